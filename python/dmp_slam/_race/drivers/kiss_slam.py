"""KISS-SLAM: kiss-icp with loop closures."""

from __future__ import annotations

from importlib.metadata import version
from typing import Any, Iterator, Mapping

import numpy as np

import dmp_slam as dmp

#: Parameters by their place in the configuration.
PARAMETERS: dict[str, Any] = {
    "voxel_size": ("odometry", "mapping", 1.0),
    "deskew": ("odometry", "preprocessing", True),
    "min_range": ("odometry", "preprocessing", 1.5),
    "max_range": ("odometry", "preprocessing", 100.0),
    "splitting_distance": ("local_mapper", 100.0),
    "overlap_threshold": ("loop_closer", 0.4),
}


def systems() -> dict[str, dmp.System]:
    versions = f"{version('kiss-slam')}, kiss-icp {version('kiss-icp')}"
    parameters = {name: place[-1] for name, place in PARAMETERS.items()}
    return {"kiss-slam": dmp.System(run, parameters, versions, lambda given: "end" if given["deskew"] else "middle")}


def run(scans: Iterator[dmp.Scan], given: Mapping[str, Any]) -> Iterator[tuple[int, Any]]:
    from kiss_slam.config import load_config
    from kiss_slam.slam import KissSLAM

    config = load_config(None)
    for name, value in given.items():
        part: Any = config
        for step in PARAMETERS[name][:-1]:
            part = getattr(part, step)
        setattr(part, name, value)
    slam, stamps = KissSLAM(config), []
    for scan in scans:
        points = np.asarray(scan.points, np.float64)
        times = np.zeros(0) if scan.times is None else np.asarray(scan.times, np.float64)
        slam.process_scan(points, times)
        stamps.append(int(scan.stamp or 0))
    # As its own pipeline ends.
    slam.generate_new_node()
    slam.local_map_graph.erase_last_local_map()
    poses, _ = slam.fine_grained_optimization()
    yield from zip(stamps, poses)
