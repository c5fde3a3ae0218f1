#!/usr/bin/env python3
"""Reads satphot's ECSV tables with astropy and says what it found: a check by an independent reader.

Usage: check_ecsv.py FILE.ecsv...     (needs astropy; exit code 1 if a promise of the format is broken)
"""

import csv
import sys

import numpy as np
from astropy import units as u
from astropy.table import QTable, Table

# astropy strips blanks around texts; everything else must come back exactly.
# The ends of names that carry a unit, longest first.
UNITS = {
    "_mag_arcsec2": u.mag / u.arcsec**2,
    "_e_px": u.electron / u.pix,
    "_deg_s": u.deg / u.s,
    "_arcsec": None,
    "_deg": u.deg,
    "_px": u.pix,
    "_km": u.km,
    "_pct": u.percent,
    "_mag": u.mag,
    "_s": u.s,
    "_d": u.d,
    "_e": u.electron,
}


def check(path):
    table = Table.read(path, format="ascii.ecsv")
    problems = []
    with open(path, newline="", encoding="utf-8") as file:
        lines = [line for line in file if not line.startswith("#")]
    cells = list(csv.reader(lines))
    names, body = cells[0], cells[1:]
    if table.colnames != names or len(table) != len(body):
        problems.append(f"astropy sees {len(table.colnames)} columns, {len(table)} rows; the file has {len(names)}, {len(body)}")
    masked = 0
    for i, name in enumerate(names):
        column = table[name]
        mask = np.broadcast_to(np.ma.getmaskarray(column), (len(table),)) if len(table) else []
        for row, is_masked in enumerate(mask):
            cell = body[row][i]
            masked += bool(is_masked)
            if column.dtype.kind in "iuf" and bool(is_masked) != (cell == ""):
                problems.append(f"{name}, row {row + 1}: cell {cell!r}, masked {bool(is_masked)}")
            elif not is_masked and column.dtype.kind == "f" and float(cell) != column[row]:
                problems.append(f"{name}, row {row + 1}: {cell} read as {column[row]!r}")
            elif not is_masked and column.dtype.kind in "US" and column[row] != cell.strip():
                problems.append(f"{name}, row {row + 1}: {cell!r} read as {column[row]!r}")
        unit = next((unit for end, unit in UNITS.items() if name.endswith(end)), None)
        if column.dtype.kind == "f" and unit is not None and column.unit != unit:
            problems.append(f"{name}: unit {column.unit}, expected {unit}")
        if not column.description:
            problems.append(f"{name}: no description")
    quantities = QTable.read(path, format="ascii.ecsv")
    with_unit = sum(quantities[name].unit is not None for name in names if hasattr(quantities[name], "unit"))
    print(f"{path}: {len(table)} rows, {len(names)} columns, {with_unit} with units, {masked} cells masked")
    for key, value in table.meta.items():
        print(f"  {key}: {value!r}")
    for problem in problems[:20]:
        print(f"  PROBLEM {problem}")
    return not problems


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    sys.exit(0 if all([check(path) for path in sys.argv[1:]]) else 1)
