#!/usr/bin/env bash
# Faint points and small discs, made of photons of Moffat (beta 2.5 to 4.5) and Gaussian stars of 1.7 to 9.5 px: the share that is
# found by signal-to-noise, the bias of the flux by signal-to-noise and size, and false detections in empty frames.
#
# usage: scripts/prove_depth.sh [EACH=200] [FRAMES=1000]
#
# SEED          another set of frames
# SNRS, DISCS   signal-to-noise and diameters [FWHM] of the second table, with commas; POINTS those of the first
# PASS          error of the size that other frames of the pass show [FWHM²]; unknown without it
set -euo pipefail
cd "$(dirname "$0")/.."
export EACH=${1:-200} FRAMES=${2:-1000}
cargo test --locked --test photometry -- --ignored --nocapture --test-threads 1 depth::
