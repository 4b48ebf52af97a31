"""Races real systems on simulated drives, and compares the verdicts with the true trajectories.

    python python/studies/race.py [--tune | --null N | --board DATA] [--drives N] [-o FOLDER]

needs `dmp-slam[race]`. It prints the tables of docs/accuracy.md and keeps each race in its folder; a drive whose race is there is
not raced again.
"""

from __future__ import annotations

import argparse
import json
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

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
SENSOR = {"scans": 250, "rate": 5, "azimuth_steps": 360, "truth_rate": 200}
SYSTEMS = ["kiss", "genz", "ct", "mad", "loam", "form", "dlio", "lio-sam", "kiss-slam"]
WITHOUT_IMU = SYSTEMS[:6]
SETTINGS = {"kiss": {"deskew": [True, False], "voxel_size": [0.5, 1.0]}}
SAMPLES = Path(__file__).parents[2] / "data-samples"
#: Of a good MEMS: noise density, bias and its random walk; rad/s and m/s², per √Hz, and √Hz times them.
IMU_NOISE = {"gyro": (1e-3, 2e-3, 1e-5), "accel": (1e-2, 2e-2, 1e-4)}
GRAVITY_M_S2 = 9.80665
#: Pairs whose errors differ by less are not counted.
APART = 1.2
#: Edge of a place, metres; of a place so many sightings are compared, in one scan of so many.
PLACE_M, SIGHTINGS, EVERY = 0.5, 8, 4
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


def poses(truth: Path) -> tuple[Any, Any, Any]:
    """Stamps, nanoseconds, places, metres, and rotations of a TUM file."""
    rows = [line.split() for line in truth.read_text().splitlines() if line[0] != "#"]
    values = np.array([row[1:] for row in rows], float)
    x, y, z, w = values[:, 3:].T
    o = np.zeros_like(x)
    turned = np.array([[o, -z, y], [z, o, -x], [-y, x, o]]).transpose(2, 0, 1)
    return np.array([int(row[0].replace(".", "")) for row in rows]), values[:, :3], np.eye(3) + 2 * w[:, None, None] * turned + 2 * turned @ turned


def imu(truth: Path, file: Path, seed: int = 0) -> Path:
    """What an IMU at the sensor measures on the true trajectory, with noise, biases and their random walks, as a file of EuRoC."""
    stamps, places, rotations = poses(truth)
    step_s, random, count = (stamps[1] - stamps[0]) / 1e9, np.random.default_rng(seed), len(stamps) - 2
    # From one pose before to one after; of so small a rotation the skew part is its axis times the sine of its angle.
    turn = rotations[:-2].transpose(0, 2, 1) @ rotations[2:]
    sines = np.stack([turn[:, 2, 1] - turn[:, 1, 2], turn[:, 0, 2] - turn[:, 2, 0], turn[:, 1, 0] - turn[:, 0, 1]], 1) / 2
    accelerations = (places[2:] - 2 * places[1:-1] + places[:-2]) / step_s**2 + [0, 0, GRAVITY_M_S2]
    measured = []
    for exact, (noise, bias, walk) in (
        (sines / (2 * step_s), IMU_NOISE["gyro"]),
        (np.einsum("nji,nj->ni", rotations[1:-1], accelerations), IMU_NOISE["accel"]),
    ):
        white, walked = random.standard_normal((2, count, 3))
        drifts = bias * random.standard_normal(3) + walk * step_s**0.5 * walked.cumsum(axis=0)
        measured.append(exact + noise / step_s**0.5 * white + drifts)
    lines = (f"{stamp},{','.join(map(repr, row))}" for stamp, row in zip(stamps[1:-1], np.hstack(measured).tolist()))
    file.write_text("#timestamp [ns],gyro x,y,z [rad/s],acceleration x,y,z [m/s^2]\n" + "\n".join(lines) + "\n")
    return file


def raced(drive: dict[str, Any], folder: Path, suffix: str = "", **how: Any) -> tuple[dict[str, Any], dict[str, float]]:
    """The race of a drive, and the RMSE of each run's places against the truth, metres."""
    name = name_of(drive)
    log, truth, out = folder / f"{name}.mcap", folder / f"{name}.truth.tum", folder / (name + suffix)
    measured = folder / f"{name}.imu.csv"
    if not measured.exists():
        dmp.simulate.town(log, truth=truth, **SENSOR, **drive)
        imu(truth, measured)
    if not (out / "race.json").exists():
        dmp.race(log, **how, imu=measured, out=out, progress=False)
    race = json.loads((out / "race.json").read_text())
    runs = [row["name"] for row in race["runs"] if row["name"] in race["score"]["order"]]
    return race, {run: dmp.truth.ape(truth, out / f"{run}.tum", align=True)["stats"]["rmse"] for run in runs}


