"""Arguments: what is accepted, what is refused by which sentence, and that nothing aborts the interpreter."""

from __future__ import annotations

import datetime
import random
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
from conftest import ISS, SITE

import satphot


@pytest.mark.parametrize(
    "moment",
    [
        "2025-06-09T10:33:12",
        "2025-06-09T20:33:12+10:00",
        ["2025-06-09T10:33:12"],
        np.datetime64("2025-06-09T10:33:12"),
        np.array(["2025-06-09T10:33:12"], dtype="datetime64[us]"),
        datetime.datetime(2025, 6, 9, 10, 33, 12),
        datetime.datetime(2025, 6, 9, 10, 33, 12, tzinfo=datetime.timezone.utc),
        60835 + (10 * 3600 + 33 * 60 + 12) / 86400,
    ],
)
def test_a_moment_may_be_said_in_many_ways(moment):
    table = satphot.Model("iss").magnitudes(ISS, SITE, moment)
    assert table["range_km"][0] == pytest.approx(748.7, abs=0.1)
    assert abs(table["time"][0] - np.datetime64("2025-06-09T10:33:12")) < np.timedelta64(2, "us")


@pytest.mark.parametrize(
    "call, sentence",
    [
        (lambda: satphot.Model("no-such-thing"), "no-such-thing"),
        (lambda: satphot.Model("iss", mode="wrong"), "model.mode"),
        (lambda: satphot.Model("iss", effects={"shadow": "square"}), "model.effects.shadow"),
        (lambda: satphot.Model("iss", shape="round"), "shape"),
        (lambda: satphot.Model("iss", tolerance=2.0), "tolerance = 2; accepted is above 0, at most 0.5"),
        (lambda: satphot.Model("iss").magnitudes(ISS, (95.0, 0.0, 0.0), "2025-06-09"), "site.lat_deg"),
        (lambda: satphot.Model("iss").magnitudes(ISS, (95.0, 0.0), "2025-06-09"), "argument `site`"),
        (lambda: satphot.Model("iss").magnitudes(ISS, SITE, "yesterday"), "not a time"),
        (lambda: satphot.Model("iss").magnitudes(ISS, SITE, np.nan), "not finite"),
        (lambda: satphot.Model("iss").magnitudes(ISS, SITE, np.datetime64("NaT")), "missing"),
        (lambda: satphot.Model("iss").magnitudes("missing.tle", SITE, "2025-06-09"), "missing.tle"),
        (lambda: satphot.Model("iss").magnitudes(ISS.replace("9996", "9990"), SITE, "2025-06-09"), "elements:2"),
        (lambda: satphot.Model("iss").magnitudes(ISS, SITE, "2025-09-09"), "orbit: "),
        (lambda: satphot.Model("iss").magnitudes(ISS, SITE, "2025-06-09", norad=1), "argument `norad`"),
        (lambda: satphot.Model("iss").magnitudes(ISS, SITE, "2025-06-09", errors="hide"), "argument `errors`"),
        (lambda: satphot.passes(ISS, SITE, "2025-06-10", "2025-06-09"), "the end must be after the start"),
        (lambda: satphot.passes(ISS, SITE, "2025-06-09", "2025-06-10", min_alt_deg=91), "argument `min_alt_deg`"),
        (lambda: satphot.sky("iss", SITE, "2025-06-09", n_alt=1), "model: "),
        (lambda: satphot.Model("iss").magnitudes(ISS, SITE, "2025-06-09", threads=5000), "argument `threads`: 5000 is outside"),
        (lambda: satphot.Model("iss").magnitudes([ISS] * 300, SITE, np.full(10**6, 60835.0)), "split the moments"),
        (lambda: satphot.sum_apertures(np.zeros((3, 3), dtype=complex), [1.0], [1.0], satphot.Circle(1.0)), "complex"),
        (lambda: satphot.limits(exptime_s=0.0), "argument `exptime_s`"),
        (lambda: satphot.limits(band="Q"), "Q"),
        (lambda: satphot.limits(moon_phase_deg=400.0), "argument `moon_phase_deg`"),
        (lambda: satphot.sum_apertures(np.zeros((3, 3)), [1.0], [1.0, 2.0], satphot.Circle(1.0)), "argument `x_px`"),
        (lambda: satphot.sum_apertures(np.zeros((3, 3)), [1.0], [1.0], satphot.Circle(-1.0)), "-1 px is not above 0"),
        (lambda: satphot.background(np.zeros((64, 64)), mesh_px=2), "photometry.mesh_px"),
        (lambda: satphot.background(np.full((64, 64), np.nan)), "image"),
        (lambda: satphot.fit_zeropoint({"a": np.arange(5.0)}), "table: no column of catalogue magnitudes"),
        (lambda: satphot.Night("missing.toml"), "missing.toml"),
    ],
)
def test_what_is_wrong_is_said_in_the_sentence_of_the_library(call, sentence):
    with pytest.raises(satphot.SatphotError) as raised:
        call()
    assert isinstance(raised.value, ValueError)
    assert sentence in str(raised.value), str(raised.value)


