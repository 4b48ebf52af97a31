"""Messages as plain dictionaries into logs, by `mcap` with `mcap-ros2-support` and by `rosbags`."""

from pathlib import Path

import numpy as np
from mcap.writer import CompressionType, IndexType, Writer as McapWriter
from mcap_ros2._dynamic import serialize_dynamic
from rosbags.interfaces import Nodetype
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import StoragePlugin, Writer as BagWriter
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

# livox_ros_driver2, msg/CustomMsg.msg and msg/CustomPoint.msg.
CUSTOM_POINT = "uint32 offset_time\nfloat32 x\nfloat32 y\nfloat32 z\nuint8 reflectivity\nuint8 tag\nuint8 line\n"
CUSTOM_MSG = ("std_msgs/Header header\nuint64 timebase\nuint32 point_num\nuint8 lidar_id\nuint8[3] rsvd\n"
              "CustomPoint[] points\n")

POINTS = "sensor_msgs/msg/PointCloud2"
CUSTOM = "livox_ros_driver2/msg/CustomMsg"

STORE = get_typestore(Stores.ROS2_HUMBLE)
STORE.register(get_types_from_msg(CUSTOM_POINT, "livox_ros_driver2/msg/CustomPoint")
               | get_types_from_msg(CUSTOM_MSG, CUSTOM))
ROS1_STORE = get_typestore(Stores.ROS1_NOETIC)
ROS1_STORE.register(get_types_from_msg(CUSTOM_POINT, "livox_ros_driver2/msg/CustomPoint")
                    | get_types_from_msg(CUSTOM_MSG, CUSTOM)
                    | get_types_from_msg("geometry_msgs/TransformStamped[] transforms\n", "tf2_msgs/msg/TFMessage"))


def stamp(ns):
    return {"sec": ns // 1_000_000_000, "nanosec": ns % 1_000_000_000}


def header(ns, frame_id):
    return {"stamp": stamp(ns), "frame_id": frame_id}


def point_cloud(ns, frame_id, parts):
    fields = [dict(zip(["name", "offset", "datatype", "count"], field)) for field in parts["fields"]]
    return {"header": header(ns, frame_id), **parts, "fields": fields, "is_bigendian": parts.get("is_bigendian", False)}


def custom_message(ns, frame_id, timebase, points):
    return {"header": header(ns, frame_id), "timebase": timebase, "point_num": len(points), "lidar_id": 1,
            "rsvd": [0, 0, 0], "points": points}


def pose(values):
    position = dict(zip("xyz", map(float, values[:3])))
    return {"position": position, "orientation": dict(zip("xyzw", map(float, values[3:])))}


def transform(ns, parent, child, values):
    return {"header": header(ns, parent), "child_frame_id": child,
            "transform": {"translation": dict(zip("xyz", map(float, values[:3]))),
                          "rotation": dict(zip("xyzw", map(float, values[3:])))}}


def as_rosbags(kind, value, store=STORE):
    """The dictionary as the dataclass that rosbags wants. A header of ROS 1 has a number, too, which nothing here has."""
    def convert(description, entry):
        node, argument = description
        if node == Nodetype.NAME:
            return as_rosbags(argument, entry, store)
        if node == Nodetype.BASE:
            return entry
        inner = argument[0]
        if inner[0] == Nodetype.BASE and inner[1][0] != "string":
            name = {"octet": "uint8", "byte": "uint8", "char": "uint8"}.get(inner[1][0], inner[1][0])
            return np.frombuffer(entry, np.uint8) if isinstance(entry, bytes) else np.array(entry, dtype=name)
        return [convert(inner, one) for one in entry]

    _, fields = store.fielddefs[kind]
    value = {"seq": 7, **value}
    return store.types[kind](**{name: convert(description, value[name]) for name, description in fields})


def write_mcap(path, log, **options):
    """`log`: (topic, type, log time in ns, dictionary) in the order of the file."""
    options = {"compression": CompressionType.NONE, "chunk_size": 4096, **options}
    channels, schemas, encoders = {}, {}, {}
    with open(path, "wb") as file:
        writer = McapWriter(file, **options)
        writer.start(profile="ros2")
        for sequence, (topic, kind, log_ns, message) in enumerate(log):
            if kind not in schemas:
                text, _ = STORE.generate_msgdef(kind, ros_version=2)
                schemas[kind] = writer.register_schema(kind, "ros2msg", text.encode())
                encoders[kind] = serialize_dynamic(kind, text)[kind]
            if topic not in channels:
                channels[topic] = writer.register_channel(topic, "cdr", schemas[kind])
            writer.add_message(channels[topic], log_ns, encoders[kind](message), log_ns, sequence)
        writer.finish()


def write_bag(folder, log, storage, compression=None, little_endian=True, version=9):
    """A rosbag2 directory by rosbags; `compression` is (CompressionMode, CompressionFormat)."""
    writer = BagWriter(folder, version=version, storage_plugin=storage)
    if compression:
        writer.set_compression(*compression)
    with writer:
        connections = {}
        for topic, kind, log_ns, message in log:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=STORE)
            data = STORE.serialize_cdr(as_rosbags(kind, message), kind, little_endian=little_endian)
            writer.write(connections[topic], log_ns, data)


def write_rosbags_mcap(path, log, scratch, **options):
    """Only the .mcap of a directory that rosbags wrote."""
    folder = Path(scratch) / path.stem
    write_bag(folder, log, StoragePlugin.MCAP, **options)
    path.write_bytes((folder / f"{path.stem}.mcap").read_bytes())


def write_ros1(path, log, compression=None, chunk_bytes=1500):
    """A bag of ROS 1 by rosbags; `compression` is None, "BZ2" or "LZ4"."""
    path.unlink(missing_ok=True)
    writer = Ros1Writer(path)
    writer.chunk_threshold = chunk_bytes
    if compression:
        writer.set_compression(Ros1Writer.CompressionFormat[compression])
    with writer:
        connections = {}
        for topic, kind, log_ns, message in log:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=ROS1_STORE)
            data = ROS1_STORE.serialize_ros1(as_rosbags(kind, message, ROS1_STORE), kind)
            writer.write(connections[topic], log_ns, data)


NO_SUMMARY = {"index_types": IndexType.NONE, "repeat_channels": False, "repeat_schemas": False,
              "use_statistics": False, "use_summary_offsets": False}
ZSTD, LZ4 = {"compression": CompressionType.ZSTD}, {"compression": CompressionType.LZ4}
