"""The folder of an observer's night: two satellites in V and R, star fields, flats, biases and darks, with the truth.

    python3 scripts/make_observer_night.py --out raw --seed 1

Draws raw 16-bit frames with the headers of N.I.N.A. for the ISS and Tiangong over Sydney on 2025-06-06:

- target frames, tracked: the satellite (a rectangle and a disc of the true size, seen through the air) rests near the
  centre, stars are trails along its motion and stand in the catalogue; its magnitudes are chosen here and are no model's,
- star fields at eight airmasses in either filter, mirrored (rows top down) and turned, without world coordinates,
- flats with vignetting and dust, biases with a fixed pattern, darks with hot pixels. Lights have all of these.

`--fainter` makes the satellites fainter and point-like, `--cloudy` dims a share of the target frames with all their stars
by 0.1 to 1 mag, and `--clock-error` makes the clock of the headers of the target frames late. The truth has the places of
the satellite among the stars of the catalogue: nutation, light time and the annual aberration of the stars are applied.

Next to them are `catalogue.csv`, `elements.tle` and the folder `truth`, in which nothing is a frame.

It exists to test satphot on frames that it did not draw, so that an error made twice is not taken for agreement. Nothing
is shared with `satphot simulate`: orbits are those of the sgp4 package, the geometry, airmass (Young 1994), profile of
stars (Moffat of beta 3.0 and Gaussian), detector and FITS files are written here independently. Not drawn: scintillation, clouds,
cosmic rays, refraction, distortion of the field, smear by imperfect tracking.

Needs numpy and sgp4. Pixels count from 0 at the centre of the first one; times are UTC; magnitudes are Vega.
"""
import argparse
import csv
import math
from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
from sgp4.api import Satrec, jday

SITE_LAT_DEG, SITE_LON_DEG, SITE_ALT_M = -33.7703, 151.1113, 70.0
NIGHT_START = datetime(2025, 6, 6, 9, 0)
NIGHT_H = 11.0
CALIBRATION_START = datetime(2025, 6, 6, 6, 30)
STARS_START = datetime(2025, 6, 6, 12, 30)
STAR_ALT_DEG = (81.0, 66.0, 56.0, 48.0, 41.0, 35.0, 30.0, 26.0)
PASS_ALT_MIN_DEG = 22.0

FOCAL_LENGTH_MM, PIXEL_UM, BINNING = 800.0, 3.76, 2
SCALE_ARCSEC = math.degrees(PIXEL_UM * BINNING * 1e-3 / FOCAL_LENGTH_MM) * 3600.0
E_PER_ADU, READ_NOISE_E, PEDESTAL_ADU, ADU_MAX = 0.2475, 1.6, 500.0, 65535
DARK_E_S, HOT_PIXEL_FRAC = 0.02, 4e-4
ROTATION_DEG, ROTATION_STEP_DEG, POINTING_ERR_ARCSEC = 14.7, 0.05, 20.0
SHUTTER_DELAY_S, DOWNLOAD_S = 0.02, 0.06  # N.I.N.A. stamps the request; DATE-AVG lies between request and picture
MOFFAT_SHARE, FWHM_ZENITH_PX = 0.8, 2.9
STARS_PER_DEG2, STAR_MAG_LIMIT, CATALOGUE_MAG_LIMIT = 2500.0, 17.0, 15.8

ELEMENTS = """\
ISS (ZARYA)
1 25544U 98067A   25156.41218638  .00010954  00000+0  19949-3 0  9995
2 25544  51.6392   5.4243 0001910 184.4067 237.6437 15.50021068513332
CSS (TIANHE)
1 48274U 21035A   25156.21104554  .00019537  00000+0  25342-3 0  9990
2 48274  41.4641  93.3127 0005512   5.5400 354.5498 15.58366731234281
"""


@dataclass(frozen=True)
class Band:
    """A filter: magnitude of one electron per second, extinction, colour term of B-V, sky, illumination of its flats."""

    name: str
    zp_mag: float
    k_mag_airmass: float
    c_mag_mag: float
    sky_mag_arcsec2: float
    vignetting: float
    flat_level_adu: float
    star_exptime_s: float


@dataclass(frozen=True)
class Satellite:
    """What is drawn of a satellite: V at 1000 km and 90 deg of phase, colours, size, shape."""

    name: str
    norad_cat_id: int
    v_1000km_mag: float
    b_v_mag: float
    v_r_mag: float
    size_m: tuple
    shape: str
    exptime_s: float


BANDS = (Band("V", 22.15, 0.165, -0.048, 20.2, 0.17, 26000.0, 6.0), Band("R", 21.85, 0.112, 0.083, 19.6, 0.24, 31000.0, 5.0))
SATELLITES = (Satellite("ISS (ZARYA)", 25544, 8.6, 0.70, 0.41, (109.0, 55.0), "rectangle", 0.2),
              Satellite("CSS (TIANHE)", 48274, 10.2, 0.61, 0.36, (38.0, 38.0), "disc", 0.25))


# --- Time, Earth, sky ------------------------------------------------------------------------------------------------

def jd_of(time):
    """Julian date in two parts."""
    return jday(time.year, time.month, time.day, time.hour, time.minute, time.second + time.microsecond * 1e-6)


