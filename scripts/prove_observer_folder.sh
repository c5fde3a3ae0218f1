#!/usr/bin/env bash
# The folder of an observer's night (scripts/observer_folder.toml), with a flat and a target frame cut off, reduced by one command:
# every magnitude against the truth of the simulation, swapped keywords noticed or listed, time and memory by frames.
#
#   scripts/prove_observer_folder.sh FOLDER [SATPHOT]      needs python3; 300 MB and some minutes
#
# Fails where a group or a row is missing or mixed, a band has fewer than 200 used magnitudes, their random errors hold less than
# 60 or more than 76 % of the deviations from the median of their group, that median is further from the truth than three of its
# systematic errors, a swapped keyword is neither noticed nor listed as not checkable, or time or memory grow faster than frames,
# satellites or filters.
set -euo pipefail
here=$(cd "$(dirname "$0")/.." && pwd)
folder=${1:?usage: $0 FOLDER [SATPHOT]}
satphot=${2:-$here/target/release/satphot}
[ -x "$satphot" ] || { echo "build it first: cargo build --release --locked" >&2; exit 1; }
mkdir -p "$folder"
run() { # folder: reduces it once more; a damaged file alone is no reason to fail
  rm -rf "$1/satphot-out"
  /usr/bin/env time -f '%U %S %M' -o "$1/time.txt" "$satphot" run "$1/pipeline.toml" --quiet --no-figures > "$1/run.txt"
}
draw() { # folder, target frames of each group
  [ -e "$1/pipeline.toml" ] || "$satphot" simulate "$here/scripts/observer_folder.toml" -o "$1" --quiet --set "target.n=$2"
}
draw "$folder/night" 60
truncate -s 20000 "$folder/night/cdk_V_flat_002.fits" "$folder/night/cdk_iss_R_target_0003.fits"
run "$folder/night"
rm -rf "$folder/swapped"
cp -r "$folder/night" "$folder/swapped"
python3 - "$folder/swapped" <<'PYTHON'
import pathlib, sys

folder = pathlib.Path(sys.argv[1])


def swap(keyword, first, second):
    """Exchanges the cards of a keyword between two files."""
    cards = []
    for name in (first, second):
        data = (folder / name).read_bytes()
        cards.append(next(data[k:k + 80] for k in range(0, 11520, 80) if data[k:k + 80].startswith(keyword.ljust(8).encode() + b"=")))
    for name, old, new in ((first, *cards), (second, *reversed(cards))):
        data = (folder / name).read_bytes()
        (folder / name).write_bytes(data.replace(old, new, 1))


swap("FILTER", "cdk_V_field01_00.fits", "cdk_clear_field01_01.fits")
swap("FILTER", "cdk_V_flat_001.fits", "cdk_R_flat_001.fits")
swap("FILTER", "cdk_iss_V_target_0005.fits", "cdk_iss_R_target_0005.fits")
swap("INSTRUME", "cdk_R_field02_00.fits", "refractor_R_field02_00.fits")
swap("OBJECT", "cdk_starlink_V_target_0006.fits", "cdk_bluebird_V_target_0006.fits")
PYTHON
run "$folder/swapped"
draw "$folder/half" 30
run "$folder/half"
part() { # name, patterns of the files to leave out: a part of the half night
  rm -rf "$folder/$1"
  cp -r "$folder/half" "$folder/$1"
  (cd "$folder/$1" && shift && rm -rf satphot-out && rm -f -- $@)
  run "$folder/$1"
}
part one_satellite '*_starlink_*' '*_bluebird_*'
part one_filter '*_R_*' '*_clear_*'
python3 - "$folder" <<'PYTHON'
import csv, glob, statistics, sys

folder = sys.argv[1]


def table(path):
    lines = [line for line in open(path) if not line.startswith("#")]
    return list(csv.DictReader(lines, delimiter="," if lines[0].count(",") > lines[0].count(" ") else " "))


