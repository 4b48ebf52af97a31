"""Races real systems on simulated drives, and compares the verdicts with the true trajectories.

    python python/studies/race.py [--tune] [--drives N] [-o FOLDER]

needs `dmp-slam[race]`. It prints the tables of docs/accuracy.md and keeps each race in its folder; a drive whose race is there is
not raced again.
"""

from __future__ import annotations

import argparse
import json
from collections import Counter
from pathlib import Path
from typing import Any

import dmp_slam as dmp

#: Every drive is another town.
DRIVES = [
    {"seed": 23, "route": "loop"},
    {"seed": 24, "route": "loop", "traffic": 20},
    {"seed": 25, "route": "out-and-back"},
    {"seed": 26, "route": "out-and-back", "traffic": 20},
    {"seed": 27, "route": "loop", "beams": 32},
    {"seed": 28, "route": "one-way"},
    {"seed": 29, "route": "one-way", "beams": 32},
    {"seed": 30, "route": "loop", "speed": 9},
]
SENSOR = {"scans": 250, "rate": 5, "azimuth_steps": 360, "truth_rate": 100}
SYSTEMS = ["kiss", "genz", "ct", "mad", "loam", "form"]
SETTINGS = {"kiss": {"deskew": [True, False], "voxel_size": [0.5, 1.0]}}
#: Pairs whose errors differ by less are not counted.
APART = 1.2
SAID = ("right", "wrong", "mixed", "undecided", "same")
#: Drives and candidates for tuning.
TUNED = [
    {"seed": 51, "route": "loop"},
    {"seed": 52, "route": "out-and-back"},
    {"seed": 53, "route": "one-way"},
    {"seed": 54, "route": "loop", "traffic": 20},
]
CANDIDATES = {"kiss": {"deskew": [True], "voxel_size": [0.25, 0.5, 1.0, 2.0]}}


def name_of(drive: dict[str, Any]) -> str:
    return "-".join(f"{key}-{value}" for key, value in drive.items())


def raced(drive: dict[str, Any], folder: Path, suffix: str = "", **how: Any) -> tuple[dict[str, Any], dict[str, float]]:
    """The race of a drive, and the RMSE of each run's places against the truth, metres."""
    name = name_of(drive)
    log, truth, out = folder / f"{name}.mcap", folder / f"{name}.truth.tum", folder / (name + suffix)
    if not log.exists():
        dmp.simulate.town(log, truth=truth, **SENSOR, **drive)
    if not (out / "race.json").exists():
        dmp.race(log, **how, out=out, progress=False)
    race = json.loads((out / "race.json").read_text())
    runs = [row["name"] for row in race["runs"] if row["name"] in race["score"]["order"]]
    return race, {run: dmp.truth.ape(truth, out / f"{run}.tum", align=True)["stats"]["rmse"] for run in runs}


def repaired(drive: dict[str, Any], folder: Path, run: str) -> str:
    """The same RMSE once the run's own loops are closed; a dash where that changes nothing."""
    log, truth, out = (folder / f"{name_of(drive)}{end}" for end in (".mcap", ".truth.tum", f"-{run}.tum"))
    if not out.exists():
        dmp.repair(log, {run: folder / name_of(drive) / f"{run}.tum"}, out, progress=False)
    return f"{dmp.truth.ape(truth, out, align=True)['stats']['rmse']:.3f}" if out.exists() else "–"


def verdicts(race: dict[str, Any], error_m: dict[str, float]) -> list[tuple[str, str, str]]:
    """Each pair whose errors differ, the better run by ATE first, and what is said of it."""
    found = []
    for pair in race["score"]["pairs"]:
        good, bad = sorted((pair["a"], pair["b"]), key=error_m.__getitem__)
        if error_m[bad] > APART * error_m[good]:
            said = {good: "right", bad: "wrong"}.get(pair["verdict"], pair["verdict"].split()[0])
            found.append((good, bad, said))
    return found


def all_systems(drives: list[dict[str, Any]], folder: Path) -> None:
    """One row a drive: what is decided between real systems, and how good the first one is."""
    print("| drive | runs | failed | pairs | right | wrong | mixed | undecided | same | first by score | ATE, m | repaired | first by ATE | ATE, m |")
    print("|---|--:|--:|--:|--:|--:|--:|--:|--:|---|--:|--:|---|--:|")
    total: Counter[str] = Counter()
    wrong = []
    for drive in drives:
        race, error_m = raced(drive, folder, systems=SYSTEMS, settings=SETTINGS)
        found = verdicts(race, error_m)
        counts = Counter(said for _, _, said in found)
        total += counts
        wrong += [(drive, good, error_m[good], bad, error_m[bad]) for good, bad, said in found if said == "wrong"]
        first, best = race["score"]["order"][0], min(error_m, key=error_m.__getitem__)
        numbers = [len(race["runs"]), len(race["runs"]) - len(error_m), len(found), *(counts[said] for said in SAID)]
        cells = [" ".join(map(str, drive.values())), *numbers, first, f"{error_m[first]:.3f}"]
        cells += [repaired(drive, folder, first), best, f"{error_m[best]:.3f}"]
        print("| " + " | ".join(map(str, cells)) + " |", flush=True)
    print(f"\n{sum(total.values())} pairs: " + ", ".join(f"{total[said]} {said}" for said in SAID))
    for drive, good, good_m, bad, bad_m in wrong:
        print(f"- {drive}: {bad} ({bad_m:.3f} m) over {good} ({good_m:.3f} m)")


def tuning(folder: Path) -> None:
    """One row a drive: the setting that was chosen on a part of it, beside the default's and the best of the grid."""
    print("| drive | chosen | ATE, m | default's ATE, m | best of the grid | ATE, m |\n|---|---|--:|--:|---|--:|")
    for drive in TUNED:
        race, tuned_m = raced(drive, folder, "-tuned", systems=["kiss"], tune="kiss", settings=CANDIDATES)
        _, error_m = raced(drive, folder, "-grid", systems=["kiss"], settings=CANDIDATES)
        _, default_m = raced(drive, folder, "-default", systems=["kiss"])
        tune = race["tune"]
        of_grid = {**error_m, **default_m}
        chosen, best = tune["chosen"] or tune["default"], min(of_grid, key=of_grid.__getitem__)
        name = " ".join(map(str, drive.values()))
        cells = [name, chosen, tuned_m[chosen], tuned_m[tune["default"]], best, of_grid[best]]
        print("| " + " | ".join(f"{cell:.3f}" if isinstance(cell, float) else str(cell) for cell in cells) + " |", flush=True)


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--drives", type=int, default=len(DRIVES))
    arguments.add_argument("--tune", action="store_true", help="choose settings of kiss instead")
    arguments.add_argument("-o", "--out", type=Path, default=Path("target/study/race"))
    given = arguments.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    if given.tune:
        tuning(given.out)
    else:
        all_systems(DRIVES[: given.drives], given.out)


if __name__ == "__main__":
    main()
