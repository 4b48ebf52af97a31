#!/usr/bin/env python3
"""Reads files that `dmp` wrote with other software, and compares with what should be in them.

    python read_back.py FOLDER                # FOLDER/manifest.json says what to expect
    python read_back.py --self-test           # that it finds what is wrong

The manifest and the printed lines are described in README.md. Exit code 1 on any difference.
"""

import argparse
import json
import math
import sys
import tempfile
import traceback
from fractions import Fraction
from pathlib import Path

import laspy
import numpy as np
import open3d
from evo.core.transformations import quaternion_from_matrix
from evo.tools import file_interface
from mcap.reader import NonSeekingReader, make_reader
from mcap_ros2.decoder import DecoderFactory
from plyfile import PlyData
from pypcd4 import PointCloud

sys.path.insert(0, str(Path(__file__).resolve().parent / "store"))
import read_store  # noqa: E402: it lies in a folder of its own

NUMPY_TYPE = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}
UNIT_NS = {"s": 1_000_000_000, "ns": 1}
QUATERNION_TOLERANCE = 1e-9


class Difference(Exception):
    """The first one in a file."""


def same_number(what, found, wanted, tolerance=0.0):
    """null stands for NaN and infinite."""
    if wanted is None:
        if not math.isfinite(found):
            return
    elif found == wanted or abs(found - wanted) <= tolerance:
        return
    raise Difference(f"{what} is {found!r}, the manifest has {wanted!r}")


def same_count(what, found, wanted):
    if len(found) != len(wanted):
        raise Difference(f"{len(found)} {what}, the manifest has {len(wanted)}")


def same_points(found, wanted, tolerance, where="point"):
    same_count("points" if where == "point" else f"points in {where}", found, wanted)
    for number, (a, b) in enumerate(zip(found, wanted)):
        for axis in range(3):
            # A float32 in the file is compared with the float32 that the manifest's decimal stands for.
            value = b[axis]
            if value is not None and isinstance(a[axis], np.float32):
                value = float(np.float32(value))
            same_number(f"{'xyz'[axis]} of {where} {number}", float(a[axis]), value, tolerance)
    return len(wanted)


def same_times(found, wanted, where="time"):
    if wanted is None:
        return 0
    if found is None:
        raise Difference(f"no {where}s, the manifest has {len(wanted)}")
    same_count(f"{where}s", found, wanted)
    for number, (a, b) in enumerate(zip(found, wanted)):
        same_number(f"{where} {number}", a, b)
    return len(wanted)


def same_poses(positions, quaternions, wanted, tolerance, quaternion_tolerance):
    same_count("poses", positions, wanted)
    for number, (place, turn, pose) in enumerate(zip(positions, quaternions, wanted)):
        for axis in range(3):
            same_number(f"{'xyz'[axis]} of pose {number}", float(place[axis]), pose[axis], tolerance)
        turn, other = np.array(turn) / np.linalg.norm(turn), np.array(pose[3:]) / np.linalg.norm(pose[3:])
        if min(np.abs(turn - other).max(), np.abs(turn + other).max()) > quaternion_tolerance:
            raise Difference(f"quaternion of pose {number} is {turn.tolist()}, the manifest has {other.tolist()}")


def same_stamps(found_s, wanted_ns):
    """evo and numpy hold stamps as doubles of seconds: within one step of a double."""
    if wanted_ns is None:
        return 0
    same_count("stamps", found_s, wanted_ns)
    for number, (a, b) in enumerate(zip(found_s, wanted_ns)):
        same_number(f"stamp {number}", float(a), b / 1e9, float(np.spacing(abs(b / 1e9))))
    return len(wanted_ns)


def trajectory(path, entry):
    kind = entry["kind"]
    if kind == "kitti":
        read = file_interface.read_kitti_poses_file(str(path))
        quaternions = [np.roll(quaternion_from_matrix(pose), -1) for pose in read.poses_se3]
        times = entry.get("times_file")
        stamps = np.loadtxt(path.parent / times, ndmin=1) if times else []
    else:
        read = (file_interface.read_tum_trajectory_file if kind == "tum"
                else file_interface.read_euroc_csv_trajectory)(str(path))
        quaternions, stamps = np.roll(read.orientations_quat_wxyz, -1, axis=1), read.timestamps
    same_poses(read.positions_xyz, quaternions, entry["poses"], entry.get("tolerance_m", 0.0),
               entry.get("quaternion_tolerance", QUATERNION_TOLERANCE))
    return f"{len(entry['poses'])} poses, {same_stamps(stamps, entry.get('stamps_ns'))} stamps equal"


