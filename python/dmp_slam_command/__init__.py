"""The command ``dmp``, as the package ``dmp_slam`` installs it.

Beside the package, since a process that begins again need not import that first, and numpy with it.
"""

from __future__ import annotations

import os
import sys

#: What makes the C library give memory back, as the command sets it for itself: read when a process begins.
_MEMORY = {"MALLOC_MMAP_THRESHOLD_": "262144", "MALLOC_TRIM_THRESHOLD_": "1048576", "MALLOC_ARENA_MAX": "1"}


def main() -> None:
    """Runs the command with the arguments of this process, and ends the process with its exit code."""
    missing = {name: value for name, value in _MEMORY.items() if name not in os.environ}
    if missing and sys.platform == "linux" and sys.executable:
        os.execve(sys.executable, _this_process(), {**os.environ, **missing})

    # Where the command needs Python, it is this one.
    os.environ.setdefault("DMP_PYTHON", sys.executable)
    from dmp_slam import _core

    code = _core.main(sys.argv[1:])
    # Nothing is left to be done in Python, which would wait for threads.
    os._exit(code)


def _this_process() -> list[str]:
    """How this process was started. Another way might look for modules in another folder, such as the current one."""
    # Python 3.9 does not know; there it is the script that was installed.
    known: list[str] = getattr(sys, "orig_argv", [sys.executable, *sys.argv])
    return [sys.executable, *known[1:]]
