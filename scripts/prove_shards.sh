#!/usr/bin/env bash
# Proves that a night measured in shards gives the tables of the run on one machine, byte for byte: 1, 3 and N shards, with
# and without Snakemake (installed into a virtual environment of its own), a worker killed with -9, a shard lost and measured
# again. Prints what a shard costs besides its frames. About 5 minutes and 100 MB.
# usage: scripts/prove_shards.sh FOLDER [SATPHOT]
set -euo pipefail
folder=$(mkdir -p "${1:?usage: prove_shards.sh FOLDER [SATPHOT]}" && cd "$1" && pwd)
here=$(cd "$(dirname "$0")/.." && pwd)
satphot=${2:-}
if [ -z "$satphot" ]; then
    (cd "$here" && cargo build --release --locked)
    satphot=$here/target/release/satphot
fi
satphot=$(cd "$(dirname "$satphot")" && pwd)/$(basename "$satphot")
tables="photometry.ecsv residuals.ecsv stars.ecsv zeropoint.toml master_flat.fits"
now() { date +%s.%N; }
since() { python3 -c "print(f'{$(now) - $1:.2f}')"; }

rm -rf "$folder/night" "$folder/second" "$folder/out" "$folder/by_hand" "$folder/snake"
"$satphot" simulate -q -o "$folder/night" --set name=night --set target.n=60 --set target.scatter_mag=1.0
"$satphot" simulate -q -o "$folder/second" --set name=second --set target.n=20 --set seed=7
for night in night second; do
    start=$(now)
    "$satphot" run -q --no-figures "$folder/$night/pipeline.toml" -o "$folder/out" >/dev/null
    echo "run on one machine, $night: $(since "$start") s"
done

same() { # FOLDER NIGHT WHAT
    for table in $tables; do cmp "$folder/out/$2/$table" "$1/$table"; done
    echo "same bytes: $3"
}
n_shards() { python3 -c "import json,sys; print(len(json.load(open(sys.argv[1]))['shards']))" "$1"; }
prepare() { # FOLDER FRAMES_PER_SHARD
    "$satphot" plan -q -c "$folder/night/pipeline.toml" --frames-per-shard "$2" -o "$1/plan.json" >/dev/null
    "$satphot" flat -q --plan "$1/plan.json" -o "$1/master_flat.fits" >/dev/null
    "$satphot" zeropoint -q --plan "$1/plan.json" -o "$1/zeropoint.toml" >/dev/null
}
measure() { # FOLDER SHARD
    "$satphot" measure -q -j 1 --plan "$1/plan.json" --shard "$2" --zeropoint "$1/zeropoint.toml" \
        --out "$1/shards/$2.ecsv" >/dev/null
}
merge() { "$satphot" merge -q --plan "$1/plan.json" "$1"/shards/*.ecsv -o "$1/photometry.ecsv" >/dev/null; }

# ---- by hand
for per in 60 20 5; do
    into=$folder/by_hand/$per
    mkdir -p "$into"
    prepare "$into" "$per"
    shards=$(n_shards "$into/plan.json")
    seq 0 $((shards - 1)) | shuf | while read -r shard; do measure "$into" "$shard"; done
    merge "$into"
    same "$into" night "$shards shards by hand, in any order"
done

# ---- a worker killed, a shard lost and measured again
into=$folder/by_hand/20
rm -r "$into/shards" "$into/photometry.ecsv" "$into/residuals.ecsv"
killed=0
for delay in 0.02 0.05 0.1 0.2 0.3 0.45 0.6 0.8; do
    rm -f "$into/shards/1.ecsv"
    measure "$into" 1 &
    worker=$!
    sleep "$delay"
    if kill -9 "$worker" 2>/dev/null; then
        wait "$worker" 2>/dev/null || true
        [ -e "$into/shards/1.ecsv" ] || killed=$((killed + 1))
    fi
done
echo "killed with -9 before its table was there: $killed of 8 times"
for shard in 0 1 2; do measure "$into" "$shard"; done
merge "$into"
same "$into" night "after workers killed with -9"
rm "$into/shards/2.ecsv" "$into/photometry.ecsv"
if merge "$into" 2>"$folder/told.txt"; then echo "a lost shard was not noticed" >&2; exit 1; else code=$?; fi
[ "$code" = 3 ] && grep -q "shard 2" "$folder/told.txt" && [ ! -e "$into/photometry.ecsv" ]
echo "a lost shard: exit code $code, $(cut -c1-100 "$folder/told.txt")..."
measure "$into" 2
merge "$into"
same "$into" night "after a shard was lost and measured again"

# ---- by Snakemake
venv=$folder/venv
if [ ! -x "$venv/bin/snakemake" ]; then
    python3 -m venv "$venv"
    "$venv/bin/pip" install -q snakemake
fi
echo "Snakemake $("$venv/bin/snakemake" --version)"
snake() { # FRAMES_PER_SHARD [MORE...]
    local per=$1
    shift
    (cd "$folder" && "$venv/bin/snakemake" -q all -s "$here/scripts/snakemake/Snakefile" -c2 "$@" --config \
        "nights={\"night\": \"$folder/night/pipeline.toml\", \"second\": \"$folder/second/pipeline.toml\"}" \
        "satphot=$satphot" "frames_per_shard=$per" "out=$folder/snake/$per")
}
for per in 60 20 5; do
    start=$(now)
    snake "$per"
    echo "two nights by Snakemake, $(n_shards "$folder/snake/$per/night/plan.json") and" \
        "$(n_shards "$folder/snake/$per/second/plan.json") shards: $(since "$start") s"
    for night in night second; do same "$folder/snake/$per/$night" "$night" "$night by Snakemake"; done
done
# Snakemake asks for what its last file needs: the page goes too
rm "$folder/snake/5/night/"{shards/3.ecsv,photometry.ecsv,report.html}
snake 5
same "$folder/snake/5/night" night "Snakemake, a shard lost and measured again"
# the whole workflow killed in the middle, workers too, and started again
rm -r "$folder/snake/20/night/"{shards,photometry.ecsv,report.html}
set -m
snake 20 >/dev/null 2>&1 &
workflow=$!
for _ in $(seq 400); do # until a shard is being measured or done
    [ -d "$folder/snake/20/night/shards" ] && break
    sleep 0.05
done
kill -9 -- -"$workflow" 2>/dev/null || true
wait "$workflow" 2>/dev/null || true
set +m
(cd "$folder" && "$venv/bin/snakemake" -q all -s "$here/scripts/snakemake/Snakefile" --unlock --config \
    "nights={\"night\": \"$folder/night/pipeline.toml\", \"second\": \"$folder/second/pipeline.toml\"}" \
    "satphot=$satphot" "frames_per_shard=20" "out=$folder/snake/20")
snake 20 --rerun-incomplete
same "$folder/snake/20/night" night "Snakemake, killed with -9 with its workers and started again"

# ---- what a shard costs besides its frames
into=$folder/by_hand/5
shards=$(n_shards "$into/plan.json")
rm -r "$into/shards"
start=$(now)
for shard in $(seq 0 $((shards - 1))); do measure "$into" "$shard"; done
few=$(since "$start")
one=$folder/by_hand/60
rm -r "$one/shards"
start=$(now)
measure "$one" 0
all=$(since "$start")
start=$(now)
measure "$one" 0
skipped=$(since "$start")
python3 -c "print(f'60 frames on one thread in $shards shards: $few s, in one: $all s; a shard costs', \
    f'{($few - $all) / ($shards - 1) * 1000:.0f} ms besides its frames; one that is there already $skipped s')"
