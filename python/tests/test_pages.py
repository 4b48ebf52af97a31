"""The examples in the pages of ``docs`` run, as they stand there."""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pandas
import pytest
from conftest import SAMPLES

import dmp_slam as dmp

DOCS = SAMPLES.parent / "docs"
#: Examples that need more than the samples: a line of each, and what.
NOT_RUN = {
    'distributed.Client("tcp://scheduler:8786")': "a cluster and an object store; test_dask.py has both",
    'dataset_factory("mulran"': "a dataset of many gigabytes",
    "found = dmp.residuals(map, points, pose)": "scans posed in a map; test_residuals.py has them",
    "learn.TrajectoryLoss(scans": "the same and torch; test_torch.py has both",
    'dmp.race("drive.mcap", ["kiss", "ct"': "systems of evalio and a driver; test_race.py has both",
    "import laspy": "a package that nothing else here needs; the residuals are read by the tests of the command",
}


def blocks() -> list[Any]:
    found = []
    for page in sorted(DOCS.rglob("*.md")):
        text = page.read_text(encoding="utf-8")
        for match in re.finditer(r"^```python\n(.*?)^```", text, re.MULTILINE | re.DOTALL):
            line = text.count("\n", 0, match.start()) + 2
            found.append(pytest.param(match[1], line, id=f"{page.relative_to(DOCS)}:{line}"))
    return found


BLOCKS = blocks()


def reasons(code: str) -> list[str]:
    return [why for line, why in NOT_RUN.items() if line in code]


@pytest.fixture
def given(scans: Any, poses: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """What the pages take for granted: files in the folder, and arrays."""
    for name, sample in [("drive.mcap", "town.mcap"), ("kiss.tum", "truth.tum"), ("lio.tum", "drift.tum")]:
        shutil.copy(SAMPLES / sample, tmp_path / name)
    monkeypatch.chdir(tmp_path)
    matrices, stamps = poses
    directions = np.tile([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0]], (5, 1))
    return {
        "dmp": dmp,
        "pandas": pandas,
        "recording": scans[1],
        "poses": matrices,
        "stamps": stamps,
        "origins": np.zeros((10, 3)),
        "directions": directions,
        "ranges": np.full(10, 5.0),
    }


@pytest.mark.parametrize(("code", "line"), [block for block in BLOCKS if not reasons(block.values[0])])
def test_examples_of_pages_run(code: str, line: int, given: dict[str, Any]) -> None:
    before = dict(given)
    # Errors name the line of the page.
    exec(compile("\n" * (line - 1) + code, "the page", "exec"), given)
    made = {name: value for name, value in given.items() if name not in before}
    if "result" in made:
        assert sorted(made["result"].order) and not made["result"].is_damaged
    if "hits" in made:
        assert len(made["hits"].z1) == 10


def test_what_is_not_run_is_there_still() -> None:
    for line in NOT_RUN:
        assert sum(line in block.values[0] for block in BLOCKS) == 1, line
    assert len(BLOCKS) > len(NOT_RUN)
