"""Comparison with ground truth: the numbers of evo, and the distance of a map from a surface."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ._arguments import StrPath, documented
from ._called import on_log_and_runs, work_folder
from ._commands import parsed
from ._execute import execute
from ._listener import Event, Progress
from ._poses import STAMPED, Run, Runs, trajectory
from ._scans import Log


@documented("truth", "ape")
def ape(reference: Run, estimate: Run, *, format: str | None = None, **settings: Any) -> dict[str, Any]:
    """The absolute pose error, as ``evo_ape`` has it: ``stats`` in the JSON's ``unit`` (``dmp truth ape``).

    Trajectories are files, or in memory as for ``score``. ``format`` is that of the files, where it is not to be found by looking.

    >>> dmp.truth.ape(truth, drift, align=True)["unit"]
    'm'
    """
    return _errors("ape", reference, estimate, format, settings)


@documented("truth", "rpe")
def rpe(reference: Run, estimate: Run, *, format: str | None = None, **settings: Any) -> dict[str, Any]:
    """The relative pose error, as ``evo_rpe`` has it (``dmp truth rpe``). Trajectories are as for ``ape``."""
    return _errors("rpe", reference, estimate, format, settings)


def _errors(
    metric: str, reference: Run, estimate: Run, format: str | None, settings: dict[str, Any]
) -> dict[str, Any]:
    named = {"reference": reference, "estimate": estimate}
    with work_folder({}, named) as folder:
        numbered = enumerate(named.items())
        files = [_file(name, run, folder / f"run-{number}") for number, (name, run) in numbered]
        return parsed(("truth", metric), [*([format] if format else []), *files], settings)


def _file(name: str, run: Run, folder: Path) -> str:
    """A trajectory whose file holds its stamps itself: as evo, these metrics look for none beside it."""
    file = trajectory(name, run, folder)
    if not (folder / "times.txt").exists():
        return file
    stamped = str(folder / STAMPED)
    execute(["convert", "trajectory", file, "--output", stamped, "--to=tum", "--quiet"], progress=False)
    return stamped


@documented("truth", "smd")
def smd(
    surface: StrPath, map: StrPath, *, progress: Progress = None, cancel: Event | None = None, **settings: Any
) -> dict[str, Any]:
    """The distance of a map from a reference surface, metres (``dmp truth smd``)."""
    return parsed(("truth", "smd"), [surface, map], settings, progress, cancel)


@documented("truth", "study")
def study(
    log: Log,
    runs: Runs,
    reference: StrPath,
    *,
    progress: Progress = None,
    cancel: Event | None = None,
    **settings: Any,
) -> dict[str, Any]:
    """Every score of runs beside ground truth, and how well they rank alike (``dmp truth study``)."""
    settings = {**settings, "reference": reference}
    return on_log_and_runs(("truth", "study"), log, runs, progress, cancel, settings)
