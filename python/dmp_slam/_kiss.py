"""Reads datasets of kiss-icp: ``len(d)``, and ``d[i]`` with points and times."""

from __future__ import annotations

from decimal import Decimal
from typing import Any, Iterator

import numpy as np
import numpy.typing as npt

from ._poses import stamps_ns
from ._sweep import NS, PERIOD_NS, Scan, came_back, nearest, refuse_not_finite
from .errors import InputError

#: A gap to the next scan longer than this multiple of the one before: scans are missing in between.
_GAP = 1.5


def of_kiss(dataset: Any) -> Iterator[Scan]:
    """The scans of a dataset.

    Times are positions of points within the scan, on any scale. As in kiss-icp, the first and the last are the beginning and end of
    the scan, and the next scan begins there.
    """
    if hasattr(dataset, "reset"):
        dataset.reset()
    stamps = _Stamps(dataset)
    waiting: tuple[npt.NDArray[Any], npt.NDArray[Any], int] | None = None
    period_ns: int | None = None
    for number in range(len(dataset)):
        read = dataset[number]
        if isinstance(read, Scan):
            # Not a dataset, but a sequence of its own kind.
            yield read
            continue
        points, times = _parts(number, read)
        stamp = stamps.of(number)
        if waiting is not None:
            period_ns = _period_ns(stamp - waiting[2], period_ns)
            yield _within(number - 1, *waiting, period_ns)
        waiting = (points, times, stamp)
    if waiting is not None:
        yield _within(len(dataset) - 1, *waiting, PERIOD_NS if period_ns is None else period_ns)


def _parts(number: int, read: Any) -> tuple[npt.NDArray[Any], npt.NDArray[Any]]:
    points, times = read if isinstance(read, tuple) and len(read) == 2 else (read, ())
    try:
        points, times = np.asarray(points), np.asarray(times).reshape(-1)
    except ValueError:
        raise InputError(f"scan {number}: a dataset gives points and their times, or a dmp.Scan") from None
    if points.ndim != 2 or points.dtype.kind not in "fiu":
        raise InputError(f"scan {number}: a dataset gives points and their times, or a dmp.Scan, not {type(read).__name__}")
    if len(times) and (len(times) != len(points) or times.dtype.kind not in "fiu"):
        raise InputError(f"scan {number}: {len(points)} points have {len(points)} times, not {len(times)} of {times.dtype}")
    return points, times


def _period_ns(to_next_ns: int, before_ns: int | None) -> int:
    """The duration of a scan, from the next stamp and the scan before. A gap does not extend the scan before it."""
    if before_ns is not None and not 0 < to_next_ns < _GAP * before_ns:
        return before_ns
    return to_next_ns if to_next_ns > 0 else PERIOD_NS


class _Stamps:
    """The stamps of a dataset."""

    def __init__(self, dataset: Any) -> None:
        self._dataset = dataset
        self._known: Any = getattr(dataset, "scan_timestamps", None)
        self._ask = getattr(dataset, "get_frames_timestamps", None)
        if self._ask is not None:
            self._known = ()

    def of(self, number: int) -> int:
        """The stamp of the scan just read, nanoseconds."""
        # Some datasets read a file per access; for a bag only the scans read so far have stamps.
        if self._ask is not None and number >= len(self._known):
            self._known = self._ask()
        if self._known is None:
            return number * PERIOD_NS
        if number >= len(self._known):
            raise InputError(f"scan {number}: the dataset has {len(self._known)} stamps")
        stamp = np.asarray(self._known[number]).reshape(-1)
        if self._ask is None:
            return int(stamp[0])
        if stamp.dtype.kind in "US" and len(stamp) == 1:
            return _number(number, stamp[0])
        return stamps_ns(f"scan {number}", stamp, 1)[0]


def _number(number: int, stamp: Any) -> int:
    """The nanoseconds of a stamp given as text, such as a file name: an integer is nanoseconds, else seconds."""
    text = stamp.decode("ascii", "replace") if isinstance(stamp, bytes) else str(stamp)
    try:
        return int(text)
    except ValueError:
        pass
    try:
        return int((Decimal(text) * NS).to_integral_value())
    except (ArithmeticError, ValueError):
        raise InputError(f"scan {number}: the stamp {text!r} is no number") from None


def _within(
    number: int, points: npt.NDArray[Any], times: npt.NDArray[Any], stamp_ns: int, period_ns: int
) -> Scan:
    if len(times) == 0:
        return Scan(points, None, stamp_ns)
    returned = came_back(points)
    refuse_not_finite(number, times, returned)
    times = times.astype(np.float64)
    if not returned.any():
        return Scan(points, np.zeros(len(times), np.int64), stamp_ns)
    first, last = times[returned].min(), times[returned].max()
    share = np.zeros(len(times))
    if last > first:
        share[returned] = (times[returned] - first) / (last - first)
    return Scan(points, nearest(share * period_ns), stamp_ns)
