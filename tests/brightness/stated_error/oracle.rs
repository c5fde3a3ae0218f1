//! The Earth-reflected integral by another method than the engine's: polar about the mirror direction, azimuth outside.
//!
//! `w = cos γ m + sin γ e(ψ)`. On a ray the limb, the terminator, the surface's horizon and the end of its lobe are
//! closed forms, the end of the ground's lobe is searched for; both integrals are adaptive Gauss-Kronrod rules of 21
//! points. Nothing of the engine is used: laws, ground and rays are written anew from their definitions.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use satphot::base::vector::{Itrs, Vector};
use satphot::brightness::Brdf;

use super::rule::{Panels, Sum};

/// Relative error aimed at along a ray, and over all rays.
const ALONG: f64 = 1e-13;
const OVER: f64 = 2e-12;
/// Bisections allowed along a ray, and over all rays.
const SPLITS: (usize, usize) = (300, 1_500);
/// Places at which a ray is looked at for the end of the ground's lobe.
const LOOKS: usize = 48;

/// One surface over the lit Earth: radius 1, satellite on the z axis, source in the y-z plane.
pub struct Case {
    k: f64,
    s: Vector<Itrs>,
    n: Vector<Itrs>,
    m: Vector<Itrs>,
    law: Brdf,
    earth: Brdf,
    /// Towards nadir and across, at right angles to m.
    a: Vector<Itrs>,
    b: Vector<Itrs>,
    /// The middle of the lobe.
    width: f64,
}

impl Case {
    pub fn new(k: f64, s: Vector<Itrs>, laws: [&Brdf; 2], [n, o]: [Vector<Itrs>; 2]) -> Self {
        let cos_out = n.dot(&o);
        let m = n * (2.0 * cos_out) - o;
        // level and across first: a then keeps its digits where m points almost to nadir
        let b = Vector::new(-m.y(), m.x(), 0.0).unit().or_else(|| m.any_perpendicular()).unwrap();
        let width = match laws[1] {
            Brdf::Phong { n, .. } => n.powf(-0.5),
            Brdf::Gaussian { sigma, .. } => sigma.sqrt(),
            Brdf::Abg { b, g, .. } => b.powf(1.0 / g),
            Brdf::Binomial(_) => 2e-3,
            _ => f64::INFINITY,
        };
        Self { k, s, n, m, law: laws[1].clone(), earth: laws[0].clone(), a: b.cross(&m), b, width }
    }

    /// ∫ L f (n·w) dω \[1/sr\] and its estimated error.
    pub fn per_sr(&self) -> Sum {
        let mut scale = 0.0;
        let mut total = Sum::default();
        let edges = self.azimuths();
        for (rough, along, over) in [(true, 1e-4, 1e-2), (false, ALONG, OVER)] {
            let mut panels = Panels::clustered(&edges);
            let limit = if rough { 20 } else { SPLITS.1 };
            total = panels.refined(|psi| self.ray(psi, along, scale), over, 0.0, limit);
            scale = 0.01 * total.value / TAU;
        }
        total
    }

    /// ∫ along one ray.
    fn ray(&self, psi: f64, tolerance: f64, scale: f64) -> Sum {
        let e = self.a * psi.cos() + self.b * psi.sin();
        let Some(marks) = self.marks(&e) else { return Sum::default() };
        let (m, n) = (self.m, self.n);
        let (e_t, m_t) = (e - n * n.dot(&e), m - n * n.dot(&m));
        let mut panels = Panels::default();
        for pair in marks.windows(2) {
            let middle = 0.5 * (pair[0].0 + pair[1].0);
            let w = m * middle.cos() + e * middle.sin();
            let (p, rising) = self.ground(&w);
            if pair[1].0 > pair[0].0 && rising > 0.0 && p.dot(&self.s) > 0.0 && n.dot(&w) > 0.0 {
                panels.push(pair[0].0, pair[1].0, pair[0].1 || pair[1].1);
            }
        }
        let integrand = |gamma: f64| {
            let (sin, half) = (gamma.sin(), (0.5 * gamma).sin());
            let sagitta = 2.0 * half * half;
            let w = m * gamma.cos() + e * sin;
            let tangential = e_t * sin - m_t * sagitta;
            let cos_in = n.dot(&m) * (1.0 - sagitta) + n.dot(&e) * sin;
            let value = self.radiance(&w) * self.f(sagitta, tangential) * cos_in.max(0.0) * sin;
            Sum { value, err: 0.0 }
        };
        panels.refined(integrand, tolerance, scale, SPLITS.0)
    }

