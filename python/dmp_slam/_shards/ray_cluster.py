"""A job on a cluster of ray."""

from __future__ import annotations

import os
import shutil
import tempfile
import threading
import time
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Callable, Iterator, Mapping, NamedTuple, Sequence

from .._called import large_files
from .._listener import Listener
from ..errors import Cancelled, Error, UsageError
from . import stage, tasks
from .job import BEFORE, STAGES, Asked, Done, Job, Part, Planned, Reduced, Site
from .dask_worker import Tally, all_of

#: How often a job is looked at, and how long tasks have to stop, seconds.
_LOOK_S, _STOP_S = 0.1, 60.0
#: How much of a machine's memory the parts on it are promised.
_PROMISED = 0.6


class RayCluster(NamedTuple):
    """What tasks take of a cluster."""

    retries: int
    resources: Mapping[str, float]

    @classmethod
    def of(cls, retries: int, resources: Mapping[str, float] | None) -> RayCluster:
        """The cluster that this process is connected to."""
        try:
            import ray
        except ImportError:
            raise ImportError("dmp_slam.ray needs ray and fsspec: pip install 'dmp-slam[ray]'") from None
        if not ray.is_initialized():
            raise UsageError("there is no cluster: call ray.init")
        return cls(retries, dict(resources or {}))

    def cores(self) -> int:
        """Cores of all machines."""
        import ray

        return max(1, int(ray.cluster_resources().get("CPU", 1)))

    def check(self, paths: Sequence[str]) -> None:
        """Tasks tell what they do not see."""

    @contextmanager
    def doing(self, job: Job, listener: Listener) -> Iterator[RayRunning]:
        """A job. Whatever becomes of it, nothing of it runs afterwards."""
        running = RayRunning(self, job, listener)
        try:
            yield running
        finally:
            running.end()


class RayRunning:
    """A job whose tasks are on the cluster."""

    def __init__(self, cluster: RayCluster, job: Job, listener: Listener) -> None:
        self._cluster, self._job, self._listener = cluster, job, listener
        self._cpus = max(1, int(cluster.resources.get("num_cpus", 1)))
        self._tasks: list[Any] = []

    def plan(self, asked: Asked) -> Planned:
        """Plans it."""
        task = self._submit(_plan, asked, name="dmp-plan")
        planned: Planned = self._wait(task, {"plan": [task]})
        self._say(planned.said)
        return planned

    def reduce(self, planned: Planned, parts: Mapping[str, int], gates: list[str], junit: bool) -> Reduced:
        """Does all parts, and adds up what they come to."""
        ends: dict[str, Any] = {}
        stages: dict[str, list[Any]] = {}
        for name in STAGES:
            after = [ends[before] for before in BEFORE[name]]
            these = [Part(name, number, parts[name]) for number in range(1, parts[name] + 1)]
            given = (dict(parts), planned.is_whole, *after)
            stages[name] = [self._submit(_part, one, *given, name=f"dmp-{one}") for one in these]
            ends[name] = self._submit(_all_of, *stages[name], name=f"dmp-{name}-all", cpus=0)
        given = (dict(parts), planned.is_whole, gates, junit, *ends.values())
        last = self._submit(_reduce, *given, name="dmp-reduce")
        reduced: Reduced = self._wait(last, {**stages, "reduce": [last]})
        self._say(reduced.said)
        return reduced

    def end(self) -> None:
        """Stops what still runs, and waits for that."""
        import ray

        for task in self._tasks:
            ray.cancel(task)
        if self._tasks:
            ray.wait(self._tasks, num_returns=len(self._tasks), timeout=_STOP_S)
        self._tasks.clear()

    def _submit(self, task: Callable[..., Any], *given: Any, name: str, cpus: int | None = None) -> Any:
        import ray

        own = {key: count for key, count in self._cluster.resources.items() if key not in ("num_cpus", "memory")}
        remote = ray.remote(task).options(
            name=name,
            num_cpus=self._cpus if cpus is None else cpus,
            resources=own,
            memory=self._cluster.resources.get("memory"),
            max_retries=self._cluster.retries,
            retry_exceptions=True,
        )
        submitted = remote.remote((self._job, self._cpus, self._cluster.resources.get("memory")), *given)
        self._tasks.append(submitted)
        return submitted

    def _say(self, lines: Sequence[str]) -> None:
        for line in lines:
            self._listener.say(line)

    def _wait(self, last: Any, stages: Mapping[str, Sequence[Any]]) -> Any:
        """What the last task gives."""
        import ray

        told = None
        while not ray.wait([last], timeout=0)[0]:
            if self._listener.is_cancelled():
                raise Cancelled("stopped before the end")
            for name, of_stage in stages.items():
                done = len(ray.wait(list(of_stage), num_returns=len(of_stage), timeout=0)[0])
                if done < len(of_stage):
                    if told != (told := (name, done)):
                        self._listener.progress(name, "parts", done, len(of_stage))
                    break
            time.sleep(_LOOK_S)
        try:
            return ray.get(last)
        except ray.exceptions.RayTaskError as error:
            if isinstance(error.cause, Error):
                raise error.cause from None
            raise
        except ray.exceptions.RayError as error:
            raise Error(f"the cluster did not do it: {error}") from None


#: A job, threads of each of its tasks, and the memory that each is given.
_Task = tuple[Job, int, Any]


def _plan(task: _Task, asked: Asked) -> Planned:
    with _site(task) as site:
        return tasks.plan(task[0], asked, site)


def _part(task: _Task, what: Part, parts: Mapping[str, int], is_whole: bool, *_: Tally) -> Done:
    with _site(task) as site:
        return tasks.part(task[0], what, parts, is_whole, site)


def _all_of(task: _Task, *done: Done) -> Tally:
    return all_of((task[0], task[1]), done)


def _reduce(
    task: _Task, parts: Mapping[str, int], is_whole: bool, gates: list[str], junit: bool, *_: Tally
) -> Reduced:
    with _site(task) as site:
        return tasks.reduce(task[0], parts, is_whole, gates, junit, site)


@contextmanager
def _site(task: _Task) -> Iterator[Site]:
    """Where a task is done. A task that is cancelled is interrupted, which commands notice by themselves."""
    job, threads, memory = task
    if memory is None:
        machine = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
        memory = machine * min(1.0, threads / (os.cpu_count() or 1))
    folder = Path(tempfile.mkdtemp(prefix="dmp-ray-", dir=large_files({})))
    try:
        yield Site(folder, int(memory * _PROMISED), threads, threading.Event())
    finally:
        stage.forget(job.name, folder)
        shutil.rmtree(folder, ignore_errors=True)
