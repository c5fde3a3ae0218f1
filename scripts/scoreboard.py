#!/usr/bin/env python3
"""The scoreboard of docs/model_against_observations.md: models against observations that they were not fitted to.

Usage: scoreboard.py DATA [--program satphot] [--only TEXT] [--published]

DATA is the folder with observations/, orbits/ and, beside it, reference/. Each set is cut into parts: satellites, passes, or
contiguous rows. A model is fitted with `satphot fit` to all parts but one and compared with that one by `satphot compare`; a model of
the catalogue is only compared. Prints tables in Markdown: of the residuals (observed less modelled) mean, standard deviation, 1.4826 MAD
about the median, the correlation R of observed and modelled magnitudes, and the share within the predictive error (and that of the
magnitude itself) with its 95 % interval, from passes drawn anew. Only rows in full sunlight are judged: in the last degrees before the shadow a magnitude is of the
atmosphere and of the time. With --published, the table of published means. Needs Python alone.
"""

import argparse
import csv
import math
import random
import re
import subprocess
import sys
import tempfile
from pathlib import Path
from statistics import correlation, fmean, median, pstdev

EARTH_KM = 6371.0
GAP_S = 1200.0
DRAWS = 1000

LAWS = [
    ("constant + 5 lg R", ["--degree", "0"]),
    ("phase angle, degree 2", ["--degree", "2"]),
    ("phase angle, degree 3", ["--degree", "3"]),
    ("phase angle, 3, and Sun's altitude, 2", ["--degree", "3", "--sun-degree", "2"]),
]


def rows_of(path):
    with open(path, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))


def write(path, rows):
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)


