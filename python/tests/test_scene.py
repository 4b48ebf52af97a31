"""The scene of ``--scene`` as viewers have it: rerun loads it, ROS 2 messages decode, the shipped views name what is there."""

from __future__ import annotations

import json
import subprocess
import sys
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rerun.chunk import McapReader

import dmp_slam as dmp

VIEWERS = Path(__file__).resolve().parents[2] / "deploy" / "viewers"
NAMES = ("truth", "drift", "noise")
TYPES = {
    "map": "sensor_msgs/msg/PointCloud2",
    "returns": "sensor_msgs/msg/PointCloud2",
    "way": "sensor_msgs/msg/PointCloud2",
    "places": "sensor_msgs/msg/PointCloud2",
    "path": "nav_msgs/msg/Path",
    "labels": "visualization_msgs/msg/MarkerArray",
    "pose": "geometry_msgs/msg/PoseStamped",
    "residual": "sensor_msgs/msg/Range",
}


@pytest.fixture(scope="module")
def scored(town, runs):
    return dmp.score(town, {name: runs[name] for name in NAMES}, scene=True, per_frame=True, progress=False)


@pytest.fixture(scope="module")
def maps(town, runs, scored, tmp_path_factory):
    """The maps of the runs, with the voxels of their common score."""
    folder = tmp_path_factory.mktemp("maps")
    given = {"voxel": scored.data["config"]["voxel_m"], "progress": False}
    return {name: dmp.Map.build(town, runs[name], folder / f"{name}.dmpmap", **given) for name in NAMES}


@pytest.fixture(scope="module")
def scene(scored, tmp_path_factory) -> Path:
    file = tmp_path_factory.mktemp("scene") / "scene.mcap"
    scored.scene(file)
    return file


@pytest.fixture(scope="module")
def messages(scene):
    """The messages of each topic, decoded by what knows no more of them than their definitions in the file."""
    found: dict[str, list] = {}
    with scene.open("rb") as file:
        for schema, channel, _, message in make_reader(
            file, decoder_factories=[DecoderFactory()]
        ).iter_decoded_messages():
            found.setdefault(channel.topic, []).append((schema.name, message))
    return found


def cloud(message) -> np.ndarray:
    kinds = {6: "<u4", 7: "<f4"}
    fields = [(field.name, kinds[field.datatype]) for field in message.fields]
    points = np.frombuffer(bytes(message.data), np.dtype(fields))
    assert len(points) == message.width and message.point_step == points.dtype.itemsize
    assert message.row_step == len(message.data)
    return points


def test_messages_are_those_of_ros_2(scored, messages):
    scans = scored.data["sampling"]["frames_scored"]
    for name in NAMES:
        for what, kind in TYPES.items():
            assert {heard for heard, _ in messages[f"/{name}/{what}"]} == {kind}
        returns = [cloud(message) for _, message in messages[f"/{name}/returns"]]
        assert len(returns) == len(messages[f"/{name}/pose"]) == scans
        # Those on what moved are shown, too.
        assert sum(map(len, returns)) == sum(scored.data["runs"][0][of] for of in ("returns", "returns_left_out"))
        ((_, path),) = messages[f"/{name}/path"]
        # Decoded messages are equal to themselves alone.
        on_path = [str(pose.pose) for pose in path.poses]
        assert on_path == [str(message.pose) for _, message in messages[f"/{name}/pose"]]
        ((_, labels),) = messages[f"/{name}/labels"]
        ((_, places),) = messages[f"/{name}/places"]
        assert [marker.text.startswith(f"{name} place ") for marker in labels.markers] == [True] * places.width
    heard = messages["/worst_places"]
    assert {message.level for _, message in heard} == {30} and {message.name for _, message in heard} == set(NAMES)


def test_a_map_has_its_surfels_with_colours_and_residuals(maps, messages):
    for name in NAMES:
        ((_, message),) = messages[f"/{name}/map"]
        points = cloud(message)
        assert len(points) == len(maps[name])
        normals = np.stack([points[f"normal_{axis}"] for axis in "xyz"], axis=1)
        np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-3)
        assert (points["rgb"] << 8 | 0xFF == points["colors"]).all()
        off = points["residual_m"]
        known = np.isfinite(off)
        assert 0.3 < known.mean() < 1 and (off[known] <= 2).all()
        assert len(np.unique(points["rgb"][~known])) == 1
    # The best run's is where its own map is.
    ((_, message),) = messages["/truth/map"]
    points = cloud(message)
    placed = np.sort(np.stack([points[axis] for axis in "xyz"], axis=1), axis=0)
    np.testing.assert_allclose(placed, np.sort(maps["truth"].surfels().centres, axis=0), atol=1e-3)


