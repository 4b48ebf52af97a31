"""Scores in parts on a real cluster, over a real server of S3, are those of one process, whatever happens on the way."""

from __future__ import annotations

import json
import logging
import os
import pickle
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import distributed
import fsspec
import pytest
from cluster import Bucket, Full, Killer, Marked, Measured, compared, hooked, left

import dmp_slam as dmp
import dmp_slam.dask
from dmp_slam._shards.cache import Cache, Want

#: Less work where it is not about what is found.
FEW = {"every": 4, "drift": "none", "trust": True, "progress": False}
ENDS = 128 << 10


@pytest.fixture(scope="module")
def two(runs):
    return {name: runs[name] for name in ("truth", "drift")}


@pytest.fixture(scope="module")
def whole(town, two):
    return compared(dmp.score(town, two, progress=False))


@pytest.fixture(scope="module")
def few(town, two):
    return compared(dmp.score(town, two, **FEW))


def bag_of(files: list[Path], folder: Path) -> Path:
    """A log in several files."""
    folder.mkdir()
    names = [f"part-{number}.mcap" for number in range(len(files))]
    for name, file in zip(names, files):
        (folder / name).symlink_to(file)
    lines = ["rosbag2_bagfile_information:", "  version: 5", "  storage_identifier: mcap"]
    lines += ["  relative_file_paths:", *(f"    - {name}" for name in names), ""]
    (folder / "metadata.yaml").write_text("\n".join(lines))
    return folder


def uploaded(folder: Path, bucket: Bucket) -> str:
    """A folder in the bucket."""
    system = fsspec.filesystem("s3", **bucket.options)
    for file in folder.rglob("*"):
        if file.is_file():
            system.put_file(str(file), f"drives/{folder.name}/{file.relative_to(folder)}")
    return f"s3://drives/{folder.name}"


def remote(bucket: Bucket, log: str = "s3://drives/town.mcap", **settings: Any) -> dmp.Result:
    runs = {name: f"s3://drives/{name}.tum" for name in ("truth", "drift")}
    given = {"work": "s3://drives/work", "storage_options": bucket.options, **FEW, **settings}
    return dmp.dask.score(log, runs, **given)


@pytest.fixture(params=[1, 3, 7])
def case(request, few):
    """Parts, how they are scored, and what comes of it: all scans and drift once, else fewer."""
    if request.param == 3:
        return 3, {"progress": False}, request.getfixturevalue("whole")
    return request.param, FEW, few


def test_local_parts_are_the_whole(client, town, two, temporary, case):
    parts, given, expected = case
    assert compared(dmp.dask.score(town, two, client=client, parts=parts, **given)) == expected
    assert list(temporary.iterdir()) == []
    assert not any(client.run(left).values())


def test_parts_over_s3_are_the_whole(client, bucket, case):
    parts, given, expected = case
    every_one = {"every": None, "drift": None, "trust": False, **given}
    assert compared(remote(bucket, client=client, parts=parts, **every_one)) == expected
    assert not any(client.run(left).values())


def test_little_more_is_fetched_of_the_log_than_its_parts(client, bucket, town, few, caplog):
    size = town.stat().st_size
    with caplog.at_level(logging.INFO, logger="dmp_slam"):
        found = remote(bucket, client=client, parts={"fuse": 7, "cast": 5}, every=None)
    # The plan reads all of it; a part its share and the ends. Casting follows every second scan of so short a log, to see what moved.
    assert bucket.sent("/town.mcap") <= size + 2 * 1.1 * size + 5 * 0.5 * size + (7 + 5 + 1) * ENDS
    fused = next(record.message for record in caplog.records if record.message.startswith("fuse: 7 parts"))
    assert 0.9 * size <= int(fused.split()[3]) <= 1.1 * size + 7 * ENDS
    assert found.order == few["order"]


@pytest.mark.parametrize("stage", ["fuse", "cast"])
def test_a_worker_that_dies_is_no_loss(client, town, two, few, tmp_path, stage):
    marker = tmp_path / "died"
    before = set(client.scheduler_info()["workers"])
    with hooked(client, Killer(stage, marker)):
        found = dmp.dask.score(town, two, client=client, parts=3, **FEW)
    assert marker.exists() and set(client.scheduler_info()["workers"]) != before
    assert compared(found) == few


def test_a_worker_that_dies_over_s3_is_no_loss(client, bucket, few, tmp_path):
    marker = tmp_path / "died"
    with hooked(client, Killer("merge", marker)):
        found = remote(bucket, client=client, parts=3)
    assert marker.exists() and compared(found) == few


