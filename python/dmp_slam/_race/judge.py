"""Scores the runs that did not fail. One that the score refuses does not keep the others from theirs."""

from __future__ import annotations

from os import PathLike
from typing import Any, Mapping, Sequence

from .._listener import Event
from .._result import Result
from .._score import score
from ..errors import Cancelled, Error, UsageError
from .runs import Row


def judged(
    log: str | PathLike[str], rows: Sequence[Row], how: Mapping[str, Any], cancel: Event | None
) -> tuple[Result | None, dict[str, str]]:
    """The score of all runs that have one, and why others have none, by name."""
    named = {row.name: row.trajectory for row in rows if row.failed is None}
    refused: dict[str, str] = {}

    def scored(runs: Mapping[str, Any], **more: Any) -> Result:
        return score(log, runs, progress=False, cancel=cancel, **{**how, **more})

    try:
        result = scored(named) if named else None
    except (Cancelled, UsageError):
        raise
    except Error:
        for name, file in named.items():
            try:
                scored({name: file}, report=None)
            except (Cancelled, UsageError):
                raise
            except Error as error:
                refused[name] = str(error)
        left = {name: file for name, file in named.items() if name not in refused}
        # If each has a score of its own, the error is of them all.
        if not refused:
            raise
        result = scored(left) if left else None
    if result is not None:
        refused.update({out["name"]: out["reason"] for out in result.data["left_out"]})
    return result, refused
