#!/usr/bin/env python3
"""Compares `dmp truth ape|rpe` with evo 1.38.1, live, on generated trajectories.

    pip install evo==1.38.1
    python conformance.py --dmp target/release/dmp              # compare, print a summary
    python conformance.py --dmp … --golden golden.json          # and write the cases for the Rust test

Every case has a pair of trajectories of its own (fixed seed). evo runs through the code of its own
command; compared are the whole printed text (so six decimals exactly), the statistics in full precision
(1e-9 relative), every array of the result file, and that both fail where one does.
"""

import argparse
import contextlib
import io
import itertools
import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from importlib.metadata import version
from evo.cli import ape, ape_parser, rpe, rpe_parser
from evo.core.transformations import quaternion_matrix, quaternion_multiply
from evo.tools import file_interface

evo_version = version("evo")

SEED = 20240517
RELATIVE = 1e-9
# Below this, as a share of the largest error, a number is rounding of what should be zero.
NOTHING = 1e-12

APE_RELATIONS = ["full", "trans_part", "rot_part", "angle_deg", "angle_rad", "point_distance"]
RPE_RELATIONS = APE_RELATIONS + ["point_distance_error_ratio"]
ALIGNMENTS = [[], ["-a"], ["-s"], ["-as"], ["--align_origin"]]
KINDS = ["tum", "kitti", "euroc", "gaps", "duplicates", "unsorted_reference", "unsorted_estimate", "offset",
         "denser_estimate", "lengths", "equal_count", "doubled"]
OPTIONS = [
    ["--t_max_diff", "0.05"], ["--t_max_diff", "0.0005"], ["--t_start", "1000.5"], ["--t_end", "1001.2"],
    ["--t_start", "1000.3", "--t_end", "1001.5"], ["--change_unit", "cm"], ["--change_unit", "km"],
    ["--change_unit", "rad", "-r", "angle_deg"], ["--change_unit", "deg", "-r", "angle_rad"],
    ["-s", "--align_origin"],
]


def quaternions(rng, count, step):
    q = np.array([1.0, 0, 0, 0])
    rows = []
    for _ in range(count):
        turn = np.concatenate([[1.0], rng.normal(scale=step, size=3)])
        q = quaternion_multiply(q, turn / np.linalg.norm(turn))
        rows.append(q / np.linalg.norm(q))
    return np.array(rows)