def test_two_jobs_do_not_disturb_each_other(client, town, two, few):
    def score(voxel):
        return compared(dmp.dask.score(town, two, client=client, parts=3, voxel=voxel, **FEW))

    with ThreadPoolExecutor(2) as threads:
        other, same = threads.map(score, [0.4, None])
    assert same == few
    assert other == compared(dmp.score(town, two, voxel=0.4, **FEW))


def test_requests_that_fail_are_made_again(client, bucket, few):
    bucket.fails_every, bucket.rest_s = 7, 0.01
    found = remote(bucket, client=client, parts=3)
    assert bucket.failed > 5
    assert compared(found) == few


def test_a_job_goes_on_from_what_is_there(client, town, two, few, tmp_path, caplog):
    given = {"client": client, "parts": 3, "work": tmp_path / "work", **FEW}
    assert compared(dmp.dask.score(town, two, **given)) == few
    (tmp_path / "work" / "cast-2-of-3.part").unlink()
    with caplog.at_level(logging.INFO, logger="dmp_slam"):
        assert compared(dmp.dask.score(town, two, **given)) == few
    heard = [record.message for record in caplog.records]
    assert any(line.startswith("fuse: 3 parts, 3 of them done before") for line in heard)
    assert any(line.startswith("cast: 3 parts, 2 of them done before") for line in heard)
    with pytest.raises(dmp.UsageError, match="it holds another plan, .*: name another folder"):
        dmp.dask.score(town, two, voxel=0.4, retries=0, **given)


