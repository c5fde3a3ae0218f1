//! A month of midnights: the surface brightness of satellites over the sky against what a telescope that follows detects.
//!
//! mag/arcsec², UTC, rad inside. A night is named by the local date of its evening; its midnight ends that date. Which
//! nights have a Moon or a lit satellite follows from the date, never from an assumed cycle. No weather, no seasons.

use super::larger;
use hifitime::{Epoch, TimeScale, Unit};
use rayon::prelude::*;

use super::day::{lit_frac, sky_light};
use super::dome::{Dome, Overhead};
use crate::base::error::{Error, Result};
use crate::base::progress::Progress;
use crate::base::time::{iso_utc, mjd_utc, shifted};
use crate::brightness::sky_points::{SkyPoints, Spread};
use crate::config::Mode;
use crate::orbit::earth::Site;
use crate::tables::MonthRow;
use crate::visibility::sky_brightness_table::sky_at_moon_phase;
use crate::visibility::tracked::{Noise, limit_mag};

/// Most nights of one table.
const MAX_NIGHTS: usize = 4000;
/// Share of directions and moments from which on a night counts as lit: of fewer there is no median worth the name.
pub const LIT_FROM: f64 = 0.02;
/// New Moon: the phase whose sky is dark \[deg\].
const NEW_MOON_DEG: f64 = 180.0;

/// One night and its local midnight.
#[derive(Debug, Clone, PartialEq)]
pub struct Night {
    /// Local date of the evening, `2025-06-11`.
    pub label: String,
    /// The midnight that ends that date.
    pub midnight: Epoch,
}

/// The nights from the evening of a local date on; local time is UTC + `offset_h`.
///
/// # Errors
/// [`Error::Config`] for a date that is none, no night or more than 4000, an offset beyond ±14 h.
pub fn nights((year, month, day): (i32, u8, u8), n: usize, offset_h: f64) -> Result<Vec<Night>> {
    let bad = |name: &str, problem: String| Err(Error::Argument { name: name.into(), problem });
    let Ok(first) = Epoch::maybe_from_gregorian_utc(year, month, day, 0, 0, 0, 0) else {
        return bad("date", format!("{year:04}-{month:02}-{day:02} is not a date"));
    };
    if !(1..=MAX_NIGHTS).contains(&n) {
        return bad("nights", format!("{n} nights; accepted is 1 to {MAX_NIGHTS}"));
    }
    if !(-14.0..=14.0).contains(&offset_h) {
        return bad("utc_offset_h", format!("{offset_h} h; accepted is -14 to 14"));
    }
    let first = first.to_time_scale(TimeScale::UTC);
    // whole days of the calendar, which leap seconds do not shift
    let date = |k: usize| Epoch::from_mjd_utc(mjd_utc(first).round() + k as f64);
    let night = |k: usize| Night {
        label: iso_utc(date(k), 0).chars().take(10).collect(),
        midnight: (date(k + 1) - offset_h * Unit::Hour).to_time_scale(TimeScale::UTC),
    };
    Ok((0..n).map(night).collect())
}

/// Days of a month of the calendar.
///
/// # Errors
/// [`Error::Config`] for a month that is none.
pub fn days_in_month(year: i32, month: u8) -> Result<usize> {
    let first = |year: i32, month: u8| Epoch::maybe_from_gregorian_utc(year, month, 1, 0, 0, 0, 0);
    let next = if month == 12 { first(year + 1, 1) } else { first(year, month + 1) };
    match (first(year, month), next) {
        (Ok(from), Ok(to)) => Ok((mjd_utc(to) - mjd_utc(from)).round() as usize),
        _ => Err(Error::Argument { name: "month".into(), problem: format!("{year:04}-{month:02} is not a month") }),
    }
}

/// A type of satellite in a month.
#[derive(Debug)]
pub struct MonthSatellite {
    /// Its name.
    pub name: String,
    /// The reading of the model.
    pub mode: Mode,
    /// All over the sky.
    pub dome: Dome,
    /// Directions that are computed.
    pub points: SkyPoints,
    /// Nothing but mirrors: outside their beam there is only their picture of the ground.
    pub is_mirror: bool,
}

/// A telescope that follows, as far as its limits of surface brightness need it.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackedLimits {
    /// Surface brightness that gives 1 e⁻/s in a pixel \[mag/arcsec²\].
    pub zp_mag_arcsec2: f64,
    /// Read noise of a pixel \[e⁻\].
    pub read_noise_e: f64,
    /// Exposure time \[s\].
    pub exptime_s: f64,
    /// Pixels whose light is summed: 1 for a limit of one pixel, those of an arcsec² for one of an arcsec².
    pub n_px: f64,
    /// Band of the table of the sky.
    pub band: String,
}

