//! Hours and nights: the duty cycle of 11 June 2025, and the month of June 2025 at local midnight.
//!
//! % of 24 h, counts of the 30 nights; local time of Sydney in June, UTC+10.

use super::context::{Context, sky_points};
use super::entry::{Basis, Entry, Numbers, row};
use super::pass_check::sun_and_moon;
use super::rule::Rule;
use crate::base::error::Result;
use crate::base::progress::Silent;
use crate::base::time::{parse_utc, shifted};
use crate::brightness::ModelSettings;
use crate::brightness::ToleranceOf;
use crate::brightness::light_class::SUNRISE_ALT_DEG;
use crate::config::Mode;
use crate::visibility::duty_cycle::time_above;
use crate::visibility::forecast::dome::{Dome, Overhead};
use crate::visibility::forecast::month::{MonthSatellite, Night, TrackedLimits, nights, predict_month};
use Basis::{Assumed, Stated};

const PRACTICE: &str = "section Practicality of Moonlit Observations";
const MONTH: &str = "section Detection Thresholds";
/// Midnight that begins 11 June 2025 in Sydney.
const DAY_START: &str = "2025-06-10T14:00:00";
/// Between moments of the night at which it is decided whether the Moon lights anything \[s\].
const STEP_S: f64 = 600.0;
const DAY_S: f64 = 86_400.0;
/// Directions that are computed.
const DIRECTIONS: usize = 100;
/// Height of the ISS \[km\].
const HEIGHT_KM: f64 = 420.0;
/// Moments of a night within an hour of midnight, in the month.
const MOMENTS: usize = 5;

pub(super) const ROWS: &[Entry] = &[
    row("duty-twilight", PRACTICE, "twilight, share of 24 h", "%", 1)
        .printed("~12.5", 12.5, Rule::Share)
        .is(Stated, "from sunset (-0.833 deg) to -18 deg and back, twice 89.1 min on 11 June; from 0 deg it is 13.0 %")
        .by(|c| Ok(Numbers::both(sun_above_pct(c, -18.0)? - sun_above_pct(c, SUNRISE_ALT_DEG)?))),
    row("duty-day", PRACTICE, "twilight and day, share of 24 h", "%", 1)
        .printed("~54", 54.0, Rule::Share)
        .is(Stated, "Sun above -18 deg")
        .by(|c| Ok(Numbers::both(sun_above_pct(c, -18.0)?))),
    row("duty-moon", PRACTICE, "with moonlit satellites, share of 24 h", "%", 1)
        .printed("effectively 100", 100.0, Rule::Share)
        .is(
            Stated,
            "at full Moon some direction of the sky has moonlight in every ten minutes of \
            night; weather apart",
        )
        .by(duty_moon),
    row("nights-moon-up", MONTH, "nights of June 2025 with the Moon up at midnight", "", 0)
        .printed("approximately half", 15.0, Rule::AboutCount)
        .is(Stated, "16 of 30, 3 to 18 June")
        .by(nights_moon_up),
    row("nights-unlit", MONTH, "nights on which no satellite at 420 km over the site has moonlight at midnight", "", 0)
        .printed("~6", 6.0, Rule::AboutCount)
        .is(Stated, "7 nights, 22 to 28 June; 29 June is lit near the horizon alone")
        .by(nights_unlit),
    row("nights-detectable", MONTH, "nights on which the ISS is above the 1-sigma limit at midnight", "", 0)
        .printed("11", 11.0, Rule::Count)
        .is(
            Assumed,
            "the limits of one pixel as printed; the published count needs a surface brightness 2.3 mag \
                fainter than the \
             model's over the station's own solid angle",
        )
        .by(nights_detectable)
        .slow(),
];