def gmst_rad(time):
    """Greenwich mean sidereal time (IAU 1982); UT1 is taken to be UTC."""
    day, frac = jd_of(time)
    days = day - 2451545.0 + frac
    cent = days / 36525.0
    return math.radians((280.46061837 + 360.98564736629 * days + 0.000387933 * cent**2) % 360.0)


def unit(lon_rad, lat_rad):
    """Unit vectors of spherical angles."""
    return np.stack([np.cos(lat_rad) * np.cos(lon_rad), np.cos(lat_rad) * np.sin(lon_rad), np.sin(lat_rad)], axis=-1)


def precession(time):
    """Matrix from J2000 to the mean equator and equinox of date (IAU 1976)."""
    day, frac = jd_of(time)
    cent = (day - 2451545.0 + frac) / 36525.0
    zeta, z, theta = (math.radians(a * cent / 3600.0) for a in (2306.2181, 2306.2181, 2004.3109))

    def turn(axis, angle):
        c, s = math.cos(angle), math.sin(angle)
        return np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]] if axis == "z" else [[c, 0, -s], [0, 1, 0], [s, 0, c]])

    return turn("z", -z) @ turn("y", theta) @ turn("z", -zeta)


def nutation(time):
    """Matrix from the axes of SGP4 (true equator, mean equinox) to the mean equator and equinox of date, to 0.1 arcsec."""
    day, frac = jd_of(time)
    cent = (day - 2451545.0 + frac) / 36525.0
    node, sun, moon = (math.radians(a + b * cent) for a, b in
                       ((125.04452, -1934.136261), (280.4665, 36000.7698), (218.3165, 481267.8813)))
    arcsec = math.radians(1.0 / 3600.0)
    in_lon = (-17.20 * math.sin(node) - 1.32 * math.sin(2 * sun) - 0.23 * math.sin(2 * moon) + 0.21 * math.sin(2 * node)) * arcsec
    in_tilt = (9.20 * math.cos(node) + 0.57 * math.cos(2 * sun) + 0.10 * math.cos(2 * moon) - 0.09 * math.cos(2 * node)) * arcsec
    tilt = math.radians(23.4392911 - 0.0130042 * cent)
    # small angles: true = mean + rotations about x (-in_tilt), y (in_lon sin tilt) and z (-in_lon cos tilt, which SGP4 leaves undone)
    a_x, a_y = in_tilt, in_lon * math.sin(tilt)
    return np.array([[1.0, 0.0, a_y], [0.0, 1.0, a_x], [-a_y, -a_x, 1.0]])


def earth_velocity(time):
    """Velocity of the Earth about the Sun in units of the speed of light, of date, to 2 %."""
    later, earlier = (sun_direction(time + timedelta(hours=h)) for h in (12.0, -12.0))
    return -(later - earlier) * 149597870.7 / 86400.0 / 299792.458


def site_km(time):
    """Place of the observer in the axes of the equator of date (WGS84)."""
    a_km, e2 = 6378.137, 0.00669437999014
    lat, theta = math.radians(SITE_LAT_DEG), math.radians(SITE_LON_DEG) + gmst_rad(time)
    n_km, h_km = a_km / math.sqrt(1.0 - e2 * math.sin(lat) ** 2), SITE_ALT_M * 1e-3
    ring_km = (n_km + h_km) * math.cos(lat)
    return np.array([ring_km * math.cos(theta), ring_km * math.sin(theta), (n_km * (1.0 - e2) + h_km) * math.sin(lat)])


def alt_az_deg(of_date, time):
    """Altitude without refraction and azimuth (north through east) of unit vectors of date."""
    lat, theta = math.radians(SITE_LAT_DEG), math.radians(SITE_LON_DEG) + gmst_rad(time)
    up = unit(theta, lat)
    east = np.array([-math.sin(theta), math.cos(theta), 0.0])
    north = np.cross(up, east)
    return np.degrees(np.arcsin(of_date @ up)), np.degrees(np.arctan2(of_date @ east, of_date @ north)) % 360.0


def airmass(alt_deg):
    """Airmass at the true altitude (Young 1994)."""
    c = np.sin(np.radians(alt_deg))
    return (1.002432 * c**2 + 0.148386 * c + 0.0096467) / (c**3 + 0.149864 * c**2 + 0.0102963 * c + 0.000303978)


def sun_direction(time):
    """Unit vector to the Sun, of date, good to 0.01 deg."""
    day, frac = jd_of(time)
    days = day - 2451545.0 + frac
    g = math.radians(357.528 + 0.9856003 * days)
    lon = math.radians(280.460 + 0.9856474 * days + 1.915 * math.sin(g) + 0.020 * math.sin(2.0 * g))
    tilt = math.radians(23.439 - 4e-7 * days)
    return np.array([math.cos(lon), math.cos(tilt) * math.sin(lon), math.sin(tilt) * math.sin(lon)])


def ra_dec_deg(vector):
    """Right ascension and declination of a unit vector."""
    return math.degrees(math.atan2(vector[1], vector[0])) % 360.0, math.degrees(math.asin(vector[2]))


def sky_axes(centre):
    """Unit vectors to east and north on the sky at a direction."""
    east = np.cross([0.0, 0.0, 1.0], centre)
    east /= np.linalg.norm(east)
    return east, np.cross(centre, east)


