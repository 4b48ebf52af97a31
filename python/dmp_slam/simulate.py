"""Simulates logs and trajectories with known truth. Each function writes files and returns the command's output."""

from __future__ import annotations

from typing import Any

from ._arguments import StrPath, documented
from ._commands import printed
from ._listener import Event, Progress


@documented("simulate", "town")
def town(output: StrPath, *, progress: Progress = None, cancel: Event | None = None, **settings: Any) -> str:
    """A log of a drive through a small town, and its true trajectory (``dmp simulate town``)."""
    return printed(("simulate", "town"), [], {**settings, "output": output}, progress, cancel)


@documented("simulate", "city")
def city(output: StrPath, *, progress: Progress = None, cancel: Event | None = None, **settings: Any) -> str:
    """A log of a long drive through a city, and its true trajectory (``dmp simulate city``)."""
    return printed(("simulate", "city"), [], {**settings, "output": output}, progress, cancel)


@documented("simulate", "room")
def room(output: StrPath, *, progress: Progress = None, cancel: Event | None = None, **settings: Any) -> str:
    """Depth images of a walk through a furnished room, their truth, and five estimates (``dmp simulate room``)."""
    return printed(("simulate", "room"), [], {**settings, "output": output}, progress, cancel)


@documented("simulate", "errors")
def errors(trajectory: StrPath, output: StrPath, **settings: Any) -> str:
    """A trajectory with a known error added (``dmp simulate errors``)."""
    return printed(("simulate", "errors"), [trajectory], {**settings, "output": output})


@documented("simulate", "loops")
def loops(truth: StrPath, output: StrPath, **settings: Any) -> str:
    """A pose graph with true and false loop candidates (``dmp simulate loops``)."""
    return printed(("simulate", "loops"), [truth], {**settings, "output": output})
