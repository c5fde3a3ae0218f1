#!/usr/bin/env python3
"""Apparent geocentric directions of the Sun and the Moon from JPL DE421, for tests/orbit/sky.rs.

    # needs the Python packages skyfield and skyfield-data
    python scripts/make_ephemeris_vectors.py > tests/orbit_de421.csv

1000 epochs, one every 1.461 days from 2024-01-01 UTC to the end of 2027. Each row: MJD (UTC), the unit vectors of Sun
and Moon along GCRS axes (light time, aberration and deflection of light applied; rounded to 1e-8 = 0.002 arcsec), and
the geometric distance of the Moon in km.
"""

from skyfield_data import get_skyfield_data_path
from skyfield.api import Loader

load = Loader(get_skyfield_data_path(), verbose=False)
eph = load("de421.bsp")
ts = load.timescale(builtin=True)
earth = eph["earth"]

print("# Apparent geocentric unit vectors, GCRS axes, JPL DE421 (scripts/make_ephemeris_vectors.py)")
print("mjd_utc_d,sun_x,sun_y,sun_z,moon_x,moon_y,moon_z,moon_km")
for i in range(1000):
    days = 1.461 * i
    t = ts.utc(2024, 1, 1 + days)
    row = [f"{60310 + days:.3f}"]
    for name in ("sun", "moon"):
        place = earth.at(t).observe(eph[name]).apparent()
        km = place.distance().km
        row += [f"{c / km:.8f}" for c in place.xyz.km]
    km = (eph["moon"] - earth).at(t).distance().km
    print(",".join(row + [f"{km:.1f}"]))
