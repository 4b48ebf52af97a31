"""A suite that is scored on a cluster says what it says on one machine."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import fsspec
import pytest
from cluster import Killer, Marked, hooked, left
from conftest import in_parts

import dmp_slam as dmp

#: Logs with options: in parts, in others, and what parts do not have.
LOGS = {"a": "every = 4", "b": "every = 4\nmax_range = 60", "c": "quick = true"}
HEAD = 'versions = ["old", "new"]\ntrajectories = "{version}/{log}.tum"\n[score]\ntrust = true\n'


@pytest.fixture
def suite(town, runs, tmp_path) -> Path:
    """Logs that are the sample, one that is none, and one with a version alone."""
    (tmp_path / "garbage.mcap").write_bytes(b"no log")
    for version, run in (("old", "drift"), ("new", "truth")):
        (tmp_path / version).mkdir()
        for name in (*LOGS, "garbage", "alone"):
            shutil.copy(runs[run], tmp_path / version / f"{name}.tum")
    (tmp_path / "old" / "alone.tum").unlink()
    logs = [(name, town, options) for name, options in LOGS.items()]
    logs += [("garbage", tmp_path / "garbage.mcap", ""), ("alone", town, LOGS["a"])]
    tables = [f"[[log]]\npath = {json.dumps(str(path))}\nname = \"{name}\"\n{options}\n" for name, path, options in logs]
    (tmp_path / "suite.toml").write_text(HEAD + "".join(tables))
    return tmp_path / "suite.toml"


@pytest.fixture
def only(suite):
    """The suite with one log."""

    def one(name: str) -> Path:
        text = suite.read_text()
        start = text.index("[[log]]")
        table = next(table for table in text[start:].split("[[log]]") if f'name = "{name}"' in table)
        suite.write_text(f"{text[:start]}[[log]]{table}")
        return suite

    return one


def comparable(text: str) -> dict[str, Any]:
    """What a suite says, but for where its results are."""
    found: dict[str, Any] = json.loads(text)
    for log in found["logs"]:
        log["result"] = log["result"] is not None
    return found


def results(cache: Path) -> dict[str, Any]:
    """The results in a cache but for times and memory, and what a score in parts lacks."""
    found = {}
    for file in cache.glob("*.json"):
        content = json.loads(file.read_text())
        if content["schema"] == "dmp-score/3":
            found[file.name] = in_parts(content)
    return found


def on(client: Any, suite: Path, program: Any = None, **environment: str) -> subprocess.Popen[str]:
    """The command, begun; without a program that of Cargo, which gets a Python by its environment."""
    words = [program or os.environ["DMP_COMMAND"], "suite", suite, "--json", "--dask", client.scheduler.address]
    env = {**os.environ, **({} if program else {"DMP_PYTHON": sys.executable}), **environment}
    return subprocess.Popen(words, env=env, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def test_a_suite_on_a_cluster_is_that_of_one_machine(client, suite, tmp_path, temporary):
    here = dmp.suite(suite, cache=tmp_path / "here", progress=False)
    there = dmp.suite(suite, cache=tmp_path / "there", client=client, progress=False)
    assert comparable(there.to_json()) == comparable(here.to_json())
    assert here.is_damaged and there.is_damaged
    problems = {log["name"]: log["problem"] for log in there.data["logs"]}
    # A version without a run on a log loses there, which is no problem of the log.
    assert problems["garbage"].startswith("garbage.mcap: ") and problems["alone"] is None
    expected = results(tmp_path / "here")
    assert len(expected) == 4 and results(tmp_path / "there") == expected
    assert list(temporary.iterdir()) == [] and not any(client.run(left).values())
    # By the command, which reports each log.
    running = on(client, suite)
    printed, said = running.communicate()
    assert running.returncode == 3 and comparable(printed) == comparable(here.to_json())
    assert results(tmp_path / ".dmp-suite") == expected
    assert "garbage (4 of 5): not scored: garbage.mcap: " in said and "a: fuse: " in said
    # Only what failed is tried again, here as there.
    listed = json.loads(dmp_list(suite, tmp_path / "there"))
    assert [log["name"] for log in listed["logs"]] == ["garbage"]
    assert comparable(dmp.suite(suite, cache=tmp_path / "there", progress=False).to_json()) == comparable(here.to_json())


def dmp_list(suite: Path, cache: Path) -> str:
    words = [os.environ["DMP_COMMAND"], "suite", str(suite), "--list", "--cache", str(cache)]
    return subprocess.run(words, capture_output=True, text=True, check=True).stdout


def test_a_worker_that_dies_is_no_loss(client, only, tmp_path):
    suite = only("a")
    here = dmp.suite(suite, cache=tmp_path / "here", progress=False)
    with hooked(client, Killer("cast", tmp_path / "died")):
        there = dmp.suite(suite, cache=tmp_path / "there", client=client, cluster={"parts": 3}, progress=False)
    assert (tmp_path / "died").exists() and comparable(there.to_json()) == comparable(here.to_json())
    assert results(tmp_path / "there") == results(tmp_path / "here")


def test_a_damaged_result_is_made_again_and_taken(client, only, tmp_path):
    suite, cache = only("a"), tmp_path / ".dmp-suite"
    first = dmp.suite(suite, client=client, progress=False)
    expected = results(cache)
    (file,) = [cache / name for name in expected]
    file.write_text(file.read_text()[:-100])
    assert dmp.suite(suite, client=client, progress=False).to_json() == first.to_json()
    assert results(cache) == expected


def test_parts_may_lie_in_a_bucket(client, bucket, only):
    given = {"client": client, "work": "s3://drives/suite", "progress": False}
    found = dmp.suite(only("b"), cluster={"storage_options": bucket.options, "parts": 2}, **given)
    assert not found.is_damaged
    assert any(one.path.startswith("/drives/suite/") for one in bucket.requests if one.method == "PUT")
    system = fsspec.filesystem("s3", **bucket.options)
    system.invalidate_cache()
    assert not system.exists("drives/suite")


@pytest.mark.parametrize("how", ["event", "kill"])
def test_a_suite_that_is_stopped_leaves_nothing_running(client, only, tmp_path, how):
    marker = tmp_path / "amid"

    class AmidAPart:
        def is_set(self) -> bool:
            return marker.exists()

    suite = only("a")
    with hooked(client, Marked("cast", marker)):
        if how == "event":
            with pytest.raises(dmp.Cancelled, match="stopped before the end"):
                dmp.suite(suite, client=client, cancel=AmidAPart(), progress=False)
        else:
            # That of the package knows its Python.
            running = on(client, suite, Path(sys.executable).with_name("dmp"))
            while not marker.exists() and running.poll() is None:
                time.sleep(0.01)
            running.send_signal(signal.SIGKILL)
            running.communicate()
        end = time.monotonic() + 30
        while (any(client.processing().values()) or any(client.run(left).values())) and time.monotonic() < end:
            time.sleep(0.1)
    assert marker.exists() and time.monotonic() < end
    assert results(tmp_path / ".dmp-suite") == {}


def test_what_keeps_a_cluster_from_it_is_reported(client, only, tmp_path):
    suite = only("a")
    bare = tmp_path / "python"
    bare.write_text(f'#!/bin/sh\nexec {sys.executable} -S "$@"\n')
    bare.chmod(0o755)

    def refused(**environment: str) -> str:
        running = on(client, suite, **environment)
        printed, said = running.communicate()
        assert (running.returncode, printed, said.count("\n")) == (2, "", 1)
        return said

    assert "--dask needs Python, and /none/python cannot be run (DMP_PYTHON names another)" in refused(DMP_PYTHON="/none/python")
    said = refused(DMP_PYTHON=str(bare))
    assert "pip install 'dmp-slam[dask]'" in said and "No module named 'dmp_slam'" in said
    nobody = [os.environ["DMP_COMMAND"], "suite", str(suite), "--dask", "tcp://127.0.0.1:9"]
    env = {**os.environ, "DMP_PYTHON": sys.executable, "DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT": "1s"}
    ended = subprocess.run(nobody, env=env, capture_output=True, text=True, check=False)
    assert ended.returncode == 1 and ended.stderr.startswith("error: --dask tcp://127.0.0.1:9: "), ended.stderr
    assert ended.stderr.count("\n") == 1
    with pytest.raises(dmp.UsageError, match="cluster is of a client"):
        dmp.suite(suite, cluster={"parts": 2})
    with pytest.raises(TypeError, match="cluster.* has no keyword 'part'; near it: parts"):
        dmp.suite(suite, client=client, cluster={"part": 2})
    with pytest.raises(TypeError, match="no keyword 'dask'"):
        dmp.suite(suite, dask="tcp://127.0.0.1:9")
