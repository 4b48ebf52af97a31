#!/usr/bin/env python3
"""Makes the rosbag2 directories here and the JSON beside them: see ../README.md."""

import shutil
import sqlite3
import sys
import tempfile
from pathlib import Path

import numpy as np
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from ruamel.yaml import YAML

FOLDER = Path(__file__).resolve().parent
sys.path.insert(0, str(FOLDER.parent))

import shared as s  # noqa: E402
import ros  # noqa: E402

SECOND = 1_000_000_000


def drive():
    """Four small scans of a Velodyne, and the pose at each: (messages, topics of the JSON)."""
    rng = np.random.default_rng(21)
    log, scans, stamps, poses = [], [], [], []
    for scan in range(4):
        points, shares = s.look(rng, scan, 4, 5)
        cloud = np.zeros((1, 20), s.VELODYNE)
        for axis, name in enumerate("xyz"):
            cloud[name] = points[..., axis].T.reshape(-1)
        cloud["ring"] = np.tile(np.arange(4), 5)
        cloud["time"] = shares.T.reshape(-1) * 0.0998
        stamp = s.stamp_ns(scan)
        log_ns = stamp + s.PERIOD_NS + 1000
        parts, expected = s.pointcloud2(cloud, "time", SECOND, False, stamp)
        log.append(("/points", ros.POINTS, log_ns, ros.point_cloud(stamp, "lidar", parts)))
        scans.append({"log_time_ns": log_ns, **expected})
        pose = s.pose_at((stamp - s.START_NS) * 1e-9)
        log.append(("/pose", "geometry_msgs/msg/PoseStamped", stamp + 2000,
                    {"header": ros.header(stamp, "map"), "pose": ros.pose(pose)}))
        stamps.append(stamp)
        poses.append(pose)
    log.sort(key=lambda row: row[2])
    return log, [
        {"topic": "/points", "type": ros.POINTS, "kind": "scans", "frame_id": "lidar",
         **s.layout_json(s.VELODYNE, "time", SECOND, False), "height": 1, "width": 20, "scans": scans},
        {"topic": "/pose", "type": "geometry_msgs/msg/PoseStamped", "kind": "poses", "frame_id": "map",
         "child_frame_id": None, "messages": 4, "stamps_ns": stamps, "poses": s.rows(poses)}]


def yaml():
    lines = YAML()
    lines.default_flow_style = False
    return lines


def join(target, parts):
    """rosbags does not split a bag: the files of several, and the metadata of the first with the sums of all."""
    target.mkdir()
    documents = []
    for number, part in enumerate(parts):
        name = f"{target.name}_{number}{next(part.glob('*.db3')).suffix}"
        shutil.copy(next(part.glob("*.db3")), target / name)
        document = yaml().load((part / "metadata.yaml").read_text())
        document["rosbag2_bagfile_information"]["files"][0]["path"] = name
        documents.append(document["rosbag2_bagfile_information"])
    whole = documents[0]
    whole["files"] = [document["files"][0] for document in documents]
    whole["relative_file_paths"] = [file["path"] for file in whole["files"]]
    whole["message_count"] = sum(document["message_count"] for document in documents)
    first, last = whole["files"][0], whole["files"][-1]
    end = last["starting_time"]["nanoseconds_since_epoch"] + last["duration"]["nanoseconds"]
    whole["duration"] = {"nanoseconds": end - first["starting_time"]["nanoseconds_since_epoch"]}
    for topic in whole["topics_with_message_count"]:
        name = topic["topic_metadata"]["name"]
        topic["message_count"] = sum(other["message_count"] for document in documents
                                     for other in document["topics_with_message_count"]
                                     if other["topic_metadata"]["name"] == name)
    with (target / "metadata.yaml").open("w") as file:
        yaml().dump({"rosbag2_bagfile_information": whole}, file)


def as_humble(target, newest):
    """The same as ROS 2 Humble stores it, which rosbags does not write: the database has no definitions of messages,
    no hashes and no metadata, and the metadata file is of version 5."""
    shutil.copytree(newest, target)
    database = target / f"{target.name}.db3"
    (target / f"{newest.name}.db3").rename(database)
    with sqlite3.connect(database) as connection:
        connection.executescript("""
            CREATE TABLE kept(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,
                              serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);
            INSERT INTO kept SELECT id, name, type, serialization_format, '' FROM topics;
            DROP TABLE topics;
            ALTER TABLE kept RENAME TO topics;
            DROP TABLE message_definitions;
            DROP TABLE schema;
            DROP TABLE metadata;
        """)
        connection.commit()
        connection.execute("VACUUM")
    connection.close()
    document = yaml().load((target / "metadata.yaml").read_text())
    whole = document["rosbag2_bagfile_information"]
    whole["version"] = 5
    whole["relative_file_paths"] = [database.name]
    whole["files"][0]["path"] = database.name
    del whole["custom_data"], whole["ros_distro"]
    for topic in whole["topics_with_message_count"]:
        del topic["topic_metadata"]["type_description_hash"]
        topic["topic_metadata"]["offered_qos_profiles"] = ""
    with (target / "metadata.yaml").open("w") as file:
        yaml().dump(document, file)


def main():
    log, topics = drive()
    sqlite, mcap = StoragePlugin.SQLITE3, StoragePlugin.MCAP
    zstd = CompressionFormat.ZSTD
    names = ["sqlite3", "sqlite3_split", "sqlite3_humble", "mcap"]
    compressed = ["message_zstd", "file_zstd"]
    for name in names + compressed:
        shutil.rmtree(FOLDER / name, ignore_errors=True)
    ros.write_bag(FOLDER / "sqlite3", log, sqlite)
    ros.write_bag(FOLDER / "mcap", log, mcap)
    ros.write_bag(FOLDER / "file_zstd", log, sqlite, compression=(CompressionMode.FILE, zstd))
    with tempfile.TemporaryDirectory() as scratch:
        parts = [Path(scratch) / "first", Path(scratch) / "second"]
        halves = [Path(scratch) / "as_written_1", Path(scratch) / "as_written_2"]
        for part, half, messages in zip(parts, halves, [log[:5], log[5:]]):
            ros.write_bag(half, messages, sqlite)
            as_humble(part, half)
        join(FOLDER / "sqlite3_split", parts)
        newest = Path(scratch) / "message_zstd_as_written"
        ros.write_bag(newest, log, sqlite, compression=(CompressionMode.MESSAGE, zstd))
        as_humble(FOLDER / "message_zstd", newest)
    as_humble(FOLDER / "sqlite3_humble", FOLDER / "sqlite3")
    s.write_json(FOLDER / "bags.json", {"files": names, "compressed_files": compressed, "topics": topics})


if __name__ == "__main__":
    main()
