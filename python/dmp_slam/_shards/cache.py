"""A cache on a worker's disk for the files that parts read; evicts the least recently used above a limit."""

from __future__ import annotations

import shutil
import threading
from collections import OrderedDict
from contextlib import contextmanager
from pathlib import Path
from typing import Callable, Iterator, NamedTuple, Sequence

from .._listener import Event
from ..errors import Cancelled, Error
from .places import at_once

#: Interval at which a waiting part checks for cancellation, seconds.
_LOOK_S = 0.1


class Want(NamedTuple):
    """Files that a part reads; they are fetched and removed together."""

    #: Their identity, in the words of their job.
    key: tuple[str, ...]
    #: Their size on disk.
    size: int
    #: Fetches them into a folder.
    fetch: Callable[[Path], None]


class _Entry:
    def __init__(self, folder: Path, size: int) -> None:
        self.folder, self.size = folder, size
        self.users = 0
        self.is_whole = False
        self.fetching = threading.Lock()


def _bring(want: Want, entry: _Entry) -> None:
    """Fetches missing files. Other threads wait for a running fetch, and fetch themselves if it fails."""
    with entry.fetching:
        if not entry.is_whole:
            entry.folder.mkdir(parents=True)
            try:
                want.fetch(entry.folder)
            except BaseException:
                shutil.rmtree(entry.folder, ignore_errors=True)
                raise
            entry.is_whole = True


class Cache:
    """A folder with the files that parts read. Threads share it, processes do not."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._entries: OrderedDict[tuple[str, ...], _Entry] = OrderedDict()
        self._changed = threading.Condition()
        self._made = 0

    @property
    def held(self) -> int:
        """Bytes of all files."""
        return sum(entry.size for entry in self._entries.values())

    @contextmanager
    def holding(
        self, whose: str, wants: Sequence[Want], most: int, stop: Event
    ) -> Iterator[list[Path]]:
        """The folders of the wanted files, as long as needed. Space is reserved at once: nobody waits while holding space."""
        entries = self._take(whose, wants, most, stop)
        try:
            at_once(lambda number: _bring(wants[number], entries[number]), range(len(wants)))
            yield [entry.folder for entry in entries]
        finally:
            self._give_back(wants, entries)

    def forget(self, job: str) -> None:
        """Removes the unused files of a job."""
        with self._changed:
            for key in [key for key, entry in self._entries.items() if key[0] == job and not entry.users]:
                self._evict(key)

    def _take(self, whose: str, wants: Sequence[Want], most: int, stop: Event) -> list[_Entry]:
        wanted = {want.key for want in wants}
        needed = sum(want.size for want in wants)
        if needed > most:
            raise Error(f"{whose} reads {needed} bytes, and a worker may keep {most}: smaller parts read less each")
        with self._changed:
            while not self._make_room(wants, wanted, most):
                if stop.is_set():
                    raise Cancelled("stopped before the end")
                self._changed.wait(_LOOK_S)
            return [self._use(want) for want in wants]

    def _make_room(self, wants: Sequence[Want], wanted: set[tuple[str, ...]], most: int) -> bool:
        """Whether the wanted files fit after evicting unused ones."""
        new = sum(want.size for want in wants if want.key not in self._entries)
        for key, entry in list(self._entries.items()):
            if self.held + new <= most:
                break
            if not entry.users and key not in wanted:
                self._evict(key)
        return self.held + new <= most

    def _use(self, want: Want) -> _Entry:
        entry = self._entries.get(want.key)
        if entry is None:
            self._made += 1
            entry = self._entries[want.key] = _Entry(self._folder / str(self._made), want.size)
        self._entries.move_to_end(want.key)
        entry.users += 1
        return entry

    def _give_back(self, wants: Sequence[Want], entries: Sequence[_Entry]) -> None:
        with self._changed:
            for want, entry in zip(wants, entries):
                entry.users -= 1
                if not entry.users and not entry.is_whole:
                    self._evict(want.key)
            self._changed.notify_all()

    def _evict(self, key: tuple[str, ...]) -> None:
        shutil.rmtree(self._entries.pop(key).folder, ignore_errors=True)
