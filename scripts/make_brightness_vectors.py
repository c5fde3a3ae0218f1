"""Writes fixtures/brightness/vectors.csv: the oracle of tests/brightness/own_vectors.rs.

    python scripts/make_brightness_vectors.py                        (needs numpy only; some minutes)
    python scripts/make_brightness_vectors.py --check OTHER.csv      compares a file of this format, row by row
    python scripts/make_brightness_vectors.py --seed 7 --rows 2000 --double --out more.csv

An implementation of the model that shares nothing with the Rust engine. Spherical Earth R = 6378 km, parallel light,
cylindrical umbra, one flat one-sided surface. With w the direction from the satellite to a point p of the Earth,
    direct / E0 = A f(s, n, o) (n.s)+ (n.o)+ / d^2
    earth / E0  = A (n.o)+ / d^2  Int f_E(s, p, -w) (p.s)+ f(w, n, o) (n.w)+ dw,
frame: z through the satellite, s = (0, cos E, sin E), x = y cross z. Every integral is done twice:
  method 1  spherical polar (gamma, psi) about the mirror direction m = 2 (n.o) n - o; psi outer, gamma inner;
  method 2  (zeta, phi) about the satellite's vertical, zeta the zenith angle of the satellite at p; zeta outer.
Limb, terminator, horizon of the surface, r.o = 0 and the lobe's own scales are break points of both, in unlike ways;
both refine adaptively (Gauss-Kronrod 21 nested in Gauss-Kronrod 21). Where they differ by more than 2e-11, method 1 is
done again in numpy.longdouble (unless --double): its coordinates lose digits at the limb, those of method 2 do not.
Phong with n = 0: the lobe is the half-space r.o > 0. A mirror needs no integral.
"""
import argparse
import csv
import io
import math
import os
import pathlib
import sys
import time

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
import numpy as np  # noqa: E402

# Gauss-Kronrod 21/10: abscissae (positive half, then 0), Kronrod weights, Gauss weights (QUADPACK, 33 digits).
X21 = """0.995657163025808080735527280689003 0.973906528517171720077964012084452 0.930157491355708226001207180059508
0.865063366688984510732096688423493 0.780817726586416897063717578345042 0.679409568299024406234327365114874
0.562757134668604683339000099272694 0.433395394129247190799265943165784 0.294392862701460198131126603103866
0.148874338981631210884826001129720 0""".split()
W21 = """0.011694638867371874278064396062192 0.032558162307964727478818972459390 0.054755896574351996031381300244580
0.075039674810919952767043140916190 0.093125454583697605535065465083366 0.109387158802297641899210590325805
0.123491976262065851077958109831074 0.134709217311473325928054001771707 0.142775938577060080797094273138717
0.147739104901338491374841515972068 0.149445554002916905664936468389821""".split()
W10 = """0 0.066671344308688137593568809893332 0 0.149451349150580593145776339657697 0 0.219086362515982043995534934228163 0
0.269266719309996355091226921569469 0 0.295524224714752870173892994651338 0""".split()

BINOMIAL = {
    "binomial_starlink_v15_chassis": (
        (3.34, -98.085),
        (-999.999, 867.538, 1000.0, 1000.0, -731.248, 618.552, -294.054, 269.248, -144.853, 75.196),
        -5,
    ),
    "binomial_starlink_v15_solar": (
        (0.534, -20.409),
        (-527.765, 1000.0, -676.579, 430.596, -175.806, 57.879),
        -3,
    ),
}
R_M = 6378000
NODES_MAX = 6e6
COLUMNS = (
    "id,tags,height_m,src_elev_deg,obs_x_m,obs_y_m,obs_z_m,sat_alt_deg,sat_az_deg,src_alt_deg,src_az_deg,nx,ny,nz,"
    "area_m2,brdf,p1,p2,p3,earth_brdf,ep1,ep2,ep3,direct_per_E0,earth_per_E0,err_earth"
).split(",")


class Law:
    """f as a function of the mirror cosine (through 1 - r.o) or of D."""

    def __init__(self, kind, params, F):
        self.kind, self.F = kind, F
        self.p = [F(x) for x in params if x != ""]
        pi = F(4) * np.arctan(F(1))
        if kind == "lambertian":
            self.scale, self.value = None, lambda one_minus, D: self.p[0] / pi + 0 * one_minus
        elif kind == "phong":
            kd, ks, n = self.p
            self.scale = 1 / np.sqrt(n) if n > 4 and ks > 0 else None

            def phong(one_minus, D):
                c = np.maximum(1 - one_minus, 0)
                with np.errstate(divide="ignore", invalid="ignore", under="ignore"):
                    lobe = np.where(c > 0, np.exp(n * np.log1p(-np.minimum(one_minus, 1))), 0)
                return kd / pi + ks * (n + 2) / (2 * pi) * lobe

            self.value = phong
        elif kind == "gaussian":
            a, sigma = self.p
            self.scale = np.sqrt(sigma)
            self.value = lambda one_minus, D: a * np.exp(np.maximum(-one_minus / sigma, F(-11000)))
        elif kind == "abg":
            a, b, g = self.p
            self.scale = b ** (1 / g)
            self.value = lambda one_minus, D: a / (b + D**g)
        elif kind in BINOMIAL:
            B, C, l1 = BINOMIAL[kind]
            B, C = [F(str(x)) for x in B], [F(str(x)) for x in C]
            self.scale = F(1) / (-B[1] * 2)
            ln10 = np.log(F(10))

            def binomial(one_minus, D):
                lg = B[0] + B[1] * D
                for i, c in enumerate(C):
                    lg = lg + c / 2 * np.log1p(F(3) ** (i + l1) * D * D) / ln10
                return F(10) ** lg

            self.value = binomial
        else:
            raise ValueError(kind)

    def kink(self):
        """The end r.o = 0 of a Phong lobe is a branch point worth a break."""
        return self.kind == "phong" and self.p[1] > 0 and self.p[2] < 30


