"""The work of scripts/bench_lumos.sh, which says how to run it.

The sky: 90 altitudes (0 to 90 deg) x 180 azimuths (0 to 360 deg), h = 550 km, sphere of 6378 km, Sun at altitude
-10 deg and azimuth 90 deg, laboratory BRDFs, vegetation Earth, direct and Earth-reflected sunlight.
CPU is user + system time: of the whole process for satphot, of the computation alone for the peer (its imports are
not counted). Fref is satphot's own map at tolerance 1e-9; points of it are done again by the independent double
integration of make_brightness_vectors.py.
"""
import json
import os
import pathlib
import resource
import statistics
import subprocess
import sys
import tempfile
import time

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
import numpy as np  # noqa: E402

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import make_brightness_vectors as reference  # noqa: E402

SATPHOT, PEERS = os.environ["SATPHOT"], pathlib.Path(os.environ["SATPHOT_PEERS"])
LUMOS = os.environ.get("LUMOS_PYTHON", "")
N_ALT, N_AZ, H_KM, R_KM, SUN_ALT_DEG, SUN_AZ_DEG, PEER_E0 = 90, 180, 550.0, 6378.0, -10.0, 90.0, 1360.0
POINTS = N_ALT * N_AZ


def ours(tolerance, threads):
    """CPU s, wall s, and the fluxes as an array [azimuth, altitude]."""
    command = [SATPHOT, "predict", "sky", "--satellite", "starlink-v1.5-lab", "--height-km", str(H_KM), "--mode", "as_published",
               "--sphere-radius-km", str(R_KM), "--sun-alt-deg", str(SUN_ALT_DEG), "--sun-az-deg", str(SUN_AZ_DEG),
               "--grid", f"{N_ALT}x{N_AZ}", "--flux", "--tolerance", str(tolerance), "-j", str(threads), "--quiet"]
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    out = subprocess.run(command, capture_output=True, text=True)
    wall, after = time.perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
    if out.returncode:
        sys.exit(f"{' '.join(command)}\n{out.stderr}")
    table = np.array([[float(x) if x else 0.0 for x in line.split(",")] for line in out.stdout.split()[1:]])
    assert len(table) == POINTS, len(table)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return cpu, wall, table


def peer(density):
    """The same of lumos-sat, in units of its own solar constant."""
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "map.csv"
        arguments = [str(density), str(SUN_ALT_DEG), str(N_ALT), str(N_AZ), str(path)]
        out = subprocess.run([LUMOS, str(PEERS / "bench_lumos_map.py"), *arguments], capture_output=True, text=True)
        if out.returncode:
            sys.exit(out.stderr)
        table = np.loadtxt(path, delimiter=",", skiprows=1)
    table[:, 2] /= PEER_E0
    return json.loads(out.stdout)["cpu_s"], table


def errors(flux, ref):
    """Largest and 99th percentile of |F/Fref - 1| where it counts: altitude >= 1 deg, Fref > 1e-4 of the median."""
    counts = (ref[:, 0] >= 1) & (ref[:, 2] > 1e-4 * np.median(ref[:, 2]))
    off = np.abs(flux[counts, 2] / ref[counts, 2] - 1)
    return off.max(), np.quantile(off, 0.99), counts.sum()