impl TrackedLimits {
    /// Caddy et al.: 0.61 m telescope, 10 s, one pixel, the sky of DECam's calculator in g.
    ///
    /// Zeropoint and read noise are those with which their four limits come out (21.65, 19.67, 22.56, 20.27).
    #[must_use]
    pub fn published() -> Self {
        Self { zp_mag_arcsec2: 21.62, read_noise_e: 2.7, exptime_s: 10.0, n_px: 1.0, band: "g".into() }
    }

    /// Sky, 1σ and 5σ limit \[mag/arcsec²\] under a Moon of this phase; a Moon below the horizon leaves the sky dark,
    /// as published its phase counts all the same.
    ///
    /// # Errors
    /// [`Error::Model`] for a band or an instrument that makes no sense.
    pub fn at(&self, moon_alt_rad: f64, moon_phase_rad: f64, mode: Mode) -> Result<(f64, f64, f64)> {
        let dark = mode == Mode::Corrected && moon_alt_rad <= 0.0;
        let phase_deg = if dark { NEW_MOON_DEG } else { moon_phase_rad.to_degrees() };
        let sky = sky_at_moon_phase(&self.band, phase_deg)?;
        let sky_e_s = 10f64.powf(-0.4 * (sky - self.zp_mag_arcsec2));
        let pixel = Noise { sky_e_s, dark_e_s: 0.0, read_noise_e: self.read_noise_e };
        let zp_mag = self.zp_mag_arcsec2 + 2.5 * self.n_px.log10();
        let limit = |snr: f64| limit_mag(zp_mag, &pixel.over(self.n_px), self.exptime_s, 1, snr);
        Ok((sky, limit(1.0)?, limit(5.0)?))
    }
}

/// The moments of a night: `steps` of them, even over `half_width_h` on either side of midnight; one is midnight itself.
///
/// # Errors
/// [`Error::Config`] for no moment or a width that is none.
pub fn night_moments(night: &Night, half_width_h: f64, steps: usize) -> Result<Vec<Epoch>> {
    if !(1..=1000).contains(&steps) {
        let problem = format!("{steps} moments; accepted is 1 to 1000");
        return Err(Error::Argument { name: "steps".into(), problem });
    }
    if !(0.0..=12.0).contains(&half_width_h) {
        let problem = format!("{half_width_h} h; accepted is 0 to 12");
        return Err(Error::Argument { name: "around_h".into(), problem });
    }
    let last = (steps - 1).max(1) as f64;
    let off_s = |k: usize| if steps == 1 { 0.0 } else { 3600.0 * half_width_h * (2.0 * k as f64 / last - 1.0) };
    Ok((0..steps).map(|k| shifted(night.midnight, off_s(k))).collect())
}

/// One row per satellite and night, satellites slowest. The same for any number of threads.
///
/// # Errors
/// As [`sky_light`] and [`TrackedLimits::at`].
pub fn predict_month(
    site: &Site,
    satellites: &[MonthSatellite],
    nights: &[Night],
    (half_width_h, steps): (f64, usize),
    limits: &TrackedLimits,
    progress: &dyn Progress,
) -> Result<Vec<MonthRow>> {
    // Sun and Moon once per moment, for all satellites
    let overheads: Vec<(Overhead, Vec<Overhead>)> = nights
        .par_iter()
        .map(|night| {
            let moments = night_moments(night, half_width_h, steps)?;
            let all = moments.iter().map(|epoch| Overhead::at(site, epoch)).collect::<Result<_>>()?;
            Ok((Overhead::at(site, &night.midnight)?, all))
        })
        .collect::<Result<_>>()?;
    let tasks: Vec<(&MonthSatellite, usize)> =
        satellites.iter().flat_map(|s| (0..nights.len()).map(move |k| (s, k))).collect();
    progress.stage("month", tasks.len());
    let rows = tasks
        .par_iter()
        .with_max_len(1)
        .map(|(satellite, k)| {
            let (midnight, moments) = &overheads[*k];
            let row = month_row(satellite, &nights[*k], midnight, moments, limits);
            progress.tick();
            row
        })
        .collect();
    progress.done();
    rows
}