def test_no_moment_is_a_table_without_rows():
    table = satphot.Model("iss").magnitudes(ISS, SITE, [])
    assert table.n_rows == 0 and table["model_v_mag"].dtype == np.float64
    assert satphot.sum_apertures(np.zeros((3, 3)), [], [], satphot.Circle(1.0)).n_rows == 0


def test_rows_that_cannot_be_computed_are_nan_with_their_reason_on_request():
    table = satphot.Model("iss").magnitudes(ISS, SITE, ["2025-06-09T10:33:12", "2026-06-09T10:33:12"], errors="nan")
    assert np.isfinite(table["model_v_mag"][0]) and np.isnan(table["model_v_mag"][1])
    assert table["problem"][0] == "" and "orbit" in table["problem"][1]


def test_old_elements_are_used_when_that_is_forced_with_a_warning():
    with pytest.warns(satphot.SatphotWarning, match="25544"):
        table = satphot.Model("iss").magnitudes(ISS, SITE, "2025-07-09T10:33:12", force_age=True)
    assert table["tle_age_d"][0] == pytest.approx(30, abs=1.5)


def test_vectors_broadcast_and_farther_plates_are_fainter():
    plate = {"name": "plate", "area_m2": 10.0, "attitude": "nadir", "brdf": {"kind": "lambert", "albedo": 0.5}}
    model = satphot.Model("plate", surfaces=[plate])
    assert model.area_m2 == 10.0
    heights = np.linspace(6700.0, 7400.0, 8)
    positions = np.column_stack([heights, np.zeros(8), np.zeros(8)])
    table = model.magnitudes_of_vectors(
        positions, (6378.2, 0.0, 0.0), (1.0e7, 1.496e8, 0.0), (-3.844e5, 0.0, 0.0), velocity_km_s=(0.0, 7.6, 0.0)
    )
    assert table.n_rows == 8
    # farther satellites are fainter
    assert np.all(np.diff(table["earthshine_v_mag"]) > 0)
    with pytest.raises(satphot.SatphotError, match="below the surface"):
        model.magnitudes_of_vectors((6000.0, 0, 0), (6378.2, 0.0, 0.0), (1.0e7, 1.496e8, 0.0), (-3.844e5, 0.0, 0.0))


def test_the_lock_is_released_while_the_library_works():
    model, counted, done = satphot.Model("starlink-v1.5"), [0], threading.Event()

    def count():
        while not done.is_set():
            counted[0] += 1
            time.sleep(0.001)

    times = np.datetime64("2025-06-09T10:00:00") + np.arange(20_000) * np.timedelta64(250, "ms")
    counter = threading.Thread(target=count)
    counter.start()
    before, start = counted[0], time.perf_counter()
    model.magnitudes(ISS, SITE, times)
    took, while_working = time.perf_counter() - start, counted[0] - before
    done.set()
    counter.join()
    assert while_working > 50 * took, (while_working, took)


