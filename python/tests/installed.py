"""What a user gets who installs the wheel: its size, what comes with it, and how long its import takes."""

from __future__ import annotations

import subprocess
import sys
from importlib import metadata
from pathlib import Path

MOST_BYTES = 15_000_000
MOST_S = 0.2

(wheel,) = Path(sys.argv[1]).glob("dmp_slam-*.whl")
size = wheel.stat().st_size
assert size <= MOST_BYTES, f"the wheel has {size} bytes"

brought = {found.metadata["Name"] for found in metadata.distributions()} - {"pip", "setuptools"}
assert brought == {"dmp-slam", "numpy"}, f"installed are {brought}"

CODE = "import time; t = time.process_time(); import dmp_slam; print(time.process_time() - t)"
# Of the processor, since others may use the machine; the best of some, since the first reads files from the disk.
took_s = min(float(subprocess.check_output([sys.executable, "-c", CODE])) for _ in range(5))
assert took_s <= MOST_S, f"the import takes {took_s} s"
print(f"{wheel.name}: {size / 1e6:.1f} MB, import {took_s:.3f} s", file=sys.stderr)
