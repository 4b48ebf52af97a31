#!/usr/bin/env python3
"""Makes the clouds and meshes here and the JSON beside them: see ../README.md."""

import datetime
import sys
from pathlib import Path

import copclib
import laspy
import numpy as np
import open3d
import pye57
import pyproj
import trimesh
from laspy.vlrs.known import GeoKeyEntryStruct
from plyfile import PlyData, PlyElement
from pypcd4 import Encoding, PointCloud

FOLDER = Path(__file__).resolve().parent
sys.path.insert(0, str(FOLDER.parent))

import shared as s  # noqa: E402

SURVEY_FOOT_M = 1200 / 3937


def write(name, files, points, coordinates, time=None, faces=None, unit_m=(1.0, 1.0)):
    s.write_json(FOLDER / f"{name}.json", {
        "files": files, "coordinates": coordinates,
        "unit_m": unit_m and {"horizontal": unit_m[0], "vertical": unit_m[1]},
        "points": s.rows(points), "time": time, "faces": faces})


def seen(seed, rings=3, columns=10):
    return s.look(np.random.default_rng(seed), 0, rings, columns)[0].reshape(-1, 3)


def pcd_by_pypcd4(name, columns, time=None, viewpoint=None):
    """`columns`: (field, values). In text, in bytes and compressed."""
    names, values = [name for name, _ in columns], [value for _, value in columns]
    cloud = PointCloud.from_points(values, names, [value.dtype for value in values])
    if viewpoint:
        cloud.metadata.viewpoint = viewpoint
    files = []
    for encoding in [Encoding.ASCII, Encoding.BINARY, Encoding.BINARY_COMPRESSED]:
        files.append(f"pcd_{name}_{encoding.value}.pcd")
        cloud.save(FOLDER / files[-1], encoding)
        # What does not shrink is stored as plain bytes under the same name.
        assert f"DATA {encoding.value}\n".encode() in (FOLDER / files[-1]).read_bytes()
    write(f"pcd_{name}", files, np.stack(values[:3], axis=1), s.DATATYPE_NAME[s.DATATYPE_CODE[values[0].dtype.str[1:]]],
          time)


def pcd():
    points = np.round(seen(31) * 16) / np.float32(16)
    xyz = [(name, points[:, axis].copy()) for axis, name in enumerate("xyz")]
    share = np.tile(np.arange(10) / 10, 3)
    grey = ("intensity", np.arange(30, dtype=np.float32) * 6.5)
    t = np.round(share * 99_960_320).astype(np.uint32)
    stamp = (s.START_NS + np.round(share * 99_900_000)) / 1e9
    pcd_by_pypcd4("xyz", xyz)
    pcd_by_pypcd4("xyz_intensity", [*xyz, grey])
    pcd_by_pypcd4("t_uint32", [*xyz, grey, ("t", t), ("ring", np.repeat(np.arange(3), 10).astype(np.uint16))],
                  {"name": "t", "datatype": "uint32", "unit": "ns", "from": "start", "values": t.tolist()})
    # The pose of a sensor in VIEWPOINT is a note: the points are as they stand.
    pcd_by_pypcd4("timestamp_float64", [*xyz, grey, ("timestamp", stamp)],
                  {"name": "timestamp", "datatype": "float64", "unit": "s", "from": "clock",
                   "values": [s.number(value) for value in stamp]}, (1.0, 2.0, 3.0, 1.0, 0.0, 0.0, 0.0))
    wide = [(name, value.astype(np.float64) + 4e5 + 0.001) for name, value in xyz]
    pcd_by_pypcd4("xyz_float64", wide)
    holes = [(name, value.copy()) for name, value in xyz]
    for _, value in holes:
        value[[3, 17]] = np.nan
    holes[2][1][20] = np.inf
    pcd_by_pypcd4("holes", holes)

    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points.astype(float)))
    cloud.paint_uniform_color([0.2, 0.4, 0.6])
    files = {"open3d_ascii.pcd": {"write_ascii": True}, "open3d_binary.pcd": {},
             "open3d_binary_compressed.pcd": {"compressed": True}}
    for name, options in files.items():
        assert open3d.io.write_point_cloud(str(FOLDER / name), cloud, **options)
    # Its text has ten digits, which is enough for these.
    write("pcd_open3d", list(files), points, "float32")