fn month_row(
    satellite: &MonthSatellite,
    night: &Night,
    midnight: &Overhead,
    moments: &[Overhead],
    limits: &TrackedLimits,
) -> Result<MonthRow> {
    let (mut v_mag, mut mu, mut n_directions, mut direct) = (Vec::new(), Vec::new(), 0, 0);
    let (mut err_mag, mut pred_err_mag) = (0.0_f64, None);
    for moment in moments {
        let sky = sky_light(&satellite.dome, &satellite.points, moment)?;
        n_directions += sky.n_points;
        direct += sky.lights_v_mag[0].len() + sky.lights_v_mag[2].len();
        err_mag = err_mag.max(sky.err_mag);
        pred_err_mag = larger(pred_err_mag, sky.pred_err_mag);
        v_mag.extend(sky.v_mag);
        mu.extend(sky.mu_mag_arcsec2);
    }
    let lit_frac = lit_frac(v_mag.len(), n_directions);
    let is_lit = lit_frac >= LIT_FROM;
    let spread = |values: &mut Vec<f64>| Spread::of(values).filter(|_| is_lit);
    let (v, mu) = (spread(&mut v_mag), spread(&mut mu));
    let (sky, one, five) = limits.at(midnight.moon.alt_rad, midnight.moon_phase_rad, satellite.mode)?;
    let brighter = |limit: f64| mu.map(|mu| i64::from(mu.median < limit));
    let note = match (satellite.is_mirror, is_lit) {
        (_, false) => "not lit",
        (true, _) if direct == 0 => {
            "the beam never reaches the observer; what is left is a mirrored piece of lit ground"
        }
        (true, _) => "the beam reaches the observer",
        (false, _) => "",
    };
    Ok(MonthRow {
        object_name: satellite.name.clone(),
        mode: satellite.mode.as_str().into(),
        height_km: satellite.dome.height_km(),
        night: night.label.clone(),
        date_mid: iso_utc(night.midnight, 0),
        mjd_mid_d: mjd_utc(night.midnight),
        sun_alt_deg: midnight.sun.alt_rad.to_degrees(),
        moon_alt_deg: midnight.moon.alt_rad.to_degrees(),
        moon_phase_deg: midnight.moon_phase_rad.to_degrees(),
        moon_illum_pct: 50.0 * (1.0 + midnight.moon_phase_rad.cos()),
        lit_frac,
        model_v_mag: v.map(|s| s.median),
        mu_mean_mag_arcsec2: mu.map(|s| s.median),
        mu_p16_mag_arcsec2: mu.map(|s| s.p16),
        mu_p84_mag_arcsec2: mu.map(|s| s.p84),
        sky_mag_arcsec2: Some(sky),
        limit_1sigma_mag_arcsec2: Some(one),
        limit_5sigma_mag_arcsec2: Some(five),
        detected_1sigma: brighter(one),
        detected_5sigma: brighter(five),
        model_err_mag: v.map(|_| err_mag),
        v_pred_err_mag: v.and(pred_err_mag),
        note: note.into(),
        beam_looked_for: satellite.is_mirror && is_lit,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_night_is_named_by_its_evening_and_crosses_the_end_of_a_year() {
        let found = nights((2025, 12, 30), 4, 10.0).unwrap();
        let labels: Vec<(String, String)> = found.iter().map(|n| (n.label.clone(), iso_utc(n.midnight, 0))).collect();
        assert_eq!(labels[0], ("2025-12-30".into(), "2025-12-30T14:00:00Z".into()));
        assert_eq!(labels[2], ("2026-01-01".into(), "2026-01-01T14:00:00Z".into()));
        assert_eq!(
            nights((2025, 6, 11), 1, -5.5).unwrap()[0].midnight,
            crate::base::time::parse_utc("t", "2025-06-12T05:30:00").unwrap()
        );
        assert!(nights((2025, 2, 29), 1, 0.0).is_err() && nights((2025, 2, 1), 0, 0.0).is_err());
        assert!(nights((2025, 2, 1), 1, 15.0).is_err());
    }

    #[test]
    fn months_have_their_days() {
        for ((year, month), n) in [((2025, 6), 30), ((2024, 2), 29), ((2025, 2), 28), ((2025, 12), 31)] {
            assert_eq!(days_in_month(year, month).unwrap(), n);
        }
        assert!(days_in_month(2025, 13).is_err() && days_in_month(2025, 0).is_err());
    }

    #[test]
    fn the_four_published_limits_come_out_of_the_phase() {
        let limits = TrackedLimits::published();
        let full = limits.at(1.0, 0.0, Mode::AsPublished).unwrap();
        let new = limits.at(-1.0, 180f64.to_radians(), Mode::AsPublished).unwrap();
        for (got, published) in [(full.1, 21.65), (full.2, 19.67), (new.1, 22.56), (new.2, 20.27)] {
            // the sky of new Moon is printed to 0.1 mag
            assert!((got - published).abs() < 0.015, "{got} {published}");
        }
        // a full Moon below the horizon leaves the sky dark
        assert_eq!(
            limits.at(-0.1, 0.0, Mode::Corrected).unwrap(),
            limits.at(-0.1, std::f64::consts::PI, Mode::Corrected).unwrap()
        );
        assert_eq!(limits.at(-0.1, 0.0, Mode::AsPublished).unwrap(), full);
    }

    #[test]
    fn the_moments_of_a_night_are_even_about_midnight() {
        let night = &nights((2025, 6, 11), 1, 10.0).unwrap()[0];
        let moments = night_moments(night, 1.0, 13).unwrap();
        assert_eq!(iso_utc(moments[0], 0), "2025-06-11T13:00:00Z");
        assert_eq!(moments[6], night.midnight);
        assert_eq!(iso_utc(moments[12], 0), "2025-06-11T15:00:00Z");
        assert_eq!(night_moments(night, 1.0, 1).unwrap(), [night.midnight]);
        assert!(night_moments(night, 1.0, 0).is_err() && night_moments(night, -1.0, 3).is_err());
    }
}
