"""The pipelines of evalio."""

from __future__ import annotations

from collections import deque
from typing import Any, Iterator, Mapping

import dmp_slam as dmp
from dmp_slam._race.evalio_types import IMU, LIDAR, cloud, imu_from_lidar, initialize, measurements
from dmp_slam._race.scans import instant_ns

#: By name: the class, where its poses hold, deskewed or not, whether it takes rows and columns, and how many scans it is behind.
PIPELINES = {
    "kiss": ("KissICP", "end", "middle", False, 0),
    "genz": ("GenZICP", "middle", "middle", False, 0),
    "ct": ("CTICP", "start", "start", False, 0),
    "mad": ("MadICP", "end", "middle", False, 0),
    "loam": ("LOAM", "middle", "middle", True, 0),
    "form": ("FORM", "middle", "middle", True, 0),
    "dlio": ("DLIO", "middle", "middle", False, 0),
    "lio-sam": ("LioSAM", "middle", "middle", True, 2),
}
#: Of those that need an IMU, what differs from evalio's defaults: logs need not begin at rest, and LIO-SAM would use a scan every
#: 0.15 s and repeat the pose between them.
INERTIAL: dict[str, dict[str, Any]] = {"dlio": {"imu_calibrate": False}, "lio-sam": {"mappingProcessInterval": 0.0}}


def systems() -> dict[str, dmp.System]:
    import evalio
    from evalio._cpp import pipelines

    def system(name: str, kind: str, deskewed: str, raw: str, rows: bool, behind: int) -> dmp.System:
        made, own = getattr(pipelines, kind), {**LIDAR, **({**IMU, **INERTIAL[name]} if name in INERTIAL else {})}
        start = lambda scans, given: run(made(), rows, behind, scans, given)
        instant = lambda given: deskewed if given.get("deskew") else raw
        version = f"{made.version()} of evalio {evalio.__version__}"
        return dmp.System(start, {**made.default_params(), **own}, version, instant, name in INERTIAL)

    return {name: system(name, *of) for name, of in PIPELINES.items()}


def run(slam: Any, rows: bool, behind: int, scans: Iterator[dmp.Scan], given: Mapping[str, Any]) -> Iterator[tuple[int, Any]]:
    grid, recent, stamps = None, deque[Any](maxlen=behind + 1), {}
    for number, scan in enumerate(scans):
        grid = initialize(slam, scan, rows, given) if number == 0 else grid
        for measured in measurements(scan.imu):
            slam.add_imu(measured)
        recent.append(scan.stamp)
        first_ns = instant_ns(scan, "start")
        stamps[first_ns] = recent[0]
        slam.add_lidar(cloud(scan, grid, first_ns))
        slam.saved_features(), slam.saved_maps()
        poses = slam.saved_estimates()
        if number >= behind:
            # Poses are the IMU's.
            yield from ((stamps[stamp.to_nsec()], pose.to_mat() @ imu_from_lidar(scan.imu)) for stamp, pose in poses)
