"""Files that parts read, on the disk of a worker: as many as a bound allows, those least recently used go first."""

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

#: How often it is looked whether a part that waits is to stop, seconds.
_LOOK_S = 0.1


class Want(NamedTuple):
    """Files that a part reads, which come and go together."""

    #: What they are, in the words of the job that they belong to.
    key: tuple[str, ...]
    #: What they take on the disk.
    size: int
    #: Brings them into a folder.
    fetch: Callable[[Path], None]


class _Entry:
    def __init__(self, folder: Path, size: int) -> None:
        self.folder, self.size = folder, size
        self.users = 0
        self.is_whole = False
        self.fetching = threading.Lock()


def _bring(want: Want, entry: _Entry) -> None:
    """Brings what is not there yet. Who comes while another brings it waits, and brings it if that fails."""
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
        """The folders of what is wanted, for as long as it is needed. All of it takes its room at once: none waits with room taken."""
        entries = self._take(whose, wants, most, stop)
        try:
            at_once(lambda number: _bring(wants[number], entries[number]), range(len(wants)))
            yield [entry.folder for entry in entries]
        finally:
            self._give_back(wants, entries)

    def forget(self, job: str) -> None:
        """Removes what belongs to a job and is not in use."""
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
        """Whether what is wanted fits, when what nobody uses has gone."""
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
