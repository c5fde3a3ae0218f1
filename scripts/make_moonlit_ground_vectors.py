#!/usr/bin/env python3
"""Lunar-Earthshine by brute force: a sum over a dense even grid of patches of the ground, the Moon at its distance.

Every patch of a spherical Earth (6378 km) sees the Moon in its own direction, at its own distance and at its own phase angle
(V = -12.73 + 0.026 a + 4e-9 a^4, past 150 deg that flux times ((180 - a)/30)^4; 1/r^2 of both distances). Nothing is shared
with satphot: no coordinates, no rule, no line of code. The midpoint rule is laid over the box of the lit ground in view; a sum
over a quarter of the patches tells the error. `parallel` is the same sum with the light of the Earth's centre everywhere.

    python3 scripts/make_moonlit_ground_vectors.py > fixtures/brightness/moonlit_ground.csv
"""
import numpy as np

R_KM, AU_KM, MEAN_KM = 6378.0, 149597870.7, 384400.0
GROUNDS = {"lambert": (0.3, 0.0, 1.0), "vegetation": (0.53, 0.28, 7.31), "glint": (0.05, 0.6, 60.0)}
SURFACES = {"lambert": (1.0, 0.0, 1.0), "phong": (0.34, 0.4, 8.9), "narrow": (0.1, 0.6, 400.0)}


def unit(v):
    return v / np.linalg.norm(v)


def law(alpha_deg):
    a = np.minimum(alpha_deg, 150.0)
    taper = np.where(alpha_deg > 150.0, ((180.0 - alpha_deg) / 30.0) ** 4, 1.0)
    return taper * 10.0 ** (-0.4 * (-12.73 + 0.026 * a + 4e-9 * a**4))


def phong(kd, ks, n, cos):
    return kd / np.pi + ks * (n + 2) / (2 * np.pi) * np.where(cos > 0, np.abs(cos) ** n, 0.0)


def patches(case, theta, azimuth, parallel):
    """Light of patches per steradian of the surface's law, times the area element."""
    height_km, moon, sun, ground, surface, normal, observer = case
    satellite = np.array([0.0, 0.0, R_KM + height_km])
    p = np.stack([np.sin(theta) * np.cos(azimuth), np.sin(theta) * np.sin(azimuth), np.cos(theta)], -1)
    place = 0.0 * p if parallel else R_KM * p
    to_moon = moon - place
    d_km = np.linalg.norm(to_moon, axis=-1)
    s = to_moon / d_km[..., None]
    sun_km = np.linalg.norm(sun - moon)
    alpha = np.degrees(np.arccos(np.clip(-(s @ (sun - moon)) / sun_km, -1, 1)))
    irradiance = law(alpha) * (MEAN_KM / d_km) ** 2 * (AU_KM / sun_km) ** 2
    cos_moon = (p * s).sum(-1)
    line = satellite - R_KM * p
    range_km = np.linalg.norm(line, axis=-1)
    u = line / range_km[..., None]
    image = 2 * cos_moon[..., None] * p - s
    f_ground = phong(*GROUNDS[ground], (image * u).sum(-1))
    mirror = 2 * (normal @ observer) * normal - observer
    f_surface = phong(*SURFACES[surface], -u @ mirror)
    cos_in, cos_up = -u @ normal, (p * u).sum(-1)
    light = irradiance * f_ground * cos_moon * f_surface * cos_in * cos_up / range_km**2 * R_KM**2 * np.sin(theta)
    return np.where((cos_moon > 0) & (cos_in > 0) & (cos_up > 0), light, 0.0)


