#!/bin/sh
# Exports a table of 100000 rows in every format with at most 1 GB of address space, twice, and compares the bytes.
# Usage: scripts/prove_export.sh [satphot] [photometry.ecsv]; without a table the night of fixtures/ is reduced first.
set -eu
satphot=${1:-satphot}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
table=${2:-}
if [ -z "$table" ]; then
    "$satphot" run -q --no-figures -o "$work" >/dev/null
    table=$(ls "$work"/*/photometry.ecsv)
fi
# the rows of the night again and again, as if they were real
awk -v want=100000 '
    /^#/ { sub("data_mode: SIMULATED", "data_mode: REAL"); print; next }
    !named { print; named = 1; next }
    { sub(",ok,caution,", ",ok,use,"); row[n++] = $0 }
    END { for (i = 0; i < want; i++) print row[i % n] }' "$table" >"$work/big.ecsv"
echo "$(grep -vc '^#' "$work/big.ecsv") lines, $(wc -c <"$work/big.ecsv") bytes of ECSV"
for format in fits votable csv score tdm udl iod; do
    for k in 1 2; do
        (
            ulimit -v 1000000
            "$satphot" export "$work/big.ecsv" --to $format -o "$work/$format.$k" -q --organisation PROOF --station PROOF \
                --email proof@example.org --orcid 0000-0002-1825-0097 --observing-mode CMOS --iod-station 8000 --no-name
        )
    done
    cmp "$work/$format.1" "$work/$format.2"
    echo "$format: $(wc -c <"$work/$format.1") bytes, the same twice, below 1 GB"
    rm "$work/$format.2"
done
"$satphot" export --check "$work/score.1" | tail -1