def same_fields(columns, wanted, slack=0.0, where=""):
    """`columns` gives the values of a field by its name; how many fields are equal, in words."""
    for name, values in (wanted or {}).items():
        found = np.asarray(columns(name))
        same_count(f"values of {name}{where}", found, values)
        for number, (a, b) in enumerate(zip(found, values)):
            # The manifest has the decimal of the float32.
            b = float(np.float32(b)) if found.dtype == np.float32 and b is not None else b
            same_number(f"{name} of point {number}{where}", float(a), b, slack)
    return f", {len(wanted)} fields" if wanted else ""


def cloud_text(entry, found, columns):
    """`columns` gives the values of a field by its name."""
    time = entry.get("time")
    values = [float(value) for value in columns(time["name"])] if time else None
    points = same_points(found, entry["points"], entry.get("tolerance_m", 0.0))
    times = same_times(values, time and time["values"])
    return f"{points} points, {times} times{same_fields(columns, entry.get('fields'))} equal"


def las(path, entry):
    cloud = laspy.read(path)
    if cloud.header.point_count != len(cloud.points):
        raise Difference(f"header counts {cloud.header.point_count} points, {len(cloud.points)} are there")
    found = np.stack([np.asarray(cloud.x), np.asarray(cloud.y), np.asarray(cloud.z)], axis=1)
    for axis in range(3):
        if len(found):
            # Bounds hold all points; writers round them outwards, by less than a step and the last bit.
            step = float(cloud.header.scales[axis])
            least, largest = found[:, axis].min() - cloud.header.mins[axis], cloud.header.maxs[axis] - found[:, axis].max()
            for what, outwards in (("least", least), ("largest", largest)):
                if not -step / 1000 <= outwards <= step * 1.001:
                    raise Difference(f"{what} {'xyz'[axis]} in the header lies {outwards} outside the points")
    # The order of the sums of integer, scale and offset may differ.
    slack = max(entry.get("tolerance_m", 0.0), float(min(cloud.header.scales)) / 1000)
    return cloud_text(entry | {"tolerance_m": slack}, found, lambda name: cloud[name])


def by_open3d(path, entry, stored):
    """The second reader of PLY and PCD; it keeps all coordinates as float64. `stored` is the type in the file."""
    if path.suffix == ".pcd" and stored != np.float32:
        return  # It takes float64 coordinates of a binary PCD for zeros.
    read = open3d.io.read_point_cloud(str(path), remove_nan_points=False, remove_infinite_points=False)
    same_points(np.asarray(read.points).astype(stored), entry["points"], entry.get("tolerance_m", 0.0), "open3d's point")


def fields_by_open3d(path, entry):
    """Its reader of tensors knows fields by name, and float64 coordinates of PCD."""
    if "fields" in entry:
        read = open3d.t.io.read_point_cloud(str(path)).point
        same_points(read.positions.numpy(), entry["points"], entry.get("tolerance_m", 0.0), "open3d's tensor")
        same_fields(lambda name: read[name].numpy().reshape(-1), entry["fields"], where=", read by open3d")


def ply(path, entry):
    vertices = PlyData.read(path)["vertex"]
    found = list(zip(vertices["x"], vertices["y"], vertices["z"]))
    text = cloud_text(entry, found, lambda name: vertices[name])
    by_open3d(path, entry, np.dtype(type(found[0][0])) if found else np.float32)
    fields_by_open3d(path, entry)
    return text


def pcd(path, entry):
    cloud = PointCloud.from_path(path)
    found = list(zip(*(cloud.pc_data[name] for name in "xyz")))
    text = cloud_text(entry, found, lambda name: cloud.pc_data[name])
    by_open3d(path, entry, cloud.pc_data["x"].dtype)
    fields_by_open3d(path, entry)
    return text