class Case:
    """One row, in units of the Earth's radius."""

    def __init__(self, row, F):
        self.F, self.row = F, row
        pi = self.pi = F(4) * np.arctan(F(1))
        R = F(R_M)
        r = R + F(row["height_m"])
        self.k = R / r
        E = F(row["src_elev_deg"]) * pi / 180
        self.E = E
        self.s = np.array([F(0), np.cos(E), np.sin(E)])
        obs = np.array([F(row[c]) for c in ("obs_x_m", "obs_y_m", "obs_z_m")])
        to = obs - np.array([F(0), F(0), r])
        self.d_m = np.sqrt(to @ to)
        self.o = to / self.d_m
        n = np.array([F(row[c]) for c in ("nx", "ny", "nz")])
        self.n = n / np.sqrt(n @ n)
        self.area = F(row["area_m2"])
        self.no = self.n @ self.o
        self.m = 2 * self.no * self.n - self.o
        self.mt = self.m - (self.m @ self.n) * self.n
        self.below = obs[2] < R * R / r
        self.umbra = E < -np.arccos(self.k)
        self.mirror = row["brdf"] == "mirror"
        self.params = [row["p1"], row["p2"], row["p3"]]
        self.law = None if self.mirror else Law(row["brdf"], self.params, F)
        self.earth = Law(row["earth_brdf"], [row["ep1"], row["ep2"], row["ep3"]], F)
        self.cos_limb = np.sqrt((1 - self.k) * (1 + self.k))

    def direct(self):
        if self.below or self.umbra or self.no <= 0:
            return self.F(0)
        ns = self.n @ self.s
        if ns <= 0:
            return self.F(0)
        spread = self.area * self.no / self.d_m**2
        apart = self.m - self.s
        if self.mirror:
            rho, alpha = self.F(self.params[0]), self.F(self.params[1]) * self.pi / 180
            angle = 2 * np.arcsin(min(np.sqrt(apart @ apart) / 2, self.F(1)))
            # 1 - cos alpha = 2 sin^2(alpha/2)
            return rho * spread / (4 * self.pi * np.sin(alpha / 2) ** 2) if angle <= alpha else self.F(0)
        t = apart - (apart @ self.n) * self.n
        return spread * ns * self.law.value(apart @ apart / 2, np.sqrt(t @ t))

    def ground(self, w):
        """p, p.u and whether w (shape (3, ...)) meets the Earth."""
        sin2 = w[0] ** 2 + w[1] ** 2
        sin_eta = np.sqrt(sin2)
        pu2 = (self.k - sin_eta) * (self.k + sin_eta) / self.k**2
        hit = (pu2 >= 0) & (w[2] < 0)
        pu = np.sqrt(np.maximum(pu2, 0))
        # D = cos(eta)/k - cos(zeta); near side
        D = -w[2] / self.k - pu
        p = np.stack([D * w[0], D * w[1], 1 / self.k + D * w[2]])
        return p, pu, hit

    def radiance(self, p, pu, u_s):
        """f_E (p.s)+; u_s = u.s = -w.s."""
        ps = p[1] * self.s[1] + p[2] * self.s[2]
        ro = 2 * ps * pu - u_s
        f = self.earth.value(1 - ro, 0)
        return np.where(ps > 0, f * ps, 0)

    def mirror_earth(self):
        p, pu, hit = self.ground(self.m)
        return self.radiance(p, pu, -(self.m @ self.s)) if hit else self.F(0)

    def spread(self):
        return self.area * self.no / self.d_m**2

    def dark(self):
        """No integral at all."""
        return self.below or self.no <= 0 or self.E <= -np.arccos(self.k) or -self.n[2] <= -self.k

    # special directions ------------------------------------------------------------------------------------------
    def corners(self):
        """Unit vectors where two edges of the lit ground in front of the surface meet."""
        out = []
        sn, cn = self.k, self.cos_limb
        # limb and terminator: p on the limb has p.z = k, p.s = 0
        if self.s[1] > 0:
            y = -self.s[2] * self.k / self.s[1]
            x2 = 1 - self.k**2 - y * y
            if x2 >= 0:
                for x in (np.sqrt(x2), -np.sqrt(x2)):
                    v = np.array([x, y, self.k - 1 / self.k])
                    out.append(v / np.sqrt(v @ v))
        # limb and surface horizon: n.w = 0 on the cone
        nt = np.hypot(self.n[0], self.n[1])
        if nt > 0 and abs(self.n[2] * cn / (nt * sn)) <= 1:
            f0, df = np.arctan2(self.n[1], self.n[0]), np.arccos(self.n[2] * cn / (nt * sn))
            out += [np.array([sn * np.cos(f), sn * np.sin(f), -cn]) for f in (f0 - df, f0 + df)]
        # terminator and surface horizon: the cone of the terminator in the plane n.w = 0
        a = np.cross(self.n, [0, 0, 1])
        if np.sqrt(a @ a) > 1e-12:
            a = a / np.sqrt(a @ a)
            b = np.cross(self.n, a)
            out += [v for v in self.on_terminator_plane(a, b)]
        return out

    def quadric(self):
        """Q with w^T Q w = 0 on the terminator (and on its far side)."""
        s, z = self.s, np.array([self.F(0), self.F(0), self.F(1)])
        return (1 - self.k) * (1 + self.k) * np.outer(s, s) - s[2] * (np.outer(z, s) + np.outer(s, z)) + s[2] ** 2 * np.eye(3)

    def on_terminator_plane(self, a, b):
        Q = self.quadric()
        for t in quadratic_angles(a @ Q @ a, a @ Q @ b, b @ Q @ b):
            for sign in (1, -1):
                v = sign * (np.cos(t) * a + np.sin(t) * b)
                if v[2] < -self.cos_limb:
                    yield v

    def kink_curve(self, zeta, sign):
        """The directions with r.u = 0 on the ground: phi = 90 deg +- arccos(-tan E / tan(zeta + theta))."""
        eta = np.arcsin(self.k * np.sin(zeta))
        total = 2 * zeta - eta
        with np.errstate(divide="ignore", invalid="ignore"):
            x = -self.s[2] * np.cos(total) / (self.s[1] * np.sin(total))
            f = self.pi / 2 + sign * np.arccos(x)
        return np.stack([np.sin(eta) * np.cos(f), np.sin(eta) * np.sin(f), -np.cos(eta)])

    def kink_corners(self, functions):
        """Where the curve r.u = 0 starts, ends, and crosses the zeros of functions of (w, derivative of w along it)."""
        out = []
        if self.s[1] <= 0:
            return out
        grid = np.linspace(self.F(0), self.pi / 2, 2001)[1:]
        h = self.F(1e-7)

        def value(g, zeta, sign):
            w = self.kink_curve(zeta, sign)
            return g(w, self.kink_curve(zeta + h, sign) - self.kink_curve(zeta - h, sign))

        for sign in (1, -1):
            w = self.kink_curve(grid, sign)
            fine = np.isfinite(w[0])
            if not fine.any():
                continue
            out += [w[:, j] for j in np.nonzero(fine)[0][[0, -1]]]
            for g in functions:
                y = value(g, grid, sign)
                for j in np.nonzero(np.isfinite(y[:-1]) & np.isfinite(y[1:]) & ((y[:-1] > 0) != (y[1:] > 0)))[0][:12]:
                    lo, hi, up = grid[j], grid[j + 1], y[j + 1] > 0
                    for _ in range(60):
                        mid = (lo + hi) / 2
                        lo, hi = (lo, mid) if (value(g, mid, sign) > 0) == up else (mid, hi)
                    out.append(self.kink_curve(hi, sign))
        return [v for v in out if np.isfinite(v).all()]

    def edge_functions(self):
        """Terminator and horizon of the surface, for `kink_corners`."""
        def lit(w, _):
            p, _, _ = self.ground(w)
            return p[1] * self.s[1] + p[2] * self.s[2]

        return [lit, lambda w, _: self.n[0] * w[0] + self.n[1] * w[1] + self.n[2] * w[2]]


