"""The examples in the package's documents run."""

from __future__ import annotations

import doctest
import importlib
import importlib.util
import inspect
import pkgutil
import re
from pathlib import Path

import dmp_slam as dmp
import dmp_slam.dask


def test_examples_run(town, runs):
    known = {"dmp": dmp, "town": town, "truth": runs["truth"], "drift": runs["drift"]}
    tried = 0
    for module in pkgutil.iter_modules(dmp.__path__):
        # An extra brings what this one is made of.
        if module.name == "torch" and importlib.util.find_spec("torch") is None:
            continue
        # Importing this one's `__main__` is harmless, but it has no examples.
        found = doctest.testmod(importlib.import_module(f"dmp_slam.{module.name}"), extraglobs=known)
        assert found.failed == 0, module.name
        tried += found.attempted
    assert tried > 0


def test_everything_offered_is_documented():
    for name in dmp.__all__:
        if not name.startswith("__"):
            assert getattr(dmp, name).__doc__, name


def test_help_lists_every_keyword():
    for keyword in dmp._arguments.options(("score",)):
        assert (f"\n    {keyword}=" in inspect.getdoc(dmp.score)) == (keyword != "trajectory"), keyword
    parts = inspect.getdoc(dmp_slam.dask.score)
    assert all(f"\n    {keyword}=" in parts for keyword in ("voxel", "memory", "expect"))
    assert not any(f"\n    {keyword}=" in parts for keyword in ("work", "output", "report", "scene", "resume", "quick", "cores"))
    for function in (dmp.Map.build, dmp.truth.rpe, dmp.simulate.errors, dmp.convert.log):
        heard = inspect.getdoc(function)
        assert "\nKeywords:\n    " in heard and "\n    output=" not in heard


def test_the_columns_of_tables_are_documented(result):
    heard = (Path(__file__).parents[2] / "docs" / "python.md").read_text(encoding="utf-8")
    for name, table in (("runs", result.runs), ("pairs", result.pairs)):
        rows = heard.split(f"Columns of `{name}`")[1].split("\n\n")[1].splitlines()[2:]
        documented = [column for row in rows for column in re.findall(r"`(\w+)`", row.split("|")[1])]
        cuts = re.compile(r"(r_cv|r_near)_[\d.]+_(m2?)$")
        first_cuts = [column for column in table.column_names if not cuts.match(column) or column in documented]
        assert documented == first_cuts, name
        of_scores = {cuts.match(column).groups() for column in table.column_names if cuts.match(column)}
        assert of_scores == {cuts.match(column).groups() for column in documented if cuts.match(column)}
