"""What a user gets who installs the wheel: its size, what comes with it, and how long its import takes."""

from __future__ import annotations

import subprocess
import sys
from importlib import metadata
from pathlib import Path

MOST_BYTES = 15_000_000
#: Of the processor, and of what numpy takes, where the machine is slow or busy.
MOST_S, MOST_OF_NUMPY = 0.5, 3

(wheel,) = Path(sys.argv[1]).glob("dmp_slam-*.whl")
size = wheel.stat().st_size
assert size <= MOST_BYTES, f"the wheel has {size} bytes"

brought = {found.metadata["Name"] for found in metadata.distributions()} - {"pip", "setuptools"}
assert brought == {"dmp-slam", "numpy"}, f"installed are {brought}"

CODE = "import time; t = time.process_time(); import {}; print(time.process_time() - t)"


def import_s(module: str) -> float:
    """The best of some, since the first reads files from the disk."""
    code = CODE.format(module)
    return min(float(subprocess.check_output([sys.executable, "-c", code])) for _ in range(5))


took_s, numpy_s = import_s("dmp_slam"), import_s("numpy")
assert took_s <= max(MOST_S, MOST_OF_NUMPY * numpy_s), f"the import takes {took_s} s, that of numpy {numpy_s} s"
print(f"{wheel.name}: {size / 1e6:.1f} MB, import {took_s:.3f} s", file=sys.stderr)
