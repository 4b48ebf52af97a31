"""Writes runs in memory as trajectories for the core."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, Mapping, NamedTuple, Sequence, Union

import numpy as np
import numpy.typing as npt

from .errors import InputError, UsageError

#: A run: a file or topic as for the command, poses, or poses and their stamps.
Run = Union[str, "os.PathLike[str]", "npt.ArrayLike", "Poses", Any]
#: Runs by name, or files that give the names.
Runs = Union[Mapping[str, Run], Sequence[Union[str, "os.PathLike[str]"]], str, "os.PathLike[str]"]


#: File name of a run in memory.
FILES = ("poses.npy", "poses.tum", "times.txt")


class Poses(NamedTuple):
    """A trajectory in memory.

    ``poses`` are ``world_from_body``: N × 4 × 4 or N × 3 × 4, metres. ``stamps`` are N seconds (floats) or nanoseconds (integers);
    without them the n-th pose is that of the n-th scan.
    """

    poses: npt.ArrayLike
    stamps: npt.ArrayLike | None = None


def trajectories(runs: Runs, folder: Path) -> list[str]:
    """Runs as arguments of the command, ``NAME=FILE``; those in memory are written into the folder."""
    if isinstance(runs, (str, os.PathLike)):
        return [os.fsdecode(runs)]
    if not isinstance(runs, Mapping):
        if not all(isinstance(run, (str, os.PathLike)) for run in runs):
            raise TypeError("runs without names must be files: give a dict of names and runs")
        return [os.fsdecode(run) for run in runs]
    found = []
    for number, (name, run) in enumerate(runs.items()):
        check_name(name)
        found.append(f"{name}={trajectory(name, run, folder / f'run-{number}')}")
    return found


def check_name(name: Any) -> None:
    """Rejects an invalid name of a run."""
    if not isinstance(name, str) or not name or any(sign in name for sign in "=/\\"):
        raise UsageError(f"{name!r}: a run's name is a text without =, / and \\")


def in_file_of_its_name(name: str, suffix: str) -> str:
    """The path below its folder of a run in memory, whose format follows from its name."""
    return f"named/{name}{suffix}"


def trajectory(name: str, run: Run, folder: Path) -> str:
    """A run as an argument of the command; one in memory is written into a folder, which is created."""
    if isinstance(run, (str, os.PathLike)):
        return os.fsdecode(run)
    folder.mkdir()
    return str(_write(name, run, folder))


def _write(name: str, run: Any, folder: Path) -> Path:
    """Writes a run in memory; returns its file."""
    quaternions = getattr(run, "orientations_quat_wxyz", None)
    if quaternions is not None:
        return _write_evo(name, run, np.asarray(quaternions, np.float64), folder)
    given, stamps = run if isinstance(run, tuple) and len(run) == 2 else (run, None)
    poses = _floats(name, given)
    if poses.ndim != 3 or poses.shape[1:] not in ((4, 4), (3, 4)) or len(poses) == 0:
        raise InputError(f"run {name!r}: poses are N × 4 × 4 or N × 3 × 4, not {_shape(poses)}")
    _refuse_not_finite(name, poses.reshape(len(poses), -1))
    file = folder / "poses.npy"
    np.save(file, np.ascontiguousarray(poses))
    if stamps is not None:
        _write_times(folder / "times.txt", stamps_ns(f"run {name!r}", stamps, len(poses)))
    return file


def _write_evo(name: str, run: Any, quaternions: npt.NDArray[np.float64], folder: Path) -> Path:
    """Writes a ``PosePath3D`` or ``PoseTrajectory3D`` of evo: bit-identical with stamps, else as matrices."""
    stamps = getattr(run, "timestamps", None)
    if stamps is None:
        return _write(name, np.asarray(run.poses_se3, np.float64), folder)
    places = _floats(name, run.positions_xyz)
    rows = np.column_stack([places, np.roll(quaternions, -1, axis=1)])
    _refuse_not_finite(name, rows)
    lines = zip(stamps_ns(f"run {name!r}", stamps, len(rows)), rows.tolist())
    file = folder / "poses.tum"
    with file.open("w", encoding="ascii") as out:
        out.writelines(f"{seconds(ns)} {' '.join(map(repr, row))}\n" for ns, row in lines)
    return file


def stamps_ns(whose: str, stamps: npt.ArrayLike, count: int) -> list[int]:
    """Stamps in nanoseconds: integers are nanoseconds, floats seconds."""
    given = np.asarray(stamps)
    if given.shape == (count, 1):
        given = given[:, 0]
    if given.shape != (count,):
        raise InputError(f"{whose}: {count} stamps are needed, not {_shape(given)}")
    if given.dtype.kind in "iu":
        return [int(stamp) for stamp in given]
    if given.dtype.kind != "f":
        raise InputError(f"{whose}: stamps are seconds (floats) or nanoseconds (integers), not {given.dtype}")
    if not np.isfinite(given).all():
        raise InputError(f"{whose}: stamp {int(np.argmin(np.isfinite(given)))} is not finite")
    return [nanoseconds(float(stamp)) for stamp in given]


def nanoseconds(stamp_s: float) -> int:
    """The nanoseconds of the shortest decimal of these seconds, as a file would be read."""
    from decimal import Decimal

    return int((Decimal(repr(stamp_s)) * 1_000_000_000).to_integral_value())


def seconds(stamp_ns: int) -> str:
    """Nanoseconds as decimal seconds, with all digits."""
    sign, ns = ("-" if stamp_ns < 0 else ""), abs(stamp_ns)
    return f"{sign}{ns // 1_000_000_000}.{ns % 1_000_000_000:09d}"


def _write_times(file: Path, stamps: list[int]) -> None:
    with file.open("w", encoding="ascii") as out:
        out.writelines(f"{seconds(ns)}\n" for ns in stamps)


def _floats(name: str, values: npt.ArrayLike) -> npt.NDArray[np.float64]:
    try:
        return np.asarray(values, np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"run {name!r}: not a list of poses: {error}") from None


def _refuse_not_finite(name: str, rows: npt.NDArray[np.float64]) -> None:
    whole = np.isfinite(rows).all(axis=1)
    if not whole.all():
        raise InputError(f"run {name!r}: pose {int(np.argmin(whole))} is not finite")


def _shape(array: npt.NDArray[Any]) -> str:
    return " × ".join(map(str, array.shape)) or "one number"
