"""How tasks of ray learn that their job is over.

They ask. ``ray.cancel`` would not do: one of the tasks that wait for others may just be handed to a worker, and the answer to a task
that was cancelled meanwhile ends the process that cancelled it (ray 2.60).
"""

from __future__ import annotations

import threading
from contextlib import contextmanager
from typing import Any, Iterator, Sequence

from ..errors import Error

#: How often a task asks, and how long the end of a job waits for its tasks, seconds.
_ASK_S, _STOP_S = 0.5, 60.0


class _Board:
    """Whether a job is over, and the tasks of it that began: an actor."""

    def __init__(self) -> None:
        self._is_over = False
        self._began: set[str] = set()

    def begin(self, task: str) -> bool:
        """Whether a task may begin."""
        if not self._is_over:
            self._began.add(task)
        return not self._is_over

    def is_over(self) -> bool:
        return self._is_over

    def end(self) -> set[str]:
        """Ends the job: which tasks began before."""
        self._is_over = True
        return self._began


def board() -> Any:
    """The board of a job. It takes no core, lies where this process is, and is there until no task of the job is left."""
    import ray
    from ray.util.scheduling_strategies import NodeAffinitySchedulingStrategy

    here = NodeAffinitySchedulingStrategy(ray.get_runtime_context().get_node_id(), soft=True)
    return ray.remote(_Board).options(num_cpus=0, max_restarts=-1, max_task_retries=-1, scheduling_strategy=here).remote()


def end(board: Any, tasks: Sequence[Any]) -> None:
    """Ends a job, and waits for tasks that run. Those that have not begun do nothing when they come to it."""
    import ray

    try:
        began = ray.get(board.end.remote(), timeout=_STOP_S)
        running = [task for task in tasks if task.task_id().hex() in began]
        if running:
            ray.wait(running, num_returns=len(running), timeout=_STOP_S)
    except ray.exceptions.RayError:
        # A cluster that does not answer runs nothing of it.
        pass


@contextmanager
def asking(board: Any) -> Iterator[threading.Event]:
    """Set when the job of the task of this thread is over; from the first if it was before the task began.

    A thread of its own asks: what waits in the thread of a task gives its core away meanwhile.
    """
    import ray

    task = ray.get_runtime_context().get_task_id()
    stop, heard, done = threading.Event(), threading.Event(), threading.Event()
    failed: list[Exception] = []

    def ask() -> None:
        try:
            is_over = not ray.get(board.begin.remote(task))
            while not is_over:
                heard.set()
                if done.wait(_ASK_S):
                    return
                is_over = ray.get(board.is_over.remote())
        except Exception as error:
            # Later: whoever began the job is gone.
            failed.append(error)
        finally:
            stop.set()
            heard.set()

    threading.Thread(target=ask, name="dmp-asks", daemon=True).start()
    heard.wait()
    if failed:
        raise Error(f"nobody says whether the job is over: {failed[0]}")
    try:
        yield stop
    finally:
        done.set()
