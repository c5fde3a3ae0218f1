#!/usr/bin/env bash
# Proves what a day, a month and a constellation cost and that they hold the published numbers:
# the ISS through 11 June 2025 (145 moments x 1000 directions, four lights), June 2025 (30 nights x 13 moments x 300
# directions x 8 satellites), 100 000 satellites x 144 moments; all at tolerance 1e-3, with wall and CPU time and memory.
# usage: scripts/prove_day_month.sh FOLDER_WITH_SPACE [SATPHOT]
set -euo pipefail
folder=${1:?usage: prove_day_month.sh FOLDER_WITH_SPACE [SATPHOT]}
satphot=${2:+$(realpath "$2")}
here=$(cd "$(dirname "$0")/.." && pwd)
if [ -z "$satphot" ]; then
    (cd "$here" && cargo build --release --locked)
    satphot=$here/target/release/satphot
fi
mkdir -p "$folder"
cd "$folder"
site=-33.7703,151.1113,70
timed() {
    local name=$1 limit_s=$2
    shift 2
    local TIMEFORMAT='%R %U'
    echo "$name (load $(cut -d' ' -f1 /proc/loadavg))"
    { time "$satphot" predict "$@" >"$name.txt" 2>"$name.err"; } 2>time.txt
    awk -v limit="$limit_s" '{ printf "  wall %s s, CPU %s s%s\n", $1, $2, limit ? (($1 <= limit) ? ", within " : ", NOT within ") limit " s" : "" }' time.txt
}
for mode in as_published corrected; do
    timed "day_$mode" 10 day --satellite iss --height-km 420 --site "$site" --date 2025-06-11 --mode "$mode" \
        --points 1000 --tolerance 1e-3 -o "day_$mode.svg" -o "day_$mode.ecsv"
    grep -E "highest Sun|night, Sun" "day_$mode.txt" | sed 's/^/  /'
    timed "month_$mode" 60 month --month 2025-06 --site "$site" --mode "$mode" --tolerance 1e-3 -o "month_$mode.svg" \
        -o "month_$mode.ecsv"
    tail -9 "month_$mode.txt" | sed 's/^/  /'
done
echo "published: night 11.25 (9.52 to 13.97), day -2.66 (-3.44 to -0.27); 11 of 30 nights"
timed constellation 0 constellation --satellite starlink-v2 --count 100000 --inclination-deg 53 --site "$site" \
    --start 2025-06-11T00:00:00 --steps 144 --tolerance 1e-3 -o constellation.ecsv
grep million constellation.err | sed 's/^/  /'
"$satphot" predict duty --site "$site" --date 2025-06-11 --satellite iss
