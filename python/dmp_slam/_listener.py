"""Passes messages of a command to the logger ``dmp_slam``, and its progress to a progress bar."""

from __future__ import annotations

import logging
import sys
from typing import Any, Callable, Protocol, Union

#: Findings and costs have level INFO; warnings have level WARNING.
log = logging.getLogger("dmp_slam")

#: Prefixes of lines at level WARNING.
_WARNINGS = ("note: ", "lost: ", "gate failed: ", "error: ")

#: Called with the stage, the unit of its steps, the number done, and the total if known.
ProgressFunction = Callable[[str, str, int, Union[int, None]], None]
#: ``None``: shown on a terminal or in a notebook; or always, never, or passed to a function.
Progress = Union[bool, ProgressFunction, None]


class Event(Protocol):
    """An event that stops a command, such as ``threading.Event``."""

    def is_set(self) -> bool:
        """Whether to stop."""


class Listener:
    """Listens to one command."""

    def __init__(
        self, progress: bool | ProgressFunction | None, cancel: Event | None, said: list[str] | None = None
    ) -> None:
        self._cancel = cancel
        self._said = said
        self._bar: _TqdmBar | _LineBar | None = None
        self._show: ProgressFunction | None
        if callable(progress):
            self._show = progress
        elif progress or (progress is None and _is_watched()):
            self._bar = _bar()
            self._show = self._bar.show
        else:
            self._show = None

    def say(self, line: str) -> None:
        if self._said is not None:
            self._said.append(line)
            return
        level = logging.WARNING if line.startswith(_WARNINGS) else logging.INFO
        log.log(level, "%s", line)

    def progress(self, stage: str, unit: str, done: int, total: int | None) -> None:
        if self._show is not None:
            self._show(stage, unit, done, total)

    def is_cancelled(self) -> bool:
        return self._cancel is not None and self._cancel.is_set()

    def close(self) -> None:
        """Ends listening."""
        if self._bar is not None:
            self._bar.close()


def _is_watched() -> bool:
    return "ipykernel" in sys.modules or (sys.stderr is not None and sys.stderr.isatty())


def _bar() -> _TqdmBar | _LineBar:
    try:
        from tqdm.auto import tqdm
    except ImportError:
        return _LineBar()
    return _TqdmBar(tqdm)


class _TqdmBar:
    """A bar of tqdm for each stage."""

    def __init__(self, tqdm: Any) -> None:
        self._tqdm = tqdm
        self._bar: Any = None
        self._stage = ""

    def show(self, stage: str, unit: str, done: int, total: int | None) -> None:
        if self._bar is None or stage != self._stage or done < self._bar.n or total != self._bar.total:
            self.close()
            self._bar = self._tqdm(total=total, desc=stage, unit=" " + unit, unit_scale=True, leave=False)
            self._stage = stage
        self._bar.update(done - self._bar.n)

    def close(self) -> None:
        if self._bar is not None:
            self._bar.close()
            self._bar = None


class _LineBar:
    """A line that is overwritten, without tqdm."""

    _width = 0

    def show(self, stage: str, unit: str, done: int, total: int | None) -> None:
        self._write(f"{stage}: {100 * done // total} %" if total else f"{stage}: {done} {unit}")

    def close(self) -> None:
        if self._width:
            self._write("")
            sys.stderr.write("\r")
            sys.stderr.flush()

    def _write(self, text: str) -> None:
        sys.stderr.write("\r" + text.ljust(self._width))
        sys.stderr.flush()
        self._width = len(text)
