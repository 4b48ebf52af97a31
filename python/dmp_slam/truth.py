"""Comparison with ground truth: the numbers of evo, and the distance of a map from a surface."""

from __future__ import annotations

from typing import Any

from ._commands import Progress, StrPath, parsed
from ._listener import Event


def ape(reference: StrPath, estimate: StrPath, *, format: str = "tum", **settings: Any) -> dict[str, Any]:
    """The absolute pose error, as ``evo_ape`` has it: ``stats`` in the JSON's ``unit`` (``dmp truth ape``).

    >>> dmp.truth.ape(truth, drift, align=True)["unit"]
    'm'
    """
    return parsed(("truth", "ape"), [format, reference, estimate], settings)


def rpe(reference: StrPath, estimate: StrPath, *, format: str = "tum", **settings: Any) -> dict[str, Any]:
    """The relative pose error, as ``evo_rpe`` has it (``dmp truth rpe``)."""
    return parsed(("truth", "rpe"), [format, reference, estimate], settings)


def smd(
    surface: StrPath, map: StrPath, *, progress: Progress = None, cancel: Event | None = None, **settings: Any
) -> dict[str, Any]:
    """The distance of a map from a reference surface, metres (``dmp truth smd``)."""
    return parsed(("truth", "smd"), [surface, map], settings, progress, cancel)
