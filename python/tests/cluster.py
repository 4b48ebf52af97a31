"""What the tests of clusters share: a bucket whose requests are counted, fail and take long, and workers that die or are looked at."""

from __future__ import annotations

import json
import os
import resource
import signal
import threading
import time
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Callable, Iterator, NamedTuple

from conftest import in_parts
from distributed import Client, WorkerPlugin

import dmp_slam as dmp


class Request(NamedTuple):
    method: str
    path: str
    #: Bytes that were sent.
    sent: int


class Bucket:
    """A server of S3 on this machine."""

    def __init__(self) -> None:
        from moto.server import DomainDispatcherApplication, create_backend_app
        from werkzeug.serving import make_server

        self._app = DomainDispatcherApplication(create_backend_app)
        self._lock = threading.Lock()
        self.requests: list[Request] = []
        #: Every so many requests one fails; 0 for none. How long each takes beside.
        self.fails_every, self.rest_s = 0, 0.0
        self.failed = 0
        self._server = make_server("127.0.0.1", 0, self._answer, threaded=True)
        self.url = f"http://127.0.0.1:{self._server.server_port}"
        threading.Thread(target=self._server.serve_forever, daemon=True).start()
        self.options = {
            "key": "test",
            "secret": "test",
            "client_kwargs": {"endpoint_url": self.url},
        }

    def close(self) -> None:
        self._server.shutdown()

    def sent(self, name: str) -> int:
        """Bytes that were sent of files with a name."""
        return sum(one.sent for one in self.requests if one.method == "GET" and one.path.endswith(name))

    def _answer(self, environ: dict[str, Any], start: Callable[..., Any]) -> Any:
        with self._lock:
            number = len(self.requests)
            self.requests.append(Request(environ["REQUEST_METHOD"], environ["PATH_INFO"], 0))
        time.sleep(self.rest_s)
        if self.fails_every and number % self.fails_every == self.fails_every - 1:
            self.failed += 1
            # What was to be stored is taken, so that the connection can go on.
            environ["wsgi.input"].read(int(environ.get("CONTENT_LENGTH") or 0))
            start("500 Internal Server Error", [("Content-Length", "0")])
            return [b""]
        body = b"".join(self._app(environ, start))
        self.requests[number] = self.requests[number]._replace(sent=len(body))
        return [body]


class Hooked(WorkerPlugin):  # type: ignore[misc]
    """Puts something around the commands that tasks run in a worker, for as long as it is registered."""

    name = "hooked"

    def hook(self, stage: str, run: Callable[..., Any]) -> Any:
        """``run`` may be given a function of progress."""
        raise NotImplementedError

    def setup(self, worker: Any) -> None:
        from dmp_slam._shards import tasks

        self.worker, self._unhooked = worker, tasks.execute
        tasks.execute = self._execute

    def teardown(self, worker: Any) -> None:
        from dmp_slam._shards import tasks

        tasks.execute = self._unhooked

    def _execute(self, arguments: list[str], progress: Any, *given: Any) -> Any:
        return self.hook(arguments[1], lambda shown=progress: self._unhooked(arguments, shown, *given))


class Killer(Hooked):
    """The first worker that is amid a part dies."""

    def __init__(self, stage: str, marker: Path) -> None:
        self._stage, self._marker = stage, marker

    def hook(self, stage: str, run: Callable[..., Any]) -> Any:
        return run(self._die) if stage == self._stage else run()

    def _die(self, *_: Any) -> None:
        try:
            os.close(os.open(self._marker, os.O_CREAT | os.O_EXCL))
        except FileExistsError:
            return
        os.kill(os.getpid(), signal.SIGKILL)


class Marked(Hooked):
    """It is written down that a part is amid its work, which then goes on slowly: what small parts do is soon over."""

    #: How long it goes on slowly, longer than a stop is on its way, and how long a step then takes, seconds.
    _SLOW_S, _STEP_S = 5.0, 0.1

    def __init__(self, stage: str, marker: Path) -> None:
        self._stage, self._marker = stage, marker

    def hook(self, stage: str, run: Callable[..., Any]) -> Any:
        return run(self._step) if stage == self._stage else run()

    def _step(self, *_: Any) -> None:
        if not self._marker.exists():
            self._marker.touch()
        if time.time() - self._marker.stat().st_mtime < self._SLOW_S:
            time.sleep(self._STEP_S)


class Full(Hooked):
    """No file may have more bytes, while a command of a stage runs or from then on: what a disk that is full does."""

    def __init__(self, stage: str, most_bytes: int, is_kept: bool = False) -> None:
        self._stage, self._most_bytes, self._is_kept = stage, most_bytes, is_kept

    def hook(self, stage: str, run: Callable[..., Any]) -> Any:
        if stage != self._stage:
            return run()
        before = resource.getrlimit(resource.RLIMIT_FSIZE)
        resource.setrlimit(resource.RLIMIT_FSIZE, (self._most_bytes, before[1]))
        try:
            return run()
        finally:
            if not self._is_kept:
                resource.setrlimit(resource.RLIMIT_FSIZE, before)

    def teardown(self, worker: Any) -> None:
        most = resource.getrlimit(resource.RLIMIT_FSIZE)[1]
        resource.setrlimit(resource.RLIMIT_FSIZE, (most, most))
        super().teardown(worker)


class Measured(Hooked):
    """Writes down what the files take that were brought for each command."""

    def __init__(self, file: Path) -> None:
        self._file = file

    def hook(self, stage: str, run: Callable[..., Any]) -> Any:
        folder = Path(self.worker.local_directory, "dmp-parts", "cache")
        files = [file for file in folder.rglob("*") if file.is_file()]
        with self._file.open("a") as out:
            out.write(f"{stage} {sum(file.stat().st_blocks for file in files) * 512} {len(files)}\n")
        return run()


def left(dask_worker: Any) -> list[str]:
    """Files that this package left in the folder of a worker."""
    return [str(file) for file in Path(dask_worker.local_directory, "dmp-parts").rglob("*") if file.is_file()]


@contextmanager
def hooked(client: Client, plugin: Hooked) -> Iterator[None]:
    client.register_plugin(plugin)
    try:
        yield
    finally:
        client.wait_for_workers(2)
        client.unregister_worker_plugin("hooked")


def compared(result: dmp.Result) -> dict[str, Any]:
    """All but times and memory, and what a score in parts lacks."""
    return in_parts(json.loads(result.to_json()))
