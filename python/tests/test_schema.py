"""What the command prints is valid by docs/schema.json, and other documents are refused."""

from __future__ import annotations

import copy
import json
import shutil
from pathlib import Path
from typing import Any, Callable, Iterator

import jsonschema
import pytest

from conftest import SAMPLES, command

SCHEMA = json.loads((SAMPLES.parent / "docs/schema.json").read_text(encoding="utf-8"))
CHECKER = jsonschema.Draft202012Validator(SCHEMA)
TOWN, TRUTH, DRIFT, NOISE, COLLAPSED = (
    SAMPLES / name for name in ("town.mcap", "truth.tum", "drift.tum", "noise.tum", "collapsed.tum")
)
#: What no score here fills, each with why.
NOT_SEEN = {
    "promise/of_each_result": "only results beside each other have it",
    "drift/runs/visits/": "a score has no visits",
    "drift/comparisons/better": "more pairs of visits would decide",
    "drift/comparisons/difference_m2/interval": "as that",
    "inputs/runs/conventions/silence": "a place where scans show neither clock nor mounting",
}


def printed(*arguments: Any, codes: tuple[int, ...] = (0,)) -> Any:
    """What a command prints, which must be valid."""
    done = command(*arguments)
    assert done.returncode in codes, done.stderr
    document = json.loads(done.stdout)
    problems = [f"{error.json_path}: {error.message}" for error in CHECKER.iter_errors(document)]
    assert not problems, f"{arguments}:\n" + "\n".join(problems)
    return document


def score(*arguments: Any, log: Path = TOWN, codes: tuple[int, ...] = (0,)) -> Any:
    return printed("score", log, *arguments, "--json", codes=codes)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("documents")


@pytest.fixture(scope="module")
def room(folder: Path) -> Path:
    made = command("simulate", "room", "-o", folder / "room", "--size", "160x120", "--frames", 60, "--rate", 3)
    assert made.returncode == 0, made.stderr
    return folder / "room"


@pytest.fixture(scope="module")
def other_runs(folder: Path) -> dict[str, Path]:
    """The true run under another name, and with stamps that are late, or of another day."""
    lines = [line.split(maxsplit=1) for line in TRUTH.read_text().splitlines()[1:]]
    files = {"same": 0.0, "late": 0.5, "elsewhere": 1e6}
    for name, later_s in files.items():
        text = "".join(f"{float(stamp) + later_s:.9f} {pose}\n" for stamp, pose in lines)
        (folder / f"{name}.tum").write_text(text)
    return {name: folder / f"{name}.tum" for name in files}


@pytest.fixture(scope="module")
def scores(folder: Path, room: Path, other_runs: dict[str, Path]) -> list[Any]:
    """Scores with all that changes what is in them."""
    a, b = ("-t", TRUTH), ("-t", DRIFT)
    maps, scans, city = folder / "maps", folder / "scans", folder / "city"
    assert command("convert", "log", TOWN, "-o", scans, "--to", "bin").returncode == 0
    drive = ("--km", 10, "--beams", 8, "--azimuth-steps", 60, "--speed", 20, "--rate", 5)
    assert command("simulate", "city", *drive, "-o", f"{city}/", "--truth", folder / "city.tum").returncode == 0
    quick: list[Any] = []
    for seed in (1, 2):
        worse = folder / f"worse-{seed}.tum"
        noise = ("--noise", "0.03,0.03deg", "--seed", seed, "-o", worse)
        assert command("simulate", "errors", folder / "city.tum", *noise).returncode == 0
        quick += ["-t", worse]
    maps.mkdir()
    for run in (TRUTH, DRIFT):
        built = command("map", "build", TOWN, "-t", run, "-o", maps / f"{run.stem}.dmpmap", "--voxel", 0.3)
        assert built.returncode == 0, built.stderr
    every = ("--per-frame", folder / "frames.csv", "--per-tile", folder / "tiles.csv")
    page = ("--reference", "truth", "--report", folder / "page.html")
    given = ("--map", f"truth={maps / 'truth.dmpmap'}", "--map", f"drift={maps / 'drift.dmpmap'}")
    gates = ("--expect", "R_cv<1cm", "--expect", "DMP<9", "--expect", "coverage>99%")
    gates += ("--expect", "best:truth", "--expect", "same")
    depth = room / "estimates"
    return [
        score(*a),
        score(*a, *b, "-t", NOISE, "-t", COLLAPSED, *every),
        score(*a, "-t", other_runs["same"], "--voxel", 0.3, "--drift=none"),
        score(*a, *b, *page),
        score(*b, "-t", COLLAPSED, "--every", 5, "--same-within", "1cm"),
        score(*a, "-t", NOISE, "--every", 3, "--drift", "--ego=-1,-1,-2,1,1,1"),
        score(*a, *b, *given),
        score(*a, *b, log=scans),
        score(*a, *b, "--segment", "2s", "--every", 2),
        score(*a, *b, "--segment", "3scans", "--drift", "--ego", "none", "--trust"),
        score(*a, *b, "--extrinsic", "truth=0,0,0.1,0,0,0,1", "--pose-at", "end"),
        score(*a, "-t", other_runs["elsewhere"], codes=(3,)),
        score("-t", other_runs["late"], "--mend"),
        score(*a, *b, "--max-range", 3, codes=(0, 3)),
        score(*quick, "--quick", log=city),
        score(*a, *b, *gates, codes=(4,)),
        score("-t", depth / "good.txt", "-t", depth / "off.txt", log=room),
        score("-t", depth / "good.txt", "-t", depth / "another.txt", log=room),
    ]


