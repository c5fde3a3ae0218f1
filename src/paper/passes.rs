//! The table of passes: Sun, Moon and satellite at the stated times, and what the model says of those passes.
//!
//! Local time of Sydney as printed. Elements: ISS of 2025-06-05 to 06-14, CSS of 2025-06-05; none of January 2024.

use super::context::{Context, quantile};
use super::entry::{Basis, Entry, Numbers, row};
use super::moon::moon_alt_deg;
use super::pass_check::{CheckedPass, FoundPass, sun_and_moon};
use super::rule::Rule;
use crate::base::error::{Error, Result};
use crate::base::time::{parse_utc, shifted};
use crate::brightness::scene::scene;
use crate::config::Mode;
use crate::orbit::passes;
use Basis::{Additional, Literature, Stated};

const TABLE: &str = "table of passes";
/// Lowest altitude of the paper's telescope \[deg\].
const DOME_ALT_DEG: f64 = 15.0;
/// Between moments of a modelled pass \[s\].
const STEP_S: f64 = 5.0;

/// The Moon's lit share at a stated time; corrected: of the date that can be true.
const fn moon_row(id: &'static str, quantity: &'static str) -> Entry {
    row(id, TABLE, quantity, "%", 1)
}

/// The Sun's altitude, likewise.
const fn sun_row(id: &'static str, quantity: &'static str) -> Entry {
    row(id, TABLE, quantity, "deg", 1)
}

/// The satellite's altitude at the stated time; corrected: the highest of the pass that can be meant.
const fn alt_row(id: &'static str, quantity: &'static str) -> Entry {
    row(id, TABLE, quantity, "deg", 1)
}

/// Median V of a moonlit pass.
const fn median_row(id: &'static str, quantity: &'static str) -> Entry {
    row(id, TABLE, quantity, "mag", 2)
}

/// Observed less modelled median of a moonlit pass, against the headline.
const fn residual_row(id: &'static str, quantity: &'static str) -> Entry {
    row(id, TABLE, quantity, "mag", 2).against(0.03, Rule::Residual).is(
        Stated,
        "the median printed less that of the untuned model above 15 deg; held against the headline, 0.03 with its spread of 0.80",
    )
}

/// Brightest V of a pass: an observation, with the model's next to it.
const fn max_row(id: &'static str, quantity: &'static str) -> Entry {
    row(id, TABLE, quantity, "mag", 2)
}

const MODEL: &str = "observed; the model untuned, above 15 deg, with the laws of Starlink parts. Mean of \
    model less observed \
                     of the four passes +0.6 by an independent engine, scatter 1.1 mag";
const OBSERVED: &str = "observed, with the model's";

