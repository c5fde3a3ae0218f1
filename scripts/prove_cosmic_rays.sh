#!/usr/bin/env bash
# How often tracks of cosmic rays are reported as the satellite: frames with four tracks in the search region and no target,
# with a point source of S/N 6 to 300 as well, and with it alone; FWHM 1.5 to 10 px. Prints a table: frames, false
# detections, targets found, of them flagged, of them off by 4 sigma without a flag.
#
# usage: scripts/prove_cosmic_rays.sh [FRAMES=1000]
#
# FWHM      a list [px], e.g. 1.5,4                         default 1.5,2,2.5,3,4,6,10
# KINDS     a list: 0 tracks alone, 1 tracks and a target of S/N 6 to 300, 2 that target, 3 one of S/N 6 to 30,
#           4 one to five tracks alone, 5 nothing     default 0,1,2,3,4
# SKY       electrons per pixel, where there is no target (the S/N of targets is that of 60)   default 60
# OTHER     1 draws tracks of other shapes: single and double pixels, long thin tracks, worms, muons
# SEED      another seed                              default 1000003
# OUTLIERS  1 lists the false detections and the targets lost
set -euo pipefail
cd "$(dirname "$0")/.."
FRAMES=${1:-1000} cargo test --locked --test photometry -- --ignored --nocapture tracks_in_a_thousand_frames
