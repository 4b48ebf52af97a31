"""What is handed to those who do parts of a score, and what they hand back."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Mapping, NamedTuple

from .._listener import Event
from .places import Place

#: The stages of which there are parts.
STAGES = ("fuse", "merge", "cast", "drift")
#: The stages that must be done before.
BEFORE: Mapping[str, tuple[str, ...]] = {
    "fuse": (),
    "merge": ("fuse",),
    "cast": ("merge",),
    "drift": (),
    "reduce": STAGES,
}
#: What every part reads.
PLAN_FILES = ("plan.json", "runs.part")


class Job(NamedTuple):
    """A score in parts."""

    #: What no other job is called.
    name: str
    log: Place
    #: The folder of the plan, where the files of all parts lie.
    work: Place
    #: Most bytes of files that a worker keeps for parts; ``None`` for half of what its disk has free.
    cache_bytes: int | None
    #: What was asked for every command: memory and threads.
    means: tuple[str, ...]


class Planned(NamedTuple):
    """What a plan says."""

    hash: str
    #: How many parts of each stage make sense.
    suggested: dict[str, int]
    #: Whether the log is opened as a whole by every part.
    is_whole: bool
    #: What the command said.
    said: list[str]


class Given(NamedTuple):
    """A run as it was given."""

    #: Its name and a sign of equality, or nothing.
    prefix: str
    #: As the command takes it, or the name of a file that is handed over with the plan.
    text: str
    #: Where its file is, if it is to be brought.
    place: Place | None = None
    is_packed: bool = False


class Asked(NamedTuple):
    """What is to be planned."""

    settings: list[str]
    runs: list[Given]
    #: Runs that were in memory, as files.
    packed: Mapping[str, bytes]
    #: How to get to files that options name.
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
        """As commands take it."""
        return f"{self.number}/{self.of}"

    @property
    def stem(self) -> str:
        """What the names of its files begin with."""
        return f"{self.stage}-{self.number}-of-{self.of}."

    @property
    def receipt(self) -> str:
        """The name of the file that says that it is done."""
        return f"{self.stem}part"


class Done(NamedTuple):
    """A part that was done."""

    part: Part
    #: Bytes of the log and of the folder of the plan that were brought for it.
    log_bytes: int = 0
    work_bytes: int = 0
    #: Whether it was done before.
    was_done: bool = False


class Reduced(NamedTuple):
    """What all parts came to."""

    text: str
    is_damaged: bool
    gate_failed: bool
    said: list[str]
    #: The JUnit file, if it was asked for.
    junit: str | None


class Site(NamedTuple):
    """Where a part is done."""

    #: A folder on the disk there.
    folder: Path
    #: What it may use of the memory, if that is known.
    memory_bytes: int | None
    #: Threads that it may use.
    threads: int
    #: Whether it is to stop.
    stop: Event


def receipts_before(stage: str, parts: Mapping[str, int]) -> list[str]:
    """The names of the files that say that the stages before are done."""
    return [
        Part(before, number, parts[before]).receipt
        for before in BEFORE[stage]
        for number in range(1, parts[before] + 1)
    ]
