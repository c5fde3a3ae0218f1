#!/bin/sh
# Full-size frames: satphot against numpy, ccdproc, sep and photutils, in turns, one machine, one run. CPU seconds, wall
# seconds, peak memory, ratios.
#
#   scripts/bench_peers.sh FOLDER [TURNS=3] [--full]
#
# FOLDER receives the frames (6.1 GB, drawn by `satphot simulate scripts/bench_frames.toml` unless they are there).
# --full lets numpy and ccdproc take the median of all rows (ten minutes) instead of 800 of 6388, extrapolated.
#
# PEER_PYTHON   a python with numpy, astropy, ccdproc, photutils, sep     default python3; without them only satphot
#               is measured
here=$(cd "$(dirname "$0")" && pwd)
cd "$here/.." || exit 1
folder=${1:?usage: scripts/bench_peers.sh FOLDER [TURNS] [--full]}
cargo build --release --locked --quiet || exit 1
cargo build --release --locked --quiet --bench full_size || exit 1
if [ ! -f "$folder/pipeline.toml" ]; then
    target/release/satphot simulate scripts/bench_frames.toml -o "$folder" || exit 1
fi
FULL_SIZE=$(ls -t target/release/deps/full_size-* | grep -v '\.d$' | head -1)
export FULL_SIZE SATPHOT="$PWD/target/release/satphot"
exec "${PEER_PYTHON:-python3}" "$here/bench_peers.py" "$@"
