"""Files and folders by path or URL: everything that fsspec reads and writes."""

from __future__ import annotations

import os
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, Callable, Iterable, Iterator, Mapping, NamedTuple, Sequence, TypeVar

from .._arguments import StrPath
from .._listener import Event
from ..errors import Cancelled, Error, InputError, UsageError

#: Bytes per request, and bytes in flight: the memory of a fetch.
_BLOCK_BYTES, _BATCH_BYTES = 4 << 20, 16 << 20
#: Files fetched at a time.
_AT_ONCE = 8
#: Delays before a failed request is repeated, seconds.
_RESTS_S = (0.1, 0.4, 1.5, 4.0)

_LOCAL = ("file://", "local://")
_Found = TypeVar("_Found")
_Of = TypeVar("_Of")
#: Half-open range of bytes.
Range = tuple[int, int]


class Place(NamedTuple):
    """The place of a file or a folder."""

    #: An absolute path, or a URL.
    path: str
    #: Access options for fsspec.
    options: Mapping[str, Any]
    #: Whether it is a path, which commands accept.
    is_local: bool

    def __str__(self) -> str:
        return self.path

    @property
    def name(self) -> str:
        return self.path.rstrip("/").rsplit("/", 1)[-1]

    def join(self, name: str) -> Place:
        """A file in this folder, or the place itself without a name."""
        return self._replace(path=f"{self.path.rstrip('/')}/{name}") if name else self


def is_url(text: str) -> bool:
    return "://" in text


def place_of(path: StrPath, options: Mapping[str, Any] | None) -> Place:
    """The place that a path or URL names."""
    text = os.fsdecode(path)
    for prefix in _LOCAL:
        if text.startswith(prefix):
            text = text[len(prefix) :]
    if is_url(text):
        return Place(text, dict(options or {}), False)
    return Place(os.path.abspath(text), {}, True)


def _opened(place: Place) -> tuple[Any, str]:
    try:
        from fsspec.core import url_to_fs
    except ImportError:
        raise ImportError(f"{place} needs fsspec: pip install 'dmp-slam[dask]'") from None
    try:
        system, path = url_to_fs(place.path, **place.options)
    except ImportError as error:
        # It names the package to install.
        raise ImportError(f"{place}: {error}") from None
    except ValueError as error:
        raise UsageError(f"{place}: {error}") from None
    return system, path


def _again(place: Place, stop: Event | None, call: Callable[[Any, str], _Found]) -> _Found:
    """Makes a request, and repeats it on failure."""
    system, path = _opened(place)
    for rest_s in (*_RESTS_S, None):
        if stop is not None and stop.is_set():
            raise Cancelled("stopped before the end")
        try:
            return call(system, path)
        except FileNotFoundError:
            raise UsageError(f"{place}: it is not there") from None
        except PermissionError as error:
            raise InputError(f"{place}: it may not be read or written: {error}") from None
        except Error:
            raise
        # Every file system has its own errors.
        except Exception as error:
            if rest_s is None:
                raise Error(f"{place}: {type(error).__name__}: {error}") from None
            time.sleep(rest_s)
    raise AssertionError("the last try returns or raises")


def size_of(place: Place, stop: Event | None = None) -> int:
    """The bytes of a file."""

    def size(system: Any, path: str) -> int:
        system.invalidate_cache()
        return int(system.info(path)["size"])

    return _again(place, stop, size)


def is_there(place: Place, stop: Event | None = None) -> bool:
    """Whether there is such a file."""
    if place.is_local:
        return os.path.exists(place.path)
    try:
        size_of(place, stop)
    except UsageError:
        return False
    return True


def files_of(place: Place, stop: Event | None = None) -> dict[str, int]:
    """The files of a folder and its subfolders with their sizes, by relative name; one without a name for a file."""

    def files(system: Any, path: str) -> dict[str, int]:
        system.invalidate_cache()
        found = system.find(path, detail=True)
        sizes = {name[len(path) :].strip("/"): int(info["size"]) for name, info in found.items()}
        if not sizes:
            raise FileNotFoundError
        return sizes

    return _again(place, stop, files)


def at_once(call: Callable[[_Of], _Found], of: Iterable[_Of]) -> list[_Found]:
    """Calls a function for several files, some in parallel: a remote store has high latency and high throughput."""
    with ThreadPoolExecutor(_AT_ONCE) as threads:
        return list(threads.map(call, of))


def fetch_all(place: Place, folder: Path, files: Mapping[str, int], stop: Event) -> None:
    """Fetches the files of a folder, or the one without a name to the path itself."""
    at_once(lambda name: fetch(place.join(name), folder / name, files[name], None, stop), files)


def fetch(place: Place, file: Path, size: int, ranges: Sequence[Range] | None, stop: Event) -> None:
    """Fetches a file, or some ranges of its bytes into a sparse file of the same length."""
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        with file.open("wb") as out:
            out.truncate(size)
            for batch in _batches([(0, size)] if ranges is None else ranges):
                for (start, end), block in zip(batch, _again(place, stop, _blocks(batch))):
                    if len(block) != end - start:
                        problem = f"bytes {start} to {end} are to be read, and {len(block)} of them are there"
                        raise InputError(f"{place}: {problem}")
                    out.seek(start)
                    out.write(block)
    except OSError as error:
        raise Error(f"{file}: cannot write: {error.strerror}") from None


def _blocks(batch: list[Range]) -> Callable[[Any, str], list[bytes]]:
    starts, ends = [start for start, _ in batch], [end for _, end in batch]

    def blocks(system: Any, path: str) -> list[bytes]:
        return list(system.cat_ranges([path] * len(batch), starts, ends, on_error="raise"))

    return blocks


def _batches(ranges: Sequence[Range]) -> Iterator[list[Range]]:
    """Ranges in pieces, some at a time."""
    batch: list[Range] = []
    held = 0
    for first, last in ranges:
        for start in range(first, last, _BLOCK_BYTES):
            end = min(start + _BLOCK_BYTES, last)
            if batch and held + end - start > _BATCH_BYTES:
                yield batch
                batch, held = [], 0
            batch.append((start, end))
            held += end - start
    if batch:
        yield batch


def bring(file: Path, place: Place, stop: Event | None = None) -> None:
    """Uploads a local file to a place."""
    _again(place, stop, lambda system, path: system.put_file(str(file), path))


def remove(place: Place) -> None:
    """Removes a folder with its content."""
    _again(place, None, lambda system, path: system.rm(path, recursive=True))