def quadratic_angles(a, b, c):
    """t with a cos^2 + 2 b cos sin + c sin^2 = 0, mod pi; scalars or arrays (nan where none)."""
    # (a + c)/2 + (a - c)/2 cos 2t + b sin 2t = 0
    amplitude = np.hypot((a - c) / 2, b)
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio = -(a + c) / 2 / amplitude
        # a double root is lost to rounding: taken back
        ratio = np.where(np.abs(ratio) < 1 + 1e-9, np.clip(ratio, -1, 1), ratio)
        half = np.arccos(ratio) / 2
    centre = np.arctan2(b, (a - c) / 2) / 2
    both = [centre - half, centre + half]
    return [t for t in both if np.ndim(t) or np.isfinite(t)]


# nested adaptive quadrature ----------------------------------------------------------------------------------------
class Nested:
    """Outer panels between given edges; inner segments between break points that depend on the outer variable."""

    def __init__(self, F, breaks, integrand, inside, rtol):
        self.F, self.breaks, self.integrand, self.inside, self.rtol = F, breaks, integrand, inside, rtol
        x = np.array([F(v) for v in X21])
        self.t = (1 + np.concatenate([-x, x[:-1][::-1]])) / 2
        wk, wg = np.array([F(v) for v in W21]), np.array([F(v) for v in W10])
        self.wk = np.concatenate([wk, wk[:-1][::-1]]) / 2
        self.wg = np.concatenate([wg, wg[:-1][::-1]]) / 2
        self.eps = np.finfo(F).eps
        self.nodes, self.stuck, self.scale = 0, 0, F(0)

    @staticmethod
    def cluster(t):
        """Fourth order at both ends."""
        u = 1 - t
        return t**4 * (35 - 84 * t + 70 * t * t - 20 * t**3), 140 * (t * u) ** 3

    def rule(self, y, width):
        """Value and error of each row of y (QUADPACK's estimate)."""
        k, g = (y @ self.wk) * width, (y @ self.wg) * width
        res_abs = (np.abs(y) @ self.wk) * width
        spread = (np.abs(y - (k / np.where(width > 0, width, 1))[:, None]) @ self.wk) * width
        d = np.abs(k - g)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            err = np.where((spread > 0) & (d > 0), spread * np.minimum(1, (200 * d / spread) ** 1.5), d)
        return k, err, 50 * self.eps * res_abs

    def inner(self, x):
        """The inner integral at every outer node."""
        total = np.zeros(len(x), self.F)
        pos, singular = self.breaks(x)
        order = np.argsort(pos, axis=1)
        pos = np.take_along_axis(pos, order, axis=1)
        flag = np.take_along_axis(np.broadcast_to(singular, pos.shape), order, axis=1)
        a, w = pos[:, :-1], np.diff(pos, axis=1)
        i, j = np.nonzero(w > 0)
        a, w, c = a[i, j], w[i, j], flag[i, j] | flag[i, j + 1]
        keep = self.inside(x[i], a + w / 2)
        i, a, w, c = i[keep], a[keep], w[keep], c[keep]
        t0, dt = np.zeros(len(i), self.F), np.ones(len(i), self.F)
        for depth in range(45):
            if not len(i):
                break
            t = t0[:, None] + dt[:, None] * self.t
            xc, dc = self.cluster(t)
            y = np.where(c[:, None], xc, t)
            jac = np.where(c[:, None], dc, 1) * w[:, None]
            f = self.integrand(np.broadcast_to(x[i, None], t.shape), a[:, None] + w[:, None] * y) * jac
            self.nodes += f.size
            k, err, noise = self.rule(f, dt)
            pending = total.copy()
            np.add.at(pending, i, k)
            limit = np.maximum(self.rtol * np.maximum(np.abs(pending[i]), self.scale) / 8, noise)
            done = err <= limit
            if depth == 44 or (~done).sum() > 40 * len(x) + 2000:
                self.stuck += int((~done).sum())
                done[:] = True
            np.add.at(total, i[done], k[done])
            i, a, w, c, t0, dt = (np.repeat(v[~done], 2) for v in (i, a, w, c, t0, dt))
            dt = dt / 2
            t0[1::2] += dt[1::2]
        return total

    def chunked(self, x):
        return np.concatenate([self.inner(x[j : j + 600]) for j in range(0, len(x), 600)]) if len(x) else x

    def integrate(self, edges):
        edges = np.array(sorted(edges), self.F)
        edges = edges[np.concatenate([[True], np.diff(edges) > 0])]
        a, w = edges[:-1], np.diff(edges)
        t0, dt = np.zeros(len(a), self.F), np.ones(len(a), self.F)
        # a rough first pass sets the scale below which nothing matters
        y, jac = self.cluster(t0[:, None] + dt[:, None] * self.t)
        fine, self.rtol = self.rtol, 1e-2
        f = self.chunked((a[:, None] + w[:, None] * y).ravel()).reshape(y.shape) * jac * w[:, None]
        self.scale, self.rtol = np.abs((f @ self.wk).sum()) / 10, fine
        total, err_total = self.F(0), self.F(0)
        for depth in range(45):
            if not len(a):
                break
            t = t0[:, None] + dt[:, None] * self.t
            y, jac = self.cluster(t)
            x = a[:, None] + w[:, None] * y
            f = self.chunked(x.ravel()).reshape(x.shape) * jac * w[:, None]
            k, err, noise = self.rule(f, dt)
            self.scale = max(self.scale, np.abs(total + k.sum()) / 10)
            limit = np.maximum(10 * self.rtol * np.abs(total + k.sum()) / max(len(k), 30), noise)
            done = err <= limit
            if depth == 44 or self.nodes > NODES_MAX:
                self.stuck += int((~done).sum())
                done[:] = True
            total += k[done].sum()
            err_total += err[done].sum()
            a, w, t0, dt = (np.repeat(v[~done], 2) for v in (a, w, t0, dt))
            dt = dt / 2
            t0[1::2] += dt[1::2]
        return total, err_total


