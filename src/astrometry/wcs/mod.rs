//! World coordinates: pixel to sky and back on the tangent plane, with SIP or TPV distortion.
//!
//! Pixels 0-based (centre of the first pixel = 0), degrees at the edges, J2000/ICRS. Not included: projections other
//! than TAN and TPV, lookup-table distortions; a header with those is refused, never half used.

mod cards;
mod header;
mod linear;
mod sip;
#[cfg(test)]
mod tests;
mod tpv;

pub use linear::Wcs;

use crate::fits::Header;

pub use cards::WcsValue;
use header::{Projection, axes_swapped, check_system, matrix, pole_deg, projection};
use sip::{Sip, undistort};
use tpv::Tpv;

impl Wcs {
    /// Reads the header of a file, in the pixels that are read from it: superpixels of a colour sensor.
    ///
    /// # Errors
    /// Those of [`Wcs::from_keys`].
    pub fn of_header(header: &Header) -> Result<Option<Wcs>, String> {
        let stored = Self::from_keys(&|key| header.number(key), &|key| header.text(key))?;
        Ok(stored.map(|wcs| if header.green().is_some() { wcs.of_superpixels() } else { wcs }))
    }

    /// Reads a header through two look-ups: a keyword's number, a keyword's text.
    ///
    /// CD, or PC with CDELT, or CDELT with CROTA2. SIP terms are used whenever `A_ORDER` or `B_ORDER` is there, also
    /// when CTYPE lacks `-SIP`; PV terms on both axes are TPV, also when CTYPE says TAN (SCAMP). `Ok(None)`: the header
    /// has no celestial coordinates.
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
        let mut cd = matrix(number, swapped)?;
        if swapped {
            crval_deg.swap(0, 1);
            cd.swap(0, 1);
        }
        if !(-90.0..=90.0).contains(&crval_deg[1]) {
            return Err(format!("CRVAL: declination {} deg is outside -90 to 90", crval_deg[1]));
        }
        let sip = [Sip::from_keys('A', number)?, Sip::from_keys('B', number)?];
        let has_sip = ["A_ORDER", "B_ORDER"].iter().any(|k| number(k).is_some());
        let projection = projection(&ctype, number, has_sip, swapped)?;
        // A native pole away from 180 deg turns the intermediate plane by the difference.
        let turn_deg = pole_deg(number, projection) - 180.0;
        let tpv = match projection {
            Projection::Tan => {
                cd = turned(&cd, turn_deg);
                None
            }
            Projection::Tpv => Some(Tpv::from_keys(number, swapped, turn_deg)?),
        };
        let inverse = invert(&cd).ok_or_else(|| {
            format!("CD (or PC, CDELT): the matrix {cd:?} deg/px is singular, so no pixel can be computed from the sky")
        })?;
        crval_deg[0] = crval_deg[0].rem_euclid(360.0);
        Ok(Some(Wcs { crval_deg, crpix, cd, inverse, sip, tpv }))
    }

    /// The same system in superpixels of 2 × 2 pixels: `x' = (x − 1/2)/2` from 0, `CD' = 2 CD`, `A'_pq = 2^(p+q−1) A_pq`.
    #[must_use]
    pub fn of_superpixels(self) -> Wcs {
        let crpix = self.crpix.map(|c| 0.5 * c + 0.25);
        let (cd, inverse) = (self.cd.map(|row| row.map(|v| 2.0 * v)), self.inverse.map(|row| row.map(|v| 0.5 * v)));
        let sip = self.sip.map(|sip| {
            let halved = |(p, q, a): (i32, i32, f64)| (p, q, a * 2f64.powi(p + q - 1));
            sip.map(|sip| Sip { order: sip.order, terms: sip.terms.into_iter().map(halved).collect() })
        });
        Wcs { crpix, cd, inverse, sip, ..self }
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
        Wcs { crval_deg, crpix: [x_px + 1.0, y_px + 1.0], cd, inverse, sip: [None, None], tpv: None }
    }

    /// A tangent-plane system from its terms: the sky point `crval_deg` (RA, Dec) at the 0-based pixel `centre_px`, the
    /// matrix `cd` (rows ξ, η; columns x, y) \[deg/px\], and the SIP terms (p, q, coefficient) of both axes, orders 2
    /// to 9.
    ///
    /// `None` if the matrix is singular or anything is not finite.
    #[must_use]
    pub fn from_terms(
        crval_deg: [f64; 2],
        centre_px: (f64, f64),
        cd: [[f64; 2]; 2],
        sip: [Vec<(i32, i32, f64)>; 2],
    ) -> Option<Wcs> {
        let fine = |v: &f64| v.is_finite();
        let known = |t: &(i32, i32, f64)| t.2.is_finite() && t.0 >= 0 && t.1 >= 0 && (2..=9).contains(&(t.0 + t.1));
        let inverse = invert(&cd)?;
        if !(crval_deg.iter().all(fine) && fine(&centre_px.0) && fine(&centre_px.1) && sip.iter().flatten().all(known))
        {
            return None;
        }
        let sip = sip.map(|terms| {
            let order = terms.iter().map(|t| (t.0 + t.1) as usize).max()?;
            Some(Sip { order, terms })
        });
        let crval_deg = [crval_deg[0].rem_euclid(360.0), crval_deg[1]];
        Some(Wcs { crval_deg, crpix: [centre_px.0 + 1.0, centre_px.1 + 1.0], cd, inverse, sip, tpv: None })
    }

    /// Whether east is along +x where north is along +y, det CD > 0: the sky as seen in a mirror.
    #[must_use]
    pub fn mirrored(&self) -> bool {
        self.cd[0][0] * self.cd[1][1] - self.cd[0][1] * self.cd[1][0] > 0.0
    }

    /// Rotation at the reference point \[deg\], -180 to 180, as [`Wcs::tan`] takes it.
    #[must_use]
    pub fn rotation_deg(&self) -> f64 {
        // CD = s · diag(±1, 1) · R(−θ): both rows give θ; their sum is the nearest rotation
        let sign = if self.mirrored() { 1.0 } else { -1.0 };
        (sign * self.cd[0][1] - self.cd[1][0]).atan2(sign * self.cd[0][0] + self.cd[1][1]).to_degrees()
    }

    /// Whether there are distortion terms.
    #[must_use]
    pub fn is_distorted(&self) -> bool {
        self.sip.iter().any(Option::is_some) || self.tpv.is_some()
    }

    /// Sky to 0-based pixel; `None` on or behind the tangent plane, or where the SIP terms cannot be inverted.
    ///
    /// Newton iteration on u + A(u,v) = U, v + B(u,v) = V, to 1e-9 px. A point where the distortion has folded over
    /// (Jacobian not positive) is not a solution: the polynomial is not valid there.
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
        let (xi_deg, eta_deg) = match &self.tpv {
            Some(tpv) => tpv.invert(xi_deg, eta_deg)?,
            None => (xi_deg, eta_deg),
        };
        let big_u = self.inverse[0][0] * xi_deg + self.inverse[0][1] * eta_deg;
        let big_v = self.inverse[1][0] * xi_deg + self.inverse[1][1] * eta_deg;
        let (u, v) = undistort(&self.sip, big_u, big_v)?;
        Some((u + self.crpix[0] - 1.0, v + self.crpix[1] - 1.0))
    }

    /// 0-based pixel to (RA, Dec) \[deg\], RA in 0 to 360.
    #[must_use]
    pub fn pixel_to_sky(&self, x_px: f64, y_px: f64) -> (f64, f64) {
        let (u, v) = (x_px + 1.0 - self.crpix[0], y_px + 1.0 - self.crpix[1]);
        let [a, b] = [0, 1].map(|i| self.sip[i].as_ref().map_or(0.0, |s| s.at(u, v).0));
        let (u, v) = (u + a, v + b);
        let (xi_deg, eta_deg) = (self.cd[0][0] * u + self.cd[0][1] * v, self.cd[1][0] * u + self.cd[1][1] * v);
        let (xi_deg, eta_deg) = self.tpv.as_ref().map_or((xi_deg, eta_deg), |tpv| tpv.apply(xi_deg, eta_deg));
        let (xi, eta) = (xi_deg.to_radians(), eta_deg.to_radians());
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
}

/// The matrix with its plane turned.
fn turned(cd: &[[f64; 2]; 2], turn_deg: f64) -> [[f64; 2]; 2] {
    if turn_deg.abs() < 1e-9 {
        return *cd;
    }
    let (s, c) = turn_deg.to_radians().sin_cos();
    [[0, 1].map(|j| c * cd[0][j] + s * cd[1][j]), [0, 1].map(|j| c * cd[1][j] - s * cd[0][j])]
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
