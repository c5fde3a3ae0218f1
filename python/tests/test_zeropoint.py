"""Zeropoints: a true one is found, whatever holds the table."""

from __future__ import annotations

import numpy as np
import pytest

import satphot


def stars(n=80):
    """Stars of ZP -23.4, k 0.12, C 0.08."""
    rng = np.random.default_rng(11)
    v_mag, b_v_mag, airmass = rng.uniform(9, 14, n), rng.uniform(0.2, 1.1, n), rng.uniform(1.0, 1.9, n)
    inst_mag = v_mag - 23.4 + 0.12 * airmass + 0.08 * b_v_mag + rng.normal(0, 0.01, n)
    inst_mag[::17] += 1.0  # outliers
    return {"inst_mag": inst_mag, "inst_mag_err": np.full(n, 0.01), "v_mag": v_mag, "b_v_mag": b_v_mag, "airmass": airmass}


def test_a_true_zeropoint_is_found_with_its_covariance():
    zeropoint = satphot.fit_zeropoint(stars())
    truth = np.array([-23.4, 0.12, 0.08])
    found = np.array([zeropoint.zp_mag, zeropoint.k_mag_airmass, zeropoint.c_mag_mag])
    assert np.all(np.abs(found - truth) < 4 * zeropoint.errors[:3])
    assert np.all(zeropoint.errors[:3] < 0.04)
    assert zeropoint.n_rejected == 5 and zeropoint.n_used == 75
    np.testing.assert_array_equal(zeropoint.covariance, zeropoint.covariance.T)
    assert np.all(np.linalg.eigvalsh(zeropoint.covariance) > -1e-15)
    assert zeropoint.determined["k"] == "fitted"
    rows = zeropoint.stars()
    assert rows.n_rows == 80 and np.all(rows["fit_weight"][::17] == 0)


def test_calibration_is_the_equation_and_its_error_the_covariance():
    zeropoint = satphot.fit_zeropoint(stars())
    inst_mag, airmass, b_v_mag = np.array([-12.0, -10.0, -8.0]), 1.3, np.array([0.4, 0.6, 0.8])
    table = zeropoint.calibrate(inst_mag, airmass, b_v_mag, 0.1)
    expected = inst_mag - zeropoint.zp_mag - zeropoint.k_mag_airmass * airmass - zeropoint.c_mag_mag * b_v_mag
    np.testing.assert_allclose(table["v_mag"], expected, atol=1e-12)
    for i, colour in enumerate(b_v_mag):
        g = np.array([1.0, airmass, colour, airmass * colour])
        err = np.hypot(np.sqrt(g @ zeropoint.covariance @ g), zeropoint.c_mag_mag * 0.1)
        assert table["v_err_mag"][i] == pytest.approx(err, rel=1e-9)
    assert np.all(table["v_err_95_mag"] > 1.9 * table["v_err_mag"])
    with pytest.raises(satphot.SatphotError, match="airmass"):
        zeropoint.calibrate(inst_mag)


def test_files_dictionaries_and_structured_arrays_give_the_same(tmp_path):
    table = stars()
    path = tmp_path / "stars.csv"
    np.savetxt(path, np.column_stack(list(table.values())), delimiter=",", header=",".join(table), comments="", fmt="%.17g")
    structured = np.rec.fromarrays(list(table.values()), names=list(table))
    renamed = {("MAG" if name == "inst_mag" else name): column for name, column in table.items()}
    values = [
        satphot.fit_zeropoint(path),
        satphot.fit_zeropoint(str(path)),
        satphot.fit_zeropoint(table),
        satphot.fit_zeropoint(structured),
        satphot.fit_zeropoint(renamed, {"inst_mag": "MAG"}),
    ]
    assert len({value.zp_mag for value in values}) == 1


def test_a_constant_airmass_is_no_term():
    table = stars()
    del table["airmass"]
    zeropoint = satphot.fit_zeropoint(table, {"airmass": 1.2})
    assert zeropoint.k_mag_airmass == 0.0 or zeropoint.determined["k"] != "fitted"
    assert satphot.fit_zeropoint(table).calibrate(-12.0, b_v_mag=0.5)["v_mag"][0] > 11
