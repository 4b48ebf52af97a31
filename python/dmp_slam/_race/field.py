"""The systems that run: by name, from drivers, with their parameters."""

from __future__ import annotations

import itertools
import json
import os
import shlex
import subprocess
import sys
from typing import Any, Iterator, Mapping, NamedTuple, Sequence, Union

from .._poses import check_name
from ..errors import InputError, UsageError
from .system import DRIVERS

#: Systems by name, or names of those that come with the package and files of drivers.
Systems = Union[Sequence[Union[str, "os.PathLike[str]"]], Mapping[str, Union[str, "os.PathLike[str]"]], None]

WORKER = [sys.executable, "-m", "dmp_slam._race.worker"]


class Entry(NamedTuple):
    """A system with parameters, as it is run."""

    name: str
    #: The name of its system, under which settings are given.
    system: str
    #: The name or the file of the driver; ``None`` for a command.
    driver: str | None
    #: The name of the system in its driver, or the command.
    runs: str
    version: str
    parameters: dict[str, Any]
    #: Parameters that differ from the defaults.
    changed: dict[str, Any]
    needs_imu: bool = False

    def with_parameters(self, name: str, changed: Mapping[str, Any]) -> Entry:
        """The same system with other parameters."""
        return self._replace(name=name, parameters={**self.parameters, **changed}, changed={**self.changed, **changed})

    def command(self, log: str, trajectory: str, order: str) -> list[str]:
        """What is started."""
        if self.driver is not None:
            return [*WORKER, order]
        filled = {key: shlex.quote(str(value)) for key, value in {**self.parameters, "log": log, "out": trajectory}.items()}
        return ["/bin/sh", "-c", self.runs.format_map(filled)]


def entries(systems: Systems, settings: Mapping[str, Mapping[str, Any]], has_imu: bool = False) -> list[Entry]:
    """The systems with each combination of their settings; if none are given, those that need no IMU or have one."""
    found = [entry for entry in _systems(systems, settings) if systems is not None or has_imu or not entry.needs_imu]
    without = [entry.system for entry in found if entry.needs_imu and not has_imu]
    if without:
        raise UsageError(f"{without[0]} needs an IMU: give imu, a topic of the log or a .csv")
    unknown = [name for name in settings if all(entry.system != name for entry in found)]
    if unknown:
        raise UsageError(f"settings of {unknown[0]!r}: it is none of the systems: {', '.join(entry.system for entry in found)}")
    found = [each for entry in found for each in grid(entry, settings.get(entry.system, {}))]
    names = [entry.name for entry in found]
    twice = [name for name in names if names.count(name) > 1]
    if twice:
        raise UsageError(f"{twice[0]} is given twice")
    return found


def grid(entry: Entry, settings: Mapping[str, Any], all_named: bool = False) -> list[Entry]:
    """An entry for each combination of values. Those that vary are in its name, or all with their keys."""
    for key in settings:
        if entry.driver is not None and key not in entry.parameters:
            raise UsageError(f"{entry.system} has no parameter {key!r}; it has {', '.join(sorted(entry.parameters)) or 'none'}")
    values = {key: value if isinstance(value, (list, tuple)) else [value] for key, value in settings.items()}
    found = []
    for combination in itertools.product(*values.values()):
        changed = {key: _as_default(entry, key, value) for key, value in zip(values, combination)}
        words = [_word(key, value, all_named) for key, value in changed.items() if all_named or len(values[key]) > 1]
        found.append(entry.with_parameters("-".join([entry.system, *words]), changed))
        check_name(found[-1].name)
    return found


def _word(key: str, value: Any, with_key: bool) -> str:
    if isinstance(value, bool):
        return key if value else f"no-{key}"
    return f"{key}-{value}" if with_key else str(value)


def _as_default(entry: Entry, key: str, value: Any) -> Any:
    """A value of the type that the default has: whole numbers may be given for decimals."""
    default = entry.parameters.get(key)
    if default is None or type(value) is type(default):
        return value
    if isinstance(default, float) and type(value) is int:
        return float(value)
    raise UsageError(f"{entry.system}: {key} is a {type(default).__name__} as {default!r}, not {value!r}")


def _systems(systems: Systems, settings: Mapping[str, Mapping[str, Any]]) -> Iterator[Entry]:
    if systems is None:
        known, missing = _installed()
        if not known:
            raise UsageError(f"no SLAM system is installed: pip install 'dmp-slam[race]' ({missing})")
        yield from known.values()
        return
    named = systems.items() if isinstance(systems, Mapping) else map(_with_name, systems)
    for name, system in named:
        text = os.fsdecode(system)
        if "{out}" in text:
            if name is None:
                raise UsageError(f"a command needs a name, NAME={text}")
            given = settings.get(name, {})
            yield Entry(name, name, None, text, "", {key: None for key in given}, {})
        elif text.endswith(".py") or ".py:" in text:
            yield from _of_file(name, text)
        else:
            known, missing = _installed()
            if text not in known:
                raise UsageError(f"{text!r} is no installed system: {', '.join(known) or missing}; or a driver, FILE.py, or a command")
            yield known[text]._replace(name=name or text, system=name or text)


def _with_name(system: str | os.PathLike[str]) -> tuple[str | None, str]:
    """A system of a list, which may be ``NAME=SYSTEM``."""
    name, sign, text = os.fsdecode(system).partition("=")
    return (name, text) if sign else (None, name)


def _of_file(name: str | None, text: str) -> Iterator[Entry]:
    file, _, one = text.partition(".py:")
    file = f"{file}.py" if one else file
    offered = _described(file)
    if one and one not in offered:
        raise UsageError(f"{file} has no system {one!r}; it has {', '.join(offered)}")
    chosen = [one] if one else list(offered)
    for system in chosen:
        called = name if name is not None and len(chosen) == 1 else system
        yield _entry(called, file, system, offered[system])


def _entry(called: str, driver: str, system: str, offered: Mapping[str, Any]) -> Entry:
    return Entry(called, called, driver, system, offered["version"], offered["parameters"], {}, offered["needs_imu"])


def _installed() -> tuple[dict[str, Entry], str]:
    """The systems of the package's drivers that are installed, and why one driver has none."""
    found, missing = {}, ""
    for file in sorted(DRIVERS.glob("*.py")):
        try:
            offered = _described(file.stem)
        except InputError as error:
            missing = str(error)
            continue
        for name, one in offered.items():
            found[name] = _entry(name, file.stem, name, one)
    return found, missing


def _described(driver: str) -> dict[str, Any]:
    done = subprocess.run([*WORKER, driver], capture_output=True, text=True, check=False, stdin=subprocess.DEVNULL)
    if done.returncode != 0:
        lines = done.stderr.strip().splitlines()
        raise InputError(f"{driver}: {lines[-1] if lines else f'ended with exit code {done.returncode}'}")
    described: dict[str, Any] = json.loads(done.stdout)
    return described
