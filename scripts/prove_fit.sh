#!/usr/bin/env bash
# How often the errors of a fit of surfaces hold the truth that was put into simulated passes: strengths, the width of a lobe, the pitch of
# a chassis, the offset of an array from the Sun, over many sets of 20, 40 and 80 passes. Within the error must lie 63 to 73 %, within
# twice it at least 92 %.
#
# usage: scripts/prove_fit.sh [SETS=200]     of each number of passes
set -euo pipefail
cd "$(dirname "$0")/.."
SETS=${1:-200} cargo test --locked --test predict -- --ignored --nocapture errors_of_hundreds_of_fits
