"""What the scripts in these folders share: a room to look at, the point layouts of drivers, and the JSON.

Nothing here reads or writes a format of its own: the files come from other software, and this module makes the
numbers that go into them.
"""

import json
import math
from fractions import Fraction

import numpy as np

START_NS = 1_700_000_000_123_456_789
PERIOD_NS = 100_000_000

# Half sizes of the room, metres, around the origin of the map.
ROOM_M = np.array([12.0, 9.0, 3.0])

DATATYPE_CODE = {"i1": 1, "u1": 2, "i2": 3, "u2": 4, "i4": 5, "u4": 6, "f4": 7, "f8": 8}
DATATYPE_NAME = {1: "int8", 2: "uint8", 3: "int16", 4: "uint16", 5: "int32", 6: "uint32", 7: "float32", 8: "float64"}


def layout(step, *fields):
    """A numpy record of `step` bytes from (name, type, offset) rows."""
    names, formats, offsets = zip(*fields)
    return np.dtype({"names": names, "formats": ["<" + f for f in formats], "offsets": offsets, "itemsize": step})


XYZ = [("x", "f4", 0), ("y", "f4", 4), ("z", "f4", 8)]

# velodyne_pointcloud of ROS 2, PointcloudXYZIRT: packed fields; `time` in seconds after the stamp of the scan.
VELODYNE = layout(22, *XYZ, ("intensity", "f4", 12), ("ring", "u2", 16), ("time", "f4", 18))
# ouster_ros, struct Point (os_point.h): PCL_ADD_POINT4D takes 16 bytes, EIGEN_ALIGN16 rounds up to 48; `t` in
# nanoseconds after the stamp. `ring` was uint8 in releases before 0.10, uint16 later; the offset stayed.
OUSTER = layout(48, *XYZ, ("intensity", "f4", 16), ("t", "u4", 20), ("reflectivity", "u2", 24), ("ring", "u2", 26),
                ("ambient", "u2", 28), ("range", "u4", 32))
OUSTER_OLD = layout(48, *XYZ, ("intensity", "f4", 16), ("t", "u4", 20), ("reflectivity", "u2", 24), ("ring", "u1", 26),
                    ("ambient", "u2", 28), ("range", "u4", 32))
# HesaiLidar_ROS_2.0, source_driver_ros2.hpp: packed fields; `timestamp` in seconds on the clock of the stamps.
HESAI = layout(26, *XYZ, ("intensity", "f4", 12), ("ring", "u2", 16), ("timestamp", "f8", 18))
# HesaiLidar_General_ROS, struct PointXYZIT of PCL: PCL_ADD_POINT4D, then a float, a double and the ring, 48 bytes.
HESAI_PCL = layout(48, *XYZ, ("intensity", "f4", 16), ("timestamp", "f8", 24), ("ring", "u2", 32))
# rslidar_sdk, source_pointcloud_ros.hpp with POINT_TYPE XYZIRT: packed; `timestamp` in seconds on the clock of the
# stamps, and with `ts_first_point: false` (its default) the stamp of the scan is that of the last point.
ROBOSENSE = HESAI
# livox_ros_driver2, lddc.cpp, LivoxPointXyzrtlt: packed; `timestamp` is a double that holds nanoseconds on the
# clock of the stamps.
LIVOX = layout(26, *XYZ, ("intensity", "f4", 12), ("tag", "u1", 16), ("line", "u1", 17), ("timestamp", "f8", 18))


def stamp_ns(scan, period_ns=PERIOD_NS):
    return START_NS + scan * period_ns


def quaternion(yaw_rad, pitch_rad=0.0, roll_rad=0.0):
    """x, y, z, w."""
    cy, sy = math.cos(yaw_rad / 2), math.sin(yaw_rad / 2)
    cp, sp = math.cos(pitch_rad / 2), math.sin(pitch_rad / 2)
    cr, sr = math.cos(roll_rad / 2), math.sin(roll_rad / 2)
    return np.array([sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy,
                     cr * cp * cy + sr * sp * sy])


