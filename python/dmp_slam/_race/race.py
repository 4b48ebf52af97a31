"""``race``: which SLAM system, and which setting, makes the better map of a log?"""

from __future__ import annotations

import json
import os
import tempfile
from itertools import combinations
from pathlib import Path
from typing import Any, Mapping

from .._arguments import StrPath, options
from .._called import large_files, work_folder
from .._commands import repair as repaired
from .._core import __version__
from .._listener import Event, Listener, Progress
from .._scans import Log, place
from ..errors import Error, UsageError
from .field import Entry, Systems, entries
from .imu import Pose, brings_imu, read
from .judge import judged
from .process import Limits, memory_bytes
from .result import Race
from .runs import Row, Runs
from .scans import Scans
from .tune import candidates, choose, held_out

#: How long a run may take if nothing is given, and the choosing of parameters, minutes.
_RUN_MINUTES, _TUNE_MINUTES = 60.0, 20.0


def race(
    log: Log,
    systems: Systems = None,
    *,
    settings: Mapping[str, Mapping[str, Any]] | None = None,
    tune: str | None = None,
    repeats: int = 1,
    minutes: float | None = None,
    memory: float | str | None = None,
    imu: StrPath | None = None,
    imu_from_lidar: Pose = None,
    repair: bool = False,
    score: Mapping[str, Any] | None = None,
    out: StrPath | None = None,
    progress: Progress = None,
    cancel: Event | None = None,
) -> Race:
    """Runs SLAM systems on a log, each in a process of its own, and ranks their maps by ``score``.

    ``systems`` are names of those that come with ``pip install 'dmp-slam[race]'`` (all that are installed, if none are given),
    files of drivers (``mine.py``; see ``System``), or a dict of names and these or commands of a shell with ``{log}`` and ``{out}``:
    what a command writes there is a trajectory as TUM. ``settings`` are parameters of systems by their names; each combination of
    values in lists is a run. ``tune`` names a system whose parameters are varied: with its settings, or each switch and decimal by
    itself; the best on the first 60 % of the log is compared with the default on the rest. ``repeats`` runs each so many times.

    ``imu`` is for systems that need one: a topic of the log with ``sensor_msgs/Imu``, or a ``.csv`` as EuRoC's (``stamp in ns,
    gyro x, y, z, acceleration x, y, z``; rad/s and m/s², which at rest is 9.8 upwards); a dataset of evalio brings its own.
    ``imu_from_lidar`` is the pose of the LiDAR in the IMU's frame, 4 × 4 or ``"X,Y,Z,QX,QY,QZ,QW"`` (the same frame).

    ``minutes`` limits each run (60), or with ``tune`` the choosing (20), and ``memory`` each run, in bytes or as ``"4 GB"`` (three
    quarters of what is available). A run that fails is a row with the reason, and changes no other's numbers. ``repair`` closes the
    loops of the best run. ``score`` are keywords of ``dmp.score``. Trajectories, outputs of systems, ``race.json`` and the page go
    into the new folder ``out``; without it, into one that goes with the result.

    >>> dmp.race(town, ["kiss", "ct"], settings={"kiss": {"voxel_size": [0.5, 1.0]}}).best  # doctest: +SKIP
    'ct'
    """
    how, given = dict(score or {}), {name: dict(values) for name, values in (settings or {}).items()}
    if repeats < 1:
        raise UsageError(f"repeats is at least 1, not {repeats}")
    found, tuned, others = _field(systems, given, tune, imu is not None or brings_imu(log))
    limits = Limits(60 * (minutes if minutes is not None and tune is None else _RUN_MINUTES), memory_bytes(memory))
    folder, temporary = _new_folder(out, how)
    reading = {key: how[key] for key in options(("convert", "log")) if key in how and key in options(("score",))}
    with work_folder(how) as work:
        placed = place(log, work)
        placed.spool(progress, cancel)
        scans = Scans.of(placed.path, work / "scans", progress, cancel, reading)
        measured = None
        if not (imu is None and imu_from_lidar is None) or any(entry.needs_imu for entry in [*found, *others]):
            measured = read(imu, log, placed.path, imu_from_lidar, scans.stamps_ns())
            scans = scans.with_imu(measured)
        scored = placed.path if scans.are_stamped() else str(scans.log(work / "stamped.mcap"))
        runs = Runs(scored, scans, folder, work / "runs", limits, cancel)
        chosen = None
        if tuned is not None:
            choosing = runs._replace(limits=Limits(60 * (minutes or _TUNE_MINUTES), limits.memory_bytes))
            chosen = choose(tuned, others, choosing, how)
            if chosen.entry is not None:
                found.append(chosen.entry)
        rows, same = _all(found, repeats, runs, progress)
        alone = [row for row in rows if row.name not in same]
        result, refused = judged(scored, alone, {**how, "report": folder / "page.html"}, cancel)
        rows = [row._replace(failed=row.failed or refused.get(same.get(row.name, row.name))) for row in rows]
        data: dict[str, Any] = {
            "schema": "dmp-race/1",
            "dmp_version": __version__,
            "asked": {"systems": _as_json(systems), "settings": given, "tune": tune, "repeats": repeats, "minutes": minutes}
            | {"memory": memory, "repair": repair, "score": how}
            | {"imu": None if imu is None else os.fsdecode(imu), "imu_from_lidar": None if measured is None else measured.imu_from_lidar.tolist()},
            "scans": len(scans.stamps_ns()),
            "limits": limits._asdict(),
            "runs": [{**row.as_json(), "same_as": same.get(row.name)} for row in rows],
            "scatter": _scatter(rows, same, result.data if result else {"pairs": []}) if repeats > 1 else [],
            "tune": None,
            "repair": None,
            "score": result.data if result else None,
        }
        if chosen is not None and tuned is not None:
            of_name = {row.entry.name: row for row in reversed(rows)}
            rest = None
            if chosen.entry is not None and not of_name[tuned.name].failed and not of_name[chosen.entry.name].failed:
                rest = held_out(runs, of_name[tuned.name], of_name[chosen.entry.name], how)
            data["tune"] = chosen.as_json(tuned, rest)
        if repair and result is not None:
            data["repair"] = _repaired(scored, folder, result.order[0], how, cancel)
    (folder / "race.json").write_text(json.dumps(data, indent=1, default=str) + "\n", encoding="utf-8")
    return Race(data, result, folder, temporary)


