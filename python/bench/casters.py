"""Casters of Python as processes that cast on request: ``casters.py NAME FOLDER``.

One line of input is one request: ``load`` reads the rays and answers ``ok``, ``build`` makes what is cast into, casts one ray in a
thousand and answers with the seconds, ``go WAY THREADS`` casts all rays once and answers with the seconds, ``ranges FILE`` writes the
first range of each, NaN for a miss, and answers ``ok``.

Rays lie in memory as each caster takes them: float64 for dmp_slam and trimesh, float32 for Open3D and embreex. Triangles are those of
squares: two for each surfel, of the area of its disc, in its plane.
"""

from __future__ import annotations

import importlib
import importlib.metadata
import math
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

#: The radius of a surfel's disc by the edge of the map's voxels.
RADIUS_VOXELS = 0.8


def squares(folder: Path) -> tuple[Any, Any]:
    """Corners and triangles of all surfels."""
    import dmp_slam as dmp

    built = dmp.Map.open(folder / "drive.dmpmap")
    centres, normals = built.surfels()
    # The axis that the normal is least along gives a basis of the disc's plane.
    axes = np.eye(3)[np.abs(normals).argmin(axis=1)]
    across = np.cross(normals, axes)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    along = np.cross(normals, across)
    half = RADIUS_VOXELS * built.voxel * math.sqrt(math.pi) / 2
    corners = [centres + half * (u * across + v * along) for u, v in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    first = 4 * np.arange(len(centres)).reshape(-1, 1, 1)
    return np.stack(corners, axis=1).reshape(-1, 3), (first + [[0, 1, 2], [0, 2, 3]]).reshape(-1, 3)


class Caster:
    """What all have in common."""

    needs: tuple[str, ...] = ()
    dtype: Any = np.float64
    one_thread = False
    into = "two triangles a surfel"
    #: Ways to cast, and what comes back.
    ways: dict[str, str] = {}

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.origins, self.directions = (
            np.load(folder / f"{name}.npy").astype(self.dtype, copy=False) for name in ("origins", "directions")
        )

    @classmethod
    def versions(cls) -> list[str]:
        """Of what it needs, which must be there."""
        for name in cls.needs:
            importlib.import_module(name)
        return [f"{name} {importlib.metadata.version(name)}" for name in cls.needs]

    def build(self) -> None:
        raise NotImplementedError

    def go(self, way: str, threads: int, step: int = 1) -> Any:
        """Casts every ``step``-th ray."""
        raise NotImplementedError

    def ranges(self) -> Any:
        raise NotImplementedError


class Dmp(Caster):
    needs = ("dmp_slam",)
    into = "the map"
    ways = {
        "first": "z1 as float64",
        "measured": "z1 and zn as float64",
        "normals": "z1 as float64 and normals as float32",
    }

    def __init__(self, folder: Path) -> None:
        super().__init__(folder)
        self.measured = np.load(folder / "ranges.npy")

    def build(self) -> None:
        import dmp_slam as dmp

        self.map = dmp.Map.open(self.folder / "drive.dmpmap")

    def go(self, way: str, threads: int, step: int = 1) -> Any:
        origins, directions = self.origins[::step], self.directions[::step]
        if way == "measured":
            return self.map.cast(origins, directions, self.measured[::step], threads=threads)
        return self.map.cast(origins, directions, threads=threads, normals=way == "normals")

    def ranges(self) -> Any:
        return self.go("first", 1).z1


class Open3d(Caster):
    needs = ("open3d",)
    dtype = np.float32
    ways = {"first": "range, triangle, normal and place on it as float32 and uint32"}

    def __init__(self, folder: Path) -> None:
        super().__init__(folder)
        import open3d

        self.core = open3d.core
        self.rays = self.core.Tensor(np.hstack([self.origins, self.directions]))
        del self.origins, self.directions

    def build(self) -> None:
        import open3d

        corners, triangles = squares(self.folder)
        self.scene = open3d.t.geometry.RaycastingScene()
        corners, triangles = corners.astype(np.float32), triangles.astype(np.uint32)
        self.scene.add_triangles(self.core.Tensor(corners), self.core.Tensor(triangles))

    def go(self, way: str, threads: int, step: int = 1) -> Any:
        return self.scene.cast_rays(self.rays if step == 1 else self.rays[::step], nthreads=threads)

    def ranges(self) -> Any:
        found = self.go("first", 1)["t_hit"].numpy().astype(np.float64)
        return np.where(np.isfinite(found), found, np.nan)


class Embreex(Caster):
    needs = ("embreex",)
    dtype = np.float32
    one_thread = True
    ways = {"first": "range as float32"}

    def build(self) -> None:
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        corners, triangles = squares(self.folder)
        self.scene = EmbreeScene()
        self.mesh = TriangleMesh(self.scene, corners.astype(np.float32), triangles.astype(np.int32))

    def go(self, way: str, threads: int, step: int = 1) -> Any:
        return self.scene.run(self.origins[::step], self.directions[::step], query="DISTANCE")

    def ranges(self) -> Any:
        found = self.go("first", 1).astype(np.float64)
        return np.where(found < 1e30, found, np.nan)


class Trimesh(Caster):
    needs = ("trimesh", "embreex")
    one_thread = True
    ways = {"first": "place and triangle of each hit as float64 and int64", "ids": "triangle as int32: no range"}

    def build(self) -> None:
        import trimesh

        corners, triangles = squares(self.folder)
        self.mesh = trimesh.Trimesh(corners, triangles, process=False)

    def go(self, way: str, threads: int, step: int = 1) -> Any:
        origins, directions = self.origins[::step], self.directions[::step]
        if way == "ids":
            return self.mesh.ray.intersects_first(origins, directions)
        return self.mesh.ray.intersects_location(origins, directions, multiple_hits=False)

    def ranges(self) -> Any:
        places, rays, _ = self.go("first", 1)
        found = np.full(len(self.origins), np.nan)
        found[rays] = np.linalg.norm(places - self.origins[rays], axis=1)
        return found


CASTERS: dict[str, type[Caster]] = {
    "dmp_slam": Dmp,
    "open3d": Open3d,
    "embreex": Embreex,
    "trimesh + embreex": Trimesh,
}


def main() -> None:
    name, folder = sys.argv[1:]
    # What others print is no answer.
    answers, sys.stdout = sys.stdout, sys.stderr
    caster: Caster | None = None
    for line in sys.stdin:
        verb, *words = line.split()
        answer = "ok"
        if verb == "load":
            caster = CASTERS[name](Path(folder))
        elif caster is None:
            sys.exit(f"error: {line.strip()}: nothing is loaded")
        elif verb == "build":
            began = time.perf_counter()
            caster.build()
            caster.go("first", 1, 1000)
            answer = str(time.perf_counter() - began)
        elif verb == "go":
            began = time.perf_counter()
            found = caster.go(words[0], int(words[1]))
            answer = str(time.perf_counter() - began)
            # What came back is let go of between two casts, as its room is taken within one.
            del found
        elif verb == "ranges":
            np.save(words[0], caster.ranges())
        else:
            sys.exit(f"error: {line.strip()}: unknown request")
        print(answer, file=answers, flush=True)


if __name__ == "__main__":
    main()