INTERRUPTED = """
import signal
import numpy as np, satphot
# ignored where the tests run in the background of a shell
signal.signal(signal.SIGINT, signal.default_int_handler)
times = np.datetime64("2025-06-01T00:00:00") + np.arange(20_000_000) * np.timedelta64(50, "ms")
print("ready", flush=True)
try:
    satphot.Model("iss").magnitudes('''{elements}''', (-33.77, 151.11, 70.0), times)
except KeyboardInterrupt:
    print("interrupted", flush=True)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_ctrl_c_ends_a_long_call():
    child = subprocess.Popen(
        [sys.executable, "-c", INTERRUPTED.format(elements=ISS)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert child.stdout.readline() == "ready\n"
    time.sleep(1.5)
    sent = time.monotonic()
    child.send_signal(signal.SIGINT)
    out, err = child.communicate(timeout=60)
    assert out == "interrupted\n", err
    assert time.monotonic() - sent < 10


ODD_NUMBERS = [0, 1, -1, 2, 3.5, -0.0, 1e-300, 1e300, 1e18, -1e18, 2**31 - 1, 2**31, 2**63, 10**30, np.nan, np.inf, -np.inf, 89.9999, 6378.0]
ODD = [
    *ODD_NUMBERS,
    None,
    True,
    "",
    "x",
    "iss",
    "V",
    "none",
    "2025-06-09",
    "2025-06-09T23:59:60",
    "0001-01-01",
    "9999-12-31",
    "\x00",
    "é\n" * 3,
    ISS,
    b"\xff\xfe",
    (),
    [],
    {},
    object(),
    SITE,
    (0, 0, 0),
    [[]],
    np.zeros(0),
    np.zeros((0, 0)),
    np.zeros((9, 9)),
    np.ones((40, 40), dtype=np.float32),
    np.full((33, 17), np.nan),
    np.arange(7),
    np.arange(6.0)[::-2],
    np.array(["2025-06-09", "NaT"], dtype="datetime64[s]"),
    np.array(5),
    np.array([1 + 2j]),
    np.array(["a", "b"]),
    np.ma.masked_array([1.0, 2.0], [True, False]),
    {"inst_mag": np.arange(20.0), "v_mag": np.arange(20.0) + 23, "airmass": np.ones(20)},
    {"satellite": 5},
    datetime.datetime(1, 1, 1),
    datetime.date(2025, 1, 1),
]


@pytest.mark.filterwarnings("ignore")
def test_random_arguments_never_abort_the_interpreter():
    """Some thousand calls: each returns or raises an ordinary exception. A panic would be a BaseException and fail this."""
    rng = random.Random(20250609)
    model = satphot.Model("iss")
    image = np.ones((40, 40))
    zeropoint = satphot.fit_zeropoint(
        {"inst_mag": np.arange(30) * 0.1 - 12, "v_mag": np.arange(30) * 0.1 + 11.4 + 1e-3 * np.sin(np.arange(30))}
    )
    moment = "2025-06-09T10:33:12"

    def odd():
        return rng.choice(ODD)

    def mostly(usual):
        return odd() if rng.random() < 0.35 else usual

    def shape():
        kind = rng.choice([satphot.Ellipse, satphot.Rectangle, satphot.Pill, satphot.Circle])
        return satphot.Circle(mostly(3.0)) if kind is satphot.Circle else kind(mostly(3.0), mostly(2.0), mostly(0.3))

    def words(**usual):
        return {key: mostly(value) for key, value in usual.items() if rng.random() < 0.4}

    calls = {
        "model": lambda: satphot.Model(
            mostly("iss"), **words(mode="corrected", band="V", tolerance=1e-3, effects={}, surfaces=[], k_mag_airmass=0.1)
        ),
        "magnitudes": lambda: model.magnitudes(
            mostly(ISS), mostly(SITE), mostly(moment), **words(norad=25544, errors="nan", max_age_d=14, force_age=True, threads=1)
        ),
        "vectors": lambda: model.magnitudes_of_vectors(
            mostly((6900.0, 0, 0)), mostly((6378.2, 0, 0)), mostly((1e7, 1.5e8, 0)), mostly((-3.8e5, 0, 0)), **words(
                velocity_km_s=(0, 7.6, 0), sidereal_rad=0.0, errors="nan")
        ),
        "passes": lambda: satphot.passes(
            mostly(ISS), mostly(SITE), mostly(moment), mostly("2025-06-09T16:00:00"), **words(min_alt_deg=10.0, norad=25544, threads=1)
        ),
        "sky": lambda: satphot.sky(
            mostly(model), mostly(SITE), mostly(moment), n_alt=mostly(3) if rng.random() < 0.5 else 2, n_az=2,
            **words(height_km=420.0, track_az_deg=90.0)
        ),
        "limits": lambda: satphot.limits(
            **words(
                exptime_s=10.0, n_sub=2, snr=(1.0, 5.0), mag=12.0, band="V", sky_mag_arcsec2=20.0, moon_phase_deg=10.0,
                moon_alt_deg=30.0, alt_deg=60.0, omega_arcsec2=100.0, area_m2=10.0, range_km=500.0, zp_mag=24.0,
                fwhm_arcsec=2.0, aper_r_arcsec=3.0, gain_setting=200, read_noise_e=1.0, saturation_e=5e4, qe=0.8,
                pixel_arcsec=0.2, extinction_mag=0.1, obstruction=0.4,
            )
        ),
        "apertures": lambda: satphot.sum_apertures(
            mostly(image), mostly([20.0]), mostly([20.0]), mostly(shape()) if rng.random() < 0.2 else shape(), **words(
                error=1.0, mask=image > 2, e_per_unit=1.0)
        ),
        "background": lambda: satphot.background(mostly(image), **words(mask=image > 2, mesh_px=16, clip_sigma=3.0, threads=1)).at(
            mostly(5.0), mostly(5.0)
        ),
        "fit": lambda: satphot.fit_zeropoint(
            mostly({"inst_mag": np.arange(20.0), "v_mag": np.arange(20.0) + 23}),
            **words(columns={"airmass": 1.2}, band="V", inst_constant_mag=25.0, settings={"zeropoint.estimator": "ols"}),
        ),
        "calibrate": lambda: zeropoint.calibrate(mostly([-12.0]), mostly(1.2), mostly(0.6), mostly(0.1)),
        "night": lambda: satphot.Night(mostly("missing.toml"), mostly({})),
    }  # fmt: skip
    good = dict.fromkeys(calls, 0)
    refused = dict.fromkeys(calls, 0)
    for _ in range(4000):
        name = rng.choice(list(calls))
        try:
            calls[name]()
            good[name] += 1
        except (ValueError, TypeError, AttributeError, OverflowError, MemoryError):
            refused[name] += 1
    # the arguments are odd enough to be refused, and not so odd that all are
    assert all(refused.values()), refused
    assert all(n for name, n in good.items() if name != "night"), good