def grades(scale, top, F):
    """Scales of a lobe: a few within it, geometric beyond."""
    out = [scale * f for f in (F(1) / 4, 1, 2, 4, 7)]
    while out[-1] < top:
        out.append(out[-1] * 4)
    return np.array([v for v in out if v < top], F)


def method_1(case, rtol):
    """Polar about m: w = cos(gamma) m + sin(gamma) e(psi)."""
    F, pi, m, n = case.F, case.pi, case.m, case.n
    a = np.array([F(0), F(0), F(-1)]) + m[2] * m  # towards nadir
    if np.sqrt(a @ a) < 1e-9:
        a = np.cross(m, np.array([F(1), F(0), F(0)]))
    a = a - (a @ m) * m
    a = a / np.sqrt(a @ a)
    b = np.cross(m, a)
    nm, na, nb = n @ m, n @ a, n @ b
    at, bt = a - na * n, b - nb * n
    mt = m - nm * n
    Q = case.quadric()
    mm, ma, mb, aa, ab, bb = m @ Q @ m, m @ Q @ a, m @ Q @ b, a @ Q @ a, a @ Q @ b, b @ Q @ b
    steps = F(4) ** np.arange(-1, 5)
    scale = case.law.scale
    lobe = grades(scale, pi, F) if scale is not None else np.zeros(0, F)
    kinked = case.earth.kink()

    def direction(psi, gamma):
        c, s = np.cos(psi), np.sin(psi)
        cg, sg = np.cos(gamma), np.sin(gamma)
        return [cg * m[j] + sg * (c * a[j] + s * b[j]) for j in range(3)]

    def inside(psi, gamma):
        w = direction(psi, gamma)
        p, pu, hit = case.ground(np.stack(w))
        return hit & (p[1] * case.s[1] + p[2] * case.s[2] > 0)

    def integrand(psi, gamma):
        c, s = np.cos(psi), np.sin(psi)
        half = np.sin(gamma / 2)
        one_minus = 2 * half * half
        sg = np.sin(gamma)
        w = np.stack(direction(psi, gamma))
        p, pu, _ = case.ground(w)
        nw = nm * (1 - one_minus) + sg * (c * na + s * nb)
        # tangential part of w - m, without cancellation
        D = np.sqrt(sum((sg * (c * at[j] + s * bt[j]) - one_minus * mt[j]) ** 2 for j in range(3)))
        L = case.radiance(p, pu, -(w[1] * case.s[1] + w[2] * case.s[2]))
        return L * case.law.value(one_minus, D) * np.maximum(nw, 0) * sg

    def breaks(psi):
        c, s = np.cos(psi), np.sin(psi)
        ez = c * a[2] + s * b[2]
        amplitude = np.hypot(m[2], ez)
        with np.errstate(invalid="ignore"):
            half = np.arccos(case.cos_limb / amplitude)  # nan: the ray misses the Earth
        centre = np.arctan2(-ez, -m[2])
        low, high = centre - half, centre + half
        wrap = high <= 0
        low, high = np.where(wrap, low + 2 * pi, low), np.where(wrap, high + 2 * pi, high)
        horizon = np.arctan2(c * na + s * nb, nm) + pi / 2
        low, high = np.maximum(low, 0), np.minimum(np.minimum(high, horizon), pi)
        none = ~(low < high)
        low, high = np.where(none, 0, low), np.where(none, 0, high)
        columns, flags = [low, high], [True, True]
        terminator = quadratic_angles(mm + 0 * c, c * ma + s * mb, c * c * aa + 2 * c * s * ab + s * s * bb)
        terminator = [np.mod(t, pi) for t in terminator]
        columns += terminator
        flags += [False, False]
        if case.law.kind == "phong":
            columns.append(np.full_like(psi, pi / 2))
            flags.append(True)
        for g in lobe:
            columns.append(np.full_like(psi, g))
            flags.append(False)
        if scale is not None:
            for start in [low, *terminator]:
                start = np.where(np.isfinite(start), start, 0)
                decay = np.minimum(scale, scale**2 / np.maximum(start, scale))
                for f in steps:
                    columns += [start + decay * f]
                    flags += [False]
        if kinked:
            roots = kink_roots(psi, low, high)
            columns += roots
            flags += [True] * len(roots)
        pos = np.stack(columns, axis=1)
        pos = np.where(np.isfinite(pos), pos, low[:, None])
        return np.clip(pos, low[:, None], high[:, None]), np.array(flags)

    def ru(psi, gamma):
        w = np.stack(direction(psi, gamma))
        p, pu, _ = case.ground(w)
        ws = w[1] * case.s[1] + w[2] * case.s[2]
        return 2 * (p[1] * case.s[1] + p[2] * case.s[2]) * pu + ws

    def kink_roots(psi, low, high, count=4):
        x = (1 - np.cos(np.linspace(F(0), pi, 81))) / 2
        g = low[:, None] + (high - low)[:, None] * x
        y = ru(np.broadcast_to(psi[:, None], g.shape), g)
        y = np.where(np.isfinite(y), y, 1)
        # a dip between two samples of one sign hides two roots: its lowest point becomes a sample
        side = np.where(y > 0, F(1), F(-1))
        size = np.abs(y)
        dip = (side[:, 1:-1] == side[:, :-2]) & (side[:, 1:-1] == side[:, 2:])
        i, j = np.nonzero(dip & (size[:, 1:-1] <= size[:, :-2]) & (size[:, 1:-1] <= size[:, 2:]))
        if len(i):
            lo, hi, sgn = g[i, j], g[i, j + 2], side[i, j + 1]
            for _ in range(48):
                one, two = lo + (hi - lo) * F(0.45), lo + (hi - lo) * F(0.55)
                left = sgn * ru(psi[i], one) < sgn * ru(psi[i], two)
                lo, hi = np.where(left, lo, one), np.where(left, two, hi)
            g[i, j + 1] = (lo + hi) / 2
            y[i, j + 1] = ru(psi[i], g[i, j + 1])
        change = (y[:, :-1] > 0) != (y[:, 1:] > 0)
        out = np.full((len(psi), count), np.nan, F)
        i, j = np.nonzero(change)
        if len(i):
            nth = np.cumsum(change, axis=1)[i, j] - 1
            lo, hi, up = g[i, j], g[i, j + 1], y[i, j + 1] > 0
            for _ in range(62):
                mid = (lo + hi) / 2
                above = (ru(psi[i], mid) > 0) == up
                lo, hi = np.where(above, lo, mid), np.where(above, mid, hi)
            ok = nth < count
            out[i[ok], nth[ok]] = hi[ok]
        return list(out.T)

    def angle(v):
        return np.arctan2(v @ b, v @ a)

    special = [angle(v) for v in case.corners()]
    out2 = case.cos_limb**2 - m[2] ** 2
    if out2 > 0 and np.hypot(a[2], b[2]) > 0:
        x = np.sqrt(out2) / np.hypot(a[2], b[2])
        if x <= 1:
            f0 = np.arctan2(b[2], a[2])
            special += [f0 + sign * np.arccos(v) for sign in (1, -1) for v in (x, -x)]
    # rays that touch the terminator: (mQe)^2 = (mQm)(eQe)
    for t in quadratic_angles(ma * ma - mm * aa, ma * mb - mm * ab, mb * mb - mm * bb):
        special += [t, t + pi]
    # across the nearest edges: limb, horizon of the surface, terminator
    centre = [F(0), np.arctan2(nb, na)]
    p, pu, hit = case.ground(m)
    if hit:
        grad = np.array([(Q @ m) @ a, (Q @ m) @ b])
        centre.append(np.arctan2(grad[1], grad[0]))
    for c0 in centre:
        special += [c0, c0 + pi / 2, c0 - pi / 2, c0 + pi]
    if kinked:
        def turn(w, dw):  # d psi = 0: dw in the plane of m and w
            c = np.cross(m, np.moveaxis(w, 0, -1))
            return dw[0] * c[..., 0] + dw[1] * c[..., 1] + dw[2] * c[..., 2]

        special += [angle(v) for v in case.kink_corners([*case.edge_functions(), turn])]
    edges = [F(0), 2 * pi] + [np.mod(v, 2 * pi) for v in special] + [j * pi / 4 for j in range(1, 8)]
    work = Nested(F, breaks, integrand, inside, rtol)
    value, err = work.integrate(edges)
    return value, err, work


