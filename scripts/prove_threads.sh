#!/usr/bin/env bash
# Proves that two threads reduce a night as one does, byte for byte, and prints how much faster each stage is:
# simulates 200 frames of 1500 x 1500 px (0.9 GB on disk), reduces them with -j 1 and -j 2.
# usage: scripts/prove_threads.sh FOLDER_WITH_SPACE [SATPHOT]
set -euo pipefail
folder=${1:?usage: prove_threads.sh FOLDER_WITH_SPACE [SATPHOT]}
satphot=${2:-}
here=$(cd "$(dirname "$0")/.." && pwd)
if [ -z "$satphot" ]; then
    (cd "$here" && cargo build --release --locked)
    satphot=$here/target/release/satphot
fi
night=$folder/night
if [ ! -e "$night/pipeline.toml" ]; then
    "$satphot" simulate -q "$here/scripts/full_night.toml" -o "$night" --set name=threads \
        --set frame.nx_px=1500 --set frame.ny_px=1500 --set photometry.clip_radius_px=740.0 --set photometry.mesh_px=64 \
        --set flats.n=10 --set pointings.n=10 --set pointings.frames=6 --set target.n=130
fi
for jobs in 1 2 1 2; do
    out=$folder/out_$jobs
    rm -rf "$out"
    echo "-j $jobs, load $(cut -d' ' -f1 /proc/loadavg)"
    ( TIMEFORMAT='  wall %R s, CPU %U + %S s'; time "$satphot" run -q -j "$jobs" "$night/pipeline.toml" --out "$out" >"$folder/summary_$jobs.txt" )
    grep "peak memory" "$folder/summary_$jobs.txt" | sed 's/^/  /'
done
python3 - "$folder" <<'PYTHON'
import glob, json, sys
def stages(jobs):
    with open(glob.glob(f"{sys.argv[1]}/out_{jobs}/*/manifest.json")[0]) as file:
        return {s["name"]: s for s in json.load(file)["stages"]}
one, two = stages(1), stages(2)
print(f"{'stage':10} {'-j 1 wall':>10} {'CPU s':>8} {'-j 2 wall':>10} {'CPU s':>8} {'wall ratio':>10} {'cores':>6}")
for name, a in one.items():
    b = two[name]
    if a["wall_s"] > 0.05:
        cpu = [x.get("cpu_s") or float("nan") for x in (a, b)]
        print(f"{name:10} {a['wall_s']:10.2f} {cpu[0]:8.2f} {b['wall_s']:10.2f} {cpu[1]:8.2f} "
              f"{a['wall_s'] / b['wall_s']:10.2f} {cpu[1] / b['wall_s']:6.2f}")
PYTHON
for table in "$folder"/out_1/*/*; do
    case $(basename "$table") in effective.toml | manifest.json | plan.json | satphot.log*) continue ;; esac
    [ -d "$table" ] || cmp "$table" "$folder/out_2/$(basename "$(dirname "$table")")/$(basename "$table")"
done
echo "tables, master flat and gallery are the same bytes"
