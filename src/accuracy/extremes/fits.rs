//! Extremes of the zeropoint fit: what the stars cannot tell, what half of them deny, a million of them.

use super::{Extreme, Verdict, absolute, holds, or_wrong, refused, relative};
use crate::config::Zeropoint as Config;
use crate::zeropoint::fit::{StarMeasurement, fit};

const AREA: &str = "zeropoint";
/// ZP, k and C put in.
const TRUTH: [f64; 3] = [-23.37, 0.12, 0.08];

/// `n` stars without noise in seven pointings.
fn exact(n: usize) -> Vec<StarMeasurement> {
    (0..n)
        .map(|i| {
            let (airmass, b_v_mag) = (1.0 + 0.05 * (i % 19) as f64, 0.2 + 0.03 * (i % 23) as f64);
            let v_mag = 10.0 + 0.01 * (i % 500) as f64;
            let inst_mag = v_mag + TRUTH[0] + TRUTH[1] * airmass + TRUTH[2] * b_v_mag;
            let (inst_err_mag, v_err_mag) = (0.01, 0.02);
            StarMeasurement {
                inst_mag,
                inst_err_mag,
                v_mag,
                v_err_mag,
                b_v_mag,
                b_v_err_mag: 0.0,
                airmass,
                pointing: i % 7,
                star: None,
            }
        })
        .collect()
}

/// The same with a share of them too faint.
fn spoilt(n: usize, share: f64, by_mag: f64) -> Vec<StarMeasurement> {
    let mut stars = exact(n);
    let every = (1.0 / share).max(1.0);
    let mut next = 0.0;
    while (next as usize) < n {
        stars[next as usize].inst_mag += by_mag;
        next += every;
    }
    stars
}

pub(super) fn cases() -> Vec<Extreme> {
    let config = Config::default();
    let predicted = |stars: &[StarMeasurement]| fit(stars, &config).map(|z| -z.v_mag(0.0, 1.4, 0.65));
    let truth = TRUTH[0] + TRUTH[1] * 1.4 + TRUTH[2] * 0.65;
    let mut all = Vec::new();
    for n in [30, 1_000_000] {
        let case = format!("{n} perfect stars [mag]");
        all.push(or_wrong(AREA, &case, predicted(&exact(n)).map(|p| absolute(AREA, &case, truth, p, 1e-10))));
    }
    for share in [0.1, 0.3] {
        let case = format!("{:.0} % of the stars 0.7 mag too faint [mag]", 100.0 * share);
        all.push(or_wrong(
            AREA,
            &case,
            predicted(&spoilt(400, share, 0.7)).map(|p| absolute(AREA, &case, truth, p, 0.01)),
        ));
    }
    // so many that agree with one another might be right
    all.push(refused(AREA, "45 % of the stars 0.7 mag too faint", "majority", predicted(&spoilt(400, 0.45, 0.7))));
    all.push(refused(AREA, "60 % of the stars too faint, each by its own amount", "", {
        let mut stars = spoilt(400, 0.6, 0.5);
        for (i, star) in stars.iter_mut().enumerate() {
            star.inst_mag += if i % 5 < 3 { 0.3 + 0.002 * (i * 37 % 400) as f64 } else { 0.0 };
        }
        predicted(&stars)
    }));
    all.push(refused(AREA, "no star", "star", predicted(&[])));
    all.push(refused(AREA, "two stars", "star", predicted(&exact(2))));
    // what one airmass or one colour cannot tell is named
    let mut one_airmass = exact(60);
    one_airmass.iter_mut().for_each(|s| s.airmass = 1.2);
    all.push(named("all stars at one airmass", "k", fit(&one_airmass, &config)));
    let mut one_colour = exact(60);
    one_colour.iter_mut().for_each(|s| s.b_v_mag = 0.5);
    all.push(named("all stars of one colour", "C", fit(&one_colour, &config)));
    let mut collinear = exact(60);
    collinear.iter_mut().for_each(|s| s.b_v_mag = 0.3 + 0.4 * (s.airmass - 1.0));
    all.push(named("colour and airmass on one line", "", fit(&collinear, &config)));
    let mut holed = exact(60);
    (holed[0].inst_mag, holed[1].airmass, holed[2].b_v_mag) = (f64::NAN, f64::INFINITY, f64::NAN);
    all.push(or_wrong(
        AREA,
        "NaN and infinity among the stars",
        predicted(&holed).map(|p| absolute(AREA, "NaN and infinity among the stars [mag]", truth, p, 1e-10)),
    ));
    // flux 1e12 e- in f32 loses 6e-8 of it
    let rounded: Vec<StarMeasurement> = exact(60)
        .into_iter()
        .map(|s| StarMeasurement {
            inst_mag: -2.5 * f64::from(10f64.powf(-0.4 * (s.inst_mag - 20.0)) as f32).log10() + 20.0,
            ..s
        })
        .collect();
    all.push(or_wrong(
        AREA,
        "fluxes in single precision",
        predicted(&rounded).map(|p| relative(AREA, "fluxes in single precision [mag]", truth, p, 1e-8)),
    ));
    all
}

/// A term the stars cannot carry: refused by name, or excluded and reported.
fn named(case: &str, term: &str, result: crate::Result<crate::zeropoint::fit::Zeropoint>) -> Extreme {
    match result {
        Err(error) => holds(AREA, case, "refused or reported", error.to_string().contains(term), error.to_string()),
        Ok(z) => {
            let warning = z.warnings.iter().find(|w| w.contains(term)).cloned();
            let mut one =
                holds(AREA, case, "refused or reported", warning.is_some(), warning.unwrap_or_else(|| "fitted".into()));
            if one.verdict == Verdict::Ok {
                one.expected = "reported".into();
            }
            one
        }
    }
}