def method_2(case, rtol):
    """About the vertical: w = (sin eta cos phi, sin eta sin phi, -cos eta), sin eta = k sin zeta."""
    F, pi, k, m, n, s = case.F, case.pi, case.k, case.m, case.n, case.s
    eta_m, phi_m = np.arctan2(np.hypot(m[0], m[1]), -m[2]), np.arctan2(m[1], m[0])
    eta_n, phi_n, nt = np.arctan2(np.hypot(n[0], n[1]), -n[2]), np.arctan2(n[1], n[0]), np.hypot(n[0], n[1])
    scale = case.law.scale
    kinked = case.earth.kink()
    steps = F(4) ** np.arange(-2, 14)

    def parts(zeta):
        sz, cz = np.sin(zeta), np.cos(zeta)
        se = k * sz
        ce = np.sqrt((1 - se) * (1 + se))
        return sz, cz, se, ce, sz * ce - cz * se, cz * ce + sz * se  # ..., sin theta, cos theta

    def lit(zeta, phi):
        sz, cz, se, ce, st, ct = parts(zeta)
        return st * np.sin(phi) * s[1] + ct * s[2]

    def inside(zeta, phi):
        sz, cz, se, ce, st, ct = parts(zeta)
        return (lit(zeta, phi) > 0) & (se * (n[0] * np.cos(phi) + n[1] * np.sin(phi)) - ce * n[2] > 0)

    def integrand(zeta, phi):
        sz, cz, se, ce, st, ct = parts(zeta)
        cp, sp = np.cos(phi), np.sin(phi)
        w = [se * cp, se * sp, -ce]
        ps = st * sp * s[1] + ct * s[2]
        ro = 2 * ps * cz + w[1] * s[1] + w[2] * s[2]
        L = case.earth.value(1 - ro, 0) * np.maximum(ps, 0)
        nw = n[0] * w[0] + n[1] * w[1] + n[2] * w[2]
        apart = [w[j] - m[j] for j in range(3)]
        along = sum(apart[j] * n[j] for j in range(3))
        D = np.sqrt(sum((apart[j] - along * n[j]) ** 2 for j in range(3)))
        one_minus = sum(v * v for v in apart) / 2
        return L * case.law.value(one_minus, D) * np.maximum(nw, 0) * k * k * sz * cz / ce

    def breaks(zeta):
        sz, cz, se, ce, st, ct = parts(zeta)
        columns, flags = [], []

        def cut(centre, cosine, flag):
            with np.errstate(invalid="ignore"):
                half = np.arccos(cosine)
            columns.extend([centre - half, centre + half])
            flags.extend([flag, flag])

        with np.errstate(divide="ignore", invalid="ignore"):
            cut(pi / 2, -s[2] * ct / (s[1] * st), False)
            cut(phi_n, n[2] * ce / (nt * se), False)
            if case.law.kind == "phong":
                cut(phi_m, m[2] * ce / (np.hypot(m[0], m[1]) * se), True)
            if kinked:
                ssum, csum = sz * ct + cz * st, cz * ct - sz * st
                cut(pi / 2, -s[2] * csum / (s[1] * ssum), True)
        if scale is not None:
            width = scale / np.maximum(se, scale)
            for f in steps:
                for sign in (1, -1):
                    off = width * f
                    columns.append(np.where(off < pi, phi_m + sign * off, phi_m))
                    flags.append(False)
        columns.append(phi_m + 0 * zeta)
        flags.append(False)
        start = phi_m - pi
        pos = [start + np.mod(c - start, 2 * pi) for c in columns] + [start + 0 * zeta, start + 2 * pi + 0 * zeta]
        flags += [False, False]
        pos = np.stack(pos, axis=1)
        return np.where(np.isfinite(pos), pos, start), np.array(flags)

    special = [F(0), pi / 2]

    def at_eta(eta):
        x = np.sin(eta) / k
        if 0 < eta < pi / 2 and x < 1:
            special.append(np.arcsin(x))

    half_pi = pi / 2
    for axis, halves in ((eta_n, [half_pi]), (eta_m, [half_pi] if case.law.kind == "phong" else [])):
        for h in halves:
            for e in (abs(axis - h), axis + h, 2 * pi - axis - h):
                at_eta(e)
    at_eta(eta_m)
    if scale is not None:
        for f in grades(scale, pi, F):
            at_eta(eta_m + f)
            at_eta(eta_m - f)
            at_eta(np.arcsin(k) - f)
    special += [np.arctan2(np.sin(abs(case.E)), np.cos(abs(case.E)) - k)]
    for v in case.corners():
        at_eta(np.arctan2(np.hypot(v[0], v[1]), -v[2]))
    if kinked:
        zeta = np.linspace(F(0), half_pi, 4001)
        total = 2 * zeta - np.arcsin(k * np.sin(zeta))
        for wanted in (abs(case.E), pi - abs(case.E)):
            j = np.nonzero((total[:-1] < wanted) & (total[1:] >= wanted))[0]
            for lo, hi in [(zeta[q], zeta[q + 1]) for q in j]:
                for _ in range(62):
                    mid = (lo + hi) / 2
                    lo, hi = (mid, hi) if 2 * mid - np.arcsin(k * np.sin(mid)) < wanted else (lo, mid)
                special.append(lo)
    if kinked:
        across = lambda w, _: m[0] * w[0] + m[1] * w[1] + m[2] * w[2]
        for v in case.kink_corners([*case.edge_functions(), across]):
            at_eta(np.arctan2(np.hypot(v[0], v[1]), -v[2]))
    special += [half_pi * j / 4 for j in range(1, 4)]
    work = Nested(F, breaks, integrand, inside, rtol)
    value, err = work.integrate([v for v in special if 0 <= v <= half_pi])
    return value, err, work


