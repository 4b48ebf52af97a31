"""The source distribution has all that the wheel is built of: every source of the crates below it, as it is in the repository."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

unpacked, repository = Path(sys.argv[1]), Path(__file__).resolve().parents[2]
(root,) = unpacked.iterdir()

# Its manifests fit together and the versions are those of the lock file.
METADATA = ["cargo", "metadata", "--locked", "--offline", "--format-version=1", "--no-deps"]
metadata = json.loads(subprocess.check_output([*METADATA, "--manifest-path", root / "python" / "Cargo.toml"]))
crates = {package["name"] for package in metadata["packages"]}
assert {"dmp-slam", "dmp-cast", "dmp-cli", "dmp-python"} <= crates, f"there are {crates}"

folders = [Path(package["manifest_path"]).parent.relative_to(root.resolve()) for package in metadata["packages"]]
files = [file for folder in folders for file in (repository / folder / "src").rglob("*") if file.is_file()]
sources = [file.relative_to(repository) for file in files]
assert len(sources) > 300, f"only {len(sources)} sources"
other = [file for file in sources if (root / file).read_bytes() != (repository / file).read_bytes()]
assert not other, f"not as in the repository: {other}"
print(f"{len(crates)} crates, {len(sources)} sources", file=sys.stderr)
