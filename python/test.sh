#!/usr/bin/env bash
# Builds the wheel, installs it into an environment of its own and tests it there, as somebody who installs it would find it.
# `python/test.sh -k pattern` hands its arguments on to pytest.
set -euo pipefail
cd "$(dirname "$0")"

if ! command -v python3 >/dev/null; then
    if [ "${CI:-}" = true ]; then
        echo "python3 is needed to test the Python package" >&2
        exit 1
    fi
    echo "no python3: the Python package is not tested" >&2
    exit 0
fi

target=${CARGO_TARGET_DIR:-$(cd .. && pwd)/target}
tools=$target/python/tools tested=$target/python/tested wheels=$target/python/wheels sources=$target/python/sources

# What builds and checks is kept from one time to the next; what is tested is new.
if [ ! -x "$tools/bin/maturin" ]; then
    python3 -m venv "$tools"
    "$tools/bin/pip" install --quiet --disable-pip-version-check --constraint tests/constraints.txt maturin
fi
rm -rf "$wheels" "$tested" "$sources"
"$tools/bin/maturin" sdist --out "$sources"
mkdir "$sources/unpacked"
tar -xzf "$sources"/dmp_slam-*.tar.gz -C "$sources/unpacked"
"$tools/bin/python" tests/sources.py "$sources/unpacked"
"$tools/bin/maturin" build --release --locked --out "$wheels"
python3 -m venv "$tested"
"$tested/bin/pip" install --quiet --disable-pip-version-check --constraint tests/constraints.txt "$wheels"/dmp_slam-*.whl
# Away from the sources, which would be imported instead of the package.
here=$PWD
cd "$tested"
# What comes with the wheel, before anything else is there.
bin/python "$here/tests/installed.py" "$wheels"
bin/pip install --quiet --disable-pip-version-check --constraint "$here/tests/constraints.txt" \
    pytest mypy pandas polars pyarrow matplotlib rerun-sdk mcap-ros2-support nbclient ipykernel kiss-icp rosbags \
    dask distributed s3fs 'moto[server]' kubernetes-validate pyyaml jsonschema

# That of these sources, whatever was built before.
cargo build --release --locked --manifest-path "$here/../Cargo.toml"
export DMP_COMMAND=$target/release/dmp
bin/python -m pytest --rootdir "$here" -p no:cacheprovider "$here/tests" "$@"
bin/stubtest dmp_slam._core
cd "$here"
"$tested/bin/mypy" --cache-dir "$target/python/mypy"
