"""A score in parts, for any scheduler."""

from __future__ import annotations

import os
import shutil
import tempfile
import uuid
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any, Mapping, NamedTuple, Protocol

from .._arguments import StrPath
from .._called import large_files
from .._execute import Output
from .._kept import Kept
from .._listener import Listener
from .._poses import Runs
from .._result import Result
from .asked import Settings, asked_of, local_files, log_of, parts_of
from .job import STAGES, Asked, Job, Planned, Reduced
from .places import place_of


class Doing(Protocol):
    """A running job."""

    def plan(self, asked: Asked) -> Planned:
        """Plans it."""

    def reduce(self, planned: Planned, parts: Mapping[str, int], gates: list[str], junit: bool) -> Reduced:
        """Does all parts and merges their results."""


class Workers(Protocol):
    """The workers of a scheduler."""

    def cores(self) -> int:
        """Their total number of threads."""

    def check(self, paths: list[str]) -> None:
        """Rejects workers that are unsuitable or do not see local files."""

    def doing(self, job: Job, listener: Listener) -> AbstractContextManager[Doing]:
        """A job. At its end, in any case, none of its tasks runs."""


class Where(NamedTuple):
    """Where parts are done, and their number."""

    work: StrPath | None
    parts: int | Mapping[str, int] | None
    cache_bytes: int | None
    storage_options: Mapping[str, Any] | None


def in_parts(
    workers: Workers,
    log: StrPath,
    runs: Runs,
    where: Where,
    listener: Listener,
    given: Settings,
) -> Result:
    """Scores runs on a log with workers, and closes the listener."""
    log_place = log_of(log, where.storage_options)
    parts_of(where.parts, {}, STAGES)
    with tempfile.TemporaryDirectory(prefix="dmp-python-") as packed:
        asked = asked_of(runs, Path(packed), given, workers.cores(), where.storage_options)
    made = tempfile.mkdtemp(prefix="dmp-parts-", dir=large_files({})) if where.work is None else None
    try:
        work = place_of(made if made is not None else os.fsdecode(where.work or ""), where.storage_options)
        job = Job(uuid.uuid4().hex[:8], log_place, work, where.cache_bytes, given.means)
        workers.check(local_files(log_place, work, asked.runs))
        with workers.doing(job, listener) as doing:
            planned = doing.plan(asked)
            counts = parts_of(where.parts, planned.suggested, STAGES)
            reduced = doing.reduce(planned, counts, given.gates, given.junit is not None)
    finally:
        listener.close()
        if made is not None:
            shutil.rmtree(made, ignore_errors=True)
    if given.junit is not None and reduced.junit is not None:
        given.junit.write_text(reduced.junit, encoding="utf-8")
    output = Output(reduced.text, reduced.is_damaged, reduced.gate_failed)
    return Result(output, Kept(None, []), None, None, None)
