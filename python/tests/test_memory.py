"""Runs and logs from memory: whatever form they have, or one clear line."""

from __future__ import annotations

import copy
import subprocess
import sys

import numpy as np
import pytest
from conftest import command, scores

import dmp_slam as dmp

FEW = {"every": 10, "progress": False, "trust": True}


def test_poses_in_memory_score_as_their_file(town, poses, tmp_path, temporary):
    matrices, stamps = poses
    np.save(tmp_path / "poses.npy", matrices)
    seconds = [f"{ns // 10**9}.{ns % 10**9:09d}\n" for ns in stamps.tolist()]
    (tmp_path / "times.txt").write_text("".join(seconds))
    printed = command("score", town, f"--trajectory=mine={tmp_path / 'poses.npy'}", "--every=10", "--trust", "--json")
    expected = scores(printed.stdout)
    wide = np.zeros((2 * len(matrices), 4, 4))
    wide[::2] = matrices
    for given in (
        matrices,
        np.asfortranarray(matrices),
        wide[::2],
        matrices[::-1].copy()[::-1],
        matrices[:, :3],
        list(matrices),
        matrices.tolist(),
    ):
        found = dmp.score(town, {"mine": dmp.Poses(given, stamps)}, **FEW)
        assert scores(found.to_json()) == expected
    assert list(temporary.iterdir()) == []


def test_stamps_are_seconds_or_nanoseconds(town, poses):
    matrices, stamps = poses
    whole = dmp.score(town, {"mine": (matrices, stamps)}, **FEW)
    decimal = dmp.score(town, {"mine": (matrices, stamps / 1e9)}, **FEW)
    assert decimal.data["inputs"]["runs"][0]["poses"] == whole.data["inputs"]["runs"][0]["poses"]
    # Float seconds of today are good to 0.2 µs.
    assert decimal.data["runs"][0]["returns"] == whole.data["runs"][0]["returns"]


try:
    from evo.core.trajectory import PosePath3D, PoseTrajectory3D
except ImportError:

    class PosePath3D:
        """What is read of evo's, where evo is not installed."""

        def __init__(self, poses_se3):
            self.poses_se3 = poses_se3
            # Not read without stamps.
            self.orientations_quat_wxyz = np.zeros((len(poses_se3), 4))

    class PoseTrajectory3D:
        """The same with stamps."""

        def __init__(self, positions_xyz, orientations_quat_wxyz, timestamps):
            self.positions_xyz, self.timestamps = positions_xyz, timestamps
            self.orientations_quat_wxyz = orientations_quat_wxyz


def test_trajectories_of_evo_score_as_their_file(town, runs, temporary):
    lines = [line.split() for line in runs["truth"].read_text().splitlines()[1:]]
    numbers = np.array([[float(cell) for cell in line] for line in lines])
    evo = PoseTrajectory3D(numbers[:, 1:4], numbers[:, [7, 4, 5, 6]], numbers[:, 0])
    from_file = dmp.score(town, {"truth": runs["truth"]}, **FEW)
    from_memory = dmp.score(town, {"truth": evo}, **FEW)
    assert from_memory.data["runs"] == from_file.data["runs"]
    matrices = np.tile(np.eye(4), (100, 1, 1))
    path = dmp.score(town, {"path": PosePath3D(poses_se3=list(matrices))}, **FEW)
    assert path.data["runs"] == dmp.score(town, {"path": matrices}, **FEW).data["runs"]
    assert list(temporary.iterdir()) == []


def spoiled(array, *index):
    array = array.copy()
    array[index] = np.nan
    return array


