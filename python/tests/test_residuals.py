"""Residuals of scans in a map: what they are, against rays that are cast, scores, and central differences."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

import dmp_slam as dmp

SEGMENT = {"segment": "1scans", "ego": "none", "voxel": 0.2, "progress": False}
#: Small motions of every column: rotation, translation, those of the extrinsic, time, scale.
STEP = 3e-6


def behind(pose: np.ndarray, column: int, size: float) -> np.ndarray:
    """The pose with a small motion behind it, by the series of the exponential map."""
    small = np.zeros((4, 4))
    x = np.zeros(6)
    x[column] = size
    small[:3, :3] = [[0, -x[2], x[1]], [x[2], 0, -x[0]], [-x[1], x[0], 0]]
    small[:3, 3] = x[3:]
    return pose @ (np.eye(4) + small + small @ small / 2)


@pytest.fixture(scope="module")
def drive(scans, poses):
    """Scans of a drive as if each were made at one instant, and roughly where."""
    _, found = scans
    matrices, stamps = poses
    chosen = np.searchsorted(stamps, [round(scan.stamp * 1e9) for scan in found])
    keep = [k for k in range(len(found)) if chosen[k] < len(stamps)]
    points = [found[k].points[np.linalg.norm(found[k].points, axis=1) > 1.5] for k in keep]
    return points, matrices[chosen[keep]]


@pytest.fixture(scope="module")
def built(drive, tmp_path_factory):
    file = tmp_path_factory.mktemp("residuals") / "drive.dmpmap"
    return dmp.Map.build([dmp.Scan(points) for points in drive[0]], drive[1], file, **SEGMENT)


def test_predictions_are_those_of_rays(built, drive):
    points, pose = drive[0][7], drive[1][7]
    ways = points.astype(np.float64) @ pose[:3, :3].T
    ranges = np.linalg.norm(points.astype(np.float64), axis=1)
    hits = built.cast(pose[:3, 3], ways, ranges, segments=np.full(len(ways), 7), normals=True)
    for surfel, expected in (("first", hits.z1), ("nearest", hits.zn), ("independent", hits.zc)):
        found = dmp.residuals(built, points, pose, surfel=surfel, segments=[7])
        missing = np.isnan(expected)
        assert (np.isnan(found.predicted) == missing).all() and (np.isnan(found.residual) == missing).all()
        assert np.isnan(found.jacobian[missing]).all() and (found.weights == ~missing).all()
        assert np.array_equal(found.state, np.where(missing, np.where(np.isnan(hits.z1), 3, 2), 0))
        np.testing.assert_allclose(found.predicted[~missing], expected[~missing], atol=2e-3)
        np.testing.assert_allclose((ranges - found.predicted)[~missing], found.residual[~missing], atol=1e-12)
    first = dmp.residuals(built, points, pose, surfel="first", kind="plane")
    hit = np.isfinite(hits.z1)
    np.testing.assert_allclose(first.planes[hit, 3:], hits.normals[hit], atol=1e-6)
    signed = ((ways + pose[:3, 3] - first.planes[:, :3]) * -first.planes[:, 3:]).sum(axis=1)
    np.testing.assert_allclose(first.residual[hit], signed[hit], atol=1e-9)


@pytest.mark.parametrize("kind", ["range", "plane"])
def test_every_column_is_a_central_difference(built, drive, kind):
    points, pose = drive[0][3:6], drive[1][3:6]
    count = sum(map(len, points))
    scans = [dmp.Scan(one, np.linspace(-0.05, 0.05, len(one))) for one in points]
    rng = np.random.default_rng(1)
    extrinsic = np.array([[0.8, -0.6, 0, 0.5], [0.6, 0.8, 0, -0.2], [0, 0, 1, 0.3], [0, 0, 0, 1]])
    given = {"kind": kind, "twist": 0.2 * rng.normal(size=(3, 6)), "time_offset": 0.01, "scale": 1.01, "extrinsic": extrinsic}
    body = pose @ np.linalg.inv(extrinsic)
    held = dmp.residuals(built, scans, body, probe=1e-3, **given)
    assert held.jacobian.shape == (count, 14)

    def at(column: int, size: float) -> np.ndarray:
        moved, posed = dict(given), body
        if column < 6:
            posed = np.array([behind(one, column, size) for one in body])
        elif column < 12:
            moved["extrinsic"] = behind(extrinsic, column - 6, size)
        else:
            name = ("time_offset", "scale")[column - 12]
            moved[name] += size
        return dmp.residuals(built, scans, posed, held=held, jacobian=False, **moved).residual

    by_differences = np.stack([(at(k, STEP) - at(k, -STEP)) / (2 * STEP) for k in range(14)], axis=1)
    used = held.state < 2
    assert used.mean() > 0.4 and 0 < (held.state == 1).sum() < used.sum() / 2
    for block in (slice(0, 3), slice(3, 6), slice(6, 9), slice(9, 12), slice(12, 13), slice(13, 14)):
        found, expected = held.jacobian[used, block], by_differences[used, block]
        size = np.maximum(np.abs(expected).max(axis=1), 0.1)
        assert (np.abs(found - expected).max(axis=1) / size).max() < 1e-6


def test_residuals_and_scores_are_those_of_a_score(built, drive):
    points, poses = drive
    log, numbers = [dmp.Scan(one) for one in points], np.arange(len(points))
    asked = {"trust": True, "returns": "all", "drift": "none", "residuals": True}
    result = dmp.score(log, {"run": poses}, **asked, **SEGMENT)
    returns = result.residuals("run")
    scored = returns["kind"] != 4
    assert len(returns) == sum(map(len, points)) and scored.mean() > 0.95
    (run,) = result.data["runs"]
    columns = {
        "first": ("first_residual_m", None),
        "nearest": ("nearest_residual_m", run["r_near_m2"]["0.5"]),
        "independent": ("signed_residual_m", run["r_cv_m2"]["0.5"]),
    }
    for surfel, (column, score) in columns.items():
        found = dmp.residuals(built, points, poses, surfel=surfel, segments=numbers, truncation=0.5)
        # Rays that graze a rim may differ.
        alike = np.isclose(found.residual, returns[column], atol=2e-3, equal_nan=True)
        assert alike[scored].mean() > 0.999, surfel
        if score is not None:
            assert np.nanmean(found.squares[scored]) == pytest.approx(score, rel=1e-2)


def test_batches_types_and_threads_change_nothing(built, drive):
    points, poses = drive[0][:4], drive[1][:4]
    many = dmp.residuals(built, points, poses, threads=2)
    ends = np.cumsum([len(one) for one in points])
    for one, pose, start, end in zip(points, poses, np.append(0, ends), ends):
        alone = dmp.residuals(built, one.astype(np.float64), pose, threads=1)
        for name in ("predicted", "residual", "jacobian", "weights", "squares", "state", "planes"):
            assert np.array_equal(getattr(many, name)[start:end], getattr(alone, name), equal_nan=True), name
    assert np.isnan(many.jacobian[:, 12]).all()


def test_what_is_wrong_is_refused(built, drive):
    points, pose = drive[0][0], drive[1][0]
    for given, error, message in (
        ({"surfel": "independent"}, dmp.UsageError, "segments"),
        ({"surfel": "nextdoor"}, dmp.InputError, "first, nearest or independent"),
        ({"kind": "depth"}, dmp.InputError, "range or plane"),
        ({"truncation": 0.0}, dmp.UsageError, "truncation"),
        ({"twist": [1.0, 2.0]}, dmp.InputError, "1 × 6"),
        ({"extrinsic": 2 * np.eye(4)}, dmp.InputError, "no rotation"),
        ({"segments": [0.5]}, dmp.InputError, "segments"),
    ):
        with pytest.raises(error, match=message):
            dmp.residuals(built, points, pose, **given)
    with pytest.raises(dmp.InputError, match="N × 3"):
        dmp.residuals(built, points[:, :2], pose)
    with pytest.raises(dmp.InputError, match="2 × 4 × 4"):
        dmp.residuals(built, [points, points], pose)


def test_the_package_imports_no_framework():
    code = "import dmp_slam, sys; sys.exit(bool({'torch', 'jax'} & set(sys.modules)))"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
