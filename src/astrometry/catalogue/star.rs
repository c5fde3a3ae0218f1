//! A catalogue in memory: its stars, and what was skipped.

use std::sync::OnceLock;

use super::tree::Tree;
use crate::bands::{Band, ColourIndex};

/// One entry.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct CatalogueStar {
    /// Name or number; the row number if the table has none.
    pub id: String,
    /// Right ascension, J2000 \[deg\], 0 to 360.
    pub ra_deg: f64,
    /// Declination, J2000 \[deg\].
    pub dec_deg: f64,
    /// V \[mag\].
    pub v_mag: f64,
    /// Its error, if known \[mag\].
    pub v_err_mag: Option<f64>,
    /// Colour, if known: B−V, or the index of [`Catalogue::colour`] \[mag\].
    pub b_v_mag: Option<f64>,
    /// Its error, if known \[mag\].
    pub b_v_err_mag: Option<f64>,
    /// Nights or images the entry rests on, if known.
    pub n_obs: Option<u32>,
    /// Proper motion in right ascension, with the factor cos δ, if known \[mas/yr\].
    pub pm_ra_mas_yr: Option<f64>,
    /// Proper motion in declination, if known \[mas/yr\].
    pub pm_dec_mas_yr: Option<f64>,
    /// Epoch of the position, if known \[Julian year\].
    pub epoch_jyear: Option<f64>,
    /// Another entry lies within the match radius and is not fainter by more than 3 mag: a detection there may be of
    /// either. Set by [`Catalogue::mark_ambiguous`].
    pub ambiguous: bool,
    /// Distance of the nearest other entry, if that is within the match radius \[arcsec\].
    pub neighbour_arcsec: Option<f64>,
}

impl CatalogueStar {
    /// The star at its place in `jyear` (Julian year) if it has a proper motion; a position without an epoch of its own is of
    /// `epoch_jyear`.
    ///
    /// u = u₀ + (t − t₀) (μ_α* e_α + μ_δ e_δ), made a unit vector: right at the poles too. Radial motion is excluded.
    #[must_use]
    pub fn moved_to(&self, jyear: f64, epoch_jyear: f64) -> CatalogueStar {
        let mut star = self.clone();
        let (Some(pm_ra), Some(pm_dec)) = (star.pm_ra_mas_yr, star.pm_dec_mas_yr) else { return star };
        let years = jyear - star.epoch_jyear.unwrap_or(epoch_jyear);
        let ((sin_a, cos_a), (sin_d, cos_d)) =
            (star.ra_deg.to_radians().sin_cos(), star.dec_deg.to_radians().sin_cos());
        let [east, north] = [pm_ra, pm_dec].map(|mas| (mas * years / 3.6e6).to_radians());
        let x = cos_d * cos_a - east * sin_a - north * sin_d * cos_a;
        let y = cos_d * sin_a + east * cos_a - north * sin_d * sin_a;
        let z = sin_d + north * cos_d;
        star.ra_deg = y.atan2(x).to_degrees().rem_euclid(360.0);
        star.dec_deg = z.atan2(x.hypot(y)).to_degrees();
        star.epoch_jyear = Some(jyear);
        star
    }
}

/// The entries of a file, in its order; a star that is in it twice is here once.
#[derive(Debug, Clone, Default)]
pub struct Catalogue {
    /// Usable entries.
    pub stars: Vec<CatalogueStar>,
    /// Rows without position or magnitude.
    pub n_skipped: usize,
    /// Why, for the first [`super::SKIPPED_SHOWN`] of them.
    pub skipped: Vec<String>,
    /// Notes for the observer: magnitudes made from others, duplicates dropped.
    pub notes: Vec<String>,
    /// The band of the magnitudes, where the column gives it.
    pub band: Option<Band>,
    /// The column they are from, in words.
    pub band_from: String,
    /// The colour index of the stars, where the column gives it.
    pub colour: Option<ColourIndex>,
    /// Built by the first look at a place.
    pub(crate) tree: OnceLock<Tree>,
}
