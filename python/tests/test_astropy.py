"""Objects of astropy go in and come out."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import ISS, SITE

import satphot

pytest.importorskip("astropy")
from astropy import units as u  # noqa: E402
from astropy.coordinates import EarthLocation  # noqa: E402
from astropy.table import QTable, Table  # noqa: E402
from astropy.time import Time  # noqa: E402

TEXTS = ["2025-06-09T10:33:12.000", "2025-06-09T10:35:00.125"]


def test_times_and_places_give_the_numbers_of_plain_arguments():
    plain = satphot.Model("iss").magnitudes(ISS, SITE, TEXTS)
    place = EarthLocation.from_geodetic(SITE[1] * u.deg, SITE[0] * u.deg, SITE[2] * u.m)
    for scale in ("utc", "tai", "tt"):
        table = satphot.Model("iss").magnitudes(ISS, place, getattr(Time(TEXTS, scale="utc"), scale))
        assert isinstance(table, QTable)
        assert table["alt_deg"].unit == u.deg and table["model_v_mag"].unit == u.mag
        np.testing.assert_allclose(table["alt_deg"].to_value("deg"), plain["alt_deg"], atol=1e-7)
        np.testing.assert_allclose(table["range_km"].to_value("m"), 1e3 * plain["range_km"], atol=1e-2)
        assert abs((table["time"] - Time(TEXTS)).to_value("s")).max() < 1e-6


@pytest.mark.filterwarnings("ignore::satphot.SatphotWarning")
def test_a_leap_second_is_a_second():
    moments = Time(["2016-12-31T23:59:59", "2016-12-31T23:59:60", "2017-01-01T00:00:00"])
    old = ISS.replace("25159.07052714", "16360.07052714").replace("9996", "9990")
    model = satphot.Model("iss")
    table = model.magnitudes(old, SITE, moments)
    steps = np.diff(table["az_deg"].to_value("deg")) % 360
    assert steps[0] == pytest.approx(steps[1], rel=0.05)


def test_passes_and_windows():
    plain = satphot.passes(ISS, SITE, "2025-06-09", "2025-06-10")
    table = satphot.passes(ISS, SITE, Time("2025-06-09"), Time("2025-06-10"), min_alt_deg=(10 * 60) * u.arcmin)
    assert isinstance(table["rise"], Time) and len(table) == plain.n_rows > 0
    assert abs(table["rise"].unix - plain["rise"].astype("int64") / 1e9).max() < 1e-3
    assert list(table["illum"]) == list(plain["illum"])


def test_every_table_can_be_one_of_astropy(tmp_path):
    table = satphot.passes(ISS, SITE, "2025-06-09", "2025-06-10").to_astropy()
    path = tmp_path / "passes.ecsv"
    table.write(path)
    assert len(QTable.read(path)) == len(table)
    assert table["max_alt_deg"].info.description


def test_images_with_a_unit_keep_it():
    image = np.full((32, 32), 2.0) * u.electron
    table = satphot.sum_apertures(image, [16.0], [16.0], satphot.Circle(4.0), error=0.5 * u.electron)
    assert table["sum"].unit == u.electron
    assert table["sum"][0].value == pytest.approx(2 * np.pi * 16)
    rng = np.random.default_rng(1)
    background = satphot.background(rng.normal(10, 1, (128, 128)) * u.electron)
    assert background.global_level.unit == u.electron and background.level().unit == u.electron


def test_tables_of_stars(tmp_path):
    rng = np.random.default_rng(2)
    v_mag = rng.uniform(9, 14, 50)
    noise = rng.normal(0, 0.01, 50)
    table = Table({"inst_mag": v_mag - 23.4 + noise, "v_mag": v_mag, "name": [f"star {i}" for i in range(50)]})
    quantities = QTable(table)
    quantities["v_mag"] = v_mag * u.mag
    values = {satphot.fit_zeropoint(t, {"id": "name"}).zp_mag for t in (table, quantities)}
    assert len(values) == 1 and values.pop() == pytest.approx(-23.4, abs=0.01)


def test_wrong_units_are_refused():
    with pytest.raises(satphot.SatphotError, match="range_km"):
        satphot.limits(range_km=5 * u.s)
