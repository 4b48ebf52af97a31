"""Gradients in torch: what `gradcheck` says of them, and a loss of a trajectory."""

from __future__ import annotations

import numpy as np
import pytest

import dmp_slam as dmp

torch = pytest.importorskip("torch")
learn = pytest.importorskip("dmp_slam.torch")


@pytest.fixture(scope="module")
def corner(tmp_path_factory):
    """Three walls, seen by twelve scans, and their map: each scan with times, the sensor moving."""
    rng = np.random.default_rng(5)
    stamps = 1_000_000_000 + 100_000_000 * np.arange(12)
    poses = np.tile(np.eye(4), (12, 1, 1))
    poses[:, 0, 3] = 0.05 * np.arange(12)
    scans = []
    for number in range(12):
        a, b = rng.uniform(0.1, 6.0, (2, 3000))
        flat = np.zeros(1000)
        walls = np.concatenate(
            [
                np.stack([flat + 6.02, a[:1000], b[:1000]], 1),
                np.stack([a[1000:2000], flat + 6.02, b[1000:2000]], 1),
                np.stack([a[2000:], b[2000:], flat + 6.02], 1),
            ]
        )
        times = rng.uniform(-0.1, 0.0, 3000)
        at = poses[number, :3, 3] + np.outer(times, [0.5, 0.0, 0.0])
        scans.append(dmp.Scan(walls - at, times, int(stamps[number])))
    loss = learn.TrajectoryLoss(scans, tmp_path_factory.mktemp("corner"), every=None, build={"voxel": 0.2, "ego": "none"})
    return scans, torch.from_numpy(poses), loss


def test_exp_and_log_are_inverse():
    motions = np.random.default_rng(1).normal(size=(50, 6)) * np.logspace(-9, 0, 50)[:, None]
    back = learn.log(learn.exp(torch.from_numpy(motions)).numpy())
    np.testing.assert_allclose(back, motions, atol=1e-12, rtol=1e-6)


@pytest.mark.parametrize("kind", ["range", "plane"])
def test_gradcheck_passes(corner, kind):
    scans, poses, loss = corner
    map = loss.renew(poses)
    some = [scan._replace(points=np.asarray(scan.points)[::150], times=np.asarray(scan.times)[::150]) for scan in scans[4:6]]
    asked = {"kind": kind, "surfel": "first", "twist": np.tile([0.1, 0.2, -0.1, 0.5, 0.1, 0.0], (2, 1))}
    held = dmp.residuals(map, some, poses[4:6].numpy(), **asked)
    assert (held.state == 0).mean() > 0.9

    def residual(body, sensor, later, scale):
        found, _ = learn.residuals(
            map,
            some,
            poses[4:6] @ learn.exp(body),
            extrinsic=learn.exp(sensor),
            time_offset=later,
            scale=scale,
            held=held,
            **asked,
        )
        return found

    rng = torch.Generator().manual_seed(1)
    body = (0.1 * torch.randn(2, 6, dtype=torch.float64, generator=rng)).requires_grad_()
    sensor = (0.1 * torch.randn(6, dtype=torch.float64, generator=rng)).requires_grad_()
    later = torch.tensor(0.01, dtype=torch.float64, requires_grad=True)
    scale = torch.tensor(1.02, dtype=torch.float64, requires_grad=True)
    assert torch.autograd.gradcheck(residual, (body, sensor, later, scale), eps=1e-6, atol=1e-6, rtol=1e-6)


def test_descent_on_the_loss_puts_a_pose_back(corner):
    scans, poses, loss = corner
    loss.renew(poses)
    off = torch.tensor([0.01, -0.01, 0.005, 0.03, -0.02, 0.04], dtype=torch.float64)
    step = off.clone().requires_grad_()
    optimizer = torch.optim.Adam([step], lr=3e-3)
    for _ in range(120):
        optimizer.zero_grad()
        moved = torch.cat([poses[:6], (poses[6] @ learn.exp(step))[None], poses[7:]])
        value = loss(moved, of=[6])
        value.backward()
        optimizer.step()
    assert step.detach().norm() < 0.2 * off.norm(), step


def test_poses_in_single_precision_get_gradients_in_single_precision(corner):
    scans, poses, loss = corner
    map = loss.renew(poses)
    gradients = []
    for kind in (torch.float32, torch.float64):
        pose = poses[3].to(kind).requires_grad_()
        residual, _ = learn.residuals(map, scans[3], pose, surfel="first")
        residual.square().mean().backward()
        assert pose.grad.dtype == kind and residual.dtype == torch.float64
        gradients.append(pose.grad.double())
    assert torch.allclose(*gradients, rtol=1e-3, atol=1e-5)


def test_a_time_needs_a_twist_and_a_score_returns_that_count(corner):
    scans, poses, _ = corner
    map = corner[2].renew(poses)
    later = torch.zeros((), dtype=torch.float64, requires_grad=True)
    residual, _ = learn.residuals(map, scans[3], poses[3], time_offset=later, surfel="first")
    with pytest.raises(RuntimeError, match="twists"):
        residual.sum().backward()
    with pytest.raises(ValueError, match="no return counts"):
        far = poses[3].clone()
        far[:3, 3] += 1e4
        learn.score(*learn.residuals(map, scans[3], far))