def test_wrong_poses_fail_with_one_line(town, poses, temporary):
    matrices, stamps = poses
    for run, line in [
        (matrices[0], "poses are N × 4 × 4 or N × 3 × 4, not 4 × 4"),
        (matrices[:, :, :3], "not .* × 4 × 3"),
        (matrices[:0], "not 0 × 4 × 4"),
        (spoiled(matrices, 7, 0, 3), "pose 7 is not finite"),
        ((matrices, stamps[:-1]), f"{len(stamps)} stamps are needed"),
        ((matrices, spoiled(stamps / 1e9, 3)), "stamp 3 is not finite"),
        ((matrices, stamps.astype(str)), "stamps are seconds"),
        ([[1, 2], [3]], "not a list of poses"),
        ("no such.tum", "no such.tum"),
    ]:
        with pytest.raises((dmp.InputError, dmp.UsageError), match=line):
            dmp.score(town, {"mine": run})
    for name in ("a=b", "", "a/b", 7):
        with pytest.raises(dmp.UsageError, match="a run's name"):
            dmp.score(town, {name: matrices})
    assert list(temporary.iterdir()) == []


def test_scans_in_memory_score_as_their_log(scans, runs, tmp_path, temporary):
    folder, found = scans
    named = {"truth": runs["truth"]}
    log = tmp_path / "log.mcap"
    dmp.convert.log(folder, log, progress=False)
    expected = scores(dmp.score(log, named, **FEW).to_json())["runs"]

    def unusual(scan):
        """The same with negative strides, as Fortran orders it, and in double precision."""
        points = np.asfortranarray(np.asarray(scan.points, np.float64))
        return dmp.Scan(points[::-1], np.asarray(scan.times)[::-1].astype(np.float64), scan.stamp)

    for log in (found, iter(found), (unusual(scan) for scan in found)):
        assert scores(dmp.score(log, named, **FEW).to_json())["runs"] == expected
    assert list(temporary.iterdir()) == []


class Kiss:
    """A dataset as kiss-icp has them, of a bag: in order, stamps of what was read."""

    def __init__(self, scans):
        self.scans, self.timestamps = scans, ["of an earlier pass"]

    def __len__(self):
        return len(self.scans)

    def __getitem__(self, index):
        assert index == len(self.timestamps)
        points, times, stamp = self.scans[index]
        self.timestamps.append(stamp)
        return np.asarray(points, np.float64), np.asarray(times, np.float64)

    def reset(self):
        self.timestamps = []

    def get_frames_timestamps(self):
        return self.timestamps


