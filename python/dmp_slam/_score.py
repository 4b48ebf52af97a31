"""``score``, and other commands on a log and runs, which may be in memory."""

from __future__ import annotations

import json
import os
import tempfile
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Iterator, Mapping

from ._arguments import arguments
from ._execute import check, execute
from ._listener import Event, ProgressFunction
from ._poses import FILES, Runs, trajectories
from ._result import Result
from ._scans import LOG_FILE, Log, place
from .errors import Error

#: What is written into files that a result keeps the contents of, if their keyword is True.
_KEPT = {"report": "page.html", "per_frame": "frames.csv", "per_tile": "tiles.csv"}


#: A disk, where the folder of the system is often memory.
_DISK = Path("/var/tmp")


@contextmanager
def work_folder(settings: Mapping[str, Any], runs: Runs = ()) -> Iterator[Path]:
    """A folder for what is in memory, where the command works too; it goes with all that is in it.

    Errors that name a file in it name the log or the run instead.
    """
    work = settings.get("work")
    # What is wrong with it is told by the command.
    there = work if work is not None and Path(work).is_dir() else _default_folder()
    with tempfile.TemporaryDirectory(prefix="dmp-python-", dir=there) as made:
        folder = Path(made)
        try:
            yield folder
        except Error as error:
            told = str(error)
            # Of a disk that is full it matters where it is.
            line = told if "cannot write" in told else _with_names(told, folder, runs)
            if line == told:
                raise
            raise type(error)(line) from None


def _default_folder() -> Path | None:
    """The folder that the command takes without ``work``; ``None`` for that of the system, which ``TMPDIR`` may name."""
    return _DISK if "TMPDIR" not in os.environ and _DISK.is_dir() else None


def _with_names(line: str, folder: Path, runs: Runs) -> str:
    """A line with what is in memory by its name."""
    for number, name in enumerate(runs if isinstance(runs, Mapping) else ()):
        for file in FILES:
            line = line.replace(str(folder / f"run-{number}" / file), f"run {name!r}")
    return line.replace(str(folder / LOG_FILE), "the log")


def of_log_and_runs(
    words: tuple[str, ...],
    log: Log,
    runs: Runs,
    given: list[str],
    folder: Path,
    progress: bool | ProgressFunction | None,
    cancel: Event | None,
) -> list[str]:
    """The arguments of a command on a log and runs, when these are where they say. Scans come last: they take long."""
    named = trajectories(runs, folder)
    placed = place(log, folder)
    called = [*words, *given, *(f"--trajectory={run}" for run in named), "--", placed.path]
    if placed.scans is not None:
        check(called)
        placed.spool(progress, cancel)
    return called


def score(
    log: Log,
    runs: Runs,
    *,
    progress: bool | ProgressFunction | None = None,
    cancel: Event | None = None,
    **settings: Any,
) -> Result:
    """Scores runs on a log, and ranks them, as ``dmp score`` does.

    ``log`` is a path, the files of one bag in order, a dataset of kiss-icp or evalio, or scans (``dmp.Scan``), which are read once, one
    by one, into a file that goes when the scores are there. ``runs`` are names with trajectories: files or topics as the
    command takes them, N × 4 × 4 arrays or lists of poses (``world_from_body``, metres; with stamps as ``dmp.Poses``), or
    trajectories of evo. Every option of the command is a keyword with the same name, unit and values: numbers or texts
    (``voxel=0.2`` or ``voxel="20 cm"``), True for a switch, a dict for what differs from run to run
    (``pose_at={"kiss": "end"}``). ``report=True``, ``per_frame=True`` and ``per_tile=True`` keep in the result what the command
    writes into files.

    ``progress`` is shown where somebody watches (``None``), always or never, or given to a function of stage, unit, steps done
    and all steps. ``cancel`` is an event that stops the work when it is set.

    >>> result = dmp.score(town, {"truth": truth, "drift": drift}, threads=1, progress=False)
    >>> result.best
    'truth'
    """
    words = ("score",)
    with work_folder(settings, runs) as folder:
        files = {
            keyword: folder / name if settings.get(keyword) is True else settings.get(keyword)
            for keyword, name in _KEPT.items()
        }
        given = arguments(words, {**settings, **files}, without=["trajectory"])
        called = of_log_and_runs(words, log, runs, [*given, "--json"], folder, progress, cancel)
        output = execute(called, progress, cancel)
        kept = [Path(file).read_text(encoding="utf-8") if file else None for file in files.values()]
    return Result(output, *kept)


def on_log_and_runs(
    words: tuple[str, ...],
    log: Log,
    runs: Runs,
    progress: bool | ProgressFunction | None,
    cancel: Event | None,
    settings: Mapping[str, Any],
) -> dict[str, Any]:
    """Another command on a log and runs: its JSON."""
    with work_folder(settings, runs) as folder:
        given = arguments(words, settings, without=["trajectory"])
        called = of_log_and_runs(words, log, runs, [*given, "--json"], folder, progress, cancel)
        parsed: dict[str, Any] = json.loads(execute(called, progress, cancel).text)
    return parsed
