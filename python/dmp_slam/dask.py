"""Scores in parts on a cluster of dask: ``dmp_slam.dask.score``. ``pip install 'dmp-slam[dask]'`` brings what it needs.

>>> import dmp_slam.dask
>>> with distributed.Client("tcp://scheduler:8786"):  # doctest: +SKIP
...     result = dmp_slam.dask.score("s3://drives/city.mcap", {"lio": "s3://drives/lio.tum"}, work="s3://scratch/city")
"""

from __future__ import annotations

from typing import Any, Mapping

from ._arguments import StrPath, documented
from ._listener import Event, Listener, Progress
from ._poses import Runs
from ._result import Result
from ._shards.asked import WHOLE, settings_of
from ._shards.dask_cluster import DaskCluster
from ._shards.scored import Where, in_parts

__all__ = ["score"]


@documented("shard", "reduce", without=["log", "threads", "memory"])
@documented("shard", "plan", without=["output", "cores", *WHOLE])
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

    ``progress`` and ``cancel`` are as in ``dmp_slam.score``; a function gets stages and parts.
    """
    workers = DaskCluster.of(client, retries, resources)
    where = Where(work, parts, cache_bytes, storage_options)
    return in_parts(workers, log, runs, where, Listener(progress, cancel), settings_of(settings))
