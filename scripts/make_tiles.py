"""Tile-compressed and odd plain FITS files for tests/frames/tiles.rs, written by astropy (BSD-3), with the values astropy reads.

usage: python scripts/make_tiles.py tests/data/tiles

Writes NAME.fits and prints `NAME sum weighted nan`: the sum of the finite pixels, the sum of pixel times (1 + its
number in rows mod 97), and the number of undefined pixels, each pixel rounded to float32 first.
"""
import sys
import warnings

import numpy as np
from astropy.io import fits

warnings.simplefilter("ignore")
folder = sys.argv[1]
ny, nx = 23, 31
j, i = np.mgrid[0:ny, 0:nx]
rng = np.random.default_rng(7)
noise = rng.integers(-40, 40, (ny, nx))
counts = 1000 + 3 * i + 5 * j + noise
floats = (1000 + 0.37 * i - 0.11 * j + rng.normal(0, 2, (ny, nx))).astype("f4")
holes = floats.copy()
holes[3, 4:9] = np.nan


def told(name):
    with fits.open(f"{folder}/{name}.fits") as f:
        hdu = next(h for h in f if h.data is not None)
        image = np.squeeze(hdu.data)
        v = image.astype("f4").astype("f8").ravel()
    ok = np.isfinite(v)
    weight = 1 + np.arange(v.size) % 97
    print(f'    ("{name}", {float(v[ok].sum())!r}, {float((v * weight)[ok].sum())!r}, {int((~ok).sum())}),')


def tiles(name, data, how, tile=None, **more):
    f = fits.HDUList([fits.PrimaryHDU(), fits.CompImageHDU(data, compression_type=how, tile_shape=tile, **more)])
    f.writeto(f"{folder}/{name}.fits", overwrite=True, checksum=True)
    told(name)


for how in ["RICE_1", "GZIP_1", "GZIP_2", "PLIO_1", "HCOMPRESS_1", "NOCOMPRESS"]:
    tag = how.split("_")[0].lower() + ("2" if how == "GZIP_2" else "")
    tile = (23, 31) if how == "HCOMPRESS_1" else None
    if how != "PLIO_1":
        tiles(f"{tag}_u16", counts.astype("u2"), how, tile)
    tiles(f"{tag}_i16", counts.astype("i2"), how, tile)
    tiles(f"{tag}_i32", counts.astype("i4") if how == "PLIO_1" else (counts * 9173 - 9_000_000).astype("i4"), how, tile)
    tiles(f"{tag}_u8", (counts % 251).astype("u1"), how, tile)
    if how in ("RICE_1", "GZIP_1", "GZIP_2", "HCOMPRESS_1"):
        tiles(f"{tag}_f32", floats, how, tile, quantize_level=16, quantize_method=1, dither_seed=37)
tiles("rice_f32_exact_zeros", np.where(i == j, 0, floats).astype("f4"), "RICE_1", quantize_method=2, dither_seed=9999)
tiles("rice_f32_no_dither", floats, "RICE_1", quantize_method=-1)
tiles("rice_f32_nan", holes, "RICE_1", quantize_method=1, dither_seed=1)
tiles("rice_f64", floats.astype("f8"), "RICE_1", quantize_method=1, dither_seed=5)
tiles("gzip_f32_lossless", holes, "GZIP_1", quantize_level=0)
tiles("gzip2_f64_lossless", holes.astype("f8") * 1e-30, "GZIP_2", quantize_level=0)
# a constant row cannot be quantised: astropy stores it without loss in another column
flat_row = floats.copy()
flat_row[5] = 7.25
tiles("rice_f32_fallback", flat_row, "RICE_1", quantize_method=1, dither_seed=3)
tiles("rice_squares", counts.astype("u2"), "RICE_1", (7, 8))
tiles("gzip_whole", counts.astype("i4"), "GZIP_1", (23, 31))
tiles("hcompress_squares", counts.astype("i2"), "HCOMPRESS_1", (8, 16))
tiles("hcompress_lossy_smooth", counts.astype("i2"), "HCOMPRESS_1", (23, 31), hcomp_scale=4, hcomp_smooth=1)
tiles("hcompress_lossy", counts.astype("i2"), "HCOMPRESS_1", (23, 31), hcomp_scale=4, hcomp_smooth=0)
tiles("rice_cube", counts.astype("i2")[None], "RICE_1", (1, 1, 31))

for bitpix, kind in [(8, "u1"), (16, "i2"), (32, "i4"), (64, "i8"), (-32, "f4"), (-64, "f8")]:
    data = (counts % 251 if bitpix == 8 else counts * (1 if bitpix == 16 else 7001)).astype(kind)
    fits.PrimaryHDU(data).writeto(f"{folder}/plain_{kind}.fits", overwrite=True, checksum=True)
    told(f"plain_{kind}")
for kind in ["u2", "u4", "u8", "i1"]:
    data = (counts % 120 if kind == "i1" else counts * (1 if kind == "u2" else 70001)).astype(kind)
    fits.HDUList([fits.PrimaryHDU(), fits.ImageHDU(data)]).writeto(f"{folder}/plain_{kind}.fits", overwrite=True, checksum=True)
    told(f"plain_{kind}")
scaled = fits.PrimaryHDU(counts.astype("i2"))
scaled.header["BSCALE"], scaled.header["BZERO"], scaled.header["BLANK"] = 0.25, -17.5, 1011
scaled.writeto(f"{folder}/plain_scaled.fits", overwrite=True, checksum=True)
told("plain_scaled")
fits.PrimaryHDU(holes[None]).writeto(f"{folder}/plain_cube.fits", overwrite=True, checksum=True)
told("plain_cube")

# tiles higher than the 64 rows that are read at once: 24 columns, 150 rows
y, x = np.mgrid[:150, :24]
tall = (500 + 3 * x + 7 * y + (x * y) % 61).astype("u2")
tiles("tall_rice_u16", tall, "RICE_1", (150, 24))
tiles("tall_squares_u16", tall, "RICE_1", (100, 10))
tiles("tall_hcompress_u16", tall, "HCOMPRESS_1", (150, 24))
tiles("tall_gzip_f32", (tall / 8).astype("f4"), "GZIP_1", (150, 24), quantize_level=0)
tiles("tall_rice_f32", (tall / 8).astype("f4"), "RICE_1", (75, 24), quantize_level=16, quantize_method=1, dither_seed=37)
