#!/usr/bin/env bash
# The shards of a plan as a SLURM array, without Snakemake. On the login node:
#   satphot plan -c pipeline.toml -o night/plan.json
#   satphot flat --plan night/plan.json -o night/master_flat.fits
#   satphot zeropoint --plan night/plan.json -o night/zeropoint.toml
#   last=$(python3 -c 'import json; print(len(json.load(open("night/plan.json"))["shards"]) - 1)')
#   job=$(sbatch --parsable --array=0-"$last" scripts/snakemake/slurm_array.sh night)
#   sbatch --dependency=afterok:"$job" --wrap 'satphot merge --plan night/plan.json night/shards/*.ecsv -o night/photometry.ecsv'
# A task that was killed or ran out of time is submitted again by its number (--array=7): what it measured is kept. The merge that
# waits for the first array never starts then (DependencyNeverSatisfied): scancel it, and submit it again after the new task.
#SBATCH --job-name=satphot
#SBATCH --cpus-per-task=2
#SBATCH --mem=2G
#SBATCH --time=00:20:00
# B: satphot takes the place of the batch script (exec below) and is no step; without B: only steps are reported
#SBATCH --signal=B:TERM@30
#SBATCH --output=satphot_%A_%a.log
set -euo pipefail
night=${1:?usage: sbatch --array=0-LAST slurm_array.sh FOLDER_OF_THE_PLAN}
exec satphot measure -q -j "${SLURM_CPUS_PER_TASK:-1}" --max-memory 1800MB --plan "$night/plan.json" \
    --shard "$SLURM_ARRAY_TASK_ID" --zeropoint "$night/zeropoint.toml" --out "$night/shards/$SLURM_ARRAY_TASK_ID.ecsv"