pub(super) const ROWS: &[Entry] = &[
    moon_row("pass-2024-01-24-moon", "Moon, 24-01-24 10:20")
        .printed("98", 98.0, Rule::MoonShare)
        .is(Stated, "96.7 %, below the horizon: no moonlight to be had by day")
        .by(moon::<0>),
    row("pass-2024-01-24-moon-alt", TABLE, "altitude of the Moon, 24-01-24 10:20", "deg", 1)
        .is(Additional, "below the horizon")
        .by(|c| Ok(Numbers::corrected(moon_alt_deg(c, &checked(c, 0)?.stated.epoch)?))),
    sun_row("pass-2024-01-24-sun", "Sun, 24-01-24 10:20")
        .printed("50", 50.0, Rule::SunAltitude)
        .is(Stated, "summer time, UTC+11. No elements of 2024 here: the pass itself is not checked")
        .by(sun::<0>),
    moon_row("pass-2025-06-08-moon", "Moon, 08-06-25 20:33")
        .printed("91", 91.0, Rule::MoonShare)
        .is(Stated, "92.4 % on the date printed; the pass is of 9 June, 96.6 %")
        .by(moon::<1>),
    sun_row("pass-2025-06-08-sun", "Sun, 08-06-25 20:33").printed("-44", -44.0, Rule::SunAltitude).is(Stated, "").by(sun::<1>),
    alt_row("pass-2025-06-08-alt", "altitude of the ISS, 08-06-25 20:33")
        .printed("a pass", 10.0, Rule::Pass)
        .is(
            Stated,
            "the ISS was under the observer's feet. The pass is of 9 June 20:33 (10:33 UTC, as the text has \
            it), 32.1 deg \
         high, 749 km away",
        )
        .by(altitude::<1>)
        .judged_by(near_stated::<1>),
    row("pass-2025-06-09-range", TABLE, "range of the ISS at that culmination", "km", 0)
        .is(Additional, "322 arcsec2 of station instead of the 1130 at 400 km")
        .by(|c| Ok(Numbers::corrected(meant(c, 1)?.range_km))),
    moon_row("pass-2025-06-09-moon", "Moon, 09-06-25 02:00, CSS")
        .printed("99", 99.0, Rule::MoonShare)
        .is(Stated, "93.1 % on the date printed, which is that of the evening before; 97.1 % on 10 June")
        .by(moon::<2>),
    sun_row("pass-2025-06-09-sun", "Sun, 09-06-25 02:00, CSS")
        .printed("-59", -59.0, Rule::SunAltitude)
        .is(Stated, "-58.3 at the culmination, 02:11")
        .by(sun::<2>),
    alt_row("pass-2025-06-09-alt", "altitude of the CSS, 09-06-25 02:00")
        .printed("a pass", 10.0, Rule::Pass)
        .is(
            Stated,
            "below the horizon. The pass is of 10 June 02:11, 72.8 deg high: the date is UTC's, or the evening's",
        )
        .by(altitude::<2>)
        .judged_by(near_stated::<2>),
    moon_row("pass-2025-06-10-morning-moon", "Moon, 10-06-25 03:00")
        .printed("99", 99.0, Rule::MoonShare)
        .is(Stated, "97.2 %")
        .by(moon::<3>),
    sun_row("pass-2025-06-10-morning-sun", "Sun, 10-06-25 03:00")
        .printed("-48", -48.0, Rule::SunAltitude)
        .is(Stated, "")
        .by(sun::<3>),
    alt_row("pass-2025-06-10-morning-alt", "ISS, 10-06-25 03:00")
        .against(10.0, Rule::Pass).is(Stated, "03:05, 44.5 deg high")
        .by(altitude::<3>)
        .judged_by(near_stated::<3>),
    moon_row("pass-2025-06-10-evening-moon", "Moon, 10-06-25 19:40")
        .printed("99", 99.0, Rule::MoonShare)
        .is(Stated, "")
        .by(moon::<4>),
    sun_row("pass-2025-06-10-evening-sun", "Sun, 10-06-25 19:40")
        .printed("-32", -32.0, Rule::SunAltitude)
        .is(Stated, "the time is rounded to ten minutes")
        .by(sun::<4>),
    alt_row("pass-2025-06-10-evening-alt", "ISS, 10-06-25 19:40")
        .against(10.0, Rule::Pass).is(Stated, "19:44, 59.5 deg high")
        .by(altitude::<4>)
        .judged_by(near_stated::<4>),
    moon_row("pass-2025-06-11-moon", "Moon, 11-06-25 18:50")
        .printed("100", 100.0, Rule::MoonShare)
        .is(Stated, "")
        .by(moon::<5>),
    sun_row("pass-2025-06-11-sun", "Sun, 11-06-25 18:50")
        .printed("-24", -24.0, Rule::SunAltitude)
        .is(
            Stated,
            "night for the observer; \"Twilight\" because the ISS is sunlit until about 08:55 UTC and then \
                enters the umbra, \
             which is why the distribution has two peaks",
        )
        .by(sun::<5>),
    alt_row("pass-2025-06-11-alt", "ISS, 11-06-25 18:50").against(10.0, Rule::Pass).is(Stated, "18:56, 68 deg high").by(altitude::<5>)
        .judged_by(near_stated::<5>),
    moon_row("pass-2025-06-12-moon", "Moon, 12-06-25 03:00").printed("99", 99.0, Rule::MoonShare).is(Stated, "").by(moon::<6>),
    sun_row("pass-2025-06-12-sun", "Sun, 12-06-25 03:00").printed("-48", -48.0, Rule::SunAltitude).is(Stated, "").by(sun::<6>),
    alt_row("pass-2025-06-12-alt", "ISS, 12-06-25 03:00").against(10.0, Rule::Pass).is(Stated, "03:04, 50 deg high").by(altitude::<6>)
        .judged_by(near_stated::<6>),
    row("pass-labels", TABLE, "rows whose label is that of the light on the satellite", "", 0)
        .printed("7", 7.0, Rule::Count)
        .is(Stated, "twilight wherever sunlight reaches the satellite; the row of 2024 by the Sun alone")
        .by(labels),
    row("lowest-pass", "section Description of Observations", "lowest culmination in the table", "deg", 1)
        .printed("above 40", 40.0, Rule::AtLeast)
        .is(Stated, "9 June 20:33 culminates at 32.1 deg")
        .by(lowest_pass),
    row(
        "missed-pass",
        "section Description of Observations",
        "highest pass by night, 8-12 June, not in the table",
        "deg",
        1,
    )
    .printed("every pass", 0.0, Rule::AtMost)
    .is(Stated, "9 June 03:53 local passed near the zenith")
    .by(missed_pass),
    median_row("pass-2025-06-08-median", "median V, 08-06-25 20:33")
        .printed("11.91", 11.91, Rule::Digits)
        .is(Literature, MODEL)
        .by(median::<1>),
    median_row("pass-2025-06-10-morning-median", "median V, 10-06-25 03:00")
        .printed("11.44", 11.44, Rule::Digits)
        .is(Literature, MODEL)
        .by(median::<3>),
    median_row("pass-2025-06-10-evening-median", "median V, 10-06-25 19:40")
        .printed("12.42", 12.42, Rule::Digits)
        .is(Literature, MODEL)
        .by(median::<4>),
    median_row("pass-2025-06-12-median", "median V, 12-06-25 03:00")
        .printed("12.65", 12.65, Rule::Digits)
        .is(Literature, MODEL)
        .by(median::<6>),
    median_row("pass-2025-06-11-median", "median V, 11-06-25 18:50")
        .printed("6.41", 6.41, Rule::Digits)
        .is(Literature, "observed; the model's median depends on how many frames fell into sunlight")
        .by(median::<5>),
    max_row("pass-2025-06-08-max", "brightest V, 08-06-25 20:33")
        .printed("9.00", 9.0, Rule::Digits)
        .is(Literature, OBSERVED)
        .by(brightest::<1>),
    max_row("pass-2025-06-10-morning-max", "brightest V, 10-06-25 03:00")
        .printed("10.78", 10.78, Rule::Digits)
        .is(Literature, OBSERVED)
        .by(brightest::<3>),
    max_row("pass-2025-06-10-evening-max", "brightest V, 10-06-25 19:40")
        .printed("11.30", 11.3, Rule::Digits)
        .is(Literature, OBSERVED)
        .by(brightest::<4>),
    max_row("pass-2025-06-11-max", "brightest V, 11-06-25 18:50")
        .printed("2.70", 2.7, Rule::Digits)
        .is(Literature, OBSERVED)
        .by(brightest::<5>),
    max_row("pass-2025-06-12-max", "brightest V, 12-06-25 03:00")
        .printed("11.20", 11.2, Rule::Digits)
        .is(Literature, OBSERVED)
        .by(brightest::<6>),
    max_row("pass-2024-01-24-max", "brightest V, 24-01-24 10:20")
        .printed("-4.73", -4.73, Rule::Digits)
        .is(Literature, "observed by day; no elements of 2024 here"),
    residual_row("pass-2025-06-08-residual", "observed less modelled median, 08-06-25 20:33").by(residual::<1>),
    residual_row("pass-2025-06-10-morning-residual", "observed less modelled median, 10-06-25 03:00").by(residual::<3>),
    residual_row("pass-2025-06-10-evening-residual", "observed less modelled median, 10-06-25 19:40").by(residual::<4>),
    residual_row("pass-2025-06-12-residual", "observed less modelled median, 12-06-25 03:00").by(residual::<6>),
    median_row("pass-2025-06-11-residual", "observed less modelled median, 11-06-25 18:50")
        .is(Additional, "twilight: the model's median depends on how many frames fell into sunlight; not in the headline")
        .by(residual::<5>),
    row("residual", "abstract", "observed less modelled, mean of the moonlit passes", "mag", 2)
        .printed("0.03 ± 0.80", 0.03, Rule::Model)
        .is(
            Stated,
            "the paper's is of 147 observations, which are not public; here the printed medians of the four moonlit passes of \
             the ISS less the untuned model's. The sign is not stated: \"the model is brighter\" makes it observed less modelled",
        )
        .by(|c| headline(c, |mean, _| mean)),
    row("residual-scatter", "abstract", "its spread", "mag", 2)
        .printed("0.80", 0.80, Rule::Model)
        .is(Stated, "standard deviation of the four passes about their mean")
        .by(|c| headline(c, |_, std| std)),
    median_row("pass-2024-01-24-median", "median V, 24-01-24 10:20")
        .printed("-0.83", -0.83, Rule::Digits)
        .is(Literature, "observed by day; no elements of 2024 here"),
    max_row("pass-2025-06-09-css-max", "brightest V, 09-06-25 02:00, CSS")
        .printed("12.94", 12.94, Rule::Digits)
        .is(Literature, "observed; the paper does not model the CSS"),
    median_row("pass-2025-06-09-css-median", "median V, 09-06-25 02:00, CSS")
        .printed("13.42", 13.42, Rule::Digits)
        .is(Literature, "observed; the paper does not model the CSS"),
];

