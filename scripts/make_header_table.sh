#!/bin/sh
# The table of docs/headers.md: what satphot understands of real headers, next to what their programs mean.
# scripts/make_header_table.sh [satphot] [folder of headers] rewrites the part between the two marks.
set -eu
cd "$(dirname "$0")/.."
program=${1:-target/release/satphot}
headers=${2:-../shared/data/headers}
if [ ! -d "$headers" ]; then echo "skipped: $headers not present"; exit 0; fi
"$program" inspect --json "$headers" > target/headers.jsonl
python3 - <<'PY'
import json, os, re

MEANS = {
    "nina.txt": "N.I.N.A. 1.10. DATE-OBS: the computer's clock (UTC) when the exposure is requested; DATE-LOC one hour ahead. "
                "GAIN the setting, EGAIN e-/ADU. Colour camera, rows top down. OBJCTRA zeros: no mount.",
    "sharpcap.txt": "SharpCap 2019 through AstroImageJ. DATE-OBS: when the frame was grabbed, that is the end. TAN-SIP by "
                    "astrometry.net.",
    "sgp.txt": "Sequence Generator Pro 3.1. DATE-OBS: the driver's last exposure, start. EGAIN 3.99 (N.I.N.A.: 1.00 of the same "
               "camera at the same setting). Sexagesimal site. CTYPE and CRVAL of the target without any scale.",
    "sgp_fixed_wcs.txt": "The same with CD, CDELT and CROTA added by hand.",
    "maximdl.txt": "MaxIm DL 5.24 at iTelescope. DATE-OBS: start, UTC, whole seconds; JD the same. RA in hours. CALSTAT: bias, "
                   "dark and flat done; PEDESTAL is added to reach zero. DATE is the old format of DATE-OBS.",
    "apt.txt": "APT 3.54. DATE-OBS: start, whole seconds, also as HIERARCH CAMERA-DATE-OBS; JD is 5 s after the end. "
               "SNAPSHOT = 1: a single frame.",
    "seestar.txt": "ZWO Seestar S50. A live stack of 187 frames, EXPTIME that of one; DATE-OBS: \"image created\". Three colour "
                   "planes, TAN-SIP.",
    "dwarflab.txt": "Dwarf II. EXP in seconds, BINNING 2*2, RA and DEC zeros where unknown; DATE: when it was saved. Colour.",
    "pixinsight.txt": "PixInsight. A master of 238 images; every value a string; DATE-END computed. PV1_1, PV1_2 zeros mean "
                      "nothing; a spline next to the linear WCS.",
    "app.txt": "Astro Pixel Processor. An integration without any date.",
    "app2.txt": "Astro Pixel Processor. A master flat of 30 frames.",
    "wcs_m106.txt": "World coordinates alone: CD, CDELT and CROTA1, CROTA2 that differ by 0.0007 deg.",
}

def cell(text):
    return str(text).replace("|", "\\|").replace("\n", " ")

def time(i):
    t = i["time"]
    return f"{t['date_mid'][:-4]}Z ± {t['time_err_s']:g} s: {t['time_source']}" if t else "none"

def gain(i):
    g = i["gain"]
    words = [] if g["gain_setting"] is None else [f"setting {g['gain_setting']}"]
    if g["e_per_adu"] is not None:
        words.append(f"{g['e_per_adu']:.4g} e-/ADU ({g['e_per_adu_source']})")
    return ", ".join(words) or "none"

def place(i):
    words = []
    if i["site"]:
        words.append(f"site {i['site']['lat_deg']:.3f} {i['site']['lon_deg']:.3f}")
    if i["pointing"]:
        p = i["pointing"][0]
        words.append(f"RA {p['ra_deg']:.3f} Dec {p['dec_deg']:+.3f} ({p['source']})")
    return ", ".join(words) or "none"

def wcs(i):
    w = i["wcs"]
    scale = "" if w["scale_arcsec"] is None else f", {w['scale_arcsec']:.3f}″/px"
    return w["state"] + scale

def answer(i):
    short = lambda t: re.split(r": a stack|: a colour|; name your|; give the", t)[0]
    refused = "**refused**: " + "; ".join(short(r) for r in i["refused"]) if i["refused"] else "usable"
    warned = [re.split(r"; |: set |: measure |: compare ", w)[0] for w in i["warnings"]]
    return refused + ("" if not warned else ". Reported: " + "; ".join(warned))

rows = ["| header | what its program means | mid-exposure | exposure | gain | place | type, filter, binning | WCS | answer |",
        "|---|---|---|---|---|---|---|---|---|"]
for line in open("target/headers.jsonl"):
    i = json.loads(line)
    name = os.path.basename(i["file"])
    e = i["exptime_s"]
    exposure = f"{e['value']:g} s ({e['source']})" if e else "none"
    optics = f"{i['type']}, {i['filter']['value'] if i['filter'] else 'no filter'}, {i['binning']['value']}"
    cells = [f"`{name}`", MEANS.get(name, ""), time(i), exposure, gain(i), place(i), optics, wcs(i), answer(i)]
    rows.append("| " + " | ".join(cell(c) for c in cells) + " |")
path = "docs/headers.md"
text = open(path).read()
begin, end = "<!-- table: scripts/make_header_table.sh -->\n", "<!-- end of table -->"
before, rest = text.split(begin)
after = rest.split(end)[1]
open(path, "w").write(before + begin + "\n".join(rows) + "\n" + end + after)
print(f"{len(rows) - 2} headers in {path}")
PY
rm -f target/headers.jsonl
