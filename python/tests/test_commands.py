"""The other commands, maps, and the command that the package installs."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from conftest import command, scores

import dmp_slam as dmp


@pytest.fixture(scope="module")
def built(town, runs, tmp_path_factory):
    return dmp.Map.build(town, runs["truth"], tmp_path_factory.mktemp("map") / "truth.dmpmap", progress=False)


def test_commands_give_what_the_command_prints(town, runs):
    drift = runs["drift"]
    assert dmp.info(town) == json.loads(command("info", town, "--json").stdout)
    found = dmp.calibrate(town, {"drift": drift}, progress=False)
    printed = command("calibrate", town, f"--trajectory=drift={drift}", "--json")
    assert found == json.loads(printed.stdout)
    found = dmp.drift(town, {"drift": drift}, progress=False)
    printed = json.loads(command("drift", town, f"--trajectory=drift={drift}", "--json").stdout)
    assert found["runs"] == printed["runs"]
    found = dmp.truth.ape(runs["truth"], drift, align=True)
    assert found == json.loads(command("truth", "ape", "tum", runs["truth"], drift, "--align", "--json").stdout)


def test_errors_of_trajectories_in_memory_are_those_of_files(runs, poses, tmp_path):
    matrices, stamps = poses
    found = dmp.truth.ape(runs["truth"], dmp.Poses(matrices[:, :3], stamps), align=True)
    expected = dmp.truth.ape(runs["truth"], runs["truth"], align=True)
    assert found["estimate"]["poses_compared"] == expected["estimate"]["poses_compared"] == len(stamps)
    assert found["stats"]["max"] < 1e-9
    far = dmp.truth.rpe(dmp.Poses(matrices, stamps), runs["drift"], delta=1, delta_unit="m", all_pairs=True)
    printed = command("truth", "rpe", runs["truth"], runs["drift"], "--delta=1", "--delta_unit=m", "--all_pairs", "--json")
    assert far["stats"]["rmse"] == pytest.approx(json.loads(printed.stdout)["stats"]["rmse"])


def test_several_estimates_are_compared_with_one_reference(runs, poses, tmp_path):
    matrices, stamps = poses
    truth, files = runs["truth"], [runs["drift"], runs["noise"]]
    found = dmp.truth.ape(truth, *files, align=True)
    assert found == json.loads(command("truth", "ape", truth, *files, "--align", "--json").stdout)
    assert found["schema"] == "dmp-truth-runs/1"
    assert found["runs"] == [dmp.truth.ape(truth, file, align=True) for file in files]
    # By name, from memory; the stamps are in the file or beside it, or there are none.
    in_memory = {"mine": dmp.Poses(matrices, stamps), "poses": dmp.Poses(matrices, stamps), "file": files[0]}
    zipped = tmp_path / "out.zip"
    found = dmp.truth.rpe(truth, in_memory, delta=2, save_results=zipped)["runs"]
    assert [run["estimate"]["path"] for run in found] == ["mine.tum", "poses.tum", "drift.tum"]
    assert found[2] == dmp.truth.rpe(truth, files[0], delta=2)
    written = sorted(file.name for file in tmp_path.iterdir())
    assert written == ["out.drift.zip", "out.mine.zip", "out.poses.zip"]
    bare = dmp.truth.ape(matrices, {"mine": matrices, "again": matrices})["runs"]
    assert [run["estimate"]["path"] for run in bare] == ["mine.npy", "again.npy"]
    assert bare[0]["reference"]["path"] == "reference.npy" and bare[0]["stats"]["max"] == 0
    for estimates, kind, line in [
        (({"mine": truth, "other": matrices},), dmp.Error, "^run 'other' against .*the other has none"),
        (({"a/b": truth},), dmp.UsageError, "'a/b': a run's name"),
        (({"reference": truth},), dmp.UsageError, "no name of an estimate"),
        (({},), TypeError, "needs an estimate"),
        ((), TypeError, "needs an estimate"),
    ]:
        with pytest.raises(kind, match=line):
            dmp.truth.ape(truth, *estimates)


def test_samples_and_comparisons_are_those_of_the_command(town, runs, result, tmp_path):
    again = tmp_path / "result.json"
    again.write_text(result.to_json())
    joined = dmp.compare(result, again)
    assert joined["schema"] == "dmp-compare/1" and joined["order"] == result.order
    again.write_text("{}")
    with pytest.raises(dmp.InputError, match="result.json: no result of"):
        dmp.compare(result, again)
    truth = runs["truth"]
    # A short log is scored as a whole.
    short = dmp.score(town, {"truth": truth}, quick=True, progress=False)
    assert scores(short.to_json()) == scores(dmp.score(town, {"truth": truth}, progress=False).to_json())


def test_runs_scored_apart_are_judged_by_what_was_kept(town, runs, tmp_path):
    names = ("truth", "drift", "noise")
    apart = [dmp.score(town, {name: runs[name]}, keep=True, progress=False) for name in names]
    together = dmp.score(town, {name: runs[name] for name in names}, progress=False)
    joined = dmp.compare(*apart)
    assert joined["order"] == together.order and joined["not_compared"] == []
    assert joined["pairs"] == together.data["pairs"]
    kept = tmp_path / "truth.dmp"
    apart[0].keep(kept)
    assert dmp.compare(kept, apart[1])["not_compared"] == []
    with pytest.raises(dmp.UsageError, match="keep=True"):
        together.keep(tmp_path / "none.dmp")


def test_simulations_are_written(tmp_path):
    log, worse = tmp_path / "town.mcap", tmp_path / "worse.tum"
    said = dmp.simulate.town(log, scans=20, azimuth_steps=100, truth=tmp_path / "truth.tum", progress=False)
    assert "20 scans" in said and log.exists()
    assert "ATE" in dmp.simulate.errors(tmp_path / "truth.tum", worse, noise=(0.03, "0.1deg"))
    dmp.convert.trajectory(worse, tmp_path / "worse.txt", to="kitti")
    assert len((tmp_path / "worse.txt").read_text().splitlines()) == len(worse.read_text().splitlines()) - 1
    with pytest.raises(dmp.UsageError, match="take the place of the input"):
        dmp.convert.log(log, log)


def test_surfels_are_arrays(built):
    centres, normals = built.surfels()
    assert centres.shape == normals.shape == (len(built), 3)
    assert np.abs(np.linalg.norm(normals, axis=1) - 1).max() < 1e-3
    assert 0.49 < built.voxel < 0.51 and "surfels" in repr(built)


def test_rays_meet_the_surfels_that_they_aim_at(built):
    centres, normals = built.surfels()
    aimed, away = centres[::50], normals[::50].astype(float)
    # From a metre above each surfel, down onto it.
    z1, zn, zc, unasked = built.cast(aimed + away, -2 * away, np.ones(len(aimed)))
    near = np.abs(zn - 1) < 1e-3
    assert near.mean() > 0.99
    assert (z1[near] <= zn[near] + 1e-9).all() and np.isnan(zc).all() and unasked is None
    first = built.cast(aimed + away, -away)
    assert np.array_equal(first.z1, z1, equal_nan=True) and np.isnan(first.zn).all()
    fortran = built.cast(np.asfortranarray(aimed + away), (-away)[::-1][::-1])
    assert np.array_equal(fortran.z1, z1, equal_nan=True)
    sky = built.cast([[0.0, 0, 5000]], [0.0, 0, 1])
    assert np.isnan(sky.z1).all()
    nothing = built.cast([[0.0, 0, 0], [np.nan, 0, 0]], [[0.0, 0, 0], [1, 0, 0]])
    assert np.isnan(nothing.z1).all()
    of_drive = built.cast(aimed + away, -away, segments=np.full(len(aimed), -1000))
    assert np.isfinite(of_drive.zc).mean() > 0.99


def test_normals_are_those_of_the_first_surfel(built):
    centres, normals = built.surfels()
    count = len(centres)
    # Down onto every surfel, from the side that its normal is on, and from the other; then into the sky.
    away = np.concatenate([normals, -normals]).astype(float)
    origins = np.concatenate([np.tile(centres, (2, 1)) + away, np.tile([[0.0, 0, 5000]], (100, 1))])
    ways = np.concatenate([-away, np.tile([[0.0, 0, 1]], (100, 1))])
    found = built.cast(origins, ways, normals=True)
    assert found.normals.shape == (2 * count + 100, 3) and found.normals.dtype == np.float32
    missed = np.isnan(found.z1)
    assert missed[-100:].all() and np.array_equal(np.isnan(found.normals), np.tile(missed[:, None], (1, 3)))
    assert ((found.normals * ways).sum(axis=1)[~missed] <= 0).all()
    assert np.abs(np.linalg.norm(found.normals[~missed], axis=1) - 1).max() < 1e-3
    # What lies nothing before is met itself.
    itself = np.flatnonzero(np.abs(found.z1[: 2 * count] - 1) < 1e-5)
    assert len(itself) > count / 2
    assert (np.abs(found.normals[itself] - away[itself]).max(axis=1) < 1e-6).mean() > 0.999
    # All else is what it is without normals, and with any number of threads.
    plain = built.cast(origins, ways, threads=1)
    assert plain.normals is None
    assert all(np.array_equal(one, other, equal_nan=True) for one, other in zip(plain[:3], found[:3]))
    for threads, ranges in ((1, None), (2, np.ones(len(ways)))):
        again = built.cast(origins, ways, ranges, threads=threads, normals=True)
        assert np.array_equal(again.normals, found.normals, equal_nan=True)
    nothing = built.cast(np.zeros((0, 3)), np.zeros((0, 3)), normals=True)
    assert nothing.normals.shape == (0, 3) and built.cast(np.zeros((0, 3)), np.zeros((0, 3))).normals is None


def test_wrong_rays_fail_with_one_line(built, tmp_path):
    for rays, line in [
        (([[0, 0], [1, 1]], [[0, 0, 1]]), "origins: N × 3 numbers are needed, not 2 × 2"),
        (([0, 0, 0], [0, 0, 1], [1, 2]), "ranges: 1 numbers are needed"),
    ]:
        with pytest.raises(dmp.InputError, match=line):
            built.cast(*rays)
    with pytest.raises(dmp.InputError, match="nowhere.dmpmap"):
        dmp.Map.open(tmp_path / "nowhere.dmpmap")


CAST = """
import multiprocessing, sys
import numpy as np
import dmp_slam as dmp