truth = {row["frame"]: row for row in table(f"{folder}/night/truth/target.csv")}
failures, used, within, groups = [], {}, {}, 0
filters = {"-V-": "V", "-R-": "R", "-no-filter-": "clear"}
for path in sorted(glob.glob(f"{folder}/night/satphot-out/observer/*/photometry.ecsv")):
    group = path.split("/")[-2]
    satellite, band = next((s, b) for s in ("iss", "starlink", "bluebird") for b in ("-V-", "-R-", "-no-filter-") if s in group and b in group)
    groups += 1
    rows = [row for row in table(path) if row["frame"] in truth]
    camera = "refractor" if "qhy" in group else "cdk"
    mixed = [row["frame"] for row in rows if not row["frame"].startswith(f"{camera}_{satellite}_{filters[band]}_")]
    if mixed:
        failures.append(f"{group}: holds {mixed}")
    good = [row for row in rows if row["status"] == "ok" and row["verdict"] == "use"]
    deviations = [float(row["v_mag"]) - float(truth[row["frame"]]["v_mag"]) for row in good]
    if len(good) < 10:
        failures.append(f"{group}: {len(good)} used magnitudes of {len(rows)}")
        continue
    middle = statistics.median(deviations)
    err_sys = statistics.median(float(row["v_mag_err_sys"]) for row in good)
    if abs(middle) > 3 * err_sys:
        failures.append(f"{group}: {middle:+.3f} mag from the truth, its systematic error is {err_sys:.3f}")
    used[band] = used.get(band, 0) + len(good)
    within[band] = within.get(band, 0) + sum(abs(d - middle) <= float(r["v_mag_err"]) for d, r in zip(deviations, good))
    print(f"{group}: {len(good)} of {len(rows)} used, {middle:+.4f} +- {err_sys:.4f} mag from the truth")
if groups != 18:
    failures.append(f"{groups} groups, not 18")
for band, n in used.items():
    share = within[band] / n
    print(f"filter {filters[band]}: {n} magnitudes, 1 sigma holds {share:.3f}")
    if n < 200 or not 0.60 <= share <= 0.76:
        failures.append(f"filter {filters[band]}: {n} magnitudes, coverage {share:.3f}")
checks = {}
for path in glob.glob(f"{folder}/swapped/satphot-out/observer/*/keyword_checks.ecsv"):
    for row in table(path):
        checks[row["frame"], row["keyword"]] = row["standing"], row["reason"]
reasons = {}
for path in glob.glob(f"{folder}/swapped/satphot-out/observer/*/photometry.ecsv"):
    reasons.update({row["frame"]: row["reason"] for row in table(path) if row["verdict"] == "reject"})
expected = [("cdk_V_field01_00.fits", "FILTER", "deviates"), ("cdk_clear_field01_01.fits", "FILTER", "deviates"),
            ("cdk_V_flat_001.fits", "FILTER", "deviates"), ("cdk_R_flat_001.fits", "FILTER", "deviates"),
            ("cdk_iss_V_target_0005.fits", "FILTER", "not_checkable"), ("cdk_iss_R_target_0005.fits", "FILTER", "not_checkable"),
            ("cdk_R_field02_00.fits", "INSTRUME", "deviates"), ("refractor_R_field02_00.fits", "INSTRUME", "deviates"),
            ("cdk_starlink_V_target_0006.fits", "OBJECT", "deviates"), ("cdk_bluebird_V_target_0006.fits", "OBJECT", "deviates")]
for frame, keyword, standing in expected:
    found, reason = checks.get((frame, keyword), ("", reasons.get(frame, "")))
    noticed = found == standing or (standing == "deviates" and not found and reason)
    print(f"swapped {keyword} of {frame}: {found or 'set aside'}: {reason}")
    if not noticed:
        failures.append(f"swapped {keyword} of {frame}: {found}, not {standing}")


def cost(name):
    """CPU time [s] and peak memory [MB] of a run."""
    user, system, memory = [float(x) for x in open(f"{folder}/{name}/time.txt").read().split()[-3:]]
    return user + system, memory / 1024


for what, less, more, factor in (
    ("frames", "half", "night", len(glob.glob(f"{folder}/night/*.fits")) / len(glob.glob(f"{folder}/half/*.fits"))),
    ("satellites", "one_satellite", "half", 3.0),
    # where two filters measure a colour, target frames are measured twice
    ("filters", "one_filter", "half", 2 * 3.0),
):
    (time_1, memory_1), (time_2, memory_2) = cost(less), cost(more)
    print(f"{factor:.2f} times the {what}: CPU {time_1:.1f} to {time_2:.1f} s, memory {memory_1:.0f} to {memory_2:.0f} MB")
    if time_2 / time_1 > 1.3 * factor or memory_2 / memory_1 > 1.3 * factor:
        failures.append(f"time or memory grow faster than the {what}")
print("\n".join(failures) or "proved")
sys.exit(bool(failures))
PYTHON
