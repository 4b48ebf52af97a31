"""What a driver offers: systems, each a function from scans to poses."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Callable, Iterable, Iterator, Mapping, NamedTuple, Union

import numpy.typing as npt

from .._sweep import Scan
from ..errors import UsageError

DRIVERS = Path(__file__).parent / "drivers"

#: Where a pose holds in its scan; ``stamp``: at the stamp that comes with it.
INSTANTS = ("start", "middle", "end", "stamp")


class System(NamedTuple):
    """A SLAM system, as a driver offers it to ``race``.

    ``run`` takes the scans and the parameters, and gives stamps in nanoseconds with poses ``world_from_sensor``, 4 × 4 or 3 × 4,
    metres. A scan has float32 points, times in seconds after its stamp (or ``None``), and the stamp in nanoseconds. A driver is a
    file with a function ``systems()``, which returns systems by name.
    """

    run: Callable[[Iterator[Scan], Mapping[str, Any]], Iterable[tuple[int, npt.ArrayLike]]]
    #: Its parameters with their defaults; of a tuned system those that are switches or decimals are varied.
    parameters: Mapping[str, Any] = {}
    version: str = ""
    #: Where a pose holds in the scan whose stamp it has: ``start``, ``middle`` or ``end``, or ``stamp`` for the stamp's own instant.
    pose_at: Union[str, Callable[[Mapping[str, Any]], str]] = "stamp"
    #: Whether it needs what an IMU measured, ``scan.imu``.
    needs_imu: bool = False

    def instant(self, parameters: Mapping[str, Any]) -> str:
        """Where poses hold with these parameters."""
        found = self.pose_at(parameters) if callable(self.pose_at) else self.pose_at
        if found not in INSTANTS:
            raise UsageError(f"pose_at is {', '.join(INSTANTS)}, not {found!r}")
        return found


def load(driver: str) -> dict[str, System]:
    """The systems of a driver: a file, or the name of one that comes with the package."""
    import runpy

    file = Path(driver) if driver.endswith(".py") else DRIVERS / f"{driver}.py"
    try:
        offers = runpy.run_path(str(file)).get("systems")
    except SyntaxError as error:
        raise UsageError(f"{file}: line {error.lineno}: {error.msg}") from None
    if not callable(offers):
        raise UsageError(f"{file}: it has no function systems() that returns systems by name")
    found: dict[str, System] = offers()
    return found
