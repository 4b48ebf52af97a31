#!/usr/bin/env python3
"""Makes the bags of ROS 1 here and the JSON beside them, from the messages of ../mcap: see ../README.md."""

import importlib.util
import sys
from pathlib import Path

import numpy as np

FOLDER = Path(__file__).resolve().parent
sys.path.insert(0, str(FOLDER.parent))

import shared as s  # noqa: E402
import ros  # noqa: E402

spec = importlib.util.spec_from_file_location("logs", FOLDER.parent / "mcap" / "make.py")
logs = importlib.util.module_from_spec(spec)
spec.loader.exec_module(logs)

WAYS = {"none": None, "lz4": "LZ4", "bz2": "BZ2"}


def write(name, log, topics, **more):
    """The same messages in chunks of each compression."""
    for way, compression in WAYS.items():
        ros.write_ros1(FOLDER / f"{name}_{way}.bag", log, compression)
    s.write_json(FOLDER / f"{name}.json", {"files": [f"{name}_{way}.bag" for way in WAYS], "topics": topics, **more})


def main():
    for name, seed, made in [("velodyne", 1, logs.velodyne), ("livox_custom", 8, logs.livox_custom)]:
        log, topic = made(np.random.default_rng(seed))
        write(name, log, [topic])
    log, topics, derived = logs.poses(np.random.default_rng(12))
    write("poses", log, topics, derived=derived)


if __name__ == "__main__":
    main()