def solve(row, F=np.float64, both=True):
    """direct, earth, relative difference of the two methods, nodes. F is the type of method 1's integral."""
    case = Case(row, np.longdouble)
    with np.errstate(under="ignore"):
        direct = case.direct()
        if case.mirror:
            earth = case.F(0) if case.below or case.no <= 0 else case.F(case.params[0]) * case.spread() * case.mirror_earth()
            return direct, earth, 0.0, 0
        if case.dark():
            return direct, case.F(0), 0.0, 0
        rtol = 3e-11 if F is np.float64 else 1e-9
        one, _, work = method_1(case if F is np.longdouble else Case(row, F), rtol)
        two, nodes = one, work.nodes
        if both:
            two, _, work_2 = method_2(Case(row, np.float64), 3e-11)
            nodes += work_2.nodes
        err = float(abs(two / one - 1)) if one != 0 else float(two != 0)
        return direct, one * case.spread(), err, nodes


def read(path):
    text = "".join(line for line in open(path) if not line.startswith("#"))
    return list(csv.DictReader(io.StringIO(text)))


def check(path, F, only=None):
    """Compares a file of this format with the two methods."""
    worst = {}
    rows = [r for r in read(path) if only is None or r["id"] in only]
    for row in rows:
        start = time.time()
        direct, earth, err, nodes = solve(row, F)
        want_direct, want = float(row["direct_per_E0"]), float(row["earth_per_E0"])
        off = abs(float(earth) / want - 1) if want else abs(float(earth))
        off_direct = abs(float(direct) / want_direct - 1) if want_direct else abs(float(direct))
        worst[row["id"]] = (off, off_direct, float(err))
        if off > 1e-10 or off_direct > 1e-10 or err > 1e-10:
            print(f"{row['id']} {row['tags']} {row['brdf']} earth off {off:.1e} direct off {off_direct:.1e} "
                  f"methods apart {float(err):.1e} listed {row['err_earth']} {nodes} nodes {time.time() - start:.1f} s", flush=True)
    v = np.array(list(worst.values()))
    print(f"{len(v)} rows; earth: median {np.median(v[:, 0]):.1e} worst {v[:, 0].max():.1e}; "
          f"direct worst {v[:, 1].max():.1e}; methods apart worst {v[:, 2].max():.1e}")


# the cases --------------------------------------------------------------------------------------------------------
SURFACES = [
    ("lambertian", "0.4", "", ""),
    ("lambertian", "1", "", ""),
    ("phong", "0.34", "0.4", "8.9"),
    ("phong", "0.15", "0.25", "0.26"),
    ("phong", "0.1", "0.5", "0"),
    ("phong", "0.2", "0.3", "1"),
    ("phong", "0", "0.9", "3.5"),
    ("phong", "0", "0.8", "60"),
    ("phong", "0.05", "0.85", "1000"),
    ("phong", "0.02", "0.9", "30000"),
    ("phong", "0", "1", "1000000"),
    ("phong", "0.9", "0.8", "12"),  # creates light
    ("gaussian", "100", "0.001", ""),
    ("gaussian", "1500", "0.0001", ""),
    ("gaussian", "12000", "0.00001", ""),
    ("gaussian", "100000", "0.000001", ""),
    ("gaussian", "100000000", "0.000000001", ""),
    ("abg", "0.003362", "0.000004309", "2.068"),
    ("abg", "0.001", "0.000000001", "2"),
    ("abg", "0.0002", "0.00000000001", "2.6"),
    ("abg", "0.02", "0.001", "1.3"),
    ("binomial_starlink_v15_chassis", "", "", ""),
    ("binomial_starlink_v15_chassis", "", "", ""),
    ("binomial_starlink_v15_chassis", "", "", ""),
    ("binomial_starlink_v15_solar", "", "", ""),
    ("binomial_starlink_v15_solar", "", "", ""),
    ("mirror", "0.8", "0.2665", ""),
    ("mirror", "1", "0.265", ""),
]
EARTHS = [
    ("phong", "0.53", "0.28", "7.31"),
    ("phong", "0.53", "0.28", "7.31"),
    ("phong", "0.48", "0.08", "16.45"),
    ("lambertian", "0.3", "", ""),
    ("lambertian", "1", "", ""),
    ("phong", "0.2", "0.5", "0"),
    ("phong", "0.1", "0.6", "0.26"),
    ("phong", "0.3", "0.3", "1"),
    ("phong", "0.1", "0.2", "2.5"),
    ("phong", "0.2", "0.4", "200"),
]
SOURCES = ["day", "day", "day", "subsolar", "e_zero", "e_zero", "past_terminator", "past_terminator", "sliver", "umbra_edge",
           "nadir_source", "terminator_in_view", "terminator_in_view", "terminator_in_view"]
OBSERVERS = ["sky"] * 10 + ["zenith", "horizon", "horizon", "below_horizon"]
AIMS = ["limb", "limb", "limb", "terminator", "terminator", "terminator", "corner", "corner", "lit_ground", "lit_ground",
        "dark_side", "off_earth", "grazing_observer", "grazing_limb", "over_limb", "direct", "glint", "nadir", "panel",
        "anti_source", "away", "random"]


