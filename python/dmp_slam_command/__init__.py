"""The command ``dmp``, as the package ``dmp_slam`` installs it.

Outside the package, so that a process that restarts itself need not import the package and numpy first.
"""

from __future__ import annotations

import os
import sys

#: Makes the C library return memory, as the command sets it for itself: read when a process begins.
_MEMORY = {"MALLOC_MMAP_THRESHOLD_": "262144", "MALLOC_TRIM_THRESHOLD_": "1048576", "MALLOC_ARENA_MAX": "1"}


def main() -> None:
    """Runs the command with the arguments of this process, and ends the process with its exit code."""
    missing = {name: value for name, value in _MEMORY.items() if name not in os.environ}
    if missing and sys.platform == "linux" and sys.executable:
        os.execve(sys.executable, _this_process(), {**os.environ, **missing})

    # If the command needs Python, it uses this one.
    os.environ.setdefault("DMP_PYTHON", sys.executable)
    from dmp_slam import _core

    code = _core.main(sys.argv[1:])
    # Nothing is left to do in Python, whose exit would wait for threads.
    os._exit(code)


def _this_process() -> list[str]:
    """The command line of this process. Another one might find modules in other folders, such as the current one."""
    # Python 3.9 has no ``orig_argv``; there it is the installed script.
    known: list[str] = getattr(sys, "orig_argv", [sys.executable, *sys.argv])
    return [sys.executable, *known[1:]]