def ply():
    points = seen(32)
    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points.astype(float) + 4e5))
    cloud.normals = open3d.utility.Vector3dVector(np.tile([0.0, 0.0, 1.0], (30, 1)))
    cloud.paint_uniform_color([0.2, 0.4, 0.6])
    assert open3d.io.write_point_cloud(str(FOLDER / "open3d_binary.ply"), cloud)
    write("ply_open3d", ["open3d_binary.ply"], points.astype(float) + 4e5, "float64")
    near = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(np.round(points.astype(float), 3)))
    assert open3d.io.write_point_cloud(str(FOLDER / "open3d_ascii.ply"), near, write_ascii=True)
    text = (FOLDER / "open3d_ascii.ply").read_text().split("end_header\n")[1]
    write("ply_open3d_ascii", ["open3d_ascii.ply"],
          np.array([[float(word) for word in line.split()[:3]] for line in text.splitlines()]), "float64")

    time = np.tile(np.arange(10) / 10, 3) * 0.0998
    for width, coordinates in [("f4", "float32"), ("f8", "float64")]:
        vertices = np.zeros(30, [("x", width), ("y", width), ("z", width), ("intensity", "u1"), ("time", "f8")])
        for axis, name in enumerate("xyz"):
            vertices[name] = points[:, axis]
        if width == "f8":
            vertices["x"] += 5e5 + 1e-6
        vertices["time"] = time
        element = PlyElement.describe(vertices, "vertex", comments=["made by plyfile"])
        ways = {"ascii": {"text": True}, "little": {"byte_order": "<"}, "big": {"byte_order": ">"}}
        files = [f"plyfile_{coordinates}_{way}.ply" for way in ways]
        for file, options in zip(files, ways.values()):
            PlyData([element], **options).write(FOLDER / file)
        write(f"ply_plyfile_{coordinates}", files, np.stack([vertices[name] for name in "xyz"], axis=1), coordinates,
              {"name": "time", "datatype": "float64", "unit": "s", "from": "start",
               "values": [s.number(value) for value in time]})


def meshes():
    """A sphere of 12 triangles a side, cut and moved."""
    ball = trimesh.creation.icosphere(subdivisions=1, radius=2.0)
    corners = np.round(ball.vertices + [10.0, -20.0, 3.0], 4)
    faces = ball.faces
    mesh = open3d.geometry.TriangleMesh(open3d.utility.Vector3dVector(corners), open3d.utility.Vector3iVector(faces))
    files = ["mesh_open3d_binary.ply", "mesh_open3d_ascii.ply", "mesh_open3d.obj", "mesh_trimesh.obj",
             "mesh_plyfile_big.ply"]
    for name in files[:3]:
        assert open3d.io.write_triangle_mesh(str(FOLDER / name), mesh, write_ascii="ascii" in name,
                                             write_vertex_normals=False)
    trimesh.Trimesh(corners, faces, process=False).export(FOLDER / files[3])
    vertices = np.array([tuple(corner) for corner in corners], [("x", "f8"), ("y", "f8"), ("z", "f8")])
    lists = np.empty(len(faces), [("vertex_indices", object)])
    lists["vertex_indices"] = [face.astype("i4") for face in faces]
    PlyData([PlyElement.describe(vertices, "vertex"),
             PlyElement.describe(lists, "face", len_types={"vertex_indices": "u1"}, val_types={"vertex_indices": "i4"})],
            byte_order=">").write(FOLDER / files[4])
    write("mesh", files, corners, "float64", faces=faces.tolist())


def las_file(name, point_format, version, whole, scale, offset, crs=None, gps_time=None, extra=False, more_keys=(),
             kinds=("las", "laz")):
    """`whole`: the integers of the file."""
    header = laspy.LasHeader(point_format=point_format, version=version)
    header.creation_date = datetime.date(2024, 5, 17)
    header.scales, header.offsets = scale, offset
    if crs:
        header.add_crs(pyproj.CRS(crs))
        if more_keys:
            directory = header.vlrs.get("GeoKeyDirectoryVlr")[0]
            directory.geo_keys = directory.geo_keys + [
                GeoKeyEntryStruct(id=key, tiff_tag_location=0, count=1, value_offset=value) for key, value in more_keys]
            directory.geo_keys_header.number_of_keys = len(directory.geo_keys)
    if extra:
        header.add_extra_dim(laspy.ExtraBytesParams("range_m", np.float32, "of the sensor"))
        header.add_extra_dim(laspy.ExtraBytesParams("scan", np.uint16))
    if gps_time is not None and gps_time[0] == "adjusted":
        header.global_encoding.gps_time_type = laspy.header.GpsTimeType.STANDARD
    cloud = laspy.LasData(header)
    cloud.X, cloud.Y, cloud.Z = whole.T
    cloud.intensity = np.arange(len(whole))
    if gps_time is not None:
        cloud.gps_time = gps_time[1]
    if extra:
        cloud.range_m = np.linspace(1, 30, len(whole), dtype=np.float32)
        cloud.scan = np.arange(len(whole)) // 10
    files = [f"{name}.{kind}" for kind in kinds]
    for file in files:
        cloud.write(str(FOLDER / file))
    return files


