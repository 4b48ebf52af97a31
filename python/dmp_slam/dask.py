"""Scores in parts on a cluster of dask: ``dmp_slam.dask.score``. ``pip install 'dmp-slam[dask]'`` brings what it needs.

>>> import dmp_slam.dask
>>> with distributed.Client("tcp://scheduler:8786"):  # doctest: +SKIP
...     result = dmp_slam.dask.score("s3://drives/city.mcap", {"lio": "s3://drives/lio.tum"}, work="s3://scratch/city")
"""

from __future__ import annotations

import os
import shutil
import tempfile
import uuid
from pathlib import Path
from typing import Any, Mapping

from ._arguments import StrPath, documented
from ._called import large_files
from ._execute import Output
from ._kept import Kept
from ._listener import Event, Listener, Progress
from ._poses import Runs
from ._result import Result
from ._shards.asked import WHOLE, asked_of, local_files, log_of, parts_of, settings_of
from ._shards.cluster import Cluster
from ._shards.job import STAGES, Job
from ._shards.places import place_of

__all__ = ["score"]


@documented("shard", "reduce", without=["log", "threads", "memory"])
@documented("shard", "plan", without=["output", *WHOLE])
def score(
    log: StrPath,
    runs: Runs,
    *,
    client: Any = None,
    work: StrPath | None = None,
    parts: int | Mapping[str, int] | None = None,
    retries: int = 2,
    resources: Mapping[str, float] | None = None,
    cache_bytes: int | None = None,
    storage_options: Mapping[str, Any] | None = None,
    progress: Progress = None,
    cancel: Event | None = None,
    **settings: Any,
) -> Result:
    """Scores runs on a log as ``dmp_slam.score`` does, to the bit, in parts that the workers of a cluster do.

    ``log``, the files of ``runs`` and ``work`` are paths that every worker has, or URLs that fsspec knows (``s3://``, ``gs://``), which
    ``storage_options`` are for. Runs may also be in memory, as ``dmp_slam.score`` takes them.

    ``client`` is one of ``distributed``; without it the current one. ``work`` is a folder for the plan and the files of parts. A job that
    was stopped goes on from what is there; without ``work`` it is a temporary one of this machine, which all workers must see.
    ``parts`` are how many there are, of every stage or by the stages ``fuse``, ``merge``, ``cast`` and ``drift``; without it as many as make
    sense. ``retries`` is how often a part that failed is tried again, ``resources`` what each task takes of a worker's: one that is
    called ``threads``, ``cores`` or ``CPU`` is how many threads it has, else one. ``memory`` and ``threads`` are those of a part; without
    ``memory`` it has its share of the worker's limit. ``cache_bytes`` is how much of the log and of ``work`` a worker keeps on its disk,
    in its ``local_directory``, if they are not local; without it half of what is free there. To be planned, all of the log is read
    once, and brought to one worker's disk for that.

    ``progress`` and ``cancel`` are as in ``dmp_slam.score``; a function is told of stages and parts.
    """
    given = settings_of(settings, ("dask", "score"))
    log_place = log_of(log, storage_options)
    parts_of(parts, {}, STAGES)
    cluster = Cluster.of(client, retries, resources)
    listener = Listener(progress, cancel)
    name = uuid.uuid4().hex[:8]
    with tempfile.TemporaryDirectory(prefix="dmp-python-") as packed:
        asked = asked_of(runs, Path(packed), given, cluster.cores(), storage_options)
    made = tempfile.mkdtemp(prefix="dmp-dask-", dir=large_files({})) if work is None else None
    try:
        work_place = place_of(made if made is not None else os.fsdecode(work or ""), storage_options)
        job = Job(name, log_place, work_place, cache_bytes, given.means)
        cluster.check(local_files(log_place, work_place, asked.runs))
        with cluster.doing(job, listener) as running:
            planned = running.plan(asked)
            counts = parts_of(parts, planned.suggested, STAGES)
            reduced = running.reduce(planned, counts, given.gates, given.junit is not None)
    finally:
        listener.close()
        if made is not None:
            shutil.rmtree(made, ignore_errors=True)
    if given.junit is not None and reduced.junit is not None:
        given.junit.write_text(reduced.junit, encoding="utf-8")
    output = Output(reduced.text, reduced.is_damaged, reduced.gate_failed)
    return Result(output, Kept(None, []), None, None, None)
