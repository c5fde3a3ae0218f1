#!/usr/bin/env bash
# Every reader at inputs of 1, 2, 4 and 8 MB made to be slow: scripts/prove_budget.sh [SATPHOT [READER ...]]
# Fails where the time grows faster than the input, or the memory beyond a multiple of it. A few minutes.
set -euo pipefail
cd "$(dirname "$0")/.."
satphot=$(realpath "${1:-target/release/satphot}")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
python3 - "$satphot" "${@:2}" <<'PYTHON'
import os, subprocess, sys, threading, time

satphot = sys.argv[1]
SIZES = [1, 2, 4, 8]  # MB
SLOWEST_S, GROWTH, MOST_KB_PER_MB, BASE_KB = 60.0, 3.0, 60_000, 150_000

def card(key, value):
    return f"{key:<8}= {value:>20}".ljust(80)

def fits(*cards):
    head = [card("SIMPLE", "T"), card("BITPIX", 16), card("NAXIS", 2), card("NAXIS1", 20), card("NAXIS2", 20)]
    text = "".join(head + [c.ljust(80)[:80] for c in cards] + ["END".ljust(80)])
    return text.ljust(-(-len(text) // 2880) * 2880).encode() + bytes(2880)

def checked(line):
    return line + str(sum(int(c) if c.isdigit() else c == "-" for c in line) % 10)

def tle(day, tilt):
    return (checked(f"1 25544U 98067A   25{day:012.8f}  .00010000  00000-0  18000-3 0  999") + "\n"
            + checked(f"2 25544 {tilt:8.4f} 100.0000 0005000  80.0000 280.0000 15.50000000 1234") + "\n")

def votable(fields, data):
    return (f'<?xml version="1.0"?><VOTABLE><RESOURCE><TABLE>{fields}<DATA>{data}</DATA></TABLE></RESOURCE></VOTABLE>')

FIELDS = "".join(f'<FIELD name="{n}" datatype="double"/>' for n in ("RAJ2000", "DEJ2000", "Vmag"))
BODY = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
SATELLITE = """name = "own"
title = "own"
components = [{ name = "bus", material = "grey", at_m = [0, 0, 0], shape = { mesh = { file = "a.obj", scale_m = 1.0, sheet = true } } }]
[materials.grey]
brdf = { kind = "lambert", albedo = 0.3 }
"""
fill = lambda piece, mb: piece * int(mb * 1e6 / len(piece))
PASSES = ["passes", "--elements", "a.tle", "--site", "10,10,0", "--start", "2025-06-10", "--hours", "1"]
OMM = ["passes", "--elements", "a.json", "--site", "10,10,0", "--start", "2025-06-10", "--hours", "1"]
STARS = lambda name: ["solve", "--catalogue", name, "--ra", "1", "--dec", "1", "--scale", "1", "none.fits"]
RENDER = ["render", "own.toml", "--elements", "one.tle", "--site", "10,10,0", "--time", "2025-06-10T13:37:02",
          "--pixels", "8", "--samples", "1", "--rays", "1", "-o", "picture.png"]
CSV = "RAJ2000,DEJ2000,Vmag"
CASES = {  # reader: file, its text at a size [MB], the verb that reads it
    "header, CONTINUE": ("a.fits", lambda mb: fits("LONG    = 'a&' / c", *["CONTINUE  'b&' / " + "word " * 9] * int(mb * 12500)),
                         ["inspect", "a.fits"]),
    "header, HIERARCH": ("a.fits", lambda mb: fits(*[f"HIERARCH A{i} = {i} / c" for i in range(int(mb * 12500))]),
                         ["inspect", "a.fits"]),
    "elements, name": ("a.tle", lambda mb: fill("N", mb) + "\n" + tle(161.5, 51.64), PASSES),
    "elements, planes": ("a.tle", lambda mb: "".join(tle(161 + i * 1e-5, 51.64 if i % 2 else 80) for i in range(int(mb * 7100))), PASSES),
    "elements, names": ("a.tle", lambda mb: fill("A NAME\n", mb), PASSES),
    "elements, OMM": ("a.json", lambda mb: "[" + fill("{},", mb) + "{}]", OMM),
    "VOTable, no bytes": ("a.vot", lambda mb: votable('<FIELD name="RAJ2000" datatype="char" arraysize="0"/>',
                          '<BINARY><STREAM encoding="base64">' + fill("AAAA", mb) + "</STREAM></BINARY>"), STARS("a.vot")),
    "VOTable, attributes": ("a.vot", lambda mb: votable("<FIELD " + " ".join(f'a{i}="1"' for i in range(int(mb * 80000))) + "/>", ""), STARS("a.vot")),
    "VOTable, fields": ("a.vot", lambda mb: votable("".join(f'<COOSYS ID="c{i}"/><FIELD name="f{i}" ref="c0"/>' for i in range(int(mb * 20000))), ""), STARS("a.vot")),
    "VOTable, empty rows": ("a.vot", lambda mb: votable(FIELDS, "<TABLEDATA>" + fill("<TR/>", mb) + "</TABLEDATA>"), STARS("a.vot")),
    "catalogue, rows": ("a.csv", lambda mb: CSV + "\n" + "".join(f"{i % 360},{i % 89},9.5\n" for i in range(int(mb * 75000))), STARS("a.csv")),
    "catalogue, one place": ("a.csv", lambda mb: CSV + "\n" + fill("1.0,1.0,9.5\n", mb), STARS("a.csv")),
    "catalogue, columns": ("a.csv", lambda mb: ",".join(f"c{i}" for i in range(int(mb * 120000))) + "\n", STARS("a.csv")),
    "catalogue, remarks": ("a.csv", lambda mb: fill("#Column\tVmag\t[ucd=phot.mag]\n", mb) + CSV + "\n1,1,9\n", STARS("a.csv")),
    "configuration, keys": ("a.toml", lambda mb: "[night]\n" + "".join(f"k{i} = 1\n" for i in range(int(mb * 90000))),
                            ["run", "a.toml", "--dry-run"]),
    "configuration, nesting": ("a.toml", lambda mb: "a = " + fill("[", mb), ["run", "a.toml", "--dry-run"]),
    "mesh, fan": ("a.obj", lambda mb: BODY + "f 1 " + fill("2 3 ", mb) + "\n", RENDER),
    "elements, KVN": ("a.kvn", lambda mb: fill("EPOCH = 1\n", mb), PASSES[:2] + ["a.kvn"] + PASSES[3:]),
    "elements, OMM in CSV": ("a.omm", lambda mb: "NORAD_CAT_ID,EPOCH\n" + fill("1,2\n", mb), PASSES[:2] + ["a.omm"] + PASSES[3:]),
    "elements, OMM in XML": ("a.xml", lambda mb: "<ndm>" + fill("<omm><EPOCH>1</EPOCH></omm>", mb) + "</ndm>",
                             PASSES[:2] + ["a.xml"] + PASSES[3:]),
    "own table, meta": ("a.ecsv", lambda mb: "# %ECSV 1.0\n# ---\n# meta:\n" + "".join(f"#   k{i}: 1\n" for i in range(int(mb * 80000))),
                        ["export", "a.ecsv", "--to", "csv", "-o", "-"]),
    "own table, columns": ("a.ecsv", lambda mb: "# %ECSV 1.0\n# ---\n# datatype:\n" +
                           "".join(f"# - {{name: c{i}, datatype: string}}\n" for i in range(int(mb * 25000))) + "a b\n",
                           ["export", "a.ecsv", "--to", "csv", "-o", "-"]),
    "SCORE, rows": ("a.csv", lambda mb: fill("1,2,3,4\n", mb), ["export", "--check", "a.csv"]),
    "matched stars": ("a.csv", lambda mb: "v_mag,inst_mag,airmass,b_v,pointing\n" + "".join(
                      f"{9 + i % 7 * .1:.2f},{-10 + i % 7 * .1:.2f},{1 + i % 9 * .1:.2f},0.{i % 9},p{i % 50}\n" for i in range(int(mb * 33000))),
                      ["zeropoint", "--matched", "a.csv"]),
    "matched stars, pointings": ("a.csv", lambda mb: "v_mag,inst_mag,airmass,b_v,star,pointing\n" + "".join(
                      f"{9 + i % 7 * .1:.2f},{-10 + i % 7 * .1:.2f},{1 + i % 9 * .1:.2f},0.{i % 9},s{i // 2},p{i}\n" for i in range(int(mb * 27000))),
                      ["zeropoint", "--matched", "a.csv"]),
    "scattering, rows": ("a.txt", lambda mb: "phi_i theta_i phi_o theta_o brdf\n" + fill("30 0 20 180 0.1\n", mb), ["brdf", "fit", "a.txt", "--law", "lambert"]),
    "plan": ("a.json", lambda mb: "{" + ",".join(f'"k{i}":[]' for i in range(int(mb * 70000))) + "}", ["verify", "a.json"]),
    "geometry, columns": ("a.csv", lambda mb: ",".join(f"c{i}" for i in range(int(mb * 120000))) + "\n", ["predict", "geometry", "a.csv"]),
    "band": ("a.csv", lambda mb: "".join(f"{300 + i * 1e-3:.42f},1\n" for i in range(int(mb * 20000))), RENDER[:1] + ["iss"] + RENDER[2:-2] + ["--band", "a.csv"] + RENDER[-2:]),
    "mesh, one place": ("a.obj", lambda mb: BODY + fill("v 1 1 1\n", mb), RENDER),
}
ONLY = sys.argv[2:] or [""]
open("one.tle", "w").write(tle(161.5, 51.64))
open("own.toml", "w").write(SATELLITE)
failed = 0
for name, (file, make, arguments) in CASES.items():
    if not name.startswith(tuple(ONLY)):
        continue
    took, memory, why = [], [], ""
    for mb in SIZES:
        text = make(mb)
        open(file, "wb").write(text if isinstance(text, bytes) else text.encode())
        best = SLOWEST_S
        for _ in range(2 if mb > 1 else 3):
            start = time.monotonic()
            child = subprocess.Popen([satphot, *arguments], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            timer = threading.Timer(SLOWEST_S, child.kill)
            timer.start()
            _, status, usage = os.wait4(child.pid, 0)
            timer.cancel()
            best = min(best, usage.ru_utime + usage.ru_stime)
            if os.WIFSIGNALED(status) or os.WEXITSTATUS(status) in (1, 101):
                why = f"ended by {status} at {mb} MB"
            if best > 5:
                break
        took.append(best)
        memory.append(usage.ru_maxrss)
        if why:
            break
    # doubling the input doubles the time; what lies below 0.1 s is the start of the program
    if not why and any(b > GROWTH * max(a, 0.1) for a, b in zip(took, took[1:])):
        why = "grows faster than its input"
    if not why and any(kb > BASE_KB + MOST_KB_PER_MB * mb for kb, mb in zip(memory, SIZES)):
        why = "takes too much memory"
    failed += bool(why)
    print(f"{name:<24}", " ".join(f"{t:6.2f} s" for t in took), f"{max(memory) / 1e3:6.0f} MB", why or "ok", flush=True)
sys.exit(1 if failed else 0)
PYTHON
