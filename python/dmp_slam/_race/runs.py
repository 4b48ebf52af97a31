"""Runs systems one after the other, each in a process of its own; one that fails is a row with the reason."""

from __future__ import annotations

import json
import logging
from pathlib import Path
from typing import Any, NamedTuple

from .._listener import Event
from .field import Entry
from .process import Limits, nonsense, run
from .scans import Scans

#: A line for each run, at level INFO.
log = logging.getLogger("dmp_slam.race")


class Row(NamedTuple):
    """One run of a system."""

    entry: Entry
    name: str
    trajectory: Path
    #: Why it does not count; ``None`` if it does.
    failed: str | None
    wall_s: float
    cpu_s: float
    peak_memory_bytes: int
    #: What its worker reports: where poses hold (``pose_at``), and the time for the scans alone (``run_s``).
    facts: dict[str, Any]

    def as_json(self) -> dict[str, Any]:
        """The row in the JSON."""
        entry = self.entry
        return {
            "name": self.name,
            "system": entry.system,
            "driver": entry.driver or "command",
            "runs": entry.runs,
            "version": entry.version,
            "parameters": entry.parameters,
            "changed": entry.changed,
            "pose_at": self.facts.get("pose_at"),
            "trajectory": None if self.failed else self.trajectory.name,
            "failed": self.failed,
            "wall_s": round(self.wall_s, 3),
            "cpu_s": round(self.cpu_s, 3),
            "run_s": self.facts.get("run_s"),
            "peak_memory_bytes": self.peak_memory_bytes,
        }


class Runs(NamedTuple):
    """Where and how systems run."""

    #: The log as commands get it.
    log: str
    scans: Scans
    #: For trajectories and what systems print.
    out: Path
    #: For orders and what workers leave.
    work: Path
    limits: Limits
    cancel: Event | None

    def row(self, entry: Entry, name: str) -> Row:
        """Runs a system."""
        folder, trajectory = self.work / name, self.out / f"{name}.tum"
        folder.mkdir(parents=True)
        order = {
            "driver": entry.driver,
            "system": entry.runs,
            "parameters": entry.parameters,
            "scans": str(self.scans.folder),
            "first": self.scans.first,
            "last": self.scans.last,
            "folder": str(folder),
            "trajectory": str(trajectory),
        }
        (folder / "order.json").write_text(json.dumps(order), encoding="utf-8")
        command = entry.command(self.log, str(trajectory), str(folder / "order.json"))
        ended = run(command, self.out / f"{name}.log", self.limits, self.cancel)
        failed = ended.failed or nonsense(trajectory, self.scans.stamps_ns())
        facts = folder / "facts.json"
        known = json.loads(facts.read_text(encoding="utf-8")) if facts.exists() and not failed else {}
        log.info("%s: %s", name, failed or f"{ended.wall_s:.1f} s, {ended.peak_memory_bytes / 1e6:.0f} MB")
        return Row(entry, name, trajectory, failed, *ended[1:], known)
