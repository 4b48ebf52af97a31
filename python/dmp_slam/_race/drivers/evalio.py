"""The pipelines of evalio that need no IMU."""

from __future__ import annotations

from typing import Any, Iterator, Mapping

import dmp_slam as dmp
from dmp_slam._race.grid import RECORD, Grid, records

#: By name: the class, whether it takes rows and columns, and where its poses hold, deskewed or not.
PIPELINES = {
    "kiss": ("KissICP", False, "end", "middle"),
    "genz": ("GenZICP", False, "middle", "middle"),
    "ct": ("CTICP", False, "start", "start"),
    "mad": ("MadICP", False, "end", "middle"),
    "loam": ("LOAM", True, "middle", "middle"),
    "form": ("FORM", True, "middle", "middle"),
}
OWN = {"min_range": 1.5, "max_range": 100.0}
#: The numbers of types in a ``PointCloud2``.
TYPES = {"<f4": 7, "<u4": 6, "|u1": 2}


def systems() -> dict[str, dmp.System]:
    import evalio
    from evalio._cpp import pipelines

    def system(name: str, grid: bool, *at: str) -> dmp.System:
        made = getattr(pipelines, name)
        parameters, version = {**made.default_params(), **OWN}, f"{made.version()} of evalio {evalio.__version__}"
        instant = lambda given: at[0 if given.get("deskew") else 1]
        return dmp.System(lambda scans, given: run(made(), grid, scans, given), parameters, version, instant)

    return {name: system(*of) for name, of in PIPELINES.items()}


def run(slam: Any, is_grid: bool, scans: Iterator[dmp.Scan], given: Mapping[str, Any]) -> Iterator[tuple[int, Any]]:
    from evalio._cpp.helpers import DataType, Field, PointCloudMetadata, fill_col_row_major, pc2_to_evalio
    from evalio.types import SE3, LidarParams, Stamp

    fields = [Field(name=name, datatype=DataType(TYPES[of[0].str]), offset=of[1]) for name, of in (RECORD.fields or {}).items()]
    slam.set_params({name: value for name, value in given.items() if name not in OWN})
    grid = None
    for number, scan in enumerate(scans):
        if given.get("deskew") and scan.times is None:
            raise dmp.InputError("deskew takes the time of each point, and this log has none")
        if number == 0:
            grid = Grid.of(scan) if is_grid else None
            size = {"num_rows": grid.rows, "num_columns": grid.columns} if grid else {"num_rows": 1, "num_columns": 1}
            slam.set_lidar_params(LidarParams(**size, **{name: given[name] for name in OWN}))
            slam.set_imu_T_lidar(SE3.identity())
            slam.initialize()
        points, step = records(scan, grid), RECORD.itemsize
        shape = {"width": len(points), "height": 1, "point_step": step, "row_step": step * len(points)}
        cloud = PointCloudMetadata(stamp=Stamp.from_nsec(scan.stamp), is_bigendian=0, is_dense=1, **shape)
        measured = pc2_to_evalio(cloud, fields, points.tobytes())
        fill_col_row_major(measured)
        slam.add_lidar(measured)
        slam.saved_features(), slam.saved_maps()
        yield from ((stamp.to_nsec(), pose.to_mat()) for stamp, pose in slam.saved_estimates())
