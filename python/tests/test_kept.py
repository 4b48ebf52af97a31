"""Returns that stay on the disk with a result, and pictures of them."""

from __future__ import annotations

import gc
import pickle
import subprocess
import sys
from pathlib import Path

import matplotlib
import numpy as np
import pandas
import polars
import pytest
from conftest import command

import dmp_slam as dmp

NAMES = ("truth", "drift")


@pytest.fixture(scope="module")
def kept(town, runs):
    named = {name: runs[name] for name in NAMES}
    return dmp.score(town, named, residuals=True, per_frame=True, progress=False)


def test_returns_give_the_scores(kept):
    for run in kept.data["runs"]:
        returns = kept.residuals(run["name"])
        # Those on what moved are rows, but are not scored.
        assert (returns["kind"] == 4).sum() == run["returns_left_out"]
        returns = returns[returns["kind"] != 4]
        assert len(returns) == run["returns"]
        off = returns["signed_residual_m"].astype(np.float64)
        there = np.isfinite(off)
        mean_m2 = np.minimum(off[there] ** 2, 4.0).mean()
        assert mean_m2 == pytest.approx(run["r_cv_m2"]["2"], rel=1e-5)
        assert (returns["kind"] == 0).mean() == pytest.approx(run["miss_rate"])


def test_returns_are_those_of_the_command(kept, town, runs, tmp_path):
    named = [f"--trajectory={name}={runs[name]}" for name in NAMES]
    assert command("score", town, *named, f"--residuals={tmp_path}/r.ply", "--quiet").returncode == 0
    for name in NAMES:
        bytes_ = (tmp_path / f"r.{name}.ply").read_bytes()
        assert bytes_[bytes_.index(b"end_header\n") + 11 :] == kept.residuals(name).tobytes()


def test_returns_come_scan_by_scan(kept, monkeypatch):
    returns = kept.residuals("drift")
    expected = [(number, (returns["frame"] == number).sum()) for number in np.unique(returns["frame"])]
    for block in (4099, 1 << 20):
        monkeypatch.setattr("dmp_slam._kept._BLOCK", block)
        parts = list(kept.residuals_by_frame("drift"))
        assert [(frame, len(part)) for frame, part in parts] == expected
        assert all((part["frame"] == frame).all() for frame, part in parts)
    assert pandas.DataFrame(parts[0][1]).shape == polars.DataFrame(parts[0][1]).shape == (expected[0][1], 13)


def test_one_run_needs_no_name(town, runs):
    alone = dmp.score(town, {"mine": runs["truth"]}, residuals=True, every=10, progress=False)
    assert len(alone.residuals()) == sum(alone.data["runs"][0][of] for of in ("returns", "returns_left_out"))
    assert [frame for frame, _ in alone.residuals_by_frame()] == list(range(0, 100, 10))


@pytest.mark.parametrize("names", [("a b", "a:b"), ("A", "a"), ("ü", "%")])
def test_runs_may_have_names_that_files_cannot_have(town, runs, names):
    named = {names[0]: runs["truth"], names[1]: runs["drift"]}
    found = dmp.score(town, named, residuals=True, every=20, progress=False)
    spread = [np.nanmedian(found.residuals(name)["residual_m"]) for name in names]
    assert spread[0] < spread[1]


def test_files_alone_have_their_names(town, runs):
    found = dmp.score(town, [runs["truth"], runs["drift"]], residuals=True, every=20, progress=False)
    assert len(found.residuals("drift")) and found._kept.trajectory("drift") is not None


def test_trajectories_are_those_that_were_scored(kept, town, runs, tmp_path):
    places = np.loadtxt(runs["drift"], usecols=(1, 2, 3))
    np.testing.assert_array_equal(kept._kept.trajectory("drift"), places)
    settings = {"residuals": True, "every": 20, "progress": False}
    stamped = tmp_path / "run"
    stamped.write_bytes(runs["drift"].read_bytes())
    named = {"truth": runs["truth"], "mine": stamped}
    for poses_as in ("tum", {"mine": ["tum", "stamps-s"]}):
        given = dmp.score(town, named, poses_as=poses_as, **settings)
        np.testing.assert_array_equal(given._kept.trajectory("mine"), places)
        assert given._kept.trajectory("truth") is not None
    mended = dmp.score(town, {"mine": runs["drift"]}, mend=True, **settings)
    assert mended._kept.trajectory("mine") is None