def cloud_message(message, time_field):
    """Points, times (ns after the stamp) and fields of a decoded PointCloud2 or CustomMsg."""
    stamp = message.header.stamp.sec * 1_000_000_000 + message.header.stamp.nanosec
    if hasattr(message, "timebase"):
        points = [tuple(np.float32(value) for value in (point.x, point.y, point.z)) for point in message.points]
        return stamp, points, [point.offset_time for point in message.points], None
    order = ">" if message.is_bigendian else "<"
    kind = np.dtype({"names": [field.name for field in message.fields],
                     "formats": [order + NUMPY_TYPE[field.datatype] for field in message.fields],
                     "offsets": [field.offset for field in message.fields], "itemsize": message.point_step})
    data = bytes(message.data)
    width = message.width * message.point_step
    cloud = np.concatenate([np.frombuffer(data[row * message.row_step:row * message.row_step + width], kind)
                            for row in range(message.height)])
    points = list(zip(*(cloud[name].astype(kind[name].newbyteorder("=")) for name in "xyz")))
    if time_field is None:
        return stamp, points, None, cloud
    base = stamp if time_field["from"] == "clock" else 0
    return stamp, points, [round(Fraction(value.item()) * UNIT_NS[time_field["unit"]]) - base
                           for value in cloud[time_field["name"]]], cloud


