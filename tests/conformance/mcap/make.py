#!/usr/bin/env python3
"""Makes the logs in this folder and the JSON beside them: see ../README.md for how, and for what the JSON means."""

import sys
import tempfile
from pathlib import Path

import numpy as np
from rosbags.rosbag2 import CompressionFormat, CompressionMode

FOLDER = Path(__file__).resolve().parent
sys.path.insert(0, str(FOLDER.parent))

import shared as s  # noqa: E402
import ros  # noqa: E402

SECOND = 1_000_000_000
# From the end of a scan until its message is in the log.
DELAY_NS = 1_234_567
BAG_ZSTD = (CompressionMode.STORAGE, CompressionFormat.ZSTD)


def fill(kind, rng, scan, rings, columns, organised=False):
    """A scan in a driver's layout, without its time field: (cloud, share of the spin). Not organised: one row, in the
    order of time."""
    points, shares = s.look(rng, scan, rings, columns)
    cloud = np.zeros((rings, columns), kind)
    for axis, name in enumerate("xyz"):
        cloud[name] = points[..., axis]
    names = cloud.dtype.names
    if "intensity" in names:
        cloud["intensity"] = rng.integers(1, 256, size=cloud.shape)
    for name in {"ring", "line"} & set(names):
        cloud[name] = np.arange(rings)[:, None]
    if "range" in names:
        cloud["range"] = np.round(np.linalg.norm(points, axis=-1) * 1000)
    if organised:
        return cloud, shares
    # Field by field into zeros: a copy of a record leaves what lies between its fields to chance.
    row = np.zeros((1, cloud.size), kind)
    row[0] = cloud.T.reshape(-1)
    return row, shares.T.reshape(1, -1)


def log_of(topic, frame_id, kind, time_field, unit_ns, absolute, clouds):
    """(messages, the topic's JSON) of (stamp, filled array) rows."""
    log, scans = [], []
    for stamp, cloud in clouds:
        parts, scan = s.pointcloud2(cloud, time_field, unit_ns, absolute, stamp)
        log_ns = stamp + s.PERIOD_NS + DELAY_NS
        log.append((topic, ros.POINTS, log_ns, ros.point_cloud(stamp, frame_id, parts)))
        scans.append({"log_time_ns": log_ns, **scan})
    shape = clouds[0][1].shape
    return log, {"topic": topic, "type": ros.POINTS, "kind": "scans", "frame_id": frame_id,
                 **s.layout_json(kind, time_field, unit_ns, absolute), "height": shape[0], "width": shape[1],
                 "scans": scans}


def velodyne(rng, topic="/velodyne_points", frame_id="velodyne", scans=3):
    """`time` runs from 0 at the first point, so the stamp is the start of the scan."""
    clouds = []
    for scan in range(scans):
        cloud, shares = fill(s.VELODYNE, rng, scan, 8, 8)
        cloud["time"] = shares * 0.0998 + np.tile(np.arange(8) * 2.304e-6, 8)
        clouds.append((s.stamp_ns(scan), cloud))
    return log_of(topic, frame_id, s.VELODYNE, "time", SECOND, False, clouds)


def ouster(rng, kind, hole):
    """Organised, a row a beam; `t` is the same in a column. What did not come back is (0, 0, 0) or NaN."""
    clouds = []
    for scan in range(3):
        cloud, shares = fill(kind, rng, scan, 8, 6, organised=True)
        cloud["t"] = np.round(shares * 99_960_320)
        for name in "xyz":
            cloud[name][3, :] = hole
            cloud[name][5, 2:5] = hole
        cloud["range"][3, :] = 0
        clouds.append((s.stamp_ns(scan), cloud))
    return log_of("/ouster/points", "os_lidar", kind, "t", 1, False, clouds)


def clock_seconds(rng, topic, frame_id, kind, stamp_of_last):
    """`timestamp` in seconds on the clock of the stamps; the stamp is the first or the last point's, from the double."""
    clouds = []
    for scan in range(3):
        cloud, shares = fill(kind, rng, scan, 8, 6)
        cloud["timestamp"] = (s.stamp_ns(scan) + np.round(shares * 99_900_000)) / 1e9
        if stamp_of_last:
            for name in "xyz":
                cloud[name][0, 20:24] = np.nan
        stamp = s.whole_ns(cloud["timestamp"][0, -1 if stamp_of_last else 0].item(), SECOND)
        clouds.append((stamp, cloud))
    return log_of(topic, frame_id, kind, "timestamp", SECOND, True, clouds)


