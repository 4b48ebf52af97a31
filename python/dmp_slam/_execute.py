"""Runs one command in the core: returns its output, or raises its error."""

from __future__ import annotations

import warnings
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
    """Raises the command's usage error for these arguments, before any work is done."""
    wrong = _core.check_arguments(arguments)
    if wrong is not None:
        raise _KINDS[wrong[0]](wrong[1])


class Output(NamedTuple):
    """The output of a command, and how it ended."""

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
    """Runs a command with these arguments. Its messages go to ``said`` if given, else to the logger."""
    listener = Listener(progress, cancel, said)
    try:
        end, line, printed = _core.run(arguments, listener)
    finally:
        listener.close()
    if line is not None:
        raise _KINDS[end](line)
    if end == "output-failed":
        warnings.warn("a file beside the result could not be written; the messages name it", RuntimeWarning, stacklevel=3)
    return Output(printed.decode(), end == "damaged", end == "gate-failed")
