"""A job on a ``dask.distributed`` cluster: starts, watches and stops its tasks."""

from __future__ import annotations

import time
from contextlib import contextmanager
from typing import Any, Callable, Iterator, Mapping, NamedTuple, Sequence

from .. import _core
from .._listener import Listener
from ..errors import Cancelled, Error, UsageError
from . import dask_worker as worker
from .job import BEFORE, STAGES, Asked, Job, Part, Planned, Reduced

#: Interval at which a job is checked, seconds.
_LOOK_S = 0.05
#: Time for workers to stop, seconds.
_STOP_S = 60.0
#: Assumed cores of a cluster without workers yet.
_CORES = 8


class DaskCluster(NamedTuple):
    """The workers of a client, and the resources of a task."""

    client: Any
    retries: int
    resources: Mapping[str, float]

    @classmethod
    def of(cls, client: Any, retries: int, resources: Mapping[str, float] | None) -> DaskCluster:
        """The cluster of a client, or of the current one."""
        try:
            import distributed
        except ImportError:
            raise ImportError("dmp_slam.dask needs dask and fsspec: pip install 'dmp-slam[dask]'") from None
        if client is None:
            try:
                client = distributed.get_client()
            except ValueError:
                raise UsageError("there is no client: make a distributed.Client, or name one by client=") from None
        if client.asynchronous:
            raise UsageError("the client is asynchronous: score waits, and needs one that is not")
        return cls(client, retries, dict(resources or {}))

    def cores(self) -> int:
        """Threads of all workers."""
        return sum(self.client.nthreads().values()) or _CORES

    def check(self, paths: Sequence[str]) -> None:
        """Rejects workers of another version, and those that do not see local files."""
        try:
            seen = self.client.run(worker.look, list(paths))
        except ImportError as error:
            raise UsageError(f"a worker cannot import dmp_slam: {error}") from None
        for address, (version, missing) in seen.items():
            if version != _core.__version__:
                raise UsageError(f"the worker {address} has dmp-slam {version}, here it is {_core.__version__}")
            if missing:
                raise UsageError(f"the worker {address} does not see {missing[0]}: name what all workers reach")

    @contextmanager
    def doing(self, job: Job, listener: Listener) -> Iterator[Running]:
        """A job. At its end, in any case, none of its tasks runs and no worker keeps its files."""
        running = Running(self, job, listener)
        try:
            yield running
        finally:
            running.end()


class Running:
    """A job whose tasks are on the cluster."""

    def __init__(self, cluster: DaskCluster, job: Job, listener: Listener) -> None:
        self._cluster, self._job, self._listener = cluster, job, listener
        self._threads = _threads(cluster.resources)
        self._futures: list[Any] = []

    def plan(self, asked: Asked) -> Planned:
        """Plans it."""
        future = self._submit(worker.plan, asked, name="plan", priority=0)
        planned: Planned = self._wait(future, {"plan": [future]})
        self._say(planned.said)
        return planned

    def reduce(self, planned: Planned, parts: Mapping[str, int], gates: list[str], junit: bool) -> Reduced:
        """Does all parts and merges their results."""
        own = planned.hash[:8]
        ends: dict[str, Any] = {}
        stages: dict[str, list[Any]] = {}
        # Tasks that others wait for come first.
        for stage in STAGES:
            after = [ends[before] for before in BEFORE[stage]]
            these = [Part(stage, number, parts[stage]) for number in range(1, parts[stage] + 1)]
            priority = -1 if stage == "drift" else 0
            given = (dict(parts), planned.is_whole, after)
            stages[stage] = [
                self._submit(worker.part, one, *given, name=f"{stage}-{one.label}-{own}", priority=priority)
                for one in these
            ]
            ends[stage] = self._submit(worker.all_of, stages[stage], name=f"{stage}-all-{own}", priority=0)
        sums = (gates, junit, [ends[stage] for stage in STAGES])
        future = self._submit(
            worker.reduce, dict(parts), planned.is_whole, *sums, name=f"reduce-{own}", priority=0
        )
        reduced: Reduced = self._wait(future, {**stages, "reduce": [future]})
        for stage in STAGES:
            self._listener.say(f"{stage}: {ends[stage].result()}")
        self._say(reduced.said)
        return reduced

    def whole(self, words: list[str], log: str) -> str:
        """Runs a whole command on a log in one task; returns its output."""
        future = self._submit(worker.whole, words, log, name="score", priority=0)
        text, said = self._wait(future, {"score": [future]})
        self._say(said)
        return str(text)

    def end(self) -> None:
        """Stops running tasks, waits for them, and releases everything."""
        client, name = self._cluster.client, self._job.name
        if client.status != "running":
            return
        client.cancel(self._futures)
        until = time.monotonic() + _STOP_S
        while any(client.run(worker.end, name, on_error="ignore").values()) and time.monotonic() < until:
            time.sleep(_LOOK_S)
        self._futures.clear()

    def _submit(self, task: Callable[..., Any], *given: Any, name: str, priority: int) -> Any:
        future = self._cluster.client.submit(
            task,
            (self._job, self._threads),
            *given,
            key=f"dmp-{name}-{self._job.name}",
            retries=self._cluster.retries,
            resources=self._cluster.resources or None,
            priority=priority,
            pure=False,
        )
        self._futures.append(future)
        return future

    def _say(self, lines: Sequence[str]) -> None:
        for line in lines:
            self._listener.say(line)

    def _wait(self, last: Any, stages: Mapping[str, Sequence[Any]]) -> Any:
        """The result of the last task."""
        shown = None
        while not last.done():
            if self._listener.is_cancelled():
                raise Cancelled("stopped before the end")
            for stage, futures in stages.items():
                done = sum(future.status == "finished" for future in futures)
                if done < len(futures):
                    if shown != (shown := (stage, done)):
                        self._listener.progress(stage, "parts", done, len(futures))
                    break
            time.sleep(_LOOK_S)
        return _result(last)


def _result(future: Any) -> Any:
    from concurrent.futures import CancelledError

    from distributed import KilledWorker

    try:
        return future.result()
    except KilledWorker as error:
        raise Error(f"the workers that did {error.task} died, the last {error.last_worker.address}") from None
    except CancelledError:
        raise Cancelled("the cluster cancelled it before the end") from None


def _threads(resources: Mapping[str, float]) -> int:
    """Number of threads of a task, by its resources."""
    named = [count for name, count in resources.items() if name.lower() in ("threads", "cores", "cpu")]
    return max(1, int(min(named, default=1)))
