"""The local folder of a part: fetches its input and uploads its output."""

from __future__ import annotations

import json
import os
import shutil
import tempfile
import threading
from contextlib import AbstractContextManager, ExitStack, contextmanager
from functools import partial
from pathlib import Path
from typing import Any, Iterator, Mapping, NamedTuple, Sequence

from .._execute import execute
from ..errors import Error, InputError
from .cache import Cache, Want
from .job import PLAN_FILES, Job, Part, Site
from .places import Place, at_once, bring, fetch, fetch_all, files_of, size_of

#: The folder of all files of this package on a worker's disk.
_FOLDER = "dmp-parts"
_CACHES: dict[Path, Cache] = {}
_LOCK = threading.Lock()


class Staged(NamedTuple):
    """The input of a command."""

    #: The folder of the plan.
    plan: Path
    log: Path | None
    #: For scratch files.
    scratch: Path
    log_bytes: int = 0
    work_bytes: int = 0

    @property
    def arguments(self) -> list[str]:
        """The same as options."""
        log = [] if self.log is None else [f"--log={self.log}"]
        return [*log, f"--work={self.scratch}"]


@contextmanager
def staged(job: Job, site: Site, receipts: Sequence[str], part: Part | None, is_whole: bool) -> Iterator[Staged]:
    """Fetches the input of a part, or of the reduction without a part; uploads the part's output at the end."""
    names: dict[str, str] = {}
    with errors_by_place(names), own_folder(job, site) as scratch, ExitStack() as stack:
        plan = Path(job.work.path) if job.work.is_local else _plan_folder(job, site, receipts, scratch)
        names[str(plan)] = str(job.work)
        bare = Staged(plan, Path(job.log.path) if job.log.is_local else None, scratch)
        wants = [_whole_log(job, site)] if is_whole and bare.log is None else []
        needs: dict[str, Any] = {"log": [], "files": []}
        if part is not None and not (job.log.is_local and job.work.is_local):
            # Commands may read any byte of a log without an index of its scans.
            with _holding(job, site, part, wants) as held:
                opened = bare._replace(log=held[0] / job.log.name) if held else bare
                needs = _needs(job, site, part, opened)
        wanted = [*wants, *_wants(job, site, needs, bool(wants))]
        held = stack.enter_context(_holding(job, site, part, wanted))
        for want, held_in in zip(wanted, held):
            if want.key[1] == "log":
                bare = bare._replace(log=held_in / job.log.name)
                names[str(held_in / job.log.name)] = str(job.log)
            else:
                _link(held_in / want.key[2], plan)
        by_kind = {kind: sum(want.size for want in wanted if want.key[1] == kind) for kind in ("log", "work")}
        yield bare._replace(log_bytes=by_kind["log"], work_bytes=by_kind["work"])
        if part is not None and not job.work.is_local:
            _take_away(job, site, part, plan)


@contextmanager
def own_folder(job: Job, site: Site) -> Iterator[Path]:
    """A temporary folder for one part."""
    beside = site.folder / _FOLDER / job.name
    beside.mkdir(parents=True, exist_ok=True)
    folder = Path(tempfile.mkdtemp(prefix="part-", dir=beside))
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


@contextmanager
def errors_by_place(names: dict[str, str]) -> Iterator[None]:
    """Errors name the original places of files, not their local copies."""
    try:
        yield
    except Error as error:
        text = line = str(error)
        # For a full disk, the local path matters.
        if "cannot write" not in text:
            for path, place in names.items():
                line = line.replace(path, place)
        if line == text:
            raise
        raise type(error)(line) from None


def forget(job: str, folder: Path) -> None:
    """Removes a job's files from a worker."""
    with _LOCK:
        cache = _CACHES.get(folder)
    if cache is not None:
        cache.forget(job)
    shutil.rmtree(folder / _FOLDER / job, ignore_errors=True)


def means(job: Job, site: Site) -> list[str]:
    """The options for memory and threads: the given ones, or the worker's share."""
    given = list(job.means)
    if not any(option.startswith("--threads") for option in given):
        given.append(f"--threads={site.threads}")
    if site.memory_bytes and not any(option.startswith("--memory") for option in given):
        given.append(f"--memory={site.memory_bytes >> 20}MiB")
    return given


def _cache(site: Site) -> Cache:
    with _LOCK:
        return _CACHES.setdefault(site.folder, Cache(site.folder / _FOLDER / "cache"))


