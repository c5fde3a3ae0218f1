//! Extremes of the zeropoint: one star, one pointing, colour that follows the airmass, two equal camps, air that brightens.
//!
//! What cannot be determined must be refused, or come with an error that holds: over drawn nights a 1-sigma error holds the
//! truth in 68 %, and in more where a prior of the site is wider than the truth is off.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha12Rng;
use rand_distr::StandardNormal;

use super::{Extreme, absolute, holds, or_wrong, refused};
use crate::base::error::Result;
use crate::config;
use crate::zeropoint::fit::{StarMeasurement, Zeropoint, fit};

const AREA: &str = "zeropoint";
/// ZP and C that are put in.
const ZP: f64 = -23.37;
const C: f64 = 0.08;
/// Random error of a star \[mag\].
const ERR_MAG: f64 = 0.02;
/// Nights a share is of: its own scatter is 0.05.
const NIGHTS: u64 = 80;
/// Three of its scatters below 68 %.
const LEAST_SHARE: f64 = 0.52;

/// A night: stars of each airmass, their colours and what spoils them.
struct Drawn<'a> {
    airmasses: &'a [f64],
    stars: usize,
    k: f64,
    b_v: &'a dyn Fn(f64, &mut ChaCha12Rng) -> f64,
    spoilt: &'a dyn Fn(usize) -> f64,
}

const FIVE: [f64; 5] = [1.05, 1.25, 1.5, 1.75, 2.0];

fn any_colour(_: f64, rng: &mut ChaCha12Rng) -> f64 {
    rng.random_range(0.2..0.9)
}

impl Default for Drawn<'_> {
    fn default() -> Self {
        Self { airmasses: &FIVE, stars: 12, k: 0.12, b_v: &any_colour, spoilt: &|_| 0.0 }
    }
}

impl Drawn<'_> {
    fn night(&self, seed: u64) -> Vec<StarMeasurement> {
        let mut rng = ChaCha12Rng::seed_from_u64(seed);
        let mut all = Vec::new();
        for (pointing, airmass) in self.airmasses.iter().copied().enumerate() {
            for _ in 0..self.stars {
                let (b_v_mag, v_mag) = ((self.b_v)(airmass, &mut rng), rng.random_range(10.0..13.0));
                let noise = ERR_MAG * rng.sample::<f64, _>(StandardNormal);
                all.push(StarMeasurement {
                    inst_mag: v_mag + ZP + self.k * airmass + C * b_v_mag + noise + (self.spoilt)(all.len()),
                    inst_err_mag: ERR_MAG,
                    v_mag,
                    v_err_mag: 0.001,
                    b_v_mag,
                    b_v_err_mag: 0.0,
                    airmass,
                    pointing,
                    star: None,
                });
            }
        }
        all
    }

    fn fitted(&self, seed: u64) -> Result<Zeropoint> {
        fit(&self.night(seed), &config::Zeropoint::default())
    }

    /// Error of the magnitude that a night's fit predicts at an airmass and a colour, and the stated 1-sigma error.
    fn error_at(&self, zeropoint: &Zeropoint, (airmass, b_v_mag): (f64, f64)) -> (f64, f64) {
        let truth = ZP + self.k * airmass + C * b_v_mag;
        (-zeropoint.v_mag(0.0, airmass, b_v_mag) - truth, zeropoint.err_mag(airmass, b_v_mag, 0.0))
    }

    /// Share of the nights whose error is within what is stated.
    fn held(&self, case: &'static str, at: (f64, f64)) -> Extreme {
        let (mut held, mut n, mut stated) = (0.0, 0.0, 0.0);
        for seed in 0..NIGHTS {
            match self.fitted(5_000 + seed) {
                Ok(zeropoint) => {
                    let (error, err) = self.error_at(&zeropoint, at);
                    n += 1.0;
                    stated += err;
                    held += if error.abs() <= err { 1.0 } else { 0.0 };
                }
                Err(error) => return holds(AREA, case, "an answer", false, error.to_string()),
            }
        }
        let got = format!("{:.0} % of {n} nights, stated {:.4} mag on average", 100.0 * held / n, stated / n);
        holds(AREA, case, "1-sigma errors hold 68 % or more", held / n >= LEAST_SHARE, got)
    }
}

pub(super) fn cases() -> Vec<Extreme> {
    let mut all = Vec::new();
    let one_star = Drawn { airmasses: &[1.2], stars: 1, ..Drawn::default() };
    all.push(refused(AREA, "one star", "usable stars", one_star.fitted(1)));

    let one_pointing = Drawn { airmasses: &[1.2], stars: 40, ..Drawn::default() };
    all.push(one_pointing.held("one pointing: at its own airmass", (1.2, 0.5)));
    all.push(one_pointing.held("one pointing: a magnitude at airmass 2", (2.0, 0.5)));
    all.push(or_wrong(AREA, "one pointing", far_error(&one_pointing)));

    // colour and airmass on one line to a thousandth: along it everything is known, across it nothing
    let line =
        |airmass: f64, rng: &mut ChaCha12Rng| 0.3 + 0.4 * (airmass - 1.0) + 1e-3 * rng.sample::<f64, _>(StandardNormal);
    let collinear = Drawn { b_v: &line, ..Drawn::default() };
    all.push(collinear.held("colour follows the airmass: on their line", (1.5, 0.5)));
    all.push(collinear.held("colour follows the airmass: off their line", (1.0, 0.9)));

    let camps = Drawn { spoilt: &|star| if star % 2 == 0 { 0.8 } else { 0.0 }, ..Drawn::default() };
    all.push(refused(AREA, "two camps of stars 0.8 mag apart, as many in each", "majority", camps.fitted(1)));
    let minority = Drawn { spoilt: &|star| if star % 3 == 0 { 0.8 } else { 0.0 }, ..Drawn::default() };
    let right = minority.fitted(1).map(|z| minority.error_at(&z, (1.5, 0.5)));
    all.push(or_wrong(
        AREA,
        "a third of the stars 0.8 mag off",
        right.map(|(error, err)| absolute(AREA, "a third of the stars 0.8 mag off: V [mag]", 0.0, error, 4.0 * err)),
    ));

    let brightening = Drawn { k: -0.3, ..Drawn::default() };
    all.push(or_wrong(
        AREA,
        "an extinction of -0.3 mag",
        brightening.fitted(1).map(|z| {
            let says = z.k_note.contains("does not brighten");
            let got = format!("k {:.3} +- {:.3}, {}", z.k_mag_airmass, z.errs()[1], z.k_note);
            holds(
                AREA,
                "an extinction of -0.3 mag",
                "not used; the prior of the site, with a note",
                says && z.k_mag_airmass > -0.1,
                got,
            )
        }),
    ));
    // zero is the least that air can do, and within the noise of many nights is below it
    all.push(Drawn { k: 0.0, ..Drawn::default() }.held("no extinction at all: at airmass 1.5", (1.5, 0.5)));
    all
}

/// Away from the only airmass the error is that of the prior of k.
fn far_error(one_pointing: &Drawn) -> Result<Extreme> {
    let zeropoint = one_pointing.fitted(1)?;
    let (near, far) = (zeropoint.err_mag(1.2, 0.5, 0.0), zeropoint.err_mag(2.0, 0.5, 0.0));
    let expected = config::Zeropoint::default().k_prior.err * 0.8;
    let got = (far.powi(2) - near.powi(2)).max(0.0).sqrt();
    Ok(absolute(AREA, "one pointing: error added over 0.8 airmass [mag]", expected, got, 1e-3))
}