def independent(alt_deg, az_deg):
    """The same point by the reference in Python, both surfaces, per unit irradiance."""
    def direction(alt, az):
        alt, az = np.radians(alt), np.radians(az)
        return np.array([np.cos(alt) * np.sin(az), np.cos(alt) * np.cos(az), np.sin(alt)])  # east, north, up

    up, sun, look = np.array([0.0, 0.0, 1.0]), direction(SUN_ALT_DEG, SUN_AZ_DEG), direction(alt_deg, az_deg)
    reach = -R_KM * look[2] + np.sqrt((R_KM * look[2]) ** 2 + 2 * R_KM * H_KM + H_KM**2)
    z = R_KM * up + reach * look
    z /= np.sqrt(z @ z)
    y = sun - (sun @ z) * z
    cos_e = np.sqrt(y @ y)
    y /= cos_e
    x = np.cross(y, z)
    row = {"height_m": H_KM * 1e3, "src_elev_deg": np.degrees(np.arctan2(sun @ z, cos_e)), "earth_brdf": "phong"}
    row |= {"ep1": "0.53", "ep2": "0.28", "ep3": "7.31", "p1": "", "p2": "", "p3": ""}
    row |= {f"obs_{name}_m": R_KM * 1e3 * (up @ axis) for name, axis in (("x", x), ("y", y), ("z", z))}
    total, apart = 0.0, 0.0
    for law, area, normal in (("chassis", 3.65, (0, 0, -1)), ("solar", 22.0, (0, 1, 0))):
        surface = {"brdf": f"binomial_starlink_v15_{law}", "area_m2": area} | dict(zip(("nx", "ny", "nz"), normal))
        direct, earth, err, _ = reference.solve(row | surface)
        total += float(direct + earth)
        apart = max(apart, float(err))
    return total, apart


def main():
    turns = int(sys.argv[1]) if len(sys.argv) > 1 else 3
    with_peer = bool(LUMOS) and (PEERS / "bench_lumos_map.py").exists()
    if not with_peer:
        print("lumos-sat is not measured: set LUMOS_PYTHON and SATPHOT_PEERS (see scripts/bench_lumos.sh)")
    print(f"load average {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores; medians of {turns} turns\n")
    runs = {"satphot 1e-3": [], "satphot 1e-6": [], "lumos-sat 150": []}
    maps = {}
    for _ in range(turns):
        for tolerance in ("1e-3", "1e-6"):
            cpu, _, maps[f"satphot {tolerance}"] = ours(tolerance, 1)
            runs[f"satphot {tolerance}"].append(cpu)
        if with_peer:
            cpu, maps["lumos-sat 150"] = peer(150)
            runs["lumos-sat 150"].append(cpu)
    ref = ours("1e-9", 0)[2]
    if with_peer:
        assert np.allclose(ref[:, :2], maps["lumos-sat 150"][:, :2], atol=1e-9), "the two grids differ"
    cpu_s = {name: statistics.median(times) for name, times in runs.items() if times}
    print(f"{'map of ' + str(POINTS):<16}{'CPU s':>9}{'us/point':>10}{'times faster':>14}{'largest error':>15}{'99 %':>10}")
    for name, seconds in cpu_s.items():
        largest, p99, count = errors(maps[name], ref)
        faster = f"{cpu_s['lumos-sat 150'] / seconds:.0f}" if with_peer else "-"
        print(f"{name:<16}{seconds:>9.3f}{1e6 * seconds / POINTS:>10.1f}{faster:>14}{largest:>15.1e}{p99:>10.1e}")
    print(f"\nerrors: |F/Fref - 1| over the {count} points with altitude >= 1 deg and Fref > 1e-4 of the median {np.median(ref[:, 2]):.2e}")

    wall = {threads: statistics.median(ours("1e-6", threads)[1] for _ in range(max(turns, 5))) for threads in (1, 2)}
    print(f"two threads: {wall[1] / wall[2]:.2f} times one ({wall[1]:.3f} s, {wall[2]:.3f} s wall at 1e-6)")

    rng = np.random.default_rng(1)
    worst, apart, checked = 0.0, 0.0, 0
    bright = np.nonzero(ref[:, 2] > 1e-4 * np.median(ref[:, 2]))[0]
    for j in rng.choice(bright, 40, replace=False):
        value, methods = independent(*ref[j, :2])
        worst, apart, checked = max(worst, abs(ref[j, 2] / value - 1)), max(apart, methods), checked + 1
    print(f"Fref against the independent double integration, {checked} points at random: {worst:.1e} at most (its two methods {apart:.1e})")


if __name__ == "__main__":
    main()
