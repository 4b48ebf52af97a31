"""Comparison with ground truth: the numbers of evo, and the distance of a map from a surface."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Mapping

from ._arguments import StrPath, documented
from ._called import work_folder
from ._commands import parsed
from ._execute import execute
from ._listener import Event, Progress
from ._poses import Run, check_name, in_file_of_its_name, trajectory
from .errors import UsageError


@documented("truth", "ape")
def ape(
    reference: Run, *estimates: Run | Mapping[str, Run], format: str | None = None, **settings: Any
) -> dict[str, Any]:
    """The absolute pose error, as ``evo_ape`` computes it: ``stats`` in the JSON's ``unit`` (``dmp truth ape``).

    Trajectories are files, or in memory as for ``score``. ``format`` is that of the files, if it cannot be detected. Of several
    estimates, or of a dict of them by their names, ``runs`` has one such object each.

    >>> dmp.truth.ape(truth, drift, align=True)["unit"]
    'm'
    >>> [run["estimate"]["path"] for run in dmp.truth.ape(truth, drift, truth)["runs"]]
    ['drift.tum', 'truth.tum']
    """
    return _errors("ape", reference, estimates, format, settings)


@documented("truth", "rpe")
def rpe(
    reference: Run, *estimates: Run | Mapping[str, Run], format: str | None = None, **settings: Any
) -> dict[str, Any]:
    """The relative pose error, as ``evo_rpe`` computes it (``dmp truth rpe``). Trajectories are as for ``ape``."""
    return _errors("rpe", reference, estimates, format, settings)


def _errors(
    metric: str, reference: Run, estimates: tuple[Any, ...], format: str | None, settings: dict[str, Any]
) -> dict[str, Any]:
    named = {"reference": reference, **_by_name(metric, estimates)}
    with work_folder({}, named) as folder:
        numbered = enumerate(named.items())
        files = [_file(name, run, folder / f"run-{number}") for number, (name, run) in numbered]
        return parsed(("truth", metric), [*([format] if format else []), *files], settings)


def _by_name(metric: str, estimates: tuple[Any, ...]) -> dict[str, Run]:
    """The estimates by name; ``reference`` is not a valid name."""
    if len(estimates) == 1 and isinstance(estimates[0], Mapping):
        if "reference" in estimates[0]:
            raise UsageError("'reference': this is no name of an estimate")
        for name in estimates[0]:
            check_name(name)
        named = dict(estimates[0])
    elif len(estimates) == 1:
        named = {"estimate": estimates[0]}
    else:
        named = {f"estimate-{number}": run for number, run in enumerate(estimates, start=1)}
    if not named:
        raise TypeError(f"truth.{metric}() needs an estimate behind the reference")
    return named


def _file(name: str, run: Run, folder: Path) -> str:
    """A trajectory file with its own stamps: as in evo, these metrics read no file beside it. One in memory gets its name as file
    name."""
    file = trajectory(name, run, folder)
    if not folder.exists():
        return file
    named = folder / in_file_of_its_name(name, Path(file).suffix)
    named.parent.mkdir()
    if not (folder / "times.txt").exists():
        Path(file).rename(named)
        return str(named)
    stamped = str(named.with_name(f"{name}.tum"))
    execute(["convert", "trajectory", file, "--output", stamped, "--to=tum", "--quiet"], progress=False)
    return stamped


@documented("truth", "smd")
def smd(
    surface: StrPath, map: StrPath, *, progress: Progress = None, cancel: Event | None = None, **settings: Any
) -> dict[str, Any]:
    """The distance of a map from a reference surface, metres (``dmp truth smd``)."""
    return parsed(("truth", "smd"), [surface, map], settings, progress, cancel)
