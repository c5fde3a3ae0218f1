"""Error against run time of other programs, for the curves that `satphot accuracy --python` draws with its own.

usage: python - SATPHOT METHOD quick|full < accuracy_peers.py
One line per setting: method,case,setting,n,median,p95,worst,cpu_us. What is not installed is skipped, with a line on
standard error. earth-reflected: lumos-sat; truth is `satphot predict geometry` at tolerance 1e-10.
apertures: photutils and sep; truth is the area. background-mesh: photutils and sep; truth is the sky put in.
CPU time of one thread, imports not counted.
"""
import csv
import io
import math
import os
import subprocess
import sys
import time

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")
import numpy as np  # noqa: E402

SATPHOT, METHOD, EFFORT = sys.argv[1:4]
QUICK = EFFORT == "quick"
R_KM, H_KM = 6378.0, 550.0


def tell(case, setting, off, cpu_s, pieces):
    off = np.sort(np.where(np.isfinite(off), np.abs(off), np.inf))
    rank = lambda share: off[max(math.ceil(share * len(off)), 1) - 1]
    print(f"{METHOD},{case},{setting},{len(off)},{rank(0.5):.6e},{rank(0.95):.6e},{off[-1]:.6e},{1e6 * cpu_s / pieces:.6e}")


def timed(work, least_s=0.02 if QUICK else 0.2):
    """The answer and the CPU time of one call."""
    answer, calls, start = work(), 1, time.process_time()
    while (used := time.process_time() - start) < least_s:
        work()
        calls += 1
    return answer, used / max(calls - 1, 1)


def earth_reflected():
    try:
        import lumos.constants, lumos.conversions, lumos.functions, lumos.geometry  # noqa: E401
        import lumos.calculator as calc
        from lumos.brdf import library
    except ImportError as missing:
        return print(f"lumos-sat: {missing}", file=sys.stderr)
    rng = np.random.default_rng(6)
    cases = []
    while len(cases) < (12 if QUICK else 60):
        elevation = np.radians(rng.uniform(-18.0, 40.0))
        theta, turn = rng.uniform(0, 0.95 * math.acos(R_KM / (R_KM + H_KM))), rng.uniform(0, 2 * math.pi)
        observer = R_KM * np.array([math.sin(theta) * math.cos(turn), math.sin(theta) * math.sin(turn), math.cos(theta)])
        cases.append((elevation, observer))
    laws = {
        "Lambert": (library.LAMBERTIAN(0.3), ("lambertian", 0.3, "", "")),
        "Phong n = 9": (library.PHONG(0.34, 0.4, 8.9), ("phong", 0.34, 0.4, 8.9)),
        "Phong n = 1e4": (library.PHONG(0.0, 1.0, 1e4), ("phong", 0.0, 1.0, 1e4)),
        "ABG of a painted plate": (library.ABG(0.003362, 4.309e-6, 2.068), ("abg", 0.003362, 4.309e-6, 2.068)),
    }
    ground = library.PHONG(0.53, 0.28, 7.31)
    for label, (law, ours) in laws.items():
        text = io.StringIO()
        out = csv.writer(text)
        names = "id height_m src_elev_deg obs_x_m obs_y_m obs_z_m nx ny nz area_m2 brdf p1 p2 p3 earth_brdf ep1 ep2 ep3"
        out.writerow(names.split())
        for k, (elevation, observer) in enumerate(cases):
            place = [repr(float(x)) for x in 1e3 * observer]
            out.writerow([k, 1e3 * H_KM, math.degrees(elevation), *place, 0, 0, -1, 1, *ours, "phong", 0.53, 0.28, 7.31])
        run = subprocess.run([SATPHOT, "predict", "geometry", "-", "--tolerance", "1e-10", "-q"], input=text.getvalue(), capture_output=True, text=True)
        truth = np.array([float(row["earth_per_E0"]) for row in csv.DictReader(io.StringIO(run.stdout))])
        surface = lumos.geometry.Surface(1.0, np.array([0.0, 0.0, -1.0]), law)
        for density in (25, 50, 100, 150, 300) if QUICK else (25, 50, 100, 150, 300, 600):
            def light(case):
                elevation, observer = case
                # the mesh of daylight is that of a Sun above the horizon: -E past the terminator
                return calc.get_intensity_satellite_frame([surface], 1e3 * H_KM, -elevation, 1e3 * observer, False, True, density, ground)
            got, cpu_s = timed(lambda: np.array([light(case) for case in cases]))
            lit = truth > 0
            tell(f"lumos-sat: {label}", density, got[lit] / lumos.constants.SUN_INTENSITY / truth[lit] - 1, cpu_s, len(cases))


