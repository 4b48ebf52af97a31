"""Residuals of scans in a map, and their derivatives."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, NamedTuple, Sequence, Union

import numpy as np
import numpy.typing as npt

from ._map import Map
from ._sweep import NS, Scan
from .errors import InputError, UsageError

Floats = npt.NDArray[np.float64]

#: States of a return: a surfel predicts it; and it changes nearby, where that was probed; none as requested does, though the ray
#: meets the map; the ray meets nothing.
HELD, CHANGES, OTHER, MISS = range(4)


class Residuals(NamedTuple):
    """Residuals of N returns, and their derivatives; NaN where nothing predicts a return."""

    #: N: the predicted range z', metres.
    predicted: Floats
    #: N, metres: z − z', or the distance behind the surfel's plane as the sensor sees it; positive where the return is too far.
    residual: Floats
    #: N × 14: by rotation (rad) and translation (m) of the body, by those of the extrinsic, each a small motion behind the pose
    #: (``pose @ exp(motion)``), by the time offset (s; NaN without twists) and by the scale; ``None`` if not requested.
    jacobian: Floats | None
    #: N: 1 where a surfel predicts the return within the truncation, else 0.
    weights: Floats
    #: N, m²: min(residual², truncation²); the truncation's where only other surfels are on the ray; NaN where R_near or R_cv does
    #: not count the return. ``np.nanmean`` of it is the score.
    squares: Floats
    #: N: 0 a surfel predicts the return; 1 so it does, and a probe met another one; 2 none as requested, though the ray meets the
    #: map; 3 the ray meets nothing.
    state: npt.NDArray[np.uint8]
    #: N × 6: a point of the surfel's plane (m) and its unit normal, in the frame of the poses; for ``held``.
    planes: Floats


class Batch(NamedTuple):
    """Scans in one piece."""

    #: N × 3, float32 or float64.
    points: npt.NDArray[Any]
    #: N, seconds after the pose of each scan holds.
    times: Floats | None
    #: Behind the last return of each scan.
    ends: npt.NDArray[np.int64]

    @property
    def scan_of(self) -> npt.NDArray[np.int64]:
        """The scan of each return."""
        return np.repeat(np.arange(len(self.ends)), np.diff(self.ends, prepend=0))


Scans = Union[npt.ArrayLike, Scan, Sequence[Union[npt.ArrayLike, Scan]], Batch]


def batch(scans: Scans) -> Batch:
    """Scans in one piece: one scan alone, or a list of them. A single array is not copied."""
    if isinstance(scans, Batch):
        return scans
    many = [_scan(scan) for scan in (scans if _is_list(scans) else [scans])]  # type: ignore[union-attr]
    if not many:
        raise InputError("scans: there are none")
    points = many[0][0] if len(many) == 1 else np.concatenate([points for points, _ in many])
    ends = np.cumsum([len(points) for points, _ in many], dtype=np.int64)
    if any(times is None for _, times in many):
        return Batch(points, None, ends)
    return Batch(points, np.concatenate([times for _, times in many if times is not None]), ends)


def _is_list(scans: Any) -> bool:
    if isinstance(scans, (list, tuple)) and not isinstance(scans, Scan):
        return isinstance(scans[0], Scan) or np.ndim(scans[0]) == 2 if len(scans) else True
    return False


def _scan(scan: Any) -> tuple[npt.NDArray[Any], Floats | None]:
    given, times = (scan.points, scan.times) if isinstance(scan, Scan) else (scan, None)
    points = np.asarray(given)
    if points.ndim != 2 or points.shape[1] != 3 or points.dtype.kind not in "fiu":
        raise InputError(f"scan: points are N × 3 numbers, not {' × '.join(map(str, points.shape))} of {points.dtype}")
    points = np.ascontiguousarray(points, points.dtype if points.dtype in (np.float32, np.float64) else np.float64)
    if times is None:
        return points, None
    seconds = np.asarray(times)
    if seconds.shape != points.shape[:1] or seconds.dtype.kind not in "fiu":
        raise InputError(f"scan: {len(points)} points have {len(points)} times")
    return points, seconds.astype(np.float64) / (1 if seconds.dtype.kind == "f" else NS)


def residuals(
    map: Map,
    scan: Scans,
    pose: npt.ArrayLike,
    *,
    kind: str = "range",
    surfel: str = "nearest",
    extrinsic: npt.ArrayLike | None = None,
    twist: npt.ArrayLike | None = None,
    time_offset: float = 0.0,
    scale: float = 1.0,
    segments: npt.ArrayLike | None = None,
    truncation: float | None = None,
    probe: float | None = None,
    held: Residuals | None = None,
    jacobian: bool = True,
    threads: int | None = None,
) -> Residuals:
    """What a map predicts for the returns of scans, the residuals, and their derivatives while the surfels stay.

    ``scan`` is N × 3 in the sensor's frame (metres, float32 or float64), a ``Scan``, or a list of K of them; ``pose`` is 4 × 4 or
    K × 4 × 4, ``world_from_body`` in the frame of the map's trajectory. ``extrinsic`` is ``body_from_sensor``, 4 × 4. ``kind`` is
    ``"range"``, measured minus predicted range, or ``"plane"``, the distance from the surfel's plane.

    ``surfel`` predicts: the ``"first"`` on the ray, the ``"nearest"`` to the measured range within 5 m (R_near), or the first
    ``"independent"`` one (R_cv). The last needs ``segments``, those of the drive in which the scans were measured, a number for each:
    for a map of ``Map.build(…, segment="1scans")`` the number of the scan.

    ``twist`` is how the body turns (rad/s) and moves (m/s) in its own frame, 6 or K × 6. Returns with times are posed by it: times
    count from the instant of the pose, ``time_offset`` seconds are added. Without it a scan is rigid. ``scale`` is a factor on ranges.

    Residuals beyond ``truncation``, metres, have weight 0. ``probe``, metres, marks returns whose surfel changes that far to a side.
    ``held``, an earlier answer, holds its surfels instead of casting. ``threads`` defaults to the number of cores.
    """
    scans = batch(scan)
    count, of = len(scans.points), len(scans.ends)
    if surfel == "independent" and segments is None and held is None:
        raise UsageError("segments: independent surfels need the segment of each scan")
    for name, value in (("truncation", truncation), ("probe", probe), ("scale", scale), ("threads", threads)):
        if value is not None and not value > 0:
            raise UsageError(f"{name}: more than 0, not {value}")
    if held is not None and len(held.planes) != count:
        raise InputError(f"held: {len(held.planes)} returns, but the scans have {count}")
    asked = SimpleNamespace(
        points=scans.points,
        ends=scans.ends,
        poses=_numbers("pose", pose, (of, 4, 4)),
        extrinsic=_numbers("extrinsic", np.eye(4) if extrinsic is None else extrinsic, (1, 4, 4)),
        twists=None if twist is None else _numbers("twist", twist, (of, 6)),
        times=None if twist is None else scans.times,
        segments=None if segments is None else _segments(segments, of),
        later=float(time_offset),
        scale=float(scale),
        kind=kind,
        surfel=surfel,
        probe=probe,
        is_held=held is not None,
        threads=threads,
    )
    filled = SimpleNamespace(
        predicted=np.empty(count),
        residual=np.empty(count),
        jacobian=np.empty((count, 14)) if jacobian else None,
        planes=np.empty((count, 6)) if held is None else np.array(held.planes, np.float64),
        state=np.empty(count, np.uint8) if held is None else np.array(held.state, np.uint8),
    )
    try:
        map._core.residuals(asked, filled)
    except ValueError as error:
        raise InputError(str(error)) from None
    return _judged(filled, surfel, np.inf if truncation is None else truncation)


def _judged(filled: Any, surfel: str, truncation: float) -> Residuals:
    with np.errstate(invalid="ignore"):
        within = np.abs(filled.residual) <= truncation
        squares = np.minimum(filled.residual**2, truncation**2)
    if surfel == "nearest" and truncation < np.inf:
        squares[filled.state == OTHER] = truncation**2
    judged = {"weights": within.astype(np.float64), "squares": squares}
    return Residuals(**vars(filled), **judged)


def _segments(segments: npt.ArrayLike, count: int) -> npt.NDArray[np.int32]:
    numbers = np.atleast_1d(np.asarray(segments))
    if numbers.shape != (count,) or numbers.dtype.kind not in "iu":
        raise InputError(f"segments: {count} whole numbers are needed, one for each scan")
    return np.ascontiguousarray(numbers, np.int32)


def _numbers(name: str, values: npt.ArrayLike, shape: tuple[int, ...]) -> Floats:
    given = np.asarray(values, np.float64)
    if given.shape not in ((shape, shape[1:]) if shape[0] == 1 else (shape,)):
        raise InputError(f"{name}: {' × '.join(map(str, shape))} numbers are needed, not {' × '.join(map(str, given.shape))}")
    if not np.isfinite(given).all():
        raise InputError(f"{name}: not finite")
    return np.ascontiguousarray(given.reshape(shape))
