"""Compares `dmp truth smd` with scipy (cloud to cloud) and trimesh (cloud to mesh) on a real cloud.

    pip install scipy trimesh rtree "laspy[lazrs]" numpy
    python compare.py DMP CLOUD.laz

The mesh is the Delaunay triangulation of a part of the cloud's points over x and y. Fails where a number differs
by more than a micrometre.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import laspy
import numpy as np
import trimesh
from scipy.spatial import Delaunay, cKDTree

CAP_M = 1.0
TOLERANCE_M = 1.1e-6


def write_ply(path, vertices, faces=None):
    header = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\n"
    header += "".join(f"property double {axis}\n" for axis in "xyz")
    body = vertices.astype("<f8").tobytes()
    if faces is not None:
        header += f"element face {len(faces)}\nproperty list uchar int vertex_indices\n"
        rows = np.empty(len(faces), dtype=[("count", "u1"), ("corners", "<i4", 3)])
        rows["count"], rows["corners"] = 3, faces
        body += rows.tobytes()
    path.write_bytes(header.encode() + b"end_header\n" + body)


def smd(dmp, reference, evaluated):
    command = [dmp, "truth", "smd", str(reference), str(evaluated), "--json"]
    return json.loads(subprocess.run(command, check=True, capture_output=True).stdout)["maps"][0]


def compare(what, found, distances_m):
    capped = np.sort(np.minimum(distances_m, CAP_M))
    share = lambda s: capped[max(int(np.ceil(s * len(capped))), 1) - 1]
    expected = {
        "mean_m": capped.mean(),
        "median_m": share(0.5),
        "rmse_m": np.sqrt((capped**2).mean()),
        "std_m": capped.std(),
        "p95_m": share(0.95),
        "max_m": capped[-1],
    }
    assert found["count"] == len(capped) and found["beyond_cap"] == (distances_m > CAP_M).sum(), what
    for name, value in expected.items():
        print(f"{what:20} {name:9} dmp {found[name]:.9f}  other {value:.9f}")
        assert abs(found[name] - value) < TOLERANCE_M, (what, name)


def main(dmp, cloud):
    las = laspy.read(cloud)
    points = np.vstack([las.x, las.y, las.z]).T
    random = np.random.default_rng(1)
    with tempfile.TemporaryDirectory() as folder:
        a, b = Path(folder) / "reference.ply", Path(folder) / "map.ply"
        reference, moved = points[::2], points[1::2] + [0.03, -0.02, 0.05]
        write_ply(a, reference)
        write_ply(b, moved)
        found = smd(dmp, a, b)
        compare("to the cloud", found["accuracy"], cKDTree(reference).query(moved)[0])
        compare("from the cloud", found["completeness"], cKDTree(moved).query(reference)[0])

        some = lambda: points[random.choice(len(points), min(20_000, len(points) // 2), replace=False)]
        vertices, few = some(), some()
        middle = vertices.mean(0)
        faces = Delaunay(vertices[:, :2] - middle[:2]).simplices
        write_ply(a, vertices, faces)
        write_ply(b, few)
        # Counted from the middle: trimesh loses digits far from the origin.
        mesh = trimesh.Trimesh(vertices - middle, faces, process=False)
        distances_m = trimesh.proximity.closest_point(mesh, few - middle)[1]
        compare("to the mesh", smd(dmp, a, b)["accuracy"], distances_m)


if __name__ == "__main__":
    main(*sys.argv[1:])
