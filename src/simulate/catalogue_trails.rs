//! The stars that trail through a tracked frame as stars of the catalogue: where they stand on the sky, and their path through
//! the frame as the satellite's own path makes it.

use hifitime::Epoch;
use ndarray::Array2;
use rand::Rng;

use super::field::{Star, Trail};
use super::frames::{FrameSimulator, scatter};
use super::render::{PixelPsf, add_trail};
use super::tracked::FieldStar;
use crate::astrometry::wcs::Wcs;
use crate::base::error::Result;
use crate::base::time::shifted;
use crate::orbit::Tracker;

/// Straight pieces a trail is drawn in.
const PIECES: usize = 16;

impl FrameSimulator<'_> {
    /// The world coordinates of a frame that follows the satellite, `after_s` from mid-exposure, the satellite standing at a pixel;
    /// north up and east left as in the star frames.
    fn tracked_wcs(&self, tracker: &Tracker, mid: Epoch, after_s: f64, (x_px, y_px): (f64, f64)) -> Result<Wcs> {
        let (ra_deg, dec_deg) = tracker.icrs_at(&shifted(mid, after_s))?;
        Ok(Wcs::tan(ra_deg, dec_deg, x_px, y_px, self.scale_arcsec, 0.0, false))
    }

    /// The stars whose trails have their middle at these places, as the catalogue lists them.
    pub(super) fn stars_of_trails(
        &self,
        trails: &[Trail],
        rng: &mut impl Rng,
        (tracker, mid, frame): (&Tracker, Epoch, usize),
        target_px: (f64, f64),
    ) -> Result<Vec<Star>> {
        let wcs = self.tracked_wcs(tracker, mid, 0.0, target_px)?;
        let star = |(k, trail): (usize, &Trail)| {
            let (ra_deg, dec_deg) = wcs.pixel_to_sky(trail.centre_px.0, trail.centre_px.1);
            let catalogue_v_mag = trail.v_mag + scatter(rng, self.scenario.field.catalogue_err_mag);
            let id = format!("t{frame:04}{k:05}");
            Star { id, ra_deg, dec_deg, v_mag: trail.v_mag, b_v_mag: trail.b_v_mag, catalogue_v_mag }
        };
        Ok(trails.iter().enumerate().map(star).collect())
    }

    /// Adds the trails of stars to a frame that follows the satellite.
    pub(super) fn add_paths(
        &self,
        image: &mut Array2<f32>,
        psf: &PixelPsf,
        stars: &[FieldStar],
        (tracker, mid, exptime_s): (&Tracker, Epoch, f64),
        target_px: (f64, f64),
    ) -> Result<()> {
        let at = |k: usize| self.tracked_wcs(tracker, mid, exptime_s * (k as f64 / PIECES as f64 - 0.5), target_px);
        let moments = (0..=PIECES).map(at).collect::<Result<Vec<Wcs>>>()?;
        for star in stars {
            let places: Vec<Option<(f64, f64)>> =
                moments.iter().map(|w| w.sky_to_pixel(star.ra_deg, star.dec_deg)).collect();
            for pair in places.windows(2) {
                if let [Some(from), Some(to)] = pair {
                    let centre = (0.5 * (from.0 + to.0), 0.5 * (from.1 + to.1));
                    let piece_e = star.flux_e / PIECES as f64;
                    add_trail(image, psf, centre, (to.0 - from.0, to.1 - from.1), piece_e);
                }
            }
        }
        Ok(())
    }
}
