"""Tables of results: what the JSON says, a row for each run or pair, in units that people say."""

from __future__ import annotations

import csv
import io
import math
from typing import Any, Iterable, Mapping

from ._core import Table, columns

_KINDS = (("bool", bool), ("int", int), ("float", (int, float)))


def table(rows: Iterable[Mapping[str, Any]], kinds: Mapping[str, str] | None = None) -> Table:
    """A table of rows with the same columns. ``kinds`` say what these hold, where there may be no row to infer them from."""
    rows = list(rows)
    if kinds is not None:
        return Table([(name, kind, [_as(kind, row[name]) for row in rows]) for name, kind in kinds.items()])
    names = list(rows[0]) if rows else []
    return Table([_column(name, [row[name] for row in rows]) for name in names])


def _column(name: str, values: list[Any]) -> tuple[str, str, list[Any]]:
    there = [value for value in values if value is not None]
    for kind, types in _KINDS:
        # A bool is an int, too.
        if all(isinstance(value, types) and (kind == "bool" or not isinstance(value, bool)) for value in there):
            return (name, kind if there else "float", [_as(kind, value) for value in values])
    return (name, "str", [None if value is None else str(value) for value in values])


def _as(kind: str, value: Any) -> Any:
    return float(value) if kind == "float" and value is not None else value


def runs_table(result: Mapping[str, Any]) -> Table:
    """The runs in their order, best first."""
    of_name = {run["name"]: run for run in result["runs"]}
    return table(_run_row(rank, of_name[name]) for rank, name in enumerate(result["order"], start=1))


def _run_row(rank: int, run: Mapping[str, Any]) -> dict[str, Any]:
    row: dict[str, Any] = {"run": run["name"], "rank": rank}
    for name, field, unit in columns():
        if unit == "root":
            squares = run[field] or {}
            for scale in sorted(squares, key=float, reverse=True):
                row[f"{name}_{scale}_m"] = root(squares[scale])
                row[f"{name}_{scale}_m2"] = squares[scale]
        else:
            # Results of earlier versions may not have it.
            row[name if unit == "share" else field] = run.get(field)
    thickness = run.get("thickness") or {}
    row["thick_m"], row["thick_95_m"] = thickness.get("median_m"), thickness.get("p95_m")
    row["returns"], row["frames"], row["surfels"] = run["returns"], run["frames"], run["surfels"]
    return row


def pairs_table(result: Mapping[str, Any]) -> Table:
    """Each two runs: what is decided between them, at which scale, and the interval of their difference there."""
    return table((_pair_row(pair) for pair in result["pairs"]), _PAIRS)


_PAIRS = {
    "a": "str",
    "b": "str",
    "verdict": "str",
    "apart_m": "float",
    "apart_between_m": "float",
    "score": "str",
    "decided_at_m": "float",
    "decided_by_drift": "bool",
    "a_m": "float",
    "b_m": "float",
    "difference_m2": "float",
    "interval_low_m2": "float",
    "interval_high_m2": "float",
    "returns": "int",
    "reason": "str",
}


def _pair_row(pair: Mapping[str, Any]) -> dict[str, Any]:
    decided_m = pair["decided_at_m"]
    scale = next((scale for scale in pair["scales"] if scale["scale_m"] == decided_m), None)
    low, high = (scale and scale["interval_m2"]) or (None, None)
    apart = pair["apart"] or {}
    within, between = apart.get("within"), apart.get("between")
    return {
        "a": pair["a"],
        "b": pair["b"],
        "verdict": pair["verdict"],
        "apart_m": within["worst_m"] if within else None,
        "apart_between_m": between["worst_m"] if between else None,
        "score": pair["score"],
        "decided_at_m": decided_m,
        "decided_by_drift": pair.get("decided_by_drift", False),
        "a_m": root(scale["mean_a_m2"]) if scale else None,
        "b_m": root(scale["mean_b_m2"]) if scale else None,
        "difference_m2": scale["difference_m2"] if scale else None,
        "interval_low_m2": low,
        "interval_high_m2": high,
        "returns": scale["returns"] if scale else None,
        "reason": pair["reason"],
    }


def root(square: float | None) -> float | None:
    """A length whose square is given."""
    return None if square is None or square < 0 else math.sqrt(square)


def csv_table(text: str) -> Table:
    """The table of a file that the command has written. Empty cells are nothing."""
    names, *rows = csv.reader(io.StringIO(text))
    of_names = list(zip(*rows)) or [()] * len(names)
    return Table([_csv_column(name, list(cells)) for name, cells in zip(names, of_names)])


def _csv_column(name: str, cells: list[str]) -> tuple[str, str, list[Any]]:
    if name != "run" and not cells:
        return (name, "float", [])
    if name != "run":
        for kind, number in (("int", int), ("float", float)):
            try:
                return (name, kind, [number(cell) if cell else None for cell in cells])
            except ValueError:
                pass
    return (name, "str", cells)


#: What a table of a suite's pairs has of each pair as it is.
_SUITE_PAIR = {
    "a": "str",
    "b": "str",
    "outcome": "str",
    "better": "str",
    "p_value": "float",
    "logs_needed": "int",
    "compared": "int",
    "a_better": "int",
    "b_better": "int",
    "mixed": "int",
    "same": "int",
    "undecided": "int",
}


def suite_pairs_table(suite: Mapping[str, Any]) -> Table:
    """Every two versions of a suite."""

    def row(pair: Mapping[str, Any]) -> dict[str, Any]:
        found = {name: pair[name] for name in _SUITE_PAIR}
        for effect in ("rms", "drift"):
            difference = pair[f"{effect}_difference"]
            low, high = difference["interval_m"] or (None, None)
            found[f"{effect}_difference_m"] = difference["median_m"]
            found[f"{effect}_low_m"], found[f"{effect}_high_m"] = low, high
        return found

    ends = ("difference_m", "low_m", "high_m")
    kinds = {f"{effect}_{end}": "float" for effect in ("rms", "drift") for end in ends}
    return table(map(row, suite["pairs"]), {**_SUITE_PAIR, **kinds})


def suite_logs_table(suite: Mapping[str, Any]) -> Table:
    """Every two versions of a suite on every log, worst first."""
    kinds = {
        "log": "str",
        "a": "str",
        "b": "str",
        "verdict": "str",
        "decided_at_m": "float",
        "decided_by_drift": "bool",
        "rms_difference_m": "float",
        "drift_difference_m": "float",
    }
    place = {log: k for k, log in enumerate(suite["worst_first"])}
    rows = [{**on_log, "a": pair["a"], "b": pair["b"]} for pair in suite["pairs"] for on_log in pair["logs"]]
    return table(sorted(rows, key=lambda row: place[row["log"]]), kinds)
