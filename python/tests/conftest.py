"""What the tests share: the sample town, and the command that was built beside the package."""

from __future__ import annotations

import json
import os
import subprocess
import tempfile
from pathlib import Path
from typing import Any, Iterator

import numpy as np
import pytest

import dmp_slam as dmp

SAMPLES = Path(__file__).resolve().parents[2] / "data-samples"


@pytest.fixture(scope="session")
def town() -> Path:
    return SAMPLES / "town.mcap"


@pytest.fixture(scope="session")
def runs() -> dict[str, Path]:
    return {name: SAMPLES / f"{name}.tum" for name in ("truth", "drift", "noise", "collapsed")}


@pytest.fixture(scope="session")
def result(town: Path, runs: dict[str, Path]) -> dmp.Result:
    """All that can be asked of the samples."""
    return dmp.score(town, runs, report=True, per_frame=True, per_tile=True, progress=False)


@pytest.fixture(scope="session")
def poses(runs: dict[str, Path]) -> tuple[Any, Any]:
    """The true trajectory as matrices and stamps in nanoseconds."""
    lines = [line.split() for line in runs["truth"].read_text().splitlines()[1:]]
    stamps = np.array([int(line[0].replace(".", "")) for line in lines])
    x, y, z, w = (np.array([float(line[k]) for line in lines]) for k in range(4, 8))
    matrices = np.zeros((len(lines), 4, 4))
    matrices[:, 0, 0], matrices[:, 0, 1] = 1 - 2 * (y * y + z * z), 2 * (x * y - z * w)
    matrices[:, 0, 2], matrices[:, 1, 0] = 2 * (x * z + y * w), 2 * (x * y + z * w)
    matrices[:, 1, 1], matrices[:, 1, 2] = 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)
    matrices[:, 2, 0], matrices[:, 2, 1] = 2 * (x * z - y * w), 2 * (y * z + x * w)
    matrices[:, 2, 2], matrices[:, 3, 3] = 1 - 2 * (x * x + y * y), 1
    matrices[:, :3, 3] = [[float(cell) for cell in line[1:4]] for line in lines]
    return matrices, stamps


@pytest.fixture(scope="session")
def scans(town: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[dmp.Scan]]:
    """The scans of the town in a folder, and in memory."""
    folder = tmp_path_factory.mktemp("scans") / "town"
    dmp.convert.log(town, folder, to="bin", progress=False)
    files = sorted(folder.rglob("*.bin"))
    times = {file.stem: file for file in folder.rglob("*.f32")}
    stamps = next(folder.rglob("times.txt")).read_text().split()
    found = []
    for file, stamp in zip(files, stamps):
        points = np.fromfile(file, np.float32).reshape(-1, 4)[:, :3]
        found.append(dmp.Scan(points, np.fromfile(times[file.stem], np.float32), float(stamp)))
    return folder, found


@pytest.fixture
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of temporary files of this test, to look whether something is left in it."""
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    monkeypatch.setenv("TMPDIR", str(folder))
    return folder


# Of the modules that ask for them.
@pytest.fixture(scope="module")
def client() -> Iterator[Any]:
    import distributed

    cluster = distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=":0", memory_limit="4 GB"
    )
    with cluster, distributed.Client(cluster) as client:
        yield client


@pytest.fixture(scope="module")
def served() -> Iterator[Any]:
    from cluster import Bucket

    bucket = Bucket()
    yield bucket
    bucket.close()


@pytest.fixture
def bucket(served: Any, town: Path, runs: dict[str, Path]) -> Any:
    """With the samples in it, and nothing else."""
    import fsspec

    served.fails_every, served.rest_s, served.failed = 0, 0.0, 0
    system = fsspec.filesystem("s3", **served.options)
    if system.exists("drives"):
        system.rm("drives", recursive=True)
    system.invalidate_cache()
    system.mkdir("drives")
    for file in (town, *runs.values()):
        system.put_file(str(file), f"drives/{file.name}")
    served.requests.clear()
    return served


def command(*arguments: Any) -> subprocess.CompletedProcess[str]:
    """Runs the command that was built beside the package."""
    program = os.environ["DMP_COMMAND"]
    return subprocess.run([program, *map(str, arguments)], capture_output=True, text=True, check=False)


def in_parts(found: dict[str, Any]) -> dict[str, Any]:
    """A result without times and memory, and without what a score in parts lacks."""
    runs = [{**run, "thickness": None, "surfels_contradicted": None} for run in found["runs"]]
    return {**{key: value for key, value in found.items() if key not in ("timing", "memory")}, "runs": runs}


def scores(text: str) -> dict[str, Any]:
    """A result without times, memory and the names of files, which differ from one time to the next."""
    found: dict[str, Any] = json.loads(text)
    del found["timing"], found["memory"], found["inputs"]["log"]
    for run in found["inputs"]["runs"]:
        run["file"] = None
    return found
