"""``python -m dmp_slam race LOG``: runs SLAM systems on a log and ranks them. All other commands are those of ``dmp``."""

from __future__ import annotations

import argparse
import ast
import logging
import sys
from typing import Any


def main() -> int:
    """Runs the command; returns its exit code: 0, 2 for usage, 3 if a run failed, else 1."""
    if sys.argv[1:2] != ["race"]:
        from dmp_slam import _core

        return _core.main(sys.argv[1:])
    given = _parser().parse_args(sys.argv[2:])

    import dmp_slam as dmp

    logging.basicConfig(level=logging.WARNING, format="%(message)s", stream=sys.stderr)
    logging.getLogger("dmp_slam.race").setLevel(logging.INFO)
    try:
        race = dmp.race(
            given.log,
            given.system or None,
            settings=_settings(given.set),
            tune=given.tune,
            repeats=given.repeats,
            minutes=given.minutes,
            memory=given.memory,
            imu=given.imu,
            imu_from_lidar=given.imu_from_lidar,
            repair=given.repair,
            score={key.replace("-", "_"): value for key, value in (_pair(text) for text in given.score)},
            out=given.out,
        )
    except dmp.UsageError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    except dmp.Error as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    print(race.to_json() if given.json else race)
    print(f"written: {race.folder}", file=sys.stderr)
    return 3 if race.is_damaged else 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m dmp_slam race",
        description="Runs SLAM systems on a log, each in a process of its own, and ranks their maps.",
        epilog="Exit codes: 0; 2 for a wrong option; 3 if a run failed; 1 for other errors. docs/guide/race.md has examples.",
    )
    add = parser.add_argument
    add("log", help="the log, as for dmp score")
    add("-s", "--system", action="append", default=[], metavar="NAME", help="an installed system, FILE.py, NAME=FILE.py or NAME='COMMAND {log} {out}'; several times; default: all that are installed")
    add("--set", action="append", default=[], metavar="SYSTEM.KEY=VALUE[,VALUE]", help="a parameter; several values are several runs")
    add("--tune", metavar="SYSTEM", help="look for better parameters of a system, and check them on the rest of the log")
    add("--repeats", type=int, default=1, metavar="N", help="run each so many times")
    add("--minutes", type=float, metavar="M", help="time limit of a run (60), or with --tune of the choosing (20)")
    add("--memory", metavar="SIZE", help="memory limit of a run, '4 GB' (three quarters of what is available)")
    add("--imu", metavar="TOPIC", help="for systems that need an IMU: its topic in the log, or a .csv: stamp in ns, gyro in rad/s, acceleration in m/s²")
    add("--imu-from-lidar", metavar="X,Y,Z,QX,QY,QZ,QW", help="where the LiDAR is in the IMU's frame, metres (the same frame)")
    add("--repair", action="store_true", help="close the loops of the best run")
    add("--score", action="append", default=[], metavar="OPTION=VALUE", help="an option of dmp score, 'voxel=20 cm'")
    add("-o", "--out", default="race", metavar="FOLDER", help="new folder for trajectories, race.json and page.html (race)")
    add("--json", action="store_true", help="print race.json instead of tables")
    return parser


def _pair(text: str) -> tuple[str, Any]:
    key, sign, value = text.partition("=")
    return key, (value if sign else True)


def _settings(given: list[str]) -> dict[str, dict[str, Any]]:
    found: dict[str, dict[str, Any]] = {}
    for text in given:
        name, value = _pair(text)
        system, _, key = name.partition(".")
        values = [_value(one) for one in str(value).split(",")]
        found.setdefault(system, {})[key] = values if len(values) > 1 else values[0]
    return found


def _value(text: str) -> Any:
    words = {"true": True, "false": False}
    try:
        return words[text.lower()] if text.lower() in words else ast.literal_eval(text)
    except (ValueError, SyntaxError):
        return text


if __name__ == "__main__":
    sys.exit(main())