fn checked(context: &Context, i: usize) -> Result<&CheckedPass> {
    context.passes.get(i).ok_or_else(|| Error::Model { problem: format!("the table of passes has no row {}", i + 1) })
}

/// The pass a row can mean.
fn meant(context: &Context, i: usize) -> Result<&FoundPass> {
    let row = checked(context, i)?;
    let pass = row.proposed.first().map(|(_, pass)| pass).or(row.pass.as_ref());
    pass.ok_or_else(|| Error::Orbit { problem: format!("no pass near {}", row.stated.time) })
}

/// A quantity of Sun and Moon at the stated time, and at the same time of the date that can be true.
fn sky(context: &Context, i: usize, of: impl Fn(&super::pass_check::SunAndMoon) -> f64) -> Result<Numbers> {
    let row = checked(context, i)?;
    let days = row.proposed.first().map_or(0, |(days, _)| *days);
    let right = sun_and_moon(&context.site, &shifted(row.stated.epoch, f64::from(days) * 86_400.0))?;
    Ok(Numbers::pair(of(&row.sky), of(&right)))
}

fn moon<const I: usize>(context: &Context) -> Result<Numbers> {
    sky(context, I, |s| s.moon_illum_pct)
}

fn sun<const I: usize>(context: &Context) -> Result<Numbers> {
    sky(context, I, |s| s.sun_alt_deg)
}

