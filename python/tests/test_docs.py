"""The examples in the package's documents run."""

from __future__ import annotations

import doctest
import importlib
import inspect
import pkgutil

import dmp_slam as dmp
import dmp_slam.dask


def test_examples_run(town, runs):
    known = {"dmp": dmp, "town": town, "truth": runs["truth"], "drift": runs["drift"]}
    tried = 0
    for module in pkgutil.iter_modules(dmp.__path__):
        # Importing this one's `__main__` is harmless, but it has no examples.
        found = doctest.testmod(importlib.import_module(f"dmp_slam.{module.name}"), extraglobs=known)
        assert found.failed == 0, module.name
        tried += found.attempted
    assert tried > 0


def test_everything_offered_is_documented():
    for name in dmp.__all__:
        if not name.startswith("__"):
            assert getattr(dmp, name).__doc__, name


def test_help_tells_every_keyword():
    for keyword in dmp._arguments.options(("score",)):
        assert (f"\n    {keyword}=" in inspect.getdoc(dmp.score)) == (keyword != "trajectory"), keyword
    parts = inspect.getdoc(dmp_slam.dask.score)
    assert all(f"\n    {keyword}=" in parts for keyword in ("voxel", "memory", "fail_above"))
    assert not any(f"\n    {keyword}=" in parts for keyword in ("work", "output", "report", "scene", "view", "cores"))
    for function in (dmp.Map.build, dmp.truth.rpe, dmp.simulate.errors, dmp.convert.log):
        told = inspect.getdoc(function)
        assert "\nKeywords:\n    " in told and "\n    output=" not in told