def _holding(
    job: Job, site: Site, part: Part | None, wants: Sequence[Want]
) -> AbstractContextManager[list[Path]]:
    cache, most = _cache(site), job.cache_bytes
    if most is None:
        most = (shutil.disk_usage(site.folder).free + cache.held) // 2
    return cache.holding(str(part or "reduce"), wants, most, site.stop)


def _needs(job: Job, site: Site, part: Part, opened: Staged) -> dict[str, Any]:
    """The files that a part reads, by the command."""
    words = ["shard", "inputs", str(opened.plan), part.stage, f"--part={part.label}"]
    printed = execute([*words, *opened.arguments, *means(job, site)], False, site.stop)
    found: dict[str, Any] = json.loads(printed.text)
    return found


def _wants(job: Job, site: Site, needs: dict[str, Any], has_log: bool) -> list[Want]:
    wants = []
    if not job.log.is_local and not has_log:
        if needs["log"] is None:
            wants.append(_whole_log(job, site))
        elif needs["log"]:
            wants.append(_log_ranges(job, site, needs["log"]))
    if not job.work.is_local and needs["files"]:
        sizes = files_of(job.work, site.stop)
        wants.extend(_work_file(job, site, file, sizes) for file in needs["files"])
    return wants


def _whole_log(job: Job, site: Site) -> Want:
    files = files_of(job.log, site.stop)

    def bring_all(folder: Path) -> None:
        fetch_all(job.log, folder / job.log.name, files, site.stop)

    return Want((job.name, "log"), sum(files.values()), bring_all)


def _log_ranges(job: Job, site: Site, files: list[dict[str, Any]]) -> Want:
    ranges = [_ranges(file["ranges"], file["bytes"]) for file in files]

    def bring_ranges(folder: Path) -> None:
        for file, of_file in zip(files, ranges):
            target = folder / job.log.name / file["name"]
            fetch(job.log.join(file["name"]), target, file["bytes"], of_file, site.stop)

    size = sum(end - start for of_file in ranges for start, end in of_file)
    return Want((job.name, "log", json.dumps(files)), size, bring_ranges)


def _work_file(job: Job, site: Site, file: dict[str, Any], sizes: Mapping[str, int]) -> Want:
    name, place = str(file["name"]), job.work.join(str(file["name"]))
    if name not in sizes:
        raise InputError(f"{place}: it is not there")
    length = sizes[name]
    ranges = _ranges(file["ranges"], length)

    def bring_file(folder: Path) -> None:
        fetch(place, folder / name, length, ranges, site.stop)

    size = sum(end - start for start, end in ranges)
    return Want((job.name, "work", name, json.dumps(ranges)), size, bring_file)


def _ranges(ranges: list[dict[str, int]] | None, length: int) -> list[tuple[int, int]]:
    """Ranges to fetch. Those of a truncated file end with it; the command reports that."""
    if ranges is None:
        return [(0, length)]
    return [(one["start"], min(one["end"], length)) for one in ranges if one["start"] < length]


def _plan_folder(job: Job, site: Site, receipts: Sequence[str], scratch: Path) -> Path:
    """A folder with the plan and the receipts of earlier stages."""
    folder, heads = scratch / "plan", site.folder / _FOLDER / job.name / "heads"
    heads.mkdir(parents=True, exist_ok=True)
    folder.mkdir()
    for file in at_once(partial(_head, job.work, heads, site), [*PLAN_FILES, *receipts]):
        _link(file, folder)
    return folder


def _head(work: Place, heads: Path, site: Site, name: str) -> Path:
    """A small file that many parts read: it is fetched once."""
    file = heads / name
    if not file.exists():
        place = work.join(name)
        beside = heads / f".{name}.{threading.get_ident()}"
        fetch(place, beside, size_of(place, site.stop), None, site.stop)
        os.replace(beside, file)
    return file


def _link(file: Path, folder: Path) -> None:
    os.link(file, folder / file.name)


def _take_away(job: Job, site: Site, part: Part, folder: Path) -> None:
    """Uploads the output of a part: its receipt last."""
    written = sorted(name for name in os.listdir(folder) if name.startswith(part.stem) and name != part.receipt)
    for name in [*written, part.receipt]:
        bring(folder / name, job.work.join(name), site.stop)
