#!/usr/bin/env bash
# Makes every table and figure of Caddy et al., "The First Observations of Moonlit Satellites", that can be computed:
# docs/figures/paper/, and the blocks between markers in docs/paper.md. Text outside the markers is left alone.
# usage: scripts/reproduce_paper.sh                        (some minutes of two cores)
# SATPHOT names the program; without it a release build is made. Needs Python 3 with its standard library.
set -euo pipefail
cd "$(dirname "$0")/.."
if [[ -z ${SATPHOT:-} ]]; then
    cargo build --release
    SATPHOT=target/release/satphot
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
figures=docs/figures/paper
mkdir -p "$figures"
site=(--site -33.7703,151.1113,70)
iss=(--elements src/presets/iss_2025_june.tle "${site[@]}" --satellite iss)

# the list of numbers, the table of passes, the satellites with the parts of the ISS
"$SATPHOT" published --markdown --full -q > "$work/published.md"
"$SATPHOT" check-table -q > "$work/passes.txt"
"$SATPHOT" satellites > "$work/satellites.txt"
"$SATPHOT" satellites iss > "$work/iss.txt"

# light classes: every pass of the campaign that the telescope could follow, and four by day a week later
"$SATPHOT" predict pass "${iss[@]}" --start 2025-06-08T00:00:00 --hours 120 --min-alt 15 -q -o "$work/passes.ecsv" > "$work/all_passes.txt"
by_day=()
for start in 2025-06-18T06:00:00 2025-06-19T05:15:00 2025-06-21T05:15:00 2025-06-22T04:30:00; do
    by_day+=("$work/day_$start.ecsv")
    "$SATPHOT" predict pass "${iss[@]}" --start $start --hours 0.75 --min-alt 15 -q -o "${by_day[-1]}" >> "$work/all_passes.txt"
done
"$SATPHOT" published --observed "$work/passes.ecsv" "${by_day[@]}" -q -o "$figures/classes.svg" > "$work/classes.txt"

# figures 2, 5, 7, 8, 9 and 10 as published and as corrected, on common scales; the map of figure 9; the sky of figure 7
"$SATPHOT" published --figures "$figures" -q > "$work/figures.txt"
"$SATPHOT" plot ground --elements src/presets/iss_2025_june.tle "${site[@]}" --time 2025-06-09T10:33:12 -q \
    -o "$figures/ground_track.svg" > "$work/ground.txt"
"$SATPHOT" predict sky "${site[@]}" --satellite iss --height-km 420 --time 2025-06-09T10:33:12 -q > "$work/sky.txt"

# 24 hours: the curve in both readings, the hours
for mode in as_published corrected; do
    "$SATPHOT" predict day "${site[@]}" --satellite iss --height-km 420 --date 2025-06-11 --mode $mode -q \
        -o "$figures/day_$mode.svg" > "$work/day_$mode.txt"
done
"$SATPHOT" predict duty "${site[@]}" --satellite iss --height-km 420 --start 2025-06-10T14:00:00 -q > "$work/duty.txt"

# the month against the limits
"$SATPHOT" predict month "${site[@]}" --month 2025-06 --utc-offset-h 10 --mode both -q -o "$figures/month.svg" > "$work/month.txt"
"$SATPHOT" limits tracked --band g --zp-pixel-mag 21.624 --read-noise-e 2.7 --dark-e-s 0 -q > "$work/tracked.txt"

# streaks, the mirror, the simple model
"$SATPHOT" limits streak --model -q -o "$figures/streak.svg" > "$work/streak.txt"
"$SATPHOT" limits footprint "${site[@]}" --start 2025-06-11T00:00:00 -q > "$work/footprint.txt"
"$SATPHOT" limits simple > "$work/simple.txt"

# the Moon: laws and spectra, at the ground as the paper draws them
"$SATPHOT" plot moon --column global -q -o "$figures/moon.svg" > "$work/moon.txt"

python3 - "$work" docs/paper.md <<'PYTHON'
import pathlib
import re
import sys

work, page = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
text = page.read_text()


def block(match):
    name = match.group(1)
    markdown, plain = work / f"{name}.md", work / f"{name}.txt"
    if markdown.exists():
        body = markdown.read_text().strip()
    else:
        lines = [line.rstrip() for line in plain.read_text().strip("\n").splitlines()]
        body = "```text\n" + "\n".join(lines) + "\n```"
    return f"<!-- {name}:begin -->\n{body}\n<!-- {name}:end -->"


page.write_text(re.sub(r"<!-- ([a-z_]+):begin -->.*?<!-- \1:end -->", block, text, flags=re.S))
PYTHON
echo "docs/paper.md, $(ls "$figures" | wc -l) figures"
