"""Scores in parts on a dask cluster: ``dmp_slam.dask.score``. ``pip install 'dmp-slam[dask]'`` installs its dependencies.

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
from ._shards.asked import settings_of
from ._shards.dask_cluster import DaskCluster
from ._shards.scored import Where, in_parts

__all__ = ["score"]


@documented("shard", "reduce", without=["log", "threads", "memory"])
@documented("shard", "plan", without=["output", "cores"])
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
    """Scores runs on a log as ``dmp_slam.score`` does, to the bit, in parts on the workers of a cluster.

    ``log``, the files of ``runs`` and ``work`` are paths that every worker has, or URLs for fsspec (``s3://``, ``gs://``) with
    ``storage_options``. Runs may also be in memory, as for ``dmp_slam.score``.

    ``client`` is one of ``distributed``; default: the current one. ``work`` is a folder for the plan and the files of parts. A
    stopped job resumes from them. Default: a temporary folder of this machine, which all workers must see. ``parts`` is the number
    of parts, for every stage or by the stages ``fuse``, ``merge``, ``cast`` and ``drift``; default: the plan's suggestion.
    ``retries`` is how often a failed part is tried again. ``resources`` are the worker resources of each task; one named
    ``threads``, ``cores`` or ``CPU`` is its number of threads, else it has one. ``memory`` and ``threads`` are those of a part;
    ``memory`` defaults to its share of the worker's limit. ``cache_bytes`` is how much of a remote log and ``work`` a worker keeps
    on its disk, in its ``local_directory``; default: half of the free space. For planning, one worker reads the whole log once,
    from its own disk.

    ``progress`` and ``cancel`` are as in ``dmp_slam.score``; a function receives stages and parts.
    """
    workers = DaskCluster.of(client, retries, resources)
    where = Where(work, parts, cache_bytes, storage_options)
    return in_parts(workers, log, runs, where, Listener(progress, cancel), settings_of(settings))