def test_datasets_of_kiss_icp_are_read(runs, temporary):
    span = 100_000_000
    scans = [
        ([[5, 0, 0], [0, 5, 0], [0, 0, 5]], times, 1_700_000_000.5 + 0.1 * number)
        for number, times in enumerate(([0, 0.5, 1], [40, 30, 20], []))
    ]
    written = list(dmp._scans.scans_of(Kiss(scans)))
    stamps = [1_700_000_000_500_000_000 + number * span for number in range(3)]
    assert [abs(scan.stamp - stamp) < 1000 for scan, stamp in zip(written, stamps)] == [True] * 3
    assert np.abs(written[0].times - [0, span // 2, span]).max() < 1000
    assert np.abs(written[1].times - [span, span // 2, 0]).max() < 1000
    assert written[2].times is None


def test_a_gap_is_no_part_of_the_scan_before_it():
    sweep = ([[5, 0, 0], [0, 5, 0]], [0, 1])
    # Two scans a second; one is missing before the last two, which have one stamp.
    scans = [(*sweep, stamp) for stamp in (0.0, 0.5, 1.0, 2.0, 2.0)]
    ends = [int(scan.times[-1]) for scan in dmp._scans.scans_of(Kiss(scans))]
    assert ends == [500_000_000] * 5


def test_datasets_without_stamps_pair_by_number(scans, poses):
    _, found = scans

    class Plain:
        def __len__(self):
            return 20

        def __getitem__(self, index):
            return np.asarray(found[index].points, np.float64), np.array([])

    matrices, _ = poses
    scored = dmp.score(Plain(), {"kiss": matrices[:20]}, trust=True, progress=False)
    assert scored.data["inputs"]["scans"] == 20
    assert scored.data["inputs"]["runs"][0]["poses"] == 20


def test_datasets_of_evalio_are_read():
    class Stamp:
        def __init__(self, ns):
            self.ns = ns

        def to_nsec(self):
            return self.ns

    class Point:
        def __init__(self, ns):
            self.t = Stamp(ns)

    class Measurement:
        stamp = Stamp(17)
        points = [Point(0), Point(25)]

        def to_vec_positions(self):
            return [np.array([1.0, 2, 3]), np.array([4.0, 5, 6])]

    class Dataset(str):
        """Its names are those of an enumeration of texts."""

        def lidar(self):
            yield Measurement()

    with pytest.raises(dmp.Error):
        # One scan is no log to be scored, but it is read.
        dmp.score(Dataset("basement"), {"mine": np.eye(4)[None]}, progress=False)
    (scan,) = dmp._scans.scans_of(Dataset("basement"))
    assert scan.stamp == 17 and scan.times.tolist() == [0, 25]
    assert np.asarray(scan.points).tolist() == [[1, 2, 3], [4, 5, 6]]


def test_wrong_scans_fail_with_one_line(scans, runs, temporary):
    _, found = scans
    good = found[0]
    count = len(good.points)
    named = {"truth": runs["truth"]}
    for scan, line in [
        (good._replace(points=np.zeros((count, 4))), f"scan 1: points are N × 3 numbers, not {count} × 4"),
        (good._replace(points=np.zeros(count)), "scan 1: points are N × 3"),
        (good._replace(points=np.full((count, 3), "x")), "scan 1: points are N × 3"),
        (good._replace(points=np.zeros((count, 3), complex)), "scan 1: .* of complex128"),
        (good._replace(times=good.times[:-1]), f"scan 1: {count} points have {count} times"),
        (good._replace(times=spoiled(np.asarray(good.times), 2)), "scan 1: time 2 is not finite"),
        (good._replace(stamp=float("nan")), "scan 1: the stamp is"),
        (good._replace(stamp="now"), "scan 1: the stamp is"),
        (good._replace(times=None), "scan|frame"),
        ("a scan", "scan 1: a dmp.Scan is needed, not str"),
    ]:
        with pytest.raises(dmp.InputError, match=line):
            dmp.score(iter([good, scan]), named, progress=False)
    with pytest.raises(dmp.InputError, match="the log has no scans"):
        dmp.score(iter([]), named)
    with pytest.raises(TypeError, match="a log is a path, a dataset or scans, not int"):
        dmp.score(7, named)
    assert list(temporary.iterdir()) == []


def test_points_that_did_not_return_are_kept_and_dropped(scans, runs):
    _, found = scans
    holed = copy.copy(found)
    points = np.array(found[0].points)
    points[:50] = np.nan
    holed[0] = found[0]._replace(points=points)
    named = {"truth": runs["truth"]}
    dropped = dmp.score(holed, named, **{**FEW, "every": 1}).data["inputs"]["dropped"]
    assert dropped["non_finite"] == 50


def test_what_is_in_memory_waits_in_the_work_folder(scans, runs, tmp_path, temporary):
    _, found = scans
    seen = []

    def watched():
        yield from found[:20]
        seen.extend(tmp_path.glob("dmp-python-*/*"))
        yield from found[20:]

    dmp.score(watched(), {"truth": runs["truth"]}, work=tmp_path, **FEW)
    assert seen and not list(tmp_path.glob("dmp-python-*"))
    assert list(temporary.iterdir()) == []


def test_a_generator_that_raises_leaves_nothing(scans, runs, temporary):
    _, found = scans

    def broken():
        yield from found[:5]
        raise OSError("the disk was taken out")

    with pytest.raises(OSError, match="the disk was taken out"):
        dmp.score(broken(), {"truth": runs["truth"]})
    assert list(temporary.iterdir()) == []


SPOOLING = """
import resource, sys
import numpy as np
from dmp_slam import Scan, _scans

points, times = np.random.default_rng(1).uniform(-20, 20, (20_000, 3)), np.linspace(0, 0.09, 20_000)
for count in (20, 200):
    _scans.spool((Scan(points + k, times, k * 0.1) for k in range(count)), sys.argv[1])
    print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""


def test_memory_does_not_grow_with_the_log(tmp_path):
    log = tmp_path / "log.mcap"
    printed = subprocess.check_output([sys.executable, "-c", SPOOLING, log], text=True)
    few_kib, many_kib = map(int, printed.split())
    assert log.stat().st_size > 30_000_000
    assert many_kib - few_kib < 10_000