def apertures():
    rng = np.random.default_rng(5)
    n, side = (200 if QUICK else 2000), 1024
    places = rng.uniform(120, side - 120, (n, 2))
    field = np.ones((side, side))
    shapes = [("circle r = 5 px", 5.0, 5.0), ("circle r = 20 px", 20.0, 20.0), ("ellipse 60 x 15 px", 60.0, 15.0)]
    try:
        import sep
        for label, a, b in shapes:
            for subpixels in (1, 5, 10, 0):
                work = lambda: sep.sum_ellipse(field, places[:, 0], places[:, 1], a, b, 0.5, 1.0, subpix=subpixels)[0]
                if a == b:
                    work = lambda: sep.sum_circle(field, places[:, 0], places[:, 1], a, subpix=subpixels)[0]
                got, cpu_s = timed(work)
                tell(f"sep: {label}", subpixels or "exact", got / (math.pi * a * b) - 1, cpu_s, n)
    except ImportError as missing:
        print(f"sep: {missing}", file=sys.stderr)
    try:
        from photutils.aperture import CircularAperture, EllipticalAperture, aperture_photometry
        for label, a, b in shapes:
            shape = CircularAperture(places, a) if a == b else EllipticalAperture(places, a, b, theta=0.5)
            for setting, how in (("1", {"method": "center"}), ("5", {"method": "subpixel", "subpixels": 5}), ("exact", {"method": "exact"})):
                got, cpu_s = timed(lambda: np.asarray(aperture_photometry(field, shape, **how)["aperture_sum"]))
                tell(f"photutils: {label}", setting, got / (math.pi * a * b) - 1, cpu_s, n)
    except ImportError as missing:
        print(f"photutils: {missing}", file=sys.stderr)


def background_mesh():
    rng = np.random.default_rng(11)
    side, sky_e = 1024, 60.0
    y, x = np.mgrid[0:side, 0:side]
    u, v = x / side - 0.5, y / side - 0.5
    sky = sky_e * (1 + 0.1 * u + 0.05 * v - 0.3 * (u * u + v * v))
    for label, stars in (("no stars", 0), ("1000 stars per Mpx", 1000)):
        frame = sky.copy()
        variance = (4.0 / 2.355) ** 2
        for _ in range(int(stars * side * side / 1e6)):
            x0, y0, flux = rng.uniform(0, side), rng.uniform(0, side), 500.0 * rng.uniform(0.01, 1.0) ** -1.3
            i = slice(max(int(x0) - 14, 0), int(x0) + 15), slice(max(int(y0) - 14, 0), int(y0) + 15)
            r2 = (x[i[1], i[0]] - x0) ** 2 + (y[i[1], i[0]] - y0) ** 2
            frame[i[1], i[0]] += flux / (2 * math.pi * variance) * np.exp(-0.5 * r2 / variance)
        frame = frame + np.sqrt(frame) * rng.standard_normal(frame.shape)
        at = np.s_[8::16, 8::16]
        off = lambda level: ((level - sky) / np.sqrt(sky))[at].ravel()
        megapixels = frame.size / 1e6
        try:
            import sep
            for mesh in (16, 32, 64, 128, 256):
                level, cpu_s = timed(lambda: sep.Background(frame, bw=mesh, bh=mesh).back())
                tell(f"sep: {label}", mesh, off(level), cpu_s, megapixels)
        except ImportError as missing:
            print(f"sep: {missing}", file=sys.stderr)
        try:
            from photutils.background import Background2D
            for mesh in (32, 64, 128) if QUICK else (16, 32, 64, 128, 256):
                level, cpu_s = timed(lambda: Background2D(frame, mesh).background)
                tell(f"photutils: {label}", mesh, off(level), cpu_s, megapixels)
        except ImportError as missing:
            print(f"photutils: {missing}", file=sys.stderr)


{"earth-reflected": earth_reflected, "apertures": apertures, "background-mesh": background_mesh}[METHOD]()
