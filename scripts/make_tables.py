"""Writes tests/data/tables: FITS tables as astropy, BANZAI, SExtractor and stellarphot make them, small.

Stars: V = V_inst - ZP - k X - C (B-V) without noise, ZP = -23.37, k = 0.12, C = 0.08, V_inst of electrons per second.
Observations: the ISS over Macquarie on 2025-06-09, times in TAI, angles in radians.

    python3 scripts/make_tables.py        (astropy 6 or later)
"""

from pathlib import Path

import astropy.units as u
import numpy as np
from astropy.io import fits
from astropy.table import MaskedColumn, QTable
from astropy.time import Time

FOLDER = Path(__file__).resolve().parent.parent / "tests" / "data" / "tables"
ZP, K, C = -23.37, 0.12, 0.08


def stars(n=48):
    """n stars in 6 fields: V, B-V, airmass, field, electrons per second."""
    i = np.arange(n)
    v = 9.0 + 0.1 * i
    b_v = 0.2 + 0.02 * ((7 * i) % 40)
    airmass = 1.0 + 0.15 * (i % 6)
    inst = v + ZP + K * airmass + C * b_v
    return v, b_v, airmass, i % 6, 10 ** (-0.4 * inst)


def write(name, hdus):
    fits.HDUList(hdus).writeto(FOLDER / name, overwrite=True, checksum=False)


def column(name, form, array, unit=None, **more):
    return fits.Column(name=name, format=form, array=array, unit=unit, **more)


def banzai():
    """BANZAI: the image in a compressed extension, the catalogue in CAT; the matched columns are ours."""
    v, b_v, airmass, field, e_s = stars()
    image = fits.CompImageHDU(np.arange(64, dtype="f4").reshape(8, 8), name="SCI")
    table = fits.BinTableHDU.from_columns(
        [
            column("x", "D", 10.0 + np.arange(len(v)), "pixel"),
            column("y", "D", 20.0 + np.arange(len(v)), "pixel"),
            column("flux", "D", 30.0 * e_s, "count"),
            column("fluxerr", "D", 0.3 * e_s, "count"),
            column("ra", "D", 150.0 + 0.01 * np.arange(len(v)), "degree"),
            column("dec", "D", -30.0 + 0.0 * v, "degree"),
            column("flag", "B", np.zeros(len(v), dtype="u1")),
            column("cat_v_mag", "D", v, "mag"),
            column("cat_b_v_mag", "D", b_v, "mag"),
            column("airmass", "D", airmass),
            column("field_id", "J", field),
        ],
        name="CAT",
    )
    bpm = fits.CompImageHDU(np.zeros((8, 8), dtype="u1"), name="BPM")
    write("banzai.fits", [fits.PrimaryHDU(), image, table, bpm])


def ldac():
    """FITS_LDAC of SExtractor: the header as a table of one cell before the objects; an aperture of three."""
    v, b_v, airmass, field, e_s = stars()
    cards = [f"{card:80s}" for card in ["SIMPLE  =                    T", "OBJECT  = 'field'", "END"]]
    head = fits.Column(name="Field Header Card", format="240A", array=np.array([cards]), dim="(80, 3)")
    imhead = fits.BinTableHDU.from_columns([head], name="LDAC_IMHEAD")
    mag = -2.5 * np.log10(e_s)
    aper = np.stack([0.8 * e_s, 0.9 * e_s, e_s], axis=1).astype("f4")
    objects = fits.BinTableHDU.from_columns(
        [
            column("NUMBER", "J", np.arange(1, len(v) + 1)),
            column("MAG_AUTO", "D", mag, "mag"),
            column("MAGERR_AUTO", "E", np.full(len(v), 0.01), "mag"),
            column("FLUX_APER", "3E", aper, "count"),
            column("ALPHA_J2000", "D", 150.0 + 0.01 * np.arange(len(v)), "deg"),
            column("DELTA_J2000", "D", -30.0 + 0.0 * v, "deg"),
            column("Vmag", "D", v, "mag"),
            column("B-V", "D", b_v, "mag"),
            column("AIRMASS", "D", airmass),
            column("FIELD_ID", "J", field),
        ],
        name="LDAC_OBJECTS",
    )
    write("ldac.fits", [fits.PrimaryHDU(), imhead, objects])


def stellarphot():
    """stellarphot: a QTable with units, a Time, a masked column; exposures in minutes, altitudes in radians."""
    v, b_v, airmass, field, e_s = stars()
    table = QTable()
    table["star_id"] = np.array([f"s{i}" for i in range(len(v))])
    table["aperture_net_cnts"] = 60.0 * e_s * u.electron
    table["noise_electrons"] = MaskedColumn(0.6 * e_s, mask=[i == 5 for i in range(len(v))])
    table["exposure"] = np.full(len(v), 1.0) * u.min
    # 1/sin is within 0.003 of the airmass of Kasten & Young 1989 here
    table["altitude"] = np.arcsin(1 / airmass) * u.rad
    table["cat_v_mag"] = 1000 * v * u.mmag
    table["cat_b_v_mag"] = b_v * u.mag
    table["passband"] = np.full(len(v), "V")
    table["date-obs"] = Time(60835.5 + 0.01 * field, format="mjd", scale="utc")
    table["file"] = np.array([f"frame{f}.fits" for f in field])
    table.write(FOLDER / "stellarphot.fits", overwrite=True)


def observations():
    """A QTable of an observer: Time in TAI, angles in radians, a masked magnitude."""
    utc = Time(["2025-06-09T10:31:00", "2025-06-09T10:32:00", "2025-06-09T10:33:12", "2025-06-09T10:34:00"], scale="utc")
    table = QTable()
    table["satellite_name"] = np.full(4, "ISS (ZARYA)")
    table["norad_cat_id"] = np.full(4, 25544)
    table["time"] = utc.tai
    table["mag"] = MaskedColumn([12.1, 12.2, 12.5, 0.0], mask=[0, 0, 0, 1])
    table["pixels"] = np.arange(8.0).reshape(4, 2) * u.adu
    table.write(FOLDER / "observations_tai.fits", overwrite=True)
    table.write(FOLDER / "observations_tai.ecsv", overwrite=True)


def geometry():
    """A table of geometry, angles in radians and the height in metres, with their units."""
    table = QTable()
    table["sun_alt"] = np.radians([-10.0, -12.0, -20.0]) * u.rad
    table["sun_az"] = np.radians([90.0, 95.0, 100.0]) * u.rad
    table["sat_alt"] = np.radians([30.0, 45.0, 80.0]) * u.rad
    table["sat_az"] = np.radians([200.0, 300.0, 10.0]) * u.rad
    table["height"] = np.array([550e3, 550e3, 550e3]) * u.m
    table.write(FOLDER / "geometry_rad.fits", overwrite=True)
    table.write(FOLDER / "geometry_rad.vot", format="votable", overwrite=True)


if __name__ == "__main__":
    FOLDER.mkdir(parents=True, exist_ok=True)
    for make in [banzai, ldac, stellarphot, observations, geometry]:
        make()
