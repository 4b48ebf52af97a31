"""Scores in parts on a cluster of ray: ``dmp_slam.ray.score``. ``pip install 'dmp-slam[ray]'`` brings what it needs.

>>> import dmp_slam.ray
>>> ray.init("auto")  # doctest: +SKIP
>>> result = dmp_slam.ray.score("s3://drives/city.mcap", runs, work="s3://scratch/city")  # doctest: +SKIP
"""

from __future__ import annotations

from typing import Any, Mapping

from ._arguments import StrPath, documented
from ._listener import Event, Listener, Progress
from ._poses import Runs
from ._result import Result
from ._shards.asked import WHOLE, settings_of
from ._shards.ray_cluster import RayCluster
from ._shards.scored import Where, in_parts

__all__ = ["score"]


@documented("shard", "reduce", without=["log", "threads", "memory"])
@documented("shard", "plan", without=["output", "cores", *WHOLE])
def score(
    log: StrPath,
    runs: Runs,
    *,
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
    """Scores runs on a log as ``dmp_slam.score`` does, to the bit, in parts that tasks of ray do.

    All is as in ``dmp_slam.dask.score``, but that ``ray.init`` must have been called, and that what is brought to a worker's disk for a
    part lies in its folder for temporary files, and goes with the part. ``resources`` are those of ray; ``num_cpus`` and ``memory``
    may be among them.
    """
    workers = RayCluster.of(retries, resources)
    where = Where(work, parts, cache_bytes, storage_options)
    return in_parts(workers, log, runs, where, Listener(progress, cancel), settings_of(settings))
