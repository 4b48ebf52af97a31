"""The command ``dmp``, as the package installs it."""

from __future__ import annotations

import os
import sys

from . import _core

#: What makes the C library give memory back, as the command sets it for itself: read when a process begins.
_MEMORY = {"MALLOC_MMAP_THRESHOLD_": "262144", "MALLOC_TRIM_THRESHOLD_": "1048576", "MALLOC_ARENA_MAX": "1"}


def main() -> None:
    """Runs the command with the arguments of this process, and ends the process with its exit code."""
    missing = {name: value for name, value in _MEMORY.items() if name not in os.environ}
    if missing and sys.platform == "linux":
        again = [sys.executable, "-m", "dmp_slam.command", *sys.argv[1:]]
        os.execve(sys.executable, again, {**os.environ, **missing})
    code = _core.main(sys.argv[1:])
    # Nothing is left to be done in Python, which would wait for threads.
    os._exit(code)


if __name__ == "__main__":
    main()
