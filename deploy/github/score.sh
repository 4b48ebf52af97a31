#!/usr/bin/env bash
# Scores runs in a job of GitHub, for action.yml: the table goes to the summary, a page and the JSON beside.
set -euo pipefail

# New for each time that the action is used in a job.
out=$(mktemp -d "$RUNNER_TEMP/dmp-XXXXXX")

# The release of this version; without one the command must be there.
version=${DMP_VERSION:-}
if [ -z "$version" ] && [[ ${DMP_REF:-} =~ ^v[0-9]+\.[0-9]+\.[0-9]+ ]]; then version=${DMP_REF#v}; fi
if [ -n "$version" ]; then
    name=dmp-$version-$(uname -m)-unknown-linux-gnu
    echo "downloading $name" >&2
    curl --fail --silent --show-error --location --retry 3 "$DMP_RELEASES/v$version/$name.tar.gz" | tar -xz -C "$out"
    PATH=$out/$name:$PATH
elif ! command -v dmp >/dev/null; then
    echo "error: no dmp on the PATH: install it, or name a version" >&2
    exit 2
fi

# An argument a line; `-t NAME=FILE` and `--option value` may share one.
arguments=()
while IFS= read -r line; do
    line=${line#"${line%%[![:space:]]*}"}
    line=${line%"${line##*[![:space:]]}"}
    case $line in
        '') ;;
        -*' '*) arguments+=("${line%% *}" "${line#* }") ;;
        *) arguments+=("$line") ;;
    esac
    case $line in
        --json | --json[=\ ]* | --report | --report[=\ ]*)
            echo "error: ${line%%[= ]*}: the action gives this option itself: its outputs \`json\` and \`page\` name the files" >&2
            exit 2
            ;;
    esac
done <<<"$DMP_ARGUMENTS"

status=0
dmp score "${arguments[@]}" --report "$out/report.html" --json >"$out/scores.json" || status=$?
{
    echo "json=$out/scores.json"
    if [ -s "$out/report.html" ]; then echo "page=$out/report.html"; fi
} >>"$GITHUB_OUTPUT"
if [ -s "$out/scores.json" ]; then
    {
        # Names of runs may have anything in them: the fence is longer than any row of backticks in the table.
        table=$(dmp compare "$out/scores.json")
        fence='```'
        while [[ $table == *"$fence"* ]]; do fence+='`'; done
        printf '%stext\n%s\n%s\n' "$fence" "$table" "$fence"
    } >>"$GITHUB_STEP_SUMMARY"
fi
# Scores of a log that is damaged in part are valid: the job prints a warning and continues.
if [ "$status" = 3 ]; then
    echo "::warning title=dmp::part of the log was lost or damaged, or a run was excluded"
    status=0
fi
exit "$status"
