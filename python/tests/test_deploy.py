"""The files of `deploy`, as far as they can be tried without a cluster."""

import json
import os
import pathlib
import stat
import string
import subprocess
import tarfile
from typing import Any

import kubernetes_validate
import pytest
import yaml
from conftest import in_parts

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
    return in_parts(json.loads(text))


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


def test_jobs_of_slurm_score_as_one_machine(path: pathlib.Path, tmp_path: pathlib.Path) -> None:
    sbatch = path / "sbatch"
    sbatch.write_text(SBATCH)
    sbatch.chmod(sbatch.stat().st_mode | stat.S_IXUSR)
    work, jobs = tmp_path / "it's 100 % $HOME; of work", tmp_path / "jobs"
    environment = {**os.environ, "PATH": f"{path}:{os.environ['PATH']}", "JOBS": str(jobs)}
    script = [DEPLOY / "slurm" / "score.sh", str(work), *asked()]
    subprocess.run(script, env=environment, capture_output=True, text=True, check=True)
    assert jobs.read_text().splitlines() == ["", "afterok:1", "afterok:2", "", "afterok:3:4"]
    assert comparable((work / "scores.json").read_text()) == scored(path)


def test_jobs_of_kubernetes_score_as_one_machine(path: pathlib.Path, tmp_path: pathlib.Path) -> None:
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


def in_github(folder: pathlib.Path, arguments: str, **environment: str) -> "subprocess.CompletedProcess[str]":
    """What the action does in a job: its outputs are in files of the folder."""
    given = {
        "GITHUB_ACTIONS": "true",
        "RUNNER_TEMP": str(folder),
        "GITHUB_OUTPUT": str(folder / "output"),
        "GITHUB_STEP_SUMMARY": str(folder / "summary"),
        "DMP_ARGUMENTS": arguments,
    }
    script = DEPLOY / "github" / "score.sh"
    env = {**os.environ, **given, **environment}
    return subprocess.run([script], cwd=SAMPLES, env=env, capture_output=True, text=True, check=False)


def test_the_action_scores_and_annotates(tmp_path: pathlib.Path, path: pathlib.Path) -> None:
    on_path = f"{path}:{os.environ['PATH']}"
    arguments = "town.mcap\n  -t new=truth.tum\n-t drift.tum  \n\n--every 4\n--expect best:drift\n"
    ended = in_github(tmp_path, arguments, PATH=on_path)
    assert ended.returncode == 4 and "::error title=dmp gate failed::drift: worse than new" in ended.stderr
    outputs = dict(line.split("=", 1) for line in (tmp_path / "output").read_text().splitlines())
    report = json.loads(pathlib.Path(outputs["json"]).read_text())
    assert report["order"] == ["new", "drift"]
    assert "<title>" in pathlib.Path(outputs["page"]).read_text()
    summary = (tmp_path / "summary").read_text()
    assert summary.startswith("```text\n") and "new" in summary and summary.endswith("```\n")
    # A name does not end the fence that it stands in.
    (tmp_path / "summary").unlink()
    ended = in_github(tmp_path, "town.mcap\n-t a```b=truth.tum\n--every 9", PATH=on_path)
    assert ended.returncode == 0, ended.stderr
    assert (tmp_path / "summary").read_text().startswith("````text\n")
    for option in ("--json", "--report x.html", "--report=x.html"):
        ended = in_github(tmp_path, f"town.mcap\n-t truth.tum\n{option}", PATH=on_path)
        assert ended.returncode == 2 and "the action gives this option itself" in ended.stderr
    # Wrong usage leaves no result.
    (tmp_path / "output").unlink()
    ended = in_github(tmp_path, "town.mcap\n--voxle 2", PATH=on_path)
    assert ended.returncode == 2 and "--voxle" in ended.stderr
    assert "page=" not in (tmp_path / "output").read_text()


def test_the_action_takes_a_release(tmp_path: pathlib.Path) -> None:
    name = f"dmp-1.2.3-{os.uname().machine}-unknown-linux-gnu"
    (tmp_path / "v1.2.3").mkdir()
    with tarfile.open(tmp_path / "v1.2.3" / f"{name}.tar.gz", "w:gz") as archive:
        archive.add(os.environ["DMP_COMMAND"], f"{name}/dmp")
    releases = {"DMP_RELEASES": tmp_path.as_uri(), "PATH": "/usr/bin:/bin"}
    arguments = "town.mcap\n-t truth.tum\n--every 9"
    for given in ({"DMP_VERSION": "1.2.3"}, {"DMP_REF": "v1.2.3"}):
        (tmp_path / "output").unlink(missing_ok=True)
        ended = in_github(tmp_path, arguments, **releases, **given)
        assert ended.returncode == 0, ended.stderr
    if not any(os.access(f"{folder}/dmp", os.X_OK) for folder in ("/usr/bin", "/bin")):
        ended = in_github(tmp_path, arguments, **releases, DMP_REF="main")
        assert (ended.returncode, ended.stderr) == (2, "error: no dmp on the PATH: install it, or name a version\n")


def test_the_action_and_the_workflows_fit_their_scripts() -> None:
    action = yaml.safe_load((ROOT / "action.yml").read_text())
    script = (DEPLOY / "github" / "score.sh").read_text()
    for step in action["runs"]["steps"]:
        for name in step.get("env", {}):
            assert name in script, name
    assert set(action["inputs"]) == {"arguments", "version", "page"} and set(action["outputs"]) == {"json", "page"}
    for file in (ROOT / ".github" / "workflows").iterdir():
        workflow = yaml.safe_load(file.read_text())
        needed = {need for job in workflow["jobs"].values() for need in job.get("needs", [])}
        assert needed <= set(workflow["jobs"]), file