def test_residuals_are_those_of_the_table(scored, messages):
    import polars

    frames = polars.DataFrame(scored.frames)
    for name in NAMES:
        of_run = frames.filter(polars.col("run") == name)["r_cv_2_m2"].to_numpy()
        lengths = [message.range for _, message in messages[f"/{name}/residual"]]
        np.testing.assert_allclose(np.square(lengths), of_run, rtol=1e-5)
        assert {message.max_range for _, message in messages[f"/{name}/residual"]} == {2.0}


def test_rerun_loads_all_of_it(scene, messages):
    rows: Counter[tuple[str, str]] = Counter()
    points: Counter[str] = Counter()
    for chunk in McapReader(scene).stream():
        batch = chunk.to_record_batch()
        for column in batch.schema.names:
            rows[chunk.entity_path, column] += chunk.num_rows
        if "Points3D:positions" in batch.schema.names:
            lengths = [len(row) for row in batch.column("Points3D:positions")]
            points[chunk.entity_path] += sum(lengths)
    scans = len(messages["/truth/pose"])
    for name in NAMES:
        for what in ("map", "way", "places", "returns"):
            path = f"/{name}/{what}"
            assert points[path] == sum(message.width for _, message in messages[path])
            for column in ("Points3D:positions", "Points3D:colors", "Points3D:residual_m", "CoordinateFrame:frame"):
                assert rows[path, column] == len(messages[path]), (path, column)
        assert rows[f"/{name}/pose", "InstancePoses3D:translations"] == scans
        assert rows[f"/{name}/residual", "Scalars:scalars"] == scans
    assert rows["/tf", "Transform3D:child_frame"] == len(NAMES) * scans
    assert rows["/worst_places", "TextLog:text"] == len(messages["/worst_places"])


def test_the_command_of_rerun_converts_it(scene, tmp_path):
    recording = tmp_path / "scene.rrd"
    convert = [sys.executable, "-m", "rerun", "mcap", "convert", str(scene), "-o", str(recording)]
    heard = subprocess.run(convert, capture_output=True, text=True, check=True).stderr
    assert recording.stat().st_size > scene.stat().st_size / 4
    assert " ERROR " not in heard, heard


def test_the_shipped_views_for_rerun_show_every_run(scene, tmp_path):
    views = tmp_path / "scene.rrd"
    script = [sys.executable, str(VIEWERS / "rerun_blueprint.py"), str(scene), "--save", str(views)]
    heard = subprocess.run(script, capture_output=True, text=True, check=True)
    assert "rror" not in heard.stderr, heard.stderr
    said = subprocess.run(
        [sys.executable, "-m", "rerun", "rrd", "stats", str(views)], capture_output=True, text=True, check=True
    ).stdout
    for what in ("map", "residual", "returns"):
        assert f"/truth/{what}: " in said and f"/noise/{what}: " in said, said


def test_the_shipped_layout_for_foxglove_names_what_is_there(messages):
    """Its topics are those of the sample runs `a` and `b` of docs/guide/viewers.md."""
    layout = json.loads((VIEWERS / "foxglove-layout.json").read_text())
    panels = layout["configById"]
    placed = json.dumps(layout["layout"])
    assert all(panel in placed for panel in panels)
    kinds = {panel.split("!")[0] for panel in panels}
    assert kinds == {"3D", "Plot", "RosOut"}
    (space,) = (panel for key, panel in panels.items() if key.startswith("3D!"))
    assert space["followTf"] == "map"
    here = {f"/{run}/{what}" for run in "ab" for what in TYPES} | {"/tf", "/worst_places"}
    assert set(space["topics"]) <= here
    (plot,) = (panel for key, panel in panels.items() if key.startswith("Plot!"))
    assert [path["value"] for path in plot["paths"]] == ["/a/residual.range", "/b/residual.range"]
    assert hasattr(messages["/truth/residual"][0][1], "range")


def test_a_scene_that_was_not_asked_for_is_refused(result, tmp_path):
    with pytest.raises(dmp.UsageError, match="scene=True"):
        result.scene(tmp_path / "scene.mcap")