def pair(rng, kind, count):
    """(stamps, xyz, quaternions wxyz) of reference and estimate."""
    stamps = 1000 + np.arange(count) * 0.05
    xyz = np.cumsum(rng.normal(scale=0.3, size=(count, 3)) + [0.3, 0.1, 0.0], axis=0)
    q = quaternions(rng, count, 0.1)
    turn = quaternions(rng, 1, 1.0)[0]
    moved = (quaternion_matrix(turn)[:3, :3] @ xyz.T).T * rng.uniform(0.5, 2) + rng.normal(scale=5, size=3)
    moved += rng.normal(scale=0.05, size=xyz.shape)
    noise = [quaternion_multiply(turn, quaternion_multiply(a, b)) for a, b in
             zip(q, [quaternions(rng, 1, 0.02)[0] for _ in range(count)])]
    jitter = rng.uniform(-0.008, 0.008, size=count) if kind != "equal_count" else np.zeros(count)
    reference, estimate = [stamps, xyz, q], [stamps + jitter, moved, np.array(noise)]

    def keep(path, ids):
        return [column[ids] for column in path]

    if kind == "gaps":
        estimate = keep(estimate, np.r_[0:count // 4, count // 2:count])
    elif kind == "denser_estimate":
        reference = keep(reference, np.sort(rng.permutation(count)[: 2 * count // 3]))
    elif kind == "duplicates":
        reference = keep(reference, np.sort(rng.integers(0, count, size=count + 5)))
        estimate = keep(estimate, np.sort(rng.integers(0, count, size=count)))
    elif kind == "unsorted_reference":
        reference = keep(reference, rng.permutation(count))
        estimate = keep(estimate, np.arange(0, count, 2))
    elif kind == "unsorted_estimate":
        estimate = keep(estimate, rng.permutation(count))
        reference = keep(reference, np.arange(0, count - 3))
    elif kind == "offset":
        estimate[0] = estimate[0] - 3.25
    elif kind == "lengths":
        estimate[2] = estimate[2] * rng.uniform(0.95, 1.05, size=(count, 1))
    elif kind in ("tum", "euroc"):
        estimate = keep(estimate, np.sort(rng.permutation(count)[: 3 * count // 4]))
    return reference, estimate


def as_tum(path):
    rows = np.column_stack([path[0], path[1], np.roll(path[2], -1, axis=1)])
    return "# stamp tx ty tz qx qy qz qw\n" + "".join(" ".join(f"{x:.9g}" if k else f"{x:.6f}"
                                                       for k, x in enumerate(row)) + "\n" for row in rows)


def as_euroc(path):
    head = "#timestamp [ns], p_x [m], p_y [m], p_z [m], q_w [], q_x [], q_y [], q_z []\n"
    return head + "".join(f"{round(stamp * 1e9)}," + ",".join(f"{x:.9g}" for x in (*xyz, *q)) + "\n"
                          for stamp, xyz, q in zip(*path))


def as_kitti(path):
    text = ""
    for xyz, q in zip(path[1], path[2]):
        rows = np.column_stack([quaternion_matrix(q)[:3, :3], xyz])
        text += " ".join(f"{x:.6e}" for x in rows.flatten()) + "\n"
    return text


def make(rng, kind, count):
    reference, estimate = pair(rng, kind, count)
    if kind == "kitti":
        return "kitti", as_kitti(reference), as_kitti(estimate)
    if kind == "euroc":
        return "euroc", as_euroc(reference), as_tum(estimate)
    return "tum", as_tum(reference), as_tum(estimate)


def cases():
    """(name, metric, kind, options, small). Small ones go into the golden file."""
    kinds = itertools.cycle(KINDS)

    def add(metric, options, small=False):
        kind = next(kinds)
        if kind == "kitti" and any(o.startswith("--t_") for o in options):
            kind = next(kinds)
        if kind == "offset":
            options = options + ["--t_offset", "3.25"]
        return metric, kind, options, small

    for round_, (relation, alignment) in itertools.product(
            range(3), itertools.product(APE_RELATIONS, ALIGNMENTS)):
        yield add("ape", ["-r", relation, *alignment], round_ == 0 and len(alignment) < 2)
        if round_:
            next(kinds)
    alignments = itertools.cycle(ALIGNMENTS)
    deltas = {"f": ["1", "3"], "m": ["1.5", "0.8"], "d": ["25", "12"], "r": ["0.4", "0.25"]}
    number = 0
    for relation, unit, all_pairs, _ in itertools.product(RPE_RELATIONS, "fmdr", [False, True], range(2)):
        number += 1
        options = ["-r", relation, "-u", unit, "-d", deltas[unit][number % 2], *next(alignments)]
        options += ["--all_pairs"] if all_pairs else []
        yield add("rpe", options, number % 9 == 0)
    yield add("rpe", ["-u", "m"], True)
    for metric, options in itertools.product(["ape", "rpe"], OPTIONS):
        yield add(metric, options, metric == "ape")


def one(kind):
    return {"tum": "0 1 2 3 0 0 0 1\n", "kitti": "1 0 0 1 0 1 0 2 0 0 1 3\n"}[kind]


def line_of(count, kind="tum"):
    if kind == "kitti":
        return "".join(f"1 0 0 {k} 0 1 0 0 0 0 1 0\n" for k in range(count))
    return "".join(f"{k} {k} 0 0 0 0 0 1\n" for k in range(count))


def edge_cases():
    """(name, metric, word, reference, estimate, options): what cannot, or can just, be answered."""
    far = line_of(8).splitlines()
    far = "".join(f"{float(row.split()[0]) + 100} {row.split(' ', 1)[1]}\n" for row in far)
    zero = "".join(f"{k} {k * k} {k} 1 0 0 0 0\n" for k in range(6))
    bent = "".join(f"{k} {k * k} {k} {(-1) ** k} 0 0 0.6 0.8\n" for k in range(6))
    still = "".join(f"{k} 1 2 3 0 0 0 1\n" for k in range(6))
    skew = "".join(f"1.1 0 0 {k * k} 0 1 0 {k} 0 0 1 0\n" for k in range(6))
    good = "".join(f"1 0 0 {k * k} 0 1 0 {k} 0 0 1 {k % 3}\n" for k in range(6))
    yield "no_match", "ape", "tum", line_of(8), far, []
    yield "no_match_offset", "ape", "tum", line_of(8), far, ["--t_offset", "100"]
    yield "matched_by_offset", "ape", "tum", line_of(8), far, ["--t_offset", "-100"]
    yield "collinear", "ape", "tum", line_of(8), line_of(8), ["-a"]
    yield "collinear_scale", "ape", "tum", line_of(8), line_of(8), ["-s"]
    yield "one_pose", "ape", "tum", one("tum"), one("tum"), []
    yield "one_pose_pairs", "rpe", "tum", one("tum"), one("tum"), []
    yield "one_kitti_pose", "ape", "kitti", one("kitti"), one("kitti"), []
    yield "no_pairs", "rpe", "tum", line_of(8), line_of(8), ["-d", "100", "-u", "m"]
    yield "no_all_pairs", "rpe", "tum", line_of(8), line_of(8), ["-d", "2.5", "-u", "m", "--all_pairs"]
    yield "all_pairs_delta_zero", "rpe", "tum", line_of(8), line_of(8), ["-d", "0", "--all_pairs"]
    yield "delta_zero", "rpe", "tum", line_of(8), line_of(8), ["-d", "0"]
    yield "delta_negative", "rpe", "tum", line_of(8), line_of(8), ["-d", "-1"]
    yield "delta_not_whole", "rpe", "tum", line_of(8), line_of(8), ["-d", "1.5"]
    yield "angle_too_large", "rpe", "tum", bent, bent, ["-d", "200", "-u", "d"]
    yield "counts_differ", "ape", "kitti", line_of(8, "kitti"), line_of(7, "kitti"), []
    yield "counts_differ_aligned", "ape", "kitti", line_of(8, "kitti"), line_of(7, "kitti"), ["-a"]
    yield "start_after_end", "ape", "tum", line_of(8), line_of(8), ["--t_start", "5", "--t_end", "2"]
    yield "empty_time", "ape", "tum", line_of(8), line_of(8), ["--t_start", "50", "--t_end", "60"]
    yield "start_zero", "ape", "tum", bent, zero, ["--t_start", "0"]
    yield "zero_quaternions", "ape", "tum", bent, zero, ["-r", "angle_deg"]
    yield "identical", "ape", "tum", bent, bent, ["-r", "full"]
    yield "standstill_ratio", "rpe", "tum", still, bent, ["-r", "point_distance_error_ratio"]
    yield "standstill", "rpe", "tum", still, bent, []
    yield "no_rotation", "ape", "kitti", good, skew, ["-r", "angle_deg"]
    yield "no_rotation_but_places", "ape", "kitti", good, skew, []
    yield "unit_of_other_kind", "ape", "tum", bent, zero, ["--change_unit", "deg"]
    yield "unit_of_none", "ape", "tum", bent, zero, ["-r", "full", "--change_unit", "m"]


def run_evo(metric, word, files, options, zip_path):
    """(printed text or None, result or None); a failure has neither."""
    parser, command = {"ape": (ape_parser, ape), "rpe": (rpe_parser, rpe)}[metric]
    printed = io.StringIO()
    arguments = [word, *map(str, files), *options, "--save_results", str(zip_path), "--no_warnings"]
    try:
        with contextlib.redirect_stdout(printed), np.errstate(all="ignore"):
            command.run(parser.parser().parse_args(arguments))
    except (Exception, SystemExit):  # whatever evo dies of, it has given no numbers
        return None, None
    # Warnings and the progress of a search are no part of the result.
    lines = re.split(r"[\r\n]", printed.getvalue())
    noise = re.compile(r"\x1b\[|Searching all pairs|^\d+ %$")
    return "\n".join(line for line in lines if not noise.search(line)), file_interface.load_res_file(zip_path)


def run_dmp(dmp, metric, word, files, options, zip_path):
    command = [dmp, "truth", metric, word, *map(str, files), *options]
    as_json = subprocess.run([*command, "--json"], capture_output=True, text=True)
    as_text = subprocess.run([*command, "--save_results", zip_path], capture_output=True, text=True)
    return as_json, as_text


def near(a, b, largest):
    a, b = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
    if a.shape != b.shape:
        return False
    return bool(np.all(np.abs(a - b) <= np.maximum(RELATIVE * np.maximum(np.abs(a), np.abs(b)), NOTHING * largest)))


def on_a_line(files):
    """Whether the associated places of two TUM files leave the rotation undetermined, but for rounding."""
    paths = [file_interface.read_tum_trajectory_file(str(file)) for file in files]
    x, y = (path.positions_xyz - path.positions_xyz.mean(axis=0) for path in paths[0].sync_with(paths[1]))
    values = np.linalg.svd(x.T @ y, compute_uv=False)
    return values[1] < 1e-15 * values[0]


def compare(dmp, name, metric, word, reference, estimate, options, golden):
    """A list of differences."""
    with tempfile.TemporaryDirectory() as folder:
        files = [Path(folder) / "reference.txt", Path(folder) / "estimate.txt"]
        files[0].write_text(reference)
        files[1].write_text(estimate)
        text, result = run_evo(metric, word, files, options, Path(folder) / "evo.zip")
        as_json, as_text = run_dmp(dmp, metric, word, files, options, Path(folder) / "dmp.zip")
        if golden is not None:
            golden.append({"name": name, "metric": metric, "word": word, "reference": reference,
                           "estimate": estimate, "options": options, "text": text,
                           "stats": None if result is None else result.stats})
        errors = [line for line in as_json.stderr.splitlines() if line.startswith("error: ")]
        if result is None:
            good = as_json.returncode in (1, 2) and len(errors) == 1 and not as_json.stdout
            return ["evo fails", *([] if good else [f"dmp does not: {as_json}"])]
        if as_json.returncode == 1 and "no alignment is determined" in as_json.stderr and on_a_line(files):
            # What evo aligned by is rounding.
            return ["refused"]
        if as_json.returncode or as_text.returncode:
            return ["evo answers", f"dmp does not: {as_json.stderr}{as_text.stderr}"]
        differences = ["evo answers"]
        report = json.loads(as_json.stdout)
        errors = np.abs(result.np_arrays["error_array"])
        # Errors come from places; what is nothing beside those is rounding.
        scale = max(1.0, float(errors.max()))
        for key, value in result.stats.items():
            if not near(value, report["stats"][key], scale if key != "sse" else scale ** 2):
                differences.append(f"{key}: evo {value!r} dmp {report['stats'][key]!r}")
        if text != as_text.stdout and scale * NOTHING < errors.max():
            differences.append(f"text: evo {text!r} dmp {as_text.stdout!r}")
        ours = file_interface.load_res_file(Path(folder) / "dmp.zip")
        if set(ours.np_arrays) != set(result.np_arrays):
            differences.append(f"arrays: evo {sorted(result.np_arrays)} dmp {sorted(ours.np_arrays)}")
        for key in set(ours.np_arrays) & set(result.np_arrays):
            largest = max(1.0, float(np.abs(result.np_arrays[key]).max(initial=0)))
            if not near(ours.np_arrays[key], result.np_arrays[key], largest):
                differences.append(f"array {key} differs")
        if scale * NOTHING < errors.max() and ours.info != result.info:
            differences.append(f"info: evo {result.info} dmp {ours.info}")
        return differences


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--dmp", required=True, help="the command under test")
    parser.add_argument("--golden", help="file to write the small cases and evo's numbers into")
    arguments = parser.parse_args()
    assert evo_version == "1.38.1", f"evo {evo_version}: this is about 1.38.1"
    rng = np.random.default_rng(SEED)
    golden, answered, failed, refused, wrong = [], 0, 0, 0, 0
    pairs = 0
    per_metric = {"ape": 0, "rpe": 0}

    def check(name, metric, word, reference, estimate, options, keep):
        nonlocal answered, failed, refused, wrong, pairs
        found = compare(arguments.dmp, name, metric, word, reference, estimate, options, golden if keep else None)
        pairs += 1
        per_metric[metric] += 1
        answered += found[0] == "evo answers"
        failed += found[0] == "evo fails"
        refused += found[0] == "refused"
        if found[0] == "refused" and keep and golden[-1]["name"] == name:
            golden.pop()
        wrong += len(found) > 1
        for difference in found[1:]:
            print(f"DIFFERENT {name}: {metric} {word} {' '.join(options)}: {difference}")

    for number, (metric, kind, options, small) in enumerate(cases()):
        count = 12 if small else int(rng.integers(30, 120))
        word, reference, estimate = make(rng, kind, count)
        check(f"{number}_{kind}", metric, word, reference, estimate, options, small)
    for name, *case in edge_cases():
        check(name, *case, True)
    print(f"evo {evo_version}, seed {SEED}")
    print(f"{pairs} pairs of trajectories: {per_metric['ape']} APE, {per_metric['rpe']} RPE")
    print(f"evo gives numbers for {answered + refused}, fails on {failed}; "
          f"{refused} with numbers are refused (alignment on a line)")
    print(f"tolerance {RELATIVE:g} relative; printed text equal to the character")
    print(f"{wrong} different")
    if arguments.golden:
        cases_text = ",\n".join(json.dumps(case) for case in golden)
        Path(arguments.golden).write_text(f'{{"evo": "{evo_version}", "cases": [\n{cases_text}\n]}}\n')
        print(f"{len(golden)} cases written to {Path(arguments.golden).name}")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
