#!/bin/sh
# The all-sky map of Starlink V1.5 against lumos-sat 1.0.9: CPU time and error, one machine, one run, in turns.
#
#   scripts/bench_lumos.sh [TURNS=3]
#
# SATPHOT        our program                       default target/release/satphot (cargo build --release)
# SATPHOT_PEERS  folder of bench_lumos_map.py      default ../shared/peers
# LUMOS_PYTHON   a python with lumos-sat 1.0.9     without it only satphot is measured
# PYTHON         a python with numpy               default python3
here=$(cd "$(dirname "$0")" && pwd)
export SATPHOT="${SATPHOT:-$here/../target/release/satphot}"
export SATPHOT_PEERS="${SATPHOT_PEERS:-$here/../../shared/peers}"
exec "${PYTHON:-python3}" "$here/bench_lumos.py" "$@"