def test_scores_are_valid(scores: list[Any]) -> None:
    verdicts = {pair["verdict"] for found in scores for pair in found["pairs"]}
    assert {"truth", "same", "undecided"} <= verdicts
    # One that is mixed takes a longer drive, but has no other fields.
    mixed = copy.deepcopy(scores[1])
    mixed["pairs"][0].update(verdict="mixed", better_on_the_whole="truth", decided_at_m=10.0)
    CHECKER.validate(mixed)


def test_the_schema_has_no_field_that_a_score_lacks(scores: list[Any]) -> None:
    """Each is there in some score, and not null."""
    heard = {path for path, _ in fields("dmp-score", SCHEMA["$defs"]["dmp-score"])}
    seen = set()
    for found in scores:
        seen |= {path for path, _ in fields("dmp-score", SCHEMA["$defs"]["dmp-score"], found)}
    excused = tuple(f"dmp-score/{path}" for path in NOT_SEEN)
    assert {path for path in heard - seen if not path.startswith(excused)} == set()
    assert not [path for path in excused if any(other.startswith(path) for other in seen)]


def fields(path: str, schema: Any, value: Any = ...) -> Iterator[tuple[str, Any]]:
    """All fields below, with their schemas; of a value those that it has, and that are not null."""
    if "$ref" in schema:
        schema = {**schema, **SCHEMA["$defs"][schema["$ref"].rpartition("/")[2]]}
    for choice in schema.get("anyOf", []):
        yield from fields(path, choice, value)
    if "items" in schema and value is not None:
        for item in value if value is not ... else [...]:
            yield from fields(path, schema["items"], item)
    for name, field in schema.get("properties", {}).items():
        within = value if value is ... or value is None else value.get(name)
        if within is not None:
            yield f"{path}/{name}", field
            yield from fields(f"{path}/{name}", field, within)


