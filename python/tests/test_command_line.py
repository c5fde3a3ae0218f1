"""The package and the program give the same numbers, to the last printed digit."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import ISS, ROOT, SITE, rows_of

import satphot

PLACE = ",".join(map(str, SITE))


def assert_same(table, rows, ignored=()):
    """Every column of the table that the program prints has the printed values."""
    assert table.n_rows == len(rows) > 0
    compared = [name for name in table if name in rows[0] and name not in ignored]
    for name in compared:
        for value, text in zip(table[name], (row[name] for row in rows), strict=True):
            if table[name].dtype.kind == "U":
                assert value == text, name
            elif text == "":
                assert np.isnan(value), name
            else:
                assert value == float(text), name
    return compared


@pytest.mark.parametrize("mode", ["corrected", "as_published"])
@pytest.mark.parametrize("band", ["V", "g"])
def test_magnitudes_are_those_of_predict_pass(program, elements, mode, band):
    printed = rows_of(
        program(
            "predict", "pass", "--elements", elements, "--site", PLACE, "--satellite", "iss", "--mode", mode, "--set", f"model.band={band}",
            "--start", "2025-06-09T10:00:00", "--hours", 3, "--step-s", 30, "--csv", "-q",
        )
    )  # fmt: skip
    model = satphot.Model("iss", mode=mode, band=band)
    table = model.magnitudes(elements, SITE, [row["date_mid"] for row in printed])
    compared = assert_same(table, printed)
    assert {"alt_deg", "model_v_mag", "sun_v_mag", "lunar_earthshine_v_mag", "mu_mean_mag_arcsec2", "illum"} <= set(compared)
    assert np.isfinite(table["model_v_mag"]).any()


def test_passes_are_those_of_the_program(program, elements):
    printed = rows_of(
        program("passes", "--elements", elements, "--site", PLACE, "--start", "2025-06-09T00:00:00", "--hours", 48, "--csv")
    )
    table = satphot.passes(elements, SITE, "2025-06-09T00:00:00", "2025-06-11T00:00:00")
    assert table.n_rows == len(printed) > 5
    for name in ("rise", "culmination", "set"):
        # the program rounds half up to a second
        seconds = (table[name] + np.timedelta64(500, "ms")).astype("datetime64[s]")
        assert [f"{second}Z" for second in seconds] == [row[f"{name}_utc"] for row in printed]
    for name in ("rise_az_deg", "max_alt_deg", "max_az_deg", "set_az_deg", "range_km", "sun_alt_deg", "moon_alt_deg"):
        assert [f"{value:.1f}" for value in table[name]] == [row[name] for row in printed], name
    for name in ("illum", "sky_class", "paper_label", "outside_window"):
        assert list(table[name]) == [row[name] for row in printed], name


@pytest.mark.parametrize("mode", ["corrected", "as_published"])
def test_a_map_of_the_sky_is_that_of_the_program(program, mode):
    printed = rows_of(
        program(
            "predict", "sky", "--satellite", "starlink-v1.5", "--site", PLACE, "--time", "2025-06-09T08:30:00", "--mode", mode,
            "--grid", "7x13", "--csv", "-q",
        )
    )  # fmt: skip
    table = satphot.sky(satphot.Model("starlink-v1.5", mode=mode), SITE, "2025-06-09T08:30:00", n_alt=7, n_az=13)
    compared = assert_same(table, printed)
    assert {"alt_deg", "az_deg", "model_v_mag", "flux_per_e0"} <= set(compared)
    assert np.isfinite(table["model_v_mag"]).any()


@pytest.mark.parametrize(
    "options, arguments",
    [
        ([], {}),
        (["--band", "V", "--mag", 12, "--subs", 4], {"band": "V", "mag": 12, "n_sub": 4}),
        (
            ["--band", "r", "--moon-phase-deg", 20, "--moon-alt-deg", 40, "--alt-deg", 60],
            {"band": "r", "moon_phase_deg": 20, "moon_alt_deg": 40, "alt_deg": 60},
        ),
        (["--sky-mag", 20.1, "--omega-arcsec2", 300], {"sky_mag_arcsec2": 20.1, "omega_arcsec2": 300}),
        (
            ["--fwhm-arcsec", 3, "--aper-r-arcsec", 4, "--zp-mag", 24, "--extinction-mag", 0.2],
            {"fwhm_arcsec": 3, "aper_r_arcsec": 4, "zp_mag": 24, "extinction_mag": 0.2},
        ),
        (["--set", "telescope.aperture_m=0.5"], {"settings": {"telescope.aperture_m": 0.5}}),
    ],
)
def test_limits_are_those_of_the_program(program, options, arguments):
    printed = rows_of(program("limits", "tracked", "--csv", "-q", *options))
    compared = assert_same(satphot.limits(**arguments), printed)
    assert {"limit_mag", "mu_limit_mag_arcsec2", "mag_exptime_s", "sky"} <= set(compared)


def test_a_zeropoint_is_that_of_the_program(program, tmp_path):
    tomllib = pytest.importorskip("tomllib")
    stars, out = ROOT / "examples" / "stars.csv", tmp_path / "zeropoint.toml"
    program("zeropoint", "--matched", stars, "-o", out, "-q")
    written = tomllib.loads(out.read_text())
    zeropoint = satphot.fit_zeropoint(stars)

    def numbers(value):
        """Every number of a file, wherever it stands."""
        if isinstance(value, dict):
            value = list(value.values())
        if isinstance(value, list):
            return [one for each in value for one in numbers(each)]
        return [float(value)] if isinstance(value, (int, float)) else []

    known = np.array(numbers(written))
    for value in (zeropoint.zp_mag, zeropoint.k_mag_airmass, zeropoint.c_mag_mag, zeropoint.rms_mag, zeropoint.n_used):
        assert np.isclose(known, value, rtol=0, atol=1e-9).any(), value
    for i in range(3):
        assert np.isclose(known, zeropoint.covariance[i, i], rtol=1e-9).any()


def test_a_night_has_the_tables_of_the_program(program, tmp_path):
    config = ROOT / "fixtures" / "night" / "pipeline.toml"
    program("run", "-c", config, "--set", f"night.output={tmp_path / 'program'}", "-q")
    night = satphot.Night(config, {"night.output": str(tmp_path / "package")}).run()
    folder = tmp_path / "program" / night.folder.name
    for name, table in (("photometry", night.photometry), ("stars", night.stars), ("residuals", night.residuals)):
        own, others = ((place / f"{name}.ecsv").read_text().splitlines() for place in (night.folder, folder))
        body = [line for line in others if not line.startswith("#")]
        assert [line for line in own if not line.startswith("#")] == body
        assert table.n_rows == len(body) - 1 > 0
        assert list(table) == body[0].replace(",", " ").split()
    assert np.isfinite(night.photometry["v_mag"]).sum() >= 20
    assert night.zeropoint.zp_mag == pytest.approx(-23.37, abs=0.05)
    assert "zeropoint" in night.summary.lower()


def test_several_satellites_are_rows_one_after_the_other(elements):
    other = ISS.replace("25544", "25545").replace("ISS (ZARYA)", "SECOND").replace("  9996", "  9997").replace("513748", "513749")
    times = np.array(["2025-06-09T10:30:00", "2025-06-09T10:33:12", "2025-06-09T10:36:00"], dtype="datetime64[s]")
    model = satphot.Model("iss")
    both = model.magnitudes([elements, other], SITE, times)
    alone = model.magnitudes(elements, SITE, times)
    assert both.meta["object_names"] == ["ISS (ZARYA)", "SECOND"]
    assert list(both["satellite"]) == [0, 0, 0, 1, 1, 1]
    for name, column in alone.items():
        np.testing.assert_array_equal(both[name][:3], column)
        if name not in ("satellite", "norad_cat_id"):
            np.testing.assert_array_equal(both[name][3:], column)


def test_the_number_of_threads_does_not_change_a_bit(elements):
    times = np.datetime64("2025-06-09T10:00:00") + np.arange(200) * np.timedelta64(17, "s")
    one, all_cores = (satphot.Model("iss-inferred").magnitudes(elements, SITE, times, threads=n) for n in (1, 0))
    for name in one:
        np.testing.assert_array_equal(one[name], all_cores[name])