def messages(path, topic):
    """Through the summary where there is one and once more without it; checksums are compared both times."""
    decoders = [DecoderFactory()]
    with open(path, "rb") as file:
        straight = [(row.channel.topic, row.decoded_message) for row in
                    NonSeekingReader(file, validate_crcs=True, decoder_factories=decoders).iter_decoded_messages()]
    with open(path, "rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        summary = reader.get_summary()
        indexed = list(reader.iter_messages())
    same_count("messages through the summary", indexed, straight)
    if summary and summary.statistics and summary.statistics.message_count != len(straight):
        raise Difference(f"statistics count {summary.statistics.message_count} messages, {len(straight)} are there")
    if topic is None:
        topics = {at for at, message in straight if hasattr(message, "point_step") or hasattr(message, "timebase")}
        if len(topics) != 1:
            raise Difference(f"clouds in {len(topics)} topics, and the manifest names none")
        topic = topics.pop()
    return [message for at, message in straight if at == topic]


def mcap(path, entry):
    found = messages(path, entry.get("topic"))
    if "poses" in entry:
        found = [message.transforms[0] if hasattr(message, "transforms") else message for message in found]

        def inner(message):
            return inner(message.pose) if hasattr(message, "pose") else getattr(message, "transform", message)
        stamps = [message.header.stamp.sec * 1_000_000_000 + message.header.stamp.nanosec for message in found]
        poses = [inner(message) for message in found]
        places = [pose.translation if hasattr(pose, "translation") else pose.position for pose in poses]
        turns = [pose.rotation if hasattr(pose, "rotation") else pose.orientation for pose in poses]
        same_poses([(p.x, p.y, p.z) for p in places], [(q.x, q.y, q.z, q.w) for q in turns], entry["poses"],
                   entry.get("tolerance_m", 0.0), entry.get("quaternion_tolerance", QUATERNION_TOLERANCE))
        return f"{len(entry['poses'])} poses, {same_times(stamps, entry['stamps_ns'], 'stamp')} stamps equal"
    scans = entry["scans"]
    same_count("clouds", found, scans)
    points = times = 0
    field = entry.get("time_field", {"name": "t", "unit": "ns", "from": "stamp"})
    for number, (message, scan) in enumerate(zip(found, scans)):
        stamp, cloud, offsets, columns = cloud_message(message, field)
        same_number(f"stamp of scan {number}", stamp, scan["stamp_ns"])
        points += same_points(cloud, scan["points"], entry.get("tolerance_m", 0.0), f"scan {number}, point")
        times += same_times(offsets, scan.get("offsets_ns"), f"scan {number}'s time")
        fields = same_fields(lambda name: columns[name], scan.get("fields"), 1e-7, f" of scan {number}")
    return f"{points} points, {times} times{fields if scans else ''} equal"


def kitti_bin(path, entry):
    """One file with `points`, or a folder with `scans`: scans/*.bin, times.txt and times/*.f32."""
    if "scans" not in entry:
        return f"{same_points(np.fromfile(path, '<f4').reshape(-1, 4), entry['points'], 0.0)} points, 0 times equal"
    files = sorted((path / "scans").glob("*.bin"))
    same_count("scans", files, entry["scans"])
    seconds = (path / "times.txt").read_text().split() if (path / "times.txt").exists() else []
    same_count("stamps", seconds, [scan for scan in entry["scans"] if scan.get("stamp_ns") is not None])
    points = times = 0
    for number, (file, scan) in enumerate(zip(files, entry["scans"])):
        if seconds:
            same_number(f"stamp of scan {number}", round(Fraction(seconds[number]) * 1_000_000_000), scan["stamp_ns"])
        points += same_points(np.fromfile(file, "<f4").reshape(-1, 4), scan["points"], entry.get("tolerance_m", 0.0),
                              f"scan {number}, point")
        after = path / "times" / f"{file.stem}.f32"
        found = np.fromfile(after, "<f4") if after.exists() else None
        wanted = scan.get("offsets_ns")
        # As float32 seconds: the nearest to the manifest's nanoseconds.
        times += same_times(found, wanted and [np.float32(ns / 1e9) for ns in wanted], f"scan {number}'s time")
    return f"{points} points, {times} times equal"


def store(path, entry):
    """A map, by the script that was written from the page on its format."""
    found = read_store.read(path)["tiles"]
    same_count("tiles", found, entry["tiles"])
    surfels = 0
    for number, (tile, wanted) in enumerate(zip(found, entry["tiles"])):
        for name in wanted:
            if name != "surfels" and tile[name] != wanted[name]:
                raise Difference(f"tile {number}: {name} {tile[name]}, not {wanted[name]}")
        same_count(f"surfels of tile {number}", tile["surfels"], wanted["surfels"])
        for row, (surfel, expected) in enumerate(zip(tile["surfels"], wanted["surfels"])):
            if surfel != expected:
                raise Difference(f"tile {number}, surfel {row}: {surfel}, not {expected}")
        surfels += len(wanted["surfels"])
    return f"{surfels} surfels equal"


READ = {"tum": trajectory, "kitti": trajectory, "euroc": trajectory, "las": las, "laz": las, "ply": ply, "pcd": pcd,
        "mcap": mcap, "bin": kitti_bin, "store": store}
KNOWN = {".tum", ".csv", ".las", ".laz", ".ply", ".pcd", ".mcap", ".bin", ".dmpmap"}


def compare(folder, say=print, complete=True):
    """Paths with a difference; `complete`: a file that the manifest does not name is one."""
    wrong, named = [], set()
    for entry in json.loads((folder / "manifest.json").read_text())["files"]:
        named.add(Path(entry["path"]))
        try:
            say(f"{entry['path']}: {READ[entry['kind']](folder / entry['path'], entry)}")
        except Difference as difference:
            wrong.append(entry["path"])
            say(f"{entry['path']}: {difference}")
        except Exception as error:  # noqa: BLE001: whatever a library makes of a bad file is a difference
            wrong.append(entry["path"])
            place = traceback.extract_tb(error.__traceback__)[-1]
            say(f"{entry['path']}: not read: {type(error).__name__}: {error} ({Path(place.filename).name})")
    for path in sorted(folder.rglob("*")):
        inside = path.relative_to(folder)
        if complete and path.suffix in KNOWN and named.isdisjoint([inside, *inside.parents]):
            wrong.append(str(path.relative_to(folder)))
            say(f"{path.relative_to(folder)}: not in the manifest")
    if not named:
        raise SystemExit("the manifest names no file")
    say(f"{len(named)} files, {len(wrong)} with a difference")
    return wrong


def self_test():
    """On the files of the folders beside this script: equal as they are; then with one number of one entry changed at
    a time, which must be found in that file and in no other."""
    here, entries = Path(__file__).resolve().parent, []
    for path in sorted((here / "clouds").glob("*.json")):
        known = json.loads(path.read_text())
        for file in known["files"]:
            kind = Path(file).suffix[1:]
            if kind in READ:
                time = known["time"]
                fields = {"fields": {time["name"]: time["values"]}} if time and kind in ("las", "laz") else {}
                entries.append({"path": f"clouds/{file}", "kind": kind, "points": known["points"], "time": time, **fields})
    for path in sorted((here / "store").glob("*.json")):
        entries.append({"path": f"store/{path.stem}.dmpmap", "kind": "store",
                        "tiles": json.loads(path.read_text())["tiles"]})
    for path in sorted((here / "trajectories").glob("*.json")):
        known = json.loads(path.read_text())
        if known["format"] in ("tum", "kitti", "euroc") and "files" in known:
            entries += [{"path": f"trajectories/{file}", "kind": known["format"], "poses": known["poses"],
                         "stamps_ns": known["stamps_ns"], "tolerance_m": 1e-12, "times_file": known["times"],
                         "quaternion_tolerance": known["quaternion_tolerance"]} for file in known["files"]]
    for path in sorted((here / "mcap").glob("*.json")):
        known = json.loads(path.read_text())
        for topic in known["topics"]:
            if topic["kind"] == "scans" or topic["type"].endswith(("Odometry", "PoseStamped")):
                wanted = {name: topic[name] for name in ("scans", "time_field", "poses", "stamps_ns") if name in topic}
                # mcap-ros2-support reads little-endian messages only.
                entries += [{"path": f"mcap/{file}", "kind": "mcap", "topic": topic["topic"], **wanted}
                            for file in known["files"] if "cdr_be" not in file]
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        raw = np.array([[1.5, -2.25, 3.125, 0.0], [4.0, 5.0, 6.0, 0.0]], "<f4")
        raw.tofile(folder / "one.bin")
        entries.append({"path": "one.bin", "kind": "bin", "points": raw[:, :3].tolist()})
        for name in ("scans", "times"):
            (folder / "bins" / name).mkdir(parents=True)
        scans = []
        for number in range(3):
            raw.tofile(folder / f"bins/scans/{number:06d}.bin")
            np.array([0.0, 0.05], "<f4").tofile(folder / f"bins/times/{number:06d}.f32")
            scans.append({"stamp_ns": number * 100_000_000, "points": raw[:, :3].tolist(), "offsets_ns": [0, 50_000_000]})
        (folder / "bins/times.txt").write_text("0.0\n0.1\n0.2\n")
        entries.append({"path": "bins", "kind": "bin", "scans": scans})
        for name in ("clouds", "store", "trajectories", "mcap"):
            (folder / name).symlink_to(here / name)
        lines = []

        def run(rows, complete=False):
            (folder / "manifest.json").write_text(json.dumps({"files": rows}))
            return compare(folder, lines.append, complete)

        if wrong := run(entries):
            print("\n".join(lines))
            return f"differences where there are none: {wrong}"
        if run([*entries[:3], entries[-1]], complete=True) != ["one.bin"]:
            return "a file that is in no manifest was not found"
        missed = changes = 0
        for entry in entries:
            for change in changed(entry):
                changes += 1
                if run([change]) != [entry["path"]]:
                    missed += 1
                    print(f"{entry['path']}: a change was not found")
        print(f"{len(entries)} entries equal; {changes - missed} of {changes} changes found")
        return f"{missed} changes not found" if missed else None


def changed(entry):
    """Copies of an entry with one thing wrong."""
    def copy():
        return json.loads(json.dumps(entry))

    def bump(rows, number, by):
        rows[number] = 1.0 if rows[number] is None else rows[number] + by

    for rows in ("points", "poses"):
        if rows in entry:
            other = copy()
            bump(other[rows][-1], 2, 0.01)
            yield other
            other = copy()
            del other[rows][0]
            yield other
    if "poses" in entry:
        other = copy()
        other["poses"][3][3] += 0.01
        yield other
        other = copy()
        other["stamps_ns"][5 if len(other["stamps_ns"]) > 5 else 0] += 1000
        yield other
    if "tiles" in entry:
        for number in (0, 3, 6):
            other = copy()
            other["tiles"][-1]["surfels"][-1][number] += 1e-6 if number < 6 else 1
            yield other
        other = copy()
        other["tiles"][0]["z_range_m"][1] += 1e-3
        yield other
    if "fields" in entry:
        other = copy()
        bump(other["fields"][sorted(other["fields"])[-1]], 1, 1)
        yield other
    if entry.get("time"):
        other = copy()
        other["time"]["values"][2] += 1e-6 if other["time"]["unit"] == "s" else 1
        yield other
    if "scans" in entry:
        other = copy()
        bump(other["scans"][-1]["points"][1], 0, 1e-5)
        yield other
        other = copy()
        other["scans"][0]["stamp_ns"] += 1
        yield other
        if entry["scans"][0]["offsets_ns"]:
            other = copy()
            other["scans"][1]["offsets_ns"][1] += 5
            yield other
        other = copy()
        del other["scans"][1]
        yield other


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, nargs="?")
    parser.add_argument("--self-test", action="store_true")
    options = parser.parse_args()
    if options.self_test:
        return self_test()
    if options.folder is None:
        parser.error("a folder, or --self-test")
    return 1 if compare(options.folder) else 0


if __name__ == "__main__":
    sys.exit(main())
