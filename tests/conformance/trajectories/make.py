#!/usr/bin/env python3
"""Makes the trajectories and pose graphs here and the JSON beside them: see ../README.md."""

import math
import sys
from decimal import ROUND_HALF_EVEN, Decimal
from pathlib import Path

import gtsam
import numpy as np
from evo.core.trajectory import PosePath3D, PoseTrajectory3D
from evo.tools import file_interface

FOLDER = Path(__file__).resolve().parent
sys.path.insert(0, str(FOLDER.parent))

import shared as s  # noqa: E402

COUNT = 16


def write(name, content):
    s.write_json(FOLDER / f"{name}.json", content)


def text_ns(word):
    """Seconds in a text to nanoseconds: of the decimal, not of a double on the way."""
    return int((Decimal(word) * 1_000_000_000).quantize(Decimal(1), ROUND_HALF_EVEN))


def lines(path):
    return [line.replace(",", " ").split() for line in path.read_text().splitlines() if not line.startswith("#")]


def matrices(poses):
    stack = np.zeros((len(poses), 4, 4))
    for matrix, pose in zip(stack, poses):
        matrix[:3, :3], matrix[:3, 3], matrix[3, 3] = s.rotation(pose[3:]), pose[:3], 1
    return stack


def main():
    stamps = np.array([s.stamp_ns(scan) for scan in range(COUNT)])
    poses = np.array([s.pose_at(scan * 0.1) for scan in range(COUNT)])
    wxyz = np.roll(poses[:, 3:], 1, axis=1)

    # evo prints 18 digits behind the point of a double of seconds: the digits below 238 ns are the double's.
    trajectory = PoseTrajectory3D(poses[:, :3], wxyz, stamps / 1e9)
    file_interface.write_tum_trajectory_file(str(FOLDER / "evo.tum"), trajectory)
    rows = lines(FOLDER / "evo.tum")
    write("tum", {"files": ["evo.tum"], "format": "tum", "times": None, "stamps_ns": [text_ns(row[0]) for row in rows],
                  "poses": [[float(word) for word in row[1:]] for row in rows], "quaternion_tolerance": 1e-12})

    # As many SLAM programs print it: nine decimals, stamps to the nanosecond.
    with (FOLDER / "nine_decimals.tum").open("w") as file:
        file.write("# timestamp tx ty tz qx qy qz qw\n")
        for stamp, pose in zip(stamps, poses):
            file.write(f"{stamp // 10**9}.{stamp % 10**9:09d} " + " ".join(f"{value:.9f}" for value in pose) + "\n")
    rows = lines(FOLDER / "nine_decimals.tum")
    write("tum_nine_decimals", {
        "files": ["nine_decimals.tum"], "format": "tum", "times": None, "stamps_ns": stamps.tolist(),
        "poses": [[float(word) for word in row[1:]] for row in rows], "quaternion_tolerance": 1e-8})

    # numpy.savetxt gives the times their `%.18e`, as evo's KITTI rows have it. evo writes no EuRoC; it reads this one.
    np.savetxt(FOLDER / "times.txt", (stamps - s.START_NS) / 1e9)
    times = [text_ns(row[0]) for row in lines(FOLDER / "times.txt")]
    file_interface.write_kitti_poses_file(str(FOLDER / "evo_kitti.txt"), PosePath3D(poses_se3=list(matrices(poses))))
    euroc = FOLDER / "state_groundtruth.csv"
    with euroc.open("w") as file:
        file.write("#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z [], "
                   "v_RS_R_x [m s^-1], v_RS_R_y [m s^-1], v_RS_R_z [m s^-1], b_w_RS_S_x [rad s^-1], "
                   "b_w_RS_S_y [rad s^-1], b_w_RS_S_z [rad s^-1], b_a_RS_S_x [m s^-2], b_a_RS_S_y [m s^-2], "
                   "b_a_RS_S_z [m s^-2]\n")
        for stamp, pose, quaternion in zip(stamps, poses, wxyz):
            row = [*pose[:3], *quaternion, *[0.0] * 9]
            file.write(f"{stamp}," + ",".join(f"{value:.6f}" for value in row) + "\n")
    read = file_interface.read_euroc_csv_trajectory(str(euroc))
    rows = [[float(word) for word in row] for row in lines(euroc)]
    in_file = [row[1:4] + row[5:8] + [row[4]] for row in rows]
    assert np.array_equal(read.positions_xyz, np.array(in_file)[:, :3])
    write("euroc", {"files": ["state_groundtruth.csv"], "format": "euroc", "times": None, "stamps_ns": stamps.tolist(),
                    "poses": in_file, "quaternion_tolerance": 1e-5})

    whole = matrices(poses)
    exact = {"poses.npy": whole, "poses_fortran.npy": np.asfortranarray(whole), "poses_big.npy": whole.astype(">f8")}
    half = {"poses_f32.npy": whole.astype("<f4"), "poses_f32_big_fortran.npy": np.asfortranarray(whole.astype(">f4"))}
    for name, stack in (exact | half).items():
        np.save(FOLDER / name, stack)
    with (FOLDER / "poses_version2.npy").open("wb") as file:
        np.lib.format.write_array(file, whole, version=(2, 0))
    # As quaternions by the formula, not by matrices: the same to 1e-12.
    write("kitti", {"files": ["evo_kitti.txt"], "format": "kitti", "times": "times.txt", "stamps_ns": times,
                    "poses": s.rows(poses), "quaternion_tolerance": 1e-12})
    write("npy", {"files": [*exact, "poses_version2.npy"], "format": "npy", "times": "times.txt", "stamps_ns": times,
                  "poses": s.rows(poses), "quaternion_tolerance": 1e-12})
    write("npy_f32", {"files": [*half], "format": "npy", "times": "times.txt", "stamps_ns": times,
                      "poses": s.rows(np.hstack([poses[:, :3].astype("<f4").astype(float), poses[:, 3:]])),
                      "quaternion_tolerance": 1e-6})
    # What no reader should take for poses: another shape, integers.
    np.save(FOLDER / "not_poses_shape.npy", whole[:, :, :3])
    np.save(FOLDER / "not_poses_integers.npy", whole.astype("<i8"))
    write("npy_refused", {"refused": ["not_poses_shape.npy", "not_poses_integers.npy"], "format": "npy"})

    graphs(poses)


