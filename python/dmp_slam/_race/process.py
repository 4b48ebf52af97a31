"""Runs one process with a limit of memory and time, and looks at the trajectory that it leaves."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import time
from pathlib import Path
from typing import NamedTuple, Sequence

import numpy as np

from .._listener import Event
from ..errors import Cancelled, UsageError

#: How often a process is looked at, seconds.
_LOOK_S = 0.05
#: No vehicle is faster, metres per second.
_FASTEST_M_S = 300.0
#: How far the length of a quaternion may be from 1.
_QUATERNION_OFF = 0.01


class Limits(NamedTuple):
    """What one run may take."""

    time_s: float
    memory_bytes: int


class Ended(NamedTuple):
    """How a process ended."""

    #: Why its output does not count; ``None`` if it does.
    failed: str | None
    wall_s: float
    cpu_s: float
    peak_memory_bytes: int


def run(command: Sequence[str], said: Path, limits: Limits, cancel: Event | None = None) -> Ended:
    """Runs a command in a session of its own. Its output goes to a file. At the end none of its processes is left."""
    began_s = time.monotonic()
    with said.open("wb") as out:
        try:
            process = subprocess.Popen(
                command, stdin=subprocess.DEVNULL, stdout=out, stderr=subprocess.STDOUT, start_new_session=True
            )
        except OSError as error:
            return Ended(f"could not start: {error}", 0.0, 0.0, 0)
    failed, peak_bytes = None, 0
    try:
        while True:
            ended, status, used = os.wait4(process.pid, os.WNOHANG)
            wall_s = time.monotonic() - began_s
            if ended:
                break
            peak_bytes = max(peak_bytes, *_memory_bytes(process.pid))
            if failed is None:
                failed = _beyond(limits, wall_s, peak_bytes)
            if failed is not None or (cancel is not None and cancel.is_set()):
                _kill(process.pid)
            time.sleep(_LOOK_S)
        process.returncode = os.waitstatus_to_exitcode(status)
    finally:
        _kill(process.pid)
        process.wait()
    if cancel is not None and cancel.is_set():
        raise Cancelled("stopped before the end")
    failed = failed or _exit(process.returncode, said)
    return Ended(failed, wall_s, used.ru_utime + used.ru_stime, peak_bytes)


def _kill(session: int) -> None:
    try:
        os.killpg(session, signal.SIGKILL)
    except ProcessLookupError:
        pass


def _beyond(limits: Limits, wall_s: float, peak_bytes: int) -> str | None:
    if peak_bytes > limits.memory_bytes:
        return f"used more than {limits.memory_bytes / 1e6:.0f} MB of memory"
    if wall_s > limits.time_s:
        return f"did not end within {limits.time_s:.0f} s"
    return None


def _exit(code: int, said: Path) -> str | None:
    """What an exit code and the last line of the output say; ``None`` for success."""
    if code == 0:
        return None
    if code < 0:
        return f"was killed by {signal.Signals(-code).name}"
    lines = [line.strip() for line in _tail(said).splitlines() if line.strip()]
    return f"ended with exit code {code}" + (f": {lines[-1][:200]}" if lines else "")


def _tail(file: Path) -> str:
    with file.open("rb") as bytes_of:
        bytes_of.seek(max(0, file.stat().st_size - 4096))
        return bytes_of.read().decode("utf-8", "replace")


def _memory_bytes(process: int) -> tuple[int, int]:
    """What a process and its children hold now, and the most that one of them ever held; 0 if it has ended.

    Not what ``wait4`` reports: that begins with the memory of the process that started it.
    """
    folder = Path(f"/proc/{process}")
    try:
        lines = (folder / "status").read_text(encoding="utf-8", errors="replace").splitlines()
        children = [child for task in (folder / "task").iterdir() for child in (task / "children").read_text().split()]
    except OSError:
        return 0, 0
    known = {line.split()[0]: int(line.split()[1]) * 1024 for line in lines if line.startswith(("VmRSS:", "VmHWM:"))}
    of_children = [_memory_bytes(int(child)) for child in children]
    held = known.get("VmRSS:", 0) + sum(now for now, _ in of_children)
    return held, max([known.get("VmHWM:", 0), *(most for _, most in of_children)])


def nonsense(trajectory: Path, stamps_ns: Sequence[int]) -> str | None:
    """Why a trajectory is none of this log; ``None`` if it may be one."""
    try:
        rows = np.loadtxt(trajectory, ndmin=2)
    except (OSError, ValueError) as error:
        return f"wrote no trajectory: {str(error).splitlines()[0][:200]}"
    if rows.shape[1:] != (8,) or len(rows) < 2:
        return f"wrote {len(rows)} lines of {rows.shape[1] if rows.size else 0} numbers, not poses as TUM"
    finite = np.isfinite(rows).all(axis=1)
    if not finite.all():
        return f"wrote pose {int(np.argmin(finite))} that is not finite"
    off = abs(np.linalg.norm(rows[:, 4:], axis=1) - 1) > _QUATERNION_OFF
    if off.any():
        return f"wrote pose {int(np.argmax(off))} that is no rotation"
    steps_s = np.diff(rows[:, 0])
    if (steps_s <= 0).any():
        return f"wrote pose {int(np.argmax(steps_s <= 0)) + 1} that is not later than the one before"
    speeds = np.linalg.norm(np.diff(rows[:, 1:4], axis=0), axis=1) / steps_s
    if speeds.max() > _FASTEST_M_S:
        return f"moved at {speeds.max():.0f} m/s at pose {int(speeds.argmax()) + 1}"
    inside = (rows[:, 0] >= stamps_ns[0] / 1e9 - 1) & (rows[:, 0] <= stamps_ns[-1] / 1e9 + 1)
    if inside.sum() < max(2, len(stamps_ns) // 10):
        return f"wrote {int(inside.sum())} poses within the {len(stamps_ns)} scans"
    return None


def memory_bytes(given: float | str | None) -> int:
    """A limit in bytes: a number, or a text as ``"4 GB"``; by default three quarters of the memory that is available."""
    if given is None:
        lines = Path("/proc/meminfo").read_text(encoding="ascii").splitlines()
        return next(int(line.split()[1]) for line in lines if line.startswith("MemAvailable:")) * 1024 * 3 // 4
    units = {"": 1, "b": 1, "kb": 10**3, "mb": 10**6, "gb": 10**9, "kib": 1 << 10, "mib": 1 << 20, "gib": 1 << 30}
    found = re.fullmatch(r"\s*([\d.]+)\s*([a-z]*)\s*", str(given).lower())
    try:
        return int(float(found[1]) * units[found[2]])  # type: ignore[index]
    except (TypeError, KeyError, ValueError):
        raise UsageError(f"memory is bytes, or a number with MB or GB, not {given!r}") from None
