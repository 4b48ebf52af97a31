"""The tasks of a job on a worker of ``dask.distributed``."""

from __future__ import annotations

import os
import threading
import time
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Iterator, Mapping, NamedTuple, Sequence

from .. import _core
from ..errors import Cancelled
from . import stage, tasks
from .job import Asked, Done, Job, Part, Planned, Reduced, Site

#: Share of a worker's memory for its parts: the rest is for the interpreter and reserve.
_PROMISED = 0.6
#: Interval at which cancellation is checked, seconds.
_LOOK_S = 0.05
_ENDING = ("closing", "closed", "failed")

#: Tasks of each job that run in this process, and finished jobs.
_running: dict[str, int] = {}
_over: set[str] = set()
_lock = threading.Lock()

#: A job, and the number of threads of each task.
Task = tuple[Job, int]


class Tally(NamedTuple):
    """What the parts of a stage read and reused."""

    parts: int
    done_before: int
    log_bytes: int
    work_bytes: int

    def __str__(self) -> str:
        before = f", {self.done_before} of them done before" if self.done_before else ""
        brought = f"{self.log_bytes} bytes of the log and {self.work_bytes} of the work folder were brought"
        return f"{self.parts} part{'s' * (self.parts != 1)}{before}; {brought}"


def plan(task: Task, asked: Asked) -> Planned:
    """Plans a job."""
    with _site(task) as site:
        return tasks.plan(task[0], asked, site)


def part(task: Task, what: Part, parts: Mapping[str, int], is_whole: bool, _: Sequence[Tally]) -> Done:
    """Does a part, after the tasks in the last argument."""
    with _site(task) as site:
        return tasks.part(task[0], what, parts, is_whole, site)


def all_of(_: Task, done: Sequence[Done]) -> Tally:
    """Joins all parts of a stage, so that later tasks wait for one task."""
    before = sum(one.was_done for one in done)
    return Tally(len(done), before, sum(one.log_bytes for one in done), sum(one.work_bytes for one in done))


def reduce(
    task: Task, parts: Mapping[str, int], is_whole: bool, gates: list[str], junit: bool, _: Sequence[Tally]
) -> Reduced:
    """Merges the results of all parts."""
    with _site(task) as site:
        return tasks.reduce(task[0], parts, is_whole, gates, junit, site)


def whole(task: Task, words: list[str], log: str) -> tuple[str, list[str]]:
    """Runs a whole command on a log; returns its output and messages."""
    with _site(task) as site:
        return tasks.whole(task[0], words, log, site)


def look(paths: Sequence[str]) -> tuple[str, list[str]]:
    """The version of this package here, and the missing files."""
    return _core.__version__, [path for path in paths if not os.path.exists(path)]


def end(job: str, dask_worker: Any) -> int:
    """Ends a job: its tasks stop. Returns the number still running; at 0 its cached files are removed."""
    with _lock:
        _over.add(job)
        still = _running.get(job, 0)
    if not still:
        stage.forget(job, Path(dask_worker.local_directory))
    return still


class _Stop:
    """Whether a task must stop: it was cancelled, its job ended, or the worker closes."""

    def __init__(self, worker: Any, key: Any, job: str) -> None:
        self._worker, self._key, self._job = worker, key, job
        self._next_s, self._is_set = 0.0, False

    def is_set(self) -> bool:
        now_s = time.monotonic()
        if now_s >= self._next_s and not self._is_set:
            self._next_s = now_s + _LOOK_S
            state = self._worker.state.tasks.get(self._key)
            gone = state is None or state.state == "cancelled"
            self._is_set = gone or self._job in _over or self._worker.status.name in _ENDING
        return self._is_set


@contextmanager
def _site(task: Task) -> Iterator[Site]:
    """The site of the current thread's task."""
    from distributed import get_worker

    job, threads = task
    worker = get_worker()
    stop = _Stop(worker, worker.get_current_task(), job.name)
    limit = worker.memory_manager.memory_limit
    share = min(1.0, threads / worker.state.nthreads)
    memory = int(limit * _PROMISED * share) if limit else None
    with _lock:
        if job.name in _over:
            raise Cancelled("stopped before the end")
        _running[job.name] = _running.get(job.name, 0) + 1
    try:
        yield Site(Path(worker.local_directory), memory, threads, stop)
    finally:
        with _lock:
            _running[job.name] -= 1
            if not _running[job.name]:
                del _running[job.name]