def blocks(n, k):
    """Part of each of n rows, k contiguous parts of equal length."""
    return [i * k // n for i in range(n)]


# sunlit wherever the Sun is not hidden
UNIT = '[[satellites]]\nname = "unit"\nempirical = { kind = "polynomial", mag_1000km = [0.0], phase_deg = [0.0, 180.0] }\n'


class Set:
    """Rows in satphot's columns, the part and the pass of each, and what commands about them need."""

    def __init__(self, title, rows, parts, passes, surfaces, listed, more=(), compare=()):
        self.title, self.rows, self.parts, self.passes = title, rows, parts, passes
        self.surfaces, self.listed, self.more, self.compare = surfaces, listed, list(more), list(compare)


def height_km(row):
    """Of a row of SCORE, over a sphere."""
    d, alt = float(row["range_to_sat_km_satchecker"]), math.radians(float(row["alt_deg_satchecker"]))
    return math.sqrt(EARTH_KM**2 + d * d + 2 * EARTH_KM * d * math.sin(alt)) - EARTH_KM


def score(data):
    """Starlink V2 mini of 450 to 600 km, by satellite."""
    rows = [row for row in rows_of(data / "observations/v2mini_score_public.csv") if 450 < height_km(row) < 600]
    satellites = sorted({row["norad_cat_id"] for row in rows})
    part = {n: i * 5 // len(satellites) for i, n in enumerate(satellites)}
    # a pass: a satellite in an hour
    passes = [row["norad_cat_id"] + row["observation_time_utc"][:13] for row in rows]
    return Set(
        "SCORE, Starlink V2 mini at 450 to 600 km (V; parts: satellites)",
        rows,
        [part[row["norad_cat_id"]] for row in rows],
        passes,
        ["starlink-v2", "starlink-v2-film"],
        ["starlink-v2", "starlink-v2-film", "starlink-v2-observed", "starlink-v2-mini-phase", "starlink-v2-mini-phase-sun"],
    )


def slingshot(data):
    """Starlink V2 by night; no times: contiguous rows."""
    rows = [
        {
            "sun_alt_deg": r["sun_alt_deg"],
            "sun_az_deg": r["az_diff_deg"],
            "alt_deg": r["sat_alt_deg"],
            "az_deg": "0",
            "height_km": r["sat_height_km"],
            "v_mag": r["obs_mag"],
        }
        for r in rows_of(data / "observations/starlink_v2_slingshot.csv")
    ]
    parts = blocks(len(rows), 8)
    return Set(
        "Slingshot, Starlink V2 (AB; parts: contiguous rows)",
        rows,
        parts,
        blocks(len(rows), 32),
        ["starlink-v2", "starlink-v2-film"],
        ["starlink-v2", "starlink-v2-film", "starlink-v2-observed", "starlink-v2-mini-phase", "starlink-v2-mini-phase-sun"],
    )


def pomenis(data):
    """Starlink V1.5 by night."""
    all_rows = rows_of(data.parent / "reference/pomenis_starlink_2022.csv")
    rows = [
        {
            "time": r["utc"],
            "alt_deg": r["sat_alt_deg"],
            "az_deg": r["sat_az_deg"],
            "height_km": r["sat_height_km"],
            "v_mag": r["ab_mag"],
        }
        for r in all_rows
    ]
    rows.sort(key=lambda r: r["time"])
    nights = sorted({r["time"][:10] for r in rows})
    part = {night: i * 5 // len(nights) for i, night in enumerate(nights)}
    return Set(
        "Pomenis, Starlink V1.5 (AB; parts: nights)",
        rows,
        [part[r["time"][:10]] for r in rows],
        [r["time"][:16] for r in rows],
        ["starlink-v1.5"],
        ["starlink-v1.5"],
        ["--site", "32.4434,-110.7881,2510"],
    )


def daytime(data, kind, surfaces):
    """Starlink by day, one pass a part."""
    rows = [r for r in rows_of(data / "observations/daytime_public.csv") if r["kind"] == kind and r["ok"] == "1"]
    kept = [
        {
            "time": r["utc"],
            "norad_cat_id": r["norad"],
            "alt_deg": r["alt_deg"],
            "az_deg": r["az_deg"],
            "height_km": r["sat_height_km"],
            "v_mag": r["obs_mag"],
        }
        for r in rows
    ]
    names = sorted({r["norad"] for r in rows})
    # each pass is cut in blocks for the bootstrap: no pass holds for all
    passes = [f"{r['norad']}-{i // 10}" for i, r in enumerate(rows)]
    return Set(
        f"By day, Starlink {kind} (r', AB; parts: passes)",
        kept,
        [names.index(r["norad"]) for r in rows],
        passes,
        surfaces,
        surfaces,
        ["--site", "-33.7703,151.1112,70"],
        ["--set", "model.band=r"],
    )


class Runner:
    def __init__(self, program, folder):
        self.program, self.folder = program, Path(folder)

    def run(self, *arguments):
        command = [self.program, *map(str, arguments)]
        return subprocess.run(command, cwd=self.folder, capture_output=True, text=True, check=False)

    def fit(self, table, options, more):
        """An entry fitted to a table; else why not."""
        (self.folder / "own.toml").unlink(missing_ok=True)
        done = self.run("fit", table, "--name", "own", "-o", "own.toml", "-q", *options, *more)
        if done.returncode:
            return done.stderr.strip().splitlines()[0].removeprefix("error: ").removeprefix("model: it cannot be fitted: ")
        if "0" in options and "--degree" in options and "--sun-degree" not in options:
            # a constant is one at all phase angles
            own = self.folder / "own.toml"
            head, fit = own.read_text().split("[satellites.fit]")
            own.write_text(re.sub(r"phase_deg = .*", "phase_deg = [0.0, 180.0]", head) + "[satellites.fit]" + fit)
        return None

    def compare(self, table, model, more):
        done = self.run("compare", table, "-o", "compared.csv", "-q", *model, *more)
        if done.returncode:
            raise SystemExit(f"{' '.join(model)}: {done.stderr}")
        return rows_of(self.folder / "compared.csv")


def number(row, key):
    return float(row[key]) if row.get(key) else math.nan


def statistics(judged, passes, modelled):
    """Of (observed, residual, predictive error) with the pass of each."""
    residuals = [r for _, r, _ in judged]
    if len(residuals) < 3:
        return None
    centre = median(residuals)
    observed = [o for o, _, _ in judged]
    flat = max(modelled) - min(modelled) < 1e-9
    found = {
        "n": len(residuals),
        "mean": fmean(residuals),
        "std": pstdev(residuals),
        "robust": 1.4826 * median(abs(r - centre) for r in residuals),
        "r": math.nan if flat else correlation(observed, modelled),
    }
    by_pass = {}
    for (_, residual, err), of in zip(judged, passes):
        if math.isfinite(err):
            hits, n = by_pass.get(of, (0, 0))
            by_pass[of] = (hits + (abs(residual) <= err), n + 1)
    if by_pass:
        counts = list(by_pass.values())
        found["covered"] = sum(h for h, _ in counts) / sum(n for _, n in counts)
        draw = random.Random(1)
        shares = []
        for _ in range(DRAWS):
            drawn = draw.choices(counts, k=len(counts))
            shares.append(sum(h for h, _ in drawn) / sum(n for _, n in drawn))
        shares.sort()
        found["interval"] = shares[int(0.025 * DRAWS)], shares[int(0.975 * DRAWS)]
    return found


def line(name, found, n_all):
    if found is None:
        return f"| {name} | 0 of {n_all} | | | | | |"
    covered = ""
    if "covered" in found:
        low, high = found["interval"]
        covered = f"{100 * found['covered']:.0f} % ({100 * low:.0f}-{100 * high:.0f})"
    r = f"{found['r']:.2f}" if math.isfinite(found["r"]) else ""
    return (
        f"| {name} | {found['n']} of {n_all} | {found['mean']:+.2f} | {found['std']:.2f} | {found['robust']:.2f} | {r} | {covered} |"
    )


HEAD = "| model | rows | mean | std | robust | R | within the error (95 %) |\n|---|---|---|---|---|---|---|"


def board(of, runner):
    """The table of a set."""
    print(f"\n### {of.title}\n")
    part_numbers = sorted(set(of.parts))
    write(runner.folder / "all.csv", of.rows)
    (runner.folder / "unit.toml").write_text(UNIT)
    unit = runner.compare("all.csv", ["--satellites", "unit.toml", "--satellite", "unit"], of.more)
    sunlit = [row["illum"] == "sun" for row in unit]
    if not all(sunlit):
        print(f"{len(sunlit) - sum(sunlit)} rows are not in full sunlight and not judged.\n")
    print(HEAD)
    lit = None

    def print_line(name, compared):
        judged, passes, modelled, lit_of = [], [], [], []
        for i, row in compared:
            residual = number(row, "residual_mag")
            if sunlit[i] and math.isfinite(residual) and row.get("verdict") != "reject":
                observed = residual + number(row, "model_v_mag")
                own_err = number(row, "v_mag_err")
                err = math.hypot(number(row, "v_pred_err_mag"), own_err if math.isfinite(own_err) else 0.0)
                judged.append((observed, residual, err))
                passes.append(of.passes[i])
                modelled.append(number(row, "model_v_mag"))
                lit_of.append(bool(lit and lit[i]))
        print(line(name, statistics(judged, passes, modelled), sum(sunlit)))
        if any(lit_of) and not all(lit_of):
            for word, wanted in [("array lit", True), ("not lit", False)]:
                chosen = [k for k, is_lit in enumerate(lit_of) if is_lit == wanted]
                pick = lambda values: [values[k] for k in chosen]
                found = statistics(pick(judged), pick(passes), pick(modelled))
                print(line(f"&nbsp;&nbsp;{word}", found, sum(x == wanted and s for x, s in zip(lit, sunlit))))

    for name in of.listed:
        rows = runner.compare("all.csv", ["--satellite", name], of.more + of.compare)
        if lit is None and any(row.get("lit_array_cos") for row in rows):
            lit = [number(row, "lit_array_cos") > 0 for row in rows]
        print_line(f"`{name}`, as listed", list(enumerate(rows)))
    fits = [(name, options) for name, options in LAWS]
    fits += [(f"`{name}`, areas fitted", ["--satellite", name]) for name in of.surfaces]
    for name, options in fits:
        compared, refused = [], None
        for part in part_numbers:
            inside = [i for i, p in enumerate(of.parts) if p == part]
            write(runner.folder / "kept.csv", [r for r, p in zip(of.rows, of.parts) if p != part])
            write(runner.folder / "left.csv", [of.rows[i] for i in inside])
            refused = runner.fit("kept.csv", options, of.more)
            if refused:
                break
            model = ["--satellites", "own.toml", "--satellite", "own"]
            compared += list(zip(inside, runner.compare("left.csv", model, of.more)))
        if refused:
            print(f"| {name} | refused: {refused} | | | | | |")
        else:
            print_line(f"{name}", compared)
        sys.stdout.flush()


def published(data, runner, table):
    """Published means beside the entries that stand for them, each in its own geometry as far as it is known."""
    place = {"sun_alt_deg": "-18", "sun_az_deg": "0", "alt_deg": "90", "az_deg": "0", "height_km": "550"}
    scored = {"score450": [], "score_low": []}
    for row in rows_of(data / "observations/v2mini_score_public.csv"):
        height = height_km(row)
        if 450 < height < 600:
            scored["score450"].append(row)
        elif height < 450 and row["observation_time_utc"] >= "2024-07":
            scored["score_low"].append(row)

    def mag_1000km(entry, geometry):
        if geometry in scored:
            write(runner.folder / "all.csv", scored[geometry])
            rows = runner.compare("all.csv", ["--satellite", entry], [])
            rows = [row for row in rows if row["illum"] == "sun" and row["model_v_mag"]]
            return fmean(number(row, "model_v_mag") - 5 * math.log10(number(row, "range_km") / 1000) for row in rows)
        write(runner.folder / "place.csv", [place])
        done = runner.run("predict", "table", "place.csv", "--satellite", entry, "-q")
        if done.returncode:
            raise SystemExit(f"{entry}: {done.stderr}")
        row = next(csv.DictReader(line for line in done.stdout.splitlines() if not line.startswith("#")))
        return number(row, "model_v_mag") - 5 * math.log10(0.55)

    print("| design | campaign | published | entry | its magnitude | difference |\n|---|---|---|---|---|---|")
    far = 0
    for row in rows_of(table):
        own = mag_1000km(row["entry"], row["geometry"])
        own += 0 if row["statistic"] == "m1000" else 5 * math.log10(0.55)
        difference = own - float(row["published_mag"])
        far += abs(difference) > 0.2
        words = {"m1000": "", "m550": " at 550 km", "overhead": " overhead"}[row["statistic"]]
        err = f" ± {row['err_mag']}" if row["err_mag"] else ""
        bold = "**" if abs(difference) > 0.2 else ""
        print(
            f"| {row['design']} | {row['campaign']} | {row['published_mag']}{err}{words} | `{row['entry']}` "
            f"| {own:.2f} | {bold}{difference:+.2f}{bold} |"
        )
    print(f"\n{far} of them differ by more than 0.2 mag (bold).")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path)
    parser.add_argument("--program", default="satphot")
    parser.add_argument("--only", help="sets whose title has this text")
    parser.add_argument("--published", action="store_true", help="only the published means")
    arguments = parser.parse_args()
    data = arguments.data.resolve()
    sets = [
        score(data),
        slingshot(data),
        pomenis(data),
        daytime(data, "V1.5", ["starlink-v1.5"]),
        daytime(data, "V2", ["starlink-v2", "starlink-v2-film"]),
    ]
    with tempfile.TemporaryDirectory() as folder:
        runner = Runner(arguments.program, folder)
        if arguments.published:
            published(data, runner, Path(__file__).resolve().parent.parent / "tests/data/published_magnitudes.csv")
            return
        for of in sets:
            if not arguments.only or arguments.only in of.title:
                board(of, runner)


if __name__ == "__main__":
    main()