def unit(v):
    return v / np.sqrt(v @ v)


def any_unit(rng):
    return unit(rng.normal(size=3))


def beside(rng, v, towards, delta):
    """v turned by delta towards the component of `towards` across it."""
    across = towards - (towards @ v) * v
    if across @ across < 1e-20:
        across = np.cross(v, [1.0, 0.3, 0.2])
    return math.cos(delta) * v + math.sin(delta) * unit(across)


def draw(rng, number):
    """One case as text; None where the draw contradicts itself."""
    source, observer, aim = (str(rng.choice(x)) for x in (SOURCES, OBSERVERS, AIMS))
    pick = rng.uniform()
    if pick < 0.12:
        height = float(rng.choice([35786000.0, 42164000.0, 1e9]))
    elif pick < 0.2:
        height = float(rng.choice([100000.0, 120000.0]))
    elif pick < 0.6:
        height = round(float(rng.uniform(3e5, 1.5e6)))
    else:
        height = round(float(10 ** rng.uniform(5, 8)))
    R = float(R_M)
    k = R / (R + height)
    dip = math.acos(k)
    sign = rng.choice([-1.0, 1.0])
    elevation = {
        "day": lambda: rng.uniform(dip, math.pi / 2) if rng.uniform() < 0.8 else dip * (1 + 10 ** rng.uniform(-6, -1)),
        "subsolar": lambda: math.pi / 2 - (0.0 if rng.uniform() < 0.5 else 10 ** rng.uniform(-7, -1)),
        "e_zero": lambda: sign * (0.0 if rng.uniform() < 0.2 else 10 ** rng.uniform(-8, -2)),
        "past_terminator": lambda: -dip * rng.uniform(0, 1),
        "terminator_in_view": lambda: dip * rng.uniform(0, 1),
        "sliver": lambda: -dip + dip * 10 ** rng.uniform(-5, -0.7),
        "umbra_edge": lambda: -dip + sign * 10 ** rng.uniform(-9, -3),
        "nadir_source": lambda: -math.pi / 2 + (0.0 if rng.uniform() < 0.5 else 10 ** rng.uniform(-5, 0)),
    }[source]()
    src_deg = f"{math.degrees(elevation):.12f}".rstrip("0").rstrip(".") if abs(math.degrees(elevation)) != 90 else f"{math.copysign(90, elevation):.0f}"
    E = math.radians(float(src_deg))
    s = np.array([0.0, math.cos(E), math.sin(E)])
    # the observer at an altitude of the satellite
    alt = {"sky": lambda: rng.uniform(2, 89), "zenith": lambda: 90.0, "horizon": lambda: 10 ** rng.uniform(-3, 0.5),
           "below_horizon": lambda: -(10 ** rng.uniform(-3, 1))}[observer]()
    if observer == "zenith":
        obs = np.array([0.0, 0.0, R])
    else:
        nadir = math.asin(min(1.0, k * math.cos(math.radians(alt))))
        theta = math.pi / 2 - math.radians(alt) - nadir
        phi = rng.uniform(0, 2 * math.pi)
        obs = R * np.array([math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta)])
    obs_text = [f"{x:.6f}" for x in obs]
    obs = np.array([float(x) for x in obs_text])
    sat = np.array([0.0, 0.0, R + height])
    o = unit(obs - sat)
    limb = math.asin(k)

    def view(eta, phi):
        return np.array([math.sin(eta) * math.cos(phi), math.sin(eta) * math.sin(phi), -math.cos(eta)])

    def ground_view(theta, phi):
        p = np.array([math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta)])
        return unit(R * p - sat)

    delta = float(sign * 10 ** rng.uniform(-6, -0.5)) if rng.uniform() < 0.85 else float(sign * 10 ** rng.uniform(-9, -6))
    lit_phi = math.pi / 2 + rng.normal() * 0.8
    m = n = None
    if aim == "limb":
        m = view(limb + delta, lit_phi)
    elif aim == "terminator":
        # a visible point of the terminator, beside it by delta
        if abs(math.tan(E)) >= math.tan(dip) or abs(E) < 1e-300:
            return None
        theta = abs(E) + (dip - abs(E)) * rng.uniform()
        phi = math.pi / 2 + sign * math.acos(max(-1.0, min(1.0, -math.tan(E) / math.tan(theta))))
        v = ground_view(theta, phi)
        m = beside(rng, v, s, delta)
    elif aim == "corner":
        if abs(math.tan(E)) >= math.tan(dip):
            return None
        phi = math.pi / 2 + sign * math.acos(-math.tan(E) / math.tan(dip))
        m = beside(rng, view(limb, phi), any_unit(rng), delta)
    elif aim == "lit_ground":
        m = ground_view(dip * math.sqrt(rng.uniform()), lit_phi)
    elif aim == "dark_side":
        m = ground_view(dip * math.sqrt(rng.uniform()), -lit_phi)
    elif aim == "off_earth":
        m = view(limb + rng.uniform(0.02, 1.2), lit_phi)
    elif aim == "grazing_observer":
        across = unit(np.cross(o, any_unit(rng)))
        n = unit(across + o * 10 ** rng.uniform(-5.5, -1.5))
    elif aim == "grazing_limb":
        # the surface's horizon beside the limb: only a sliver of ground in front of it
        eta = limb + math.pi / 2 - abs(delta)
        n = view(eta, lit_phi)
    elif aim == "over_limb":
        n = view(math.pi / 2 - limb * rng.uniform(-1, 1), rng.uniform(0, 2 * math.pi))
    elif aim == "direct":
        m = beside(rng, s, any_unit(rng), 10 ** rng.uniform(-4, -1.5))
    elif aim == "glint":
        # the Earth's own specular point, found by bisection on the arc between satellite and source
        lo, hi = 0.0, min(dip, max(0.0, math.pi / 2 - E))
        for _ in range(60):
            mid = (lo + hi) / 2
            p = np.array([0.0, math.sin(mid), math.cos(mid)])
            to = unit(sat - R * p)
            lo, hi = (mid, hi) if p @ to > p @ s else (lo, mid)
        m = beside(rng, ground_view(lo, math.pi / 2), any_unit(rng), abs(delta))
    elif aim == "nadir":
        n = np.array([0.0, 0.0, -1.0])
    elif aim == "panel":
        n = np.array([0.0, 1.0, 0.0])
    elif aim == "anti_source":
        n = -s
    elif aim == "away":
        n = beside(rng, np.array([0.0, 0.0, 1.0]), any_unit(rng), rng.uniform(0, math.pi / 2 - limb))
    else:
        n = any_unit(rng)
        n = n if n @ o > 0 else -n
    if n is None:
        if (m + o) @ (m + o) < 1e-16:
            return None
        n = unit(m + o)
    surface, earth = SURFACES[rng.integers(len(SURFACES))], EARTHS[rng.integers(len(EARTHS))]
    if aim == "direct" and rng.uniform() < 0.5:
        surface = SURFACES[-1 - rng.integers(2)]
        if surface[0] == "mirror":  # the observer just inside or outside the disc
            alpha = math.radians(float(surface[2]))
            n = unit(beside(rng, s, any_unit(rng), alpha * (1 + sign * 10 ** rng.uniform(-4, -0.5))) + o)
    if surface[0] == "mirror":
        exact = unit(n)
        m_now = 2 * (exact @ o) * exact - o
        apart = m_now - s
        if abs(2 * math.asin(min(1.0, math.sqrt(apart @ apart) / 2)) - math.radians(float(surface[2]))) < 1e-7:
            return None
    # topocentric columns: any north will do
    up = unit(obs)
    north = unit(np.cross(any_unit(rng), up))
    east = np.cross(north, up)

    def altaz(v):
        return math.degrees(math.atan2(v @ up, math.hypot(v @ north, v @ east))), math.degrees(math.atan2(v @ east, v @ north)) % 360

    sat_altaz, src_altaz = altaz(unit(sat - obs)), altaz(s)
    row = {"id": f"R{number:04d}", "tags": f"{source}|{observer}|{aim}", "height_m": f"{height:.1f}", "src_elev_deg": src_deg}
    row |= dict(zip(("obs_x_m", "obs_y_m", "obs_z_m"), obs_text))
    row |= {"sat_alt_deg": f"{sat_altaz[0]:.10f}", "sat_az_deg": f"{sat_altaz[1]:.10f}"}
    row |= {"src_alt_deg": f"{src_altaz[0]:.10f}", "src_az_deg": f"{src_altaz[1]:.10f}"}
    row |= dict(zip(("nx", "ny", "nz"), (f"{x:.17g}" for x in n)))
    row |= {"area_m2": str(rng.choice(["1.0", "3.65", "22.0", "2841.32"]))}
    row |= dict(zip(("brdf", "p1", "p2", "p3"), surface)) | dict(zip(("earth_brdf", "ep1", "ep2", "ep3"), earth))
    return row