def livox(rng, topic="/livox/lidar", scans=3):
    """`timestamp` is a double that holds nanoseconds on the clock of the stamps: the nearest 256 ns."""
    clouds = []
    for scan in range(scans):
        cloud, shares = fill(s.LIVOX, rng, scan, 4, 12)
        cloud["timestamp"] = (s.stamp_ns(scan) + np.round(shares * 99_990_000)).astype("<f8")
        clouds.append((s.stamp_ns(scan), cloud))
    return log_of(topic, "livox_frame", s.LIVOX, "timestamp", 1, True, clouds)


def livox_custom(rng):
    """CustomMsg; `timebase` is the stamp in the driver, and `offset_time` counts from it. In the last scan `timebase` is
    the sensor's time since it was switched on while the header has the computer's, as in logs of the older driver and
    of restamped topics: offsets count from the stamp of the header all the same."""
    log, scans = [], []
    for scan in range(3):
        cloud, shares = fill(s.LIVOX, rng, scan, 4, 12)
        stamp = s.stamp_ns(scan)
        timebase = 812_345_678_901 if scan == 2 else stamp
        offsets = np.round(shares * 99_990_000).astype(int)
        points = [{"offset_time": int(offset), "x": row["x"].item(), "y": row["y"].item(), "z": row["z"].item(),
                   "reflectivity": int(row["intensity"]), "tag": 16, "line": int(row["line"])}
                  for offset, row in zip(offsets[0], cloud[0])]
        log_ns = stamp + s.PERIOD_NS + DELAY_NS
        log.append(("/livox/lidar", ros.CUSTOM, log_ns, ros.custom_message(stamp, "livox_frame", timebase, points)))
        scans.append({"log_time_ns": log_ns, "stamp_ns": stamp, "timebase_ns": timebase,
                      "points": s.rows(np.stack([cloud[0][name] for name in "xyz"], axis=1)),
                      "offsets_ns": offsets[0].tolist()})
    field = {"name": "offset_time", "datatype": "uint32", "unit": "ns", "from": "stamp"}
    return log, {"topic": "/livox/lidar", "type": ros.CUSTOM, "kind": "scans", "frame_id": "livox_frame",
                 "point_step": None, "time_field": field, "height": 1, "width": 48, "scans": scans}


def big_endian(rng):
    """x, y, z, time as big-endian float64, float32: `is_bigendian` is set; rows are padded by 8 bytes."""
    kind = np.dtype([("x", ">f8"), ("y", ">f8"), ("z", ">f8"), ("time", ">f4")])
    log, scans = [], []
    for scan in range(2):
        seen, shares = fill(s.VELODYNE, rng, scan, 4, 12, organised=True)
        cloud = np.zeros(seen.shape, kind)
        for name in "xyz":
            cloud[name] = seen[name].astype(float) + 1e-9
        cloud["time"] = shares * 0.0998
        stamp = s.stamp_ns(scan)
        native = cloud.astype(kind.newbyteorder("<"))
        parts, expected = s.pointcloud2(native, "time", SECOND, False, stamp)
        parts["row_step"] += 8
        parts["data"] = b"".join(row.tobytes() + b"\xff" * 8 for row in cloud)
        parts["is_bigendian"] = True
        log_ns = stamp + s.PERIOD_NS + DELAY_NS
        log.append(("/points", ros.POINTS, log_ns, ros.point_cloud(stamp, "lidar", parts)))
        scans.append({"log_time_ns": log_ns, **expected})
    field = {"name": "time", "datatype": "float32", "unit": "s", "from": "stamp"}
    return log, {"topic": "/points", "type": ros.POINTS, "kind": "scans", "frame_id": "lidar", "point_step": 28,
                 "time_field": field, "height": 4, "width": 12, "scans": scans}


def without_time(rng):
    kind = s.layout(16, *s.XYZ, ("intensity", "f4", 12))
    clouds = [(s.stamp_ns(scan), fill(kind, rng, scan, 4, 12)[0]) for scan in range(2)]
    return log_of("/points", "lidar", kind, None, None, None, clouds)


BODY_FROM_LIDAR = np.concatenate([[0.25, -0.05, 1.1], s.quaternion(0.4, 0.1, -0.05)])


def map_from_odom(time_s):
    return np.concatenate([[5.0 + 0.3 * time_s, -2.0, 0.1], s.quaternion(0.5 + 0.1 * time_s)])