def repaired(drive: dict[str, Any], folder: Path, run: str) -> str:
    """The same RMSE once the run's own loops are closed; a dash where that changes nothing."""
    log, truth, out = (folder / f"{name_of(drive)}{end}" for end in (".mcap", ".truth.tum", f"-{run}.tum"))
    if not out.exists():
        dmp.repair(log, {run: folder / name_of(drive) / f"{run}.tum"}, out, progress=False)
    return f"{dmp.truth.ape(truth, out, align=True)['stats']['rmse']:.3f}" if out.exists() else "–"


def inconsistency_m(drive: dict[str, Any], folder: Path, runs: list[str]) -> dict[str, float]:
    """The mean distance between the places to which a run puts two sightings of one true place, metres. No score enters."""
    name = name_of(drive)
    files = {"truth": folder / f"{name}.truth.tum", **{run: folder / name / f"{run}.tum" for run in runs}}
    posed = dmp.score(folder / f"{name}.mcap", files, every=EVERY, returns="all", residuals=True, progress=False)
    sighted: dict[str, Any] = {}
    for run in files:
        returns = posed.residuals(run)
        # Frame, time and range distinguish the returns.
        keys = np.column_stack([returns["frame"], returns["time_s"], returns["range_m"]])
        sighted[run] = (np.ascontiguousarray(keys).view("f8,f8,f8").ravel(), np.column_stack([returns[axis] for axis in "xyz"]))
    common = sighted["truth"][0]
    for keys, _ in sighted.values():
        common = np.intersect1d(common, keys)
    common = np.random.default_rng(0).permutation(common)

    def points(run: str) -> Any:
        keys, at = sighted[run]
        order = np.argsort(keys)
        return at[order[np.searchsorted(keys, common, sorter=order)]]

    true = points("truth")
    places = np.unique(np.floor(true / PLACE_M), axis=0, return_inverse=True)[1].ravel()
    by_place = np.argsort(places, kind="stable")
    places, frames, true = places[by_place], common["f0"][by_place], true[by_place]
    found = {}
    for run in runs:
        seen = points(run)[by_place]
        # In the world of the truth: the rotation and translation that fit best.
        u, _, v = np.linalg.svd((seen - seen.mean(0)).T @ (true - true.mean(0)))
        off = (seen - seen.mean(0)) @ (u @ np.diag([1, 1, np.linalg.det(u @ v)]) @ v) - (true - true.mean(0))
        apart = []
        for ahead in range(1, SIGHTINGS):
            two = (places[:-ahead] == places[ahead:]) & (frames[:-ahead] != frames[ahead:])
            apart.append(np.linalg.norm(off[:-ahead][two] - off[ahead:][two], axis=1))
        found[run] = float(np.concatenate(apart).mean())
    return found


def verdicts(race: dict[str, Any], error_m: dict[str, float]) -> list[tuple[str, str, str]]:
    """Each pair whose errors differ, the better run by them first, and what is said of it."""
    found = []
    for pair in race["score"]["pairs"]:
        good, bad = sorted((pair["a"], pair["b"]), key=error_m.__getitem__)
        if error_m[bad] > APART * error_m[good]:
            said = {good: "right", bad: "wrong"}.get(pair["verdict"], pair["verdict"].split()[0])
            found.append((good, bad, said))
    return found


def leaders(score: dict[str, Any]) -> list[str]:
    """The runs of the first rank."""
    found = score["order"][:1]
    for name in score["order"][1:]:
        if [found[-1], name] not in score["ties"]:
            break
        found.append(name)
    return found


def all_systems(drives: list[dict[str, Any]], folder: Path) -> None:
    """One row a drive: what is decided between real systems, and how good the first one is."""
    print("| drive | runs | failed | pairs | right | wrong | mixed | undecided | same | first by score | ATE, m | repaired | first by ATE | ATE, m |")
    print("|---|--:|--:|--:|--:|--:|--:|--:|--:|---|--:|--:|---|--:|")
    total: dict[str, Counter[str]] = {"ATE": Counter(), "consistency": Counter()}
    wrong = []
    for drive in drives:
        race, error_m = raced(drive, folder, systems=SYSTEMS, settings=SETTINGS)
        apart_m = inconsistency_m(drive, folder, list(error_m))
        found = verdicts(race, error_m)
        counts = Counter(said for _, _, said in found)
        total["ATE"] += counts
        total["consistency"] += Counter(said for _, _, said in verdicts(race, apart_m))
        for by, of_run in (("ATE", error_m), ("consistency", apart_m)):
            wrong += [(by, drive, good, of_run[good], bad, of_run[bad]) for good, bad, said in verdicts(race, of_run) if said == "wrong"]
        first, best = leaders(race["score"]), min(error_m, key=error_m.__getitem__)
        numbers = [len(race["runs"]), len(race["runs"]) - len(error_m), len(found), *(counts[said] for said in SAID)]
        cells = [" ".join(map(str, drive.values())), *numbers]
        cells += [", ".join(first), ", ".join(f"{error_m[run]:.3f}" for run in first), repaired(drive, folder, first[0]), best, f"{error_m[best]:.3f}"]
        print("| " + " | ".join(map(str, cells)) + " |", flush=True)
    for by, counted in total.items():
        print(f"\nBy {by}, {sum(counted.values())} pairs: " + ", ".join(f"{counted[said]} {said}" for said in SAID))
    for by, drive, good, good_m, bad, bad_m in wrong:
        print(f"- by {by}, {drive}: {bad} ({bad_m:.3f} m) over {good} ({good_m:.3f} m)")


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


