#!/usr/bin/env bash
# Every fuzz target for a while (default 600 s each), one after the other: scripts/prove_fuzz.sh [SECONDS]
# Needs cargo-fuzz and a nightly Rust. Prints executions and crashes (an input of more than 10 s or 2 GB is one); the exit code is that of the first crash.
set -euo pipefail
cd "$(dirname "$0")/.."
seconds=${1:-600}
cargo +nightly fuzz build --sanitizer none
status=0
for target in headers tle_omm catalogue config wcs frame; do
    seeds=(fuzz/seeds/$target)
    [ $target = catalogue ] && seeds+=(tests/data/catalogue)
    [ $target = frame ] && seeds+=(tests/data/tiles)
    mkdir -p fuzz/corpus/$target fuzz/artifacts/$target
    log=fuzz/artifacts/$target.log
    code=0
    nice -n 10 cargo +nightly fuzz run --sanitizer none $target fuzz/corpus/$target "${seeds[@]}" -- \
        -dict=fuzz/dictionaries/$target.dict -max_total_time="$seconds" -rss_limit_mb=2048 -timeout=10 \
        -print_final_stats=1 >"$log" 2>&1 || code=$?
    executions=$(sed -n 's/^stat::number_of_executed_units: *//p' "$log")
    crashes=$(find fuzz/artifacts/$target -type f | wc -l)
    printf '%-10s %10s executions in %s s, %s crashes\n' $target "${executions:-?}" "$seconds" "$crashes"
    [ $code = 0 ] || status=$code
done
exit $status