def poses(rng):
    """A robot with everything that says where it is; map -> odom -> base_link -> lidar.

    /tf has odom -> base_link every 50 ms and map -> odom every 100 ms at the stamps of the scans, so the pose of the
    lidar at a scan is a product and needs no interpolation."""
    rows, cloud_topic = log_of(
        "/points", "lidar", s.VELODYNE, "time", SECOND, False,
        [(s.stamp_ns(scan), _timed(fill(s.VELODYNE, rng, scan, 4, 4))) for scan in range(5)])
    log = list(rows)
    log.append(("/tf_static", "tf2_msgs/msg/TFMessage", s.START_NS - 10 * s.PERIOD_NS,
                {"transforms": [ros.transform(s.START_NS - 10 * s.PERIOD_NS, "base_link", "lidar", BODY_FROM_LIDAR)]}))
    zero36 = [0.0] * 36
    still = {"linear": dict.fromkeys("xyz", 0.0), "angular": dict.fromkeys("xyz", 0.0)}
    expected = {name: ([], []) for name in ["/odom", "/slam/pose", "/slam/pose_with_covariance", "/slam/path"]}
    transforms, path, derived = [], [], ([], [], [])

    def note(topic, ns, values):
        expected[topic][0].append(ns)
        expected[topic][1].append(values)

    for step in range(11):
        ns = s.START_NS - s.PERIOD_NS // 2 + step * s.PERIOD_NS // 2
        at_s = (ns - s.START_NS) * 1e-9
        odom_from_body, odom = s.pose_at(at_s), map_from_odom(at_s)
        map_from_body = s.compose(odom, odom_from_body)
        now = ns + DELAY_NS
        log.append(("/odom", "nav_msgs/msg/Odometry", now, {
            "header": ros.header(ns, "odom"), "child_frame_id": "base_link",
            "pose": {"pose": ros.pose(odom_from_body), "covariance": zero36},
            "twist": {"twist": still, "covariance": zero36}}))
        note("/odom", ns, odom_from_body)
        moved = [ros.transform(ns, "odom", "base_link", odom_from_body)]
        transforms.append({"stamp_ns": ns, "parent": "odom", "child": "base_link", "pose": s.rows([odom_from_body])[0]})
        if step % 2 == 1:
            moved.append(ros.transform(ns, "map", "odom", odom))
            transforms.append({"stamp_ns": ns, "parent": "map", "child": "odom", "pose": s.rows([odom])[0]})
            stamped = {"header": ros.header(ns, "map"), "pose": ros.pose(map_from_body)}
            log.append(("/slam/pose", "geometry_msgs/msg/PoseStamped", now + 1, stamped))
            log.append(("/slam/pose_with_covariance", "geometry_msgs/msg/PoseWithCovarianceStamped", now + 2, {
                "header": stamped["header"], "pose": {"pose": stamped["pose"], "covariance": zero36}}))
            path = path + [stamped]
            log.append(("/slam/path", "nav_msgs/msg/Path", now + 3, {"header": ros.header(ns, "map"), "poses": path}))
            for topic in ["/slam/pose", "/slam/pose_with_covariance", "/slam/path"]:
                note(topic, ns, map_from_body)
            derived[0].append(ns)
            derived[1].append(map_from_body)
            derived[2].append(s.compose(map_from_body, BODY_FROM_LIDAR))
        log.append(("/tf", "tf2_msgs/msg/TFMessage", now + 4, {"transforms": moved}))
    log.sort(key=lambda row: row[2])

    kinds = {"/odom": ("nav_msgs/msg/Odometry", "odom", "base_link"),
             "/slam/pose": ("geometry_msgs/msg/PoseStamped", "map", None),
             "/slam/pose_with_covariance": ("geometry_msgs/msg/PoseWithCovarianceStamped", "map", None),
             "/slam/path": ("nav_msgs/msg/Path", "map", None)}
    topics = [cloud_topic]
    for topic, (kind, frame, child) in kinds.items():
        stamps, values = expected[topic]
        topics.append({"topic": topic, "type": kind, "kind": "poses", "frame_id": frame, "child_frame_id": child,
                       "messages": len(stamps), "stamps_ns": stamps, "poses": s.rows(values)})
    static = {"stamp_ns": s.START_NS - 10 * s.PERIOD_NS, "parent": "base_link", "child": "lidar",
              "pose": s.rows([BODY_FROM_LIDAR])[0]}
    for topic, entries in [("/tf", transforms), ("/tf_static", [static])]:
        topics.append({"topic": topic, "type": "tf2_msgs/msg/TFMessage", "kind": "transforms", "transforms": entries})
    return log, topics, {"stamps_ns": derived[0], "map_from_base_link": s.rows(derived[1]),
                         "map_from_lidar": s.rows(derived[2])}


