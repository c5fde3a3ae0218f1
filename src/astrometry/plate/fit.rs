//! World coordinates from matched stars: TAN with a similarity or a full matrix, and SIP terms where the stars support
//! them.
//!
//! Arcseconds on the tangent plane, pixels from the reference point at the frame's centre. Every pair has equal weight;
//! who belongs is decided by the caller. It does not cover proper motion and differential refraction (the matrix takes
//! most of it).

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use crate::astrometry::wcs::Wcs;

/// A star's place on the sky \[deg\] and on the frame \[px\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Match {
    /// (RA, Dec) \[deg\].
    pub sky_deg: (f64, f64),
    /// (x, y) \[px\], 0-based.
    pub at_px: (f64, f64),
}

/// What is fitted, from the fewest parameters to the most.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Model {
    /// TAN with one scale and one rotation: 4 parameters.
    Similarity,
    /// TAN with a full CD matrix: 6 parameters.
    Affine,
    /// TAN and SIP of second order: 12 parameters.
    Sip2,
    /// TAN and SIP of third order: 20 parameters.
    Sip3,
}

impl Model {
    /// Number of parameters, both axes together.
    #[must_use]
    pub fn parameters(self) -> usize {
        match self {
            Model::Similarity => 4,
            Model::Affine => 6,
            Model::Sip2 => 12,
            Model::Sip3 => 20,
        }
    }
    fn order(self) -> i32 {
        match self {
            Model::Similarity | Model::Affine => 1,
            Model::Sip2 => 2,
            Model::Sip3 => 3,
        }
    }
    /// As it is called in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Model::Similarity => "tan-4",
            Model::Affine => "tan",
            Model::Sip2 => "sip-2",
            Model::Sip3 => "sip-3",
        }
    }
}

/// A fit and what it leaves.
#[derive(Debug, Clone)]
pub struct Fit {
    /// The coordinates, reference point at the frame's centre.
    pub wcs: Wcs,
    /// What was fitted.
    pub model: Model,
    /// Detected minus fitted, east and north, pair by pair \[arcsec\].
    pub residuals_arcsec: Vec<(f64, f64)>,
}

impl Fit {
    /// Σ of the squared distances \[arcsec²\].
    #[must_use]
    pub fn sum2(&self) -> f64 {
        self.residuals_arcsec.iter().map(|r| r.0 * r.0 + r.1 * r.1).sum()
    }
    /// Root mean square distance \[arcsec\].
    #[must_use]
    pub fn rms_arcsec(&self) -> f64 {
        (self.sum2() / self.residuals_arcsec.len().max(1) as f64).sqrt()
    }
}

/// Largest probability of chance at which more parameters are accepted.
const MAX_F_CHANCE: f64 = 1e-4;

/// The model the stars support: more parameters only where an F test finds them significant.
///
/// F = ((S₁ − S₂)/(p₂ − p₁)) / (S₂/(2n − p₂)) for sums of squares S and parameters p; the third order is tried over the
/// full matrix too, because a radial distortion has no second order. A model needs half as many stars again as it
/// has parameters.
#[must_use]
pub fn fit_best(matches: &[Match], size_px: (f64, f64), start_deg: (f64, f64)) -> Option<Fit> {
    let mut best = fit(matches, size_px, start_deg, Model::Similarity)?;
    for model in [Model::Affine, Model::Sip2, Model::Sip3] {
        if 2 * matches.len() < 3 * model.parameters() {
            break;
        }
        let Some(richer) = fit(matches, size_px, start_deg, model) else { continue };
        let (p1, p2) = (best.model.parameters(), model.parameters());
        let free = (2 * matches.len() - p2) as f64;
        let (s1, s2) = (best.sum2(), richer.sum2());
        // residuals of a thousandth of a milliarcsecond are rounding: nothing is left to explain
        let exact = (1e-6f64).powi(2) * matches.len() as f64;
        let f = ((s1 - s2) / (p2 - p1) as f64) / (s2.max(exact) / free);
        let better = FisherSnedecor::new((p2 - p1) as f64, free).is_ok_and(|d| f > 0.0 && d.sf(f) < MAX_F_CHANCE);
        if better {
            best = richer;
        }
    }
    Some(best)
}

