"""Scores LiDAR SLAM runs without ground truth: which trajectory explains the scans best?

>>> import dmp_slam as dmp
>>> result = dmp.score("drive.mcap", {"kiss": "kiss.tum", "lio": "lio.tum"})  # doctest: +SKIP
>>> result.best  # doctest: +SKIP
'lio'

Lengths are metres and angles degrees unless a keyword says otherwise. Messages of a command go to the logger ``dmp_slam``: findings
at level INFO, warnings at level WARNING. Errors are ``dmp.Error`` and its subclasses, with a message of one line.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from . import convert, simulate, truth
from ._commands import calibrate, compare, drift, info, loops, repair
from ._core import Table, __version__
from ._map import Hits, Map, Surfels
from ._poses import Poses
from ._race.system import System
from ._residuals import Residuals, residuals
from ._result import Result
from ._score import score
from ._suite import SuiteResult, suite
from ._sweep import Imu, Scan
from .errors import Cancelled, Error, InputError, UsageError

if TYPE_CHECKING:
    from ._race.race import race
    from ._race.result import Race

__all__ = [
    "Cancelled",
    "Error",
    "Hits",
    "Imu",
    "InputError",
    "Map",
    "Poses",
    "Race",
    "Residuals",
    "Result",
    "Scan",
    "System",
    "Surfels",
    "Table",
    "UsageError",
    "__version__",
    "calibrate",
    "compare",
    "convert",
    "drift",
    "info",
    "loops",
    "race",
    "repair",
    "residuals",
    "score",
    "simulate",
    "suite",
    "truth",
]


def __getattr__(name: str) -> Any:
    # Few programs need them, and they import what starts processes.
    if name == "race":
        from ._race.race import race

        return race
    if name == "Race":
        from ._race.result import Race

        return Race
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
