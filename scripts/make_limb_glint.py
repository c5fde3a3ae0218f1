#!/usr/bin/env python3
"""The Earth-reflected flux of an ABG spike on a glinting limb, for src/accuracy/extremes/light.rs, by two sums that share nothing.

    # needs numpy; a minute
    python3 scripts/make_limb_glint.py

First logarithmic rings about the mirror direction in the plane of the surface, (n.w) dw = d2q: midpoint rule, the limb by
comparison. The rings begin at D = 1e-12: from 1e-10 on, the flux is 1.2e-9 smaller. Then rays from the mirror direction on the
sphere, tanh-sinh along them and across, cut at limb and terminator.
"""
import numpy as np

R_KM, HEIGHT_KM = 6378.0, 550.0
A, B, G = 1e-3, 1e-11, 1.5
KS, EXPONENT = 0.5, 200.0
PLACE_KM = np.array([485.83636231300794, 1262.475127598478, 6232.896885177042])
NORMAL = np.array([0.16188596670500424, 0.8736041493248611, -0.45892126129257965])

r = R_KM + HEIGHT_KM
k = R_KM / r
n = NORMAL / np.linalg.norm(NORMAL)
line = PLACE_KM - np.array([0.0, 0.0, r])
d_m = 1e3 * np.linalg.norm(line)
o = line / np.linalg.norm(line)
cos_out = n @ o
m = 2 * cos_out * n - o
spread = cos_out / d_m**2


def radiance(w):
    """f_E (p.s) with the source at (0, 1, 0), r.u = 2 (p.s)(p.u) + w.s."""
    sine = np.hypot(w[0], w[1])
    seen = (sine < k) & (w[2] < 0)
    rising = np.sqrt(np.maximum((k - sine) * (k + sine), 0)) / k
    height = (-w[2] / k - rising) * w[1]
    glint = np.clip(2 * height * rising + w[1], 0, 1)
    return np.where(seen, KS * (EXPONENT + 2) / (2 * np.pi) * glint**EXPONENT * np.maximum(height, 0), 0)


def in_the_plane(rings, places, first=1e-12, last=2.0):
    e1 = np.cross(n, [0.0, 0.0, 1.0])
    e1 /= np.linalg.norm(e1)
    e2 = np.cross(n, e1)
    phi = 2 * np.pi * (np.arange(places) + 0.5) / places
    step, total = np.log(last / first) / rings, 0.0
    for j in range(rings):
        rho = first * np.exp(step * (j + 0.5))
        x, y = m @ e1 + rho * np.cos(phi), m @ e2 + rho * np.sin(phi)
        front = x * x + y * y < 1
        x, y = x[front], y[front]
        w = e1[:, None] * x + e2[:, None] * y + n[:, None] * np.sqrt(1 - x * x - y * y)
        total += radiance(w).sum() * A / (B + rho**G) * rho * rho
    return spread * total * step * 2 * np.pi / places


def tanh_sinh(level, reach=3.4):
    u = 2.0**-level * np.arange(-int(reach * 2**level), int(reach * 2**level) + 1)
    v = np.pi / 2 * np.sinh(abs(u))
    return 1 / (1 + np.exp(2 * v)), np.pi / 4 * np.cosh(u) / np.cosh(v) ** 2 * 2.0**-level, u < 0


def along_rays(level, across):
    b = np.array([-m[1], m[0], 0.0])
    b /= np.linalg.norm(b)
    a = np.cross(b, m)
    width = B ** (1 / G)

    def ray(psi):
        e = a * np.cos(psi) + b * np.sin(psi)
        c = np.cross(m, e)[2]
        if abs(c) >= k:
            return 0.0
        half, centre = np.arctan2(np.sqrt((k - c) * (k + c)), np.sqrt((1 - k) * (1 + k))), np.arctan2(-e[2], -m[2])
        low, high = max(centre - half, 0), min(centre + half, np.arctan2(n @ e, cos_out) + np.pi / 2)
        dark = np.arctan2(-m[1], e[1]) % np.pi
        edges = sorted({low, high} | ({dark} if low < dark < high else set()))
        e_t, m_t, total = e - n * (n @ e), m - n * (n @ m), 0.0
        from_end, weight, at_start = tanh_sinh(level)
        for p, q in zip(edges[:-1], edges[1:]):
            t = np.linspace(np.arcsinh(p / width), np.arcsinh(q / width), 6)
            for t0, t1 in zip(t[:-1], t[1:]):
                x = np.where(at_start, t0 + (t1 - t0) * from_end, t1 - (t1 - t0) * from_end)
                gamma = np.clip(width * np.sinh(x), p, q)
                sagitta = 2 * np.sin(gamma / 2) ** 2
                w = m[:, None] * (1 - sagitta) + e[:, None] * np.sin(gamma)
                apart = e_t[:, None] * np.sin(gamma) - m_t[:, None] * sagitta
                f = A / (B + np.sqrt((apart**2).sum(0)) ** G) * np.maximum(n @ w, 0)
                total += (weight * radiance(w) * f * np.sin(gamma) * width * np.cosh(x)).sum() * (t1 - t0)
        return total

    edges = {2 * np.pi * j / 8 for j in range(9)}
    for x in (k, -k):
        v = np.array([x, 0.0, -np.sqrt(1 - k * k)])
        edges.add(np.arctan2(v @ b, v @ a) % (2 * np.pi))
    for centre in (np.pi / 2, 3 * np.pi / 2):
        edges |= {centre + side * 1e-9 * 8.0**j for j in range(10) for side in (-1, 1)}
    edges = sorted(edges)
    from_end, weight, at_start = tanh_sinh(across)
    total = 0.0
    for p, q in zip(edges[:-1], edges[1:]):
        for psi, part in zip(np.where(at_start, p + (q - p) * from_end, q - (q - p) * from_end), weight):
            total += part * (q - p) * ray(psi)
    return spread * total


print("rings in the plane of the surface", in_the_plane(2000, 20000), in_the_plane(4000, 20000))
print("rays on the sphere", along_rays(4, 3), along_rays(5, 4))
