#!/bin/sh
# Plate matching: ten kinds of field, 60 fields each, several seeds; then error against run time.
# Usage: scripts/prove_plates.sh [SEED ...]      (default 20260721 1 2)
# With python3 + numpy and ../shared/peers/plate_cases.py the fields are those of that script; else our own (cargo test).
# SATPHOT names a binary to use instead of building one; PYTHON a python with numpy; OUT the folder for the fields.
set -eu
cd "$(dirname "$0")/.."
CASES=../shared/peers/plate_cases.py
PYTHON=${PYTHON:-python3}
if [ ! -f "$CASES" ] || ! "$PYTHON" -c 'import numpy' 2>/dev/null; then
    echo "no $CASES or no numpy: our own fields"
    exec cargo test --release --test stars -- --ignored --nocapture plate_cases::
fi
if [ -z "${SATPHOT:-}" ]; then
    cargo build --release
    SATPHOT=target/release/satphot
fi
OUT=${OUT:-$(mktemp -d)}
mkdir -p "$OUT"
[ $# -gt 0 ] || set -- 20260721 1 2
failed=0
for seed in "$@"; do
    dir=$OUT/$seed
    sed "s/20260721/$seed/" "$CASES" > "$OUT/cases_$seed.py"
    [ -d "$dir" ] || "$PYTHON" "$OUT/cases_$seed.py" "$dir" 60
    # The script's wrong field is its own sky turned over at the equator: a mirror image, which a search that allows
    # mirrored frames must find. Fields that are really wrong: the detections of one with the stars of another.
    "$PYTHON" - "$dir" <<'PY'
import glob, json, sys
for w, t in zip(sorted(glob.glob(sys.argv[1] + "/wrong_field_*.json")), sorted(glob.glob(sys.argv[1] + "/typical_*.json"))):
    a, b = json.load(open(w)), json.load(open(t))
    a.update(catalogue=b["catalogue"], hint=b["hint"], case="other_field")
    json.dump(a, open(w.replace("wrong_field", "other_field"), "w"))
PY
    echo "== seed $seed: nine kinds of field, and one that is not in the catalogue"
    "$SATPHOT" solve "$dir"/[!w]*.json > "$OUT/answers_$seed.txt" || failed=1
    sed -n '/^case /,$p' "$OUT/answers_$seed.txt"
    echo "-- the mirror image (wrong_field), parity open and parity known"
    "$SATPHOT" solve "$dir"/wrong_field_*.json 2>/dev/null | tail -1
    "$SATPHOT" solve --parity mirrored "$dir"/wrong_field_*.json | tail -1
done
echo "== solved and time against the number of brightest detections hypotheses are made of (last seed)"
for n in 4 6 8 12 16 24 32; do
    echo "-- $n"
    "$SATPHOT" solve --brightest "$n" "$dir"/half_false*.json "$dir"/very_sparse*.json "$dir"/noisy*.json \
        "$dir"/other_field*.json | sed -n '/^case /,$p' | tail -n +2
done
exit $failed
