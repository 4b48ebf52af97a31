"""Suites: versions of a SLAM on several logs."""

from __future__ import annotations

import json
import shutil
from typing import Any

import pytest
from conftest import command

import dmp_slam as dmp


@pytest.fixture
def folder(town, runs, tmp_path):
    """Nine logs that are the sample, with two versions."""
    for version, run in (("old", "drift"), ("new", "truth")):
        (tmp_path / version).mkdir()
        for k in range(9):
            shutil.copy(runs[run], tmp_path / version / f"log-{k}.tum")
    logs = "".join(f'[[log]]\npath = {json.dumps(str(town))}\nname = "log-{k}"\n' for k in range(9))
    head = 'versions = ["old", "new"]\ntrajectories = "{version}/{log}.tum"\n[score]\nevery = 2\n'
    (tmp_path / "suite.toml").write_text(head + logs)
    return tmp_path


def rows(table: Any) -> list[dict[str, Any]]:
    pyarrow = pytest.importorskip("pyarrow")
    return list(pyarrow.table(table).to_pylist())


def test_a_suite_is_what_the_command_prints(folder, caplog):
    file = folder / "suite.toml"
    result = dmp.suite(file, expect="best:new", progress=False)
    printed = command("suite", file, "--expect=best:new", "--json", "--quiet")
    assert result.to_json() == printed.stdout
    assert (result.best, result.verdict("old", "new")) == ("new", "new")
    assert result.gates_passed and not result.is_damaged
    assert repr(result).startswith("best: new\nold, new: new: better on 9 of 9 logs")
    (pair,) = rows(result.pairs)
    assert (pair["better"], pair["b_better"], pair["p_value"]) == ("new", 9, 2 / 512)
    assert pair["rms_low_m"] > 0.1 and pair["drift_difference_m"] > 0.1
    logs = rows(result.logs)
    assert [row["log"] for row in logs] == result.worst_first and len(logs) == 9
    assert result.result("log-3")["schema"] == "dmp-score/3"
    with pytest.raises(KeyError):
        result.result("none")
    result.report(folder / "page.html")
    assert "new is better than old" in (folder / "page.html").read_text(encoding="utf-8")
    assert "iframe" in result._repr_html_()


def test_missing_runs_and_wrong_keys_are_reported(folder):
    for k in range(1, 9):
        (folder / "old" / f"log-{k}.tum").unlink()
    file = folder / "suite.toml"
    result = dmp.suite(file, cache=folder / "kept", expect="old:lost_logs<0", progress=False)
    # Who has no run on a log loses there.
    assert result.is_damaged and not result.gates_passed and result.best == "new"
    assert result.verdict("new", "old") == "new"
    # The index, a log with both versions, and eight equal logs with one.
    assert len(list((folder / "kept").glob("*.json"))) == 3
    with pytest.raises(TypeError, match="no keyword 'list'"):
        dmp.suite(file, list=True)
    file.write_text(file.read_text().replace("every", "evry"))
    with pytest.raises(dmp.UsageError, match="suite.toml: score.evry = 2: "):
        dmp.suite(file, progress=False)
