//! The Moon: its law against phase next to ROLO, its distance in June 2025, when it was full.
//!
//! V at mean distances unless a row says so; phase angles in deg; moments in hours of a day, UTC.

use hifitime::Epoch;

use super::context::Context;
use super::entry::{Basis, Entry, Numbers, row};
use super::pass_check::sun_and_moon;
use super::rule::Rule;
use crate::base::constants::AU_KM;
use crate::base::error::{Error, Result};
use crate::base::time::{parse_utc, seconds_between, shifted};
use crate::brightness::Band;
use crate::brightness::light_sources::{MOON_MEAN_DISTANCE_KM, SourceSettings, mag_of_flux, moon_v_mag};
use crate::config::{Effects, Mode, MoonLaw, MoonPastLimit, Source};
use crate::orbit::sky::bodies_gcrs;
use crate::orbit::{EarthOrientation, bodies};
use Basis::{Additional, Literature, Stated};

const LAW: &str = "section Spectral Modelling of Moonlight";
/// Middle of the paper's campaign.
const CAMPAIGN_UTC: &str = "2025-06-10T09:44:00";
/// Obliquity of the ecliptic of J2000 \[deg\] (IAU 2006).
const OBLIQUITY_DEG: f64 = 23.439_279_4;

/// The Moon at a phase by the law of Cox, corrected by ROLO.
const fn at_phase(id: &'static str, quantity: &'static str) -> Entry {
    row(id, LAW, quantity, "mag", 2).is(Additional, "as published: Cox; corrected: ROLO without libration")
}

pub(super) const ROWS: &[Entry] = &[
    row("moon-law-0", LAW, "V of the full Moon", "mag", 2)
        .printed("-12.73", -12.73, Rule::Digits)
        .is(Stated, "the law at 0 deg; corrected: with the surge of Krisciunas & Schaefer, which overshoots by 0.1 mag")
        .by(|_| pair_of_laws(0.0, MoonLaw::CoxOpposition)),
    row("moon-surge-2", LAW, "V of the Moon at 2 deg", "mag", 2)
        .is(Additional, "as published: Cox; corrected: with the surge of Krisciunas & Schaefer below 7 deg")
        .by(|_| pair_of_laws(2.0, MoonLaw::CoxOpposition)),
    at_phase("moon-law-2", "V of the Moon at 2 deg").by(rolo::<2>),
    at_phase("moon-law-5", "V of the Moon at 5 deg").by(rolo::<5>),
    at_phase("moon-law-7", "V of the Moon at 7 deg").by(rolo::<7>),
    at_phase("moon-law-10", "V of the Moon at 10 deg").by(rolo::<10>),
    at_phase("moon-law-20", "V of the Moon at 20 deg").by(rolo::<20>),
    at_phase("moon-law-30", "V of the Moon at 30 deg").by(rolo::<30>),
    at_phase("moon-law-60", "V of the Moon at 60 deg").by(rolo::<60>),
    at_phase("moon-law-90", "V of the Moon at 90 deg").by(rolo::<90>),
    row("moon-law-holzloehner", "figure of the Moon's law", "V of the Moon against phase, observed", "mag", 2).is(
        Literature,
        "data of Holzloehner et al. 2017, not printed as numbers; the law and ROLO stand in the rows above",
    ),
    row("moon-distance-term", "equation of the Moon's law", "what the law neglects on 10 June 2025", "mag", 3)
        .is(Additional, "5 lg of the Moon's distance from the site and the Sun's from the Moon, over their means")
        .by(distance_term),
    row("full-moon", "section Detection Thresholds", "full Moon of June 2025, hours of 11 June", "h UTC", 3)
        .is(Additional, "the paper's night of full Moon; longitudes of Sun and Moon 180 deg apart")
        .by(|_| moment("2025-06-11T00:00:00", 180.0)),
    row("last-quarter", "figure of the 24-hour sequence", "last quarter of June 2025, hours of 18 June", "h UTC", 3)
        .is(Additional, "the paper's second sequence; longitudes 270 deg apart")
        .by(|_| moment("2025-06-18T00:00:00", 270.0)),
];

/// Cox next to another law at a phase.
fn pair_of_laws(phase_deg: f64, law: MoonLaw) -> Result<Numbers> {
    let effects = Effects {
        moon_law: law,
        moon_past_limit: MoonPastLimit::Polynomial,
        source: Source::ExoAtmospheric,
        ..Effects::of(Mode::Corrected)
    };
    let other = SourceSettings::new(&effects, &Band::of_config("V")?)?.moonlight_at_phase(phase_deg);
    Ok(Numbers { as_published: Some(moon_v_mag(phase_deg)), corrected: mag_of_flux(other.flux) })
}

fn rolo<const DEG: u32>(_: &Context) -> Result<Numbers> {
    pair_of_laws(f64::from(DEG), MoonLaw::Rolo)
}

fn distance_term(context: &Context) -> Result<Numbers> {
    let b = bodies(&parse_utc("time", CAMPAIGN_UTC)?, &EarthOrientation::default())?;
    let (moon_km, sun_km) =
        ((b.moon_itrs_km - context.site.position()).norm(), (b.sun_itrs_km - b.moon_itrs_km).norm());
    Ok(Numbers::pair(0.0, 5.0 * (moon_km / MOON_MEAN_DISTANCE_KM * sun_km / AU_KM).log10()))
}

/// Longitude of the Moon less that of the Sun on the ecliptic \[deg\], within ±180 of `wanted_deg`, less that.
fn elongation_deg(epoch: &Epoch, wanted_deg: f64) -> Result<f64> {
    let (sin, cos) = OBLIQUITY_DEG.to_radians().sin_cos();
    let (sun, moon) = bodies_gcrs(epoch)?;
    let [sun_deg, moon_deg] = [sun, moon].map(|v| (cos * v.y() + sin * v.z()).atan2(v.x()).to_degrees());
    Ok((moon_deg - sun_deg - wanted_deg + 180.0).rem_euclid(360.0) - 180.0)
}

/// Hours after the start of a day at which the elongation has a value, by bisection.
fn moment(day: &str, wanted_deg: f64) -> Result<Numbers> {
    let start = parse_utc("time", day)?;
    let (mut low, mut high) = (start, shifted(start, 86_400.0));
    if !(elongation_deg(&low, wanted_deg)? <= 0.0 && elongation_deg(&high, wanted_deg)? >= 0.0) {
        return Err(Error::Model { problem: format!("no elongation of {wanted_deg} deg on {day}") });
    }
    while seconds_between(low, high) > 0.5 {
        let middle = shifted(low, 0.5 * seconds_between(low, high));
        if elongation_deg(&middle, wanted_deg)? < 0.0 { low = middle } else { high = middle }
    }
    Ok(Numbers::both(seconds_between(start, low) / 3600.0))
}

/// Altitude of the Moon over the site \[deg\].
pub(super) fn moon_alt_deg(context: &Context, epoch: &Epoch) -> Result<f64> {
    Ok(sun_and_moon(&context.site, epoch)?.moon_alt_deg)
}
