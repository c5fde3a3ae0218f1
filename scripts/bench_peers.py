"""The work of scripts/bench_peers.sh, which says how to run it; `bench_peers.py STAGE FOLDER` is one peer's stage.

CPU is user + system time: of the whole process, files read and written included, for the master flat of satphot; of one
round after a warm-up, start-up and imports not counted, for everything else on both sides. One thread each.
"""
import glob
import hashlib
import json
import os
import pathlib
import resource
import statistics
import subprocess
import sys
import time

for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(threads, "1")

ROWS, BAND, BOX, LEAST_CPU_S = 800, 64, 5000, 2.0
CUTOUT = 1000  # side of what is read around a target [px]


def used():
    usage = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(u.ru_utime + u.ru_stime for u in usage)


def timed(work, share=1.0, warm=True):
    """JSON of the mean of one round; `share` of the whole is worked on."""
    found = work() if warm else None
    cpu, wall, rounds = used(), time.perf_counter(), 0
    while used() - cpu < LEAST_CPU_S or rounds == 0:
        found = work()
        rounds += 1
    line = {"cpu": (used() - cpu) / rounds / share, "wall": (time.perf_counter() - wall) / rounds / share}
    line |= {"rss_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024, "found": found, "n": rounds}
    print(json.dumps(line))


def peer_stage(stage, folder):
    """One stage of one peer, in a process of its own."""
    import numpy as np
    from astropy.io import fits

    flats, stars = (sorted(glob.glob(f"{folder}/{kind}*_*.fits")) for kind in ("flat", "field"))
    full = "full" in stage.split()

    def bands(scaled, every_row):
        data = [fits.open(f, memmap=True, do_not_scale_image_data=True)[0].data for f in flats]
        ny, nx = data[0].shape
        x0, x1 = (0, nx) if full else ((nx - BOX) // 2, (nx + BOX) // 2)
        y0, y1 = (0, ny) if full else ((ny - BOX) // 2, (ny + BOX) // 2)
        end = y1 if every_row else y0 + ROWS

        def work():
            zero = np.float32(32768)
            level = [np.float32(1) / np.median(d[y0:y1:16, x0:x1:16].astype(np.float32) + zero) for d in data]
            out = np.empty((end - y0, x1 - x0), np.float32)
            for y in range(y0, end, BAND):
                rows = slice(y, min(y + BAND, end))
                stack = [d[rows, x0:x1].astype(np.float32) + zero for d in data]
                if scaled:
                    stack = [s * k for s, k in zip(stack, level)]
                out[rows.start - y0:rows.stop - y0] = np.median(np.stack(stack), axis=0, overwrite_input=True)
            return out.shape

        timed(work, (end - y0) / (y1 - y0), warm=False)

    if "numpy" in stage:
        return bands("scaled" in stage, "every" in stage)
    if "ccdproc" in stage:
        import tempfile
        import warnings

        import ccdproc

        warnings.filterwarnings("ignore")
        every = "every" in stage
        with tempfile.TemporaryDirectory(dir=folder) as crop:
            files = flats if every else []
            for f in flats if not every else []:
                files.append(f"{crop}/{os.path.basename(f)}")
                fits.PrimaryHDU(fits.getdata(f)[:ROWS]).writeto(files[-1])
            share = 1.0 if every else ROWS / fits.getheader(flats[0])["NAXIS2"]
            keys = dict(method="median", mem_limit=4e9 * share, unit="adu", dtype="float32")
            keys |= dict(scale=lambda a: 1 / np.median(a[::16, ::16]))
            return timed(lambda: ccdproc.combine(files, **keys).data.shape, share, warm=False)

    if "floor" in stage:
        return floor(stage.split(), flats, stars, timed)
    import sep

    sep.set_extract_pixstack(5_000_000)
    master = fits.getdata(f"{folder}/master_full.fits").astype(np.float32)

    def calibrated(path):
        with fits.open(path, memmap=False) as hdus:
            data = hdus[0].data.astype(np.float32)
        data -= 500
        data *= np.float32(0.078)
        data /= master
        np.nan_to_num(data, copy=False, nan=0.0)
        return data

    def chain(path):
        data = calibrated(path)
        sky = sep.Background(data)
        sky.subfrom(data)
        found = sep.extract(data, 5.0, err=sky.globalrms, minarea=9)
        sep.sum_circle(data, found["x"], found["y"], 20.0, err=sky.globalrms, gain=1.0, bkgann=(30.0, 40.0), subpix=0)
        return len(found)

    if "chain" in stage:
        paths = iter(stars * 1000)
        return timed(lambda: chain(next(paths)))
    data = calibrated(stars[0])
    k, plastic = np.arange(2000), 1.324717957244746
    place = [60 + (n - 121) * ((0.5 + k / plastic**p) % 1) for p, n in ((1, data.shape[1]), (2, data.shape[0]))]
    if "background" in stage:
        return timed(lambda: sep.Background(data).globalrms)
    if "detect" in stage:
        sky = sep.Background(data)
        sky.subfrom(data)
        return timed(lambda: len(sep.extract(data, 5.0, err=sky.globalrms, minarea=9)))
    if "sep apertures" in stage:
        return timed(lambda: len(sep.sum_circle(data, *place, 20.0, bkgann=(30.0, 40.0), subpix=0)[0]))
    if "photutils" in stage:
        from astropy.stats import SigmaClip
        from photutils.aperture import ApertureStats, CircularAnnulus, CircularAperture, aperture_photometry

        where, clip = np.column_stack(place), SigmaClip(3.0)

        def work():
            sky = ApertureStats(data, CircularAnnulus(where, 30.0, 40.0), sigma_clip=clip).median
            return len(aperture_photometry(data, CircularAperture(where, 20.0))["aperture_sum"] - sky)

        return timed(work)
    sys.exit(f"no stage {stage}")


def floor(stage, flats, stars, timed):
    """What this machine needs at least: the bytes read once, and the fastest kernels of other libraries on data in memory.

    Master: SHA-256 of the files, and numpy's vectorised sort of the values of each pixel (they already lie side by side).
    Frame: background, detection and apertures of sep on calibrated values, without deblending. Target: the same on the
    cutout, detected at four scales (binned by 1, 2, 4, 8).
    """
    import numpy as np
    from astropy.io import fits

    def raw(path):
        with fits.open(path, memmap=True, do_not_scale_image_data=True) as hdus:
            return hdus[0]._data_offset, hdus[0].header["NAXIS2"], hdus[0].header["NAXIS1"]

    def read(path, y0, y1, x0, x1, offset, nx, into):
        with open(path, "rb", buffering=0) as file:
            if (x0, x1) == (0, nx):
                file.seek(offset + 2 * y0 * nx)
                return file.readinto(into[:2 * (y1 - y0) * nx])
            for y in range(y0, y1):
                file.seek(offset + 2 * (y * nx + x0))
                file.readinto(into[:2 * (x1 - x0)])

    offset, ny, nx = raw(stars[0])
    full = "full" in stage
    into = memoryview(bytearray(2 * ny * nx))
    if "flat" in stage:
        side_y, side_x = (ny, nx) if full else (BOX, int(BOX * np.pi / 4))  # as many pixels as the circle
        kind = np.float32 if "scaled" in stage else np.uint16
        values = np.random.default_rng(1).normal(24000, 155, (BAND, side_x, len(flats))).astype(kind)
        rows = BAND * ny // side_y  # of the whole files, which are hashed

        def one_band():
            for path in flats:
                hashlib.sha256(into[:read(path, 0, rows, 0, nx, offset, nx, into)])
            return len(np.sort(values, axis=-1)[..., len(flats) // 2])

        return timed(one_band, BAND / side_y)
    import sep

    sep.set_extract_pixstack(5_000_000)
    side_y, side_x = (ny, nx) if full else (CUTOUT, CUTOUT) if "target" in stage else (BOX, BOX)
    share = np.pi / 4 if "circle" in stage else 1.0
    y0, x0 = (ny - side_y) // 2, (nx - side_x) // 2
    data = np.ascontiguousarray(fits.getdata(stars[0])[y0:y0 + side_y, x0:x0 + side_x].astype(np.float32))
    data = (data - 500) * np.float32(0.078)
    scales = (1, 2, 4, 8) if "target" in stage else (1,)

    def work():
        read(stars[0], y0, y0 + side_y, x0, x0 + side_x, offset, nx, into)
        sky = sep.Background(data)
        clean = data - sky
        for n in reversed(scales):
            binned = clean if n == 1 else clean.reshape(side_y // n, n, side_x // n, n).sum(axis=(1, 3))
            found = sep.extract(binned, 5.0, err=n * sky.globalrms, minarea=9, deblend_cont=1.0)  # no deblending
        sep.sum_circle(clean, found["x"], found["y"], 20.0, err=sky.globalrms, gain=1.0, bkgann=(30.0, 40.0), subpix=0)
        return len(found)

    return timed(work, 1 / share)


def peer(stage, folder):
    out = subprocess.run([sys.executable, __file__, "--peer", stage, str(folder)], capture_output=True, text=True)
    return json.loads(out.stdout.splitlines()[-1]) if out.returncode == 0 else out.stderr.strip().splitlines()[-1]


def ours(stage, folder):
    out = subprocess.run([os.environ["FULL_SIZE"], *stage.split()[:1], str(folder), *stage.split()[1:]], capture_output=True, text=True)
    if out.returncode:
        sys.exit(f"{stage}\n{out.stderr}")
    return json.loads(out.stdout.splitlines()[-1])


def our_flat(folder, scale, part):
    """`satphot flat` as a process."""
    radius = {"full": "1e5", "circle": "2500.0"}[part]
    path = pathlib.Path(folder) / (f"master_{part}.fits" if scale == "level" else "master_unscaled.fits")
    command = [os.environ["SATPHOT"], "flat", "-c", f"{folder}/pipeline.toml", "-j", "1", "-o", str(path)]
    command += ["--set", f"photometry.clip_radius_px={radius}", "--set", f'flat.scale="{scale}"']
    start = time.perf_counter()
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    _, status, usage = os.wait4(process.pid, 0)
    if status:
        sys.exit(f"{' '.join(command)}\n{process.stderr.read()}")
    return {"cpu": usage.ru_utime + usage.ru_stime, "wall": time.perf_counter() - start, "rss_mb": usage.ru_maxrss / 1024}


FLOOR = 1 / 1.5  # we may need 1.5 times the CPU time of a floor
# our work, the label of the table, and the peers: stage, and how many times less CPU is the least
TABLE = [
    ("flat level full", "satphot flat, levels scaled, full frame", [("floor flat scaled full", FLOOR)]),
    ("combine level full", "its master of 42 flats, neither hashed nor written", [("numpy scaled full", 20), ("ccdproc", 180)]),
    ("flat level circle", "satphot flat, levels scaled, circle", [("floor flat scaled circle", FLOOR)]),
    ("combine level circle", "its master",
     [("numpy scaled circle", 20), ("numpy scaled full", 20), ("ccdproc", 180)]),
    ("flat none full", "satphot flat, stored values, full frame", [("floor flat plain full", FLOOR)]),
    ("combine none full", "its master", [("numpy plain full", 20)]),
    ("flat none circle", "satphot flat, stored values, circle", [("floor flat plain circle", FLOOR)]),
    ("combine none circle", "its master", [("numpy plain circle", 20), ("numpy plain full", 20)]),
    ("read full", "read and calibrate, full frame", []),
    ("background full", "background mesh of 64 px, full frame", [("sep background", None)]),
    ("detect full", "detection, full frame", [("sep detect", None)]),
    ("apertures full", "2000 apertures r = 20 px with annulus", [("sep apertures", 1), ("photutils apertures", None)]),
    ("frame circle", "one frame, circle", [("sep chain", 18), ("floor frame circle", FLOOR)]),
    ("frame full", "one frame, full frame", [("sep chain", 4), ("floor frame full", FLOOR)]),
    ("target circle", "one target frame, the SHA-256 of its file apart", [("sep chain", 20), ("floor target", FLOOR)]),
    ("followed circle", "the same where the pilots of its pass have the target", [("sep chain", 20)]),
]
SLOW = ("numpy", "ccdproc")


def main():
    every = "--full" in sys.argv
    folder, *rest = [a for a in sys.argv[1:] if a != "--full"]
    turns = int(rest[0]) if rest else 3
    runs = {}
    for turn in range(turns):
        for work, _, peers in TABLE:
            run = our_flat(folder, *work.split()[1:]) if work.startswith("flat") else ours(work, folder)
            runs.setdefault(work, []).append(run)
            for stage, _ in peers:
                if stage in runs and (len(runs[stage]) > turn or stage.startswith(SLOW)):
                    continue
                print(f"turn {turn + 1}: {stage}        ", end="\r", file=sys.stderr, flush=True)
                runs.setdefault(stage, []).append(peer(stage + (" every" if every else ""), folder))

    def median(name, key):
        return statistics.median(run[key] for run in runs[name])

    rows = "every row" if every else f"{ROWS} of 6388 rows, extrapolated"
    print(f"load average {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores; medians of {turns} turns; numpy, ccdproc: {rows}")
    print(f"{'':<48}{'CPU s':>9}{'wall s':>9}{'MB':>7}{'times less CPU':>16}{'at least':>10}")
    short = []
    for work, label, peers in TABLE:
        print(f"{label:<48}{median(work, 'cpu'):>9.4f}{median(work, 'wall'):>9.4f}{median(work, 'rss_mb'):>7.0f}")
        for stage, bar in peers:
            if isinstance(runs[stage][0], str):
                print(f"    {stage:<44}  not measured: {runs[stage][0]}")
                continue
            ratio = median(stage, "cpu") / median(work, "cpu")
            if bar and ratio < bar:
                short.append(f"{label} against {stage}: {ratio:.2f} instead of {bar:.2f}")
            print(f"    {stage:<44}{median(stage, 'cpu'):>9.4f}{median(stage, 'wall'):>9.4f}{median(stage, 'rss_mb'):>7.0f}"
                  f"{ratio:>16.2f}{format(bar, '.3g') if bar else '':>10}")
    print("\n" + ("\n".join(["below the bar:", *short]) if short else "every bar is met"))


if __name__ == "__main__":
    if sys.argv[1] == "--peer":
        peer_stage(sys.argv[2], sys.argv[3])
    else:
        main()
