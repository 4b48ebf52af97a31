"""Spools logs in memory, or of other programs, into a log for the core, one scan at a time."""

from __future__ import annotations

import os
from collections.abc import Sequence as AnySequence
from pathlib import Path
from typing import Any, Iterable, Iterator, NamedTuple, Sequence, Union

import numpy as np
import numpy.typing as npt

from . import _core
from ._kiss import of_kiss
from ._listener import Event, Listener, Progress
from ._poses import nanoseconds
from ._sweep import NS, PERIOD_NS, Scan, came_back, nearest, refuse_not_finite
from .errors import Cancelled, InputError

#: A log: a path, the files of one bag in order, or scans.
Log = Union[str, "os.PathLike[str]", Sequence[Union[str, "os.PathLike[str]"]], Iterable[Any], Any]

#: File name of the spooled log.
LOG_FILE = "log.mcap"

#: Largest time between a point and its stamp, nanoseconds: 32 bits.
_MOST_NS = 2**31 - 1


class Placed(NamedTuple):
    """The path of a log."""

    path: str
    #: The scans to spool to that path; ``None`` if the log is there.
    scans: Iterator[Scan] | None = None
    #: Their number, if known.
    of: int | None = None

    def spool(self, progress: Progress = None, cancel: Event | None = None) -> None:
        """Writes the log if it is not there yet."""
        if self.scans is not None:
            spool(self.scans, Path(self.path), self.of, progress, cancel)


def place(log: Log, folder: Path) -> Placed:
    """The path of a log; one that is not a file is spooled into the folder."""
    # Datasets of evalio are strings too.
    if isinstance(log, (str, os.PathLike)) and not hasattr(log, "lidar"):
        return Placed(os.fsdecode(log))
    if isinstance(log, (list, tuple)) and log and all(isinstance(part, (str, os.PathLike)) for part in log):
        return Placed(os.fsdecode(log[0]) if len(log) == 1 else _bag(log, folder / "bag"))
    sized: Any = None if hasattr(log, "lidar") or not hasattr(log, "__len__") else log
    return Placed(str(folder / LOG_FILE), scans_of(log), None if sized is None else len(sized))


def spool(
    scans: Iterable[Scan],
    file: Path,
    total: int | None = None,
    progress: Progress = False,
    cancel: Event | None = None,
) -> None:
    """Writes scans into an MCAP file, one at a time. If they raise, no file remains."""
    listener = Listener(progress, cancel)
    writer = _core.ScanWriter(file)
    count = 0
    try:
        _go_on(listener)
        for scan in scans:
            writer.write(*_checked(count, scan))
            count += 1
            listener.progress("taking scans", "scans", count, total)
            _go_on(listener)
        if count == 0:
            raise InputError("the log has no scans")
        writer.finish()
    except BaseException:
        # A kept error would otherwise keep the writer.
        writer.abandon()
        raise
    finally:
        listener.close()


def _go_on(listener: Listener) -> None:
    if listener.is_cancelled():
        raise Cancelled("stopped before the end")


def scans_of(log: Any) -> Iterator[Scan]:
    """The scans of a dataset of kiss-icp or evalio, or of any iterable of scans."""
    if hasattr(log, "lidar") and callable(log.lidar):
        return (_of_evalio(measured) for measured in log.lidar())
    if hasattr(log, "__getitem__") and hasattr(log, "__len__") and not isinstance(log, AnySequence):
        return of_kiss(log)
    if hasattr(log, "__iter__"):
        return (_of_tuple(number, scan) for number, scan in enumerate(log))
    raise TypeError(f"a log is a path, a dataset or scans, not {type(log).__name__}")


def _of_tuple(number: int, scan: Any) -> Scan:
    if isinstance(scan, Scan):
        return scan
    if isinstance(scan, tuple) and 1 <= len(scan) <= 3:
        return Scan(*scan)
    if isinstance(scan, np.ndarray):
        return Scan(scan)
    raise InputError(f"scan {number}: a dmp.Scan is needed, not {type(scan).__name__}")


