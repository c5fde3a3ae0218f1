#!/usr/bin/env python3
"""Write src/presets/ut1_tai.csv: UT1 - TAI every 20 days, for the rotation of the Earth.

    python3 scripts/make_ut1_table.py eopc04.1962-now finals2000A.all > src/presets/ut1_tai.csv

Both files are public: IERS EOP 20 C04 (https://hpiers.obspm.fr/eoppc/eop/eopc04/) and IERS Bulletin A
(https://datacenter.iers.org, finals2000A.all); the package astropy-iers-data of PyPI carries both. C04 is used as far as it
goes, then the measured values of Bulletin A (flag I), then its predictions of a year (flag P). On standard error: the
largest error of a straight line between two rows, against every day of the two files.
"""
import sys

STEP_D = 20
FIRST = 41317  # 1972-01-01, the first day of UTC with whole leap seconds

# TAI - UTC [s] from the MJD on: IERS Bulletin C.
LEAP = [
    (41317, 10), (41499, 11), (41683, 12), (42048, 13), (42413, 14), (42778, 15), (43144, 16), (43509, 17), (43874, 18),
    (44239, 19), (44786, 20), (45151, 21), (45516, 22), (46247, 23), (47161, 24), (47892, 25), (48257, 26), (48804, 27),
    (49169, 28), (49534, 29), (50083, 30), (50630, 31), (51179, 32), (53736, 33), (54832, 34), (56109, 35), (57204, 36),
    (57754, 37),
]


def tai_utc_s(mjd):
    return max((leap for leap in LEAP if leap[0] <= mjd), key=lambda leap: leap[0])[1]


def main():
    c04, bulletin_a = sys.argv[1:]
    days, kind = {}, {}
    with open(bulletin_a) as lines:
        for line in lines:
            text = line[58:68].strip()
            if text:
                mjd = round(float(line[7:15]))
                days[mjd], kind[mjd] = float(text), "A" if line[57] == "I" else "P"
    with open(c04) as lines:
        for line in lines:
            cells = line.split()
            if not line.startswith("#") and len(cells) > 7:
                mjd = round(float(cells[4]))
                days[mjd], kind[mjd] = float(cells[7]), "C"
    days = {mjd: utc - tai_utc_s(mjd) for mjd, utc in days.items() if mjd >= FIRST}
    last = max(days)
    rows = list(range(FIRST, last, STEP_D)) + [last]
    measured = max(mjd for mjd, k in kind.items() if k in "CA")
    worst = max(
        (abs(days[a] + (days[b] - days[a]) * (mjd - a) / (b - a) - days[mjd]), mjd)
        for a, b in zip(rows, rows[1:])
        for mjd in range(a, b)
        if mjd in days
    )
    print(f"a straight line is off by at most {1e3 * worst[0]:.2f} ms (MJD {worst[1]})", file=sys.stderr)
    c04_last = max(mjd for mjd, k in kind.items() if k == "C")
    print("# UT1 - TAI [s] at 0 h UTC; scripts/make_ut1_table.py")
    print(f"# IERS EOP 20 C04 to MJD {c04_last}, Bulletin A to MJD {measured}, its predictions to MJD {last}")
    print(f"# measured_to_mjd_d = {measured}")
    print("mjd_utc_d,ut1_tai_s")
    for mjd in rows:
        print(f"{mjd},{days[mjd]:.4f}")


main()
