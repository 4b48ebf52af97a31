"""The other commands: functions with the command's options as keywords."""

from __future__ import annotations

import json
import os
from typing import Any, Mapping

from ._arguments import StrPath, arguments, documented
from ._called import on_log_and_runs
from ._execute import execute
from ._listener import Event, Progress
from ._poses import Runs
from ._result import Result
from ._scans import Log
from ._score import score


@documented("calibrate")
def calibrate(
    log: Log, runs: Runs, *, progress: Progress = None, cancel: Event | None = None, **settings: Any
) -> dict[str, Any]:
    """Estimates clock offsets in seconds and extrinsics in metres and degrees of runs (``dmp calibrate``)."""
    return on_log_and_runs(("calibrate",), log, runs, progress, cancel, settings)


@documented("drift")
def drift(
    log: Log, runs: Runs, *, progress: Progress = None, cancel: Event | None = None, **settings: Any
) -> dict[str, Any]:
    """Measures the drift of runs at revisits, in metres (``dmp drift``)."""
    return on_log_and_runs(("drift",), log, runs, progress, cancel, settings)


@documented("info")
def info(
    log: Log, runs: Runs = (), *, progress: Progress = False, cancel: Event | None = None, **settings: Any
) -> dict[str, Any]:
    """Describes a log as ``dmp`` reads it: topics, fields, scans, times, damage (``dmp info``).

    >>> dmp.info(town)["streams"][0]["scans"]["scans"]
    100
    """
    return on_log_and_runs(("info",), log, runs, progress, cancel, settings)


@documented("repair")
def repair(
    log: Log, run: Any, output: StrPath, *, progress: Progress = None, cancel: Event | None = None, **settings: Any
) -> dict[str, Any]:
    """Repairs a run using its own loop closures, and writes it if its map improves (``dmp repair``). ``run`` is a trajectory, or
    a dict of one by its name.
    """
    runs = run if isinstance(run, (str, os.PathLike, Mapping)) else {"run": run}
    return on_log_and_runs(("repair",), log, runs, progress, cancel, {**settings, "output": output})


@documented("loops")
def loops(
    graph: StrPath, candidates: StrPath, *, progress: Progress = None, cancel: Event | None = None, **settings: Any
) -> dict[str, Any]:
    """Ranks loop candidates of a pose graph in g2o's format: the true ones first (``dmp loops``)."""
    return parsed(("loops",), [graph], {**settings, "candidates": candidates}, progress, cancel)


@documented("compare")
def compare(
    *results: Result | StrPath, progress: Progress = None, cancel: Event | None = None, **settings: Any
) -> dict[str, Any]:
    """Joins results of one log with the same settings, saved or not, into one table (``dmp compare``). Runs with saved returns
    (``keep``) are compared as if scored together.
    """
    import tempfile
    from pathlib import Path

    with tempfile.TemporaryDirectory(prefix="dmp-python-") as folder:
        files: list[StrPath] = []
        for number, result in enumerate(results, start=1):
            if isinstance(result, Result) and result.kept_file:
                files.append(f"result-{number}={result.kept_file}")
            elif isinstance(result, Result):
                file = Path(folder, f"result-{number}.json")
                file.write_text(result.to_json(), encoding="utf-8")
                files.append(file)
            else:
                files.append(result)
        return parsed(("compare",), files, settings, progress, cancel)


def parsed(
    words: tuple[str, ...],
    given: list[StrPath],
    settings: dict[str, Any],
    progress: Progress = None,
    cancel: Event | None = None,
) -> dict[str, Any]:
    """Runs the command with these files; returns its JSON."""
    found: dict[str, Any] = json.loads(printed(words, given, settings, progress, cancel, "--json"))
    return found


def printed(
    words: tuple[str, ...],
    given: list[StrPath],
    settings: dict[str, Any],
    progress: Progress = None,
    cancel: Event | None = None,
    *more: str,
) -> str:
    """Runs a command; returns its output."""
    called = [*words, *arguments(words, settings), *more, "--", *map(os.fsdecode, given)]
    return execute(called, progress, cancel).text
