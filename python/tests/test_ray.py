"""Scores in parts by tasks of ray are those of one process."""

from __future__ import annotations

import pytest
import ray

import dmp_slam as dmp
import dmp_slam.ray

#: Little work.
FEW = {"every": 4, "drift": "none", "trust": True}


@pytest.fixture
def cluster():
    ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False)
    yield
    ray.shutdown()


def test_parts_by_ray_are_the_whole(cluster, town, runs, temporary):
    two, told = {name: runs[name] for name in ("truth", "drift")}, []
    found = dmp.ray.score(town, two, parts=3, progress=lambda *step: told.append(step), **FEW)
    whole = dmp.score(town, two, progress=False, **FEW)
    assert {**found.data, "timing": 0, "memory": 0} == {**whole.data, "timing": 0, "memory": 0}
    assert "plan" in {stage for stage, _, _, _ in told} and list(temporary.iterdir()) == []
    with pytest.raises(dmp.UsageError, match="in parts"):
        dmp.ray.score(town, two, free_space=True, retries=0, progress=False, **FEW)


def test_jobs_are_ended_amid_any_stage(cluster, town, runs, temporary):
    """Tasks run, wait for cores and wait for others when a job ends, and none of them takes this process along."""

    class Amid:
        def __init__(self, steps: int) -> None:
            self.steps, self.told = steps, []

        def is_set(self) -> bool:
            return len(self.told) > self.steps

        def step(self, stage: str, *_: object) -> None:
            self.told.append(stage)

    stages = set()
    for steps in range(5):
        amid = Amid(steps)
        given = {**FEW, "every": None, "cancel": amid, "progress": amid.step}
        with pytest.raises(dmp.Cancelled, match="stopped before the end"):
            dmp.ray.score(town, runs, parts=2, voxel=0.03, **given)
        assert list(temporary.iterdir()) == []
        stages.add(amid.told[-1])
    assert len(stages) > 1, stages


def test_ray_must_be_there(town, runs):
    with pytest.raises(dmp.UsageError, match="there is no cluster: call ray.init"):
        dmp.ray.score(town, runs)
