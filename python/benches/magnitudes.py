"""CPU time and memory of many magnitudes of a two-surface model: this package, lumos-sat and the program.

    python benches/magnitudes.py [--rows 1000000] [--peer-rows 2000] [--program PATH]

Three measurements, each in a process of its own, so that its memory is its own:

1. satellites and moments: `rows` rows of a thousand satellites, geometry and four lights;
2. the same directions of one sky by this package and by lumos-sat 1.0.9, direct and
   Earth-reflected sunlight of a chassis and an array; lumos-sat takes one Sun a call, and the rows are its alone: it is
   measured with `peer-rows` of them;
3. one satellite at the moments of `satphot predict pass`, by this package and by the program, which also writes them.

CPU is user and system time of all threads; imports are not counted. Without lumos-sat or the program their lines are left
out. numpy and this package are needed.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

import numpy as np  # noqa: E402

SITE = (-33.7703, 151.1113, 70.0)
LINE2 = "2 {number:05d}  53.0500 {node:8.4f} 0001632 195.4618 {anomaly:8.4f} 15.06000000 1000"
LINE1 = "1 {number:05d}U 20001A   25160.00000000  .00000000  00000+0  00000+0 0  999"
R_KM, H_KM, AU_KM, SUN_ALT_DEG, SUN_AZ_DEG = 6378.0, 550.0, 149_597_870.7, -10.0, 90.0
KD, KS, N = 0.3, 0.2, 8.0


def checked(line):
    """The line with its checksum."""
    return line + str(sum(int(c) if c.isdigit() else c == "-" for c in line) % 10)


def shell(n):
    """Elements of n satellites on circular orbits."""
    lines = []
    for i in range(n):
        node, anomaly = 360.0 * (i % 40) / 40, 360.0 * i / n
        lines += [checked(LINE1.format(number=10_000 + i)), checked(LINE2.format(number=10_000 + i, node=node, anomaly=anomaly))]
    return "\n".join(lines) + "\n"


def clock():
    """CPU seconds of this process and of those it has waited for."""
    both = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(usage.ru_utime + usage.ru_stime for usage in both)


def measured(work):
    """What `work` returns, CPU and wall seconds of it, and the largest memory of the process [MB], before and after."""
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    cpu, wall = clock(), time.perf_counter()
    result = work()
    cost = {"cpu_s": clock() - cpu, "wall_s": time.perf_counter() - wall}
    after = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return result, {**cost, "memory_before_mb": before, "memory_mb": after}


def model(**settings):
    import satphot

    law = {"kind": "phong", "kd": KD, "ks": KS, "n": N}
    surfaces = [
        {"name": "chassis", "area_m2": 3.65, "attitude": "nadir", "brdf": law},
        {"name": "array", "area_m2": 22.0, "attitude": "sun_azimuth", "brdf": law},
    ]
    return satphot.Model("two surfaces", surfaces=surfaces, **settings)


def satellites(rows):
    """Many satellites at many moments."""
    elements = shell(1000)
    times = np.datetime64("2025-06-09T08:00:00") + np.arange(max(1, rows // 1000)) * np.timedelta64(4, "s")
    table, cost = measured(lambda: model().magnitudes(elements, SITE, times))
    lit = int(np.isfinite(table["model_v_mag"]).sum())
    return {"rows": table.n_rows, "with_light": lit, **cost}


def directions(rows):
    """Directions spread over the sky, at 5 deg altitude and above."""
    n = np.arange(rows)
    lowest = np.sin(np.radians(5.0))
    alt_deg = np.degrees(np.arcsin(lowest + (1 - lowest) * (n + 0.5) / rows))
    return alt_deg, (n * 137.507764) % 360.0


def unit(alt_deg, az_deg):
    """Up, east and north of a direction: axes of the Earth under an observer on its x axis."""
    alt, az = np.radians(alt_deg), np.radians(az_deg)
    return np.stack([np.sin(alt), np.cos(alt) * np.sin(az), np.cos(alt) * np.cos(az)], axis=-1)


def vectors(alt_deg, az_deg):
    sight = unit(alt_deg, az_deg)
    up = R_KM * sight[:, :1]
    satellite = np.array([R_KM, 0.0, 0.0]) + sight * (-up + np.sqrt(up**2 + 2 * R_KM * H_KM + H_KM**2))
    return satellite, np.array([R_KM, 0.0, 0.0]), AU_KM * unit(SUN_ALT_DEG, SUN_AZ_DEG), np.array([-3.844e5, 0.0, 0.0])


def sky(rows, tolerance):
    """The sunlit sky by this package."""
    own = model(mode="as_published", tolerance=tolerance)
    alt_deg, az_deg = directions(rows)

    def work():
        satellite, observer, sun, moon = vectors(alt_deg, az_deg)
        table = own.magnitudes_of_vectors(satellite, observer, sun, moon, velocity_km_s=(0.0, 7.6, 0.0))
        lights = [10 ** (-0.4 * table[name]) for name in ("sun_v_mag", "earthshine_v_mag")]
        return np.nansum(lights, axis=0)

    flux, cost = measured(work)
    return {"rows": rows, **cost, "flux": flux[:200].tolist() if rows <= 100_000 else []}


def peer(rows):
    """The same by lumos-sat."""
    import lumos.calculator
    import lumos.constants
    import lumos.conversions
    import lumos.functions
    import lumos.geometry
    from lumos.brdf import library

    law = library.PHONG(KD, KS, N)
    normals = [(3.65, np.array([0.0, 0.0, -1.0])), (22.0, np.array([0.0, 1.0, 0.0]))]
    surfaces = [lumos.geometry.Surface(area_m2, normal, law) for area_m2, normal in normals]
    alt_deg, az_deg = directions(rows)
    earth = library.PHONG(0.53, 0.28, 7.31)
    flux, cost = measured(
        lambda: lumos.calculator.get_intensity_observer_frame(
            surfaces, 1e3 * H_KM, alt_deg, az_deg, SUN_ALT_DEG, SUN_AZ_DEG, True, True, 150, earth
        )
    )
    return {"rows": rows, **cost, "flux": flux.ravel()[:200].tolist()}


PASS_TLE = """ISS (ZARYA)
1 25544U 98067A   25159.07052714  .00008601  00000+0  15816-3 0  9996
2 25544  51.6400 352.2516 0001632 195.4618 310.3088 15.50064259513748
"""


def program(path, step_s):
    """The program, and the moments of its rows."""
    with tempfile.TemporaryDirectory() as folder:
        elements = os.path.join(folder, "iss.tle")
        with open(elements, "w", encoding="utf-8") as file:
            file.write(PASS_TLE)
        command = [path, "predict", "pass", "--elements", elements, "--site", ",".join(map(str, SITE)), "--satellite", "iss"]
        command += ["--start", "2025-06-09T00:00:00", "--hours", "48", "--step-s", str(step_s), "--csv", "-q"]
        out, cost = measured(lambda: subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    times = [line.split(",", 1)[0] for line in out.splitlines()[1:]]
    cost["memory_mb"] = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
    return {"rows": len(times), **cost, "times": times}


def same_rows(times):
    """The same moments by this package."""
    import satphot

    moments = np.array([text.rstrip("Z") for text in times], dtype="datetime64[ns]")
    table, cost = measured(lambda: satphot.Model("iss").magnitudes(PASS_TLE, SITE, moments))
    return {"rows": table.n_rows, **cost}


def alone(name, *arguments, given=None):
    """A measurement in a process of its own."""
    command = [sys.executable, os.path.abspath(__file__), "--only", name, *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, input=json.dumps(given))
    if done.returncode:
        return None if "No module named" in done.stderr else sys.exit(done.stderr)
    return json.loads(done.stdout)


def line(name, result):
    per_row = 1e6 * result["cpu_s"] / result["rows"]
    print(
        f"{name:<46} {result['rows']:>9} rows  CPU {result['cpu_s']:8.2f} s  wall {result['wall_s']:8.2f} s  "
        f"{per_row:10.2f} us CPU/row  memory {result['memory_mb']:7.0f} MB (before {result['memory_before_mb']:.0f})",
        flush=True,
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rows", type=int, default=1_000_000)
    parser.add_argument("--peer-rows", type=int, default=2000)
    parser.add_argument("--program", default="")
    parser.add_argument("--step-s", type=float, default=0.1)
    parser.add_argument("--only", nargs="+", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.only:
        name, *rest = options.only
        one = {
            "satellites": lambda: satellites(int(rest[0])),
            "sky": lambda: sky(int(rest[0]), float(rest[1])),
            "peer": lambda: peer(int(rest[0])),
            "program": lambda: program(rest[0], float(rest[1])),
            "same_rows": lambda: same_rows(json.load(sys.stdin)),
        }[name]
        print(json.dumps(one()))
        return
    line("1000 satellites, geometry and four lights", alone("satellites", options.rows))
    line("sky, two surfaces, tolerance 1e-3", alone("sky", options.rows, 1e-3))
    theirs = alone("peer", options.peer_rows)
    ours = alone("sky", options.peer_rows, 1e-3)
    line("sky, two surfaces, the rows of lumos-sat", ours)
    if theirs is None:
        print("lumos-sat is not installed")
    else:
        line("lumos-sat, 150 x 150 panels of the Earth", theirs)
        a, b = np.array(ours["flux"]), np.array(theirs["flux"])
        both = (a > 0) & (b > 0)
        ratio = -2.5 * np.log10(a[both] / b[both])
        spread = np.ptp(ratio - np.median(ratio))
        print(f"{both.sum()} directions lit in both; largest difference in magnitude but for a constant {spread:.4f}")
        print(f"CPU of a row, lumos-sat over this package: {theirs['cpu_s'] / ours['cpu_s']:.0f}")
    if options.program:
        theirs = alone("program", options.program, options.step_s)
        line("program, predict pass --csv", theirs)
        line("the same moments", alone("same_rows", given=theirs["times"]))


if __name__ == "__main__":
    main()
