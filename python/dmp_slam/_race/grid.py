"""Rows and columns for systems that take organised scans, of a sensor whose beams have fixed elevations."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from .._sweep import NS, Scan, came_back
from ..errors import InputError

#: Gaps between beams are so many times as wide as those within one.
_CLEARER = 3.0
_FEWEST_BEAMS, _MOST_BEAMS = 4, 256
_MOST_COLUMNS = 8192


class Grid(NamedTuple):
    """Rows by elevation, lowest first; columns by azimuth from 0 to 2π."""

    #: Between each two rows, radians.
    edges: npt.NDArray[np.float64]
    columns: int
    #: The azimuth of the middle of the first column, in columns.
    phase: float = 0.0

    @property
    def rows(self) -> int:
        """Their number."""
        return len(self.edges) + 1

    @classmethod
    def of(cls, scan: Scan) -> Grid:
        """Finds rows and columns in a scan."""
        points = np.asarray(scan.points, np.float64)
        elevation, azimuth = _angles(points[came_back(points)])
        ordered = np.sort(elevation)
        gaps = np.diff(ordered)
        widest = np.argsort(-gaps, kind="stable")[:_MOST_BEAMS]
        # Where gaps between beams end and those within a beam begin.
        ratios = gaps[widest[:-1]] / np.maximum(gaps[widest[1:]], 1e-9)
        between = int(ratios[_FEWEST_BEAMS - 2 :].argmax()) + _FEWEST_BEAMS - 1 if len(ratios) >= _FEWEST_BEAMS else 0
        if between == 0 or ratios[between - 1] < _CLEARER:
            raise InputError("this system takes rows of beams, and the points of this log lie in none")
        cuts = np.sort(widest[:between])
        grid = cls((ordered[cuts] + ordered[cuts + 1]) / 2, 1)
        rows = np.searchsorted(grid.edges, elevation)
        fullest = np.sort(azimuth[rows == np.bincount(rows).argmax()])
        columns = int(np.clip(np.rint(2 * np.pi / np.median(np.diff(fullest))), 1, _MOST_COLUMNS))
        phase = np.angle(np.exp(1j * columns * azimuth).mean()) / (2 * np.pi)
        return grid._replace(columns=columns, phase=float(phase))

    def cells(self, points: npt.NDArray[np.float32]) -> npt.NDArray[np.int64]:
        """The number of the cell of each point, row by row."""
        elevation, azimuth = _angles(points.astype(np.float64))
        columns = np.rint(azimuth / (2 * np.pi) * self.columns - self.phase).astype(np.int64) % self.columns
        return np.searchsorted(self.edges, elevation) * self.columns + columns


#: A return as a field of ``PointCloud2`` each: metres, the time as nanoseconds, its row.
RECORD = np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("t", "<u4"), ("row", "u1")])


def records(scan: Scan, grid: Grid | None) -> npt.NDArray[np.void]:
    """The returns of a scan; with a grid each in its cell, and zeros in the others. Times begin at 0. Without an IMU they end at a
    second, whatever the scan's duration: shares of it, as GenZ-ICP takes them, which others scale likewise.
    """
    points = np.asarray(scan.points, np.float32)
    returned = came_back(points)
    points = points[returned]
    times = np.zeros(len(points)) if scan.times is None else np.asarray(scan.times, np.float64)[returned]
    found = np.zeros(len(points) if grid is None else grid.rows * grid.columns, RECORD)
    cells = np.arange(len(points)) if grid is None else grid.cells(points)
    found["x"][cells], found["y"][cells], found["z"][cells] = points.T
    if len(times) and np.ptp(times) > 0:
        found["t"][cells] = (times - times.min()) / (np.ptp(times) if scan.imu is None else 1) * NS
    if grid is not None:
        found["row"] = np.arange(len(found)) // grid.columns
    return found


def _angles(points: npt.NDArray[np.float64]) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    x, y, z = points.T
    return np.arctan2(z, np.hypot(x, y)), np.arctan2(y, x) % (2 * np.pi)
