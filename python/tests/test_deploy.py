"""The files of `deploy`, as far as they can be tried without a cluster."""

import json
import os
import pathlib
import stat
import string
import subprocess
from typing import Any

import kubernetes_validate
import pytest
import yaml

ROOT = pathlib.Path(__file__).resolve().parents[2]
SAMPLES = ROOT / "data-samples"
DEPLOY = ROOT / "deploy"

# Does at once what Slurm does when there is a place: every task of an array, after the jobs that it waits for.
SBATCH = """#!/usr/bin/env bash
set -euo pipefail
array=1 work= after=
while [ $# -gt 0 ]; do
    case $1 in
    --array) array=${2#*-} ;;
    --dependency) after=$2 ;;
    --wrap) work=$2 ;;
    --job-name | --cpus-per-task | --mem | --output) ;;
    --parsable) shift; continue ;;
    *) echo "sbatch: $1?" >&2; exit 1 ;;
    esac
    shift 2
done
echo "$after" >> "$JOBS"
for id in ${after//[!0-9]/ }; do [ "$id" -lt "$(wc -l < "$JOBS")" ]; done
for task in $(seq "$array"); do SLURM_ARRAY_TASK_ID=$task sh -c "$work"; done
wc -l < "$JOBS"
"""


def comparable(text: str) -> Any:
    report = json.loads(text)
    del report["timing"], report["memory"]
    return report


@pytest.fixture
def path(tmp_path: pathlib.Path) -> pathlib.Path:
    """A folder with `dmp` in it."""
    folder = tmp_path / "bin"
    folder.mkdir()
    (folder / "dmp").symlink_to(os.environ["DMP_COMMAND"])
    return folder


def asked() -> list[str]:
    log, runs = SAMPLES / "town.mcap", ["truth", "drift"]
    return [str(log), *(part for run in runs for part in ("-t", str(SAMPLES / f"{run}.tum")))]


def scored(path: pathlib.Path) -> Any:
    done = subprocess.run([path / "dmp", "score", *asked(), "--json", "-q"], capture_output=True, text=True, check=True)
    return comparable(done.stdout)


def test_slurm(path: pathlib.Path, tmp_path: pathlib.Path) -> None:
    sbatch = path / "sbatch"
    sbatch.write_text(SBATCH)
    sbatch.chmod(sbatch.stat().st_mode | stat.S_IXUSR)
    work, jobs = tmp_path / "work", tmp_path / "jobs"
    environment = {**os.environ, "PATH": f"{path}:{os.environ['PATH']}", "JOBS": str(jobs)}
    script = [DEPLOY / "slurm" / "score.sh", str(work), *asked()]
    subprocess.run(script, env=environment, capture_output=True, text=True, check=True)
    assert jobs.read_text().splitlines() == ["", "afterok:1", "afterok:2", "", "afterok:3:4"]
    assert comparable((work / "scores.json").read_text()) == scored(path)


def test_kubernetes(path: pathlib.Path, tmp_path: pathlib.Path) -> None:
    work = tmp_path / "work"
    subprocess.run([path / "dmp", "shard", "plan", *asked(), "-o", work, "-q"], capture_output=True, check=True)
    template = string.Template((DEPLOY / "kubernetes" / "stage.yaml").read_text())
    for stage, parts in {"fuse": 3, "merge": 2, "cast": 3, "drift": 2}.items():
        job = yaml.safe_load(template.safe_substitute(STAGE=stage, PARTS=parts))
        kubernetes_validate.validate(job, "1.30", strict=True)
        assert (job["spec"]["completions"], job["spec"]["completionMode"]) == (parts, "Indexed")
        container = job["spec"]["template"]["spec"]["containers"][0]
        command = [part.replace("/shared/work", str(work)) for part in [*container["command"], *container["args"]]]
        for index in range(parts):
            environment = {**os.environ, "PATH": f"{path}:{os.environ['PATH']}", "JOB_COMPLETION_INDEX": str(index)}
            subprocess.run(command, env=environment, capture_output=True, check=True)
    reduced = subprocess.run([path / "dmp", "shard", "reduce", work, "--json", "-q"], capture_output=True, text=True, check=True)
    assert comparable(reduced.stdout) == scored(path)
