#!/usr/bin/env python3
"""Compares what `dmp drift` measures with small_gicp 1.0.1, live, on the same visits.

    pip install small_gicp==1.0.1 numpy
    python small_gicp_live.py --dmp target/release/dmp [--data DMP_DATA]

A simulated town and its truth, and, where --data names the folder of real recordings, NCLT and its run, both with their second
half moved by 1.5 m and turned by 1 degree. Both programs are given the same scans of each visit, put together by the poses of
the run, and what the run claims to begin with. Compared where `dmp drift` knows all directions: what both say, and in the town
what is true. Exits with 1 where the medians are over 2 cm or 0.1 degrees.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from importlib.metadata import version
from pathlib import Path

import numpy as np
import small_gicp

REACH_M = 40.0
MOST_M, MOST_DEG = 0.02, 0.1


def matrix(seven):
    x, y, z, w = np.asarray(seven[3:]) / np.linalg.norm(seven[3:])
    pose = np.eye(4)
    pose[:3, 3] = seven[:3]
    pose[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return pose


def nanoseconds(seconds):
    whole, _, part = seconds.partition(".")
    return int(whole) * 10**9 + int(part.ljust(9, "0")[:9])


class Run:
    """A trajectory, interpolated in its lines."""

    def __init__(self, path):
        rows = [line.split() for line in path.read_text().splitlines() if line and not line.startswith("#")]
        self.stamps_ns = np.array([nanoseconds(row[0]) for row in rows])
        self.poses = np.array([[float(n) for n in row[1:8]] for row in rows])
        for k in range(1, len(self.poses)):
            if self.poses[k, 3:] @ self.poses[k - 1, 3:] < 0:
                self.poses[k, 3:] *= -1

    def at(self, stamp_ns):
        after = int(np.clip(np.searchsorted(self.stamps_ns, stamp_ns, side="right"), 1, len(self.poses) - 1))
        before_ns, after_ns = self.stamps_ns[after - 1], self.stamps_ns[after]
        part = np.clip((stamp_ns - before_ns) / (after_ns - before_ns), 0.0, 1.0)
        return matrix((1 - part) * self.poses[after - 1] + part * self.poses[after])


def cloud(folder, visit, run, stamps_ns):
    """The visit's returns, in the frame of the sensor in its middle."""
    here = np.linalg.inv(run.at(stamps_ns[visit["scan"]]))
    parts = []
    for scan in visit["scans"]:
        points = np.fromfile(folder / f"{scan:06d}.bin", np.float32).reshape(-1, 4)[:, :3].astype(float)
        times = folder.parent / "times" / f"{scan:06d}.f32"
        after_s = np.fromfile(times, np.float32) if times.exists() else np.zeros(len(points))
        used = np.isfinite(points).all(axis=1) & (np.linalg.norm(points, axis=1) > 1.5)
        for at_s in np.unique(after_s[used]):
            pose = here @ run.at(stamps_ns[scan] + int(at_s * 1e9))
            parts.append(points[used & (after_s == at_s)] @ pose[:3, :3].T + pose[:3, 3])
    points = np.concatenate(parts)
    return points[np.linalg.norm(points, axis=1) <= REACH_M]


def registered(target, source, claimed):
    # As it is used: coarse, then fine.
    for leaf_m, reach_m in [(0.5, 3.0), (0.2, 0.6)]:
        claimed = small_gicp.align(
            target, source, init_T_target_source=claimed, registration_type="GICP", downsampling_resolution=leaf_m,
            max_correspondence_distance=reach_m, max_iterations=60,
        ).T_target_source
    return claimed


def apart(a, b):
    between = np.linalg.inv(a) @ b
    sine = np.linalg.norm(between[:3, :3] - between[:3, :3].T) / np.sqrt(8)
    return np.linalg.norm(a[:3, 3] - b[:3, 3]), np.degrees(np.arcsin(min(sine, 1.0)))