    /// Where a ray changes character, rising, and whether like a root or a power there.
    fn marks(&self, e: &Vector<Itrs>) -> Option<Vec<(f64, bool)>> {
        let (m, n) = (&self.m, &self.n);
        // limb: the plane of the ray passes the vertical at the sine c
        let c = m.cross(e).z();
        let half = ((self.k - c) * (self.k + c)).max(0.0).sqrt().atan2(((1.0 - self.k) * (1.0 + self.k)).sqrt());
        let centre = (-e.z()).atan2(-m.z());
        let (mut low, mut high) = (centre - half, centre + half);
        if high <= 0.0 {
            (low, high) = (low + TAU, high + TAU);
        }
        low = low.max(0.0);
        high = high.min(n.dot(e).atan2(n.dot(m)) + FRAC_PI_2).min(PI);
        if !(low < high) {
            return None;
        }
        let mut marks = vec![(low, true), (high, true)];
        let mut steps = vec![];
        // terminator, w·Q·w = 0
        let q = |a: &Vector<Itrs>, b: &Vector<Itrs>| {
            let s = &self.s;
            (1.0 - self.k) * (1.0 + self.k) * s.dot(a) * s.dot(b) - s.z() * (a.z() * s.dot(b) + b.z() * s.dot(a))
                + s.z() * s.z() * a.dot(b)
        };
        let (mm, me, ee) = (q(m, m), q(m, e), q(e, e));
        let amplitude = (0.5 * (mm - ee)).hypot(me);
        let ratio = -0.5 * (mm + ee) / amplitude;
        if ratio.abs() < 1.0 + 1e-9 {
            let (turn, middle) = (0.5 * ratio.clamp(-1.0, 1.0).acos(), 0.5 * me.atan2(0.5 * (mm - ee)));
            for root in [middle - turn, middle + turn] {
                marks.push((root.rem_euclid(PI), false));
                steps.push(root.rem_euclid(PI));
            }
        }
        if let Brdf::Phong { .. } = self.law {
            marks.push((FRAC_PI_2, true));
        }
        if self.width < 1.0 {
            let mut scale = 0.25 * self.width;
            while scale < high {
                marks.push((scale, false));
                scale *= 4.0;
            }
            steps.push(low);
            for start in steps {
                let decay = self.width.min(self.width * self.width / start.max(self.width));
                marks.extend((-1..5).map(|j| (start + decay * 4.0_f64.powi(j), false)));
            }
        }
        if matches!(self.earth, Brdf::Phong { n, .. } if n < 30.0) {
            self.ends_of_ground_lobe(e, low, high, &mut marks);
        }
        marks.retain(|mark| mark.0 >= low && mark.0 <= high);
        marks.sort_by(|a, b| a.0.total_cmp(&b.0));
        Some(marks)
    }

    /// Places with r·u = 0 along a ray.
    fn ends_of_ground_lobe(&self, e: &Vector<Itrs>, low: f64, high: f64, marks: &mut Vec<(f64, bool)>) {
        let side = |gamma: f64| self.mirrored(&(self.m * gamma.cos() + *e * gamma.sin()));
        let at = |j: usize| low + (high - low) * 0.5 * (1.0 - (PI * j as f64 / LOOKS as f64).cos());
        let values: Vec<f64> = (0..=LOOKS).map(|j| side(at(j))).collect();
        let mut root = |mut a: f64, mut b: f64, up: bool| {
            for _ in 0..60 {
                let middle = 0.5 * (a + b);
                if (side(middle) > 0.0) == up { b = middle } else { a = middle }
            }
            marks.push((b, true));
        };
        for j in 0..LOOKS {
            let (here, next) = (values[j] > 0.0, values[j + 1] > 0.0);
            if here != next {
                root(at(j), at(j + 1), next);
            } else if j > 0 && (values[j - 1] > 0.0) == here {
                // a dip between places of one sign
                let size = [values[j - 1].abs(), values[j].abs(), values[j + 1].abs()];
                if size[1] <= size[0] && size[1] <= size[2] {
                    let (mut a, mut b) = (at(j - 1), at(j + 1));
                    for _ in 0..48 {
                        let (one, two) = (a + 0.45 * (b - a), a + 0.55 * (b - a));
                        let toward = if here { side(one) < side(two) } else { side(one) > side(two) };
                        if toward { b = two } else { a = one }
                    }
                    let lowest = 0.5 * (a + b);
                    if (side(lowest) > 0.0) != here {
                        root(at(j - 1), lowest, !here);
                        root(lowest, at(j + 1), here);
                    }
                }
            }
        }
    }

