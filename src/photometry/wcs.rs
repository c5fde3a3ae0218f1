//! World coordinates: pixel to sky and back on the tangent plane, with SIP distortion.
//!
//! Pixels 0-based (centre of the first pixel = 0), degrees at the edges, J2000/ICRS. Left out: projections other than
//! TAN, SCAMP's PV polynomials, lookup-table distortions; a header with those is refused, never half used.

/// The value of a header card written by [`Wcs::cards`].
#[derive(Debug, Clone, PartialEq)]
pub enum WcsValue {
    /// A quoted string.
    Text(String),
    /// A number.
    Real(f64),
}

/// One SIP polynomial, Σ a_pq uᵖ vᑫ with u, v in pixels from CRPIX.
#[derive(Debug, Clone)]
struct Sip {
    order: usize,
    /// (p, q, coefficient), zero terms left out.
    terms: Vec<(i32, i32, f64)>,
}

impl Sip {
    /// Reads `A_ORDER, A_p_q` (or `B_...`); `None` if the order is absent or below 1.
    fn from_keys(axis: char, number: &dyn Fn(&str) -> Option<f64>) -> Result<Option<Sip>, String> {
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
    fn at(&self, u: f64, v: f64) -> (f64, f64, f64) {
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

/// A tangent-plane coordinate system.
///
/// (ξ, η) = CD · (u + A(u,v), v + B(u,v)) with (u, v) = pixel − CRPIX; (ξ, η) is the gnomonic projection about CRVAL.
///
/// Source: Calabretta & Greisen 2002 (A&A 395, 1077); Shupe et al. 2005 (ASP 347, 491) for SIP.
#[derive(Debug, Clone)]
pub struct Wcs {
    /// (RA, Dec) of the reference point \[deg\].
    crval_deg: [f64; 2],
    /// Reference pixel, FITS convention (1-based).
    crpix: [f64; 2],
    /// Rows ξ (east), η (north); columns x, y \[deg/px\].
    cd: [[f64; 2]; 2],
    /// Its inverse \[px/deg\].
    inverse: [[f64; 2]; 2],
    sip: [Option<Sip>; 2],
}

impl Wcs {
    /// Reads a header through two look-ups: a keyword's number, a keyword's text.
    ///
    /// CD, or PC with CDELT, or CDELT with CROTA2. SIP terms are used whenever `A_ORDER` or `B_ORDER` is there, also when
    /// CTYPE lacks `-SIP`. `Ok(None)`: the header has no celestial coordinates.
    ///
    /// # Errors
    /// The keyword that makes the solution unusable, with its value.
    pub fn from_keys(
        number: &dyn Fn(&str) -> Option<f64>,
        text: &dyn Fn(&str) -> Option<String>,
    ) -> Result<Option<Wcs>, String> {
        let ctype = [1, 2].map(|i| text(&format!("CTYPE{i}")).unwrap_or_default().trim().to_uppercase());
        let celestial = |c: &str| ["RA--", "DEC-", "GLON", "GLAT", "ELON", "ELAT"].iter().any(|p| c.starts_with(p));
        if !celestial(&ctype[0]) && !celestial(&ctype[1]) {
            return Ok(None);
        }
        let swapped = axes_swapped(&ctype)?;
        check_system(number, text)?;

        let need = |key: String| match number(&key) {
            Some(v) if v.is_finite() => Ok(v),
            Some(v) => Err(format!("{key}: {v} is not finite")),
            None => Err(format!("{key} is missing although CTYPE1 = '{}' announces sky coordinates", ctype[0])),
        };
        let mut crval_deg = [need("CRVAL1".into())?, need("CRVAL2".into())?];
        let crpix = [need("CRPIX1".into())?, need("CRPIX2".into())?];
        let mut cd = matrix(number)?;
        if swapped {
            crval_deg.swap(0, 1);
            cd.swap(0, 1);
        }
        if !(-90.0..=90.0).contains(&crval_deg[1]) {
            return Err(format!("CRVAL: declination {} deg is outside -90 to 90", crval_deg[1]));
        }
        // A native pole away from 180 deg turns the intermediate plane by the difference.
        if let Some(pole_deg) = number("LONPOLE").filter(|p| (p - 180.0).abs() > 1e-9) {
            let (s, c) = (pole_deg - 180.0).to_radians().sin_cos();
            cd = [0, 1].map(|row| {
                [0, 1].map(|j| if row == 0 { c * cd[0][j] + s * cd[1][j] } else { c * cd[1][j] - s * cd[0][j] })
            });
        }
        let sip = [Sip::from_keys('A', number)?, Sip::from_keys('B', number)?];
        let inverse = invert(&cd).ok_or_else(|| {
            format!("CD (or PC, CDELT): the matrix {cd:?} deg/px is singular, so no pixel can be computed from the sky")
        })?;
        crval_deg[0] = crval_deg[0].rem_euclid(360.0);
        Ok(Some(Wcs { crval_deg, crpix, cd, inverse, sip }))
    }

    /// A plain tangent-plane system: the sky point (`ra_deg`, `dec_deg`) at the 0-based pixel (`x_px`, `y_px`).
    ///
    /// At `rotation_deg` 0 north is along +y and east along −x (+x if `mirrored`); a positive rotation turns the image
    /// of the sky from +x towards +y.
    #[must_use]
    pub fn tan(
        ra_deg: f64,
        dec_deg: f64,
        x_px: f64,
        y_px: f64,
        scale_arcsec: f64,
        rotation_deg: f64,
        mirrored: bool,
    ) -> Wcs {
        // (x, y) = R(θ) · diag(∓1, 1) · (ξ, η) / s   ⇒   CD = s · diag(∓1, 1) · R(−θ)
        let s_deg = scale_arcsec / 3_600.0;
        let (sin, cos) = rotation_deg.to_radians().sin_cos();
        let east = if mirrored { s_deg } else { -s_deg };
        let cd = [[east * cos, east * sin], [-s_deg * sin, s_deg * cos]];
        let inverse = [[cos / east, -sin / s_deg], [sin / east, cos / s_deg]];
        let crval_deg = [ra_deg.rem_euclid(360.0), dec_deg];
        Wcs { crval_deg, crpix: [x_px + 1.0, y_px + 1.0], cd, inverse, sip: [None, None] }
    }

    /// Sky to 0-based pixel; `None` on or behind the tangent plane, or where the SIP terms cannot be inverted.
    ///
    /// Newton iteration on u + A(u,v) = U, v + B(u,v) = V, to 1e-9 px. A point where the distortion has folded over
    /// (Jacobian not positive) is no solution: the polynomial is not valid there.
    #[must_use]
    pub fn sky_to_pixel(&self, ra_deg: f64, dec_deg: f64) -> Option<(f64, f64)> {
        let (sin_d, cos_d) = dec_deg.to_radians().sin_cos();
        let (sin_0, cos_0) = self.crval_deg[1].to_radians().sin_cos();
        let (sin_a, cos_a) = (ra_deg - self.crval_deg[0]).to_radians().sin_cos();
        // cos c = sin δ₀ sin δ + cos δ₀ cos δ cos Δα
        let cos_c = sin_0 * sin_d + cos_0 * cos_d * cos_a;
        if cos_c.is_nan() || cos_c <= 1e-9 {
            return None;
        }
        // ξ = cos δ sin Δα / cos c,  η = (cos δ₀ sin δ − sin δ₀ cos δ cos Δα) / cos c
        let xi_deg = (cos_d * sin_a / cos_c).to_degrees();
        let eta_deg = ((cos_0 * sin_d - sin_0 * cos_d * cos_a) / cos_c).to_degrees();
        let big_u = self.inverse[0][0] * xi_deg + self.inverse[0][1] * eta_deg;
        let big_v = self.inverse[1][0] * xi_deg + self.inverse[1][1] * eta_deg;
        let (u, v) = self.undistort(big_u, big_v)?;
        Some((u + self.crpix[0] - 1.0, v + self.crpix[1] - 1.0))
    }

    /// 0-based pixel to (RA, Dec) \[deg\], RA in 0 to 360.
    #[must_use]
    pub fn pixel_to_sky(&self, x_px: f64, y_px: f64) -> (f64, f64) {
        let (u, v) = (x_px + 1.0 - self.crpix[0], y_px + 1.0 - self.crpix[1]);
        let [a, b] = [0, 1].map(|i| self.sip[i].as_ref().map_or(0.0, |s| s.at(u, v).0));
        let (u, v) = (u + a, v + b);
        let xi = (self.cd[0][0] * u + self.cd[0][1] * v).to_radians();
        let eta = (self.cd[1][0] * u + self.cd[1][1] * v).to_radians();
        let (sin_0, cos_0) = self.crval_deg[1].to_radians().sin_cos();
        // tan Δα = ξ / (cos δ₀ − η sin δ₀),  tan δ = (sin δ₀ + η cos δ₀) / √(ξ² + (cos δ₀ − η sin δ₀)²)
        let down = cos_0 - eta * sin_0;
        let ra_deg = self.crval_deg[0] + xi.atan2(down).to_degrees();
        let dec_deg = (sin_0 + eta * cos_0).atan2(xi.hypot(down)).to_degrees();
        (ra_deg.rem_euclid(360.0), dec_deg)
    }

    /// Side of the square that has the area of a pixel at the reference point \[arcsec\], √|det CD|.
    #[must_use]
    pub fn scale_arcsec(&self) -> f64 {
        (self.cd[0][0] * self.cd[1][1] - self.cd[0][1] * self.cd[1][0]).abs().sqrt() * 3_600.0
    }

    /// The header cards of this system: keyword, value, comment.
    #[must_use]
    pub fn cards(&self) -> Vec<(String, WcsValue, String)> {
        let sip = if self.sip.iter().any(Option::is_some) { "-SIP" } else { "" };
        let text = |k: &str, v: String, c: &str| (k.to_owned(), WcsValue::Text(v), c.to_owned());
        let real = |k: String, v: f64, c: &str| (k, WcsValue::Real(v), c.to_owned());
        let mut cards = vec![
            text("CTYPE1", format!("RA---TAN{sip}"), "gnomonic projection"),
            text("CTYPE2", format!("DEC--TAN{sip}"), "gnomonic projection"),
            text("CUNIT1", "deg".into(), "unit of CRVAL1"),
            text("CUNIT2", "deg".into(), "unit of CRVAL2"),
            text("RADESYS", "ICRS".into(), "reference system"),
            real("EQUINOX".into(), 2000.0, "[yr] equinox"),
            real("CRVAL1".into(), self.crval_deg[0], "[deg] right ascension at the reference pixel"),
            real("CRVAL2".into(), self.crval_deg[1], "[deg] declination at the reference pixel"),
            real("CRPIX1".into(), self.crpix[0], "[px] reference pixel, first pixel = 1"),
            real("CRPIX2".into(), self.crpix[1], "[px] reference pixel, first pixel = 1"),
        ];
        for i in 0..2 {
            for j in 0..2 {
                cards.push(real(format!("CD{}_{}", i + 1, j + 1), self.cd[i][j], "[deg/px] pixel to sky"));
            }
        }
        for (axis, sip) in ['A', 'B'].iter().zip(&self.sip) {
            let Some(sip) = sip else { continue };
            cards.push(real(format!("{axis}_ORDER"), sip.order as f64, "SIP polynomial order"));
            for (p, q, a) in &sip.terms {
                cards.push(real(format!("{axis}_{p}_{q}"), *a, "SIP coefficient"));
            }
        }
        cards
    }

    /// (u, v) from the distorted (U, V), Newton from the undistorted guess.
    fn undistort(&self, big_u: f64, big_v: f64) -> Option<(f64, f64)> {
        if self.sip.iter().all(Option::is_none) {
            return Some((big_u, big_v));
        }
        let (mut u, mut v) = (big_u, big_v);
        for _ in 0..50 {
            let [a, b] = [0, 1].map(|i| self.sip[i].as_ref().map_or((0.0, 0.0, 0.0), |s| s.at(u, v)));
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
}

/// Whether axis 1 is the declination.
fn axes_swapped(ctype: &[String; 2]) -> Result<bool, String> {
    for (i, c) in ctype.iter().enumerate() {
        if !matches!(c.as_str(), "RA---TAN" | "DEC--TAN" | "RA---TAN-SIP" | "DEC--TAN-SIP") {
            return Err(format!(
                "CTYPE{} = '{c}': only RA---TAN and DEC--TAN (with or without -SIP) are read; solve the frame again",
                i + 1
            ));
        }
    }
    match (ctype[0].starts_with("RA"), ctype[1].starts_with("RA")) {
        (true, false) => Ok(false),
        (false, true) => Ok(true),
        _ => Err(format!("CTYPE1 = '{}', CTYPE2 = '{}': one must be RA, the other DEC", ctype[0], ctype[1])),
    }
}

/// Refuses units, equinoxes and distortions that would be silently wrong.
fn check_system(number: &dyn Fn(&str) -> Option<f64>, text: &dyn Fn(&str) -> Option<String>) -> Result<(), String> {
    for key in ["CUNIT1", "CUNIT2"] {
        if let Some(unit) = text(key).map(|u| u.trim().to_lowercase())
            && !matches!(unit.as_str(), "" | "deg" | "degree" | "degrees")
        {
            return Err(format!("{key} = '{unit}': only deg is read"));
        }
    }
    let radesys = text("RADESYS").or_else(|| text("RADECSYS")).unwrap_or_default().trim().to_uppercase();
    if radesys.starts_with("FK4") {
        return Err(format!("RADESYS = '{radesys}': coordinates of B1950 are not read; solve the frame for J2000"));
    }
    if radesys != "ICRS"
        && let Some(equinox) = number("EQUINOX").filter(|e| (e - 2000.0).abs() > 0.5)
    {
        return Err(format!("EQUINOX = {equinox}: only 2000.0 is read; solve the frame for J2000"));
    }
    let pv = (5..40).map(|m| format!("PV1_{m}")).chain((0..40).map(|m| format!("PV2_{m}")));
    for key in pv {
        if number(&key).is_some_and(|v| v != 0.0) {
            return Err(format!("{key}: PV distortion terms are not read; write the solution with SIP terms"));
        }
    }
    Ok(())
}

/// The linear part \[deg/px\]: CD, else CDELT · PC, else CDELT with CROTA2.
fn matrix(number: &dyn Fn(&str) -> Option<f64>) -> Result<[[f64; 2]; 2], String> {
    let element = |name: &str, i: usize, j: usize| number(&format!("{name}{}_{}", i + 1, j + 1));
    let any = |name: &str| (0..4).any(|n| element(name, n / 2, n % 2).is_some());
    let cd = if any("CD") {
        [0, 1].map(|i| [0, 1].map(|j| element("CD", i, j).unwrap_or(0.0)))
    } else {
        let (Some(d1), Some(d2)) = (number("CDELT1"), number("CDELT2")) else {
            return Err("CD1_1 (or CDELT1, CDELT2) is missing: the pixel scale is unknown".into());
        };
        if any("PC") {
            let pc = |i: usize, j: usize| element("PC", i, j).unwrap_or(if i == j { 1.0 } else { 0.0 });
            [[d1 * pc(0, 0), d1 * pc(0, 1)], [d2 * pc(1, 0), d2 * pc(1, 1)]]
        } else {
            let (s, c) = number("CROTA2").unwrap_or(0.0).to_radians().sin_cos();
            [[d1 * c, -d2 * s], [d1 * s, d2 * c]]
        }
    };
    if cd.iter().flatten().all(|v| v.is_finite()) {
        Ok(cd)
    } else {
        Err(format!("CD (or PC, CDELT): the matrix {cd:?} is not finite"))
    }
}

/// The inverse of a 2×2 matrix; `None` if its rows are parallel to 1e-9.
fn invert(m: &[[f64; 2]; 2]) -> Option<[[f64; 2]; 2]> {
    let det = m[0][0] * m[1][1] - m[0][1] * m[1][0];
    let size = m[0][0].hypot(m[0][1]) * m[1][0].hypot(m[1][1]);
    if det.abs() <= 1e-9 * size || !det.is_finite() || det == 0.0 {
        return None;
    }
    Some([[m[1][1] / det, -m[0][1] / det], [-m[1][0] / det, m[0][0] / det]])
}

#[cfg(test)]
#[path = "wcs_tests.rs"]
mod tests;
