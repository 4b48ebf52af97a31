"""Scores are the command's, to the bit; keywords are its options."""

from __future__ import annotations

import logging
import math
import subprocess
import sys

import numpy as np
import pandas
import polars
import pyarrow
import pytest
from conftest import command, scores

import dmp_slam as dmp


@pytest.fixture(scope="module")
def alone(town, runs):
    """One run, and no outputs."""
    return dmp.score(town, {"truth": runs["truth"]}, progress=False, every=10)


def test_scores_are_those_of_the_command(town, runs, result):
    named = [f"--trajectory={name}={file}" for name, file in runs.items()]
    printed = command("score", town, *named, "--json")
    assert printed.returncode == 0
    assert scores(result.to_json()) == scores(printed.stdout)
    # As text too: numbers are written alike.
    assert [line for line in result.to_json().splitlines() if "_m2" in line] == [
        line for line in printed.stdout.splitlines() if "_m2" in line
    ]


def test_a_result_has_order_verdicts_and_gates(result):
    assert result.order[0] == result.best == "truth"
    assert result.verdict("drift", "truth") == "truth"
    said = repr(result)
    assert said.startswith("truth (revisit error 0.4 cm) is best: better than ") and "\n1  truth " in said
    assert result.gates_passed and not result.is_damaged


def test_keywords_are_the_options(town, runs):
    two = {name: runs[name] for name in ("truth", "drift")}
    given = dmp.score(
        town,
        two,
        voxel="40 cm",
        max_range=np.float32(50),
        every=2,
        trust=True,
        extrinsic={"truth": (0, 0, 0, 0, 0, 0, 1), "drift": "identity"},
        expect=["unbeaten:truth", "unbeaten:drift", "R_cv_10<1 mm"],
        segment=None,
        progress=False,
    )
    options = ["--voxel=40 cm", "--max-range=50.0", "--every=2", "--trust", "--extrinsic=truth=0,0,0,0,0,0,1"]
    options += ["--extrinsic=drift=identity"]
    options += ["--expect=unbeaten:truth", "--expect=unbeaten:drift", "--expect=R_cv_10<1 mm"]
    named = [f"--trajectory={name}={file}" for name, file in two.items()]
    printed = command("score", town, *named, *options, "--json")
    assert printed.returncode == 4
    assert scores(given.to_json()) == scores(printed.stdout)
    assert not given.gates_passed
    assert given.data["config"]["every"] == 2


def test_numbers_have_no_exponents_and_empty_lists_omit_an_option():
    from dmp_slam._arguments import arguments

    small = arguments(("score",), {"voxel": 1e-7, "max_range": 1e22, "extrinsic": (1e-9, np.float64(0), 0.5, 0, 0, 0, 1)})
    assert small == [
        "--voxel=0.0000001",
        "--max-range=10000000000000000000000",
        "--extrinsic=0.000000001,0,0.5,0,0,0,1",
    ]
    nothing = {"expect": [], "extrinsic": np.array([]), "pose_at": {}, "voxel": ()}
    assert arguments(("score",), nothing) == []
    assert arguments(("simulate", "errors"), {"noise": []}) == []


def test_unknown_keywords_are_named_with_near_ones(town, runs):
    for wrong, line in [
        ({"voxle": 0.2}, "score.* has no keyword 'voxle'; near it: voxel"),
        ({"trust": "yes"}, "trust is a switch"),
        ({"voxel": True}, "voxel takes a value"),
        ({"voxel": {"truth": 0.2}}, "voxel takes one value"),
    ]:
        with pytest.raises(TypeError, match=line):
            dmp.score(town, runs, **wrong)


def test_errors_have_the_line_of_the_command(town, runs, tmp_path):
    truth = runs["truth"]
    for arguments, settings in [
        (["--voxel=-1"], {"voxel": -1}),
        (["--voxel=wide"], {"voxel": "wide"}),
        (["--quick", "--resume"], {"quick": True, "resume": True}),
        (["--min-range=50", "--max-range=10"], {"min_range": 50, "max_range": 10}),
    ]:
        line = command("score", town, f"--trajectory=truth={truth}", *arguments, "--json").stderr
        with pytest.raises(dmp.UsageError) as raised:
            dmp.score(town, {"truth": truth}, **settings)
        assert isinstance(raised.value, ValueError) and isinstance(raised.value, dmp.Error)
        said = " ".join(line.split("\n\n")[0].split()).removeprefix("error: ")
        assert str(raised.value) == said
    garbage = tmp_path / "garbage.mcap"
    garbage.write_bytes(b"no log")
    with pytest.raises(dmp.InputError, match="garbage.mcap: "):
        dmp.score(garbage, {"truth": truth})
    with pytest.raises(dmp.UsageError, match="nowhere.mcap"):
        dmp.score(tmp_path / "nowhere.mcap", {"truth": truth})


