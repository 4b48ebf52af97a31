"""One sweep of the sensor, and helpers for its sources."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from .errors import InputError

NS = 1_000_000_000
#: Default time between scans, nanoseconds: LiDARs turn ten times a second.
PERIOD_NS = NS // 10


class Imu(NamedTuple):
    """What an IMU measured, in its own frame."""

    #: N instants, nanoseconds.
    stamps_ns: npt.NDArray[np.int64]
    #: N × 3, rad/s.
    gyro_rad_s: npt.NDArray[np.float64]
    #: N × 3, m/s²; at rest 9.8 upwards.
    accel_m_s2: npt.NDArray[np.float64]
    #: The pose of the LiDAR in this frame, 4 × 4, metres.
    imu_from_lidar: npt.NDArray[np.float64]

    def between(self, after: int, until: int) -> Imu:
        """A part, by the number of its measurements."""
        part = slice(after, until)
        return Imu(self.stamps_ns[part], self.gyro_rad_s[part], self.accel_m_s2[part], self.imu_from_lidar)


class Scan(NamedTuple):
    """One sweep of the sensor.

    ``points`` are N × 3, metres in the sensor's frame; they are stored as float32. ``times`` are those of the points after the
    stamp, N seconds (floats) or nanoseconds (integers), ``None`` for a motion-corrected scan. They are negative before the stamp,
    which may be any instant of the sweep. ``stamp`` is in seconds (float) or nanoseconds (int); without one, scans are a tenth of a
    second apart.

    A point without an echo, not finite or (0, 0, 0), needs no time.
    """

    points: npt.ArrayLike
    times: npt.ArrayLike | None = None
    stamp: float | int | None = None
    #: For systems of ``race`` that take an IMU: from the end of the scan before to the first measurement after its own end.
    imu: Imu | None = None


def came_back(points: npt.NDArray[Any]) -> npt.NDArray[np.bool_]:
    """Which points are returns."""
    returned: npt.NDArray[np.bool_] = np.isfinite(points).all(axis=1) & (points != 0).any(axis=1)
    return returned


def refuse_not_finite(number: int, times: npt.NDArray[Any], returned: npt.NDArray[np.bool_]) -> None:
    """Rejects a return without a finite time."""
    wrong = returned & ~np.isfinite(times)
    if wrong.any():
        first = int(np.argmax(wrong))
        raise InputError(f"scan {number}: time {first} is not finite: {times[first]}")


def nearest(values: npt.NDArray[np.float64]) -> npt.NDArray[np.int64]:
    """Rounded to integers, halves away from zero, as times in files are."""
    whole = np.trunc(values)
    rest = values - whole
    return (whole + (rest >= 0.5) - (rest <= -0.5)).astype(np.int64)