def times(a, b):
    """Product of two quaternions x, y, z, w."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return np.array([aw * bx + ax * bw + ay * bz - az * by, aw * by - ax * bz + ay * bw + az * bx,
                     aw * bz + ax * by - ay * bx + az * bw, aw * bw - ax * bx - ay * by - az * bz])


def rotation(q):
    x, y, z, w = q
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ])


def compose(a_from_b, b_from_c):
    """Of poses (x, y, z, qx, qy, qz, qw)."""
    q = times(a_from_b[3:], b_from_c[3:])
    return np.concatenate([a_from_b[:3] + rotation(a_from_b[3:]) @ b_from_c[:3], q / np.linalg.norm(q)])


def pose_at(time_s):
    """A drive on an arc with a little pitch and roll: (x, y, z, qx, qy, qz, qw), f64."""
    yaw = 0.3 * time_s
    place = [2.0 * math.sin(yaw), 2.0 * (1 - math.cos(yaw)), 0.1 * math.sin(time_s)]
    return np.concatenate([place, quaternion(yaw, 0.02 * math.sin(1.3 * time_s), 0.015 * math.cos(time_s))])


def look(rng, scan, rings, columns):
    """A spin in the room: points (rings, columns, 3) in the sensor's frame, float32, and the share of the spin that
    had passed at each, (rings, columns). One direction after the other; all rings of a column at once."""
    azimuth = np.arange(columns) / columns * 2 * np.pi
    elevation = np.linspace(-0.26, 0.26, rings)
    directions = np.stack(np.broadcast_arrays(
        np.cos(elevation)[:, None] * np.cos(azimuth), np.cos(elevation)[:, None] * np.sin(azimuth),
        np.sin(elevation)[:, None]), axis=-1)
    pose = pose_at(scan * PERIOD_NS * 1e-9)
    in_map = directions @ rotation(pose[3:]).T
    with np.errstate(divide="ignore"):
        range_m = np.min((np.copysign(ROOM_M, in_map) - pose[:3]) / in_map, axis=-1)
    range_m += rng.normal(scale=0.01, size=range_m.shape)
    shares = np.broadcast_to(np.arange(columns) / columns, range_m.shape)
    return (directions * range_m[..., None]).astype("<f4"), shares


def whole_ns(value, unit_ns):
    """A stored number of a unit in nanoseconds, exactly; that it is not halfway between two is asserted, so that no
    way to round can differ."""
    exact = Fraction(value) * unit_ns
    assert (exact * 2).denominator != 1 or exact.denominator == 1, value
    return round(exact)


def number(value):
    """Shortest text that gives back the same float32 or float64, as the float64 that JSON prints; null otherwise."""
    if not np.isfinite(value):
        return None
    shortest = float(str(value))
    assert type(value)(shortest) == value
    return shortest


def rows(array):
    return [[number(value) for value in row] for row in array]


def write_json(path, content):
    """One line a row of numbers, the rest indented: short, and a change shows where it is."""
    def lay(value, indent):
        pad = " " * indent
        flat = json.dumps(value, separators=(",", ":"))
        if not isinstance(value, (list, dict)) or (len(flat) <= 100 and "{" not in flat[1:]):
            return flat
        if isinstance(value, dict):
            inner = [f"{pad} {json.dumps(key)}: {lay(entry, indent + 1)}" for key, entry in value.items()]
            return "{\n" + ",\n".join(inner) + "\n" + pad + "}"
        if all(isinstance(entry, (int, float, type(None))) or
               (isinstance(entry, list) and all(isinstance(e, (int, float, type(None))) for e in entry))
               for entry in value):
            lines, line = [], ""
            for entry in value:
                text = json.dumps(entry, separators=(",", ":"))
                if line and len(line) + len(text) > 110:
                    lines.append(line)
                    line = ""
                line += ("," if line else "") + text
            return "[\n" + ",\n".join(lines + [line]) + "]"
        return "[\n" + ",\n".join(f"{pad} {lay(entry, indent + 1)}" for entry in value) + "]"

    text = lay(content, 0) + "\n"
    assert json.loads(text) == json.loads(json.dumps(content))
    path.write_text(text)


def pointcloud2(cloud, time_field, unit_ns, absolute, stamp):
    """A filled array of one of the layouts as the parts of a PointCloud2, and as the JSON has it.

    An absolute time is on the clock of the stamps."""
    height, width = cloud.shape
    fields = [(name, offset, DATATYPE_CODE[kind.str[1:]], 1) for name, (kind, offset) in cloud.dtype.fields.items()]
    points = np.stack([cloud[name].ravel() for name in "xyz"], axis=1)
    offsets = None
    if time_field:
        offsets = [whole_ns(value.item(), unit_ns) - (stamp if absolute else 0) for value in cloud[time_field].ravel()]
    message = {"height": height, "width": width, "fields": fields, "point_step": cloud.dtype.itemsize,
               "row_step": cloud.dtype.itemsize * width, "data": cloud.tobytes(),
               "is_dense": bool(np.isfinite(points).all())}
    return message, {"stamp_ns": stamp, "points": rows(points), "offsets_ns": offsets}


UNIT_NAME = {1_000_000_000: "s", 1: "ns"}


def layout_json(kind, time_field, unit_ns, absolute):
    field = None
    if time_field:
        datatype = DATATYPE_NAME[DATATYPE_CODE[kind.fields[time_field][0].str[1:]]]
        field = {"name": time_field, "datatype": datatype, "unit": UNIT_NAME[unit_ns],
                 "from": "clock" if absolute else "stamp"}
    return {"point_step": kind.itemsize, "time_field": field}