def _of_evalio(measured: Any) -> Scan:
    """The scan of a ``LidarMeasurement``: its points have times after the stamp."""
    points = np.asarray(measured.to_vec_positions(), np.float64).reshape(-1, 3)
    offsets = np.array([point.t.to_nsec() for point in measured.points], np.int64)
    return Scan(points, offsets, int(measured.stamp.to_nsec()))


def _checked(
    number: int, scan: Scan
) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.int64] | None, int]:
    """The scan as written; raises an error of one line if it is invalid."""
    try:
        points = np.asarray(scan.points)
    except ValueError as error:
        raise InputError(f"scan {number}: points are N × 3: {error}") from None
    if points.dtype.kind not in "fiu" or points.ndim != 2 or points.shape[1] != 3:
        shape = " × ".join(map(str, points.shape))
        raise InputError(f"scan {number}: points are N × 3 numbers, not {shape} of {points.dtype}")
    stamp_ns = number * PERIOD_NS if scan.stamp is None else _stamp_ns(number, scan.stamp)
    kept = np.ascontiguousarray(points, np.float32)
    return kept, None if scan.times is None else _offsets_ns(number, scan.times, kept), stamp_ns


def _stamp_ns(number: int, stamp: float | int) -> int:
    if isinstance(stamp, (int, np.integer)) and not isinstance(stamp, bool):
        stamp_ns = int(stamp)
    elif isinstance(stamp, (float, np.floating)) and np.isfinite(stamp):
        stamp_ns = nanoseconds(float(stamp))
    else:
        raise InputError(f"scan {number}: the stamp is seconds (float) or nanoseconds (int), not {stamp!r}")
    if not 0 <= stamp_ns + 2**31 * NS < 2**32 * NS:
        raise InputError(f"scan {number}: the stamp {stamp!r} is beyond 32 bits of seconds")
    return stamp_ns


def _offsets_ns(number: int, times: npt.ArrayLike, points: npt.NDArray[np.float32]) -> npt.NDArray[np.int64]:
    """Nanoseconds after the stamp. A point without an echo gets the stamp's time."""
    given, count = np.asarray(times), len(points)
    if given.shape != (count,) or given.dtype.kind not in "fiu":
        shape = " × ".join(map(str, given.shape))
        raise InputError(f"scan {number}: {count} points have {count} times, not {shape} of {given.dtype}")
    returned = came_back(points)
    refuse_not_finite(number, given, returned)
    values = np.where(returned, given, 0)
    if given.dtype.kind == "f":
        # Too large values become infinite and are rejected.
        with np.errstate(over="ignore"):
            values = values.astype(np.float64) * NS
    beyond = (values > _MOST_NS) | (values < -_MOST_NS)
    if beyond.any():
        first = int(np.argmax(beyond))
        unit = "s" if given.dtype.kind == "f" else "ns"
        raise InputError(f"scan {number}: time {first} is {given[first]} {unit}, further than 2.14 s from the stamp")
    return nearest(values) if given.dtype.kind == "f" else values.astype(np.int64)


def _bag(files: Sequence[Union[str, os.PathLike[str]]], folder: Path) -> str:
    """Writes a folder that lists the files of one bag, in order."""
    folder.mkdir()
    names = []
    for number, file in enumerate(files):
        path = Path(os.fsdecode(file)).absolute()
        names.append(f"part-{number}{path.suffix}")
        (folder / names[-1]).symlink_to(path)
    kind = "sqlite3" if names[0].endswith(".db3") else "mcap"
    lines = ["rosbag2_bagfile_information:", "  version: 5", f"  storage_identifier: {kind}"]
    lines += ["  relative_file_paths:", *(f"    - {name}" for name in names), ""]
    (folder / "metadata.yaml").write_text("\n".join(lines), encoding="utf-8")
    return str(folder)
