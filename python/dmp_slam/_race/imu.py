"""What an IMU measured during a log: from a topic, a file or a dataset."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, Iterable, Iterator, Sequence, Tuple, Union

import numpy as np
import numpy.typing as npt

from .._arguments import StrPath
from .._sweep import NS, Imu
from ..errors import InputError, UsageError

#: ``X,Y,Z,QX,QY,QZ,QW`` or a matrix.
Pose = Union[str, npt.ArrayLike, None]
#: An instant, nanoseconds, rad/s and m/s².
Row = Tuple[int, Sequence[float], Sequence[float]]

#: The mean length of accelerations: gravity, and some motion.
_GRAVITY_M_S2 = (8.0, 12.0)
#: How far scans may lie outside of what was measured, nanoseconds.
_OUTSIDE_NS = NS // 2
#: Fewest measurements for a scan.
_LEAST_A_SCAN = 2


def read(source: StrPath | None, log: Any, path: str, imu_from_lidar: Pose, stamps_ns: Sequence[int]) -> Imu:
    """The IMU of a log at ``path``, checked against the stamps of its scans."""
    if source is None and not brings_imu(log):
        raise UsageError("imu_from_lidar is given, but no imu: a topic, or a .csv")
    if source is None:
        name, rows = "imu of the dataset", _of_dataset(log.imu())
        imu_from_lidar = log.imu_T_lidar().to_mat() if imu_from_lidar is None else imu_from_lidar
    else:
        name = os.fsdecode(source)
        rows = _of_file(Path(name)) if name.endswith(".csv") else _of_topic(name, Path(path))
    found = list(rows)
    if not found:
        raise InputError(f"{name}: no measurement")
    stamps, gyro, accel = (np.array(column) for column in zip(*found))
    order = np.argsort(stamps, kind="stable")
    imu = Imu(stamps[order], gyro[order].astype(float), accel[order].astype(float), _matrix(imu_from_lidar))
    _check(name, imu, stamps_ns)
    return imu


def brings_imu(log: Any) -> bool:
    """Whether a log is a dataset with an IMU."""
    return callable(getattr(log, "imu", None))


def _of_dataset(measured: Iterable[Any]) -> Iterator[Row]:
    return ((one.stamp.to_nsec(), one.gyro, one.accel) for one in measured)


def _of_file(file: Path) -> Iterator[Row]:
    """The lines of ``imu0/data.csv`` of EuRoC."""
    try:
        lines = file.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise UsageError(f"{file}: {error}") from None
    for number, line in enumerate(lines, 1):
        if not line.strip() or line.startswith("#"):
            continue
        try:
            stamp, *values = line.split(",")
            row = int(stamp), [float(value) for value in values[:3]], [float(value) for value in values[3:]]
        except ValueError as error:
            raise InputError(f"{file}: line {number}: {error}") from None
        if len(values) != 6:
            raise InputError(f"{file}: line {number}: {len(values) + 1} values, not stamp in ns, three rad/s and three m/s²")
        yield row


def _of_topic(topic: str, log: Path) -> Iterator[Row]:
    """The ``sensor_msgs/Imu`` of a bag or an MCAP file."""
    try:
        from rosbags.highlevel import AnyReader, AnyReaderError
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise UsageError(f"{topic}: topics are read with rosbags: pip install 'dmp-slam[race]'") from None
    try:
        with AnyReader([log], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
            known = {one.topic: one for one in reader.connections if one.msgtype == "sensor_msgs/msg/Imu"}
            if topic not in known:
                raise UsageError(f"{log}: no IMU at {topic}; it has {', '.join(known) or 'none'}")
            for _, _, raw in reader.messages([known[topic]]):
                said: Any = reader.deserialize(raw, known[topic].msgtype)
                gyro, accel = said.angular_velocity, said.linear_acceleration
                stamp_ns = said.header.stamp.sec * NS + said.header.stamp.nanosec
                yield stamp_ns, (gyro.x, gyro.y, gyro.z), (accel.x, accel.y, accel.z)
    except (AnyReaderError, OSError) as error:
        raise UsageError(f"{topic}: {log} has no topics ({error}); give a .csv") from None


def _matrix(given: Pose) -> npt.NDArray[np.float64]:
    """A pose as 4 × 4."""
    if given is None:
        return np.eye(4)
    try:
        values = np.array(given.split(",") if isinstance(given, str) else given, float)
    except ValueError as error:
        raise UsageError(f"imu_from_lidar: {error}") from None
    matrix = np.eye(4)
    if values.shape == (7,) and np.linalg.norm(values[3:]) > 0:
        x, y, z, w = values[3:] / np.linalg.norm(values[3:])
        turned = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        matrix[:3, :3] += 2 * w * turned + 2 * turned @ turned
        matrix[:3, 3] = values[:3]
    elif values.shape in ((4, 4), (3, 4)):
        matrix[:3] = values[:3]
    else:
        raise UsageError("imu_from_lidar is X,Y,Z,QX,QY,QZ,QW in metres, or 4 × 4")
    rotation = matrix[:3, :3]
    if not np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-3) or np.linalg.det(rotation) < 0:
        raise UsageError("imu_from_lidar: its matrix is no rotation")
    return matrix


def _check(name: str, imu: Imu, stamps_ns: Sequence[int]) -> None:
    finite = np.isfinite(imu.gyro_rad_s).all(axis=1) & np.isfinite(imu.accel_m_s2).all(axis=1)
    if not finite.all():
        raise InputError(f"{name}: measurement {int(np.argmin(finite))} is not finite")
    mean_m_s2 = float(np.linalg.norm(imu.accel_m_s2, axis=1).mean())
    if not _GRAVITY_M_S2[0] < mean_m_s2 < _GRAVITY_M_S2[1]:
        raise InputError(f"{name}: the mean acceleration is {mean_m_s2:.3g}, not about 9.8 m/s² with gravity")
    first, last = int(imu.stamps_ns[0]), int(imu.stamps_ns[-1])
    if first > stamps_ns[0] + _OUTSIDE_NS or last < stamps_ns[-1] - _OUTSIDE_NS:
        measured, scanned = f"{first / NS:.3f} to {last / NS:.3f} s", f"{stamps_ns[0] / NS:.3f} to {stamps_ns[-1] / NS:.3f} s"
        raise InputError(f"{name}: it measured from {measured}, the scans are from {scanned}")
    during = int(((imu.stamps_ns >= stamps_ns[0] - _OUTSIDE_NS) & (imu.stamps_ns <= stamps_ns[-1] + _OUTSIDE_NS)).sum())
    if during < _LEAST_A_SCAN * len(stamps_ns):
        raise InputError(f"{name}: {during} measurements are too few for {len(stamps_ns)} scans")
