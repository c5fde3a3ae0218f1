#!/usr/bin/env bash
# Proves that a night of full frames (9576 x 6388) is reduced in less than 1 GB: simulates it (3.2 GB on disk),
# reduces it, and fails if the peak memory that `satphot run` reports is larger.
# usage: scripts/prove_full_night.sh FOLDER_WITH_SPACE
set -euo pipefail
folder=${1:?usage: prove_full_night.sh FOLDER_WITH_SPACE}
cd "$(dirname "$0")/.."
cargo build --release --locked
satphot=target/release/satphot
"$satphot" simulate scripts/full_night.toml -o "$folder"
"$satphot" run "$folder/pipeline.toml" --out "$folder/satphot-out" | tee "$folder/summary.txt"
peak_mb=$(sed -n 's/.*, \([0-9]*\) MB peak memory.*/\1/p' "$folder/summary.txt")
echo "peak memory ${peak_mb} MB, allowed 1000 MB"
[ "$peak_mb" -lt 1000 ]