fn altitude<const I: usize>(context: &Context) -> Result<Numbers> {
    Ok(Numbers { as_published: checked(context, I)?.alt_deg, corrected: Some(meant(context, I)?.alt_deg) })
}

fn labels(context: &Context) -> Result<Numbers> {
    let mut same = 0.0;
    for (i, row) in context.passes.iter().enumerate() {
        let label = match meant(context, i) {
            Ok(pass) => Some(pass.label),
            // without elements, a Sun that is up settles it
            Err(_) if row.sky.sun_alt_deg > 0.0 => Some(crate::brightness::light_class::PaperLabel::Day),
            Err(_) => None,
        };
        same += f64::from(u8::from(label.is_some() && label == row.stated.label));
    }
    Ok(Numbers::both(same))
}

fn lowest_pass(context: &Context) -> Result<Numbers> {
    let altitudes = (0..context.passes.len()).filter_map(|i| meant(context, i).ok()).map(|p| p.alt_deg);
    Ok(Numbers::corrected(altitudes.fold(f64::INFINITY, f64::min)))
}

/// The highest pass in darkness of the campaign that no row of the table means.
fn missed_pass(context: &Context) -> Result<Numbers> {
    let [start, end] = ["2025-06-08T07:00:00", "2025-06-12T00:00:00"].map(|t| parse_utc("time", t));
    let all = passes(context.tracker("ISS")?, &start?, &end?, 40.0_f64.to_radians())?;
    let listed: Vec<_> = (0..context.passes.len()).filter_map(|i| meant(context, i).ok()).map(|p| p.epoch).collect();
    let missed = all
        .iter()
        .map(|p| &p.culmination)
        .filter(|c| c.sun_alt_rad < 0.0 && listed.iter().all(|l| (*l - c.epoch).to_seconds().abs() > 600.0));
    Ok(Numbers::corrected(missed.map(|c| c.alt_rad.to_degrees()).fold(f64::NAN, f64::max)))
}

