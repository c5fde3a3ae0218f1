#!/usr/bin/env bash
# How deep the stack of a pass reaches, and how true its flux and error are: passes of 10 to 100 frames of a target of S/N 0.9 to 3
# in one frame, still and drifting, with star trails and cosmic rays, and passes without a target. Prints a line per case: passes,
# how many found at the place and elsewhere, bias of the flux in units of its error, share within one error, S/N, and by how much
# the limit is deeper than that of one frame. Then what is no target: satellites that cross, charge spilt from saturated trails,
# each alone and with a target next to it.
#
# usage: scripts/prove_pass_stack.sh [PASSES=200]
#
# SEED      another seed                              default 20261125
# FRAMES    frames of each artefact                   default 200
# OUTLIERS  1 lists the false detections
set -euo pipefail
cd "$(dirname "$0")/.."
PASSES=${1:-200} cargo test --locked --test photometry -- --ignored --nocapture passes_of_ten_to artefacts_in_many_frames