def test_runs_without_returns_are_named(kept, result):
    with pytest.raises(dmp.UsageError, match="which run\\? 'truth', 'drift'"):
        kept.residuals()
    with pytest.raises(dmp.UsageError, match="there is no run 'kiss': 'truth', 'drift'"):
        kept.residuals("kiss")
    for asked in (result.residuals, result.residuals_by_frame):
        with pytest.raises(dmp.UsageError, match="was not called with"):
            asked("truth")


def test_files_go_with_what_holds_them(town, runs, tmp_path):
    found = dmp.score(town, {"truth": runs["truth"]}, residuals=True, every=10, work=tmp_path, progress=False)
    (folder,) = tmp_path.iterdir()
    again = pickle.loads(pickle.dumps(found))
    assert again.order == ["truth"]
    with pytest.raises(dmp.UsageError, match="residuals=True"):
        again.residuals()
    returns = found.residuals()
    del again
    gc.collect()
    assert folder.exists()
    del found
    gc.collect()
    assert not folder.exists()
    # Mapped: what is gone by its name is there.
    assert np.isfinite(returns["x"]).all()


def test_nothing_is_left_of_a_score_that_fails(town, tmp_path):
    with pytest.raises(dmp.Error):
        dmp.score(town, {"truth": tmp_path / "none.tum"}, residuals=True, work=tmp_path, progress=False)
    gc.collect()
    assert list(tmp_path.iterdir()) == []


def test_a_score_that_nothing_keeps_makes_no_folder(town, runs, tmp_path):
    dmp.score(town, {"truth": runs["truth"]}, every=20, work=tmp_path, progress=False)
    assert list(tmp_path.iterdir()) == []


def test_a_plot_has_what_was_asked_for(kept, result, tmp_path):
    matplotlib.use("agg")
    # Scores alone; also over time; and pictures with their scales of colours.
    alone = dmp.Result(dmp._execute.Output(kept.to_json(), False, False), dmp._kept.Kept(None, []), None, None, None)
    assert [len(one.plot().axes) for one in (alone, result, kept)] == [1, 2, 2 + 2 * len(NAMES)]
    figure = kept.plot()
    lines = {line.get_label(): line.get_ydata() for line in figure.axes[0].get_lines()}
    squares = next(run for run in kept.data["runs"] if run["name"] == "drift")["r_cv_m2"]
    assert np.square(lines["drift"]) == pytest.approx([squares[cut] for cut in sorted(squares, key=float)])
    figure.savefig(tmp_path / "figure.png")
    assert (tmp_path / "figure.png").stat().st_size > 20_000


def test_a_view_has_trajectories_and_returns(kept, tmp_path):
    kept.view(tmp_path / "result.rrd")
    rerun = Path(sys.executable).with_name("rerun")
    subprocess.run([rerun, "rrd", "verify", tmp_path / "result.rrd"], check=True, capture_output=True)
    printed = subprocess.run(
        [rerun, "rrd", "print", tmp_path / "result.rrd"], check=True, capture_output=True, text=True
    ).stdout
    for name in NAMES:
        for what in ("trajectory", "returns", "off_m"):
            assert f"/{name}/{what}" in printed, (name, what)


def test_what_is_not_installed_is_reported(kept):
    code = (
        "import sys, pickle; sys.modules['matplotlib'] = sys.modules['rerun'] = None\n"
        "import dmp_slam as dmp; result = pickle.loads(sys.stdin.buffer.read())\n"
        "for call in (result.plot, result.view):\n"
        "    try: call()\n"
        "    except ImportError as error: print(error)"
    )
    said = subprocess.run([sys.executable, "-c", code], input=pickle.dumps(kept), capture_output=True, check=True)
    assert said.stdout.decode().splitlines() == [
        "plot needs matplotlib: pip install matplotlib",
        "view needs rerun: pip install rerun-sdk",
    ]
