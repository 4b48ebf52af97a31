"""Open3D's RaycastingScene on the work files: surfels as regular octagons, one thread.

    cast.py SURFELS RAYS

Open3D casts triangles only, without a bound on the range: each disc becomes the regular octagon of the same area, a fan of
six triangles, so ranges near the rim of a disc differ. The only mode is `single`. One line of input is one request:
`go single` casts all rays once and answers with the seconds, `ranges single OUT` writes the ranges and answers `ok`. The end
of input ends the program.
"""

import math
import sys
import time

import numpy as np
import open3d as o3d

CORNERS = 8
# Circumradius of the octagon with the area of a unit disc.
CIRCUMRADIUS = math.sqrt(2 * math.pi / (CORNERS * math.sin(2 * math.pi / CORNERS)))


def records(path):
    numbers = np.fromfile(path, dtype="<f4")
    if numbers.size % 7:
        sys.exit(f"error: {path}: {numbers.size} numbers are no whole records of 7")
    return numbers.reshape(-1, 7)


def octagons(surfels):
    """Corners and triangles of all discs."""
    centre, normal, radius = surfels[:, :3], surfels[:, 3:6], surfels[:, 6:7]
    # The axis that the normal is least along gives a basis of the disc's plane.
    axis = np.eye(3, dtype=np.float32)[np.abs(normal).argmin(axis=1)]
    u = np.cross(normal, axis)
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    v = np.cross(normal, u)
    corners = np.empty((len(surfels), CORNERS, 3), dtype=np.float32)
    for k in range(CORNERS):
        angle = 2 * math.pi * k / CORNERS
        corners[:, k] = centre + CIRCUMRADIUS * radius * (math.cos(angle) * u + math.sin(angle) * v)
    fan = np.array([[0, k, k + 1] for k in range(1, CORNERS - 1)], dtype=np.uint32)
    first = (CORNERS * np.arange(len(surfels), dtype=np.uint32)).reshape(-1, 1, 1)
    return corners.reshape(-1, 3), (first + fan).reshape(-1, 3)


def main():
    surfels, rays = (records(path) for path in sys.argv[1:])
    start_s = time.perf_counter()
    corners, triangles = octagons(surfels)
    scene = o3d.t.geometry.RaycastingScene(nthreads=1)
    scene.add_triangles(o3d.core.Tensor(corners), o3d.core.Tensor(triangles))
    del corners, triangles
    queries = o3d.core.Tensor(np.ascontiguousarray(rays[:, :6]))
    scene.cast_rays(queries[:1], nthreads=1)  # builds the tree
    print(f"ready {len(surfels)} surfels, {len(rays)} rays, built in {time.perf_counter() - start_s} s", flush=True)
    for line in sys.stdin:
        verb, mode, *path = line.rstrip("\n").split(" ", 2)
        if mode != "single":
            sys.exit(f"error: {mode}: unknown mode")
        start_s = time.perf_counter()
        answer = scene.cast_rays(queries, nthreads=1)
        taken_s = time.perf_counter() - start_s
        if verb == "go":
            print(taken_s, flush=True)
        elif verb == "ranges" and path:
            ranges = answer["t_hit"].numpy()
            np.where(np.isfinite(ranges), ranges, np.nan).astype("<f4").tofile(path[0])
            print("ok", flush=True)
        else:
            sys.exit(f"error: {line.rstrip()}: unknown request")


main()