def to_pixels(east_rad, north_rad, rotation_deg):
    """Tangent-plane offsets to pixels from the centre: rows from the top, so that x runs west and y south, turned."""
    x_px, y_px = -np.degrees(east_rad) * 3600.0 / SCALE_ARCSEC, -np.degrees(north_rad) * 3600.0 / SCALE_ARCSEC
    c, s = math.cos(math.radians(rotation_deg)), math.sin(math.radians(rotation_deg))
    return np.stack([c * x_px - s * y_px, s * x_px + c * y_px], axis=-1)


class Orbit:
    """A satellite as the observer sees it."""

    def __init__(self, satellite):
        lines = ELEMENTS.splitlines()
        at = lines.index(satellite.name)
        self.satrec = Satrec.twoline2rv(lines[at + 1], lines[at + 2])

    def look(self, time):
        """Direction of date, range and phase angle."""
        light_s = 0.0
        for _ in range(2):  # the light that arrives now left the satellite a few milliseconds ago
            error, place_km, _ = self.satrec.sgp4(*jd_of(time - timedelta(seconds=light_s)))
            if error:
                raise SystemExit(f"sgp4 error {error}")
            line_km = np.array(place_km) - site_km(time)
            range_km = float(np.linalg.norm(line_km))
            light_s = range_km / 299792.458
        cos_phase = float(-line_km / range_km @ sun_direction(time))
        return line_km / range_km, range_km, math.degrees(math.acos(cos_phase))

    def times(self, count):
        """So many moments, evenly over all passes of the night in a dark sky."""
        moments = [NIGHT_START + timedelta(seconds=s) for s in range(0, int(NIGHT_H * 3600), 4)]
        up = [t for t in moments if alt_az_deg(self.look(t)[0], t)[0] > PASS_ALT_MIN_DEG
              and alt_az_deg(sun_direction(t), t)[0] < -12.0]
        return [up[int(i)] for i in np.linspace(0, len(up) - 1, count)]


# --- Light -----------------------------------------------------------------------------------------------------------

class Psf:
    """A star of unit flux: a share of Moffat of beta 3.0 and the rest Gaussian, of one FWHM."""

    def __init__(self, fwhm_px):
        self.fwhm_px = fwhm_px
        self.alpha2 = (0.5 * fwhm_px) ** 2 / (2.0 ** (1.0 / 3.0) - 1.0)
        self.sigma2 = (fwhm_px / 2.354820045) ** 2

    def __call__(self, r2):
        moffat = 2.0 / (math.pi * self.alpha2) / (1.0 + r2 / self.alpha2) ** 3
        return MOFFAT_SHARE * moffat + (1.0 - MOFFAT_SHARE) * np.exp(-0.5 * r2 / self.sigma2) / (2.0 * math.pi * self.sigma2)

    def pixels(self, dx, dy):
        """Light per pixel at these distances of the pixels' centres, by nine Gauss points in each."""
        total = 0.0
        for ax, wx in ((-0.3872983346, 5 / 18), (0.0, 8 / 18), (0.3872983346, 5 / 18)):
            for ay, wy in ((-0.3872983346, 5 / 18), (0.0, 8 / 18), (0.3872983346, 5 / 18)):
                total = total + wx * wy * self((dx + ax) ** 2 + (dy + ay) ** 2)
        return total


def add_stamp(image, stamp, x0, y0):
    """Adds a stamp whose first pixel is (x0, y0), the part that is in the image."""
    rows, cols = image.shape
    top, left = max(0, y0), max(0, x0)
    bottom, right = min(rows, y0 + stamp.shape[0]), min(cols, x0 + stamp.shape[1])
    if top < bottom and left < right:
        image[top:bottom, left:right] += stamp[top - y0:bottom - y0, left - x0:right - x0]


def draw_star(image, psf, x_px, y_px, flux_e, half_px):
    """Adds a star at rest."""
    x0, y0 = round(x_px) - half_px, round(y_px) - half_px
    steps = np.arange(2 * half_px + 1)
    add_stamp(image, flux_e * psf.pixels((x0 + steps - x_px)[None, :], (y0 + steps - y_px)[:, None]), x0, y0)


def draw_body(image, psf, x_px, y_px, flux_e, size_px, shape, angle_deg, fine=5, half_px=64):
    """Adds a rectangle or disc of even brightness, seen through the air: convolved on a grid five times as fine."""
    x0, y0 = round(x_px) - half_px, round(y_px) - half_px
    cells = 2 * half_px * fine
    steps = (np.arange(cells) + 0.5) / fine - 0.5
    dx, dy = (x0 + steps - x_px)[None, :], (y0 + steps - y_px)[:, None]
    c, s = math.cos(math.radians(angle_deg)), math.sin(math.radians(angle_deg))
    u, v = (c * dx + s * dy) / (0.5 * size_px[0]), (-s * dx + c * dy) / (0.5 * size_px[1])
    body = (np.maximum(abs(u), abs(v)) <= 1.0) if shape == "rectangle" else (u**2 + v**2 <= 1.0)
    lag = np.minimum(np.arange(cells), cells - np.arange(cells)) / fine
    kernel = psf(lag[None, :] ** 2 + lag[:, None] ** 2)
    seen = np.fft.irfft2(np.fft.rfft2(body / body.sum()) * np.fft.rfft2(kernel / kernel.sum()), s=body.shape)
    add_stamp(image, flux_e * seen.reshape(2 * half_px, fine, 2 * half_px, fine).sum(axis=(1, 3)), x0, y0)


