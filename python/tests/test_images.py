"""Apertures and backgrounds: laws, and photutils and sep where they are installed."""

from __future__ import annotations

import numpy as np
import pytest

import satphot

RNG = np.random.default_rng(7)
IMAGE = RNG.normal(100.0, 5.0, (120, 150))
X, Y = RNG.uniform(-3, 152, 60), RNG.uniform(-3, 122, 60)
ERROR = RNG.uniform(1.0, 3.0, IMAGE.shape)
MASK = RNG.random(IMAGE.shape) < 0.02


@pytest.mark.parametrize(
    "shape, area_px2",
    [
        (satphot.Circle(4.3), np.pi * 4.3**2),
        (satphot.Ellipse(5.0, 2.5, 0.7), np.pi * 12.5),
        (satphot.Rectangle(5.0, 2.5, 0.7), 50.0),
        (satphot.Pill(6.0, 2.0, 0.7), 32.0 + np.pi * 4.0),
    ],
)
def test_a_flat_image_gives_the_area(shape, area_px2):
    table = satphot.sum_apertures(np.full((40, 40), 3.0, dtype=np.float32), [19.3], [20.8], shape)
    assert table["sum"][0] == pytest.approx(3.0 * area_px2, rel=1e-12)
    assert table["area_px"][0] == pytest.approx(area_px2, rel=1e-12)
    assert np.isnan(table["sum_err"][0])


def test_every_position_may_have_its_own_axes():
    radii = RNG.uniform(1.0, 8.0, X.size)
    together = satphot.sum_apertures(IMAGE, X, Y, satphot.Circle(radii))
    for i in range(0, X.size, 7):
        alone = satphot.sum_apertures(IMAGE, X[i], Y[i], satphot.Circle(radii[i]))
        assert alone["sum"][0] == together["sum"][i]


def test_strides_byte_order_and_integers_are_converted():
    expected = satphot.sum_apertures(IMAGE[::2, ::3].copy(), 20.0, 20.0, satphot.Circle(5.0))["sum"][0]
    assert satphot.sum_apertures(IMAGE[::2, ::3], 20.0, 20.0, satphot.Circle(5.0))["sum"][0] == expected
    swapped = IMAGE[::2, ::3].astype(">f8")
    assert satphot.sum_apertures(swapped, 20.0, 20.0, satphot.Circle(5.0))["sum"][0] == expected
    counts = np.full((30, 30), 7, dtype=np.uint16)
    assert satphot.sum_apertures(counts, 15.0, 15.0, satphot.Rectangle(2.0, 2.0))["sum"][0] == pytest.approx(112.0)


def test_sums_are_those_of_photutils():
    aperture = pytest.importorskip("photutils.aperture")
    positions = np.column_stack([X, Y])
    pairs = [
        (satphot.Circle(5.2), aperture.CircularAperture(positions, 5.2)),
        (satphot.Ellipse(6.0, 3.0, 0.6), aperture.EllipticalAperture(positions, 6.0, 3.0, theta=0.6)),
    ]
    for own, theirs in pairs:
        for mask in (None, MASK):
            table = satphot.sum_apertures(IMAGE, X, Y, own, error=ERROR, mask=mask)
            expected = aperture.aperture_photometry(IMAGE, theirs, error=ERROR, mask=mask, method="exact")
            inside = (X > 8) & (X < 141) & (Y > 8) & (Y < 111)
            got, want = table["sum"], np.asarray(expected["aperture_sum"])
            # photutils gives NaN where an aperture misses the image
            known = np.isfinite(want)
            assert known.sum() > 50 and inside.sum() > 20
            np.testing.assert_allclose(got[known], want[known], rtol=1e-9, atol=1e-6)
            np.testing.assert_allclose(
                table["sum_err"][known], np.asarray(expected["aperture_sum_err"])[known], rtol=1e-9, atol=1e-6
            )
            areas = theirs.area_overlap(IMAGE, mask=mask, method="exact")
            np.testing.assert_allclose(table["area_px"][inside], np.asarray(areas)[inside], rtol=1e-9)


def test_sums_are_those_of_sep():
    sep = pytest.importorskip("sep")
    inside = (X > 8) & (X < 141) & (Y > 8) & (Y < 111)
    x, y = X[inside], Y[inside]
    flux, err, _ = sep.sum_circle(IMAGE, x, y, 5.0, err=ERROR, gain=2.0, subpix=0)
    table = satphot.sum_apertures(IMAGE, x, y, satphot.Circle(5.0), error=ERROR, e_per_unit=2.0)
    # sep sums areas in single precision
    np.testing.assert_allclose(table["sum"], flux, rtol=1e-7)
    np.testing.assert_allclose(table["sum_err"], err, rtol=1e-7)
    flux, _, _ = sep.sum_ellipse(IMAGE, x, y, 6.0, 3.0, 0.6, r=1.0, subpix=0)
    np.testing.assert_allclose(satphot.sum_apertures(IMAGE, x, y, satphot.Ellipse(6.0, 3.0, 0.6))["sum"], flux, rtol=1e-7)


def sky(slope):
    """A sky with noise of 5 and some stars."""
    rng = np.random.default_rng(3)
    image = rng.normal(200.0, 5.0, (384, 512)) + slope * np.arange(512)
    for x, y in rng.uniform(10, 370, (60, 2)):
        image[int(y) - 2 : int(y) + 3, int(x) - 2 : int(x) + 3] += 400.0
    return image


@pytest.mark.parametrize("slope", [0.0, 0.1])
def test_a_background_is_the_true_one(slope):
    image = sky(slope)
    measured = satphot.background(image)
    truth = 200.0 + slope * np.arange(512)
    assert np.abs(measured.level() - truth).max() < 2.0
    assert measured.global_rms == pytest.approx(5.0, abs=0.3 + 2 * slope * 64 / np.sqrt(12))
    at = measured.at([100.0, 300.0], [50.0, 200.0])
    np.testing.assert_allclose(at["level"], measured.level()[[50, 200], [100, 300]], rtol=1e-5)
    np.testing.assert_allclose(at["rms"], measured.rms()[[50, 200], [100, 300]], rtol=1e-4)


def test_masked_pixels_do_not_count():
    image = sky(0.0)
    mask = np.zeros(image.shape, dtype=bool)
    mask[:, 96:288] = True
    spoiled = np.where(mask, 1e4, image)
    assert np.abs(satphot.background(spoiled, mask=mask).level() - 200.0).max() < 3.0
    assert np.abs(satphot.background(np.where(mask, np.nan, image)).level() - 200.0).max() < 3.0
    assert np.abs(satphot.background(spoiled).level() - 200.0).max() > 100.0


def test_a_background_is_near_that_of_sep():
    sep = pytest.importorskip("sep")
    image = sky(0.1)
    own, theirs = satphot.background(image, mesh_px=64), sep.Background(image, bw=64, bh=64, fw=3, fh=3)
    assert own.global_level == pytest.approx(theirs.globalback, abs=1.0)
    assert own.global_rms == pytest.approx(theirs.globalrms, abs=0.5)
    assert np.abs(own.level() - theirs.back()).max() < 2.0
