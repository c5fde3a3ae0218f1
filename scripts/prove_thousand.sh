#!/usr/bin/env bash
# A night of 1000 frames, 5 % of them damaged in ten ways: scripts/prove_thousand.sh [TARGET_FRAMES=960]
# Every good target frame must have a measured row, every damaged one a row with its reason; exit code 0 (fewer failures
# than night.max_failed_frac), 3 with --strict; then `satphot verify --inputs`. SATPHOT=path of the program.
set -euo pipefail
cd "$(dirname "$0")/.."
targets=${1:-960}
if [ -z "${SATPHOT:-}" ]; then
    cargo build --release --quiet
    SATPHOT=$PWD/target/release/satphot
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"$SATPHOT" simulate -q -o "$work/night" --set frame.nx_px=160 --set frame.ny_px=120 --set pointings.n=5 \
    --set pointings.frames=7 --set flats.n=5 --set target.n="$targets" --set target.offset_mag=-1.5 --set name=thousand
cd "$work/night"
python3 - "$targets" <<'PY'
import glob, json, random, sys
random.seed(10)
frames = sorted(glob.glob("target_*.fits"))
ways = {}
def card(data, key, value):
    for at in range(0, len(data), 80):
        if data[at:at + 8].decode("ascii", "replace").strip() == key:
            return data[:at] + (f"{key:<8}= {value:>20}".ljust(80)).encode() + data[at + 80:]
        if data[at:at + 8] == b"END     ":
            raise SystemExit(f"no {key}")
def pixels(data):
    at = next(a for a in range(0, len(data), 80) if data[a:a + 8] == b"END     ")
    return -(-(at + 80) // 2880) * 2880
WAYS = {
    "cut in the middle": lambda d: d[: len(d) // 2],
    "empty": lambda d: b"",
    "cut in the header": lambda d: d[:1000],
    "random bytes": lambda d: random.randbytes(len(d)),
    "all zeros": lambda d: bytes(len(d)),
    "no END": lambda d: d.replace(b"END     ", b"FIN     ", 1),
    "NAXIS1 lies": lambda d: card(d, "NAXIS1", 4_000_000_000),
    "gain not tabulated": lambda d: card(d, "GAIN", 7777),
    "exposure of zero": lambda d: card(d, "EXPTIME", "0.0"),
    "text instead of a picture": lambda d: b"<html>404 not found</html>" + d[26:],
}
n_bad = max(10, (len(frames) + 40) // 20)
for k, path in enumerate(random.sample(frames, n_bad)):
    way = list(WAYS)[k % 10]
    data = open(path, "rb").read()
    open(path, "wb").write(WAYS[way](data))
    ways[path] = way
json.dump({"bad": ways, "frames": frames}, open("../damage.json", "w"))
print(f"{len(frames)} target frames, {n_bad} damaged in {len(set(ways.values()))} ways")
PY
code=0
"$SATPHOT" run -q --no-figures >"$work/out" 2>"$work/err" || code=$?
echo "exit code $code"
python3 - "$work" <<'PY'
import collections, csv, json, sys
work = sys.argv[1]
told = json.load(open(f"{work}/damage.json"))
lines = [l for l in open("satphot-out/thousand/photometry.ecsv") if not l.startswith("#")]
rows = list(csv.DictReader(lines))
by_frame = collections.Counter(r["frame"] for r in rows)
row = {r["frame"]: r for r in rows}
lost = [f for f in told["frames"] if by_frame[f] != 1]
good_failed = [f for f in told["frames"] if f not in told["bad"] and row.get(f, {}).get("status") not in ("ok", "nondetection")]
bad_passed = [(f, w, row[f]["status"]) for f, w in told["bad"].items() if f in row and row[f]["status"] not in ("failed", "rejected")]
silent = [f for f in told["bad"] if f in row and not row[f]["reason"]]
reasons = {}
for f, w in told["bad"].items():
    reasons.setdefault(w, row[f]["reason"] if f in row else "no row")
for way, reason in reasons.items():
    print(f"  {way:<26} {reason[:110]}")
print(f"{len(told['frames']) - len(told['bad'])} good, not measured: {len(good_failed)} {good_failed[:3]}")
print(f"{len(told['bad'])} damaged: without a row {len(lost)}, measured all the same {bad_passed[:3]}, without a reason {len(silent)}")
sys.exit(bool(lost or good_failed or bad_passed or silent))
PY
[ $code = 0 ]
code=0
"$SATPHOT" run -q --no-figures --strict >/dev/null 2>&1 || code=$?
echo "with --strict: exit code $code"
[ $code = 3 ]
"$SATPHOT" verify --inputs satphot-out/thousand
