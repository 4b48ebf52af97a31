"""Maps of surfels, and rays cast into them."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from . import _core
from ._arguments import StrPath, arguments, documented
from ._called import of_log_and_runs, work_folder
from ._execute import execute
from ._listener import Event, Progress
from ._poses import Run
from ._scans import Log
from .errors import InputError, UsageError

#: Default number of bytes of a map in memory for casting.
MEMORY_BYTES = 1 << 30


class Surfels(NamedTuple):
    """Surfels in the frame of the map's trajectory."""

    #: N × 3, metres.
    centres: npt.NDArray[np.float64]
    #: N × 3, unit length.
    normals: npt.NDArray[np.float32]


class Hits(NamedTuple):
    """The crossings of rays with a map: metres along each ray, NaN for a miss."""

    #: The first surfel on the ray.
    z1: npt.NDArray[np.float64]
    #: The one nearest to the measured range, within 5 m; NaN without ranges; read-only.
    zn: npt.NDArray[np.float64]
    #: The first one independent of the ray's own part of the drive; NaN without segments; read-only.
    zc: npt.NDArray[np.float64]
    #: N × 3, unit length: the normal of the surfel of ``z1``, turned towards the ray's origin, NaN for a miss; ``None`` if not
    #: requested.
    normals: npt.NDArray[np.float32] | None = None


class Map:
    """A map on disk, from ``Map.build`` or ``dmp map build``."""

    def __init__(self, path: StrPath, *, memory: int = MEMORY_BYTES) -> None:
        self._path = Path(path)
        self._core = _core.Map(os.fsdecode(path), memory)

    @classmethod
    def open(cls, path: StrPath, *, memory: int = MEMORY_BYTES) -> Map:
        """Opens a map; about ``memory`` bytes of it are in memory at a time for casting."""
        return cls(path, memory=memory)

    @classmethod
    @documented("map", "build")
    def build(
        cls,
        log: Log,
        run: Run,
        output: StrPath,
        *,
        progress: Progress = None,
        cancel: Event | None = None,
        **settings: Any,
    ) -> Map:
        """Fuses the map of a run from a log, or with ``run=None`` that of a cloud or a mesh, and opens it (``dmp map build``)."""
        words = ("map", "build")
        runs = () if run is None else run if isinstance(run, (str, os.PathLike)) else {"run": run}
        with work_folder(settings, runs) as folder:
            given = arguments(words, {**settings, "output": output}, without=["trajectory"])
            called = of_log_and_runs(words, log, runs, given, folder, progress, cancel)
            execute(called, progress, cancel)
        return cls(output)

    @property
    def path(self) -> Path:
        """Its path."""
        return self._path

    @property
    def voxel(self) -> float:
        """Edge of its voxels, metres."""
        return self._core.voxel_m

    def __len__(self) -> int:
        """Number of its surfels."""
        return len(self._core)

    def surfels(self) -> Surfels:
        """All surfels, tile by tile."""
        return Surfels(*self._core.surfels())

    def cast(
        self,
        origins: npt.ArrayLike,
        directions: npt.ArrayLike,
        ranges: npt.ArrayLike | None = None,
        *,
        segments: npt.ArrayLike | None = None,
        threads: int | None = None,
        normals: bool = False,
    ) -> Hits:
        """Casts rays into the map, in the frame of its trajectory.

        ``origins`` and ``directions`` are N × 3, or one of them 3 numbers for all rays; directions need not have unit length.
        ``ranges`` are the measured ranges, metres, and ``segments`` the numbers of the segments of the drive in which they were
        measured. ``normals=True`` also returns the normal of the first surfel on each ray, in the same frame, which takes longer.
        ``threads`` defaults to the number of cores; threads end with the call, so that a process may fork between calls.
        """
        starts, ways = np.broadcast_arrays(_rows("origins", origins), _rows("directions", directions))
        count = len(starts)
        measured = None if ranges is None else _column("ranges", ranges, count).astype(np.float64, copy=False)
        parts = None if segments is None else _column("segments", segments, count).astype(np.int32, copy=False)
        if threads is not None and threads < 1:
            raise UsageError(f"threads: at least 1, not {threads}")
        rays = np.ascontiguousarray(starts), np.ascontiguousarray(ways)
        z1, zn, zc = np.empty(count), None, None
        if ranges is not None:
            zn = np.empty(count)
        if segments is not None:
            zc = np.empty(count)
            measured = np.full(count, np.inf) if measured is None else measured
        towards = np.empty((count, 3), np.float32) if normals else None
        self._core.cast(*rays, measured, parts, threads, (z1, zn, zc, towards))
        # One number for all, broadcast without memory.
        nowhere = np.broadcast_to(np.float64(np.nan), count)
        return Hits(z1, nowhere if zn is None else zn, nowhere if zc is None else zc, towards)

    def __repr__(self) -> str:
        return f"<map {self._path}: {len(self)} surfels, voxels of {self.voxel:.3g} m>"


def _rows(name: str, values: npt.ArrayLike) -> npt.NDArray[np.float64]:
    try:
        rows = np.atleast_2d(np.asarray(values, np.float64))
    except (TypeError, ValueError) as error:
        raise InputError(f"{name}: not N × 3 numbers: {error}") from None
    if rows.ndim != 2 or rows.shape[1] != 3:
        raise InputError(f"{name}: N × 3 numbers are needed, not {' × '.join(map(str, rows.shape))}")
    return rows


def _column(name: str, values: npt.ArrayLike, count: int) -> npt.NDArray[Any]:
    column = np.asarray(values)
    if column.shape != (count,) or column.dtype.kind not in "fiu":
        raise InputError(f"{name}: {count} numbers are needed, one for each ray")
    return np.ascontiguousarray(column)
