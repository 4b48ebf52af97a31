"""Scores the logs of a suite on a cluster: for ``dmp_slam.suite`` and ``dmp suite --dask``."""

from __future__ import annotations

import json
import os
import sys
import threading
import uuid
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path
from typing import Any, Callable, Mapping, NamedTuple

from .. import _core
from .._listener import Event, Listener
from ..errors import Cancelled, Error, UsageError
from .asked import Settings, local_files, log_of
from .dask_cluster import DaskCluster
from .job import Job
from .places import place_of, remove
from .scored import Where, in_parts

#: Written in place of a result that cannot exist.
_PROBLEM = "dmp-suite-problem/1"
#: Most logs processed at a time: each has a thread here.
_AT_ONCE = 32

#: How often a failed part is tried again.
RETRIES = 2

#: Called with a line, or with the number of finished logs.
Said = Callable[[str], None]
Counted = Callable[[int], None]


class Missing(NamedTuple):
    """A log without a result, as in ``dmp suite --list``."""

    name: str
    runs: list[str]
    options: list[str]
    log: str
    #: The path for the result.
    result: Path
    is_in_parts: bool

    @classmethod
    def of(cls, listed: Mapping[str, Any]) -> Missing:
        *given, log = listed["arguments"]
        sign = "--trajectory="
        runs = [one[len(sign) :] for one in given if one.startswith(sign)]
        options = [one for one in given if not one.startswith(sign) and one not in ("score", "--json", "--")]
        return cls(listed["name"], runs, options, log, Path(listed["result"]), listed["is_in_parts"])


class _Stop:
    """Whether the user stopped the suite or a job failed."""

    def __init__(self, cancel: Event | None) -> None:
        self._cancel, self._own = cancel, threading.Event()

    def set(self) -> None:
        self._own.set()

    def is_set(self) -> bool:
        return self._own.is_set() or (self._cancel is not None and self._cancel.is_set())


def score_all(
    listed: Mapping[str, Any],
    cluster: DaskCluster,
    where: Where,
    means: list[str],
    listeners: tuple[Said, Counted],
    cancel: Event | None,
) -> None:
    """Scores the listed logs, several at a time, and writes each result to its file; for a failed log, the reason."""
    if listed["dmp_version"] != _core.__version__:
        raise UsageError(f"the suite is of dmp {listed['dmp_version']}, the package dmp-slam here is {_core.__version__}")
    say, count = listeners
    stop = _Stop(cancel)
    logs = [Missing.of(log) for log in listed["logs"]]
    with ThreadPoolExecutor(min(_AT_ONCE, cluster.cores() + 1)) as threads:
        futures = {threads.submit(_score, log, cluster, where, means, stop): log for log in logs}
        try:
            for done, future in enumerate(as_completed(futures), start=1):
                for line in future.result():
                    say(f"{futures[future].name}: {line}")
                count(done)
        finally:
            stop.set()
            threads.shutdown(cancel_futures=True)


def _score(log: Missing, cluster: DaskCluster, where: Where, means: list[str], stop: Event) -> list[str]:
    """Scores a log; returns the messages."""
    said: list[str] = []
    listener = Listener(False, stop, said)
    try:
        text = _in_parts(log, cluster, where, means, listener) if log.is_in_parts else _whole(log, cluster, means, listener)
    except Cancelled:
        raise
    except (Error, ImportError, OSError) as error:
        # The suite reports it.
        text = json.dumps({"schema": _PROBLEM, "problem": str(error) or type(error).__name__})
    beside = log.result.with_name(f".{log.result.name}.{uuid.uuid4().hex[:8]}")
    beside.write_text(text, encoding="utf-8")
    os.replace(beside, log.result)
    return said


def _in_parts(log: Missing, cluster: DaskCluster, where: Where, means: list[str], listener: Listener) -> str:
    settings = Settings(log.options, [], tuple(means), None)
    own = None
    if where.work is not None:
        # Reused when the suite resumes.
        own = place_of(where.work, where.storage_options).join(log.result.stem)
        where = where._replace(work=own.path)
        if own.is_local:
            os.makedirs(os.path.dirname(own.path), exist_ok=True)
    text = in_parts(cluster, log.log, log.runs, where, listener, settings).to_json()
    if own is not None:
        remove(own)
    return text


def _whole(log: Missing, cluster: DaskCluster, means: list[str], listener: Listener) -> str:
    """Scores in one task: an option is not available in parts."""
    place = log_of(log.log, None)
    job = Job(uuid.uuid4().hex[:8], place, place, None, tuple(means))
    cluster.check(local_files(place, place, []))
    runs = [f"--trajectory={run}" for run in log.runs]
    with cluster.doing(job, listener) as doing:
        return doing.whole(["score", *runs, *log.options, "--json"], place.path)


def main() -> None:
    """The process of ``dmp suite --dask``: reads a request in JSON from standard input, replies in lines, and stops at its end."""
    asked = json.loads(sys.stdin.readline())
    stop = threading.Event()
    threading.Thread(target=_wait_for_end, args=(stop,), daemon=True).start()
    try:
        import distributed

        with distributed.Client(asked["address"], set_as_default=False) as client:
            cluster = DaskCluster.of(client, RETRIES, None)
            where = Where(asked["work"], None, None, None)
            listeners = (lambda line: _answer("say", line), lambda done: _answer("done", done))
            score_all(asked["list"], cluster, where, asked["means"], listeners, stop)
    except (Error, ImportError, OSError, ValueError) as error:
        is_usage = isinstance(error, (UsageError, ImportError, ValueError))
        _answer("failed", {"line": str(error) or type(error).__name__, "is_usage": is_usage})


def _wait_for_end(stop: threading.Event) -> None:
    # Not with `sys.stdin`: a thread waiting there at exit would hold its lock.
    while os.read(0, 1024):
        pass
    stop.set()


def _answer(kind: str, what: Any) -> None:
    print(json.dumps({kind: what}), flush=True)


if __name__ == "__main__":
    main()
