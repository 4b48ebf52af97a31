"""``suite``: compares versions of a SLAM system on several logs."""

from __future__ import annotations

import html
import json
import os
from functools import cached_property
from pathlib import Path
from typing import Any, Mapping

from . import _columns
from ._arguments import StrPath, arguments, documented, unknown
from ._called import work_folder
from ._core import Table
from ._execute import Output, check, execute
from ._listener import Event, Listener, Progress
from .errors import UsageError

#: Height of a page in a notebook, pixels.
_PAGE_HEIGHT = 800
#: Options that change the output format.
_OTHERWISE = ("example", "list", "dask")


class SuiteResult:
    """The comparison of versions of a SLAM system on several logs.

    Tables have ``__arrow_c_stream__``, as those of ``Result``. Differences are a − b in metres: negative if a is better.
    """

    def __init__(self, output: Output, page: str) -> None:
        self._text = output.text
        self._page = page
        self._is_damaged = output.is_damaged

    def to_json(self) -> str:
        """The JSON of ``dmp suite --json``."""
        return self._text

    @cached_property
    def data(self) -> dict[str, Any]:
        """The JSON as a Python object; docs/json.md has every field (``dmp-suite/1``)."""
        parsed: dict[str, Any] = json.loads(self._text)
        return parsed

    @property
    def versions(self) -> list[str]:
        """The versions, in the order given."""
        return list(self.data["versions"])

    @property
    def worst_first(self) -> list[str]:
        """The scored logs, worst first: by the number of versions that lose against one named before them."""
        return list(self.data["worst_first"])

    @property
    def best(self) -> str | None:
        """The version decided over all logs to be better than every other; ``None`` if there is none."""
        for name in self.versions:
            if all(self.verdict(name, other) == name for other in self.versions if other != name):
                return name
        return None

    def verdict(self, one: str, other: str) -> str:
        """The better of two versions over all logs, or ``"undecided"``, or ``"too_few_logs"``."""
        for pair in self.data["pairs"]:
            if {pair["a"], pair["b"]} == {one, other}:
                return str(pair["better"] or pair["outcome"])
        raise KeyError(f"{one}, {other}")

    @property
    def pairs(self) -> Table:
        """A row for each pair of versions: the outcome, the number of logs on which each is better, ``p_value`` of the sign test,
        and the medians of their differences with their intervals (metres).
        """
        return _columns.suite_pairs_table(self.data)

    @property
    def logs(self) -> Table:
        """A row for each log and pair of versions, worst first: the verdict, the deciding scale and the differences (metres)."""
        return _columns.suite_logs_table(self.data)

    def result(self, log: str) -> dict[str, Any]:
        """The result of a log, as ``dmp score --json`` prints it, from the cache."""
        for found in self.data["logs"]:
            if found["name"] == log and found["result"] is not None:
                parsed: dict[str, Any] = json.loads(Path(found["result"]).read_text(encoding="utf-8"))
                return parsed
        raise KeyError(log)

    @property
    def gates_passed(self) -> bool:
        """Whether every requested gate, here or in the suite, passed."""
        return all(gate["passed"] for gate in self.data["gates"])

    @property
    def is_damaged(self) -> bool:
        """Whether a log could not be scored, a version has no run on one, or part of one was lost; ``data`` has the details."""
        return self._is_damaged or any(
            log["problem"] is not None or log["missing"] or log["damaged"] for log in self.data["logs"]
        )

    def report(self, path: str | os.PathLike[str]) -> None:
        """Writes the page, ``FILE.html``."""
        Path(path).write_text(self._page, encoding="utf-8")

    def _repr_html_(self) -> str:
        page = html.escape(self._page, quote=True)
        return f'<iframe srcdoc="{page}" style="width: 100%; height: {_PAGE_HEIGHT}px; border: 0"></iframe>'

    def __repr__(self) -> str:
        lines = [f"best: {self.best}" if self.best else "best: undecided"]
        for pair in self.data["pairs"]:
            outcome = pair["better"] or pair["outcome"].replace("_", " ")
            lines.append(f"{pair['a']}, {pair['b']}: {outcome}: {pair['reason']}")
        return "\n".join(lines)


@documented("suite", without=_OTHERWISE)
def suite(
    suite: StrPath,
    *,
    client: Any = None,
    cluster: Mapping[str, Any] | None = None,
    progress: Progress = None,
    cancel: Event | None = None,
    **settings: Any,
) -> SuiteResult:
    """Compares versions of a SLAM system over several logs, as ``dmp suite`` does.

    ``suite`` is the file with versions, logs and options; docs/suite.md has its keys. Unchanged results in the cache are not scored
    again.

    With a ``client`` of ``distributed`` the cluster scores, several logs at a time. All workers must reach the logs, the runs and
    ``work``, which may be a URL. ``cluster`` has keywords of ``dmp_slam.dask.score``: ``parts``, ``retries``, ``resources``,
    ``cache_bytes``, ``storage_options``.

    >>> result = dmp.suite("suite.toml")  # doctest: +SKIP
    >>> result.verdict("old", "new")  # doctest: +SKIP
    'new'
    """
    words = ("suite",)
    if client is not None:
        _score_on(client, cluster or {}, os.fsdecode(suite), settings, progress, cancel)
        settings["cached"] = True
    elif cluster is not None:
        raise UsageError("cluster is of a client: name one by client=")
    with work_folder(settings) as folder:
        asked = settings.get("report")
        page = folder / "page.html" if asked is None or isinstance(asked, bool) else asked
        given = arguments(words, {**settings, "report": page}, without=_OTHERWISE)
        output = execute([*words, *given, "--json", "--", os.fsdecode(suite)], progress, cancel)
        return SuiteResult(output, Path(page).read_text(encoding="utf-8"))


def _score_on(
    client: Any,
    cluster: Mapping[str, Any],
    suite: str,
    settings: dict[str, Any],
    progress: Progress,
    cancel: Event | None,
) -> None:
    """Scores on a cluster the results that are not in the cache."""
    from ._shards.dask_cluster import DaskCluster
    from ._shards.scored import Where
    from ._shards.suite import RETRIES, score_all

    how: dict[str, Any] = {"retries": RETRIES, "resources": None, "parts": None, "cache_bytes": None, "storage_options": None}
    for keyword in cluster:
        if keyword not in how:
            raise TypeError(unknown(("cluster",), keyword, list(how)))
    how.update(cluster)
    workers = DaskCluster.of(client, how.pop("retries"), how.pop("resources"))
    check(["suite", *arguments(("suite",), {**settings, "cached": True}, without=_OTHERWISE), "--json", "--", suite])

    def options(*keywords: str) -> list[str]:
        return arguments(("suite",), {keyword: settings[keyword] for keyword in keywords if keyword in settings})

    listed = json.loads(execute(["suite", *options("cache"), "--list", "--", suite], progress, cancel).text)
    listener = Listener(progress, cancel)
    total = len(listed["logs"])
    try:
        listeners = (listener.say, lambda done: listener.progress("scoring logs", "logs", done, total))
        where = Where(work=settings.get("work"), **how)
        score_all(listed, workers, where, options("memory", "threads"), listeners, cancel)
    finally:
        listener.close()
