"""What ``score`` finds."""

from __future__ import annotations

import html
import json
import os
import shutil
import tempfile
from functools import cached_property
from pathlib import Path
from typing import Any, Iterator

from . import _columns
from ._core import Table
from ._execute import Output, execute
from ._kept import Kept, Returns, by_frame
from .errors import UsageError

#: How high a page is shown in a notebook, pixels.
_PAGE_HEIGHT = 800


class Result:
    """The scores of runs, their order, and what is decided of each two.

    Tables have ``__arrow_c_stream__``: ``polars.DataFrame``, ``pyarrow.table`` and, from pandas 3.0 on,
    ``pandas.DataFrame.from_arrow`` take them.
    """

    def __init__(
        self, output: Output, kept: Kept, page: str | None, frames: str | None, tiles: str | None
    ) -> None:
        self._text = output.text
        self._kept = kept
        self._page = page
        self._words: str | None = None
        self._frames = frames
        self._tiles = tiles
        self._is_damaged = output.is_damaged

    def to_json(self) -> str:
        """What ``dmp score --json`` prints of the same runs, but for times, memory and the names of files."""
        return self._text

    @cached_property
    def data(self) -> dict[str, Any]:
        """The JSON as Python has it; docs/json.md has every field. Scores are squares, m²."""
        parsed: dict[str, Any] = json.loads(self._text)
        return parsed

    @property
    def order(self) -> list[str]:
        """The names of the runs, best first."""
        return list(self.data["order"])

    @property
    def best(self) -> str | None:
        """The run that is decided to be better than every other; ``None`` where there is none."""
        first, *others = self.order or [""]
        is_best = first and all(self.verdict(first, other) == first for other in others)
        return first if is_best else None

    def verdict(self, one: str, other: str) -> str:
        """The better of two runs, or ``"same"``, ``"mixed"`` or ``"undecided"``."""
        for pair in self.data["pairs"]:
            if {pair["a"], pair["b"]} == {one, other}:
                return str(pair["verdict"])
        raise KeyError(f"{one}, {other}")

    @property
    def runs(self) -> Table:
        """A row for each run, best first. Columns: ``R_cv`` and ``R_near`` at each truncation as lengths (``r_cv_10_m``, metres)
        and as squares (``r_cv_10_m2``, m²), ``dmp_mean_m2``; ``coverage``, ``revisit``, ``miss`` and ``blocked`` as shares, 0 to 1.
        """
        return _columns.runs_table(self.data)

    @property
    def pairs(self) -> Table:
        """A row for each two runs: the verdict, the scale that decided (metres), and there the scores of both (metres) and the
        interval of their difference (m²).
        """
        return _columns.pairs_table(self.data)

    @property
    def frames(self) -> Table:
        """A row for each scan and run, where ``score`` was called with ``per_frame``; docs/residuals.md has the columns."""
        return _columns.csv_table(_asked("per_frame", self._frames))

    @property
    def tiles(self) -> Table:
        """A row for each tile and run, where ``score`` was called with ``per_tile``; docs/residuals.md has the columns."""
        return _columns.csv_table(_asked("per_tile", self._tiles))

    def residuals(self, run: str | None = None) -> Returns:
        """The scored returns of a run, where ``score`` was called with ``residuals``: a record each, scan by scan.

        Fields as in docs/residuals.md: ``x``, ``y``, ``z`` in the frame of the run's trajectory, ``signed_residual_m``, ``range_m``, ``time_s``,
        ``frame``, ``kind`` and others; NaN where nothing is predicted. The array is mapped from a file on the disk, so that a log of any
        size has one; ``pandas.DataFrame`` and ``polars.DataFrame`` take it, or parts of it.
        """
        return self._kept.returns(run)

    def residuals_by_frame(self, run: str | None = None) -> Iterator[tuple[int, Returns]]:
        """The same scan by scan: the number of each in the log, and its returns."""
        return by_frame(self.residuals(run))

    def plot(self) -> Any:
        """A figure of matplotlib, which must be installed: the scores of the runs; with ``per_frame`` also the
        residuals over time, and with ``residuals`` where they are.
        """
        from ._plot import figure

        return figure(self.data, self._frames, self._kept)

    def view(self, save: str | os.PathLike[str] | None = None) -> None:
        """Shows trajectories, and returns coloured by residual, scan by scan, in rerun, which must be installed.

        ``score`` must have been called with ``residuals``. ``save`` writes a recording, ``FILE.rrd``, and opens nothing.
        """
        from ._view import show

        show(self.order, self._kept, save)

    def scene(self, path: str | os.PathLike[str]) -> None:
        """Writes the scene for viewers as rerun and Foxglove, ``FILE.mcap``, where ``score`` was called with ``scene``."""
        shutil.copyfile(self._kept.scene(), path)

    def keep(self, path: str | os.PathLike[str]) -> None:
        """Writes the result with the residual of every return, ``FILE.dmp``, where ``score`` was called with ``keep``: ``compare``
        judges its runs with those of others.
        """
        shutil.copyfile(self._kept.result(), path)

    @property
    def kept_file(self) -> Path | None:
        """Where that is while there is this result; ``None`` without ``keep``."""
        return self._kept.files.get("keep")

    def __getstate__(self) -> dict[str, Any]:
        # Files go with the first result.
        return {**self.__dict__, "_kept": Kept(None, [])}

    @property
    def gates_passed(self) -> bool:
        """Whether every gate that was asked for passed."""
        return all(gate["passed"] for gate in self.data["gates"])

    @property
    def is_damaged(self) -> bool:
        """Whether part of the log was lost or damaged, or a run excluded; ``data`` has the details."""
        return self._is_damaged

    def report(self, path: str | os.PathLike[str]) -> None:
        """Writes the page, ``FILE.html``. With pictures where ``score`` was called with ``report``."""
        Path(path).write_text(self._html(), encoding="utf-8")

    def _html(self) -> str:
        if self._page is None:
            with tempfile.TemporaryDirectory(prefix="dmp-") as folder:
                page = Path(folder, "page.html")
                self._compared([f"--report={page}", "--quiet"])
                self._page = page.read_text(encoding="utf-8")
        return self._page

    def _compared(self, options: list[str]) -> str:
        """What the command prints of this result."""
        with tempfile.TemporaryDirectory(prefix="dmp-") as folder:
            result = Path(folder, "result.json")
            result.write_text(self._text, encoding="utf-8")
            return execute(["compare", str(result), *options], progress=False).text

    def _repr_html_(self) -> str:
        page = html.escape(self._html(), quote=True)
        return f'<iframe srcdoc="{page}" style="width: 100%; height: {_PAGE_HEIGHT}px; border: 0"></iframe>'

    def __repr__(self) -> str:
        if self._words is None:
            self._words = self._compared([]).rstrip("\n")
        return self._words


def _asked(keyword: str, text: str | None) -> str:
    if text is None:
        raise UsageError(f"score was not called with {keyword}=True, or with the file to write")
    return text
