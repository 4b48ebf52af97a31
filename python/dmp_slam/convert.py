"""Logs and trajectories in the formats that others read."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path
from typing import Any

from . import _commands
from ._commands import Progress, StrPath
from ._listener import Event
from ._scans import Log, log_path


def log(
    log: Log, output: StrPath, *, progress: Progress = None, cancel: Event | None = None, **settings: Any
) -> str:
    """Writes the scans of a log, which may be in memory, in another format (``dmp convert log``)."""
    with tempfile.TemporaryDirectory(prefix="dmp-python-") as folder:
        path = log_path(log, Path(folder))
        return _commands.printed(
            ("convert", "log"), [path], {**settings, "output": output}, progress, cancel
        )


def trajectory(run: StrPath, output: StrPath, *, to: str, **settings: Any) -> str:
    """Writes a trajectory as ``tum``, ``kitti``, ``euroc`` or ``redwood`` (``dmp convert trajectory``)."""
    return _commands.printed(
        ("convert", "trajectory"), [os.fsdecode(run)], {**settings, "output": output, "to": to}
    )