def replayed(scans: Any, given: Any) -> Any:
    """The true poses with noise and a drift that the seed draws."""
    of_stamp = {stamp: (place, rotation) for stamp, place, rotation in zip(*poses(SAMPLES / "truth.tum"))}
    random, walk_m = np.random.default_rng(given["seed"]), np.zeros(3)
    for scan in scans:
        place, rotation = of_stamp[scan.stamp]
        walk_m += 0.005 * random.standard_normal(3)
        yield scan.stamp, np.column_stack([rotation, place + walk_m + 0.03 * random.standard_normal(3)])


def systems() -> dict[str, dmp.System]:
    """This file is a driver, too."""
    return {"copy": dmp.System(replayed, {"seed": 0}, pose_at="start")}


def null(times: int) -> None:
    """How often tuning prefers one of ten copies of a setting that differ by chance alone."""
    found = Counter[str]()
    for number in range(times):
        settings = {"copy": {"seed": list(range(10 * number + 1, 10 * number + 11))}}
        race = dmp.race(SAMPLES / "town.mcap", [f"{__file__}:copy"], tune="copy", settings=settings, progress=False)
        tune = race.data["tune"]
        found["a copy is better" if tune["better"] else "none is better"] += 1
        found["a copy was chosen"] += tune["chosen"] is not None
    print(dict(found))


#: As fast as the scans came, mad depends on the clock; in several threads, on them.
REPEATABLE = {"mad": {"realtime": [False], "num_threads": [1]}}
#: Logs without a truth in the folder of recordings, each with a trajectory that came with it, a line a scan.
BOARD = {"nclt_revisit": "poses_lidar_odometry.txt", "rs32_static": "poses_icp_odom.txt", "udacity22": "poses_gicp_model.tum"}


def board(data: Path, folder: Path) -> None:
    """One row for each run of each real log, without times: the same bytes again."""
    print("| log | run | rank | verdict | revisit error, m | thick, cm | R_cv(10), m | coverage, % |\n|---|---|--:|---|--:|--:|--:|--:|")
    failed = []
    for log, came_with in BOARD.items():
        out, name, poses = folder / f"board-{log}", Path(came_with).stem, folder / f"{log}.tum"
        if not (out / "race.json").exists():
            # Logs without stamps are raced at ten scans a second.
            lines = [line.split()[1:] for line in (data / log / came_with).read_text().splitlines() if line[0] != "#"]
            poses.write_text("".join(f"{number / 10:.9f} {' '.join(line)}\n" for number, line in enumerate(lines)))
            systems = {**{name: name for name in WITHOUT_IMU}, name: f"cp {poses} {{out}}"}
            dmp.race(data / log / "scans", systems, settings=SETTINGS | REPEATABLE, out=out, progress=False)
        race = json.loads((out / "race.json").read_text())
        score, rank = race["score"], 1
        order, of_run = score["order"], {run["name"]: run for run in score["runs"]}
        drift = {run["name"]: run["median_m"]["value"] for run in (score["drift"] or {"runs": []})["runs"]}
        pairs = {frozenset((pair["a"], pair["b"])): pair for pair in score["pairs"]}
        for place, run in enumerate(order, 1):
            rank = rank if place > 1 and [order[place - 2], run] in score["ties"] else place
            said = pairs[frozenset((order[0], run))]["verdict"] if place > 1 else "first"
            scores = of_run[run]
            thick, r_cv = scores["thickness"], scores["r_cv_m2"]["10"]
            numbers = [drift.get(run), thick and 100 * thick["median_m"], r_cv and r_cv**0.5, 100 * scores["coverage"]]
            cells = [log, run, str(rank), "worse" if said == order[0] else said]
            print("| " + " | ".join(cells + ["–" if number is None else f"{number:.2f}" for number in numbers]) + " |")
        failed += [f"- {log}, {row['name']}: {row['failed']}" for row in race["runs"] if row["failed"]]
    print("\n" + "\n".join(failed))


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--drives", type=int, default=len(DRIVES))
    arguments.add_argument("--tune", action="store_true", help="choose settings of kiss instead")
    arguments.add_argument("-o", "--out", type=Path, default=Path("target/study/race"))
    arguments.add_argument("--null", type=int, metavar="N", help="tune so often among settings that are equal instead")
    arguments.add_argument("--board", type=Path, metavar="DATA", help="race on the real logs of this folder instead")
    given = arguments.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    if given.board:
        board(given.board.resolve(), given.out)
    elif given.null:
        null(given.null)
    elif given.tune:
        tuning(given.out)
    else:
        all_systems(DRIVES[: given.drives], given.out)


if __name__ == "__main__":
    main()
