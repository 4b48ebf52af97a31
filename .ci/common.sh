# What the gate and the night share. Sourced by `.ci/run` and `.ci/nightly`.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

# Nothing is built a second time after a change.
export CARGO_INCREMENTAL=0

# Real recordings, where they lie beside the checkout. Without them their tests say that they were skipped.
if [ -z "${DMP_DATA:-}" ] && [ -d ../shared/data ]; then
    DMP_DATA=$(cd ../shared/data && pwd)
    export DMP_DATA
fi

began=$SECONDS
step() {
    printf '\n== %s\n' "$*" >&2
    local from=$SECONDS
    "$@"
    printf '== %d s of %d s: %s\n' $((SECONDS - from)) $((SECONDS - began)) "$*" >&2
}

has_chromium() {
    local name
    for name in "${DMP_CHROMIUM:-chromium}" chromium-browser google-chrome; do
        if command -v "$name" >/dev/null; then return; fi
    done
    return 1
}

# A fresh machine has none of these, and tests fail without them where `CI` is `true`. Only root installs them: nobody else is
# asked for a password. The arguments are further packages.
install_programs() {
    local wanted=("$@")
    has_chromium || wanted+=(chromium fonts-dejavu-core)
    python3 -c 'import ensurepip' 2>/dev/null || wanted+=(python3 python3-venv)
    if [ ${#wanted[@]} -gt 0 ] && [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
        apt-get update
        apt-get install -y --no-install-recommends "${wanted[@]}"
    fi
}
