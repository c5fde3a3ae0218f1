#!/usr/bin/env bash
# Nights that satphot did not draw (scripts/make_observer_night.py), each reduced with the configuration that `satphot init` writes
# from their headers, against the truth of the generator.
#
#   scripts/prove_observer_night.sh FOLDER [SEED...]      needs python3 with numpy and sgp4; a night takes 0.6 GB and a minute
#
# Fails where, over all nights, a used magnitude in 50 or more is off by more than 0.05 mag, or the random errors of the used ones
# hold less than 60 or more than 85 % of the deviations from the median of their group, or a forced flux in 50 (these satellites have a
# signal-to-noise above 50) differs by more than 5 % from what the others of its group make of the truth.
set -euo pipefail
here=$(cd "$(dirname "$0")/.." && pwd)
folder=${1:?usage: $0 FOLDER [SEED...]}
shift
seeds=("$@")
[ "${#seeds[@]}" -gt 0 ] || seeds=(1 2 3)
satphot=${SATPHOT:-$here/target/release/satphot}
[ -x "$satphot" ] || { echo "build it first: cargo build --release --locked" >&2; exit 1; }
for seed in "${seeds[@]}"; do
  night=$folder/$seed
  mkdir -p "$night"
  [ -d "$night/raw" ] || python3 "$here/scripts/make_observer_night.py" --out "$night/raw" --seed "$seed"
  rm -rf "$night/night.toml" "$night/satphot-out"
  (
    cd "$night"
    "$satphot" init raw night.toml > init.txt
    # what no header states, and where the catalogue and the elements lie
    sed -i 's/^# aperture_m = .*/aperture_m = 0.2/; s#"catalogue.csv"#"raw/catalogue.csv"#; s#"elements.tle"#"raw/elements.tle"#' night.toml
    "$satphot" run night.toml --quiet --no-figures > run.txt
  )
done
python3 - "$folder" "${seeds[@]}" <<'PYTHON'
import csv, glob, statistics, sys

folder, seeds = sys.argv[1], sys.argv[2:]
used, off, missed, frames, within = 0, [], 0, 0, 0
forced, forced_off = 0, 0
for seed in seeds:
    truth = {row["file"]: row for row in csv.DictReader(open(f"{folder}/{seed}/raw/truth/truth.csv"))}
    for table in sorted(glob.glob(f"{folder}/{seed}/satphot-out/*/*/photometry.ecsv")):
        lines = [line for line in open(table) if not line.startswith("#")]
        delimiter = "," if lines[0].count(",") > lines[0].count(" ") else " "
        rows = [row for row in csv.DictReader(lines, delimiter=delimiter) if row["frame"] in truth]
        frames += len(rows)
        missed += sum(row["status"] == "nondetection" for row in rows)
        good = [row for row in rows if row["status"] == "ok" and row["verdict"] == "use"]
        deviations = [float(row["v_mag"]) - float(truth[row["frame"]]["mag"]) for row in good]
        if not deviations:
            sys.exit(f"{table}: no used magnitude")
        ratios = [float(row["forced_flux_e"]) / float(truth[row["frame"]]["flux_e"]) for row in good if row["forced_flux_e"]]
        forced += len(ratios)
        forced_off += sum(abs(ratio / statistics.median(ratios) - 1.0) > 0.05 for ratio in ratios)
        median = statistics.median(deviations)
        for row, deviation in zip(good, deviations):
            used += 1
            within += abs(deviation - median) <= float(row["v_mag_err"])
            if abs(deviation) > 0.05:
                off.append((table.split("/")[-2], row["frame"], deviation, float(row["v_mag_err"])))
        name = table.split("/")[-2]
        print(f"seed {seed} {name}: {len(good)} of {len(rows)} used, median deviation {median:+.4f} mag")
for name, frame, deviation, error in off:
    print(f"off: {name} {frame} {deviation:+.3f} +- {error:.3f}")
share = within / used
print(f"{frames} frames, {used} used, {len(off)} of them off by more than 0.05 mag, {missed} not detected; 1 sigma holds {share:.3f}")
print(f"{forced} forced fluxes of {used} used frames, {forced_off} of them off by more than 5 %")
sys.exit(len(off) * 50 > used or not 0.60 <= share <= 0.85 or forced < used or forced_off * 50 > forced)
PYTHON