/// Least squares of one model.
///
/// (ξ, η) = Σ c_pq uᵖ vᑫ on the plane about the frame's centre, whose place is improved until the constant vanishes;
/// CD are the linear terms, and the SIP terms CD⁻¹ c_pq. `None` if the stars do not determine it.
#[must_use]
pub fn fit(matches: &[Match], size_px: (f64, f64), start_deg: (f64, f64), model: Model) -> Option<Fit> {
    let centre_px = (0.5 * (size_px.0 - 1.0), 0.5 * (size_px.1 - 1.0));
    let unit_px = 0.5 * size_px.0.hypot(size_px.1).max(1.0);
    let powers: Vec<(i32, i32)> = (0..=model.order()).flat_map(|o| (0..=o).map(move |q| (o - q, q))).collect();
    if matches.len() < powers.len().max(2) {
        return None;
    }
    let uv: Vec<(f64, f64)> =
        matches.iter().map(|m| ((m.at_px.0 - centre_px.0) / unit_px, (m.at_px.1 - centre_px.1) / unit_px)).collect();
    let mut centre_deg = start_deg;
    let mut terms: Vec<(f64, f64)> = Vec::new();
    // the plane turns with its centre, so a few rounds; each gains the square of the distance in radians
    for _ in 0..5 {
        let plane = Wcs::tan(centre_deg.0, centre_deg.1, 0.0, 0.0, 1.0, 0.0, true);
        let places: Option<Vec<(f64, f64)>> =
            matches.iter().map(|m| plane.sky_to_pixel(m.sky_deg.0, m.sky_deg.1)).collect();
        let places = places?;
        terms = match model {
            Model::Similarity => similarity(&uv, &places)?,
            _ => polynomial(&uv, &places, &powers)?,
        };
        centre_deg = plane.pixel_to_sky(terms[0].0, terms[0].1);
        if terms[0].0.hypot(terms[0].1) < 1e-9 {
            break;
        }
    }
    // columns of CD [deg/px] from the linear terms
    let per_px = |t: (f64, f64)| (t.0 / unit_px / 3600.0, t.1 / unit_px / 3600.0);
    let (du, dv) = (per_px(terms[1]), per_px(terms[2]));
    let cd = [[du.0, dv.0], [du.1, dv.1]];
    let det = cd[0][0] * cd[1][1] - cd[0][1] * cd[1][0];
    if det == 0.0 || !det.is_finite() {
        return None;
    }
    let (mut a, mut b) = (Vec::new(), Vec::new());
    for (&(p, q), t) in powers.iter().zip(&terms).skip(3) {
        let scale = unit_px.powi(p + q) * 3600.0;
        let (xi, eta) = (t.0 / scale, t.1 / scale);
        a.push((p, q, (cd[1][1] * xi - cd[0][1] * eta) / det));
        b.push((p, q, (cd[0][0] * eta - cd[1][0] * xi) / det));
    }
    let wcs = Wcs::from_terms([centre_deg.0, centre_deg.1], centre_px, cd, [a, b])?;
    let plane = Wcs::tan(centre_deg.0, centre_deg.1, 0.0, 0.0, 1.0, 0.0, true);
    let residuals_arcsec: Option<Vec<(f64, f64)>> = matches
        .iter()
        .map(|m| {
            let (ra, dec) = wcs.pixel_to_sky(m.at_px.0, m.at_px.1);
            let (fitted, true_) = (plane.sky_to_pixel(ra, dec)?, plane.sky_to_pixel(m.sky_deg.0, m.sky_deg.1)?);
            Some((fitted.0 - true_.0, fitted.1 - true_.1))
        })
        .collect();
    Some(Fit { wcs, model, residuals_arcsec: residuals_arcsec? })
}

/// The better of w = m z + b and w = m z̄ + b, as constant and linear terms.
///
/// m = Σ z̄ w / Σ |z|² about the means.
fn similarity(uv: &[(f64, f64)], places: &[(f64, f64)]) -> Option<Vec<(f64, f64)>> {
    let n = uv.len() as f64;
    let mean = |p: &[(f64, f64)]| p.iter().fold((0.0, 0.0), |s, v| (s.0 + v.0 / n, s.1 + v.1 / n));
    let (zc, wc) = (mean(uv), mean(places));
    let of = |sign: f64| {
        let (mut re, mut im, mut norm) = (0.0, 0.0, 0.0);
        for (z, w) in uv.iter().zip(places) {
            let (zx, zy) = (z.0 - zc.0, sign * (z.1 - zc.1));
            let (wx, wy) = (w.0 - wc.0, w.1 - wc.1);
            re += zx * wx + zy * wy;
            im += zx * wy - zy * wx;
            norm += zx * zx + zy * zy;
        }
        (norm > 0.0).then(|| (re / norm, im / norm))
    };
    let ((pr, pi), (mr, mi)) = (of(1.0)?, of(-1.0)?);
    // the residual is Σ|w|² − |m|² Σ|z|²: the larger |m| fits better
    let (m, sign) = if pr.hypot(pi) >= mr.hypot(mi) { ((pr, pi), 1.0) } else { ((mr, mi), -1.0) };
    if m.0.hypot(m.1) <= 0.0 {
        return None;
    }
    let along_u = (m.0, m.1);
    let along_v = (-sign * m.1, sign * m.0);
    let constant = (wc.0 - along_u.0 * zc.0 - along_v.0 * zc.1, wc.1 - along_u.1 * zc.0 - along_v.1 * zc.1);
    Some(vec![constant, along_u, along_v])
}

/// Both axes by singular values; `None` if the stars do not determine a combination of terms.
fn polynomial(uv: &[(f64, f64)], places: &[(f64, f64)], powers: &[(i32, i32)]) -> Option<Vec<(f64, f64)>> {
    let design = DMatrix::from_fn(uv.len(), powers.len(), |i, j| uv[i].0.powi(powers[j].0) * uv[i].1.powi(powers[j].1));
    let svd = design.svd(true, true);
    let (largest, smallest) = (svd.singular_values.max(), svd.singular_values.min());
    if !(smallest > 1e-6 * largest) {
        return None;
    }
    let xi = svd.solve(&DVector::from_iterator(places.len(), places.iter().map(|p| p.0)), 0.0).ok()?;
    let eta = svd.solve(&DVector::from_iterator(places.len(), places.iter().map(|p| p.1)), 0.0).ok()?;
    Some(xi.iter().zip(eta.iter()).map(|(x, e)| (*x, *e)).collect())
}
