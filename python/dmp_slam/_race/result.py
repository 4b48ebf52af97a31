"""What ``race`` finds."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Mapping

from .._result import Result


class Race:
    """The order of the runs, what each cost, and why some have none."""

    def __init__(self, data: dict[str, Any], score: Result | None, folder: Path, temporary: Any) -> None:
        self.data = data
        #: The score of the runs; ``None`` if all failed.
        self.score = score
        #: Trajectories, outputs of systems, ``race.json`` and ``page.html``.
        self.folder = folder
        # The folder goes with it.
        self._temporary = temporary

    @property
    def order(self) -> list[str]:
        """The names of the runs with a score, best first."""
        return self.score.order if self.score is not None else []

    @property
    def best(self) -> str | None:
        """The run that is decided to be better than every other; ``None`` where there is none."""
        return self.score.best if self.score is not None else None

    @property
    def failed(self) -> dict[str, str]:
        """Runs without a score, and why."""
        return {row["name"]: row["failed"] for row in self.data["runs"] if row["failed"]}

    @property
    def is_damaged(self) -> bool:
        """Whether a run failed, or part of the log was lost."""
        return bool(self.failed) or self.score is None or self.score.is_damaged

    def trajectory(self, name: str) -> Path:
        """The trajectory of a run, as TUM with the instants at which its poses hold."""
        for row in self.data["runs"]:
            if row["name"] == name and row["trajectory"]:
                return self.folder / str(row["trajectory"])
        raise KeyError(name)

    def to_json(self) -> str:
        """The JSON, as in ``race.json``: systems, versions, every parameter, costs, and the score."""
        return json.dumps(self.data, indent=1, default=str)

    def __repr__(self) -> str:
        parts = [repr(self.score) if self.score is not None else "no run has a score"]
        parts.append(_costs(self.data))
        parts += [_scatter(row) for row in self.data["scatter"]]
        if self.data["tune"]:
            parts.append(_tuned(self.data["tune"]))
        if self.data["repair"]:
            parts.append(_repaired(self.data["repair"]))
        return "\n\n".join(parts)


def _costs(data: Mapping[str, Any]) -> str:
    order = {name: place for place, name in enumerate(data["score"]["order"] if data["score"] else ())}
    rows = sorted(data["runs"], key=lambda row: order.get(row["same_as"] or row["name"], len(order)))
    cells = [("run", "time", "memory", "version and settings, or why it failed")]
    for row in rows:
        known = [row["version"], *(f"{key} {value}" for key, value in row["changed"].items())]
        known += [f"same poses as {row['same_as']}"] if row["same_as"] else []
        last = row["failed"] or "; ".join(word for word in known if word)
        cells.append((row["name"], f"{row['wall_s']:.1f} s", f"{row['peak_memory_bytes'] / 1e6:.0f} MB", last))
    wide = [max(len(row[column]) for row in cells) for column in range(3)]
    return "\n".join(f"{a:<{wide[0]}}  {b:>{wide[1]}}  {c:>{wide[2]}}  {d}".rstrip() for a, b, c, d in cells)


def _scatter(row: Mapping[str, Any]) -> str:
    ran = row["repeats"] - row["failed"]
    if ran < 2:
        return f"{row['run']}: {ran} of {row['repeats']} runs ended: no scatter"
    if row["different"] == 1:
        return f"{row['run']}: {ran} runs gave the same poses, bit by bit"
    apart = "" if row["apart_m"] is None else f", up to {_length(row['apart_m'])} apart"
    return f"{row['run']}: {ran} runs gave {row['different']} trajectories{apart}; {row['decided']} of {row['pairs']} pairs are decided"


def _tuned(tune: Mapping[str, Any]) -> str:
    default, first = tune["default"], f"the first {100 * tune['share_for_choosing']:.0f} %"
    if not tune["rounds"]:
        return f"{default}: no parameters were compared within the limits"
    if tune["chosen"] is None:
        return f"{default}: no setting is better than the default, on {first} of the log"
    changed = ", ".join(f"{key} {value} instead of {tune['instead_of'][key]}" for key, value in tune["changed"].items())
    lines = [f"{tune['chosen']}: {changed}; chosen on {first} of the log{_by(tune['on_chosen'])}."]
    if tune["on_rest"] is None:
        lines.append("The rest of the log, which took no part in choosing, has no score of both.")
    else:
        lines.append(f"On the rest, which took no part in choosing{_by(tune['on_rest'])}: {tune['on_rest']['verdict']}.")
    lines.append(f"It is better than {default}." if tune["better"] else f"No setting is decided to be better than the default, {default}.")
    return "\n".join(lines)


def _by(compared: Mapping[str, Any] | None) -> str:
    if compared is None or compared["better_by_m"] is None:
        return ""
    by_m, scale_m = compared["better_by_m"], compared["scale_m"]
    at = "by drift" if scale_m is None else f"at {scale_m:g} m"
    return f", where it is {_length(abs(by_m))} {'better' if by_m >= 0 else 'worse'} {at}"


def _repaired(repair: Mapping[str, Any]) -> str:
    if repair["trajectory"] is None:
        return f"{repair['run']}: not repaired" + (f": {repair['failed']}" if repair["failed"] else ", its loops closed nothing")
    return f"{repair['run']}: repaired, {repair['trajectory']}"


def _length(length_m: float) -> str:
    return f"{length_m:.2f} m" if length_m >= 1 else f"{100 * length_m:.1f} cm"