def draw_trails(image, psf, places_px, flux_e):
    """Adds stars that move during the exposure: `places_px` of moments evenly apart, stars, and two coordinates."""
    margin = 40
    rows, cols = image.shape[0] + 2 * margin, image.shape[1] + 2 * margin
    impulses = np.zeros((rows, cols))
    steps = len(places_px) - 1
    longest_px = float(np.hypot(*np.moveaxis(np.diff(places_px, axis=0), -1, 0)).sum(axis=0).max())
    count = max(2, math.ceil(2.0 * longest_px))
    at = (np.arange(count) + 0.5) / count * steps
    before = at.astype(int)
    part = (at - before)[:, None, None]
    along = (1.0 - part) * places_px[before] + part * places_px[before + 1]
    x, y = (along[:, :, k].T.ravel() + margin for k in (0, 1))
    light = np.repeat(flux_e / count, count)
    kept = (x >= 0) & (x < cols - 1) & (y >= 0) & (y < rows - 1)
    x, y, light = x[kept], y[kept], light[kept]
    col, row = x.astype(int), y.astype(int)
    fx, fy = x - col, y - row
    for ox, oy, share in ((0, 0, (1 - fx) * (1 - fy)), (1, 0, fx * (1 - fy)), (0, 1, (1 - fx) * fy), (1, 1, fx * fy)):
        np.add.at(impulses, (row + oy, col + ox), light * share)
    lag_x = np.minimum(np.arange(cols), cols - np.arange(cols))
    lag_y = np.minimum(np.arange(rows), rows - np.arange(rows))
    kernel = psf.pixels(lag_x[None, :], lag_y[:, None])
    seen = np.fft.irfft2(np.fft.rfft2(impulses) * np.fft.rfft2(kernel / kernel.sum()), s=impulses.shape)
    image += np.maximum(seen[margin:-margin, margin:-margin], 0.0)


def random_stars(rng, area_deg2):
    """V, B-V and V-R of the stars of an area: numbers grow by 10^0.32 per magnitude."""
    count = rng.poisson(STARS_PER_DEG2 * area_deg2)
    v_mag = np.maximum(STAR_MAG_LIMIT + np.log10(1.0 - rng.random(count)) / 0.32, 8.0)
    b_v_mag = np.clip(rng.normal(0.75, 0.30, count), -0.1, 1.8)
    return v_mag, b_v_mag, 0.03 + 0.56 * b_v_mag + rng.normal(0.0, 0.015, count)


def rate_e_s(band, mag, b_v_mag, mass):
    """Electrons per second below the air."""
    return 10.0 ** (0.4 * (band.zp_mag - mag - band.k_mag_airmass * mass - band.c_mag_mag * b_v_mag))


# --- Camera ----------------------------------------------------------------------------------------------------------

class Camera:
    """The detector of the night: bias pattern, dark current, and the response in each filter."""

    def __init__(self, seed, cols, rows):
        rng = np.random.default_rng([seed, 1])
        self.rows, self.cols = rows, cols
        pattern_adu = rng.normal(0.0, 2.5, (1, cols)) + rng.normal(0.0, 1.0, (rows, 1)) + rng.normal(0.0, 1.5, (rows, cols))
        self.bias_adu = PEDESTAL_ADU + pattern_adu
        self.dark_e_s = np.full((rows, cols), DARK_E_S)
        hot = rng.random((rows, cols)) < HOT_PIXEL_FRAC
        self.dark_e_s[hot] = 10.0 ** rng.uniform(0.5, 3.3, hot.sum())
        self.x, self.y = np.meshgrid(np.arange(cols) - 0.5 * (cols - 1), np.arange(rows) - 0.5 * (rows - 1))
        self.corner_px = math.hypot(0.5 * cols, 0.5 * rows)
        pixels = rng.normal(1.0, 0.006, (rows, cols))
        shared = self.dust(rng, 3)
        self.response = {}
        for band in BANDS:  # its median is 1, so that the zeropoints are those of a frame that was flattened
            response = pixels * shared * self.dust(rng, 4) * self.vignetting(rng, band)
            self.response[band.name] = response / np.median(response)

    def vignetting(self, rng, band):
        """What is left of the light towards the corners; the middle lies off that of the chip."""
        r2 = ((self.x - rng.normal(0.0, 12.0)) ** 2 + (self.y - rng.normal(0.0, 12.0)) ** 2) / self.corner_px**2
        return 1.0 - band.vignetting * r2 * (0.7 + 0.3 * r2)

    def dust(self, rng, count):
        """Rings: the shadow of a grain far from the detector, with the hole of a secondary mirror."""
        shade = np.ones((self.rows, self.cols))
        for _ in range(count):
            x_px, y_px = rng.uniform(-0.45, 0.45) * self.cols, rng.uniform(-0.45, 0.45) * self.rows
            outer_px, depth = rng.uniform(12.0, 30.0), rng.uniform(0.02, 0.07)
            r_px = np.hypot(self.x - x_px, self.y - y_px)
            inside = [0.5 * (1.0 - np.tanh((r_px - edge_px) / 2.4)) for edge_px in (outer_px, 0.4 * outer_px)]
            shade -= depth * (inside[0] - inside[1])
        return shade

    def read(self, rng, light_e, exptime_s):
        """Counts of a frame that received this light: photons and dark current by Poisson, read noise, converter."""
        electrons = rng.poisson(light_e + self.dark_e_s * exptime_s) + rng.normal(0.0, READ_NOISE_E, light_e.shape)
        return np.clip(np.rint(electrons / E_PER_ADU + self.bias_adu), 0, ADU_MAX).astype(np.uint16)


