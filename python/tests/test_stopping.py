"""Work that is stopped, and work side by side."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from conftest import scores

import dmp_slam as dmp


@pytest.fixture
def interruptible():
    """A job in the background of a shell, as tests may be, has its interrupts ignored."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("interruptible")
def test_an_interrupt_stops_the_work(town, runs, temporary):
    def interrupt():
        os.kill(os.getpid(), signal.SIGINT)

    timer = threading.Timer(0.2, interrupt)
    timer.start()
    started = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        # Finer voxels than anybody needs: it would take long.
        dmp.score(town, runs, voxel=0.05, threads=1, progress=False)
    assert time.monotonic() - started < 20
    assert list(temporary.iterdir()) == []


def test_an_interrupt_stops_the_command(town, runs, tmp_path):
    program = Path(sys.executable).with_name("dmp")
    given = ["score", town, "-t", runs["truth"], "--voxel=0.05", "--threads=1", "--work", tmp_path]
    running = subprocess.Popen([program, *given], stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    # It has begun when it says what it has found.
    assert "town.mcap" in running.stderr.readline()
    running.send_signal(signal.SIGINT)
    _, said = running.communicate(timeout=60)
    assert running.returncode == 130 and said.endswith("error: stopped before the end\n")
    assert list(tmp_path.iterdir()) == []


def test_an_event_stops_the_work(town, runs, temporary):
    event = threading.Event()
    with pytest.raises(dmp.Cancelled, match="stopped before the end"):
        dmp.score(town, runs, threads=1, progress=lambda *_: event.set(), cancel=event)
    assert list(temporary.iterdir()) == []


def test_what_progress_raises_stops_the_work(town, runs, temporary):
    class Enough(Exception):
        pass

    def progress(*_):
        raise Enough

    with pytest.raises(Enough):
        dmp.score(town, runs, threads=1, progress=progress)
    assert list(temporary.iterdir()) == []


def test_two_scores_go_side_by_side(town, runs):
    event = threading.Event()
    named = {name: runs[name] for name in ("truth", "drift")}

    def score(cancel=None, progress=False):
        return dmp.score(town, named, progress=progress, cancel=cancel)

    with ThreadPoolExecutor(3) as threads:
        both = [threads.submit(score) for _ in range(2)]
        stopped = threads.submit(score, event, lambda *_: event.set())
        first, second = (one.result() for one in both)
        with pytest.raises(dmp.Cancelled):
            stopped.result()
    assert scores(first.to_json()) == scores(second.to_json()) == scores(score().to_json())
