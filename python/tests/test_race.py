"""Races: systems in processes of their own, one answer, and a row with a reason for each that fails."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
from conftest import SAMPLES, scores

import dmp_slam as dmp
from dmp_slam._race import process, worker
from dmp_slam._race.field import entries
from dmp_slam._race.grid import Grid, records
from dmp_slam._race.system import DRIVERS, load
from dmp_slam._race.tune import candidates

#: A driver as a stranger writes it: it replays a trajectory, or misbehaves.
DRIVER = '''
import os, signal, time
import numpy as np
import dmp_slam as dmp

TRUTH = {int(line.split()[0].replace(".", "")): np.array(line.split()[1:], float) for line in open(%r) if line[0] != "#"}


def pose(row, noise, random):
    x, y, z, w = row[3:]
    turn = [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)], [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]
    return np.column_stack([turn, row[:3] + noise * random.standard_normal(3)])


def run(scans, given):
    random = np.random.default_rng(None if given["chance"] else 1)
    for number, scan in enumerate(scans):
        if number == 3:
            misbehave(given["does"])
        found = pose(TRUTH[scan.stamp], given["noise"], random)
        yield scan.stamp, found * np.nan if given["does"] == "nonsense" and number == 5 else found


def misbehave(how):
    if how == "dies":
        os.kill(os.getpid(), signal.SIGSEGV)
    if how == "hangs":
        time.sleep(1000)
    if how == "hungers":
        full = [np.ones(10_000_000) for _ in range(100)]
    if how == "raises":
        raise ValueError("no features")


def system(does="", noise=0.0, chance=False):
    return dmp.System(run, {"does": does, "noise": noise, "chance": chance, "unused": 1.5}, "1.0", "start")


def systems():
    bad = {how: system(how) for how in ("dies", "hangs", "hungers", "raises", "nonsense")}
    return {"exact": system(), "noisy": system(noise=0.1), "lucky": system(noise=0.1, chance=True), "poor": system(noise=0.5), **bad}
'''
#: Few returns and no pictures.
FEW = {"every": 4}
SCHEMA = jsonschema.Draft202012Validator(json.loads((SAMPLES.parent / "docs/schema.json").read_text(encoding="utf-8")))


def race_of(*asked: Any, **settings: Any) -> dmp.Race:
    """A race whose JSON is as the schema says."""
    race = dmp.race(*asked, score=FEW, progress=False, **settings)
    SCHEMA.validate(json.loads(race.to_json()))
    return race


@pytest.fixture(scope="module")
def driver(tmp_path_factory: pytest.TempPathFactory) -> str:
    file = tmp_path_factory.mktemp("driver") / "mine.py"
    file.write_text(DRIVER % str(SAMPLES / "truth.tum"))
    return str(file)


@pytest.fixture(scope="module")
def good(town: Path, driver: str) -> dmp.Race:
    return race_of(town, [f"{driver}:exact", f"{driver}:noisy"])


def test_the_better_map_wins_and_everything_is_recorded(town, driver, good):
    assert good.best == "exact" and good.order == ["exact", "noisy"] and not good.is_damaged and good.failed == {}
    again = dmp.score(town, {name: good.trajectory(name) for name in ("exact", "noisy")}, progress=False, **FEW)
    assert scores(again.to_json())["pairs"] == good.data["score"]["pairs"]
    exact, noisy = good.data["runs"]
    assert (exact["version"], exact["driver"], exact["pose_at"]) == ("1.0", driver, "start")
    assert noisy["parameters"] == {"does": "", "noise": 0.1, "chance": False, "unused": 1.5}
    assert 0 < exact["run_s"] < exact["wall_s"] and 10e6 < exact["peak_memory_bytes"] < 1e9
    assert json.loads((good.folder / "race.json").read_text())["runs"] == good.data["runs"]
    assert "exact" in (good.folder / "page.html").read_text(encoding="utf-8")
    assert repr(good).startswith("exact is better than noisy.") and "  1.0" in repr(good)
    # A race can be run again by what its result says.
    second = dmp.race(town, **good.data["asked"], progress=False)
    assert second.data["score"]["runs"] == good.data["score"]["runs"]


def test_a_system_that_fails_is_a_row_and_changes_no_number(town, driver, good, tmp_path):
    commands = {"absent": "/nowhere/slam {log} {out}", "empty": "true {out}", "text": "echo hello > {out}"}
    far = "awk '{{$2 = NR * 1e6; print}}' " + str(good.trajectory("exact")) + " > {out}"
    systems = {"hangs": f"{driver}:hangs", "exact": f"{driver}:exact", "dies": f"{driver}:dies", **commands, "flies": far}
    systems |= {name: f"{driver}:{name}" for name in ("hungers", "raises", "nonsense", "noisy")}
    race = race_of(town, systems, minutes=0.4, memory="400 MB", out=tmp_path / "out")
    assert race.is_damaged and race.order == ["exact", "noisy"] and set(race.failed) == set(systems) - {"exact", "noisy"}
    for name, reason in {
        "hangs": "did not end within 24 s",
        "dies": "was killed by SIGSEGV",
        "hungers": "used more than 400 MB of memory",
        "raises": "ended with exit code 1: ValueError: no features",
        "nonsense": "pose 5 is not finite",
        "absent": "ended with exit code 127: ",
        "empty": "wrote no trajectory: ",
        "text": "wrote no trajectory: ",
        "flies": "moved at ",
    }.items():
        assert reason in race.failed[name], (name, race.failed[name])
        assert f"{race.failed[name]}" in repr(race)
        with pytest.raises(KeyError):
            race.trajectory(name)
    for name in ("exact", "noisy"):
        assert race.trajectory(name).read_bytes() == good.trajectory(name).read_bytes()
    for part in ("runs", "pairs", "order", "drift"):
        assert race.data["score"][part] == good.data["score"][part], part


def test_the_best_run_is_repaired(town, driver):
    race = race_of(town, [f"{driver}:noisy"], repair=True)
    repair = race.data["repair"]
    assert repair["run"] == "noisy" and repair["failed"] is None and repair["report"]["schema"] == "dmp-repair/1"


def test_mistakes_in_a_driver_are_named(tmp_path):
    eye = np.eye(4)
    right = [(np.int64(5), eye), [6, eye[:3].tolist()]]
    assert [stamp_ns for stamp_ns, _ in worker.checked(right)] == [5, 6]
    for given, words in [
        (1.5, "pose 0: run() gave float, not a pair"),
        ((1.7e9, eye), "float in the place of the stamp: first scan.stamp, whole nanoseconds"),
        ((eye, 5), "ndarray in the place of the stamp"),
        ((5, np.eye(3)), "the shape is (3, 3): world_from_sensor is 4 × 4 or 3 × 4"),
    ]:
        with pytest.raises(dmp.Error, match=re.escape(words)):
            list(worker.checked([given]))
    file = tmp_path / "driver.py"
    for text, words in [("import dmp_slam\ndef systems(:\n", "driver.py: line 2: "), ("systems = 1\n", "it has no function systems()")]:
        file.write_text(text)
        with pytest.raises(dmp.Error, match=re.escape(words)):
            load(str(file))


def test_memory_is_that_of_the_process_and_its_children(tmp_path):
    here = np.ones(40_000_000)
    limits = process.Limits(60.0, 10**9)
    allocate = "import time; held = bytearray(100_000_000); time.sleep(0.5)"
    small = process.run([sys.executable, "-c", "import time; time.sleep(0.3)"], tmp_path / "small", limits)
    both = f"{sys.executable} -c '{allocate}' & {sys.executable} -c '{allocate}'; wait"
    large = process.run(["/bin/sh", "-c", both], tmp_path / "large", limits)
    assert here.nbytes > 300e6 and 2e6 < small.peak_memory_bytes < 60e6 and 200e6 < large.peak_memory_bytes < 300e6
    assert small.failed is None and large.failed is None and large.wall_s > 0.5


def test_nothing_of_a_system_is_left_running(town, driver, tmp_path):
    mark = str(tmp_path / "mark")
    systems = {"forks": f"(sleep 1000; touch {mark}) & sleep 1000; echo {{out}}"}
    race = race_of(town, systems, minutes=0.02)
    assert race.failed == {"forks": "did not end within 1 s"} and race.best is None and race.order == []
    left = [Path(f"/proc/{entry.name}/cmdline") for entry in Path("/proc").iterdir() if entry.name.isdigit()]
    assert not [file for file in left if file.exists() and mark.encode() in file.read_bytes()]
    assert "no run has a score" in repr(race)


def test_the_command(town, driver, tmp_path):
    call = [sys.executable, "-m", "dmp_slam", "race", town, "-s", f"{driver}:exact", "-s", f"bad={driver}:raises", "--score", "every=4"]
    done = subprocess.run([*call, "-o", tmp_path / "out"], capture_output=True, text=True, check=False)
    assert done.returncode == 3, done.stderr
    assert "ended with exit code 1: ValueError: no features" in done.stdout
    assert {"race.json", "page.html", "exact.tum", "exact.log", "bad.log"} <= {file.name for file in (tmp_path / "out").iterdir()}
    # Nothing is overwritten.
    done = subprocess.run([*call, "-o", tmp_path / "out"], capture_output=True, text=True, check=False)
    assert done.returncode == 2 and "there is something already" in done.stderr


def test_settings_are_a_grid_and_wrong_ones_are_refused(driver):
    found = entries([f"{driver}:noisy"], {"noisy": {"noise": [0.01, 1], "unused": 2}})
    assert [entry.name for entry in found] == ["noisy-0.01", "noisy-1.0"]
    assert found[1].parameters == {"does": "", "noise": 1.0, "chance": False, "unused": 2.0}
    # Tuned without settings, each decimal and switch is varied by itself.
    names = [entry.name for entry in candidates(*entries([f"{driver}:noisy"], {}), {})]
    decimals = ["noise-0.05", "noise-0.2", "chance", "unused-0.75", "unused-3.0"]
    assert names == [f"noisy-{word}" for word in decimals]
    for settings, line in [
        ({"noisy": {"nose": 1}}, "noisy has no parameter 'nose'; it has chance, does, noise, unused"),
        ({"noisy": {"noise": "much"}}, "noisy: noise is a float as 0.1, not 'much'"),
        ({"kiss": {"voxel_size": 1}}, "settings of 'kiss': it is none of the systems: noisy"),
    ]:
        with pytest.raises(dmp.UsageError, match=line):
            entries([f"{driver}:noisy"], settings)
    for systems, line in [([f"{driver}:none"], "has no system 'none'"), (["cmd {out}"], "a command needs a name")]:
        with pytest.raises(dmp.UsageError, match=line):
            entries(systems, {})


def test_tuning_is_judged_on_scans_that_took_no_part(town, driver):
    settings = {"poor": {"noise": [0.0, 0.5, 1.0, 2.0]}}
    race = race_of(town, [f"{driver}:poor"], tune="poor", settings=settings)
    tune = race.data["tune"]
    assert [round["scans"] for round in tune["rounds"]] == [15, 30, 60] and tune["on_rest"]["scans"] == 40
    assert len(tune["rounds"][0]["order"]) == 4 and len(tune["rounds"][2]["order"]) == 2
    assert tune["better"] == "poor-noise-0.0" == race.best and tune["on_rest"]["better_by_m"] > 0
    assert "noise 0.0 instead of 0.5; chosen on the first 60 % of the log, where it is" in repr(race)
    # A parameter without effect.
    same = race_of(town, [f"{driver}:exact"], tune="exact", settings={"exact": {"unused": [3.0]}})
    assert same.data["tune"]["better"] is None and "better than the default" in repr(same)
    with pytest.raises(dmp.UsageError, match="tune='kiss': it is none of the systems: exact"):
        dmp.race(town, [f"{driver}:exact"], tune="kiss")


def test_repeats_show_the_scatter_of_a_version(town, driver):
    race = race_of(town, [f"{driver}:exact", f"{driver}:lucky"], repeats=3)
    exact, lucky = race.data["scatter"]
    assert (exact["different"], exact["apart_m"]) == (1, 0.0) and (lucky["different"], lucky["pairs"]) == (3, 3)
    assert 0.01 < lucky["apart_m"] < 2
    assert [row["same_as"] for row in race.data["runs"][:3]] == [None, "exact-run1", "exact-run1"]
    assert "exact: 3 runs gave the same poses, bit by bit" in repr(race)


def test_rows_and_columns_are_found(scans):
    _, found = scans
    scan = found[0]
    grid = Grid.of(scan)
    # The town is simulated with these.
    assert (grid.rows, grid.columns) == (16, 240)
    organised = records(scan, grid)
    filled = organised[(organised["x"] != 0) | (organised["y"] != 0)]
    assert len(organised) == grid.rows * grid.columns and len(filled) > 0.98 * len(scan.points)
    for row in range(grid.rows):
        of_row = filled[filled["row"] == row]
        elevation = np.arctan2(of_row["z"], np.hypot(of_row["x"], of_row["y"]))
        assert np.ptp(elevation) < np.radians(0.2)
    with pytest.raises(dmp.InputError, match="takes rows of beams"):
        Grid.of(dmp.Scan(np.random.default_rng(1).standard_normal((5000, 3))))


def test_drivers_are_short():
    lengths = {file.name: len(file.read_text().splitlines()) for file in DRIVERS.glob("*.py")}
    assert lengths and all(length <= 60 for length in lengths.values()), lengths


@pytest.mark.parametrize("name", ["kiss", "loam"])
def test_systems_of_evalio(town, name):
    pytest.importorskip("evalio")
    race: Any = race_of(town, [name])
    assert race.failed == {} and race.order == [name]
    (row,) = race.data["runs"]
    assert "evalio" in row["version"] and row["parameters"]["min_range"] == 1.5 and row["pose_at"] == "middle"
    assert len(race.trajectory(name).read_text().splitlines()) >= 100


def test_deskewing_needs_times(scans):
    pytest.importorskip("evalio")
    race = race_of([dmp.Scan(scan.points) for scan in scans[1][:3]], ["kiss"], settings={"kiss": {"deskew": True}})
    assert "deskew takes the time of each point, and this log has none" in race.failed["kiss"]
