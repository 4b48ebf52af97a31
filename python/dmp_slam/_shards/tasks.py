"""The tasks of a score in parts: plan, parts, and their sum."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path
from typing import Mapping

from .._execute import execute
from .._listener import Event
from ..errors import Error, UsageError
from .job import PLAN_FILES, Asked, Done, Given, Job, Part, Planned, Reduced, Site, receipts_before
from .places import Place, bring, fetch, fetch_all, files_of, is_there, place_of, size_of
from .stage import means, own_folder, staged, errors_by_place

#: An option whose value is a URL.
_URL = re.compile(r"(--[a-z-]+=(?:[^=/]+=)?)(\w+://.*)", re.DOTALL)


def plan(job: Job, asked: Asked, site: Site) -> Planned:
    """Plans the score, and uploads the plan to the folder of the job."""
    names: dict[str, str] = {}
    said: list[str] = []
    with errors_by_place(names), own_folder(job, site) as scratch:
        folder = Path(job.work.path) if job.work.is_local else scratch / "plan"
        names[str(folder)] = str(job.work)
        if not job.work.is_local:
            folder.mkdir()
            # Another existing plan is not overwritten: the command reports it.
            if is_there(job.work.join(PLAN_FILES[0]), site.stop):
                _bring_whole(job.work.join(PLAN_FILES[0]), folder, site.stop)
        log = _log(job, site, scratch, said, names)
        runs = [_run(run, number, asked, scratch, site, names) for number, run in enumerate(asked.runs)]
        settings = [_option(option, number, asked, scratch, site, names) for number, option in enumerate(asked.settings)]
        words = ["shard", "plan", f"--output={folder}", f"--cores={asked.cores}", f"--work={scratch}"]
        execute([*words, *settings, *means(job, site), *runs, "--", log], False, site.stop, said)
        _check_gates(folder, asked.gates, log)
        if not job.work.is_local:
            for name in reversed(PLAN_FILES):
                bring(folder / name, job.work.join(name), site.stop)
        found = json.loads((folder / PLAN_FILES[0]).read_text(encoding="utf-8"))
    is_whole = "whole" in found["content"]["index"]["scans"]
    suggested = {stage: int(count) for stage, count in found["suggested"].items()}
    return Planned(found["hash"], suggested, is_whole, said)


def part(job: Job, what: Part, parts: Mapping[str, int], is_whole: bool, site: Site) -> Done:
    """Does a part, unless it is done."""
    if is_there(job.work.join(what.receipt), site.stop):
        return Done(what, was_done=True)
    with staged(job, site, receipts_before(what.stage, parts), what, is_whole) as given:
        words = ["shard", what.stage, str(given.plan), f"--part={what.label}"]
        execute([*words, *given.arguments, *means(job, site)], False, site.stop)
    return Done(what, given.log_bytes, given.work_bytes)


def reduce(job: Job, parts: Mapping[str, int], is_whole: bool, gates: list[str], junit: bool, site: Site) -> Reduced:
    """Merges the results of all parts."""
    said: list[str] = []
    with staged(job, site, receipts_before("reduce", parts), None, is_whole) as given:
        file = given.scratch / "junit.xml"
        words = ["shard", "reduce", str(given.plan), "--json", "--quiet", *gates, *([f"--junit={file}"] if junit else [])]
        output = execute([*words, *given.arguments, *means(job, site)], False, site.stop, said)
        cases = file.read_text(encoding="utf-8") if junit else None
    return Reduced(output.text, output.is_damaged, output.gate_failed, said, cases)


def whole(job: Job, words: list[str], log: str, site: Site) -> tuple[str, list[str]]:
    """Runs a whole command on a log; returns its output and messages."""
    said: list[str] = []
    with own_folder(job, site) as scratch:
        printed = execute([*words, f"--work={scratch}", *means(job, site), "--", log], False, site.stop, said)
    return printed.text, said


def _log(job: Job, site: Site, scratch: Path, said: list[str], names: dict[str, str]) -> str:
    """The log as an argument of the command: planning reads all of it, once."""
    if job.log.is_local:
        return job.log.path
    files = files_of(job.log, site.stop)
    size, free = sum(files.values()), shutil.disk_usage(scratch).free
    if size > free:
        problem = f"a plan reads all of its {size} bytes, and {site.folder} has room for {free}"
        raise Error(f"{job.log}: {problem}")
    said.append(f"{job.log}: a plan reads all of it: {size} bytes are brought to a worker's disk for it")
    target = scratch / "log" / job.log.name
    fetch_all(job.log, target, files, site.stop)
    names[str(target)] = str(job.log)
    return str(target)


def _run(run: Given, number: int, asked: Asked, scratch: Path, site: Site, names: dict[str, str]) -> str:
    text = run.text
    if run.is_packed:
        file = scratch / run.text
        for packed, content in asked.packed.items():
            if Path(packed).parent == Path(run.text).parent:
                (scratch / packed).parent.mkdir(exist_ok=True)
                (scratch / packed).write_bytes(content)
                names[str(scratch / packed)] = f"run {run.prefix.rstrip('=')!r}"
        text = str(file)
    elif run.place is not None and not run.place.is_local:
        file = _bring_whole(run.place, scratch / f"run-{number}", site.stop)
        names[str(file)] = str(run.place)
        text = str(file)
    return f"--trajectory={run.prefix}{text}"


def _option(option: str, number: int, asked: Asked, scratch: Path, site: Site, names: dict[str, str]) -> str:
    """An option; the file that it names by a URL is fetched."""
    named = _URL.fullmatch(option)
    if named is None:
        return option
    place = place_of(named[2], asked.options)
    file = _bring_whole(place, scratch / f"option-{number}", site.stop)
    names[str(file)] = str(place)
    return f"{named[1]}{file}"


def _bring_whole(place: Place, folder: Path, stop: Event) -> Path:
    file = folder / place.name
    fetch(place, file, size_of(place, stop), None, stop)
    return file


def _check_gates(folder: Path, gates: list[str], log: str) -> None:
    """Reports wrong gates before the long part: the command checks them first."""
    if not gates:
        return
    try:
        execute(["shard", "reduce", str(folder), f"--log={log}", "--json", *gates], False, None, [])
    except UsageError:
        raise
    except Error:
        # No part is done yet.
        pass