def test_documents_of_other_commands_are_valid(folder: Path, room: Path, other_runs: dict[str, Path]) -> None:
    one, other, list_of, runs = folder / "one.json", folder / "other.json", folder / "s.toml", folder / "runs"
    one.write_text(json.dumps(score("-t", TRUTH)))
    other.write_text(json.dumps(score("-t", DRIFT)))
    printed("compare", one, other, "--json", "--expect", "best:truth", codes=(4,))
    printed("calibrate", TOWN, "-t", TRUTH, "-t", other_runs["late"], "--json")
    of_runs = printed("drift", TOWN, "-t", TRUTH, "-t", DRIFT, "--json")["runs"]
    assert any(pair["off"] for run in of_runs for pair in run["visits"])
    for run in (DRIFT, TRUTH):
        printed("repair", TOWN, "-t", run, "-o", folder / f"repaired-{run.stem}.tum", "--json")
    for version, run in [("old", DRIFT), ("new", TRUTH)]:
        (runs / version).mkdir(parents=True)
        shutil.copy(run, runs / version / "town.tum")
    logs = "\n".join(f'[[log]]\nname = "{name}"\npath = "{TOWN}"' for name in ("town", "nowhere"))
    list_of.write_text(
        f'versions = ["old", "new"]\ntrajectories = "runs/{{version}}/{{log}}.tum"\n[score]\nvoxel = 0.3\n'
        f'[gates]\nexpect = "new:lost_logs<1"\n{logs}\n'
    )
    kept = printed("suite", list_of, "--list")["logs"]
    printed("suite", list_of, "--json", codes=(0, 3, 4))
    CHECKER.validate({"schema": "dmp-suite-problem/1", "problem": "no memory"})
    assert len(kept) == 1
    for log in (TOWN, room):
        printed("info", log, "-t", TRUTH, "--json", codes=(0, 3))
    printed("map", "info", folder / "maps/truth.dmpmap", "--json")
    for metric in ("ape", "rpe"):
        printed("truth", metric, TRUTH, DRIFT, "--json")
        printed("truth", metric, TRUTH, DRIFT, NOISE, "-a", "--json")
    printed("truth", "smd", room / "room.obj", room, "-t", room / "groundtruth.txt", "--json")
    loops = folder / "loops"
    made = command("simulate", "loops", TRUTH, "-o", loops, "--true", 2, "--false", 1, "--near", 1)
    assert made.returncode == 0, made.stderr
    graph = ("loops", loops / "graph.g2o", "--candidates", loops / "candidates.g2o")
    printed(*graph, "--json")
    log = ("--log", TOWN, "--keyframes", loops / "keyframes.txt", "--truth", loops / "labels.csv", "--accept")
    printed(*graph, *log, "--json")


SPOILED: dict[str, Callable[[Any], Any]] = {
    "a field has another name": lambda found: found["runs"][0].update(coverage_share=found["runs"][0].pop("coverage")),
    "a field is added": lambda found: found["pairs"][0]["scales"][0].update(median_m2=1.0),
    "a number is a text": lambda found: found["config"].update(voxel_m=str(found["config"]["voxel_m"])),
    "the promise is missing": lambda found: found.pop("promise"),
    "the gates are missing": lambda found: found.pop("gates"),
    "a count is a fraction": lambda found: found["inputs"].update(returns=found["inputs"]["returns"] + 0.5),
    "a truncation is unknown": lambda found: found["runs"][0]["r_cv_m2"].update({"3": 1.0}),
    "a pose is short": lambda found: found["inputs"]["runs"][0]["world_from_own"].pop(),
    "the version is another": lambda found: found.update(schema="dmp-score/2"),
    "a deep number is a text": lambda found: found["drift"]["comparisons"][0]["difference_m2"].update(value="much"),
}


@pytest.mark.parametrize("spoil", SPOILED.values(), ids=SPOILED)
def test_other_documents_are_refused(scores: list[Any], spoil: Callable[[Any], Any]) -> None:
    found = copy.deepcopy(scores[1])
    CHECKER.validate(found)
    spoil(found)
    assert not CHECKER.is_valid(found)


def test_it_is_a_schema_and_every_object_is_closed() -> None:
    jsonschema.Draft202012Validator.check_schema(SCHEMA)
    for name, found in SCHEMA["$defs"].items():
        # What other programs write may hold more.
        is_open = name == "dmp-suite-problem"
        assert found["type"] != "object" or ("additionalProperties" in found) != is_open, name
        for field, said in found.get("properties", {}).items():
            assert said["description"], (name, field)


def test_every_document_is_named_where_it_is_described() -> None:
    text = "".join(page.read_text(encoding="utf-8") for page in (SAMPLES.parent / "docs").glob("*.md"))
    for schema in SCHEMA["properties"]["schema"]["enum"]:
        assert f"`{schema}`" in text, schema
