"""Open3D's RaycastingScene on the work files: surfels as regular octagons, one thread.

    cast.py SURFELS RAYS [--reps N] [--ranges OUT] [--serve]

Open3D casts triangles only, without a bound on the range: each disc becomes the regular octagon of the same
area, a fan of six triangles, so ranges near the rim of a disc differ. The only mode is `single`. With
--serve, one line of input is one request: `go single` casts all rays once and answers with the seconds,
`ranges single OUT` writes the ranges and answers `ok`, `rays FILE` goes over to other rays and answers `ok`; the
end of input ends the program.
"""

import argparse
import math
import statistics
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


def queries_of(rays):
    return o3d.core.Tensor(np.ascontiguousarray(rays[:, :6]))


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("surfels")
    parser.add_argument("rays")
    parser.add_argument("--reps", type=int, default=5)
    parser.add_argument("--ranges")
    parser.add_argument("--serve", action="store_true")
    arguments = parser.parse_args()

    surfels, rays = records(arguments.surfels), records(arguments.rays)
    start_s = time.perf_counter()
    corners, triangles = octagons(surfels)
    scene = o3d.t.geometry.RaycastingScene(nthreads=1)
    scene.add_triangles(o3d.core.Tensor(corners), o3d.core.Tensor(triangles))
    del corners, triangles
    queries = queries_of(rays)
    scene.cast_rays(queries[:1], nthreads=1)  # builds the tree
    build_s = time.perf_counter() - start_s

    def cast():
        start_s = time.perf_counter()
        answer = scene.cast_rays(queries, nthreads=1)
        taken_s = time.perf_counter() - start_s
        ranges = answer["t_hit"].numpy()
        return taken_s, np.where(np.isfinite(ranges), ranges, np.nan).astype("<f4")

    if arguments.serve:
        print(f"ready {len(surfels)} surfels, {len(rays)} rays, built in {build_s} s", flush=True)
        for line in sys.stdin:
            if line.startswith("rays "):
                queries = queries_of(records(line.rstrip("\n").split(" ", 1)[1]))
                print("ok", flush=True)
                continue
            verb, mode, *path = line.rstrip("\n").split(" ", 2)
            if mode != "single":
                sys.exit(f"error: {mode}: unknown mode")
            taken_s, ranges = cast()
            if verb == "go":
                print(taken_s, flush=True)
            elif verb == "ranges" and path:
                ranges.tofile(path[0])
                print("ok", flush=True)
            else:
                sys.exit(f"error: {line.rstrip()}: unknown request")
        return
    _, ranges = cast()  # warm
    speeds = [len(rays) / cast()[0] / 1e6 for _ in range(arguments.reps)]
    print(
        f"single: {len(surfels)} surfels built in {build_s:.3f} s; {len(rays)} rays, {np.isnan(ranges).sum()} misses; "
        f"{statistics.median(speeds):.3f} M rays/s ({min(speeds):.3f} to {max(speeds):.3f}, {len(speeds)} casts)"
    )
    if arguments.ranges:
        ranges.tofile(arguments.ranges)


main()
