"""Writes tests/data/aperture_vectors.csv: aperture sums by photutils, sep and shapely, the oracle of tests/photometry/aperture.rs.

    python scripts/make_aperture_vectors.py     (needs numpy, photutils >= 2, sep >= 1.4, shapely >= 2)

The image is a formula, so that the test makes it itself: 160 columns, 120 rows,
    p = floor(1000 * (1.5 + sin(0.37 i) * cos(0.23 j) + ((7 i + 13 j) mod 17) / 17)),
whole numbers below 2^24, so that programs that read pixels as f32 see the same image.
sep's sums are left empty where it cannot serve: for a centre off the frame (it gives 0 and a flag) and for a circle
inside the very pixel it is centred on (it gives up to 126 times too much; photutils gives pi r^2 p, as it should).
Rectangles and pills are shapely's (GEOS) intersections with every pixel: photutils' "exact" rectangle counts 32 x 32
subpixels, and no peer has a pill. Its caps are polygons of 8000 corners whose radius is enlarged so that the area is
the disc's: right to 1e-9.
"""
import csv
import pathlib

import numpy as np
import sep
import shapely
from shapely import affinity
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



def bar(shape, x, y, a, b, t):
    """A rectangle, or a segment grown by b."""
    if shape == "rectangle":
        flat = shapely.box(-a, -b, a, b)
    else:
        step = np.pi / 2 / 2000
        flat = shapely.LineString([(b - a, 0), (a - b, 0)]) if a > b else shapely.Point(0, 0)
        flat = flat.buffer(b * np.sqrt(step / np.sin(step)), quad_segs=2000)
        if a > b:
            flat = flat.intersection(shapely.box(-2 * a, -b, 2 * a, b)).union(shapely.box(b - a, -b, a - b, b))
    return affinity.translate(affinity.rotate(flat, t, origin=(0, 0), use_radians=True), x, y)


boxes = shapely.box(i - 0.5, j - 0.5, i + 0.5, j + 0.5)
bars = []
for shape in ["rectangle", "pill"]:
    for a, b in [(0.3, 0.1), (0.7, 0.45), (2, 1), (5, 5), (12, 2), (40, 6), (60, 0.02), (300, 3)]:
        for t in [0.0, 0.3, np.pi / 4, np.pi / 2, -1.0, 2.5]:
            bars.append((shape, *rng.uniform(30, 90, 2), a, b, t))
    for x, y, a, b, t in [(80, 60, 10, 3, 0.0), (80.5, 60.5, 10.5, 2.5, np.pi / 2), (2, 3, 20, 5, 0.7), (-4, 60, 8, 4, 1.0), (155, 110, 30, 4, -0.4)]:
        bars.append((shape, x, y, a, b, t))

out = pathlib.Path(__file__).resolve().parent.parent / "tests/data/aperture_vectors.csv"
worst = 0.0
with out.open("w", newline="") as f:
    f.write(f"# photutils exact and sep {sep.__version__} exact sums, shapely {shapely.__version__}; made by scripts/make_aperture_vectors.py\n")
    w = csv.writer(f, lineterminator="\n")
    w.writerow(["shape", "x_px", "y_px", "a_px", "b_px", "theta_rad", "photutils", "sep", "shapely"])
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
        w.writerow([shape, repr(x), repr(y), repr(a), repr(b), repr(t), repr(p), "" if s is None else repr(s), ""])
    for shape, x, y, a, b, t in bars:
        x, y, a, b, t = map(float, (x, y, a, b, t))
        total = float((shapely.area(shapely.intersection(boxes, bar(shape, x, y, a, b, t))) * image).sum())
        w.writerow([shape, repr(x), repr(y), repr(a), repr(b), repr(t), "", "", repr(total)])
print(f"{len(rows)} + {len(bars)} apertures; worst |sep/photutils - 1| = {worst:.2e}")