def total(case, n, parallel=False):
    edge = np.arccos(R_KM / (R_KM + case[0]))
    box = (0.0, edge, -0.5 * np.pi, 1.5 * np.pi)

    def grid(box, n):
        t = box[0] + (box[1] - box[0]) * (np.arange(n) + 0.5) / n
        a = box[2] + (box[3] - box[2]) * (np.arange(n) + 0.5) / n
        return np.meshgrid(t, a, indexing="ij")

    for _ in range(3):
        # close in on the lit ground in view
        lit = patches(case, *grid(box, 160), parallel) > 0
        if not lit.any():
            return 0.0
        i, j = np.where(lit.any(1))[0], np.where(lit.any(0))[0]
        dt, da = (box[1] - box[0]) / 160, (box[3] - box[2]) / 160
        box = (
            max(0.0, box[0] + (i[0] - 1) * dt),
            min(edge, box[0] + (i[-1] + 2) * dt),
            max(-0.5 * np.pi, box[2] + (j[0] - 1) * da),
            min(1.5 * np.pi, box[2] + (j[-1] + 2) * da),
        )
    return patches(case, *grid(box, n), parallel).sum() * (box[1] - box[0]) * (box[3] - box[2]) / n**2


def main():
    rng = np.random.default_rng(20)
    print("# Lunar-Earthshine by brute force: scripts/make_moonlit_ground_vectors.py")
    print("# frame: z through the satellite, km; flux: sum of E f_E (p.s) f (n.w) dw, E relative to a star of V = 0 [1/sr]")
    print("# err: relative difference from a sum over a quarter of the patches; parallel: the light of the Earth's centre everywhere")
    axes = ("x", "y", "z")
    vectors = [f"{name}_{a}" for name in ("moon_km", "sun_km", "normal", "observer") for a in axes]
    print(",".join(["height_km", "moon_alt_deg", "phase_deg", "ground", "surface", *vectors, "flux", "err", "parallel"]))
    heights = (300.0, 420.0, 550.0, 1200.0, 5000.0, 36000.0)
    phases = (2.0, 5.0, 30.0, 60.0, 90.0, 120.0, 140.0, 149.7, 160.0)
    number = 0
    for altitude in (89.0, 60.0, 30.0, 15.0, 4.0, 0.0, -4.0, -10.0, -15.0, -18.0, -30.0, -60.0):
        for height in heights:
            dip = np.degrees(np.arccos(R_KM / (R_KM + height)))
            if altitude < 1.4 - dip:
                continue
            for _ in range(2):
                phase = phases[number % len(phases)]
                ground = list(GROUNDS)[number % 3]
                surface = list(SURFACES)[(number // 3) % 3]
                number += 1
                turn, roll, d_km = rng.uniform(0, 2 * np.pi), rng.uniform(0, 2 * np.pi), rng.uniform(357e3, 406e3)
                a = np.radians(altitude)
                m = np.array([np.cos(a) * np.cos(turn), np.cos(a) * np.sin(turn), np.sin(a)])
                across = unit(np.cross(m, [0.3, -0.5, 0.2]))
                sideways = np.cos(roll) * across + np.sin(roll) * np.cross(m, across)
                moon = d_km * m
                # seen from the Moon the Sun is at the phase angle from the Earth's centre
                sun = moon + AU_KM * rng.uniform(0.985, 1.015) * (-np.cos(np.radians(phase)) * m + np.sin(np.radians(phase)) * sideways)
                # the surface leans towards the ground under the Moon, so that it sees what is lit
                normal = unit(np.array([0, 0, -1.0]) + 0.5 * m * [1, 1, 0] + rng.uniform(-0.3, 0.3, 3))
                observer = unit(np.array([rng.uniform(-0.5, 0.5), rng.uniform(-0.5, 0.5), -1.0]))
                case = (height, moon, sun, ground, surface, normal, observer)
                fine, coarse, parallel = total(case, 700), total(case, 350), total(case, 350, True)
                if not fine > 0:
                    continue
                numbers = [f"{x:.12g}" for v in (moon, sun, normal, observer) for x in v]
                err = abs(fine / coarse - 1)
                print(",".join([f"{height:g}", f"{altitude:g}", f"{phase:g}", ground, surface, *numbers, f"{fine:.10g}", f"{err:.2g}", f"{parallel:.8g}"]))


main()