def compared(name, dmp, log, run_path, truth, work):
    run = Run(run_path)
    said = subprocess.run([dmp, "drift", log, "-t", f"run={run_path}", "--trust", "--json", "--quiet"],
                          capture_output=True, check=True, text=True).stdout
    report = json.loads(said)
    folder = work / name
    subprocess.run([dmp, "convert", "log", log, "-o", folder, "--quiet"], check=True, capture_output=True)
    scans = folder / "scans"
    times = folder / "times.txt"
    # Without stamps, the n-th scan has that of the n-th pose.
    stamps = [nanoseconds(line) for line in times.read_text().split()] if times.exists() else run.stamps_ns
    rows = {"dmp - small_gicp": [], "dmp - truth": [], "small_gicp - truth": []}
    claims = []
    for pair in report["visits"]:
        of_run = pair["runs"][0]
        if not of_run.get("off") or of_run["off"]["distance_m"] is None:
            continue
        first, second = (run.at(stamps[pair[which]["scan"]]) for which in ("first", "second"))
        claimed = np.linalg.inv(first) @ second
        theirs = registered(*(cloud(scans, pair[which], run, stamps) for which in ("first", "second")), claimed)
        mine = matrix(of_run["first_from_second"])
        claims.append(apart(mine, claimed))
        rows["dmp - small_gicp"].append(apart(mine, theirs))
        if truth:
            true_first, true_second = (truth.at(stamps[pair[which]["scan"]]) for which in ("first", "second"))
            right = np.linalg.inv(true_first) @ true_second
            rows["dmp - truth"].append(apart(mine, right))
            rows["small_gicp - truth"].append(apart(theirs, right))
    print(f"{name}: {len(claims)} pairs of visits, off by up to {max(c[0] for c in claims):.2f} m and "
          f"{max(c[1] for c in claims):.2f} deg")
    worst = [0.0, 0.0]
    for what, values in rows.items():
        if values:
            values = np.array(values)
            median, most = np.median(values, axis=0), values.max(axis=0)
            print(f"  {what:<20} median {100 * median[0]:5.2f} cm {median[1]:6.3f} deg,"
                  f" at most {100 * most[0]:5.2f} cm {most[1]:6.3f} deg")
            if what != "small_gicp - truth":
                worst = np.maximum(worst, median)
    return worst[0] <= MOST_M and worst[1] <= MOST_DEG


def moved_back(path, work):
    """The second half of a run, 1.5 m to the side and turned by 1 degree about its first pose."""
    run = Run(path)
    half = len(run.poses) // 2
    turn = np.radians(1.0) / 2
    rows = []
    for k, (ns, pose) in enumerate(zip(run.stamps_ns, run.poses)):
        x, y, z, qx, qy, qz, qw = pose
        if k >= half:
            (x0, y0), (c, s) = run.poses[half][:2], (np.cos(2 * turn), np.sin(2 * turn))
            x, y = x0 + c * (x - x0) - s * (y - y0) + 1.2, y0 + s * (x - x0) + c * (y - y0) - 0.9
            c, s = np.cos(turn), np.sin(turn)
            qx, qy, qz, qw = c * qx - s * qy, c * qy + s * qx, c * qz + s * qw, c * qw - s * qz
        rows.append(f"{ns // 10**9}.{ns % 10**9:09d} {x} {y} {z} {qx} {qy} {qz} {qw}\n")
    moved = work / "moved.tum"
    moved.write_text("".join(rows))
    return moved


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--dmp", type=lambda path: Path(path).resolve(), required=True)
    parser.add_argument("--data", type=Path)
    arguments = parser.parse_args()
    print(f"small_gicp {version('small_gicp')}")
    with tempfile.TemporaryDirectory() as work:
        work = Path(work)
        town, truth = work / "town.mcap", work / "town.truth.tum"
        subprocess.run([arguments.dmp, "simulate", "town", "-o", town, "--scans", "900", "--rate", "5", "--azimuth-steps", "450",
                        "--quiet", "--no-progress"], check=True, capture_output=True)
        agree = compared("town", arguments.dmp, town, moved_back(truth, work), Run(truth), work)
        if arguments.data:
            nclt = arguments.data / "nclt_revisit"
            run = moved_back(nclt / "poses_lidar_odometry.txt", work)
            agree &= compared("nclt", arguments.dmp, nclt / "scans", run, None, work)
    return 0 if agree else 1


if __name__ == "__main__":
    sys.exit(main())