def las():
    points = seen(33).astype(float)
    whole = np.round(points * 1000).astype(np.int32)
    utm, scale = np.array([691_234.0, 5_334_765.0, 512.0]), np.array([0.001, 0.001, 0.001])
    at_utm = whole * scale + utm
    step = np.tile(np.arange(10), 3) * 0.01
    week, adjusted = ("week", 345_600.25 + step), ("adjusted", 384_000_018.123_456 + step)

    def time(kind):
        return kind and {"name": "gps_time", "datatype": "float64", "unit": "s", "from": f"gps_{kind[0]}",
                         "values": [s.number(value) for value in kind[1]]}

    for point_format, version, kind in [(0, "1.2", None), (1, "1.2", week), (3, "1.2", adjusted), (6, "1.4", adjusted),
                                        (7, "1.4", adjusted)]:
        name = f"las_format{point_format}"
        files = las_file(name, point_format, version, whole, scale, utm, "EPSG:32633", kind)
        write(name, files, at_utm, "integers times scale plus offset", time(kind))
    files = las_file("las_extra_bytes", 6, "1.4", whole, scale, utm, None, adjusted, extra=True)
    write("las_extra_bytes", files, at_utm, "integers times scale plus offset", time(adjusted))

    feet = np.array([6_480_000.0, 1_840_000.0, 300.0])
    coarse = np.array([0.01, 0.01, 0.001])
    in_feet = whole * coarse + feet
    us, international = SURVEY_FOOT_M, 0.3048
    cases = {
        "feet_us_wkt": (6, "1.4", "EPSG:2229", (), (us, us)),
        "feet_us_height_in_metres_wkt": (6, "1.4", "EPSG:2229+5703", (), (us, 1.0)),
        "feet_international_wkt": (6, "1.4", "EPSG:2222", (), (international, international)),
        # Only the EPSG code and a name: the unit is in no key.
        "feet_us_geotiff_code": (1, "1.2", "EPSG:2229", (), (us, us)),
        # ProjLinearUnits and VerticalUnits: 9003 is the US survey foot. laspy writes neither by itself.
        "feet_us_geotiff_units": (1, "1.2", "EPSG:2229", ((3076, 9003), (3099, 9003)), (us, us)),
        "degrees_wkt": (6, "1.4", "EPSG:4326", (), None),
    }
    for name, (point_format, version, crs, keys, unit_m) in cases.items():
        at, fine = (feet, coarse) if unit_m else (np.array([11.5, 48.1, 500.0]), np.array([1e-7, 1e-7, 0.001]))
        files = las_file(name, point_format, version, whole, fine, at, crs, None, more_keys=keys, kinds=["laz"])
        write(name, files, in_feet if unit_m else whole * fine + at, "integers times scale plus offset", None,
              unit_m=unit_m)


def copc():
    """A root and its eight children, so the chunks of the LAZ have different sizes. Points in the order of the file."""
    rng = np.random.default_rng(34)
    offset = np.array([691_000.0, 5_334_000.0, 500.0])
    config = copclib.CopcConfigWriter(7, copclib.Vector3(0.001, 0.001, 0.001), copclib.Vector3(*offset),
                                      pyproj.CRS("EPSG:32633").to_wkt())
    header = config.las_header
    header.creation_day, header.creation_year = 138, 2024
    config.copc_info.spacing = 1.0
    config.copc_info.center_x, config.copc_info.center_y, config.copc_info.center_z = offset + 8
    config.copc_info.halfsize = 8.0
    writer = copclib.FileWriter(str(FOLDER / "tree.copc.laz"), config)
    rows, times = [], []
    keys = [(0, 0, 0, 0)] + [(1, x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    for number, key in enumerate(keys):
        size = 16 / 2 ** key[0]
        points = copclib.Points(header)
        for whole in rng.integers(10, int(size * 1000) - 10, size=(3 + number, 3)):
            place = offset + np.array(key[1:]) * size + whole * 0.001
            point = points.CreatePoint()
            point.x, point.y, point.z = place
            point.gps_time = 384_000_018.5 + len(rows)
            points.AddPoint(point)
            rows.append(np.round((place - offset) * 1000).astype(int) * 0.001 + offset)
            times.append(point.gps_time)
        writer.AddNode(copclib.VoxelKey(*key), points)
    header = writer.copc_config.las_header
    header.min, header.max = copclib.Vector3(*np.min(rows, axis=0)), copclib.Vector3(*np.max(rows, axis=0))
    writer.Close()
    write("copc", ["tree.copc.laz"], np.array(rows), "integers times scale plus offset",
          {"name": "gps_time", "datatype": "float64", "unit": "s", "from": "gps_week", "values": times})


def e57_by_pye57():
    """Two scans, the second turned by half a turn and moved: places are those after it. The file has names that differ each time."""
    points = np.round(seen(37) * 16) / 16.0
    turned = points * [-1.0, -1.0, 1.0] + [10.0, -4.0, 0.5]
    path = FOLDER / "e57_pye57.e57"
    path.unlink(missing_ok=True)
    file = pye57.E57(str(path), mode="w")
    for rotation, translation in [([1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0]), ([0.0, 0.0, 0.0, 1.0], [10.0, -4.0, 0.5])]:
        columns = {f"cartesian{axis}": points[:, k].astype(np.float64) for k, axis in enumerate("XYZ")}
        file.write_scan_raw(columns, rotation=np.array(rotation), translation=np.array(translation))
    file.close()
    write("e57_pye57", [path.name], np.concatenate([points, turned]), "float64")


def main():
    pcd()
    ply()
    meshes()
    las()
    copc()
    e57_by_pye57()


if __name__ == "__main__":
    main()
