"""Scans from memory keep their times and stamps, or are refused with one clear line."""

from __future__ import annotations

import collections
import os
import subprocess
import sys
import tempfile
import threading
from pathlib import Path

import numpy as np
import pytest
from conftest import scores

import dmp_slam as dmp

FEW = {"every": 10, "progress": False, "trust": True}


def read_back(scans, folder):
    """Spools scans; points with instants and stamps as the core has them."""
    log, written = folder / "read.mcap", folder / "read"
    dmp._scans.spool(scans, log)
    dmp.convert.log(log, written, to="bin", progress=False)
    stamps = next(written.rglob("times.txt")).read_text().split()
    files = sorted(written.rglob("*.f32"))
    return [(float(stamp), np.fromfile(file, np.float32)) for stamp, file in zip(stamps, files)]


def at_their_ends(found):
    """The same scans, with the ends of their sweeps as stamps."""
    for scan in found:
        times = np.rint(np.asarray(scan.times, np.float64) * 1e9).astype(np.int64)
        last = int(times.max())
        yield dmp.Scan(scan.points, times - last, int(scan.stamp * 1e9) + last)


def test_poses_of_scans_stamped_at_their_ends_hold_there(scans, poses):
    _, found = scans
    log = list(at_their_ends(found))
    matrices, _ = poses
    # Whatever these poses are: the n-th is used as that of the n-th scan.
    mine = np.repeat(matrices, -(-len(log) // len(matrices)), axis=0)[: len(log)]
    stamps = np.array([scan.stamp for scan in log])
    for pose_at in ("stamp", "start", "end"):
        stamped = dmp.score(log, {"mine": dmp.Poses(mine, stamps)}, pose_at=pose_at, **FEW)
        unstamped = dmp.score(log, {"mine": mine}, pose_at=pose_at, **FEW)
        assert unstamped.data["runs"] == stamped.data["runs"]
    # At the stamp is at the end of the sweep.
    at_stamp = dmp.score(log, {"mine": mine}, **FEW)
    assert at_stamp.data["runs"] == dmp.score(log, {"mine": mine}, pose_at="end", **FEW).data["runs"]
    assert at_stamp.data["runs"] != dmp.score(log, {"mine": mine}, pose_at="start", **FEW).data["runs"]


def test_what_did_not_come_back_moves_no_other_point(tmp_path):
    def sweeps(*holes):
        for number in range(5):
            points = np.array([[5.0, 0, 0], [0, 5, 0], [0, 0, 5], *([hole for hole in holes])])
            times = [0.01, 0.05, 0.09, *([-1.7e9, np.nan][: len(holes)])]
            yield dmp.Scan(points, times, 100 + 0.1 * number)

    whole = read_back(sweeps(), tmp_path)
    (tmp_path / "holed").mkdir()
    holed = read_back(sweeps([0, 0, 0], [np.nan, 1, 1]), tmp_path / "holed")
    assert [stamp for stamp, _ in holed] == [stamp for stamp, _ in whole]
    for (_, without), (_, times) in zip(whole, holed):
        assert times[:3].tolist() == without.tolist() and without[0] == np.float32(0.01)


class Dataset:
    """As kiss-icp has them: points and times by number."""

    def __init__(self, times, stamps=None):
        self.times, self.stamps, self.asked = times, stamps, 0
        if stamps is not None:
            self.get_frames_timestamps = self.ask

    def __len__(self):
        return 3

    def __getitem__(self, index):
        return np.array([[5.0, 0, 0], [0, 5, 0], [0, 0, 5]]), self.times

    def ask(self):
        self.asked += 1
        return self.stamps


@pytest.mark.parametrize(
    ("times", "line"),
    [
        ([0, np.nan, 1], "scan 1: time 1 is not finite: nan"),
        ([0, 0.1, np.inf], "scan 1: time 2 is not finite: inf"),
        ([0, 0.1, 1e300], r"scan 1: time 2 is 1e\+300 s, further than 2.14 s"),
        ([0, 0.1, -3.0], "scan 1: time 2 is -3.0 s, further"),
        (np.array([0, 1, 2**63], np.uint64), "scan 1: time 2 is 9223372036854775808 ns, further"),
        (np.array([0, 1, -(2**63)], np.int64), "scan 1: time 2 is -9223372036854775808 ns, further"),
    ],
)
def test_times_that_cannot_be_are_refused(times, line, tmp_path):
    good = dmp.Scan([[5.0, 0, 0], [0, 5, 0], [0, 0, 5]], [0, 0.05, 0.1], 0.0)
    with pytest.raises(dmp.InputError, match=line):
        dmp._scans.spool(iter([good, good._replace(times=times)]), tmp_path / "log.mcap")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("wrong", [np.nan, np.inf])
def test_times_of_datasets_that_cannot_be_are_refused(wrong):
    with pytest.raises(dmp.InputError, match=f"scan 0: time 1 is not finite: {wrong}"):
        list(dmp._scans.scans_of(Dataset([0, wrong, 1])))


@pytest.mark.parametrize("stamp", [2**63, -(2**63), 1e30, 2**31 * 10**9])
def test_stamps_that_cannot_be_are_refused(stamp, tmp_path):
    with pytest.raises(dmp.InputError, match="scan 0: the stamp .* is beyond 32 bits of seconds"):
        dmp._scans.spool([dmp.Scan([[5.0, 0, 0]], None, stamp)], tmp_path / "log.mcap")


def test_stamps_are_asked_for_once_and_may_be_texts():
    texts = ["1700000000.100000001", "1700000000200000002", "1700000000.3"]
    dataset = Dataset([0, 0.5, 1], texts)
    stamps = [scan.stamp for scan in dmp._scans.scans_of(dataset)]
    assert stamps == [1_700_000_000_100_000_001, 1_700_000_000_200_000_002, 1_700_000_000_300_000_000]
    assert dataset.asked == 1
    for stamps, line in [(["0", "soon", "2"], "scan 1: the stamp 'soon' is no number"), ([0.0], "scan 1: the dataset has 1 stamps")]:
        with pytest.raises(dmp.InputError, match=line):
            list(dmp._scans.scans_of(Dataset([0, 0.5, 1], stamps)))


class Recording:
    """A sequence of its own kind."""

    def __init__(self, found):
        self.found = found

    def __len__(self):
        return len(self.found)

    def __getitem__(self, index):
        return self.found[index]


def test_any_sequence_of_scans_is_a_log(scans):
    _, found = scans
    parts = collections.deque((scan.points, scan.times, scan.stamp) for scan in found)
    for log in (collections.deque(found), parts, Recording(found)):
        assert list(dmp._scans.scans_of(log)) == found


def test_an_error_that_is_kept_keeps_no_file(tmp_path):
    def broken():
        yield dmp.Scan([[5.0, 0, 0]], None, 0.0)
        raise OSError("the disk was taken out")

    with pytest.raises(OSError, match="the disk was taken out") as kept:
        dmp._scans.spool(broken(), tmp_path / "log.mcap")
    open_files = [os.readlink(link) for link in Path("/proc/self/fd").iterdir() if link.is_symlink()]
    assert kept.tb is not None
    assert not [file for file in open_files if str(tmp_path) in file] and list(tmp_path.iterdir()) == []


def test_an_event_stops_the_taking_of_scans(scans, runs, temporary):
    _, found = scans
    event, heard = threading.Event(), []

    def endless():
        while True:
            yield from found

    def progress(*step):
        heard.append(step)
        if step[2] == 7:
            event.set()

    with pytest.raises(dmp.Cancelled, match="stopped before the end"):
        dmp.score(endless(), {"truth": runs["truth"]}, progress=progress, cancel=event)
    assert heard[-1] == ("taking scans", "scans", 7, None)
    with pytest.raises(dmp.Cancelled):
        dmp.score((pytest.fail("it is cancelled") for _ in [0]), {"truth": runs["truth"]}, cancel=event)
    assert list(temporary.iterdir()) == []


def test_wrong_options_leave_a_generator_unused(scans, runs, temporary):
    _, found = scans
    log = iter(found)
    for wrong in ({"voxel": "wide"}, {"quick": True, "resume": True}):
        with pytest.raises(dmp.UsageError):
            dmp.score(log, {"truth": runs["truth"]}, **wrong)
    assert len(list(log)) == len(found)
    assert list(temporary.iterdir()) == []


def test_scans_wait_where_the_command_works(monkeypatch, tmp_path):
    monkeypatch.delenv("TMPDIR", raising=False)
    monkeypatch.setattr(tempfile, "tempdir", None)
    disk = Path("/var/tmp") if Path("/var/tmp").is_dir() else Path(tempfile.gettempdir())
    with dmp._score.work_folder({}) as folder:
        assert folder.parent == disk
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr(tempfile, "tempdir", None)
    with dmp._score.work_folder({}) as folder:
        assert folder.parent == tmp_path


FULL = """
import resource, signal, sys
import dmp_slam as dmp

signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))
scan = dmp.Scan([[k % 7 + 0.5, k % 11, k % 13] for k in range(50_000)])
for write in (
    lambda: dmp.info([scan._replace(stamp=0.1 * k) for k in range(20)]),
    lambda: dmp.convert.log(sys.argv[1], sys.argv[2] + "/log.mcap", progress=False),
):
    try:
        write()
    except dmp.Error as error:
        assert type(error) is dmp.Error and sys.argv[2] in str(error), repr(error)
    else:
        sys.exit("it was written")
"""


def test_a_full_disk_is_no_fault_of_the_input(town, tmp_path):
    known = {**os.environ, "TMPDIR": str(tmp_path)}
    done = subprocess.run([sys.executable, "-c", FULL, town, tmp_path], capture_output=True, text=True, env=known, check=False)
    assert done.returncode == 0, done.stderr
    assert list(tmp_path.iterdir()) == []


def test_errors_name_the_run_that_is_in_memory(town, poses, scans, temporary):
    matrices, _ = poses
    with pytest.raises(dmp.Error) as raised:
        dmp.truth.ape(dmp.Poses(matrices, np.zeros(len(matrices))), matrices)
    assert str(raised.value).startswith("run 'reference': ") and str(temporary) not in str(raised.value)
    with pytest.raises(dmp.Error) as raised:
        dmp.score(town, {"mine": dmp.Poses(matrices, np.zeros(len(matrices)))}, progress=False)
    assert "mine" in str(raised.value) and "dmp-python-" not in str(raised.value)
