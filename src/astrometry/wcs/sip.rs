//! SIP distortion: polynomials in pixels about the reference pixel, and their inverse.
//!
//! Source: Shupe et al. 2005 (ASP 347, 491). It does not cover the inverse polynomials AP and BP: the inverse is
//! iterated.

/// One SIP polynomial, Σ a_pq uᵖ vᑫ with u, v in pixels from CRPIX.
#[derive(Debug, Clone)]
pub(super) struct Sip {
    pub order: usize,
    /// (p, q, coefficient), zero terms excluded.
    pub terms: Vec<(i32, i32, f64)>,
}

impl Sip {
    /// Reads `A_ORDER, A_p_q` (or `B_...`); `None` if the order is absent or below 1.
    pub fn from_keys(axis: char, number: &dyn Fn(&str) -> Option<f64>) -> Result<Option<Sip>, String> {
        let key = format!("{axis}_ORDER");
        let Some(order) = number(&key) else { return Ok(None) };
        if !(0.0..=9.0).contains(&order) {
            return Err(format!("{key}: {order} is not a SIP order (0 to 9)"));
        }
        let order = order.round() as usize;
        let mut terms = Vec::new();
        for p in 0..=order {
            for q in 0..=order - p {
                let key = format!("{axis}_{p}_{q}");
                let a = number(&key).unwrap_or(0.0);
                if !a.is_finite() {
                    return Err(format!("{key}: {a} is not a finite SIP coefficient"));
                }
                if a != 0.0 {
                    terms.push((p as i32, q as i32, a));
                }
            }
        }
        Ok((!terms.is_empty()).then_some(Sip { order, terms }))
    }

    /// Value and derivatives along u and v.
    pub fn at(&self, u: f64, v: f64) -> (f64, f64, f64) {
        let mut sum = (0.0, 0.0, 0.0);
        for &(p, q, a) in &self.terms {
            let (up, vq) = (u.powi(p), v.powi(q));
            sum.0 += a * up * vq;
            if p > 0 {
                sum.1 += a * f64::from(p) * u.powi(p - 1) * vq;
            }
            if q > 0 {
                sum.2 += a * f64::from(q) * up * v.powi(q - 1);
            }
        }
        sum
    }
}

/// (u, v) from the distorted (U, V), Newton from the undistorted guess.
pub(super) fn undistort(sip: &[Option<Sip>; 2], big_u: f64, big_v: f64) -> Option<(f64, f64)> {
    if sip.iter().all(Option::is_none) {
        return Some((big_u, big_v));
    }
    let (mut u, mut v) = (big_u, big_v);
    for _ in 0..50 {
        let [a, b] = [0, 1].map(|i| sip[i].as_ref().map_or((0.0, 0.0, 0.0), |s| s.at(u, v)));
        let (fu, fv) = (u + a.0 - big_u, v + b.0 - big_v);
        let det = (1.0 + a.1) * (1.0 + b.2) - a.2 * b.1;
        if det.is_nan() || det <= 0.0 {
            return None;
        }
        let (du, dv) = (((1.0 + b.2) * fu - a.2 * fv) / det, ((1.0 + a.1) * fv - b.1 * fu) / det);
        u -= du;
        v -= dv;
        if !(u.is_finite() && v.is_finite()) {
            return None;
        }
        // 1e-9 px, or the last bits of a position far outside the frame
        if du.abs().max(dv.abs()) < 1e-9_f64.max(1e-14 * u.abs().max(v.abs())) {
            return Some((u, v));
        }
    }
    None
}
