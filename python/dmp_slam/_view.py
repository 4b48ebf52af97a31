"""Shows a result in the viewer rerun."""

from __future__ import annotations

import os
from typing import Any, Sequence

import numpy as np
import numpy.typing as npt

from ._kept import Kept, by_frame

#: Errors are clipped at this for colours, metres.
_MOST_M = 0.5
#: From too near over as predicted to too far; and without prediction. Safe for red-green colour blindness.
_COLOURS = np.array([[33, 102, 172], [247, 247, 247], [178, 24, 43]], np.float64)
_UNKNOWN = np.array([110, 110, 110], np.uint8)
#: The viewer has 32 bits: positions farther away are shifted by whole kilometres.
_FAR_M = 10_000.0


def show(runs: Sequence[str], kept: Kept, save: str | os.PathLike[str] | None) -> None:
    """Sends all saved outputs of runs to rerun, or writes them into a recording."""
    try:
        import rerun
    except ImportError as error:
        raise ImportError("view needs rerun: pip install rerun-sdk") from error
    of_runs = [(run, kept.returns(run)) for run in runs]
    recording = rerun.RecordingStream("dmp")
    if save is None:
        recording.spawn()
    else:
        recording.save(os.fspath(save))
    for run, returns in of_runs:
        _run(rerun, recording, run, returns, kept)
    recording.flush()


def _run(rerun: Any, recording: Any, run: str, returns: npt.NDArray[np.void], kept: Kept) -> None:
    first = returns[:1]
    place = np.array([first[axis][0] for axis in "xyz"]) if len(first) else np.zeros(3)
    moved_m = np.round(place, -3) if np.abs(place).max() > _FAR_M else np.zeros(3)
    way = kept.trajectory(run)
    if way is not None:
        recording.log([run, "trajectory"], rerun.LineStrips3D([way - moved_m]), static=True)
    for frame, scan in by_frame(returns):
        recording.set_time("scan", sequence=frame)
        recording.set_time("time", duration=float(scan["time_s"][0]))
        places = np.stack([scan[axis] for axis in "xyz"], axis=1) - moved_m
        off_m = scan["signed_residual_m"]
        recording.log([run, "returns"], rerun.Points3D(places, colors=_coloured(off_m)))
        squares_m2 = np.minimum(np.square(off_m[np.isfinite(off_m)], dtype=np.float64), _MOST_M**2)
        if squares_m2.size:
            recording.log([run, "off_m"], rerun.Scalars(float(np.sqrt(squares_m2.mean()))))


def _coloured(off_m: npt.NDArray[np.float32]) -> npt.NDArray[np.uint8]:
    """Colours of signed errors."""
    part = np.clip(np.nan_to_num(off_m), -_MOST_M, _MOST_M) / _MOST_M + 1
    channels = [np.interp(part, [0, 1, 2], _COLOURS[:, channel]) for channel in range(3)]
    colours = np.stack(channels, axis=1).astype(np.uint8)
    colours[~np.isfinite(off_m)] = _UNKNOWN
    return colours