def _field(
    systems: Systems, settings: dict[str, dict[str, Any]], tune: str | None, has_imu: bool
) -> tuple[list[Entry], Entry | None, list[Entry]]:
    """The runs, and the default and the candidates of the system that is tuned."""
    if tune is None:
        return entries(systems, settings, has_imu), None, []
    found = entries(systems, {name: values for name, values in settings.items() if name != tune}, has_imu)
    tuned = next((entry for entry in found if entry.system == tune), None)
    if tuned is None:
        raise UsageError(f"tune={tune!r}: it is none of the systems: {', '.join(entry.system for entry in found)}")
    if tuned.driver is None:
        raise UsageError(f"tune={tune!r}: a command has no defaults to compare with; give settings, or write a driver")
    return found, tuned, candidates(tuned, settings.get(tune, {}))


def _new_folder(out: StrPath | None, how: Mapping[str, Any]) -> tuple[Path, Any]:
    """The folder of results, and what removes it, if nobody named one."""
    if out is None:
        temporary = tempfile.TemporaryDirectory(prefix="dmp-race-", dir=large_files(how))
        return Path(temporary.name), temporary
    folder = Path(out)
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise UsageError(f"{folder}: there is something already; name a new folder")
    folder.mkdir(parents=True, exist_ok=True)
    return folder.resolve(), None


def _all(found: list[Entry], repeats: int, runs: Runs, progress: Progress) -> tuple[list[Row], dict[str, str]]:
    """Runs everything; and which runs gave the same bytes as an earlier one of the same setting."""
    listener, rows, same = Listener(progress, runs.cancel), [], {}
    first_of: dict[tuple[str, bytes], str] = {}
    try:
        for entry in found:
            for repeat in range(1, repeats + 1):
                row = runs.row(entry, entry.name if repeats == 1 else f"{entry.name}-run{repeat}")
                rows.append(row)
                listener.progress("running systems", "runs", len(rows), len(found) * repeats)
                if row.failed is None:
                    first = first_of.setdefault((entry.name, row.trajectory.read_bytes()), row.name)
                    if first != row.name:
                        same[row.name] = first
    finally:
        listener.close()
    return rows, same


def _scatter(rows: list[Row], same: Mapping[str, str], result: Mapping[str, Any]) -> list[dict[str, Any]]:
    """How far apart the runs of one setting are."""
    found = []
    for name in dict.fromkeys(row.entry.name for row in rows):
        of_name = [row for row in rows if row.entry.name == name]
        different = [row.name for row in of_name if row.failed is None and row.name not in same]
        two = [set(pair) for pair in combinations(different, 2)]
        pairs = [pair for pair in result["pairs"] if {pair["a"], pair["b"]} in two]
        apart = [pair["apart"]["within"]["worst_m"] for pair in pairs if pair["apart"] and pair["apart"]["within"]]
        found.append(
            {
                "run": name,
                "repeats": len(of_name),
                "failed": sum(row.failed is not None for row in of_name),
                "different": len(different),
                "apart_m": max(apart, default=0.0 if len(different) == 1 else None),
                "decided": sum(pair["verdict"] in (pair["a"], pair["b"]) for pair in pairs),
                "pairs": len(pairs),
            }
        )
    return found


def _repaired(log: str, folder: Path, best: str, how: Mapping[str, Any], cancel: Event | None) -> dict[str, Any]:
    """The best run with its loops closed, in a file of its own."""
    output = folder / f"{best}-repaired.tum"
    known = {key: value for key, value in how.items() if key in options(("repair",))}
    try:
        report = repaired(log, {best: folder / f"{best}.tum"}, output, progress=False, cancel=cancel, **known)
    except Error as error:
        return {"run": best, "trajectory": None, "failed": str(error), "report": None}
    return {"run": best, "trajectory": output.name if output.exists() else None, "failed": None, "report": report}


def _as_json(systems: Systems) -> Any:
    if systems is None:
        return None
    if isinstance(systems, Mapping):
        return {name: os.fsdecode(system) for name, system in systems.items()}
    return [os.fsdecode(system) for system in systems]
