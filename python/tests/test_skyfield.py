"""Geometry against skyfield, which computes it from other code."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import ISS, SITE

import satphot

skyfield = pytest.importorskip("skyfield.api")


def test_altitude_azimuth_and_range_are_those_of_skyfield():
    timescale = skyfield.load.timescale(builtin=True)
    _, line1, line2 = ISS.splitlines()
    satellite = skyfield.EarthSatellite(line1, line2, "ISS", timescale)
    place = skyfield.wgs84.latlon(SITE[0], SITE[1], elevation_m=SITE[2])
    seconds = np.arange(0, 6 * 3600, 600)
    times = np.datetime64("2025-06-09T08:00:00") + seconds * np.timedelta64(1, "s")
    table = satphot.Model("iss").magnitudes(ISS, SITE, times)
    topocentric = (satellite - place).at(timescale.utc(2025, 6, 9, 8, 0, seconds))
    altitude, azimuth, distance = topocentric.altaz()
    # arcseconds: the two differ in the Earth's orientation
    np.testing.assert_allclose(table["alt_deg"], altitude.degrees, atol=0.003)
    turn = (table["az_deg"] - azimuth.degrees + 180) % 360 - 180
    assert np.abs(turn * np.cos(np.radians(table["alt_deg"]))).max() < 0.003
    np.testing.assert_allclose(table["range_km"], distance.km, atol=0.3)