built = dmp.Map.open(sys.argv[1])
centres, normals = built.surfels()
aimed, away = np.tile(centres, (20, 1)), np.tile(normals, (20, 1)).astype(float)

def cast(*threads):
    return built.cast(aimed + away, -away, threads=2, normals=True)

first = cast()
assert len(aimed) > 50_000
with multiprocessing.get_context("fork").Pool(1) as pool:
    again = pool.apply_async(cast).get(timeout=60)
assert all(np.array_equal(one, other, equal_nan=True) for one, other in zip(first, again))
assert np.array_equal(built.cast(aimed + away, -away, threads=1).z1, first.z1, equal_nan=True)
"""


def test_a_process_that_forked_casts_too(built):
    done = subprocess.run([sys.executable, "-c", CAST, built.path], capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    with pytest.raises(dmp.UsageError, match="threads: at least 1, not 0"):
        built.cast([0, 0, 0], [0, 0, 1], threads=0)


def test_the_command_executes_nothing_of_the_current_folder(town, tmp_path):
    for name in ("csv", "numpy", "dmp_slam"):
        (tmp_path / f"{name}.py").write_text("raise SystemExit('of the current folder')")
    program = Path(sys.executable).with_name("dmp")
    known = {name: value for name, value in os.environ.items() if not name.startswith("MALLOC_")}
    found = subprocess.run([program, "info", town, "--json"], capture_output=True, text=True, cwd=tmp_path, env=known, check=False)
    assert found.returncode == 0 and json.loads(found.stdout), found.stderr
    assert "of the current folder" not in found.stderr


def test_the_command_begins_again_before_it_imports_much():
    code = "import sys, dmp_slam_command; sys.exit(sum(name in sys.modules for name in ('numpy', 'dmp_slam')))"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_the_package_has_the_command(town):
    program = Path(sys.executable).with_name("dmp")
    found = subprocess.run([program, "info", town, "--json"], capture_output=True, text=True, check=True)
    assert found.stdout == command("info", town, "--json").stdout
    wrong = subprocess.run([program, "score"], capture_output=True, text=True, check=False)
    assert wrong.returncode == 2 and wrong.stderr == command("score").stderr


def test_every_option_is_a_keyword(town):
    """Whoever names an option finds its keyword; positions and what functions do otherwise are none."""
    from dmp_slam._arguments import options

    for words in (("score",), ("calibrate",), ("drift",), ("map", "build"), ("truth", "ape"), ("simulate", "town")):
        keywords = options(words)
        assert keywords and not {"json", "quiet", "help"} & set(keywords)
        assert all(keyword.isidentifier() for keyword in keywords)
