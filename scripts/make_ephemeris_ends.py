#!/usr/bin/env python3
"""Geocentric directions of the Sun and the Moon from JPL DE405 at both ends of the years that satphot knows, for tests/orbit/sky.rs.

    # needs the Python packages jplephem and de405
    python3 scripts/make_ephemeris_ends.py > tests/orbit_de405_ends.csv

120 epochs from 1900 to 1904 and 120 from 2095 to 2099. Each row: MJD (TT), the unit vectors of Sun and Moon along the axes of
DE405 (ICRF to 0.001 arcsec) with light time and annual aberration to first order, and the geometric distance of the Moon in km.
"""
import de405
import numpy as np
from jplephem import Ephemeris

LIGHT_KM_D = 299792.458 * 86400.0
eph = Ephemeris(de405)
moon_share = 1.0 / (1.0 + eph.EMRAT)


def earth(jd):
    place = eph.position("earthmoon", jd) - moon_share * eph.position("moon", jd)
    return np.asarray(place).reshape(3)


def body(name, jd):
    place = eph.position("sun", jd) if name == "sun" else earth(jd) + np.asarray(eph.position("moon", jd)).reshape(3)
    return np.asarray(place).reshape(3)


def apparent(name, jd):
    """Where the body was when its light left, seen from the moving Earth: u + v/c."""
    here, light_d = earth(jd), 0.0
    for _ in range(4):
        line = body(name, jd - light_d) - here
        light_d = np.linalg.norm(line) / LIGHT_KM_D
    step = 0.05
    velocity_km_d = (earth(jd + step) - earth(jd - step)) / (2 * step)
    u = line / np.linalg.norm(line) + velocity_km_d / LIGHT_KM_D
    return u / np.linalg.norm(u)


print("# Apparent geocentric unit vectors, JPL DE405 (scripts/make_ephemeris_ends.py)")
print("mjd_tt_d,sun_x,sun_y,sun_z,moon_x,moon_y,moon_z,moon_km")
for first in (15025.0, 86300.0):
    for i in range(120):
        mjd = first + 14.61 * i
        jd = mjd + 2400000.5
        row = [f"{c:.8f}" for name in ("sun", "moon") for c in apparent(name, jd)]
        km = np.linalg.norm(eph.position("moon", jd))
        print(",".join([f"{mjd:.3f}"] + row + [f"{km:.1f}"]))
