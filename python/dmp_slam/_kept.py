"""Large outputs of a score, in files of a folder that is removed with the result."""

from __future__ import annotations

import logging
import shutil
import tempfile
import weakref
from pathlib import Path
from typing import Any, Iterator, Mapping, Sequence

import numpy as np
import numpy.typing as npt

from ._core import file_stems
from ._execute import execute
from .errors import Error, InputError, UsageError

#: The files written for these keywords, if True.
FILES_KEPT = {"residuals": "returns.ply", "scene": "scene.mcap", "keep": "result.dmp"}

#: Prefixes of arguments to the command: of a run, and of what its poses are.
_RUN, _POSES_AS = "--trajectory=", "--poses-as="
#: Options that add poses to a file, or change them.
_OTHER_POSES = ("--between", "--mend")
_LOGGER = logging.getLogger("dmp_slam")

#: An array of returns, a record each.
Returns = npt.NDArray[np.void]

_TYPES = {"double": "<f8", "float": "<f4", "int": "<i4", "uchar": "u1"}
#: Returns per search for the end of a scan.
_BLOCK = 1 << 20


class Kept:
    """A folder with the scored returns of runs, a scene and a result. It stays on disk as long as something refers to it."""

    def __init__(self, beside: Path | None, wanted: Sequence[str]) -> None:
        self.files: dict[str, Path] = {}
        self._stems: dict[str, str] = {}
        if wanted:
            folder = tempfile.mkdtemp(prefix="dmp-result-", dir=beside)
            weakref.finalize(self, shutil.rmtree, folder, ignore_errors=True)
            self.files = {keyword: Path(folder, FILES_KEPT[keyword]) for keyword in wanted}

    def take(self, result: Mapping[str, Any], called: Sequence[str]) -> None:
        """Takes the files that the command wrote when called with these arguments."""
        names = [run["name"] for run in result["runs"]]
        self._stems = dict(zip(names, file_stems(names)))
        if "residuals" in self.files:
            self._keep_trajectories(names, called)

    def _keep_trajectories(self, names: Sequence[str], called: Sequence[str]) -> None:
        if any(given.startswith(_OTHER_POSES) for given in called):
            _LOGGER.info("no trajectories to view: their poses are not those of the files")
            return
        given = [run[len(_RUN) :] for run in called if run.startswith(_RUN)]
        poses_as = [option[len(_POSES_AS) :] for option in called if option.startswith(_POSES_AS)]
        for name in names:
            # The command names runs after their files.
            files = [run.split("=", 1)[1] for run in given if run.startswith(f"{name}=")] or [
                run for run in given if "=" not in run and Path(run).stem == name
            ]
            # `HOW` is for all runs, `NAME=HOW` for one.
            of_run = [how.rpartition("=")[2] for how in poses_as if "=" not in how or how.startswith(f"{name}=")]
            to = [f"--output={self._trajectory_file(name)}", "--to=tum", "--quiet", *(_POSES_AS + how for how in of_run)]
            try:
                execute(["convert", "trajectory", *to, "--", *files], progress=False)
            except Error as error:
                # A topic, or a file that needs more context: the view has no trajectory.
                _LOGGER.info("%s: no trajectory to view: %s", name, error)

    def returns(self, run: str | None) -> Returns:
        """The returns of a run, loaded into memory on access."""
        file, stem = self._file("residuals"), self._stem(run)
        return ply_records(file if file.exists() else file.with_name(f"{file.stem}.{stem}.ply"))

    def scene(self) -> Path:
        """The scene of all runs."""
        return self._file("scene")

    def result(self) -> Path:
        """The result with its returns."""
        return self._file("keep")

    def trajectory(self, run: str) -> npt.NDArray[np.float64] | None:
        """The positions of a run, N × 3; ``None`` without a saved trajectory."""
        file = self._trajectory_file(run)
        return np.loadtxt(file, usecols=(1, 2, 3), ndmin=2) if file.exists() else None

    def _trajectory_file(self, run: str) -> Path:
        return self._file("residuals").with_name(f"{self._stem(run)}.tum")

    def _file(self, keyword: str) -> Path:
        if keyword not in self.files:
            raise UsageError(f"score was not called with {keyword}=True")
        return self.files[keyword]

    def _stem(self, run: str | None) -> str:
        if run is None and len(self._stems) == 1:
            return next(iter(self._stems.values()))
        if run is None or run not in self._stems:
            text = "which run?" if run is None else f"there is no run {run!r}:"
            raise UsageError(f"{text} {', '.join(map(repr, self._stems))}")
        return self._stems[run]


def ply_records(file: Path) -> Returns:
    """The vertices of a binary PLY with fixed-length records, mapped: read-only, by the names of their fields without
    ``scalar_``."""
    fields, count = [], 0
    with file.open("rb") as ply:
        for line in iter(ply.readline, b"end_header\n"):
            words = line.decode().split()
            if not words:
                raise InputError(f"{file}: the header of the PLY has no end")
            if words[:2] == ["element", "vertex"]:
                count = int(words[2])
            elif words[0] == "property":
                fields.append((words[2].removeprefix("scalar_"), _TYPES[words[1]]))
        start = ply.tell()
    if count == 0:
        return np.empty(0, fields)
    return np.memmap(file, np.dtype(fields), "r", start, (count,))


def by_frame(returns: Returns) -> Iterator[tuple[int, Returns]]:
    """The returns of each scan; those of a scan are consecutive."""
    start, number = 0, None
    for block in range(0, len(returns), _BLOCK):
        frames: Any = returns["frame"][block : block + _BLOCK]
        # The index at which the next scan begins.
        begins = np.flatnonzero(np.diff(frames, prepend=frames[0] if number is None else number)) + block
        number = int(frames[-1])
        for begin in begins.tolist():
            yield int(returns["frame"][start]), returns[start:begin]
            start = begin
    if len(returns):
        yield int(returns["frame"][start]), returns[start:]