@pytest.mark.parametrize("harm", ["cut", "flipped"])
def test_files_that_were_harmed_are_named(client, bucket, tmp_path, harm):
    given = {"client": client, "parts": 2, "retries": 0}
    remote(bucket, **given)
    system = fsspec.filesystem("s3", **bucket.options)
    system.invalidate_cache()
    harmed = next(name for name in system.ls("drives/work", detail=False) if name.endswith(".drift.sums"))
    content = bytearray(system.cat_file(harmed))
    if harm == "cut":
        del content[len(content) // 2 :]
    else:
        content[len(content) // 2] ^= 4
    system.pipe_file(harmed, bytes(content))
    for name in system.ls("drives/work", detail=False):
        if "/merge-" in name and name.endswith(".part"):
            system.rm_file(name)
    with pytest.raises(dmp.Error, match=f"s3://{harmed}") as raised:
        remote(bucket, **given)
    assert "dmp-parts" not in str(raised.value)
    assert not any(client.run(left).values())


@pytest.mark.parametrize("where", ["here", "s3"])
@pytest.mark.parametrize("stage", ["fuse", "cast"])
def test_a_job_that_is_cancelled_stops_soon(client, bucket, town, two, tmp_path, temporary, stage, where):
    marker = tmp_path / "amid"

    class AmidAPart:
        def is_set(self) -> bool:
            return marker.exists()

    here, there = tmp_path / "work", "s3://drives/work"
    log = bag_of([town] * 16, tmp_path / "long")
    given = {"client": client, "cancel": AmidAPart(), "parts": 1, "every": None}
    with hooked(client, Marked(stage, marker)):
        with pytest.raises(dmp.Cancelled, match="stopped before the end"):
            if where == "s3":
                remote(bucket, log=uploaded(log, bucket), **given)
            else:
                dmp.dask.score(log, two, **{**FEW, **given}, work=here)
        took_s = time.time() - marker.stat().st_mtime
        running, kept = client.processing(), client.run(left)
        work = fsspec.filesystem("s3", **bucket.options).ls(there, detail=False) if where == "s3" else here.iterdir()
        names = [str(name).rsplit("/", 1)[-1] for name in work]
    assert took_s < 10 and not any(running.values()) and not any(kept.values())
    # None was done, and none of what was begun is there.
    assert "plan.json" in names
    assert [name for name in names if name.startswith((stage, "."))] == []
    assert list(temporary.iterdir()) == []


def test_errors_keep_their_class_and_line(client, town, two, tmp_path):
    garbage = tmp_path / "garbage.mcap"
    garbage.write_bytes(b"no log")
    for log, given in [(garbage, {}), (tmp_path / "none.mcap", {}), (town, {"voxel": "wide"}), (town, {"quick": True})]:
        with pytest.raises(dmp.Error) as raised:
            dmp.dask.score(log, two, client=client, retries=0, **{**FEW, **given})
        if "quick" in given:
            assert isinstance(raised.value, dmp.UsageError) and "in parts" in str(raised.value)
            continue
        with pytest.raises(dmp.Error) as expected:
            dmp.score(log, two, **{**FEW, **given})
        assert (type(raised.value), str(raised.value)) == (type(expected.value), str(expected.value))
    for kind in (dmp.UsageError, dmp.InputError, dmp.Cancelled, dmp.Error):
        again = pickle.loads(pickle.dumps(kind("a line")))
        assert (type(again), str(again)) == (kind, "a line")


def test_keywords_that_parts_do_not_have_are_refused(client, town, two):
    given = {"client": client, "retries": 0, **FEW}
    for log, asked, kind, line in [
        (town, {"report": True}, dmp.UsageError, "--report in parts: .*use `dmp score`"),
        (town, {"scene": "scene.mcap"}, dmp.UsageError, "--scene in parts: .*use `dmp score`"),
        (town, {"quick": True}, dmp.UsageError, "--quick in parts: .*use `dmp score`"),
        (town, {"reference": "truth"}, dmp.UsageError, "--reference"),
        (town, {"voxle": 0.2}, TypeError, "score.* has no keyword 'voxle'; near it: voxel"),
        (town, {"parts": {"fuze": 3}}, dmp.UsageError, "parts of 'fuze': 3"),
        ([dmp.Scan([[1.0, 2.0, 3.0]])], {}, dmp.UsageError, "a path or a URL"),
        # Before anything long begins.
        (town, {"expect": "best:nobody"}, dmp.UsageError, "nobody"),
    ]:
        with pytest.raises(kind, match=line):
            dmp.dask.score(log, two, **given, **asked)


def test_gates_and_runs_in_memory_are_those_of_a_score(client, town, runs, poses, tmp_path):
    matrices, stamps = poses
    mixed = {"mine": dmp.Poses(matrices, stamps), "drift": runs["drift"]}
    given = {"expect": "best:drift", "junit": tmp_path / "gates.xml", **FEW}
    found = dmp.dask.score(town, mixed, client=client, parts=2, **given)
    assert compared(found) == compared(dmp.score(town, mixed, **{**given, "junit": None}))
    assert not found.gates_passed and "<failure" in (tmp_path / "gates.xml").read_text()


@pytest.mark.parametrize("there", ["log", "work"])
def test_one_of_log_and_work_may_be_here(client, bucket, town, two, few, tmp_path, there):
    log = "s3://drives/town.mcap" if there == "log" else town
    work = "s3://drives/mixed" if there == "work" else tmp_path / "mixed"
    given = {"client": client, "work": work, "storage_options": bucket.options, "parts": 2, **FEW}
    assert compared(dmp.dask.score(log, two, **given)) == few
    assert (bucket.sent("/town.mcap") > 0) == (there == "log")


def test_a_bag_in_several_files_is_brought_in_part(client, bucket, town, two, tmp_path, caplog):
    folder = bag_of([town] * 2, tmp_path / "split")
    with caplog.at_level(logging.INFO, logger="dmp_slam"):
        found = remote(bucket, client=client, log=uploaded(folder, bucket), parts=3)
    assert compared(found) == compared(dmp.score(folder, two, **FEW))
    fused = next(record.message for record in caplog.records if record.message.startswith("fuse: 3 parts"))
    assert int(fused.split()[3]) <= 1.1 * 2 * town.stat().st_size + 3 * 2 * ENDS


def test_a_folder_of_scans_is_brought_whole(client, bucket, scans, two):
    folder, _ = scans
    found = remote(bucket, client=client, log=uploaded(folder, bucket), parts=2)
    assert compared(found) == compared(dmp.score(folder, two, **FEW))


def test_a_real_drive_in_parts_is_the_whole(client, bucket, tmp_path):
    data = os.environ.get("DMP_DATA")
    if data is None:
        pytest.skip("DMP_DATA is not set: no real recordings")
    drive = Path(data, "nclt_revisit")
    log, run = drive / "scans", drive / "poses_lidar_odometry.txt"
    expected = compared(dmp.score(log, {"odometry": run}, progress=False))
    # Every return, and drift: nothing of FEW.
    asked: dict[str, Any] = {"client": client, "parts": 3, "progress": False}
    for stage in ("fuse", "cast"):
        marker = tmp_path / stage
        with hooked(client, Killer(stage, marker)):
            found = dmp.dask.score(log, {"odometry": run}, **asked)
        assert marker.exists() and compared(found) == expected
    over_s3 = {"work": "s3://drives/work", "storage_options": bucket.options}
    found = dmp.dask.score(uploaded(log, bucket), {"odometry": run}, **asked, **over_s3)
    assert compared(found) == expected


def test_what_workers_keep_is_bounded(client, bucket, few, tmp_path):
    measured, bound = tmp_path / "measured", 2_500_000
    with hooked(client, Measured(measured)):
        assert compared(remote(bucket, client=client, parts=7, cache_bytes=bound)) == few
        with pytest.raises(dmp.Error, match=r"(fuse|drift) 1/1 reads \d+ bytes, and a worker may keep 100000"):
            remote(bucket, client=client, parts=1, cache_bytes=100_000, retries=0, work="s3://drives/other")
    lines = [line.split() for line in measured.read_text().splitlines()]
    held = [(int(size), int(files)) for stage, size, files in lines if stage in ("fuse", "merge", "cast")]
    assert len(held) == 21
    # A file with holes takes whole blocks.
    assert all(size <= bound + 16384 * files for size, files in held)
    assert max(size for size, _ in held) > bound / 3


def test_a_cache_lets_go_of_what_was_used_least_recently(tmp_path):
    cache, never = Cache(tmp_path / "cache"), threading.Event()
    brought = []

    def want(name, size=40):
        def fetch(folder):
            brought.append(name)
            (folder / name).write_bytes(bytes(size))

        return Want(("job", name), size, fetch)

    def use(*names):
        with cache.holding("it", [want(name) for name in names], 100, never) as folders:
            assert all((folder / name).stat().st_size == 40 for folder, name in zip(folders, names))
            assert cache.held <= 100

    for name in "ababca":
        use(name)
    assert brought == ["a", "b", "c", "a"] or brought == ["a", "b", "c"]
    use("b")
    with pytest.raises(dmp.Error, match="it reads 120 bytes, and a worker may keep 100"):
        use("a", "b", "c")
    # What is in use stays, and who needs the room waits for it.
    order = []
    with cache.holding("it", [want("x"), want("y")], 100, never):
        waiting = threading.Thread(target=lambda: (use("z"), order.append("z")))
        waiting.start()
        time.sleep(0.3)
        order.append("x, y")
    waiting.join()
    assert order == ["x, y", "z"]
    stop = threading.Event()
    stop.set()
    with cache.holding("it", [want("x"), want("y")], 100, never), pytest.raises(dmp.Cancelled):
        with cache.holding("it", [want("z")], 100, stop):
            pass
    cache.forget("job")
    assert cache.held == 0 and [file for file in (tmp_path / "cache").rglob("*") if file.is_file()] == []


def test_a_missing_log_or_package_is_reported(client, town, two, tmp_path, bucket):
    with pytest.raises(dmp.UsageError, match="s3://drives/none.mcap: it is not there"):
        given = {"client": client, "work": tmp_path, "storage_options": bucket.options, "retries": 0, **FEW}
        dmp.dask.score("s3://drives/none.mcap", two, **given)
    code = (
        "import sys; sys.modules['distributed'] = None\n"
        "import dmp_slam.dask\n"
        "try: dmp_slam.dask.score('log', {'a': 'a.tum'})\n"
        "except ImportError as error: print(error)"
    )
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert said == "dmp_slam.dask needs dask and fsspec: pip install 'dmp-slam[dask]'\n"


def test_a_disk_that_is_full_is_reported_and_the_job_resumes(client, town, two, few, tmp_path):
    given = {"client": client, "work": tmp_path / "work", "parts": 2, "retries": 0, **FEW}
    with hooked(client, Full("fuse", most_bytes=10_000)):
        with pytest.raises(dmp.Error, match=f"{tmp_path}/work/.*cannot write") as raised:
            dmp.dask.score(town, two, **given)
    assert not isinstance(raised.value, (dmp.InputError, dmp.UsageError))
    assert [file.name for file in (tmp_path / "work").iterdir() if file.name.startswith(("fuse", "."))] == []
    assert compared(dmp.dask.score(town, two, **given)) == few


def test_a_cache_on_a_disk_that_is_full_is_reported(client, bucket, few):
    given = {"client": client, "parts": 4, "retries": 0}
    # The worker that plans has no room for the log of a part behind that.
    with hooked(client, Full("plan", most_bytes=300_000, is_kept=True)):
        with pytest.raises(dmp.Error, match=r"dmp-parts/.*: cannot write: "):
            remote(bucket, **given)
    assert not any(client.run(left).values())
    assert compared(remote(bucket, **given)) == few
