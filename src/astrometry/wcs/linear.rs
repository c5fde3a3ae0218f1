//! The parameters of world coordinates.

use super::sip::Sip;
use super::tpv::Tpv;

/// A tangent-plane coordinate system.
///
/// (ξ, η) = CD · (u + A(u,v), v + B(u,v)) with (u, v) = pixel − CRPIX; (ξ, η) is the gnomonic projection about CRVAL.
///
/// With TPV the plane is distorted, not the pixels: (ξ', η') = P(CD · (u, v)).
///
/// Source: Calabretta & Greisen 2002 (A&A 395, 1077); Shupe et al. 2005 (ASP 347, 491) for SIP; the FITS registry for TPV.
#[derive(Debug, Clone)]
pub struct Wcs {
    /// (RA, Dec) of the reference point \[deg\].
    pub(super) crval_deg: [f64; 2],
    /// Reference pixel, FITS convention (1-based).
    pub(super) crpix: [f64; 2],
    /// Rows ξ (east), η (north); columns x, y \[deg/px\].
    pub(super) cd: [[f64; 2]; 2],
    /// Its inverse \[px/deg\].
    pub(super) inverse: [[f64; 2]; 2],
    pub(super) sip: [Option<Sip>; 2],
    pub(super) tpv: Option<Tpv>,
}
