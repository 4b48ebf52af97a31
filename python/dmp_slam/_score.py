"""``score``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ._arguments import arguments, documented
from ._called import large_files, of_log_and_runs, work_folder
from ._execute import execute
from ._kept import FILES_KEPT, Kept
from ._listener import Event, Progress
from ._poses import Runs
from ._result import Result
from ._scans import Log

#: Outputs whose file contents the result holds, if their keyword is True.
_READ = {"report": "page.html", "per_frame": "frames.csv", "per_tile": "tiles.csv"}


@documented("score")
def score(
    log: Log,
    runs: Runs,
    *,
    progress: Progress = None,
    cancel: Event | None = None,
    **settings: Any,
) -> Result:
    """Scores and ranks runs on a log, as ``dmp score`` does.

    ``log`` is a path, the files of one bag in order, a dataset of kiss-icp or evalio, or scans (``dmp.Scan``). Scans are read once,
    one by one, into a temporary file. ``runs`` maps names to trajectories: files or topics as for the command, N × 4 × 4 arrays or
    lists of poses (``world_from_body``, metres; with stamps as ``dmp.Poses``), or trajectories of evo. Every option of the command
    is a keyword with the same name, unit and values: numbers or texts (``voxel=0.2`` or ``voxel="20 cm"``), True for a switch, a
    dict for values per run (``pose_at={"kiss": "end"}``). ``report=True``, ``per_frame=True``, ``per_tile=True``,
    ``residuals=True``, ``scene=True`` and ``keep=True`` store in the result what the command writes to files; the last three on
    disk, as long as the result exists.

    ``progress`` is shown on a terminal or in a notebook (``None``), always or never, or passed to a function of stage, unit, steps
    done and total steps. ``cancel`` is an event that stops the work when it is set.

    >>> result = dmp.score(town, {"truth": truth, "drift": drift}, threads=1, progress=False)
    >>> result.best
    'truth'
    """
    words = ("score",)
    with work_folder(settings, runs) as folder:
        read = {
            keyword: folder / name if settings.get(keyword) is True else settings.get(keyword)
            for keyword, name in _READ.items()
        }
        kept = Kept(large_files(settings), [name for name in FILES_KEPT if settings.get(name) is True])
        given = arguments(words, {**settings, **read, **kept.files}, without=["trajectory"])
        called = of_log_and_runs(words, log, runs, [*given, "--json"], folder, progress, cancel)
        output = execute(called, progress, cancel)
        texts = [Path(file).read_text(encoding="utf-8") if file else None for file in read.values()]
        result = Result(output, kept, *texts)
        kept.take(result.data, called)
    return result