    /// Azimuths at which the rays change character.
    fn azimuths(&self) -> Vec<f64> {
        let angle = |v: &Vector<Itrs>| v.dot(&self.b).atan2(v.dot(&self.a)).rem_euclid(TAU);
        let mut edges: Vec<f64> = (0..=8).map(|j| TAU * f64::from(j) / 8.0).collect();
        let (sn, cn) = (self.k, ((1.0 - self.k) * (1.0 + self.k)).sqrt());
        // tangents to the limb
        let st = self.m.x().hypot(self.m.y());
        if st > sn {
            let t = (sn / st).asin();
            edges.extend([t, TAU - t, PI - t, PI + t]);
        }
        // terminator on the limb: p.z = k, p·s = 0
        if self.s.y() > 0.0 {
            let y = -self.s.z() * sn / self.s.y();
            let x2 = 1.0 - sn * sn - y * y;
            if x2 >= 0.0 {
                edges.extend([1.0, -1.0].map(|side| angle(&Vector::new(side * x2.sqrt(), y, sn - 1.0 / sn))));
            }
        }
        // horizon on the limb
        let nt = self.n.x().hypot(self.n.y());
        if nt > 0.0 && (self.n.z() * cn / (nt * sn)).abs() <= 1.0 {
            let (at, half) = (self.n.y().atan2(self.n.x()), (self.n.z() * cn / (nt * sn)).acos());
            edges.extend([at - half, at + half].map(|f| angle(&Vector::new(sn * f.cos(), sn * f.sin(), -cn))));
        }
        // where lit ground begins nearest, and closely about it
        let first = |psi: f64| {
            let e = self.a * psi.cos() + self.b * psi.sin();
            let marks = self.marks(&e)?;
            marks.windows(2).find_map(|pair| {
                let middle = 0.5 * (pair[0].0 + pair[1].0);
                let w = self.m * middle.cos() + e * middle.sin();
                let (p, rising) = self.ground(&w);
                (pair[1].0 > pair[0].0 && rising > 0.0 && p.dot(&self.s) > 0.0).then_some(pair[0].0)
            })
        };
        let looks = 360;
        let near = |j: usize| first(TAU * j as f64 / f64::from(looks)).unwrap_or(f64::INFINITY);
        let all: Vec<f64> = (0..looks as usize).map(near).collect();
        let least = (0..looks as usize).min_by(|i, j| all[*i].total_cmp(&all[*j])).unwrap();
        if all[least] > 0.0 && all[least].is_finite() {
            let step = TAU / f64::from(looks);
            let (mut from, mut to) = ((least as f64 - 1.0) * step, (least as f64 + 1.0) * step);
            for _ in 0..60 {
                let (one, two) = (from + 0.45 * (to - from), from + 0.55 * (to - from));
                let toward = first(one).unwrap_or(f64::INFINITY) < first(two).unwrap_or(f64::INFINITY);
                if toward { to = two } else { from = one }
            }
            let nearest = 0.5 * (from + to);
            let mut off = self.width.min(1.0) * 1e-2;
            edges.push(nearest.rem_euclid(TAU));
            while off < 1.0 {
                edges.extend([(nearest - off).rem_euclid(TAU), (nearest + off).rem_euclid(TAU)]);
                off *= 8.0;
            }
        }
        edges.sort_by(f64::total_cmp);
        edges.dedup();
        edges
    }

    /// The ground point of a direction, and the sine of the satellite's altitude there.
    fn ground(&self, w: &Vector<Itrs>) -> (Vector<Itrs>, f64) {
        let sine = w.x().hypot(w.y());
        let rising = ((self.k - sine) * (self.k + sine)).max(0.0).sqrt() / self.k;
        let far = -w.z() / self.k - rising;
        (Vector::new(far * w.x(), far * w.y(), 1.0 / self.k + far * w.z()), rising)
    }

    /// r·u, r the mirror image of the source in the ground.
    fn mirrored(&self, w: &Vector<Itrs>) -> f64 {
        let (p, rising) = self.ground(w);
        2.0 * p.dot(&self.s) * rising + w.dot(&self.s)
    }

    /// f_E (p·s)₊.
    fn radiance(&self, w: &Vector<Itrs>) -> f64 {
        let (p, _) = self.ground(w);
        let f = match self.earth {
            Brdf::Lambert { albedo } => albedo / PI,
            Brdf::Phong { kd, ks, n } => {
                let c = self.mirrored(w);
                kd / PI + if c > 0.0 { ks * (n + 2.0) / TAU * c.min(1.0).powf(n) } else { 0.0 }
            }
            _ => panic!("no oracle for this ground"),
        };
        f * p.dot(&self.s).max(0.0)
    }

    /// f of the surface at 1 − r·o and the tangential part of w − m.
    fn f(&self, sagitta: f64, tangential: Vector<Itrs>) -> f64 {
        match &self.law {
            Brdf::Lambert { albedo } => albedo / PI,
            Brdf::Phong { kd, ks, n } => {
                let lobe = if sagitta < 1.0 { (n * (-sagitta).ln_1p()).exp() } else { 0.0 };
                kd / PI + ks * (n + 2.0) / TAU * lobe
            }
            Brdf::Gaussian { peak_per_sr, sigma } => peak_per_sr * (-sagitta / sigma).exp(),
            Brdf::Abg { a, b, g } => a / (b + tangential.norm().powf(*g)),
            Brdf::Binomial(law) => {
                // of one row: no V
                law.value(tangential.norm(), 0.0)
            }
            Brdf::Mirror { .. } => panic!("a mirror needs no integral"),
            _ => panic!("no oracle for this law"),
        }
    }
}
