#!/usr/bin/env python3
"""Opens a scene of `dmp score --scene` in rerun: a tab for every run, residuals over time and the worst places.

    pip install rerun-sdk
    python rerun_blueprint.py scene.mcap                    # opens the viewer
    python rerun_blueprint.py scene.mcap --save scene.rrd   # one file with the scene and its views: rerun scene.rrd
"""

from __future__ import annotations

import argparse
from pathlib import Path

import rerun as rr
import rerun.blueprint as rrb
from rerun.chunk import McapReader

#: Colours of runs, distinguishable for colour-blind readers (Okabe & Ito 2008).
COLOURS = [[0, 114, 178], [230, 159, 0], [0, 158, 115], [204, 121, 167], [86, 180, 233], [213, 94, 0]]
#: The common frame of all runs.
FRAME = rrb.SpatialInformation(target_frame="map")
#: The entities of a run in space, except its clouds.
MARKS = ("way", "places", "pose")


def runs_of(scene: Path) -> list[str]:
    """The names of the runs, in the order of the command."""
    topics = [channel.topic for channel in McapReader(scene).info().channels]
    return [topic[1 : -len("/way")] for topic in topics if topic.endswith("/way")]


def entity(run: str, what: str) -> str:
    """The entity path of a run's topic in rerun."""
    return rr.new_entity_path([*run.split("/"), what])


def blueprint(runs: list[str]) -> rrb.Blueprint:
    """The views of a scene."""
    marks = {entity(run, "way"): rr.Points3D.from_fields(radii=0.15) for run in runs}
    marks |= {entity(run, "places"): rr.Points3D.from_fields(radii=1.0) for run in runs}
    marks |= {entity(run, "pose"): rr.TransformAxes3D(axis_length=3.0) for run in runs}
    together = rrb.Spatial3DView(
        name="All ways",
        contents=["/tf", *(entity(run, what) for run in runs for what in MARKS)],
        spatial_information=FRAME,
        overrides=marks,
    )
    each = [
        rrb.Spatial3DView(
            name=run,
            contents=["/tf", *(entity(run, what) for what in ("map", "returns", *MARKS))],
            spatial_information=FRAME,
            overrides=marks,
        )
        for run in runs
    ]
    # Of a list of lengths, rerun plots the smallest and the largest.
    lines = {
        entity(run, "residual"): rr.SeriesLines(
            names=[run, "", ""], visible_series=[True, False, False], colors=[COLOURS[k % len(COLOURS)]] * 3
        )
        for k, run in enumerate(runs)
    }
    residuals = rrb.TimeSeriesView(name="Residual, metres", contents=list(lines), overrides=lines)
    worst = rrb.TextLogView(name="Worst places", origin="/worst_places")
    return rrb.Blueprint(
        rrb.Vertical(
            rrb.Tabs(*each, together),
            rrb.Horizontal(residuals, worst, column_shares=[3, 2]),
            row_shares=[3, 1],
        ),
        rrb.TimePanel(timeline="message_log_time", state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", type=Path, help="what dmp score --scene wrote")
    parser.add_argument("--save", type=Path, help="write FILE.rrd and open nothing")
    asked = parser.parse_args()
    views = blueprint(runs_of(asked.scene))
    rr.init("dmp", recording_id=asked.scene.stem)
    if asked.save is None:
        rr.spawn(default_blueprint=views)
    else:
        rr.save(asked.save, default_blueprint=views)
    rr.log_file_from_path(asked.scene)


if __name__ == "__main__":
    main()
