"""The process of one run: a driver gets the scans one by one, and its poses become a trajectory as TUM.

``python -m dmp_slam._race.worker DRIVER`` prints the systems of a driver as JSON; with an order, a ``.json``, it runs one of them.
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path
from typing import Any, Iterable, Iterator

import numpy as np

from .. import convert
from .._poses import Poses, trajectory
from .._sweep import Scan
from ..errors import Error, InputError
from .scans import Scans, instant_ns
from .system import load


def describe(driver: str) -> dict[str, Any]:
    """The systems of a driver, with versions and parameters."""
    offered = load(driver).items()
    return {name: {"version": one.version, "parameters": dict(one.parameters), "needs_imu": one.needs_imu} for name, one in offered}


def checked(found: Iterable[Any]) -> Iterator[tuple[int, Any]]:
    """What a system gives, pose by pose: a stamp in nanoseconds and a matrix."""
    for number, pair in enumerate(found):
        if not isinstance(pair, (tuple, list)) or len(pair) != 2:
            raise InputError(f"pose {number}: run() gave {type(pair).__name__}, not a pair of scan.stamp and a pose")
        stamp_ns, pose = pair
        if not isinstance(stamp_ns, (int, np.integer)):
            problem = f"{type(stamp_ns).__name__} in the place of the stamp: first scan.stamp, whole nanoseconds, then the pose"
            raise InputError(f"pose {number}: {problem}")
        if np.shape(pose) not in ((4, 4), (3, 4)):
            raise InputError(f"pose {number}: the shape is {np.shape(pose)}: world_from_sensor is 4 × 4 or 3 × 4")
        yield int(stamp_ns), pose


def run(order: dict[str, Any]) -> None:
    """Runs one system; writes its trajectory, and how long it took for the scans."""
    system, folder = load(order["driver"])[order["system"]], Path(order["folder"])
    at = system.instant(order["parameters"])
    # When the pose of a scan holds, by the scan's stamp.
    instants: dict[int, int] = {}

    def scans() -> Iterator[Scan]:
        kept = Scans(Path(order["scans"]), order["first"], order["last"])
        for scan in kept.measured() if system.needs_imu else kept:
            instants[int(scan.stamp or 0)] = instant_ns(scan, at)
            yield scan

    began_s = time.perf_counter()
    found = list(checked(system.run(scans(), order["parameters"])))
    facts = {"pose_at": at, "run_s": time.perf_counter() - began_s}
    if not found:
        raise InputError("the system gave no poses")
    stamps = [instants.get(stamp_ns, stamp_ns) for stamp_ns, _ in found]
    poses = trajectory(order["system"], Poses(np.array([pose for _, pose in found]), stamps), folder / "poses")
    convert.trajectory(poses, order["trajectory"], to="tum")
    (folder / "facts.json").write_text(json.dumps(facts), encoding="utf-8")


if __name__ == "__main__":
    try:
        if sys.argv[1].endswith(".json"):
            run(json.loads(Path(sys.argv[1]).read_text(encoding="utf-8")))
        else:
            # Whatever a driver prints as it is loaded does not come between.
            out, sys.stdout = sys.stdout, sys.stderr
            json.dump(describe(sys.argv[1]), out)
    except Error as error:
        sys.exit(str(error))
