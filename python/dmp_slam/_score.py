"""``score``, and other commands on a log and runs, which may be in memory."""

from __future__ import annotations

import json
import tempfile
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Iterator, Mapping

from ._arguments import arguments
from ._execute import execute
from ._listener import Event, ProgressFunction
from ._poses import Runs, trajectories
from ._result import Result
from ._scans import Log, log_path

#: What is written into files that a result keeps the contents of, if their keyword is True.
_KEPT = {"report": "page.html", "per_frame": "frames.csv", "per_tile": "tiles.csv"}


@contextmanager
def work_folder(settings: Mapping[str, Any]) -> Iterator[Path]:
    """A folder for what is in memory, where the command works too; it goes with all that is in it."""
    work = settings.get("work")
    # What is wrong with it is told by the command.
    there = work if work is not None and Path(work).is_dir() else None
    with tempfile.TemporaryDirectory(prefix="dmp-python-", dir=there) as folder:
        yield Path(folder)


def of_log_and_runs(words: tuple[str, ...], log: Log, runs: Runs, given: list[str], folder: Path) -> list[str]:
    """The arguments of a command on a log and runs. Runs come first: they are short."""
    named = trajectories(runs, folder)
    path = log_path(log, folder)
    return [*words, *given, *(f"--trajectory={run}" for run in named), "--", path]


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
    with work_folder(settings) as folder:
        files = {
            keyword: folder / name if settings.get(keyword) is True else settings.get(keyword)
            for keyword, name in _KEPT.items()
        }
        given = arguments(words, {**settings, **files}, without=["trajectory"])
        called = of_log_and_runs(words, log, runs, [*given, "--json"], folder)
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
    with work_folder(settings) as folder:
        given = arguments(words, settings, without=["trajectory"])
        called = of_log_and_runs(words, log, runs, [*given, "--json"], folder)
        parsed: dict[str, Any] = json.loads(execute(called, progress, cancel).text)
    return parsed
