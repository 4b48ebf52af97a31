"""The scans of a log on disk, for one process after the other."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Iterator, Mapping, NamedTuple

import numpy as np

from .. import convert
from .._listener import Event, Progress
from .._poses import nanoseconds
from .._scans import Log, spool
from .._sweep import NS, PERIOD_NS, Imu, Scan, came_back


class Scans(NamedTuple):
    """A folder of scans as ``dmp convert log --to bin`` writes them, or a part of it."""

    folder: Path
    first: int = 0
    last: int | None = None

    @classmethod
    def of(
        cls, log: Log, folder: Path, progress: Progress, cancel: Event | None, reading: Mapping[str, Any]
    ) -> Scans:
        """Writes the scans of a log into a new folder; ``reading`` are options of how it is read."""
        convert.log(log, folder, to="bin", progress=progress, cancel=cancel, **reading)
        return cls(folder)

    def stamps_ns(self) -> list[int]:
        """The stamp of each scan, nanoseconds."""
        from decimal import Decimal

        if self.are_stamped():
            lines = (self.folder / "times.txt").read_text(encoding="ascii").split()
            stamps = [int(Decimal(line) * NS) for line in lines]
        else:
            stamps = [number * PERIOD_NS for number, _ in enumerate((self.folder / "scans").iterdir())]
        return stamps[self.first : self.last]

    def are_stamped(self) -> bool:
        """Whether the log has stamps."""
        return (self.folder / "times.txt").exists()

    def with_imu(self, imu: Imu) -> Scans:
        """Adds what an IMU measured."""
        np.savez(self.folder / "imu.npz", *imu)
        return self

    def measured(self) -> Iterator[Scan]:
        """The scans with what the IMU measured, from a second before the first."""
        with np.load(self.folder / "imu.npz") as kept:
            imu = Imu(*(kept[name] for name in kept.files))
        done = None
        for scan in self:
            if done is None:
                done = int(np.searchsorted(imu.stamps_ns, int(scan.stamp or 0) - NS))
            until = int(np.searchsorted(imu.stamps_ns, instant_ns(scan, "end"), "right")) + 1
            yield scan._replace(imu=imu.between(done, until))
            done = max(done, until)

    def part(self, first: float, last: float) -> Scans:
        """The scans from one share of the log to another."""
        count = len(self.stamps_ns())
        return Scans(self.folder, self.first + round(first * count), self.first + round(last * count))

    def __iter__(self) -> Iterator[Scan]:  # type: ignore[override]
        for number, stamp_ns in enumerate(self.stamps_ns(), self.first):
            points = np.fromfile(self.folder / "scans" / f"{number:06}.bin", "<f4").reshape(-1, 4)[:, :3]
            times = self.folder / "times" / f"{number:06}.f32"
            yield Scan(points, np.fromfile(times, "<f4") if times.exists() else None, stamp_ns)

    def log(self, file: Path) -> Path:
        """These scans as a log of their own."""
        spool(iter(self), file)
        return file


def instant_ns(scan: Scan, at: str) -> int:
    """When a pose of a scan holds, nanoseconds."""
    stamp_ns = int(scan.stamp or 0)
    if scan.times is None or at == "stamp":
        return stamp_ns
    times = np.asarray(scan.times)[came_back(np.asarray(scan.points))]
    if len(times) == 0:
        return stamp_ns
    first_s, last_s = float(times.min()), float(times.max())
    return stamp_ns + nanoseconds({"start": first_s, "middle": (first_s + last_s) / 2, "end": last_s}[at])
