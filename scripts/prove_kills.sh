#!/usr/bin/env bash
# Kills a run of 40 target frames at random moments and goes on: scripts/prove_kills.sh [KILLS=100] [SEED=1]
# Each round starts from nothing, is killed once (KILL and TERM in turn) after a random part of the time an undisturbed run
# takes, then run again. Every data product must have the bytes of the undisturbed run; nothing half written may be left.
# SATPHOT=path of the program (default: built here).
set -euo pipefail
cd "$(dirname "$0")/.."
kills=${1:-100}
RANDOM=${2:-1}
if [ -z "${SATPHOT:-}" ]; then
    cargo build --release --quiet
    SATPHOT=$PWD/target/release/satphot
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"$SATPHOT" simulate -q -o "$work/night" --set frame.nx_px=320 --set frame.ny_px=240 --set pointings.n=3 \
    --set flats.n=4 --set target.n=40 --set name=kills
cd "$work/night"
results=satphot-out/kills
hashes() { # of the data products: not of those that tell times (manifest, logs) or of what is kept between runs
    (cd "$results" && find . -type f ! -path './.satphot/*' ! -name manifest.json ! -name 'satphot.log*' \
        ! -name plan.json -print0 | sort -z | xargs -0 sha256sum)
}
start=$(date +%s%N)
"$SATPHOT" run -q -j 2 >/dev/null 2>&1
took_ms=$((($(date +%s%N) - start) / 1000000))
hashes >"$work/wanted"
echo "undisturbed: $took_ms ms, $(wc -l <"$work/wanted") products"
midway=0 different=0 finished=0 codes=
for ((round = 1; round <= kills; round++)); do
    rm -rf satphot-out
    signal=$([ $((round % 2)) = 0 ] && echo TERM || echo KILL)
    delay_ms=$(((RANDOM * 32768 + RANDOM) % (took_ms + took_ms / 10)))
    "$SATPHOT" run -q -j 2 >/dev/null 2>&1 &
    pid=$!
    sleep "$(printf '%d.%03d' $((delay_ms / 1000)) $((delay_ms % 1000)))"
    kill -$signal $pid 2>/dev/null || true
    code=0
    wait $pid 2>/dev/null || code=$?
    case $code in
    0) finished=$((finished + 1)) ;;
    137 | 143) midway=$((midway + 1)) ;;
    *) codes="$codes $signal:$code" ;;
    esac
    if ! "$SATPHOT" run -q -j 2 >/dev/null 2>"$work/told"; then
        echo "round $round ($signal after $delay_ms ms): the run after it failed:" && cat "$work/told"
        different=$((different + 1))
        continue
    fi
    hashes >"$work/got"
    if ! diff -q "$work/wanted" "$work/got" >/dev/null; then
        echo "round $round ($signal after $delay_ms ms):" && diff "$work/wanted" "$work/got" || true
        different=$((different + 1))
    fi
    if find "$results" -name '.*.tmp.*' | grep -q .; then
        echo "round $round: half-written files left" && find "$results" -name '.*.tmp.*'
        different=$((different + 1))
    fi
done
echo "$kills kills: $midway in the middle, $finished after the end; other exit codes:${codes:- none}; $different with other bytes"
[ $different = 0 ] && [ -z "$codes" ]
