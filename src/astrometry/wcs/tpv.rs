//! TPV: the tangent plane distorted by polynomials in its own coordinates, as SCAMP writes them.
//!
//! ξ' = Σ PV1_m · ξᵃ ηᵇ rᶜ and η' = Σ PV2_m · ηᵃ ξᵇ rᶜ in degrees, r = √(ξ² + η²), m = 0 to 39.
//! Source: the TPV convention of the FITS registry (NOAO). It does not cover the pixels.

/// Powers (own coordinate, the other, r) of term m.
const POWERS: [(i32, i32, i32); 40] = powers();

const fn powers() -> [(i32, i32, i32); 40] {
    let mut table = [(0, 0, 0); 40];
    let (mut m, mut degree) = (0, 0);
    while degree <= 7 {
        let mut other = 0;
        while other <= degree {
            table[m] = (degree - other, other, 0);
            m += 1;
            other += 1;
        }
        // odd degrees have a term in r alone
        if degree % 2 == 1 {
            table[m] = (0, 0, degree);
            m += 1;
        }
        degree += 1;
    }
    table
}

/// Both polynomials; axis 0 is ξ.
#[derive(Debug, Clone)]
pub(super) struct Tpv {
    /// (m, coefficient), zero terms excluded.
    terms: [Vec<(usize, f64)>; 2],
    /// Sine and cosine of LONPOLE − 180°, by which the distorted plane is turned.
    turn: (f64, f64),
}

/// Value, derivative along ξ, derivative along η.
type ValueAndGradient = [f64; 3];

impl Tpv {
    /// Reads PV1_m and PV2_m (exchanged where axis 1 is the declination).
    ///
    /// An axis without any term is undistorted; one with terms must have its PVi_1, which readers fill in differently.
    pub fn from_keys(number: &dyn Fn(&str) -> Option<f64>, swapped: bool, turn_deg: f64) -> Result<Tpv, String> {
        let axis = |i: usize| -> Result<Vec<(usize, f64)>, String> {
            let axis = if swapped { 2 - i } else { i + 1 };
            let all: Vec<(usize, f64)> = (0..40).filter_map(|m| Some((m, number(&format!("PV{axis}_{m}"))?))).collect();
            if let Some((m, v)) = all.iter().find(|(_, v)| !v.is_finite()) {
                return Err(format!("PV{axis}_{m}: {v} is not finite"));
            }
            if !all.is_empty() && all.iter().all(|(m, _)| *m != 1) {
                return Err(format!(
                    "PV{axis}_1 is missing among other PV{axis} terms: programs take it for 0 or for 1"
                ));
            }
            Ok(if all.is_empty() { vec![(1, 1.0)] } else { all.into_iter().filter(|(_, v)| *v != 0.0).collect() })
        };
        Ok(Tpv { terms: [axis(0)?, axis(1)?], turn: turn_deg.to_radians().sin_cos() })
    }

    /// The coefficients as cards, ξ on axis 1. A turned plane is not written: nothing of ours makes one.
    pub fn cards(&self) -> Vec<(String, f64)> {
        let axis = |i: usize| self.terms[i].iter().map(move |(m, v)| (format!("PV{}_{m}", i + 1), *v));
        axis(0).chain(axis(1)).collect()
    }

    fn at(&self, xi: f64, eta: f64) -> [ValueAndGradient; 2] {
        let r = xi.hypot(eta);
        [0, 1].map(|i| {
            let (own, other) = if i == 0 { (xi, eta) } else { (eta, xi) };
            let mut sum = [0.0; 3];
            for &(m, v) in &self.terms[i] {
                let (a, b, c) = POWERS[m];
                let (pa, pb) = (own.powi(a), other.powi(b));
                let (mut d_own, mut d_other) = (0.0, 0.0);
                if c > 0 {
                    sum[0] += v * r.powi(c);
                    // ∂rᶜ = c rᶜ⁻² x; at the centre 0
                    let slope = if r > 0.0 { f64::from(c) * r.powi(c - 2) } else { 0.0 };
                    (d_own, d_other) = (slope * own, slope * other);
                } else {
                    sum[0] += v * pa * pb;
                    if a > 0 {
                        d_own = f64::from(a) * own.powi(a - 1) * pb;
                    }
                    if b > 0 {
                        d_other = f64::from(b) * pa * other.powi(b - 1);
                    }
                }
                let (d_xi, d_eta) = if i == 0 { (d_own, d_other) } else { (d_other, d_own) };
                sum[1] += v * d_xi;
                sum[2] += v * d_eta;
            }
            sum
        })
    }

    /// From the plane of the pixels to the tangent plane \[deg\].
    pub fn apply(&self, xi: f64, eta: f64) -> (f64, f64) {
        let [x, y] = self.at(xi, eta);
        let (s, c) = self.turn;
        (c * x[0] + s * y[0], c * y[0] - s * x[0])
    }

    /// Back, by Newton's iteration; `None` where the polynomials have folded over.
    pub fn invert(&self, xi: f64, eta: f64) -> Option<(f64, f64)> {
        let (s, c) = self.turn;
        let (want_x, want_y) = (c * xi - s * eta, s * xi + c * eta);
        let (mut x, mut y) = (want_x, want_y);
        for _ in 0..50 {
            let [p, q] = self.at(x, y);
            let (fx, fy) = (p[0] - want_x, q[0] - want_y);
            let det = p[1] * q[2] - p[2] * q[1];
            if det.is_nan() || det <= 0.0 {
                return None;
            }
            let (dx, dy) = ((q[2] * fx - p[2] * fy) / det, (p[1] * fy - q[1] * fx) / det);
            x -= dx;
            y -= dy;
            if !(x.is_finite() && y.is_finite()) {
                return None;
            }
            // 1e-13 deg is 4e-10 arcsec
            if dx.abs().max(dy.abs()) < 1e-13_f64.max(1e-15 * x.abs().max(y.abs())) {
                return Some((x, y));
            }
        }
        None
    }
}