def sane(row):
    """Inputs that mean the same to every reader: no row whose 0 or 1 hangs on the last digit."""
    case = Case(row, np.longdouble)
    dip = np.arccos(case.k)
    if 0 < abs(case.E + dip) < 5e-10 or 0 < abs(case.no) < 1e-6 or 0 < abs(case.n[2] - case.k) < 1e-9:
        return False
    obs_edge = abs(case.F(row["obs_z_m"]) / R_M - case.k)
    return obs_edge > 1e-9 and abs(case.E) <= case.pi / 2


def write(path, rows, seed, number, dropped, share_zero):
    with open(path, "w", newline="") as f:
        f.write(
            f"# Adversarial cases of the brightness model; made by scripts/make_brightness_vectors.py, seed {seed}.\n"
            "# Frame, columns and rules: the head of that script. direct, earth: W/m2 at the observer per W/m2 of the source;\n"
            "# err_earth: relative difference of two independent quadratures (0: mirror in closed form, or nothing to integrate).\n"
            f"# Drawn {number}, kept {len(rows)}; left out: {dropped['methods disagree']} whose two quadratures differ by more than 1e-10,\n"
            f"# {dropped['flux below 1e-60']} with a flux between 0 and 1e-60, and cases with neither light beyond {share_zero:.0%} of the rows.\n"
        )
        w = csv.DictWriter(f, COLUMNS, lineterminator="\n")
        w.writeheader()
        w.writerows(rows)


def make(seed, wanted, F, path, both=True, share_zero=0.12):
    rng = np.random.default_rng(seed)
    rows, dropped, zeros, number, extended = [], {"methods disagree": 0, "flux below 1e-60": 0}, 0, 0, 0
    start = time.time()
    while len(rows) < wanted:
        row = draw(rng, len(rows) + 1)
        if row is None or not sane(row):
            continue
        number += 1
        direct, earth, err, _ = solve(row, np.float64, both)
        if err > 2e-11 and F is np.longdouble:
            direct, earth, err, _ = solve(row, F, both)
            extended += 1
        if not (np.isfinite(float(earth)) and np.isfinite(float(direct))) or err > 1e-10:
            dropped["methods disagree"] += 1
            print(f"dropped {row} {float(earth):.3e} {float(err):.1e}", file=sys.stderr, flush=True)
            continue
        if 0 < earth < 1e-60 or 0 < direct < 1e-60:
            dropped["flux below 1e-60"] += 1
            continue
        if earth == 0 and direct == 0:
            if zeros >= share_zero * wanted:
                continue
            zeros += 1
        rows.append(row | {"direct_per_E0": f"{float(direct):.15e}", "earth_per_E0": f"{float(earth):.15e}", "err_earth": f"{float(err):.1e}"})
        if len(rows) % 50 == 0:
            print(f"{len(rows)} rows, {time.time() - start:.0f} s", file=sys.stderr, flush=True)
            write(path, rows, seed, number, dropped, share_zero)
    write(path, rows, seed, number, dropped, share_zero)
    print(f"{len(rows)} rows in {path}; {dropped}; {extended} in longdouble; {time.time() - start:.0f} s")


if __name__ == "__main__":
    here = pathlib.Path(__file__).resolve().parent.parent
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("--check", metavar="CSV")
    p.add_argument("--only", help="ids, separated by commas")
    p.add_argument("--seed", type=int, default=20260101)
    p.add_argument("--rows", type=int, default=320)
    p.add_argument("--double", action="store_true", help="float64 alone: faster, some rows are lost to rounding")
    p.add_argument("--one", action="store_true", help="method 1 alone")
    p.add_argument("--out", default=str(here / "fixtures/brightness/vectors.csv"))
    args = p.parse_args()
    number_type = np.float64 if args.double else np.longdouble
    if args.check:
        check(args.check, number_type, args.only and args.only.split(","))
    else:
        make(args.seed, args.rows, number_type, args.out, not args.one)
