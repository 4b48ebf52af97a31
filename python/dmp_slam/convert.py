"""Converts logs and trajectories to other formats."""

from __future__ import annotations

import os
from typing import Any

from . import _commands
from ._arguments import StrPath, arguments, documented
from ._called import of_log_and_runs, work_folder
from ._execute import execute
from ._listener import Event, Progress
from ._scans import Log


@documented("convert", "log")
def log(
    log: Log, output: StrPath, *, progress: Progress = None, cancel: Event | None = None, **settings: Any
) -> str:
    """Writes the scans of a log, which may be in memory, in another format (``dmp convert log``)."""
    words, settings = ("convert", "log"), {**settings, "output": output}
    with work_folder({}) as folder:
        called = of_log_and_runs(words, log, (), arguments(words, settings), folder, progress, cancel)
        return execute(called, progress, cancel).text


@documented("convert", "trajectory")
def trajectory(run: StrPath, output: StrPath, *, to: str, **settings: Any) -> str:
    """Writes a trajectory as ``tum``, ``kitti``, ``euroc`` or ``redwood`` (``dmp convert trajectory``)."""
    return _commands.printed(
        ("convert", "trajectory"), [os.fsdecode(run)], {**settings, "output": output, "to": to}
    )
