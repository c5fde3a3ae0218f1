#!/usr/bin/env bash
# Star trails of tracked frames as calibration: a quarter of the frames behind clouds of 0.1 to 1 mag, drawn by a renderer of the
# tests. Prints coverage, clouds seen, false alarms, and errors across and along the track; then frames with a catalogue of
# another field, a turned or mirrored camera, another rate and another exposure time.
#
# usage: scripts/prove_trails.sh [FRAMES=200]     of each exposure time
set -euo pipefail
cd "$(dirname "$0")/.."
FRAMES=${1:-200} cargo test --locked --test stars -- --ignored --nocapture star_trails_over_many_frames
