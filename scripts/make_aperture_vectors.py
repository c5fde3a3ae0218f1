"""Writes tests/data/aperture_vectors.csv: aperture sums by photutils and sep, the oracle of tests/photometry_aperture.rs.

    python scripts/make_aperture_vectors.py     (needs numpy, photutils >= 2, sep >= 1.4)

The image is a formula, so that the test makes it itself: 160 columns, 120 rows,
    p = floor(1000 * (1.5 + sin(0.37 i) * cos(0.23 j) + ((7 i + 13 j) mod 17) / 17)),
whole numbers below 2^24, so that programs that read pixels as f32 see the same image.
sep's sums are left empty where it cannot serve: for a centre off the frame (it gives 0 and a flag) and for a circle
inside the very pixel it is centred on (it gives up to 126 times too much; photutils gives pi r^2 p, as it should).
"""
import csv
import pathlib

import numpy as np
import sep
from photutils.aperture import CircularAperture, EllipticalAperture

NX, NY = 160, 120
i, j = np.meshgrid(np.arange(NX), np.arange(NY))
image = np.floor(1000 * (1.5 + np.sin(0.37 * i) * np.cos(0.23 * j) + ((7 * i + 13 * j) % 17) / 17)).astype("f8")
rng = np.random.default_rng(20250609)

rows = []
for r in [0.05, 0.3, 0.5, 0.7071067811865476, 1.0, 1.5, 2.5, 3.7, 5.0, 8.0, 13.3, 20.0, 33.0, 50.0, 77.7]:
    for x, y in [(80, 60), (80.5, 60.5), (80.5, 60.0), *(rng.uniform(20, 100, (5, 2)))]:
        rows.append(("circle", x, y, r, r, 0.0))
for x, y, r in [(0, 0, 5), (-0.5, -0.5, 7), (159.5, 119.5, 4.4), (-3.2, 60, 6), (80, 121.7, 5), (159, 3, 12), (80, 60, 120)]:
    rows.append(("circle", x, y, r, r, 0.0))
for a, b in [(0.6, 0.2), (2, 1), (5, 3), (12, 2), (20, 15), (40, 6), (60, 15)]:
    for theta in [0.0, 0.3, np.pi / 4, 1.2, np.pi / 2, -1.0, -0.05]:
        x, y = rng.uniform(30, 90, 2)
        rows.append(("ellipse", x, y, a, b, theta))
for x, y, a, b, theta in [(80.5, 60.5, 9, 4, 0.5), (2, 3, 20, 5, 0.7), (155, 110, 30, 4, -0.4), (80, 60, 200, 70, 0.1)]:
    rows.append(("ellipse", x, y, a, b, theta))
for _ in range(24):
    a = rng.uniform(0.5, 30)
    rows.append(("ellipse", *rng.uniform(20, 100, 2), a, a * rng.uniform(0.1, 1), rng.uniform(-np.pi / 2, np.pi / 2)))

out = pathlib.Path(__file__).resolve().parent.parent / "tests/data/aperture_vectors.csv"
worst = 0.0
with out.open("w", newline="") as f:
    f.write(f"# photutils exact and sep {sep.__version__} exact sums; made by scripts/make_aperture_vectors.py\n")
    w = csv.writer(f, lineterminator="\n")
    w.writerow(["shape", "x_px", "y_px", "a_px", "b_px", "theta_rad", "photutils", "sep"])
    for shape, x, y, a, b, t in rows:
        x, y, a, b, t = map(float, (x, y, a, b, t))
        ap = CircularAperture((x, y), a) if shape == "circle" else EllipticalAperture((x, y), a, b, theta=t)
        p = float(ap.do_photometry(image, method="exact")[0][0])
        on_frame = 0 <= x < NX and 0 <= y < NY
        in_one_pixel = shape == "circle" and a + max(abs(x - round(x)), abs(y - round(y))) <= 0.5
        s = None
        if on_frame and not in_one_pixel:
            if shape == "circle":
                s = float(sep.sum_circle(image, [x], [y], a, subpix=0)[0][0])
            else:
                s = float(sep.sum_ellipse(image, [x], [y], [a], [b], [t], r=1.0, subpix=0)[0][0])
            worst = max(worst, abs(s / p - 1))
        w.writerow([shape, repr(x), repr(y), repr(a), repr(b), repr(t), repr(p), "" if s is None else repr(s)])
print(f"{len(rows)} apertures; worst |sep/photutils - 1| = {worst:.2e}")
