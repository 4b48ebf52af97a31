"""One command, run by the core: its output, or an exception with its line."""

from __future__ import annotations

from typing import NamedTuple, Sequence

from . import _core
from ._listener import Event, Listener, Progress
from .errors import Cancelled, Error, InputError, UsageError

_KINDS: dict[str, type[Error]] = {
    "usage": UsageError,
    "input": InputError,
    "interrupted": Cancelled,
    "failed": Error,
}


def check(arguments: Sequence[str]) -> None:
    """Raises what the command would say at once of these arguments, before work is done for it."""
    wrong = _core.check_arguments(arguments)
    if wrong is not None:
        raise _KINDS[wrong[0]](wrong[1])


class Output(NamedTuple):
    """What a command printed, and how it ended."""

    text: str
    #: Part of the input was lost or damaged; the text names it.
    is_damaged: bool
    #: A gate failed.
    gate_failed: bool


def execute(
    arguments: Sequence[str],
    progress: Progress = None,
    cancel: Event | None = None,
    said: list[str] | None = None,
) -> Output:
    """Runs a command with these arguments. What it says goes to the logger, or to a list if there is one."""
    listener = Listener(progress, cancel, said)
    try:
        end, line, printed = _core.run(arguments, listener)
    finally:
        listener.close()
    if line is not None:
        raise _KINDS[end](line)
    return Output(printed.decode(), end == "damaged", end == "gate-failed")
