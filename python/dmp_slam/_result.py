"""What ``score`` finds."""

from __future__ import annotations

import html
import json
import os
import tempfile
from functools import cached_property
from pathlib import Path
from typing import Any

from . import _columns
from ._core import Table
from ._execute import Output, execute
from .errors import UsageError

#: How high a page is shown in a notebook, pixels.
_PAGE_HEIGHT = 800


class Result:
    """The scores of runs, their order, and what is decided of each two.

    Tables have ``__arrow_c_stream__``: ``polars.DataFrame``, ``pyarrow.table`` and, from pandas 3.0 on,
    ``pandas.DataFrame.from_arrow`` take them.
    """

    def __init__(self, output: Output, page: str | None, frames: str | None, tiles: str | None) -> None:
        self._text = output.text
        self._page = page
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
        """A row for each run, best first. Columns: ``R_cv`` and ``R_near`` at each cut as lengths (``r_cv_10_m``, metres) and
        as squares (``r_cv_10_m2``, m²), ``dmp_mean_m2``; ``coverage``, ``revisit``, ``miss`` and ``blocked`` as shares from 0 to 1.
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

    @property
    def gates_passed(self) -> bool:
        """Whether every gate that was asked for passed."""
        return all(gate["passed"] for gate in self.data["gates"])

    @property
    def is_damaged(self) -> bool:
        """Whether part of the log was lost or damaged, or a run left out; ``data`` says what."""
        return self._is_damaged

    def report(self, path: str | os.PathLike[str]) -> None:
        """Writes the page, ``FILE.html``. With pictures where ``score`` was called with ``report``."""
        Path(path).write_text(self._html(), encoding="utf-8")

    def _html(self) -> str:
        if self._page is None:
            with tempfile.TemporaryDirectory(prefix="dmp-") as folder:
                result, page = Path(folder, "result.json"), Path(folder, "page.html")
                result.write_text(self._text, encoding="utf-8")
                execute(["compare", str(result), f"--report={page}", "--quiet"], progress=False)
                self._page = page.read_text(encoding="utf-8")
        return self._page

    def _repr_html_(self) -> str:
        page = html.escape(self._html(), quote=True)
        return f'<iframe srcdoc="{page}" style="width: 100%; height: {_PAGE_HEIGHT}px; border: 0"></iframe>'

    def __repr__(self) -> str:
        runs = {run["name"]: run for run in self.data["runs"]}
        lines = [f"best: {self.best}" if self.best else "best: it cannot be told"]
        for rank, name in enumerate(self.order, start=1):
            squares = runs[name]["r_cv_m2"] or {}
            lengths = (f"{cut} m: {_columns.root(square):.3g} m" for cut, square in _told(squares))
            lines.append(f"{rank}  {name}  R_cv at {', '.join(lengths)}" if squares else f"{rank}  {name}")
        for pair in self.data["pairs"]:
            lines.append(f"{pair['a']}, {pair['b']}: {pair['reason']}")
        return "\n".join(lines)


def _told(squares: dict[str, float | None]) -> list[tuple[str, float]]:
    cuts = sorted(squares, key=float, reverse=True)
    return [(cut, square) for cut in cuts if (square := squares[cut]) is not None]


def _asked(keyword: str, text: str | None) -> str:
    if text is None:
        raise UsageError(f"score was not called with {keyword}=True, or with the file to write")
    return text
