#!/usr/bin/env bash
# Mutated FITS files, read in child processes with a limit of 2 GB and of time: a table of outcomes by kind of damage, the
# number of processes that died (by a signal, a panic, too much memory or time) with the mutation to blame, peak memory.
#
# usage: scripts/prove_damage.sh [COUNT=20000] [SEED=1]
#
# One mutation alone, written to the folder of temporary files:
#   MUTATION=17 SEED=1 cargo test --test frames -- --ignored --exact mutations::one_batch --nocapture
set -euo pipefail
cd "$(dirname "$0")/.."
COUNT=${1:-20000} SEED=${2:-1} cargo test --locked --test frames -- --ignored --exact --nocapture \
  mutations::many_mutated_files_kill_no_process