/// V along the pass a row can mean, above the dome's limit.
fn modelled(context: &Context, i: usize, mode: Mode) -> Result<Vec<f64>> {
    let tracker = context.tracker("ISS")?;
    let model = context.model("iss", mode)?;
    let top = meant(context, i)?.epoch;
    let mut magnitudes = Vec::new();
    for k in -120..=120 {
        let geometry = tracker.at(&shifted(top, f64::from(k) * STEP_S))?;
        if geometry.alt_rad.to_degrees() >= DOME_ALT_DEG {
            magnitudes.extend(model.brightness(&scene(&geometry))?.total_v_mag);
        }
    }
    Ok(magnitudes)
}

fn in_both_modes(context: &Context, i: usize, of: fn(Vec<f64>) -> Option<f64>) -> Result<Numbers> {
    let [as_published, corrected] = [Mode::AsPublished, Mode::Corrected].map(|mode| modelled(context, i, mode).map(of));
    Ok(Numbers { as_published: as_published?, corrected: corrected? })
}

fn median<const I: usize>(context: &Context) -> Result<Numbers> {
    in_both_modes(context, I, |v| quantile(v, 0.5))
}

/// The moonlit passes of the ISS in the table.
const MOONLIT: [usize; 4] = [1, 3, 4, 6];

/// The printed median less the modelled one, in both modes.
fn residual_of(context: &Context, i: usize) -> Result<Numbers> {
    let Some(observed) = checked(context, i)?.stated.median_v_mag else { return Ok(Numbers::default()) };
    let Numbers { as_published, corrected } = in_both_modes(context, i, |v| quantile(v, 0.5))?;
    Ok(Numbers { as_published: as_published.map(|m| observed - m), corrected: corrected.map(|m| observed - m) })
}

fn residual<const I: usize>(context: &Context) -> Result<Numbers> {
    residual_of(context, I)
}

/// A number of the mean and the standard deviation of the residuals of the moonlit passes.
fn headline(context: &Context, of: fn(f64, f64) -> f64) -> Result<Numbers> {
    let all = MOONLIT.iter().map(|i| residual_of(context, *i)).collect::<Result<Vec<_>>>()?;
    let spread = |values: Vec<f64>| {
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        of(mean, (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt())
    };
    let as_published: Option<Vec<f64>> = all.iter().map(|n| n.as_published).collect();
    let corrected: Option<Vec<f64>> = all.iter().map(|n| n.corrected).collect();
    Ok(Numbers { as_published: as_published.map(spread), corrected: corrected.map(spread) })
}

/// The highest altitude within ten minutes of the stated time \[deg\].
fn near_stated<const I: usize>(context: &Context) -> Result<f64> {
    let stated = &checked(context, I)?.stated;
    let tracker = context.tracker(&stated.target)?;
    let at = |k: i32| Ok(tracker.altitude_at(&shifted(stated.epoch, f64::from(k) * STEP_S))?.to_degrees());
    (-120..=120).map(at).try_fold(f64::NEG_INFINITY, |best, alt: Result<f64>| Ok(best.max(alt?)))
}

fn brightest<const I: usize>(context: &Context) -> Result<Numbers> {
    in_both_modes(context, I, |v| v.into_iter().reduce(f64::min))
}
