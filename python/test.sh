#!/usr/bin/env bash
# Builds the wheel, installs it into an environment of its own and tests it there, as a user finds it.
# `python/test.sh --smoke` takes the build of `cargo test` and the tests that need little else; further arguments go to pytest.
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

here=$PWD
target=${CARGO_TARGET_DIR:-$(cd .. && pwd)/target}
tools=$target/python/tools tested=$target/python/tested wheels=$target/python/wheels sources=$target/python/sources

profile=release built=release
needed=(pytest mypy jsonschema)
tests=("$here/tests")
if [ "${1:-}" = --smoke ]; then
    shift
    profile=dev built=debug
    tests=()
    for name in docs memory race race_imu residuals scans schema suite; do tests+=("$here/tests/test_$name.py"); done
else
    needed+=(pandas polars pyarrow matplotlib rerun-sdk mcap-ros2-support nbclient ipykernel kiss-icp rosbags asteval
        dask distributed s3fs 'moto[server]' kubernetes-validate pyyaml)
fi
pip() { "$1/bin/pip" install --quiet --disable-pip-version-check --constraint tests/constraints.txt "${@:2}"; }

# What builds is kept from one time to the next. What is tested is new.
if [ ! -x "$tools/bin/maturin" ]; then
    python3 -m venv "$tools"
    pip "$tools" maturin
fi
rm -rf "$wheels" "$tested" "$sources"
"$tools/bin/maturin" build --profile "$profile" --locked --out "$wheels"
python3 -m venv "$tested"
pip "$tested" "$wheels"/dmp_slam-*.whl
if [ "$profile" = release ]; then
    "$tools/bin/maturin" sdist --out "$sources"
    mkdir "$sources/unpacked"
    tar -xzf "$sources"/dmp_slam-*.tar.gz -C "$sources/unpacked"
    "$tools/bin/python" tests/sources.py "$sources/unpacked"
    # What comes with the wheel, before anything else is there.
    (cd "$tested" && bin/python "$here/tests/installed.py" "$wheels")
fi
pip "$tested" "${needed[@]}"
if [ "$profile" = release ] && "$tested/bin/python" -c 'import sys; sys.exit(sys.version_info < (3, 11))'; then
    # Without what it only needs to download datasets, whose versions contradict those of s3fs.
    pip "$tested" --no-deps evalio
fi
if [ "$profile" = release ]; then
    # Its own index has builds without CUDA, which are a tenth of the others.
    pip "$tested" torch --index-url https://download.pytorch.org/whl/cpu || pip "$tested" torch
fi

# The command of these sources, whatever was built before.
cargo build --profile "$profile" --locked
export DMP_COMMAND=$target/$built/dmp
# Away from the sources, which would be imported instead of the package.
cd "$tested"
bin/python -m pytest --rootdir "$here" -p no:cacheprovider "${tests[@]}" "$@"
bin/stubtest dmp_slam._core
cd "$here"
"$tested/bin/mypy" --cache-dir "$target/python/mypy"
