"""Runs KISS-ICP on an exported drive: odometry.py FOLDER OUT.tum --config default|coarse

FOLDER is what `cargo xtask study export` writes: scans/NNNNNN.bin (float32 x, y, z, intensity), times.txt (seconds)
and times/NNNNNN.f32 (float32 seconds after the stamp). FOLDER.truth.tum has the truth.
"""

import argparse
from pathlib import Path

import numpy as np
from kiss_icp.config import KISSConfig
from kiss_icp.kiss_icp import KissICP
from pyquaternion import Quaternion


def configured(name):
    """The settings of a run, and how many returns there are to each that is used."""
    config = KISSConfig()
    config.mapping.voxel_size = config.data.max_range / 100.0
    # More threads would add the same numbers in another order.
    config.registration.max_num_threads = 1
    if name == "default":
        return config, 1
    # What a hurried user gets: sweeps taken as rigid, large voxels, few returns, none from far away.
    config.data.deskew = False
    config.data.max_range = 40.0
    config.mapping.voxel_size = 2.0
    config.mapping.max_points_per_voxel = 5
    return config, 8


def run(folder, name):
    """Poses (4 × 4) of all scans, and the start and length of each sweep in seconds."""
    config, every = configured(name)
    odometry = KissICP(config)
    starts = (folder / "times.txt").read_text().split()
    poses, lengths = [], []
    for n in range(len(starts)):
        points = np.fromfile(folder / "scans" / f"{n:06}.bin", np.float32).reshape(-1, 4)[:, :3]
        times = np.fromfile(folder / "times" / f"{n:06}.f32", np.float32)
        odometry.register_frame(points[::every].astype(np.float64), times[::every].astype(np.float64))
        poses.append(odometry.last_pose.copy())
        lengths.append(float(times.max()))
    return poses, [int(start.replace(".", "")) for start in starts], lengths


def stamps_ns(starts_ns, lengths, share):
    return [start + round(share * length * 1e9) for start, length in zip(starts_ns, lengths)]


def ate(poses, stamps, truth):
    """RMSE of the places after rigid alignment (Umeyama 1991), metres."""
    ours = np.array([pose[:3, 3] for pose in poses])
    theirs = at_stamps(truth, stamps)[:, :3]
    a, b = ours - ours.mean(0), theirs - theirs.mean(0)
    u, _, vt = np.linalg.svd(b.T @ a)
    rotation = u @ np.diag([1, 1, np.sign(np.linalg.det(u @ vt))]) @ vt
    return float(np.sqrt(((b - a @ rotation.T) ** 2).sum(1).mean()))


def turn_error(poses, stamps, truth, scans=10):
    """RMSE of the turns over that many scans, radians: nearly free of drift, so it shows which instant is meant."""
    ours = np.unwrap([np.arctan2(pose[1, 0], pose[0, 0]) for pose in poses])
    theirs = at_stamps(truth, stamps)[:, 3]
    wrong = (ours[scans:] - ours[:-scans]) - (theirs[scans:] - theirs[:-scans])
    return float(np.sqrt((wrong**2).mean()))


def at_stamps(truth, stamps):
    """Place and heading at those instants; the truth covers all of the drive."""
    true_stamps, values = truth
    seconds, true_seconds = ([(stamp - true_stamps[0]) * 1e-9 for stamp in run] for run in (stamps, true_stamps))
    return np.stack([np.interp(seconds, true_seconds, column) for column in values.T], 1)


def read_tum(path):
    """Stamps in nanoseconds (all have nine decimals); places and headings."""
    rows = [line.split() for line in path.read_text().splitlines() if not line.startswith("#")]
    values = np.array([[float(x) for x in row[1:]] for row in rows])
    x, y, z, w = values[:, 3:].T
    headings = np.unwrap(np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)))
    return [int(row[0].replace(".", "")) for row in rows], np.column_stack([values[:, :3], headings])


def main():
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("folder", type=Path)
    arguments.add_argument("output", type=Path)
    arguments.add_argument("--config", choices=["default", "coarse"], default="default")
    given = arguments.parse_args()
    poses, starts_ns, lengths = run(given.folder, given.config)
    truth = read_tum(given.folder.with_suffix(".truth.tum"))
    # A sweep that was deskewed is in the frame of its last return; a rigid one fits best at its middle.
    share = 1.0 if given.config == "default" else 0.5
    print(f"{given.folder.name} {given.config}: {len(poses)} poses, stamped at {share} of the sweep")
    for tried in (0.0, 0.5, 1.0):
        stamps = stamps_ns(starts_ns, lengths, tried)
        error_m, error_rad = ate(poses, stamps, truth), turn_error(poses, stamps, truth)
        print(f"  at {tried}: ATE {error_m:.3f} m, turns over ten scans {error_rad:.5f} rad")
    with open(given.output, "w") as out:
        for pose, stamp in zip(poses, stamps_ns(starts_ns, lengths, share)):
            q = Quaternion(matrix=pose, rtol=1e-3, atol=1e-3)
            place = " ".join(f"{x:.4f}" for x in pose[:3, 3])
            turn = " ".join(f"{x:.6f}" for x in (q.x, q.y, q.z, q.w))
            out.write(f"{stamp // 10**9}.{stamp % 10**9 // 1000:06d} {place} {turn}\n")


if __name__ == "__main__":
    main()
