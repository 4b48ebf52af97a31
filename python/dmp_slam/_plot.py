"""Plots a result with matplotlib."""

from __future__ import annotations

import csv
import io
import math
from typing import Any, Mapping

import numpy as np
import numpy.typing as npt

from ._columns import root
from ._kept import Kept, by_frame

#: Pixels along the longer edge of an image of errors.
_PIXELS = 400
#: Errors are clipped at this, metres.
_MOST_M = 0.5


def figure(result: Mapping[str, Any], frames: str | None, kept: Kept) -> Any:
    """Scores; errors over time, if ``frames`` is given; and their positions, if returns were saved."""
    try:
        from matplotlib import pyplot
    except ImportError as error:
        raise ImportError("plot needs matplotlib: pip install matplotlib") from error
    order: list[str] = result["order"]
    pictures = order if "residuals" in kept.files else []
    rows = 1 + (frames is not None) + math.ceil(len(pictures) / 2)
    drawn = pyplot.figure(figsize=(10, 4 * rows), layout="constrained")
    grid = drawn.add_gridspec(rows, 2)
    colours = {name: f"C{number}" for number, name in enumerate(order)}
    _scores(drawn.add_subplot(grid[0, :]), result, colours)
    if frames is not None:
        _over_time(drawn.add_subplot(grid[1, :]), frames, colours)
    for number, name in enumerate(pictures):
        axes = drawn.add_subplot(grid[rows - math.ceil(len(pictures) / 2) + number // 2, number % 2])
        image = _picture(axes, name, kept)
        drawn.colorbar(image, ax=axes, label="mean distance from the predicted range [m]")
    return drawn


def _scores(axes: Any, result: Mapping[str, Any], colours: Mapping[str, str]) -> None:
    """R_cv of each run at each cut, as a length."""
    runs = {run["name"]: run for run in result["runs"]}
    for name, colour in colours.items():
        squares = runs[name]["r_cv_m2"] or {}
        cuts = sorted(squares, key=float)
        axes.plot(cuts, [root(squares[cut]) for cut in cuts], "o-", color=colour, label=name)
    axes.set(xlabel="cut [m]", ylabel="R_cv [m]", yscale="log", title="Scores: lower is better")
    axes.grid(which="both", alpha=0.3)
    axes.legend()


def _over_time(axes: Any, frames: str, colours: Mapping[str, str]) -> None:
    """R_near of each scan at its middle cut, as a length."""
    rows = list(csv.DictReader(io.StringIO(frames)))
    cuts = [name for name in rows[0] if name.startswith("r_near_")] if rows else []
    if not cuts:
        return
    column = cuts[len(cuts) // 2]
    # Without stamps: by the numbers of the scans.
    stamps = [int(row["stamp_ns"]) for row in rows if row["stamp_ns"]]
    for name, colour in colours.items():
        own = [row for row in rows if row["run"] == name and row[column]]
        if stamps:
            along = [(int(row["stamp_ns"]) - min(stamps)) / 1e9 for row in own]
        else:
            along = [float(row["frame"]) for row in own]
        axes.plot(along, [math.sqrt(float(row[column])) for row in own], color=colour, label=name, linewidth=1)
    cut = column.split("_")[2]
    axes.set(xlabel="time [s]" if stamps else "scan", ylabel=f"R_near at {cut} m [m]", title="Over time")
    axes.grid(alpha=0.3)
    axes.legend()


def _picture(axes: Any, name: str, kept: Kept) -> Any:
    """Errors of returns, seen from above: the mean of each pixel, clipped."""
    returns = kept.returns(name)
    low, high = np.full(2, np.inf), np.full(2, -np.inf)
    for _, scan in by_frame(returns):
        places = _in_memory(scan)[0]
        if len(places):
            low, high = np.minimum(low, places.min(axis=0)), np.maximum(high, places.max(axis=0))
    if not np.isfinite(low).all():
        # No return has a prediction.
        low, high = np.zeros(2), np.ones(2)
    pixel = max(float((high - low).max()) / _PIXELS, 1e-3)
    edges = [np.arange(low[k], high[k] + 2 * pixel, pixel) for k in range(2)]
    sums = np.zeros((len(edges[0]) - 1, len(edges[1]) - 1))
    counts = np.zeros_like(sums)
    for _, scan in by_frame(returns):
        places, off = _in_memory(scan)
        sums += np.histogram2d(places[:, 0], places[:, 1], bins=edges, weights=off)[0]
        counts += np.histogram2d(places[:, 0], places[:, 1], bins=edges)[0]
    mean = np.where(counts > 0, sums / np.maximum(counts, 1), np.nan)
    axes.set(title=name, xlabel="x [m]", ylabel="y [m]", aspect="equal")
    return axes.pcolormesh(*edges, mean.T, cmap="viridis", vmin=0, vmax=_MOST_M)


def _in_memory(scan: npt.NDArray[np.void]) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Positions from above of the predicted returns, and their errors, clipped."""
    off = np.minimum(scan["residual_m"].astype(np.float64), _MOST_M)
    there = np.isfinite(off)
    return np.stack([scan["x"], scan["y"]], axis=1)[there], off[there]
