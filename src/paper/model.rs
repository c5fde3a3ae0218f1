//! The model over the whole sky on the night of full Moon, 11 June 2025: magnitudes, surface brightness, which light counts.
//!
//! mag, mag/arcsec². As published: directions even in altitude and azimuth, the effects of that mode; corrected: even in
//! solid angle. 288 directions.

use super::context::{Context, quantile};
use super::entry::{Basis, Entry, Numbers, row};
use super::rule::Rule;
use crate::base::error::Result;
use crate::brightness::{Brightness, Satellite};
use crate::config::Mode;
use Basis::{Additional, Assumed, Stated};

const CURVE: &str = "section Practicality of Moonlit Observations";
const SEQUENCE: &str = "figure of the 24-hour sequence";
const MONTH: &str = "section Detection Thresholds";
/// Local midnight and noon of Sydney (UTC+10), full Moon.
const MIDNIGHT: &str = "2025-06-11T14:00:00";
const NOON: &str = "2025-06-11T02:00:00";
/// Height of the ISS the paper's numbers agree with \[km\].
const ISS_KM: f64 = 420.0;

const NIGHT_WHY: &str = "local midnight, height 420 km and directions even in altitude and azimuth, which \
    the paper does not \
                         state; the published conversion to AB adds up to 0.32 mag";
const DAY_WHY: &str = "noon, the same directions; even in solid angle the median is a whole magnitude \
    fainter, so the measure \
                       must be stated";

pub(super) const ROWS: &[Entry] = &[
    row("iss-night-median", CURVE, "ISS by night, median over the sky", "mag", 2)
        .printed("11.25", 11.25, Rule::Model)
        .is(Assumed, NIGHT_WHY)
        .by(|c| iss(c, MIDNIGHT, 0.5)),
    row("iss-night-bright", CURVE, "the same, 16 % are brighter", "mag", 2)
        .printed("9.52", 9.52, Rule::Model)
        .is(Assumed, NIGHT_WHY)
        .by(|c| iss(c, MIDNIGHT, 0.16)),
    row("iss-night-faint", CURVE, "the same, 16 % are fainter", "mag", 2)
        .printed("13.97", 13.97, Rule::Model)
        .is(Assumed, NIGHT_WHY)
        .by(|c| iss(c, MIDNIGHT, 0.84)),
    row("iss-day-median", CURVE, "ISS by day, median over the sky", "mag", 2)
        .printed("-2.66", -2.66, Rule::Model)
        .is(Assumed, DAY_WHY)
        .by(|c| iss(c, NOON, 0.5)),
    row("iss-day-bright", CURVE, "the same, 16 % are brighter", "mag", 2)
        .printed("-3.44", -3.44, Rule::Model)
        .is(Assumed, DAY_WHY)
        .by(|c| iss(c, NOON, 0.16)),
    row("iss-day-faint", CURVE, "the same, 16 % are fainter", "mag", 2)
        .printed("-0.27", -0.27, Rule::Model)
        .is(Assumed, DAY_WHY)
        .by(|c| iss(c, NOON, 0.84)),
    row(
        "direct-moon-directions",
        SEQUENCE,
        "directions in which direct moonlight is the largest light, 12, 14, 16 UTC",
        "",
        0,
    )
    .printed("none", 0.0, Rule::Count)
    .is(Stated, "of 288 each")
    .by(direct_moon),
    row("chassis-share", SEQUENCE, "share of the moonlit flux that the chassis supplies, median direction", "%", 1)
        .is(Additional, "the attitude of the arrays moves the median by less than 0.1 mag")
        .by(chassis_share),
    row("iss-mu-midnight", MONTH, "ISS, surface brightness at midnight of full Moon, median", "mag arcsec-2", 2)
        .printed("20.05", 20.05, Rule::Model)
        .is(
            Stated,
            "of the published median, 11.25, it needs 3311 arcsec2; over the station's own solid angle in \
                each direction it \
             is 2.3 mag brighter",
        )
        .by(|c| surface_brightness(c, "iss", ISS_KM, 0.5)),
    row("bluebird-mu", MONTH, "Bluebird FM1, peak surface brightness", "mag arcsec-2", 2)
        .printed("16.34", 16.34, Rule::Model)
        .is(Assumed, "full Moon, median; the albedo is not published, ours is 0.6: 0.6 to 0.75 gives the number")
        .by(|c| surface_brightness(c, "bluebird-fm1", 520.0, 0.5)),
];

/// A quantile of a quantity over the sky in both modes.
fn in_both_modes(
    context: &Context,
    (utc, satellite, height_km): (&str, &Satellite, f64),
    share: f64,
    of: impl Fn(&Brightness) -> Option<f64>,
) -> Result<Numbers> {
    let value = |mode| -> Result<Option<f64>> {
        let sky = context.over_the_sky(utc, satellite, height_km, mode)?;
        Ok(quantile(sky.iter().filter_map(&of).collect(), share))
    };
    Ok(Numbers { as_published: value(Mode::AsPublished)?, corrected: value(Mode::Corrected)? })
}

fn iss(context: &Context, utc: &str, share: f64) -> Result<Numbers> {
    in_both_modes(context, (utc, &context.satellite("iss")?, ISS_KM), share, |b| b.total_v_mag)
}

fn surface_brightness(context: &Context, name: &str, height_km: f64, share: f64) -> Result<Numbers> {
    let satellite = context.satellite(name)?;
    in_both_modes(context, (MIDNIGHT, &satellite, height_km), share, |b| b.mu_mean_mag_arcsec2)
}

/// How many directions have more direct moonlight than Lunar-Earthshine.
fn direct_moon(context: &Context) -> Result<Numbers> {
    let iss = context.satellite("iss")?;
    let count = |mode| -> Result<f64> {
        let mut count = 0;
        for utc in ["2025-06-11T12:00:00", MIDNIGHT, "2025-06-11T16:00:00"] {
            let sky = context.over_the_sky(utc, &iss, ISS_KM, mode)?;
            let direct = |b: &&Brightness| b.moon.flux_ratio > b.lunar_earthshine.flux_ratio;
            count += sky.iter().filter(direct).count();
        }
        Ok(count as f64)
    };
    Ok(Numbers::pair(count(Mode::AsPublished)?, count(Mode::Corrected)?))
}

/// Flux of the chassis alone over that of the whole, median over the directions.
fn chassis_share(context: &Context) -> Result<Numbers> {
    let whole = context.satellite("iss")?;
    let chassis = Satellite::of("chassis", whole.surfaces.iter().filter(|s| &*s.name == "chassis").cloned().collect());
    let moonlit = |b: &Brightness| b.moon.flux_ratio + b.lunar_earthshine.flux_ratio;
    let share = |mode| -> Result<f64> {
        let skies = [&whole, &chassis].map(|s| context.over_the_sky(MIDNIGHT, s, ISS_KM, mode));
        let [whole, part] = skies;
        let pairs = whole?.into_iter().zip(part?).map(|(w, p)| 100.0 * moonlit(&p) / moonlit(&w)).collect();
        Ok(quantile(pairs, 0.5).unwrap_or(f64::NAN))
    };
    Ok(Numbers::pair(share(Mode::AsPublished)?, share(Mode::Corrected)?))
}
