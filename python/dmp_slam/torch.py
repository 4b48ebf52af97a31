"""Residuals of maps in torch, a signal to learn from: gradients for poses, extrinsic, clock and scale (the extra ``torch``).

Everything is double precision on the CPU. A gradient holds the surfels that predict the returns, as ``dmp_slam.residuals`` does.
"""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any, Sequence

import numpy as np
import torch

from . import _residuals
from ._map import Map
from ._poses import Poses
from ._residuals import Batch, Residuals, Scans, batch
from ._scans import spool
from ._sweep import NS, Scan

def exp(motion: torch.Tensor) -> torch.Tensor:
    """Small motions, … × 6 of rotation vector (rad) and translation (m), as matrices, … × 4 × 4."""
    x, y, z, *shift = motion.unbind(-1)
    zero = torch.zeros_like(x)
    rows = [zero, -z, y, shift[0], z, zero, -x, shift[1], -y, x, zero, shift[2], zero, zero, zero, zero]
    found: torch.Tensor = torch.linalg.matrix_exp(torch.stack(rows, -1).unflatten(-1, (4, 4)))
    return found


def log(motions: Any) -> Any:
    """The inverse of ``exp`` in numpy, for turns of less than π: … × 4 × 4 to … × 6."""
    rotation, shift = motions[..., :3, :3], motions[..., :3, 3]
    skew = rotation - np.swapaxes(rotation, -1, -2)
    axis = np.stack([skew[..., 2, 1], skew[..., 0, 2], skew[..., 1, 0]], -1) / 2
    sine = np.linalg.norm(axis, axis=-1)
    angle = np.arctan2(sine, (np.trace(rotation, axis1=-2, axis2=-1) - 1) / 2)
    turn = axis * np.where(sine > 1e-9, angle / np.maximum(sine, 1e-9), 1.0)[..., None]
    # 1/a² − (1 + cos a) / (2 a sin a)
    small = angle < 1e-3
    safe = np.where(small, 1.0, angle)
    third = np.where(small, 1 / 12, 1 / safe**2 - (1 + np.cos(safe)) / (2 * safe * np.sin(safe)))
    aside = np.cross(turn, shift)
    shift = shift - aside / 2 + third[..., None] * np.cross(turn, aside)
    return np.concatenate([turn, shift], -1)


class _Residuals(torch.autograd.Function):  # type: ignore[misc]
    @staticmethod
    def forward(
        ctx: Any, pose: torch.Tensor, extrinsic: torch.Tensor, later: torch.Tensor, scale: torch.Tensor, scans: Batch, cast: Any
    ) -> tuple[torch.Tensor, Any]:
        needed = any(ctx.needs_input_grad)
        found = cast(pose.detach().numpy(), extrinsic.detach().numpy(), float(later), float(scale), needed)
        ctx.save_for_backward(pose, extrinsic)
        ctx.jacobian, ctx.ends = found.jacobian, scans.ends
        return torch.from_numpy(np.nan_to_num(found.residual, nan=0.0)), found

    @staticmethod
    @torch.autograd.function.once_differentiable  # type: ignore[untyped-decorator]
    def backward(ctx: Any, by_residual: torch.Tensor, _: Any) -> Any:
        pose, extrinsic = ctx.saved_tensors
        if ctx.needs_input_grad[2] and np.isnan(ctx.jacobian[:, 12]).all():
            raise RuntimeError("the gradient of the time offset needs twists")
        rows = torch.from_numpy(np.nan_to_num(ctx.jacobian, nan=0.0)) * by_residual[:, None]
        lengths = torch.from_numpy(np.diff(ctx.ends, prepend=0))
        scans = torch.repeat_interleave(torch.arange(len(lengths)), lengths)
        by_scan = torch.zeros(len(lengths), 14, dtype=torch.float64).index_add_(0, scans, rows)
        total = by_scan.sum(0)
        by_pose = _by_matrix(pose, by_scan[:, :6].reshape(*pose.shape[:-2], 6))
        return by_pose, _by_matrix(extrinsic, total[6:12]), total[12], total[13], None, None


def _by_matrix(pose: torch.Tensor, by_motion: torch.Tensor) -> torch.Tensor:
    """The gradient by the elements of a pose whose product with a small motion behind the pose is that of the vector: along
    SE(3). Away from it, where no pose is, there is none."""
    turn, shift = by_motion[..., :3], by_motion[..., 3:]
    x, y, z = (turn / 2).unbind(-1)
    zero = torch.zeros_like(x)
    half = torch.stack([zero, -z, y, z, zero, -x, -y, x, zero], -1).unflatten(-1, (3, 3))
    found = torch.zeros_like(pose)
    found[..., :3, :3] = pose[..., :3, :3] @ half
    found[..., :3, 3] = (pose[..., :3, :3] @ shift[..., None])[..., 0]
    return found


