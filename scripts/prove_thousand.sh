#!/usr/bin/env bash
# A night of 1000 frames, 5 % of them damaged in every way a file can be: scripts/prove_thousand.sh [TARGET_FRAMES=960]
# Flats, star frames and target frames are damaged before the run; some vanish, shrink or become folders while it runs; one
# has a name that is no UTF-8, one with TAB and newline. Every good frame must be measured, every damaged one be a row with
# its reason; exit code 0 (fewer failures than night.max_failed_frac), 3 with --strict; then `satphot verify --inputs`.
# SATPHOT=path of the program.
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
    --set pointings.frames=7 --set flats.n=12 --set target.n="$targets" --set target.offset_mag=-1.5 --set name=thousand
cd "$work/night"
python3 - "$targets" <<'PY'
import glob, gzip, json, os, random, struct, sys
random.seed(10)
targets = sorted(glob.glob("target_*.fits"))
others = sorted(glob.glob("flat_*.fits"))[1:3] + sorted(glob.glob("field*.fits"))[3:5]
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
def sparse(path, nx, ny):
    """A header and holes: an image larger than memory, which takes no room on the disk."""
    data = card(card(open(path, "rb").read(), "NAXIS1", nx), "NAXIS2", ny)
    start = pixels(data)
    open(path, "wb").write(data[:start])
    os.truncate(path, start + -(-nx * ny * 2 // 2880) * 2880)
def replaced(make):
    def way(path):
        os.remove(path)
        make(path)
    return way
def changed(change):
    def way(path):
        data = open(path, "rb").read()
        open(path, "wb").write(change(data))
    return way
def packed(path):
    stream = bytearray(gzip.compress(open(path, "rb").read()))
    stream[len(stream) // 2] ^= 0xFF
    os.remove(path)
    open(path + ".gz", "wb").write(stream)
    return path + ".gz"
def tile(path):
    """As one gzip tile whose stream is damaged in its middle."""
    data = open(path, "rb").read()
    start = pixels(data)
    cards = [data[k:k + 80] for k in range(0, start, 80)]
    value = lambda key: int(next(c for c in cards if c[:9].decode() == f"{key:<8}=")[10:30])
    nx, ny = value("NAXIS1"), value("NAXIS2")
    heap = bytearray(gzip.compress(data[start:start + 2 * nx * ny]))
    heap[len(heap) // 2] ^= 0xFF
    own = ["SIMPLE", "BITPIX", "NAXIS", "NAXIS1", "NAXIS2", "EXTEND", "END", ""]
    kept = [c for c in cards if c[:8].decode().strip() not in own]
    put = lambda key, v: f"{key:<8}= {v:>20}".ljust(80).encode()
    word = lambda key, v: f"{key:<8}= '{v:<8}'".ljust(80).encode()
    block = lambda cards: b"".join([*cards, b"END".ljust(80)]).ljust(-(-80 * (len(cards) + 1) // 2880) * 2880)
    numbers = {"BITPIX": 8, "NAXIS": 2, "NAXIS1": 8, "NAXIS2": 1, "PCOUNT": len(heap), "GCOUNT": 1, "TFIELDS": 1}
    image = {"ZBITPIX": 16, "ZNAXIS": 2, "ZNAXIS1": nx, "ZNAXIS2": ny, "ZTILE1": nx, "ZTILE2": ny}
    table = ([word("XTENSION", "BINTABLE")] + [put(k, v) for k, v in numbers.items()]
             + [word("TTYPE1", "COMPRESSED_DATA"), word("TFORM1", f"1PB({len(heap)})"), put("ZIMAGE", "T"), word("ZCMPTYPE", "GZIP_1")]
             + [put(k, v) for k, v in image.items()] + kept)
    body = struct.pack(">ii", len(heap), 0) + bytes(heap)
    primary = block([put("SIMPLE", "T"), put("BITPIX", 8), put("NAXIS", 0), put("EXTEND", "T")])
    os.remove(path)
    open(path + ".fz", "wb").write(primary + block(table) + body.ljust(-(-len(body) // 2880) * 2880, b"\0"))
    return path + ".fz"
BEFORE = {
    "cut in the middle": changed(lambda d: d[: len(d) // 2]),
    "empty": changed(lambda d: b""),
    "cut in the header": changed(lambda d: d[:1000]),
    "random bytes": changed(lambda d: random.randbytes(len(d))),
    "all zeros": changed(lambda d: bytes(len(d))),
    "no END": changed(lambda d: d.replace(b"END     ", b"FIN     ", 1)),
    "NAXIS1 lies": changed(lambda d: card(d, "NAXIS1", 4_000_000_000)),
    "NAXIS1 negative": changed(lambda d: card(d, "NAXIS1", -160)),
    "text instead of a picture": changed(lambda d: b"<html>404 not found</html>" + d[26:]),
    "larger than memory": lambda p: sparse(p, 30_000, 30_000),
    "gzip stream damaged": packed,
    "compressed tile damaged": tile,
    "link to nothing": replaced(lambda p: os.symlink("nowhere.fits", p)),
    "link to itself": replaced(lambda p: os.symlink(p, p)),
    "pipe that nobody writes to": replaced(os.mkfifo),
}
ONLY_TARGETS = {
    "gain not tabulated": changed(lambda d: card(d, "GAIN", 7777)),
    "exposure of zero": changed(lambda d: card(d, "EXPTIME", "0.0")),
}
n_bad = max(20, (len(targets) + 40) // 20)
late = random.sample(targets[-len(targets) // 5:], 3)  # read when the stage is well under way
during = dict(zip(["vanishes", "shrinks", "becomes a folder"], late))
chosen = random.sample([p for p in targets if p not in late], n_bad)
oddly = {os.fsdecode(b"target_\xff\xfe.fits"): chosen.pop(), "target_a\tb\nc.fits": chosen.pop()}
kinds = {**BEFORE, **ONLY_TARGETS}
for k, path in enumerate(chosen + others):
    way = list(kinds)[k % len(kinds)] if path in chosen else random.choice(list(BEFORE))
    ways[kinds[way](path) or path] = way
for name, path in oddly.items():
    os.rename(path, name)
gone = set(chosen) | set(oddly.values()) | set(during.values())
good = [p for p in targets if p not in gone]
ways.update({path: way for way, path in during.items()})
json.dump({"bad": ways, "good": good, "during": during}, open("../damage.json", "w"))
print(f"{len(targets)} target frames; {len(ways)} frames damaged in {len(set(ways.values()))} ways, {len(oddly)} named oddly")
PY
# the frames that vanish, shrink or become folders do so when the survey is over
"$SATPHOT" run --json --no-figures >"$work/out" 2>"$work/err" &
run=$!
python3 - "$work" <<'PY'
import json, os, sys, time
work = sys.argv[1]
during = json.load(open(f"{work}/damage.json"))["during"]
end = time.monotonic() + 600
while "target frames" not in open(f"{work}/err").read() + open(f"{work}/out").read() and time.monotonic() < end:
    time.sleep(0.01)
os.remove(during["vanishes"])
os.truncate(during["shrinks"], 20_000)
os.remove(during["becomes a folder"])
os.mkdir(during["becomes a folder"])
PY
code=0
wait $run || code=$?
echo "exit code $code"
python3 - "$work" <<'PY'
import collections, csv, json, sys
work = sys.argv[1]
told = json.load(open(f"{work}/damage.json"))
lines = [l for l in open("satphot-out/thousand/photometry.ecsv") if not l.startswith("#")]
rows = list(csv.DictReader(lines))
by_frame = collections.Counter(r["frame"] for r in rows)
row = {r["frame"]: r for r in rows}
ok = ("ok", "nondetection")
named = ["target_%FF%FE.fits", "target_a%09b%0Ac.fits"]
lost = [f for f in [*told["good"], *told["bad"], *named] if by_frame[f] != 1]
good_failed = [f for f in told["good"] + named if row.get(f, {}).get("status") not in ok]
bad_passed = [(f, w, row[f]["status"]) for f, w in told["bad"].items() if f in row and row[f]["status"] not in ("failed", "rejected")]
silent = [f for f in told["bad"] if f in row and not row[f]["reason"]]
reasons = {}
for f, w in told["bad"].items():
    reasons.setdefault(w, row[f]["reason"] if f in row else "no row")
for way, reason in reasons.items():
    print(f"  {way:<26} {reason[:110]}")
print(f"{len(told['good']) + len(named)} good, not measured: {len(good_failed)} {good_failed[:3]}")
print(f"{len(told['bad'])} damaged: without a row {lost[:3]}, measured all the same {bad_passed[:3]}, without a reason {len(silent)}")
sys.exit(bool(lost or good_failed or bad_passed or silent))
PY
[ $code = 0 ]
code=0
"$SATPHOT" run -q --no-figures --strict >/dev/null 2>&1 || code=$?
echo "with --strict: exit code $code"
[ $code = 3 ]
"$SATPHOT" verify --inputs satphot-out/thousand
