#!/bin/sh
# Nights of Moffat stars (beta 2.5, 3.5, 5) and Gaussians at three seeings: star magnitudes and zeropoint against truth,
# and error against run time of exact aperture overlap for the four shapes. A few minutes.
set -e
cd "$(dirname "$0")/.."
cargo test --release --test night -- --ignored --nocapture stars::
cargo test --release --test photometry -- --nocapture aperture::
