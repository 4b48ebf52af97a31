"""A job on a cluster of ray."""

from __future__ import annotations

import os
import shutil
import tempfile
import time
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Callable, Iterator, Mapping, NamedTuple, Sequence, TypeVar

from .._called import large_files
from .._listener import Listener
from ..errors import Cancelled, Error, UsageError
from . import ray_end, stage, tasks
from .job import BEFORE, STAGES, Asked, Done, Job, Part, Planned, Reduced, Site
from .dask_worker import Tally, all_of

#: How often a job is looked at, seconds.
_LOOK_S = 0.1
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
        self._board = ray_end.board()

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
        ray_end.end(self._board, self._tasks)
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
        means = _Means(self._job, self._cpus, self._cluster.resources.get("memory"), self._board)
        submitted = remote.remote(means, *given)
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
            found = ray.get(last)
        except ray.exceptions.RayTaskError as error:
            if isinstance(error.cause, Error):
                raise error.cause from None
            raise
        except ray.exceptions.RayError as error:
            raise Error(f"the cluster did not do it: {error}") from None
        if found is None:
            raise Error("the cluster did not do it: its tasks ended as if the job were over")
        return found


class _Means(NamedTuple):
    """What every task of a job is given."""

    job: Job
    threads: int
    #: Bytes; ``None`` for the share of the machine that is that of its threads.
    memory: float | None
    board: Any


# What tasks give is ``None`` where the job was over before.


def _plan(means: _Means, asked: Asked) -> Planned | None:
    return _done(means, lambda site: tasks.plan(means.job, asked, site))


def _part(means: _Means, what: Part, parts: Mapping[str, int], is_whole: bool, *_: Tally) -> Done | None:
    return _done(means, lambda site: tasks.part(means.job, what, parts, is_whole, site))


def _all_of(means: _Means, *done: Done | None) -> Tally | None:
    there = [one for one in done if one is not None]
    return all_of((means.job, means.threads), there) if len(there) == len(done) else None


def _reduce(
    means: _Means, parts: Mapping[str, int], is_whole: bool, gates: list[str], junit: bool, *_: Tally
) -> Reduced | None:
    return _done(means, lambda site: tasks.reduce(means.job, parts, is_whole, gates, junit, site))


_T = TypeVar("_T")


def _done(means: _Means, work: Callable[[Site], _T]) -> _T | None:
    """What a task comes to, in a folder of its own."""
    memory = means.memory
    if memory is None:
        machine = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
        memory = machine * min(1.0, means.threads / (os.cpu_count() or 1))
    with ray_end.asking(means.board) as stop:
        if stop.is_set():
            return None
        folder = Path(tempfile.mkdtemp(prefix="dmp-ray-", dir=large_files({})))
        try:
            return work(Site(folder, int(memory * _PROMISED), means.threads, stop))
        except Cancelled:
            # Nobody waits for it, and it is not to be tried again.
            return None
        finally:
            stage.forget(means.job.name, folder)
            shutil.rmtree(folder, ignore_errors=True)
