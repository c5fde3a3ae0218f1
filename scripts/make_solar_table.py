#!/usr/bin/env python3
"""Writes src/presets/spectra/astm_g173_03.csv from the table of ASTM G-173-03 (wavelength nm; extraterrestrial,
global, direct in W/m2/nm): numbers to five digits, no blanks, our own header.

    scripts/make_solar_table.py astm_g173_03.csv > src/presets/spectra/astm_g173_03.csv
"""
import csv
import sys

HEADER = """\
# Solar spectra of ASTM G-173-03 (Gueymard, Myers & Emery 2002, Solar Energy 73, 443; SMARTS 2.9.2), at 1 au:
# outside the atmosphere; at the ground on a sunward tilt of 37 deg, air mass 1.5: global; direct and circumsolar.
# W m^-2 nm^-1, 0 where below 1e-9. Written by scripts/make_solar_table.py.
wavelength_nm,extraterrestrial,global,direct"""


def number(text: str) -> str:
    """Five digits; below 1e-9 W/m2/nm it is night."""
    value = float(text)
    if value < 1e-9:
        return "0"
    short = f"{value:.5g}"
    return short[1:] if short.startswith("0.") else short


def main() -> None:
    with open(sys.argv[1], newline="") as table:
        rows = [row for row in csv.reader(table) if row and row[0].replace(".", "").isdigit()]
    print(HEADER)
    for wavelength, *columns in rows:
        print(",".join([f"{float(wavelength):g}", *map(number, columns)]))


if __name__ == "__main__":
    main()