/// Share of the day with the Sun above an altitude \[%\].
fn sun_above_pct(context: &Context, alt_deg: f64) -> Result<f64> {
    let start = parse_utc("time", DAY_START)?;
    let altitude = |t_s: f64| Ok(sun_and_moon(&context.site, &shifted(start, t_s))?.sun_alt_deg);
    let times_s: Vec<f64> = (0..=144).map(|k| f64::from(k) * STEP_S).collect();
    let samples = times_s.iter().map(|t| altitude(*t)).collect::<Result<Vec<f64>>>()?;
    Ok(100.0 * time_above(&altitude, &times_s, &samples, alt_deg)? / DAY_S)
}

/// The ISS all over the sky by moonlight alone.
fn moonlit(context: &Context, mode: Mode) -> Result<Dome> {
    let settings = ModelSettings { sun: false, ..super::context::settings(mode) };
    Dome::new(&context.site, &context.satellite("iss")?, &settings, HEIGHT_KM, 0.0)
}

/// Whether the Moon lights the satellite in any direction.
fn any_moonlight(dome: &Dome, overhead: &Overhead, mode: Mode) -> Result<bool> {
    let sky = dome.under(overhead)?;
    for (alt_rad, az_rad) in sky_points(DIRECTIONS, mode)?.directions {
        if sky.toward(alt_rad, az_rad)?.is_some_and(|b| b.total_v_mag.is_some()) {
            return Ok(true);
        }
    }
    Ok(false)
}

fn duty_moon(context: &Context) -> Result<Numbers> {
    let start = parse_utc("time", DAY_START)?;
    let in_mode = |mode| -> Result<f64> {
        let dome = moonlit(context, mode)?;
        let (mut seen, steps) = (0, (DAY_S / STEP_S) as u32);
        for k in 0..steps {
            let overhead = Overhead::at(&context.site, &shifted(start, f64::from(k) * STEP_S))?;
            let sunlight = overhead.sun.alt_rad.to_degrees() > -18.0;
            seen += u32::from(sunlight || any_moonlight(&dome, &overhead, mode)?);
        }
        Ok(100.0 * f64::from(seen) / f64::from(steps))
    };
    Ok(Numbers::pair(in_mode(Mode::AsPublished)?, in_mode(Mode::Corrected)?))
}

fn june() -> Result<Vec<Night>> {
    nights((2025, 6, 1), 30, 10.0)
}

fn nights_moon_up(context: &Context) -> Result<Numbers> {
    let mut up = 0;
    for night in june()? {
        up += u32::from(Overhead::at(&context.site, &night.midnight)?.moon.alt_rad > 0.0);
    }
    Ok(Numbers::both(f64::from(up)))
}

fn nights_unlit(context: &Context) -> Result<Numbers> {
    let in_mode = |mode| -> Result<f64> {
        let dome = moonlit(context, mode)?;
        let mut unlit = 0;
        for night in june()? {
            unlit += u32::from(!any_moonlight(&dome, &Overhead::at(&context.site, &night.midnight)?, mode)?);
        }
        Ok(f64::from(unlit))
    };
    Ok(Numbers::pair(in_mode(Mode::AsPublished)?, in_mode(Mode::Corrected)?))
}

/// The month of the ISS against the published limits, in both modes.
fn nights_detectable(context: &Context) -> Result<Numbers> {
    let in_mode = |mode| -> Result<f64> {
        let satellite = context.satellite("iss")?;
        let settings = ModelSettings { tolerance_of: ToleranceOf::Total, ..super::context::settings(mode) };
        let iss = MonthSatellite {
            name: satellite.name.clone(),
            mode,
            dome: Dome::new(&context.site, &satellite, &settings, HEIGHT_KM, std::f64::consts::FRAC_PI_2)?,
            points: sky_points(DIRECTIONS, mode)?,
            is_mirror: false,
        };
        let limits = TrackedLimits::published();
        let rows = predict_month(&context.site, &[iss], &june()?, (1.0, MOMENTS), &limits, &Silent)?;
        Ok(rows.iter().filter(|r| r.detected_1sigma == Some(1)).count() as f64)
    };
    Ok(Numbers::pair(in_mode(Mode::AsPublished)?, in_mode(Mode::Corrected)?))
}
