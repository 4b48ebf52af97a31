"""The notebooks run, each in a folder of its own. `python/test.sh -k "notebooks and refine" -rP` also prints what one ends with."""

from __future__ import annotations

import re
from pathlib import Path

import nbclient
import nbformat
import pytest

NOTEBOOKS = sorted(Path(__file__).resolve().parents[1].glob("notebooks/*.ipynb"))


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_it_runs(notebook, tmp_path):
    if "import torch" in notebook.read_text(encoding="utf-8"):
        pytest.importorskip("torch", reason="the notebook needs torch")
    cells = nbformat.read(notebook, as_version=4)
    assert all(not cell.get("outputs") for cell in cells.cells), "kept without outputs"
    nbclient.NotebookClient(cells, timeout=600, resources={"metadata": {"path": str(tmp_path)}}).execute()
    # The last cell prints something.
    assert any(output["output_type"] != "error" for output in cells.cells[-1]["outputs"])
    print(*(output.get("text", "") for output in cells.cells[-1]["outputs"]), sep="")


def test_the_notebooks_are_those_of_the_page():
    page = Path(__file__).resolve().parents[2] / "docs" / "python.md"
    named = re.findall(r"notebooks/([\w-]+\.ipynb)", page.read_text(encoding="utf-8"))
    assert sorted(named) == [notebook.name for notebook in NOTEBOOKS]