def residuals(
    map: Map,
    scan: Scans,
    pose: torch.Tensor,
    *,
    extrinsic: torch.Tensor | None = None,
    time_offset: torch.Tensor | None = None,
    scale: torch.Tensor | None = None,
    **settings: Any,
) -> tuple[torch.Tensor, Residuals]:
    """``dmp_slam.residuals`` with gradients for ``pose``, ``extrinsic``, ``time_offset`` and ``scale``: N residuals, metres, 0 where
    nothing predicts a return, and the whole answer in numpy. Other keywords are those of ``dmp_slam.residuals``. Tensors of other types
    and devices are converted; their gradients have their own.
    """
    scans = batch(scan)

    def cast(pose: Any, extrinsic: Any, later: float, scale: float, jacobian: bool) -> Residuals:
        given = {"extrinsic": extrinsic, "time_offset": later, "scale": scale, "jacobian": jacobian}
        return _residuals.residuals(map, scans, pose, **given, **settings)

    one = torch.eye(4, dtype=torch.float64) if extrinsic is None else extrinsic
    later = torch.zeros((), dtype=torch.float64) if time_offset is None else time_offset
    factor = torch.ones((), dtype=torch.float64) if scale is None else scale
    given = (number.to("cpu", torch.float64) for number in (pose, one, later, factor))
    found: tuple[torch.Tensor, Residuals] = _Residuals.apply(*given, scans, cast)
    return found


def score(residual: torch.Tensor, found: Residuals) -> torch.Tensor:
    """R_near or R_cv, m²: the mean of ``found.squares`` over the returns that count, with the gradient of the residuals."""
    counted = np.isfinite(found.squares)
    if not counted.any():
        raise ValueError("no return counts: the map is elsewhere, or nothing in it is independent")
    within = torch.from_numpy(found.weights)
    rest = float(found.squares[counted & (found.weights == 0)].sum())
    return ((within * residual**2).sum() + rest) / int(counted.sum())


class TrajectoryLoss:
    """A loss of a trajectory by the map that it makes itself: the score of its scans, with a new map every few calls, or only when
    asked (``every=None``).

    ``scans`` are K ``Scan`` with stamps in nanoseconds, and times before or after them; the pose of a scan holds at its stamp. Between
    poses the body moves steadily. Maps are made in ``folder``; ``build`` has keywords of ``Map.build``. By default only surfels that
    other scans have seen predict a scan; otherwise each would vouch for its own pose.
    """

    def __init__(
        self,
        scans: Sequence[Scan],
        folder: Any,
        *,
        every: int | None = 10,
        truncation: float = 0.5,
        surfel: str = "independent",
        kind: str = "range",
        build: dict[str, Any] | None = None,
    ) -> None:
        self.map: Map | None = None
        self._scans, self._folder, self._every = list(scans), Path(folder), every
        self._settings = {"truncation": truncation, "surfel": surfel, "kind": kind}
        self._build = {"segment": "1scans", "topic": "/points", "progress": False, **(build or {})}
        self._stamps = np.array([scan.stamp for scan in self._scans], np.int64)
        self._numbers, self._calls = itertools.count(), 0
        self._folder.mkdir(parents=True, exist_ok=True)
        self._log = self._folder / "scans.mcap"
        spool(self._scans, self._log)

    def renew(self, poses: torch.Tensor) -> Map:
        """Makes the map of these poses, K × 4 × 4, and keeps it until the next one."""
        file = self._folder / f"map-{next(self._numbers) % 2}.dmpmap"
        file.unlink(missing_ok=True)
        self.map = Map.build(self._log, Poses(poses.detach().numpy(), self._stamps), file, **self._build)
        return self.map

    def __call__(self, poses: torch.Tensor, of: Sequence[int] | None = None, **settings: Any) -> torch.Tensor:
        """The loss, m², over the returns of some scans, or of all."""
        if self.map is None or (self._every and self._calls % self._every == 0):
            self.renew(poses)
        self._calls += 1
        assert self.map is not None
        numbers = np.arange(len(self._scans)) if of is None else np.asarray(of)
        given: dict[str, Any] = {**self._settings, "segments": numbers, "twist": self.twists(poses)[numbers], **settings}
        scans = batch([self._scans[number] for number in numbers])
        return score(*residuals(self.map, scans, poses[torch.from_numpy(numbers)], **given))

    def twists(self, poses: torch.Tensor) -> Any:
        """How the body turned (rad/s) and moved (m/s) from each pose to the next, K × 6 in its own frame, without a gradient."""
        motions = np.linalg.inv(poses.detach().numpy()[:-1]) @ poses.detach().numpy()[1:]
        steps = log(motions) / (np.diff(self._stamps) / NS)[:, None]
        return np.concatenate([steps[:1], steps])
