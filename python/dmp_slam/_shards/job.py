"""The input and output of tasks that do parts of a score."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Mapping, NamedTuple

from .._listener import Event
from .places import Place

#: The stages with parts.
STAGES = ("fuse", "merge", "cast", "drift")
#: The stages that must be done before.
BEFORE: Mapping[str, tuple[str, ...]] = {
    "fuse": (),
    "merge": ("fuse",),
    "cast": ("merge",),
    "drift": (),
    "reduce": STAGES,
}
#: The files that every part reads.
PLAN_FILES = ("plan.json", "runs.part")


class Job(NamedTuple):
    """A score in parts."""

    #: Its unique name.
    name: str
    log: Place
    #: The folder of the plan, with the files of all parts.
    work: Place
    #: Most bytes of files that a worker caches for parts; ``None``: half of its free disk space.
    cache_bytes: int | None
    #: Options for every command: memory and threads.
    means: tuple[str, ...]


class Planned(NamedTuple):
    """The content of a plan."""

    hash: str
    #: Suggested number of parts of each stage.
    suggested: dict[str, int]
    #: Whether every part opens the whole log.
    is_whole: bool
    #: Messages of the command.
    said: list[str]


class Given(NamedTuple):
    """A given run."""

    #: Its name and ``=``, or nothing.
    prefix: str
    #: Its argument for the command, or the name of a file sent with the plan.
    text: str
    #: The place of its file, if it must be fetched.
    place: Place | None = None
    is_packed: bool = False


class Asked(NamedTuple):
    """A request to plan."""

    settings: list[str]
    runs: list[Given]
    #: Runs in memory, as files.
    packed: Mapping[str, bytes]
    #: Access options for the files that options name.
    options: Mapping[str, Any]
    #: Cores of all workers.
    cores: int
    gates: list[str]


class Part(NamedTuple):
    """A part of a stage."""

    stage: str
    number: int
    of: int

    def __str__(self) -> str:
        return f"{self.stage} {self.label}"

    @property
    def label(self) -> str:
        """Its name in arguments of commands."""
        return f"{self.number}/{self.of}"

    @property
    def stem(self) -> str:
        """The stem of its file names."""
        return f"{self.stage}-{self.number}-of-{self.of}."

    @property
    def receipt(self) -> str:
        """The name of its receipt file, which marks it as done."""
        return f"{self.stem}part"


class Done(NamedTuple):
    """A finished part."""

    part: Part
    #: Bytes of the log and of the plan's folder fetched for it.
    log_bytes: int = 0
    work_bytes: int = 0
    #: Whether it was already done.
    was_done: bool = False


class Reduced(NamedTuple):
    """The merged result of all parts."""

    text: str
    is_damaged: bool
    gate_failed: bool
    said: list[str]
    #: The JUnit file, if requested.
    junit: str | None


class Site(NamedTuple):
    """Where a part is done."""

    #: A folder on the local disk.
    folder: Path
    #: Its share of the memory, if known.
    memory_bytes: int | None
    #: Its number of threads.
    threads: int
    #: Whether to stop.
    stop: Event


def receipts_before(stage: str, parts: Mapping[str, int]) -> list[str]:
    """The names of the receipts of earlier stages."""
    return [
        Part(before, number, parts[before]).receipt
        for before in BEFORE[stage]
        for number in range(1, parts[before] + 1)
    ]