def _timed(filled):
    cloud, shares = filled
    cloud["time"] = shares * 0.0998
    return cloud


def write(name, files, topics, **more):
    s.write_json(FOLDER / f"{name}.json", {"files": files, "topics": topics, **more})


def main():
    scratch = tempfile.TemporaryDirectory()

    def one(name, seed, made, options=ros.ZSTD):
        log, topic = made(np.random.default_rng(seed))
        ros.write_mcap(FOLDER / f"{name}.mcap", log, **options)
        write(name, [f"{name}.mcap"], [topic])

    def both(name, seed, made, options=ros.ZSTD):
        """One log by each of the two writers; rosbags knows no compression of chunks but zstd."""
        one(name, seed, made, options)
        log, topic = made(np.random.default_rng(seed))
        ros.write_rosbags_mcap(FOLDER / f"{name}_rosbags.mcap", log, scratch.name, compression=BAG_ZSTD)
        write(name, [f"{name}.mcap", f"{name}_rosbags.mcap"], [topic])

    log, topic = velodyne(np.random.default_rng(1))
    ways = {"zstd": ros.ZSTD, "lz4": ros.LZ4, "none": {}, "unchunked": {"use_chunking": False},
            "no_summary": ros.ZSTD | ros.NO_SUMMARY, "unchunked_no_summary": {"use_chunking": False} | ros.NO_SUMMARY,
            "no_crc": ros.LZ4 | {"enable_crcs": False}, "data_crc": {"enable_data_crcs": True}}
    for way, options in ways.items():
        ros.write_mcap(FOLDER / f"velodyne_{way}.mcap", log, **options)
    ros.write_rosbags_mcap(FOLDER / "velodyne_rosbags.mcap", log, scratch.name)
    ros.write_rosbags_mcap(FOLDER / "velodyne_rosbags_zstd.mcap", log, scratch.name, compression=BAG_ZSTD)
    # The CDR of the messages is big-endian; the bytes of the points are not.
    ros.write_rosbags_mcap(FOLDER / "velodyne_rosbags_cdr_be.mcap", log, scratch.name, little_endian=False)
    write("velodyne", [f"velodyne_{way}.mcap" for way in [*ways, "rosbags", "rosbags_zstd", "rosbags_cdr_be"]], [topic])

    both("ouster_zeros", 2, lambda rng: ouster(rng, s.OUSTER, 0), ros.LZ4)
    one("ouster_nan", 3, lambda rng: ouster(rng, s.OUSTER_OLD, np.nan))
    one("hesai", 4, lambda rng: clock_seconds(rng, "/lidar_points", "hesai_lidar", s.HESAI, False))
    one("hesai_pcl", 5, lambda rng: clock_seconds(rng, "/hesai/pandar", "PandarXT-32", s.HESAI_PCL, False), ros.LZ4)
    one("robosense", 6, lambda rng: clock_seconds(rng, "/rslidar_points", "rslidar", s.ROBOSENSE, True))
    both("livox", 7, livox)
    both("livox_custom", 8, livox_custom)
    both("big_endian", 9, big_endian, {})
    one("without_time", 10, without_time)

    rng = np.random.default_rng(11)
    front, rear = velodyne(rng, "/front/points", "front", 2), livox(rng, "/rear/points", 2)
    talk = [("/chatter", "std_msgs/msg/String", s.START_NS + 7 * step, {"data": f"step {step}"}) for step in range(3)]
    log = sorted(front[0] + rear[0] + talk, key=lambda row: (row[2], row[0]))
    ros.write_mcap(FOLDER / "two_clouds.mcap", log, **ros.ZSTD)
    ros.write_rosbags_mcap(FOLDER / "two_clouds_rosbags.mcap", log, scratch.name)
    write("two_clouds", ["two_clouds.mcap", "two_clouds_rosbags.mcap"], [front[1], rear[1]])

    log, topics, derived = poses(np.random.default_rng(12))
    ros.write_mcap(FOLDER / "poses.mcap", log, **ros.ZSTD)
    ros.write_rosbags_mcap(FOLDER / "poses_rosbags.mcap", log, scratch.name, compression=BAG_ZSTD)
    write("poses", ["poses.mcap", "poses_rosbags.mcap"], topics, derived=derived)


if __name__ == "__main__":
    main()
