"""Runs commands on a log and runs, which may be in memory."""

from __future__ import annotations

import json
import os
import tempfile
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Iterator, Mapping

from ._arguments import arguments
from ._execute import check, execute
from ._listener import Event, Progress
from ._poses import FILES, Runs, in_file_of_its_name, trajectories
from ._scans import LOG_FILE, Log, place
from .errors import Error

#: On a disk: the system's folder is often in memory.
_DISK = Path("/var/tmp")


@contextmanager
def work_folder(settings: Mapping[str, Any], runs: Runs = ()) -> Iterator[Path]:
    """A folder for data in memory and for the command's work; removed at the end with its content.

    Errors that name a file in it name the log or the run instead.
    """
    with tempfile.TemporaryDirectory(prefix="dmp-python-", dir=large_files(settings)) as made:
        folder = Path(made)
        try:
            yield folder
        except Error as error:
            text = str(error)
            # For a full disk, the path matters.
            line = text if "cannot write" in text else _with_names(text, folder, runs)
            if line == text:
                raise
            raise type(error)(line) from None


def large_files(settings: Mapping[str, Any]) -> Path | None:
    """The command's work folder; ``None`` for that of the system, which ``TMPDIR`` may name."""
    work = settings.get("work")
    # The command reports its errors.
    if work is not None and Path(work).is_dir():
        return Path(work)
    return _DISK if "TMPDIR" not in os.environ and _DISK.is_dir() else None


def _with_names(line: str, folder: Path, runs: Runs) -> str:
    """A line in which names replace the paths of data in memory."""
    for number, name in enumerate(runs if isinstance(runs, Mapping) else ()):
        for file in (*FILES, *(in_file_of_its_name(name, suffix) for suffix in (".npy", ".tum"))):
            line = line.replace(str(folder / f"run-{number}" / file), f"run {name!r}")
    return line.replace(str(folder / LOG_FILE), "the log")


def of_log_and_runs(
    words: tuple[str, ...],
    log: Log,
    runs: Runs,
    given: list[str],
    folder: Path,
    progress: Progress,
    cancel: Event | None,
) -> list[str]:
    """The arguments of a command on a log and runs, written to files if needed. Scans come last: they take long."""
    named = trajectories(runs, folder)
    placed = place(log, folder)
    called = [*words, *given, *(f"--trajectory={run}" for run in named), "--", placed.path]
    if placed.scans is not None:
        check(called)
        placed.spool(progress, cancel)
    return called


def on_log_and_runs(
    words: tuple[str, ...],
    log: Log,
    runs: Runs,
    progress: Progress,
    cancel: Event | None,
    settings: Mapping[str, Any],
) -> dict[str, Any]:
    """Runs a command on a log and runs; returns its JSON."""
    with work_folder(settings, runs) as folder:
        given = arguments(words, settings, without=["trajectory"])
        called = of_log_and_runs(words, log, runs, [*given, "--json"], folder, progress, cancel)
        parsed: dict[str, Any] = json.loads(execute(called, progress, cancel).text)
    return parsed
