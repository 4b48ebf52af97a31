"""The request: keywords of a score as options of its parts, and runs and logs as workers reach them."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, Mapping, NamedTuple

from .._arguments import Option, arguments, options, unknown
from .._execute import check
from .._poses import Runs, trajectories
from ..errors import UsageError
from .job import Asked, Given
from .places import Place, is_url, place_of

#: Options with arguments of their own.
_OWN = ("trajectory", "output", "cores", "log", "work")
_MEANS = ("memory", "threads")
_SCORE, _PLAN, _REDUCE = ("score",), ("shard", "plan"), ("shard", "reduce")


class Settings(NamedTuple):
    """Keywords as options."""

    plan: list[str]
    gates: list[str]
    means: tuple[str, ...]
    #: The file for the gates' results.
    junit: Path | None


def settings_of(given: Mapping[str, Any]) -> Settings:
    """Keywords as options of the commands that they belong to; invalid ones are rejected."""
    gates = set(options(_REDUCE)) - {*_OWN, *_MEANS}
    known = (set(options(_PLAN)) | gates) - set(_OWN)
    # Those of a score as a whole: the plan rejects them, and says why.
    whole = {keyword: option for keyword, option in options(_SCORE).items() if keyword not in {*known, *_OWN}}
    rejected = []
    for keyword, value in given.items():
        if keyword in whole:
            rejected += [_with_any_value(whole[keyword])] if value is not None and value is not False else []
        elif keyword not in known:
            raise TypeError(unknown(_SCORE, keyword, sorted(known)))
    own = {keyword: _reachable(value) for keyword, value in given.items() if keyword in known}
    junit = own.pop("junit", None)
    of_means = {keyword: own.pop(keyword) for keyword in _MEANS if keyword in own}
    of_gates = {keyword: own.pop(keyword) for keyword in gates if keyword in own}
    found = Settings(
        [*arguments(_PLAN, own), *rejected],
        arguments(_REDUCE, of_gates),
        tuple(arguments(_REDUCE, of_means)),
        None if junit is None else Path(junit),
    )
    check([*_PLAN, *found.plan, *found.means, "--trajectory=run", "--output=work", "log"])
    check([*_REDUCE, *found.gates, *found.means, "work"])
    if found.junit is not None and not found.gates:
        raise UsageError("junit needs a gate")
    return found


def _with_any_value(option: Option) -> str:
    """An option as an argument, whatever its value."""
    return f"--{option.name}" if option.value is None or option.may_be_alone else f"--{option.name}=any"


def _reachable(value: Any) -> Any:
    """A value in which paths are absolute, so that they hold on all workers."""
    if isinstance(value, Mapping):
        return {name: _reachable(one) for name, one in value.items()}
    is_path = isinstance(value, os.PathLike) or (isinstance(value, str) and ("/" in value or "." in value))
    return os.path.abspath(value) if is_path and os.path.isfile(value) else value


def log_of(log: Any, storage_options: Mapping[str, Any] | None) -> Place:
    """The place of a log."""
    if isinstance(log, (list, tuple)) and len(log) == 1:
        (log,) = log
    if not isinstance(log, (str, os.PathLike)) or hasattr(log, "lidar"):
        raise UsageError("a log that is scored in parts is a path or a URL, of a file or a folder")
    return place_of(log, storage_options)


def asked_of(
    runs: Runs, folder: Path, settings: Settings, cores: int, storage_options: Mapping[str, Any] | None
) -> Asked:
    """The request to plan. Runs in memory are written into a folder."""
    given = [_given(text, folder, storage_options) for text in trajectories(runs, folder)]
    files = sorted(file for file in folder.rglob("*") if file.is_file())
    packed = {str(file.relative_to(folder)): file.read_bytes() for file in files}
    return Asked(settings.plan, given, packed, dict(storage_options or {}), cores, settings.gates)


def _given(text: str, folder: Path, storage_options: Mapping[str, Any] | None) -> Given:
    name, sign, rest = text.partition("=")
    prefix, rest = (name + sign, rest) if sign and "/" not in name else ("", text)
    if rest.startswith(f"{folder}/"):
        return Given(prefix, os.path.relpath(rest, folder), is_packed=True)
    if rest.startswith("topic:"):
        return Given(prefix, rest)
    bag, sign, topic = rest.partition(":/")
    if sign and not is_url(rest) and not os.path.exists(rest):
        return Given(prefix, f"{os.path.abspath(bag)}:/{topic}")
    place = place_of(rest, storage_options)
    return Given(prefix, place.path, place)


def local_files(log: Place, work: Place, runs: list[Given]) -> list[str]:
    """Local files and folders that every worker must see."""
    places = [log, work, *(run.place for run in runs if run.place is not None)]
    return [place.path for place in places if place.is_local and os.path.exists(place.path)]


def parts_of(parts: int | Mapping[str, int] | None, suggested: Mapping[str, int], stages: tuple[str, ...]) -> dict[str, int]:
    """The number of parts of each stage: the given one, else the plan's suggestion."""
    said: Mapping[str, int] = parts if isinstance(parts, Mapping) else {}
    if isinstance(parts, int):
        said = dict.fromkeys(stages, parts)
    for stage, count in said.items():
        if stage not in stages or isinstance(count, bool) or not isinstance(count, int) or count < 1:
            raise UsageError(f"parts of {stage!r}: {count!r}; stages are {', '.join(stages)}, with 1 part at least")
    return {stage: said.get(stage, suggested.get(stage, 1)) for stage in stages}
