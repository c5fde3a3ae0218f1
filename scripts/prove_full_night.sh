#!/usr/bin/env bash
# Proves that a night of full frames (9576 x 6388) is reduced in the memory it is given: simulates it (3.2 GB on disk),
# reduces it with the default limit and with a smaller one, and fails if the peak that `satphot run` reports is larger
# than either, or the tables differ by a byte.
# usage: scripts/prove_full_night.sh FOLDER_WITH_SPACE [SATPHOT]
set -euo pipefail
folder=${1:?usage: prove_full_night.sh FOLDER_WITH_SPACE [SATPHOT]}
satphot=${2:-}
here=$(cd "$(dirname "$0")/.." && pwd)
if [ -z "$satphot" ]; then
    (cd "$here" && cargo build --release --locked)
    satphot=$here/target/release/satphot
fi
[ -e "$folder/pipeline.toml" ] || "$satphot" simulate "$here/scripts/full_night.toml" -o "$folder"
for limit_mb in 600 400; do
    out=$folder/satphot-out-$limit_mb
    "$satphot" run "$folder/pipeline.toml" --out "$out" --max-memory "${limit_mb}MB" | tee "$folder/summary_$limit_mb.txt"
    peak_mib=$(sed -n 's/.*, \([0-9]*\) MB peak memory.*/\1/p' "$folder/summary_$limit_mb.txt")
    peak_mb=$((peak_mib * 1048576 / 1000000))
    echo "peak memory ${peak_mb} MB, allowed ${limit_mb} MB"
    [ "$peak_mb" -le "$limit_mb" ]
done
for table in photometry.ecsv stars.ecsv residuals.ecsv zeropoint.toml master_flat.fits; do
    cmp "$folder"/satphot-out-600/*/$table "$folder"/satphot-out-400/*/$table
done
echo "the tables are the same bytes"