def graphs(poses):
    """By gtsam, whose own order of the six numbers of a pose is rotation, translation: in the file it is the other way
    round, and so is the information."""
    upper = np.diag([4.0, 5.0, 6.0, 7.0, 8.0, 9.0])
    upper[0, 1], upper[3, 5] = 0.5, -0.25
    noise = gtsam.noiseModel.Gaussian.Information(upper + np.triu(upper, 1).T)
    values, factors = gtsam.Values(), gtsam.NonlinearFactorGraph()
    placed = [gtsam.Pose3(matrix) for matrix in matrices(poses[:12])]
    for number, pose in enumerate(placed):
        values.insert(number, pose)
    pairs = [(number, number + 1) for number in range(11)] + [(11, 0), (7, 2)]
    for a, b in pairs:
        factors.add(gtsam.BetweenFactorPose3(a, b, placed[a].between(placed[b]), noise))
    gtsam.writeG2o(factors, values, str(FOLDER / "gtsam.g2o"))
    ids, in_file, edges = [], [], []
    for row in lines(FOLDER / "gtsam.g2o"):
        if row[0] == "VERTEX_SE3:QUAT":
            ids.append(int(row[1]))
            in_file.append([float(word) for word in row[2:]])
        else:
            assert row[0] == "EDGE_SE3:QUAT" and len(row) == 3 + 7 + 21
            edges.append({"from": int(row[1]), "to": int(row[2]), "pose": [float(word) for word in row[3:10]],
                          "information": [float(word) for word in row[10:]]})
    assert len(ids) == 12 and len(edges) == len(pairs)
    assert np.abs(np.array(in_file)[:, :3] - poses[:12, :3]).max() < 1e-5
    write("g2o", {"files": ["gtsam.g2o"], "format": "g2o", "times": None, "stamps_ns": None, "ids": ids,
                  "poses": in_file, "edges": edges, "quaternion_tolerance": 1e-5})

    values, factors = gtsam.Values(), gtsam.NonlinearFactorGraph()
    flat = [gtsam.Pose2(pose[0], pose[1], 0.03 * number) for number, pose in enumerate(poses[:4])]
    for number, pose in enumerate(flat):
        values.insert(number, pose)
    for number in range(3):
        factors.add(gtsam.BetweenFactorPose2(number, number + 1, flat[number].between(flat[number + 1]),
                                             gtsam.noiseModel.Isotropic.Sigma(3, 0.1)))
    gtsam.writeG2o(factors, values, str(FOLDER / "gtsam_flat.g2o"))
    ids, in_file, edges = [], [], []
    for row in lines(FOLDER / "gtsam_flat.g2o"):
        if row[0] == "VERTEX_SE2":
            ids.append(int(row[1]))
            x, y, turn = (float(word) for word in row[2:])
            in_file.append([x, y, 0.0, 0.0, 0.0, math.sin(turn / 2), math.cos(turn / 2)])
    write("g2o_flat", {"files": ["gtsam_flat.g2o"], "format": "g2o", "times": None, "stamps_ns": None, "ids": ids,
                       "poses": in_file, "edges": edges, "quaternion_tolerance": 1e-12})


if __name__ == "__main__":
    main()