# --- Files -----------------------------------------------------------------------------------------------------------

def sexagesimal(value, signed):
    """'HH MM SS' or '+DD MM SS' as N.I.N.A. writes them."""
    seconds = round(abs(value) * 3600.0)
    sign = ("-" if value < 0 else "+") if signed else ""
    return f"{sign}{seconds // 3600:02d} {seconds // 60 % 60:02d} {seconds % 60:02d}"


def card(key, value, comment):
    """A card of 80 characters."""
    if isinstance(value, bool):
        text = f"{'T' if value else 'F':>20}"
    elif isinstance(value, str):
        text = f"{chr(39) + value.ljust(8) + chr(39):<20}"
    else:
        text = f"{value!r:>20}"
    return f"{key:<8}= {text} / {comment}"[:80].ljust(80)


class Folder:
    """The folder of the night in the layout of N.I.N.A., with a running number in the names."""

    def __init__(self, out, rows, cols):
        self.out, self.rows, self.cols, self.number = out, rows, cols, 0

    def write(self, kind, counts, request, exptime_s, rng, band=None, target=None, pointing=None):
        """One frame; `request` is the clock when the exposure is asked for. Returns the name of the file."""
        average = request + timedelta(seconds=0.5 * (SHUTTER_DELAY_S + exptime_s + DOWNLOAD_S))
        temp_c = -10.0 + round(float(rng.normal(0.0, 0.1)), 1)

        def stamp(time):
            return time.isoformat(timespec="milliseconds")

        cards = [("SIMPLE", True, "C# FITS"), ("BITPIX", 16, ""), ("NAXIS", 2, "Dimensionality"), ("NAXIS1", self.cols, ""),
                 ("NAXIS2", self.rows, ""), ("BZERO", 32768, ""), ("EXTEND", True, "Extensions are permitted"),
                 ("IMAGETYP", kind, "Type of exposure"), ("EXPOSURE", exptime_s, "[s] Exposure duration"),
                 ("EXPTIME", exptime_s, "[s] Exposure duration"),
                 ("DATE-LOC", stamp(request + timedelta(hours=10)), "Time of observation (local)"),
                 ("DATE-OBS", stamp(request), "Time of observation (UTC)"),
                 ("DATE-AVG", stamp(average), "Averaged midpoint time (UTC)"),
                 ("XBINNING", BINNING, "X axis binning factor"), ("YBINNING", BINNING, "Y axis binning factor"),
                 ("GAIN", 100, "Sensor gain"), ("OFFSET", 50, "Sensor gain offset"),
                 ("EGAIN", E_PER_ADU, "[e-/ADU] Electrons per A/D unit"),
                 ("XPIXSZ", PIXEL_UM * BINNING, "[um] Pixel X axis size"), ("YPIXSZ", PIXEL_UM * BINNING, "[um] Pixel Y axis size"),
                 ("INSTRUME", "ZWO ASI2600MM Pro", "Imaging instrument name"),
                 ("SET-TEMP", -10.0, "[degC] CCD temperature setpoint"), ("CCD-TEMP", temp_c, "[degC] CCD temperature"),
                 ("TELESCOP", "8in RC", "Name of telescope"), ("FOCALLEN", FOCAL_LENGTH_MM, "[mm] Focal length"),
                 ("FOCRATIO", 4.0, "Focal ratio")]
        if pointing is not None:
            alt_deg, az_deg = alt_az_deg(precession(request) @ unit(*np.radians(pointing)), request)
            cards += [("RA", round(pointing[0], 7), "[deg] RA of telescope"),
                      ("DEC", round(pointing[1], 7), "[deg] Declination of telescope"),
                      ("CENTALT", round(float(alt_deg), 6), "[deg] Altitude of telescope"),
                      ("CENTAZ", round(float(az_deg), 6), "[deg] Azimuth of telescope"),
                      ("AIRMASS", round(float(airmass(alt_deg)), 6), "Airmass at frame center (Young 1994)")]
        cards += [("SITEELEV", SITE_ALT_M, "[m] Observation site elevation"),
                  ("SITELAT", SITE_LAT_DEG, "[deg] Observation site latitude"),
                  ("SITELONG", SITE_LON_DEG, "[deg] Observation site longitude")]
        if band is not None:
            cards += [("FWHEEL", "ZWO EFW", "Filter Wheel name"), ("FILTER", band.name, "Active filter name")]
        if target is not None:
            cards += [("OBJECT", target, "Name of the object of interest"),
                      ("OBJCTRA", sexagesimal(pointing[0] / 15.0, False), "[H M S] RA of imaged object"),
                      ("OBJCTDEC", sexagesimal(pointing[1], True), "[D M S] Declination of imaged object")]
        cards += [("ROWORDER", "TOP-DOWN", "FITS Image Orientation"), ("EQUINOX", 2000.0, "Equinox of celestial coordinate system"),
                  ("SWCREATE", "N.I.N.A. 3.1.2.9001 (x64)", "Software that created this file")]
        header = "".join(card(*c) for c in cards) + "END".ljust(80)
        data = (counts.astype(np.int32) - 32768).astype(">i2").tobytes()
        wheel = band.name + "_" if band else ""
        name = f"{request:%Y-%m-%d_%H-%M-%S}_{wheel}{temp_c:.2f}_{exptime_s:.2f}s_{self.number:04d}.fits"
        self.number += 1
        folder = self.out / f"{NIGHT_START:%Y-%m-%d}" / kind
        folder.mkdir(parents=True, exist_ok=True)
        header = header.ljust(-(-len(header) // 2880) * 2880).encode("ascii")
        (folder / name).write_bytes(header + data + bytes(-len(data) % 2880))
        return name


def write_csv(path, rows):
    """A table of dictionaries."""
    with path.open("w", newline="") as file:
        table = csv.DictWriter(file, fieldnames=list(rows[0]))
        table.writeheader()
        table.writerows(rows)


# --- The night -------------------------------------------------------------------------------------------------------

def sky_e(camera, rng, band, exptime_s):
    """Electrons of the sky per pixel, with a gradient."""
    rate = 10.0 ** (0.4 * (band.zp_mag - band.sky_mag_arcsec2)) * SCALE_ARCSEC**2
    slope = rng.normal(0.0, 0.05, 2)
    return rate * exptime_s * (1.0 + slope[0] * camera.x / camera.cols + slope[1] * camera.y / camera.rows)


def seeing(rng, mass):
    """The profile of a frame's stars."""
    return Psf(FWHM_ZENITH_PX * mass**0.6 * math.exp(rng.normal(0.0, 0.05)))


def draw_calibration(folder, camera, seed, counts):
    """Biases, darks of two exposures, flats of every filter."""
    rng, clock = np.random.default_rng([seed, 2]), CALIBRATION_START
    dark = np.zeros((camera.rows, camera.cols))
    plan = [("BIAS", None, 0.0)] * counts["biases"] + [("DARK", None, t) for t in (6.0, 30.0) for _ in range(counts["darks"])]
    plan += [("FLAT", band, 1.5) for band in BANDS for _ in range(counts["flats"])]
    for kind, band, exptime_s in plan:
        light_e = dark
        if band is not None:
            light_e = camera.response[band.name] * band.flat_level_adu * rng.normal(1.0, 0.03) * E_PER_ADU
        folder.write(kind, camera.read(rng, light_e, exptime_s), clock, exptime_s, rng, band)
        clock += timedelta(seconds=exptime_s + 2.0)


def catalogue_rows(rng, count, stars):
    """The stars that a catalogue knows, with its errors; `count` rows are there already."""
    rows = []
    for place, v_mag, b_v_mag, v_r_mag in stars:
        if v_mag < CATALOGUE_MAG_LIMIT:
            ra_deg, dec_deg = ra_dec_deg(place)
            row = {"recno": count + len(rows) + 1, "RAJ2000": f"{ra_deg:.7f}", "DEJ2000": f"{dec_deg:.7f}"}
            for name, mag in (("B", v_mag + b_v_mag), ("V", v_mag), ("R", v_mag - v_r_mag)):
                err_mag = math.hypot(0.012, 0.03 * 10.0 ** (0.3 * (mag - 16.0)))
                row |= {f"{name}mag": f"{mag + rng.normal(0.0, err_mag):.3f}", f"e_{name}mag": f"{err_mag:.3f}"}
            rows.append(row)
    return rows


def draw_star_fields(folder, camera, seed, frames_each):
    """Sidereal frames of all pointings; returns the rows of the catalogue and of the truth."""
    catalogue, truth, clock = [], [], STARS_START
    for field, alt_deg in enumerate(STAR_ALT_DEG):
        rng = np.random.default_rng([seed, 3, field])
        lat, theta = math.radians(SITE_LAT_DEG), math.radians(SITE_LON_DEG) + gmst_rad(clock)
        up, az_rad = unit(theta, lat), rng.uniform(0.0, 2.0 * math.pi)
        east = np.array([-math.sin(theta), math.cos(theta), 0.0])
        level = math.cos(az_rad) * np.cross(up, east) + math.sin(az_rad) * east
        of_date = math.sin(math.radians(alt_deg)) * up + math.cos(math.radians(alt_deg)) * level
        centre = precession(clock).T @ of_date
        axes = sky_axes(centre)
        half_deg = 1.2 * camera.corner_px * SCALE_ARCSEC / 3600.0
        v_mag, b_v_mag, v_r_mag = random_stars(rng, (2.0 * half_deg) ** 2)
        plane = np.radians(rng.uniform(-half_deg, half_deg, (len(v_mag), 2)))
        stars = centre + plane[:, :1] * axes[0] + plane[:, 1:] * axes[1]
        stars /= np.linalg.norm(stars, axis=1)[:, None]
        mags = {"V": v_mag, "R": v_mag - v_r_mag}
        catalogue += catalogue_rows(rng, len(catalogue), zip(stars, v_mag, b_v_mag, v_r_mag))
        for band in BANDS:
            for _ in range(frames_each):
                start = clock + timedelta(seconds=SHUTTER_DELAY_S)
                middle = start + timedelta(seconds=0.5 * band.star_exptime_s)
                offset_rad = np.radians(rng.normal(0.0, POINTING_ERR_ARCSEC / math.sqrt(2.0), 2) / 3600.0)
                aim = centre + offset_rad[0] * axes[0] + offset_rad[1] * axes[1]
                aim /= np.linalg.norm(aim)
                rotation_deg = ROTATION_DEG + ROTATION_STEP_DEG * folder.number / 10.0
                aim_axes = sky_axes(aim)
                depth = stars @ aim
                xy = to_pixels(stars @ aim_axes[0] / depth, stars @ aim_axes[1] / depth, rotation_deg)
                xy += [0.5 * (camera.cols - 1), 0.5 * (camera.rows - 1)]
                mass = airmass(alt_az_deg(stars @ precession(middle).T, middle)[0])
                flux_e = rate_e_s(band, mags[band.name], b_v_mag, mass) * band.star_exptime_s
                psf = seeing(rng, float(np.median(mass)))
                light_e = sky_e(camera, rng, band, band.star_exptime_s)
                for (x_px, y_px), flux, v in zip(xy, flux_e, v_mag):
                    if -40 < x_px < camera.cols + 40 and -40 < y_px < camera.rows + 40:
                        draw_star(light_e, psf, x_px, y_px, flux, 40 if v < CATALOGUE_MAG_LIMIT else 16)
                counts = camera.read(rng, light_e * camera.response[band.name], band.star_exptime_s)
                name = folder.write("LIGHT", counts, clock, band.star_exptime_s, rng, band, f"Field {field + 1}",
                                    ra_dec_deg(centre))
                ra_deg, dec_deg = ra_dec_deg(aim)
                truth.append({"file": name, "filter": band.name, "ra_deg": f"{ra_deg:.6f}", "dec_deg": f"{dec_deg:.6f}",
                              "airmass": f"{np.median(mass):.5f}", "fwhm_px": f"{psf.fwhm_px:.4f}",
                              "rotation_deg": f"{rotation_deg:.3f}"})
                clock += timedelta(seconds=band.star_exptime_s + 3.0)
        clock += timedelta(seconds=180.0)
    return catalogue, truth


def draw_targets(folder, camera, seed, satellite, index, frames_each, catalogue, args):
    """Tracked frames of one satellite, two of a filter after each other; returns the rows of the truth."""
    orbit, truth = Orbit(satellite), []
    for i, request in enumerate(orbit.times(frames_each * len(BANDS))):
        rng, band = np.random.default_rng([seed, 4, index, i]), BANDS[i // 2 % len(BANDS)]
        request += timedelta(milliseconds=int(rng.integers(0, 1000)))
        start = request + timedelta(seconds=SHUTTER_DELAY_S)
        middle = start + timedelta(seconds=0.5 * satellite.exptime_s)
        toward, range_km, phase_deg = orbit.look(middle)
        alt_deg, az_deg = alt_az_deg(toward, middle)
        mass = float(airmass(alt_deg))
        v_mag = satellite.v_1000km_mag + 5.0 * math.log10(range_km / 1000.0) + 0.008 * (phase_deg - 90.0)
        v_mag += rng.normal(0.0, 0.06)  # its own flicker
        mag = v_mag - (satellite.v_r_mag if band.name == "R" else 0.0)
        sky_rng = np.random.default_rng([seed, 5, index, i])
        cloud_mag = float(sky_rng.uniform(0.1, 1.0)) if sky_rng.random() < args.cloudy else 0.0
        through = 10.0 ** (-0.4 * cloud_mag)
        psf = seeing(rng, mass)
        light_e = sky_e(camera, rng, band, satellite.exptime_s)

        rotation_deg = ROTATION_DEG + ROTATION_STEP_DEG * folder.number / 10.0
        matrix = precession(middle).T @ nutation(middle)
        centre = matrix @ toward
        centre /= np.linalg.norm(centre)
        axes = sky_axes(centre)
        x_px, y_px = (0.5 * (n - 1) + rng.normal(0.0, args.jitter) for n in (camera.cols, camera.rows))
        # the camera keeps its angle to north while it follows the satellite: the centre of the frame at moments of the exposure
        moments = [start + timedelta(seconds=f * satellite.exptime_s) for f in np.linspace(0.0, 1.0, 9)]
        followed = [matrix @ orbit.look(t)[0] for t in moments]
        step_px = -to_pixels(*((followed[-1] - followed[0]) @ a for a in axes), rotation_deg)
        box_px = np.array([camera.cols, camera.rows]) + abs(step_px) + 80.0
        star_v_mag, b_v_mag, v_r_mag = random_stars(rng, float(np.prod(box_px)) * (SCALE_ARCSEC / 3600.0) ** 2)
        middle_px = (rng.random((len(star_v_mag), 2)) - 0.5) * box_px + 0.5 * np.array([camera.cols, camera.rows])
        star_mag = star_v_mag - (v_r_mag if band.name == "R" else 0.0)
        # where the stars are seen in the middle of the exposure, and from there at every moment
        back = middle_px - [x_px, y_px]
        c, s = math.cos(math.radians(rotation_deg)), math.sin(math.radians(rotation_deg))
        plane = -np.radians(np.stack([c * back[:, 0] + s * back[:, 1], -s * back[:, 0] + c * back[:, 1]], axis=-1) * SCALE_ARCSEC / 3600.0)
        seen = centre + plane[:, :1] * axes[0] + plane[:, 1:] * axes[1]
        seen /= np.linalg.norm(seen, axis=1)[:, None]
        places_px = np.stack([to_pixels(*(seen @ a / (seen @ toward_t) for a in sky_axes(toward_t)), rotation_deg)
                              for toward_t in followed]) + [x_px, y_px]
        draw_trails(light_e, psf, places_px, through * rate_e_s(band, star_mag, b_v_mag, mass) * satellite.exptime_s)
        # a catalogue knows no aberration
        velocity = matrix @ earth_velocity(middle)
        places = seen - velocity
        places /= np.linalg.norm(places, axis=1)[:, None]
        catalogue += catalogue_rows(np.random.default_rng([seed, 6, index, i]), len(catalogue), zip(places, star_v_mag, b_v_mag, v_r_mag))
        ra_deg, dec_deg = ra_dec_deg((centre - velocity) / np.linalg.norm(centre - velocity))
        flux_e = through * rate_e_s(band, mag, satellite.b_v_mag, mass) * satellite.exptime_s
        size_px = [math.degrees(m * 1e-3 / range_km) * 3600.0 / SCALE_ARCSEC for m in satellite.size_m]
        if satellite.shape == "point":
            draw_star(light_e, psf, x_px, y_px, flux_e, 64)
        else:
            draw_body(light_e, psf, x_px, y_px, flux_e, size_px, satellite.shape, 40.0 + 0.2 * i)
        counts = camera.read(rng, light_e * camera.response[band.name], satellite.exptime_s)
        stamped = request + timedelta(seconds=args.clock_error)
        name = folder.write("LIGHT", counts, stamped, satellite.exptime_s, rng, band, satellite.name, ra_dec_deg(centre))
        truth.append({"file": name, "satellite": satellite.name, "norad_cat_id": satellite.norad_cat_id, "filter": band.name,
                      "mid_time_utc": middle.isoformat(timespec="milliseconds"), "exptime_s": satellite.exptime_s,
                      "mag": f"{mag:.5f}", "x_px": f"{x_px:.3f}", "y_px": f"{y_px:.3f}", "flux_e": f"{flux_e:.1f}",
                      "airmass": f"{mass:.5f}", "alt_deg": f"{alt_deg:.4f}", "az_deg": f"{az_deg:.4f}",
                      "range_km": f"{range_km:.3f}", "phase_angle_deg": f"{phase_deg:.3f}", "fwhm_px": f"{psf.fwhm_px:.4f}",
                      "trail_px": f"{np.hypot(*step_px):.1f}", "cloud_mag": f"{cloud_mag:.4f}",
                      "ra_deg": f"{ra_deg:.7f}", "dec_deg": f"{dec_deg:.7f}"})
    return truth


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="folder to write to; it must not exist or be empty")
    parser.add_argument("--seed", type=int, default=1, help="seed of every random number (default %(default)s)")
    parser.add_argument("--size", default="600x500", help="columns x rows of the frames (default %(default)s)")
    parser.add_argument("--targets", type=int, default=20, help="target frames of each satellite and filter (default %(default)s)")
    parser.add_argument("--stars", type=int, default=2, help="star frames of each pointing and filter (default %(default)s)")
    parser.add_argument("--fainter", type=float, default=0.0, metavar="MAG",
                        help="make the satellites fainter by so much, and points (default: as they are)")
    parser.add_argument("--cloudy", type=float, default=0.0, metavar="FRAC", help="share of the target frames under cloud")
    parser.add_argument("--clock-error", type=float, default=0.0, metavar="S", help="how late the clock of the target frames is")
    parser.add_argument("--trail", type=float, default=1.0, metavar="FACTOR", help="factor on the exposure times of target frames")
    parser.add_argument("--jitter", type=float, default=5.0, metavar="PX",
                        help="scatter of the satellite about the middle of the frame (default %(default)s)")
    parser.add_argument("--flats", type=int, default=9, help="flats of each filter (default %(default)s)")
    parser.add_argument("--biases", type=int, default=15, help="bias frames (default %(default)s)")
    parser.add_argument("--darks", type=int, default=7, help="darks of either exposure (default %(default)s)")
    args = parser.parse_args()
    cols, rows = (int(n) for n in args.size.lower().split("x"))
    if args.out.exists() and any(args.out.iterdir()):
        raise SystemExit(f"{args.out} is not empty")
    (args.out / "truth").mkdir(parents=True, exist_ok=True)

    camera, folder = Camera(args.seed, cols, rows), Folder(args.out, rows, cols)
    draw_calibration(folder, camera, args.seed, vars(args))
    catalogue, star_truth = draw_star_fields(folder, camera, args.seed, args.stars)
    target_truth = []
    for index, satellite in enumerate(SATELLITES):
        satellite = replace(satellite, v_1000km_mag=satellite.v_1000km_mag + args.fainter, exptime_s=args.trail * satellite.exptime_s,
                            shape="point" if args.fainter else satellite.shape)
        target_truth += draw_targets(folder, camera, args.seed, satellite, index, args.targets, catalogue, args)
    (args.out / "elements.tle").write_text(ELEMENTS)
    write_csv(args.out / "catalogue.csv", catalogue)
    write_csv(args.out / "truth" / "truth.csv", target_truth)
    write_csv(args.out / "truth" / "star_frames.csv", star_truth)
    write_csv(args.out / "truth" / "bands.csv", [
        {"filter": b.name, "zp_mag": b.zp_mag, "k_mag_airmass": b.k_mag_airmass, "c_mag_mag": b.c_mag_mag} for b in BANDS])
    print(f"{folder.number} frames and {len(catalogue)} catalogue stars in {args.out}, truth in {args.out / 'truth'}")


if __name__ == "__main__":
    main()
