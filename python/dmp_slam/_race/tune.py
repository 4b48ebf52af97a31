"""Looks for better parameters of a system on growing parts of a log, then checks the best on the rest."""

from __future__ import annotations

import time
from typing import Any, Mapping, NamedTuple, Sequence

from .._columns import root
from ..errors import UsageError
from .field import Entry, grid
from .judge import judged
from .process import Limits
from .runs import Row, Runs, log

#: The shares of the log, from its start, on which candidates are compared. What follows the last takes no part in choosing.
PARTS = (0.15, 0.3, 0.6)
#: By what decimals are multiplied, if no settings are given.
FACTORS = (0.5, 2.0)


class Chosen(NamedTuple):
    """The best candidate, and how it was found."""

    #: ``None``: the default was best.
    entry: Entry | None
    #: Each part with the order of its candidates, best first.
    rounds: list[dict[str, Any]]
    #: The comparison with the default on the last part; ``None`` without one.
    on_chosen: dict[str, Any] | None

    def as_json(self, default: Entry, rest: dict[str, Any] | None) -> dict[str, Any]:
        """The search in the JSON; ``rest`` is the comparison on the scans that took no part."""
        best = self.entry.name if self.entry is not None and rest is not None and rest["verdict"] == self.entry.name else None
        return {
            "system": default.system,
            "default": default.name,
            "chosen": self.entry.name if self.entry else None,
            "changed": self.entry.changed if self.entry else {},
            "instead_of": {key: default.parameters[key] for key in (self.entry.changed if self.entry else {})},
            "share_for_choosing": PARTS[-1],
            "rounds": self.rounds,
            "on_chosen": self.on_chosen,
            "on_rest": rest,
            "better": best,
        }


def candidates(default: Entry, settings: Mapping[str, Any]) -> list[Entry]:
    """The combinations of the settings; without any, one decimal or switch other than the default in each."""
    if settings:
        return [entry for entry in grid(default, settings, True) if entry.parameters != default.parameters]
    found = []
    for key, value in default.parameters.items():
        others = [not value] if isinstance(value, bool) else [value * by for by in FACTORS] if isinstance(value, float) and value else []
        found += [each for other in others for each in grid(default, {key: other}, True)]
    if not found:
        raise UsageError(f"{default.system} has no decimals and no switches to vary: give settings")
    return found


def choose(default: Entry, others: Sequence[Entry], runs: Runs, how: Mapping[str, Any]) -> Chosen:
    """Compares candidates within the time limit of ``runs``. The default always takes part."""
    ends_s = time.monotonic() + runs.limits.time_s
    left: list[Entry] = list(others)
    rounds: list[dict[str, Any]] = []
    on_chosen = None
    for number, share in enumerate(PARTS):
        part = runs.scans.part(0, share)
        count, folder = len(part.stamps_ns()), runs.work / f"part-{number}"
        folder.mkdir(parents=True)
        within = runs._replace(log=str(part.log(folder / "log.mcap")), scans=part, out=folder, work=folder)
        rows: list[Row] = []
        for entry in [default, *left]:
            rest_s = ends_s - time.monotonic()
            if rest_s <= 0:
                break
            rows.append(within._replace(limits=Limits(rest_s, runs.limits.memory_bytes)).row(entry, entry.name))
        if time.monotonic() >= ends_s:
            log.warning("note: the time for tuning ended at %.0f %% of the log", 100 * share)
            break
        result, refused = judged(within.log, rows, how, runs.cancel)
        if result is None:
            break
        named = {row.name: row for row in rows}
        names = ordered(result.data)
        order = [named[name].entry for name in names]
        rounds.append({"scans": count, "order": names, "failed": {**{row.name: row.failed for row in rows if row.failed}, **refused}})
        best = order[0]
        on_chosen = None if best == default or default not in order else compared(result.data, best.name, default.name)
        # Those go on that are not decided to be worse, and as many as the time allows.
        worse = {name for name in names[1:] if compared(result.data, best.name, name)["verdict"] == best.name}
        left = [entry for entry in order if entry != default and entry.name not in worse]
        if number + 1 < len(PARTS):
            left = left[: _affordable(rows, count, PARTS[number + 1] / share, ends_s - time.monotonic())]
    if not rounds:
        return Chosen(None, rounds, None)
    first = rounds[-1]["order"][0]
    by_name = {entry.name: entry for entry in [default, *others]}
    return Chosen(None if first == default.name else by_name[first], rounds, on_chosen)


def ordered(result: Mapping[str, Any]) -> list[str]:
    """The candidates, best first: by how many of the others each is better than, decided or not; at the scale that decided, or
    else the largest, which shows drift."""
    wins = dict.fromkeys(result["order"], 0)
    for pair in result["pairs"]:
        better_by_m = compared(result, pair["a"], pair["b"])["better_by_m"]
        if better_by_m is not None:
            wins[pair["a"] if better_by_m > 0 else pair["b"]] += 1
    return sorted(wins, key=lambda name: -wins[name])


def _affordable(rows: Sequence[Row], count: int, growth: float, rest_s: float) -> int:
    """How many candidates beside the default the time allows on a part so many times as long; at least one."""
    each_s = growth * sum(row.wall_s for row in rows) / len(rows)
    return max(1, int(rest_s / each_s) - 1)


def compared(result: Mapping[str, Any], one: str, other: str) -> dict[str, Any]:
    """How much better one run is than another: the verdict, and RMS residuals in metres at the scale that decided, or the
    first; where drift decided, RMS drift, and no scale."""
    pair = next(pair for pair in result["pairs"] if {pair["a"], pair["b"]} == {one, other})
    scales = pair["scales"]
    scale = next((scale for scale in scales if scale["scale_m"] == pair["decided_at_m"]), scales[0] if scales else None)
    found = {"verdict": pair["verdict"], "reason": pair["reason"], "score": pair["score"], "scale_m": None, "better_by_m": None}
    if pair.get("decided_by_drift"):
        drift = next(drift for drift in result["drift"]["comparisons"] if {drift["a"], drift["b"]} == {one, other})
        a_m, b_m = drift["rms_a_m"], drift["rms_b_m"]
        if a_m is not None and b_m is not None:
            found.update(better_by_m=b_m - a_m if drift["a"] == one else a_m - b_m)
    elif scale is not None:
        a_m, b_m = root(scale["mean_a_m2"]), root(scale["mean_b_m2"])
        if a_m is not None and b_m is not None:
            found.update(scale_m=scale["scale_m"], better_by_m=b_m - a_m if pair["a"] == one else a_m - b_m)
    return found


def held_out(runs: Runs, default: Row, best: Row, how: Mapping[str, Any]) -> dict[str, Any] | None:
    """Compares the chosen run with the default's on the scans that took no part in choosing; ``None`` if one has no score there."""
    part = runs.scans.part(PARTS[-1], 1)
    result, _ = judged(part.log(runs.work / "rest.mcap"), [default, best], how, runs.cancel)
    if result is None or len(result.order) < 2:
        return None
    return {"scans": len(part.stamps_ns()), **compared(result.data, best.name, default.name)}
