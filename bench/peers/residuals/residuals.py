"""Point-to-plane derivatives on one core: `dmp_slam.residuals` beside Open3D and small_gicp, in turns, on the same returns.

The returns are those of a simulated drive in its own map. Open3D gets the correspondences, so it casts and searches nothing: one
linear system. small_gicp searches the nearest of the map's surfels for each return: one step. `dmp_slam` casts each return, keeps
every residual, and returns all fourteen columns; `held` casts nothing.
"""

from __future__ import annotations

import os

os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")

import statistics
import tempfile
import time
from pathlib import Path
from typing import Callable

import numpy as np

import dmp_slam as dmp

RUNS, SCANS = 5, 100


def drive(folder: Path) -> tuple[dmp.Map, list[np.ndarray], np.ndarray]:
    log, truth = folder / "town.mcap", folder / "truth.txt"
    dmp.simulate.town(log, scans=SCANS, beams=32, truth=truth, progress=False)
    dmp.convert.log(log, folder / "scans", to="bin", progress=False)
    files = sorted((folder / "scans").rglob("*.bin"))
    points = [np.fromfile(file, np.float32).reshape(-1, 4)[:, :3].copy() for file in files]
    rows = np.loadtxt(truth).reshape(-1, 3, 4)
    poses = np.tile(np.eye(4), (len(rows), 1, 1))
    poses[:, :3] = rows
    log = [dmp.Scan(one) for one in points]
    return dmp.Map.build(log, poses, folder / "map.dmpmap", segment="1scans", progress=False), points, poses


def peers(map: dmp.Map, points: list[np.ndarray], poses: np.ndarray, held: dmp.Residuals) -> dict[str, Callable[[], object]]:
    found: dict[str, Callable[[], object]] = {}
    places = np.concatenate([one @ pose[:3, :3].T + pose[:3, 3] for one, pose in zip(points, poses)])
    centres, normals = map.surfels()
    try:
        import open3d as o3d

        have = np.flatnonzero(held.state < 2)
        source, target = o3d.geometry.PointCloud(), o3d.geometry.PointCloud()
        source.points = o3d.utility.Vector3dVector(places[have])
        target.points = o3d.utility.Vector3dVector(held.planes[have, :3])
        target.normals = o3d.utility.Vector3dVector(held.planes[have, 3:])
        pairs = o3d.utility.Vector2iVector(np.repeat(np.arange(len(have), dtype=np.int32)[:, None], 2, axis=1))
        step = o3d.pipelines.registration.TransformationEstimationPointToPlane()
        found[f"open3d {o3d.__version__}, pairs given"] = lambda: step.compute_transformation(source, target, pairs)
    except ImportError:
        print("no open3d: skipped")
    try:
        import small_gicp

        surfels, returns = small_gicp.PointCloud(centres), small_gicp.PointCloud(places)
        small_gicp.estimate_normals(surfels, num_neighbors=10)
        tree = small_gicp.KdTree(surfels)
        asked = {"registration_type": "PLANE_ICP", "num_threads": 1, "max_iterations": 1}
        found["small_gicp, one step"] = lambda: small_gicp.align(surfels, returns, tree, **asked)
    except ImportError:
        print("no small_gicp: skipped")
    return found


def main() -> None:
    with tempfile.TemporaryDirectory(dir="/var/tmp") as folder:
        map, points, poses = drive(Path(folder))
        numbers = np.arange(len(points))
        held = dmp.residuals(map, points, poses, surfel="first")

        def ours(**asked: object) -> Callable[[], object]:
            return lambda: dmp.residuals(map, points, poses, threads=1, **{"segments": numbers, **asked})

        ways = {
            "dmp_slam, range, first": ours(surfel="first"),
            "dmp_slam, range, nearest": ours(),
            "dmp_slam, plane, nearest": ours(kind="plane"),
            "dmp_slam, range, independent": ours(surfel="independent"),
            "dmp_slam, range, nearest, probed": ours(probe=1e-3),
            "dmp_slam, range, held": ours(held=held),
            **peers(map, points, poses, held),
        }
        taken: dict[str, list[float]] = {name: [] for name in ways}
        for run in range(RUNS + 1):
            for name, way in ways.items():
                start = time.process_time()
                way()
                if run > 0:
                    taken[name].append(time.process_time() - start)
        count = len(held.state)
        print(f"{count} returns, {len(map)} surfels, {RUNS} runs of each, in turns; M returns a second of the core, least - largest")
        for name, seconds in taken.items():
            rates = sorted(count / 1e6 / one for one in seconds)
            print(f"{name:36} {statistics.median(rates):6.2f}   {rates[0]:.2f} - {rates[-1]:.2f}")


if __name__ == "__main__":
    main()
