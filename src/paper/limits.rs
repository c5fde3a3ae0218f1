//! Limits of telescopes: the paper's own following a satellite, Rubin's of a point, the beam of a mirror.
//!
//! mag and mag/arcsec², each row saying which.

use super::areas::scale_arcsec;
use super::context::Context;
use super::entry::{Basis, Entry, Numbers, row};
use super::rule::Rule;
use crate::base::error::{Error, Result};
use crate::base::vector::{Itrs, Vector};
use crate::brightness::light_sources::{FULL_MOON_V_MAG, SUN_V_MAG};
use crate::visibility::footprint::{PUBLISHED_DIVERGENCE_DEG, beam_diameter_km, glint_mag};
use crate::visibility::sky_brightness_table::sky_at_moon_phase;
use crate::visibility::survey::{LimitKind, RUBIN, SeeingMeaning};
use crate::visibility::tracked::{Area, Calculator};
use Basis::{Additional, Assumed, Stated};

const MONTH: &str = "section Detection Thresholds";
const ASTRONOMY: &str = "section Implications for Astronomy";
/// Exposure of the published limits \[s\].
const EXPTIME_S: f64 = 10.0;
/// Sky of the published limits at full and new Moon \[mag/arcsec²\].
const FULL_SKY: f64 = 19.4;
const NEW_SKY: f64 = 22.13;
/// Earendil-1: height \[km\], area \[m²\], reflectance.
const EARENDIL: (f64, f64, f64) = (625.0, 324.0, 0.96);

const LIMIT_WHY: &str = "Gunagala's formula for one pixel, with the zeropoint (21.62 mag/arcsec2 for 1 e-/s \
    in a pixel) and read \
                         noise (2.7 e-) these limits need: 84.6 e2 at full, 13.6 e2 at new Moon. Corrected: \
                             per arcsec2";
const RUBIN_WHY: &str = "rubin_sim's throughputs, one exposure of 15 s, sky 19.4 in all three bands, 0.7 \
    arcsec as the seeing at \
                         500 nm. It is a point source's magnitude, not mag/arcsec2; corrected: per arcsec2";

pub(super) const ROWS: &[Entry] = &[
    row("limit-full-1", MONTH, "1-sigma limit, full Moon", "mag arcsec-2", 2)
        .printed("21.65", 21.65, Rule::Limit)
        .is(Assumed, LIMIT_WHY)
        .by(|c| limit(c, FULL_SKY, 1.0)),
    row("limit-full-5", MONTH, "5-sigma limit, full Moon", "mag arcsec-2", 2)
        .printed("19.67", 19.67, Rule::Limit)
        .is(Assumed, LIMIT_WHY)
        .by(|c| limit(c, FULL_SKY, 5.0)),
    row("limit-new-1", MONTH, "1-sigma limit, new Moon", "mag arcsec-2", 2)
        .printed("22.56", 22.56, Rule::Limit)
        .is(Assumed, LIMIT_WHY)
        .by(|c| limit(c, NEW_SKY, 1.0)),
    row("limit-new-5", MONTH, "5-sigma limit, new Moon", "mag arcsec-2", 2)
        .printed("20.27", 20.27, Rule::Limit)
        .is(Assumed, LIMIT_WHY)
        .by(|c| limit(c, NEW_SKY, 5.0)),
    row("sky-full", ASTRONOMY, "sky at full Moon, g", "mag arcsec-2", 1)
        .printed("19.4", 19.4, Rule::Digits)
        .is(Stated, "the table of DECam's exposure-time calculator")
        .by(|_| Ok(Numbers::both(sky_at_moon_phase("g", 0.0)?))),
    row("sky-new", MONTH, "sky at new Moon, g", "mag arcsec-2", 1)
        .is(Additional, "the same table; the limits at new Moon need 22.1 to 22.2")
        .by(|_| Ok(Numbers::both(sky_at_moon_phase("g", 180.0)?))),
    row("rubin-g", ASTRONOMY, "Rubin, 5-sigma limit in 15 s, g", "mag", 2)
        .printed("23.13", 23.13, Rule::Limit)
        .is(Assumed, RUBIN_WHY)
        .by(|_| rubin("g")),
    row("rubin-r", ASTRONOMY, "the same, r", "mag", 2)
        .printed("23.16", 23.16, Rule::Limit)
        .is(Assumed, RUBIN_WHY)
        .by(|_| rubin("r")),
    row("rubin-i", ASTRONOMY, "the same, i", "mag", 2)
        .printed("23.12", 23.12, Rule::Limit)
        .is(Assumed, RUBIN_WHY)
        .by(|_| rubin("i")),
    row("rubin-g-effective", ASTRONOMY, "the same, g, with 0.7 arcsec the width of the images", "mag", 2)
        .is(Additional, "the other reading of the seeing")
        .by(|_| {
            let visit = RUBIN.visit(RUBIN.band("g")?, SeeingMeaning::Effective);
            Ok(Numbers::both(visit.limit_mag(LimitKind::Point, 5.0)?))
        }),
    row("earendil-beam", MONTH, "Earendil-1, diameter of the beam on the ground", "km", 2)
        .printed("5.8", 5.8, Rule::Digits)
        .is(Stated, "2 x 625 km tan(0.53 deg/2), pointing to nadir")
        .by(|_| Ok(Numbers::both(beam_diameter_km(EARENDIL.0, PUBLISHED_DIVERGENCE_DEG.to_radians())?))),
    row("earendil-sun", MONTH, "Earendil-1 in sunlight, inside its beam", "mag", 2)
        .is(Additional, "radiance is kept: outside the beam nothing")
        .by(|_| glint(SUN_V_MAG)),
    row("earendil-moon", MONTH, "Earendil-1 in moonlight, inside its beam", "mag", 2)
        .is(Additional, "the same")
        .by(|_| glint(FULL_MOON_V_MAG)),
];

fn limit(context: &Context, sky_mag_arcsec2: f64, snr: f64) -> Result<Numbers> {
    let calculator = Calculator::published(scale_arcsec(context));
    let of = |area| calculator.limit(area, sky_mag_arcsec2, EXPTIME_S, 1, snr).map(|l| l.mag_arcsec2);
    Ok(Numbers { as_published: of(Area::Pixel)?, corrected: of(Area::Arcsec2)? })
}

fn rubin(band: &str) -> Result<Numbers> {
    let visit = RUBIN.visit(RUBIN.band(band)?, SeeingMeaning::At500nm);
    Ok(Numbers::pair(visit.limit_mag(LimitKind::Point, 5.0)?, visit.limit_mag(LimitKind::SquareArcsec, 5.0)?))
}

/// The mirror seen straight, the light source in its beam.
fn glint(source_mag: f64) -> Result<Numbers> {
    let (height_km, area_m2, reflectance) = EARENDIL;
    let up = Vector::<Itrs>::new(0.0, 0.0, 1.0);
    let disc_rad = (0.5 * PUBLISHED_DIVERGENCE_DEG).to_radians();
    glint_mag((area_m2, reflectance), (&up, &up, &up), height_km, disc_rad, source_mag)
        .map(Numbers::both)
        .ok_or_else(|| Error::Model { problem: "no glint inside the beam".into() })
}
