#!/usr/bin/env bash
# A score on Slurm: deploy/slurm/score.sh WORK LOG -t [NAME=]RUN ... [options of `dmp shard plan`]
set -euo pipefail

work=$1
shift
# As one word of the shell that runs a job, whatever is in it; and in names of Slurm's files, which take `%` for their own.
word="'${work//\'/\'\\\'\'}'"
folder=${work//%/%%}
dmp shard plan "$@" -o "$work" --cores "${DMP_CORES:-64}" || [ $? -eq 3 ]

# An array job with a task for each part of a stage, perhaps after another job: stage NAME [JOB]
stage() {
    local parts
    parts=$(sed -n "s/^ *\"$1\": \([0-9]*\).*/\1/p" "$work/plan.json" | head -n 1)
    sbatch --parsable --job-name "dmp-$1" --array "1-$parts" ${2:+--dependency "afterok:$2"} \
        --cpus-per-task 1 --mem "${DMP_MEMORY:-2G}" --output "$folder/%x-%a.log" \
        --wrap "dmp shard $1 $word --part \$SLURM_ARRAY_TASK_ID/$parts --threads 1"
}

fuse=$(stage fuse)
merge=$(stage merge "$fuse")
cast=$(stage cast "$merge")
drift=$(stage drift)
sbatch --parsable --job-name dmp-reduce --dependency "afterok:$cast:$drift" --output "$folder/%x.log" \
    --wrap "dmp shard reduce $word --json > $word/scores.json"
