"""Logs that are in memory, or that other programs read: spooled into a log that the core reads, a scan at a time."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, Iterable, Iterator, NamedTuple, Sequence, Union

import numpy as np
import numpy.typing as npt

from . import _core
from ._poses import nanoseconds, stamps_ns
from .errors import InputError

#: A log: a path, the files of one bag in order, or scans.
Log = Union[str, "os.PathLike[str]", Sequence[Union[str, "os.PathLike[str]"]], Iterable[Any], Any]

_NS = 1_000_000_000
#: From one scan to the next where a dataset does not tell, nanoseconds: LiDARs turn ten times a second.
PERIOD_NS = _NS // 10
#: Where the next scan is so many times as late as the one before was, scans between them are missing.
_GAP = 1.5


class Scan(NamedTuple):
    """One sweep of the sensor.

    ``points`` are N × 3, metres in the sensor's frame; they are kept as float32. ``times`` are those of the points after the stamp,
    N seconds (floats) or nanoseconds (integers), ``None`` where the scan was corrected for its motion. ``stamp`` is in seconds
    (float) or nanoseconds (int); without one, scans are a tenth of a second apart.
    """

    points: npt.ArrayLike
    times: npt.ArrayLike | None = None
    stamp: float | int | None = None


def log_path(log: Log, folder: Path) -> str:
    """The path of a log; what is none is spooled into the folder."""
    # Datasets of evalio are texts, too.
    if isinstance(log, (str, os.PathLike)) and not hasattr(log, "lidar"):
        return os.fsdecode(log)
    if isinstance(log, (list, tuple)) and log and all(isinstance(part, (str, os.PathLike)) for part in log):
        return os.fsdecode(log[0]) if len(log) == 1 else _bag(log, folder / "bag")
    file = folder / "log.mcap"
    spool(scans_of(log), file)
    return str(file)


def spool(scans: Iterable[Scan], file: Path) -> None:
    """Writes scans into an MCAP file, one at a time. Where they raise, no file is left."""
    writer = _core.ScanWriter(file)
    count = 0
    for number, scan in enumerate(scans):
        writer.write(*_checked(number, scan))
        count += 1
    if count == 0:
        raise InputError("the log has no scans")
    writer.finish()


def scans_of(log: Any) -> Iterator[Scan]:
    """The scans of a dataset of kiss-icp or evalio, or of anything that gives scans."""
    if hasattr(log, "lidar") and callable(log.lidar):
        return (_of_evalio(measured) for measured in log.lidar())
    if hasattr(log, "__getitem__") and hasattr(log, "__len__") and not isinstance(log, (list, tuple)):
        return _of_kiss(log)
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
    """A ``LidarMeasurement``: its points have times after the stamp."""
    points = np.asarray(measured.to_vec_positions(), np.float64).reshape(-1, 3)
    offsets = np.array([point.t.to_nsec() for point in measured.points], np.int64)
    return Scan(points, offsets, int(measured.stamp.to_nsec()))


def _of_kiss(dataset: Any) -> Iterator[Scan]:
    """A dataset of kiss-icp: ``len(d)``, and ``d[i]`` with points and times.

    Times say where in its scan a point lies, on whatever scale: as in kiss-icp the first and the last are the scan's beginning and
    end, and the next scan begins there.
    """
    if hasattr(dataset, "reset"):
        dataset.reset()
    waiting: tuple[npt.NDArray[Any], npt.NDArray[Any], int] | None = None
    period_ns: int | None = None
    for number in range(len(dataset)):
        read = dataset[number]
        points, times = read if isinstance(read, tuple) else (read, ())
        stamp = _kiss_stamp(dataset, number)
        if waiting is not None:
            period_ns = _period_ns(stamp - waiting[2], period_ns)
            yield _within(*waiting, period_ns)
        waiting = (np.asarray(points), np.asarray(times).reshape(-1), stamp)
    if waiting is not None:
        yield _within(*waiting, PERIOD_NS if period_ns is None else period_ns)


def _period_ns(to_next_ns: int, before_ns: int | None) -> int:
    """How long a scan takes, by when the next one comes and by the scan before. A gap is no part of the scan before it."""
    if before_ns is not None and not 0 < to_next_ns < _GAP * before_ns:
        return before_ns
    return to_next_ns if to_next_ns > 0 else PERIOD_NS


def _kiss_stamp(dataset: Any, number: int) -> int:
    """The stamp of a scan that was just read, nanoseconds."""
    if hasattr(dataset, "get_frames_timestamps"):
        stamps = dataset.get_frames_timestamps()
        # Of a bag only those that were read are known.
        return stamps_ns(f"scan {number}", np.asarray(stamps[number]).reshape(-1), 1)[0]
    if hasattr(dataset, "scan_timestamps"):
        return int(dataset.scan_timestamps[number])
    return number * PERIOD_NS


def _within(points: npt.NDArray[Any], times: npt.NDArray[Any], stamp_ns: int, period_ns: int) -> Scan:
    if len(times) == 0:
        return Scan(points, None, stamp_ns)
    times = times.astype(np.float64)
    first, last = times.min(), times.max()
    share = (times - first) / (last - first) if last > first else np.zeros(len(times))
    return Scan(points, _nearest(share * period_ns), stamp_ns)


def _checked(
    number: int, scan: Scan
) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.int64] | None, int]:
    """A scan as it is written, or one line that says what is wrong with it."""
    try:
        points = np.asarray(scan.points)
    except ValueError as error:
        raise InputError(f"scan {number}: points are N × 3: {error}") from None
    if points.dtype.kind not in "fiu" or points.ndim != 2 or points.shape[1] != 3:
        shape = " × ".join(map(str, points.shape))
        raise InputError(f"scan {number}: points are N × 3 numbers, not {shape} of {points.dtype}")
    stamp_ns = number * PERIOD_NS if scan.stamp is None else _stamp_ns(number, scan.stamp)
    offsets = None if scan.times is None else _offsets_ns(number, scan.times, len(points))
    if offsets is not None and len(offsets):
        # A log counts from the first return.
        first = min(int(offsets.min()), 0)
        stamp_ns, offsets = stamp_ns + first, offsets - first
    return np.ascontiguousarray(points, np.float32), offsets, stamp_ns


def _stamp_ns(number: int, stamp: float | int) -> int:
    if isinstance(stamp, (int, np.integer)):
        return int(stamp)
    if not isinstance(stamp, (float, np.floating)) or not np.isfinite(stamp):
        raise InputError(f"scan {number}: the stamp is seconds (float) or nanoseconds (int), not {stamp!r}")
    return nanoseconds(float(stamp))


def _offsets_ns(number: int, times: npt.ArrayLike, count: int) -> npt.NDArray[np.int64]:
    given = np.asarray(times)
    if given.shape != (count,) or given.dtype.kind not in "fiu":
        shape = " × ".join(map(str, given.shape))
        raise InputError(f"scan {number}: {count} points have {count} times, not {shape} of {given.dtype}")
    if given.dtype.kind == "f":
        if not np.isfinite(given).all():
            raise InputError(f"scan {number}: time {int(np.argmin(np.isfinite(given)))} is not finite")
        given = _nearest(given.astype(np.float64) * _NS)
    return np.ascontiguousarray(given, np.int64)


def _nearest(values: npt.NDArray[np.float64]) -> npt.NDArray[np.int64]:
    """Whole numbers, halves away from zero: as the times of files are rounded."""
    whole = np.trunc(values)
    rest = values - whole
    return (whole + (rest >= 0.5) - (rest <= -0.5)).astype(np.int64)


def _bag(files: Sequence[Union[str, os.PathLike[str]]], folder: Path) -> str:
    """Files of one bag, in order, as a folder that names them."""
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