def test_tables_have_lengths_beside_squares(result):
    runs = pandas.DataFrame.from_arrow(result.runs)
    assert list(runs["run"]) == result.order
    scored = {run["name"]: run for run in result.data["runs"]}
    for _, row in runs.iterrows():
        square = scored[row["run"]]["r_cv_m2"]["10"]
        assert row["r_cv_10_m2"] == square and row["r_cv_10_m"] == math.sqrt(square)
        assert 0 <= row["coverage"] <= 1
    pairs = pandas.DataFrame.from_arrow(result.pairs)
    assert len(pairs) == 6 and set(pairs["verdict"]) == {"truth", "noise", "mixed"}


def test_a_run_alone_has_a_table_of_pairs_without_rows(alone, result):
    pairs = pyarrow.table(alone.pairs)
    assert pairs.num_rows == 0 and pairs.schema == pyarrow.table(result.pairs).schema
    assert len(pandas.DataFrame.from_arrow(alone.pairs)) == 0
    empty = dmp._columns.csv_table("run,frame\r\n")
    assert empty.column_names == ["run", "frame"] and len(empty) == 0


def test_tables_of_scans_and_tiles_go_to_other_programs(result):
    frames = polars.DataFrame(result.frames)
    assert frames.shape[0] == 4 * result.data["sampling"]["frames_scored"]
    assert set(frames["run"]) == set(result.order)
    tiles = pyarrow.table(result.tiles)
    assert tiles.num_rows > 0 and tiles.column_names == result.tiles.column_names
    assert len(result.frames) == frames.shape[0]


def test_tables_that_were_not_asked_for_are_refused(alone):
    for table in ("frames", "tiles"):
        with pytest.raises(dmp.UsageError, match=f"per_{table[:-1]}=True"):
            getattr(alone, table)


def test_pages_are_written_and_shown(result, alone, tmp_path):
    page = tmp_path / "page.html"
    result.report(page)
    assert page.read_text().startswith("<!doctype html>") and "<svg" in page.read_text()
    assert result._repr_html_().startswith("<iframe srcdoc=")
    alone.report(page)
    assert "truth" in page.read_text()


def test_messages_go_to_the_log_and_progress_to_a_function(town, runs, caplog):
    steps = []
    with caplog.at_level(logging.INFO, logger="dmp_slam"):
        dmp.score(town, {"truth": runs["truth"]}, progress=lambda *step: steps.append(step))
    assert any("100 scans" in record.message for record in caplog.records)
    assert all(record.name == "dmp_slam" for record in caplog.records)
    assert "casting rays" in {stage for stage, _, _, _ in steps}
    assert all(done <= total for _, _, done, total in steps if total is not None)


HOSTED = """
import logging, sys
import numpy as np
import dmp_slam as dmp

logging.basicConfig(level=logging.INFO, stream=sys.stdout, format="%(message)s")
held = np.ones(1_000_000_000 // 8)
result = dmp.score(sys.argv[1], {"truth": sys.argv[2]}, memory="500 MB", threads=1, every=10, progress=False)
assert result.data["memory"]["peak_anon_bytes"] > held.nbytes
"""


def test_memory_of_the_interpreter_is_not_that_of_the_command(town, runs):
    said = subprocess.check_output([sys.executable, "-c", HOSTED, town, runs["truth"]], text=True)
    assert "scored for 1 run" in said and "memory" not in said


def test_a_bar_is_drawn_without_tqdm(town, runs, capsys):
    dmp.score(town, {"truth": runs["truth"]}, progress=True)
    drawn = capsys.readouterr().err
    assert "\rcasting rays: " in drawn and drawn.endswith("\r")


def test_files_of_one_bag_are_one_log(town, runs):
    named = {"truth": runs["truth"]}
    one = dmp.score([town], named, progress=False, every=10)
    assert one.data["inputs"]["log"] == town.name
    bag = dmp.score([town, town], named, progress=False, every=10, trust=True)
    assert bag.data["inputs"]["scans"] == 200
