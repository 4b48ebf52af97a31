"""What the tests of clusters share: a bucket whose requests are counted, fail and take long, and workers that die or are looked at."""

from __future__ import annotations

import os
import signal
import threading
import time
from pathlib import Path
from typing import Any, Callable, NamedTuple

from distributed import WorkerPlugin


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


def hooked(hook: Callable[[list[str], Callable[[], Any]], Any]) -> None:
    """Puts something around the commands that tasks run, in this process."""
    from dmp_slam._shards import tasks

    unhooked = tasks.execute

    def execute(arguments: list[str], *given: Any) -> Any:
        return hook(arguments, lambda *others: unhooked(arguments, *(others or given)))

    tasks.execute = execute


class Killer(WorkerPlugin):  # type: ignore[misc]
    """The first worker that is amid a part dies."""

    def __init__(self, stage: str, marker: Path) -> None:
        self.name = f"killer-{stage}"
        self._stage, self._marker = stage, str(marker)

    def setup(self, worker: Any) -> None:
        def die(*_: Any) -> None:
            try:
                os.close(os.open(self._marker, os.O_CREAT | os.O_EXCL))
            except FileExistsError:
                return
            os.kill(os.getpid(), signal.SIGKILL)

        def hook(arguments: list[str], run: Callable[..., Any]) -> Any:
            return run(die, None) if arguments[1] == self._stage else run()

        hooked(hook)


class Measured(WorkerPlugin):  # type: ignore[misc]
    """Writes down what the files take that were brought for each command."""

    def __init__(self, file: Path) -> None:
        self.name = "measured"
        self._file = str(file)

    def setup(self, worker: Any) -> None:
        folder = Path(worker.local_directory, "dmp-parts", "cache")

        def hook(arguments: list[str], run: Callable[..., Any]) -> Any:
            files = [file for file in folder.rglob("*") if file.is_file()]
            with open(self._file, "a") as out:
                out.write(f"{arguments[1]} {sum(file.stat().st_blocks for file in files) * 512} {len(files)}\n")
            return run()

        hooked(hook)


def left(dask_worker: Any) -> list[str]:
    """Files that this package left in the folder of a worker."""
    return [str(file) for file in Path(dask_worker.local_directory, "dmp-parts").rglob("*") if file.is_file()]
