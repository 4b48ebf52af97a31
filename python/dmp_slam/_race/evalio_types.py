"""Scans and what an IMU measured, as evalio takes them."""

from __future__ import annotations

from typing import Any, Iterator, Mapping

import numpy as np

from .._sweep import NS, Imu, Scan
from ..errors import InputError
from .grid import RECORD, Grid, records

#: Parameters of ours: ranges, metres; noise densities and random walks of the IMU, rad/s/√Hz, m/s²/√Hz, rad/s²/√Hz and m/s³/√Hz.
LIDAR = {"min_range": 1.5, "max_range": 100.0}
IMU = {"gyro": 1e-3, "accel": 1e-2, "gyro_bias": 1e-5, "accel_bias": 1e-4}
#: The numbers of types in a ``PointCloud2``.
_TYPES = {"<f4": 7, "<u4": 6, "|u1": 2}


def cloud(scan: Scan, grid: Grid | None, first_ns: int) -> Any:
    """A scan whose times count from ``first_ns``."""
    from evalio._cpp.helpers import DataType, Field, PointCloudMetadata, fill_col_row_major, pc2_to_evalio
    from evalio.types import Stamp

    fields = [Field(name=name, datatype=DataType(_TYPES[of[0].str]), offset=of[1]) for name, of in (RECORD.fields or {}).items()]
    points, step = records(scan, grid), RECORD.itemsize
    shape = {"width": len(points), "height": 1, "point_step": step, "row_step": step * len(points)}
    about = PointCloudMetadata(stamp=Stamp.from_nsec(first_ns), is_bigendian=0, is_dense=1, **shape)
    measured = pc2_to_evalio(about, fields, points.tobytes())
    fill_col_row_major(measured)
    return measured


def initialize(slam: Any, scan: Scan, rows: bool, given: Mapping[str, Any]) -> Grid | None:
    """Tells a pipeline of its parameters and sensors, of which ``scan`` is the first; returns the grid, if it takes rows."""
    from evalio.types import SE3, ImuParams, LidarParams

    if scan.times is None and (given.get("deskew") or scan.imu is not None):
        raise InputError("deskew takes the time of each point, and this log has none")
    grid, imu = Grid.of(scan) if rows else None, scan.imu
    slam.set_params({name: value for name, value in given.items() if name not in {**LIDAR, **IMU}})
    size = {"num_rows": grid.rows, "num_columns": grid.columns} if grid else {"num_rows": 1, "num_columns": 1}
    slam.set_lidar_params(LidarParams(**size, **{name: given[name] for name in LIDAR}))
    if imu is not None:
        rate = NS / float(np.median(np.diff(imu.stamps_ns)))
        slam.set_imu_params(ImuParams(rate=rate, gravity=ImuParams.down().gravity, **{name: given[name] for name in IMU}))
    slam.set_imu_T_lidar(SE3.from_mat(np.asfortranarray(imu_from_lidar(imu))))
    slam.initialize()
    return grid


def imu_from_lidar(imu: Imu | None) -> Any:
    """The pose of the LiDAR in the frame of poses."""
    return np.eye(4) if imu is None else imu.imu_from_lidar


def measurements(imu: Imu | None) -> Iterator[Any]:
    """Each measurement."""
    from evalio.types import ImuMeasurement, Stamp

    for stamp_ns, gyro, accel in [] if imu is None else zip(*imu[:3]):
        yield ImuMeasurement(Stamp.from_nsec(int(stamp_ns)), gyro, accel)
