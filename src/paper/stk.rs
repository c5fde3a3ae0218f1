//! The table of the Ansys STK simulation: ratios, magnitudes, units, and what the illumination it was given should be.
//!
//! Radiances in W m⁻² sr⁻¹ unless the unit of a row says cm⁻²; the simulation itself is another's and enters as printed.

use super::context::Context;
use super::entry::{Basis, Entry, Numbers, row};
use super::rule::Rule;
use crate::base::error::{Error, Result};
use crate::base::time::parse_utc;
use crate::brightness::light_sources::{FULL_MOON_V_MAG, SUN_V_MAG, flux_of_mag};
use crate::brightness::spectrum::{SolarColumn, Spectrum};
use Basis::{Additional, Stated};

const TABLE: &str = "table of STK radiances";
const TEXT: &str = "section The Role of Lunar-Earthshine";

/// As printed: starlight, + moonlight, + Lunar-Earthshine.
const PANEL: [f64; 3] = [1.48e-12, 1.48e-12, 1.38e-10];
const BODY_1: [f64; 3] = [1.63e-11, 1.35e-8, 1.54e-8];
const BODY_2: [f64; 3] = [2.36e-11, 2.36e-11, 4.82e-9];
const SNR: [f64; 3] = [0.575, 307.0, 467.0];
/// W/cm².
const IRRADIANCE: [f64; 3] = [2.87e-20, 8.45e-18, 1.31e-17];
/// Irradiance of magnitude 0 \[W/cm²\].
const VEGA_W_CM2: f64 = 2.04e-12;
/// Irradiance and area of the station behind the mean radiance.
const ISS: &str = "iss";
/// Culmination of the pass simulated.
const PASS_UTC: &str = "2025-06-09T10:33:12";
/// Band of the simulated sensor \[nm\].
const WIDE_NM: (f64, f64) = (300.0, 1050.0);
/// Square centimetres in a square metre.
const CM2: f64 = 1e4;

pub(super) const ROWS: &[Entry] = &[
    row("stk-mag-starlight", TABLE, "visual magnitude, starlight only", "mag", 2)
        .printed("19.63", 19.63, Rule::Digits)
        .is(Stated, "-2.5 lg of the irradiance over 2.04e-12 W/cm2; corrected: over that of a V = 0 solar spectrum")
        .by(|_| magnitude(0)),
    row("stk-mag-moon", TABLE, "visual magnitude, moonlight", "mag", 2)
        .printed("13.46", 13.46, Rule::Digits)
        .is(Stated, "the same")
        .by(|_| magnitude(1)),
    row("stk-mag-lunar-earthshine", TABLE, "visual magnitude, moonlight and Lunar-Earthshine", "mag", 2)
        .printed("12.98", 12.98, Rule::Digits)
        .is(Stated, "the same")
        .by(|_| magnitude(2)),
    row("stk-vega-offset", TEXT, "magnitude of its Vega less that of V = 0 sunlight, 0.3-1.05 um", "mag", 3)
        .against(0.0, Rule::Limit)
        .is(
            Stated,
            "\"visual magnitude\" is of a broad band with Vega's flux as zero, neither V nor AB: sunlight \
                of V = 0 carries \
             1.92e-12 W/cm2 there",
        )
        .by(|_| Ok(Numbers::corrected(2.5 * (VEGA_W_CM2 / v_zero_w_cm2()?).log10()))),
    row("stk-body1-ratio", TEXT, "body 1, moonlight over starlight", "", 0)
        .printed("~830", 830.0, Rule::About)
        .is(Stated, "1.35e-8/1.63e-11")
        .by(|_| Ok(Numbers::both(BODY_1[1] / BODY_1[0]))),
    row("stk-panel-ratio", TEXT, "solar panels, Lunar-Earthshine over starlight", "", 1)
        .printed("~93", 93.0, Rule::About)
        .is(Stated, "1.38e-10/1.48e-12")
        .by(|_| Ok(Numbers::both(PANEL[2] / PANEL[0]))),
    row("stk-body1-gain", TEXT, "body 1, what Lunar-Earthshine adds", "%", 1)
        .printed("~14", 14.0, Rule::About)
        .is(Stated, "1.54e-8/1.35e-8")
        .by(|_| Ok(Numbers::both(100.0 * (BODY_1[2] / BODY_1[1] - 1.0)))),
    row("stk-body2-ratio", TEXT, "body 2, Lunar-Earthshine over starlight", "", 1)
        .printed("~240", 240.0, Rule::About)
        .is(Stated, "4.82e-9/2.36e-11 is 204: digits exchanged, in the text and in the conclusions")
        .by(|_| Ok(Numbers::both(BODY_2[2] / BODY_2[0]))),
    row("stk-least-gain", "abstract", "least gain of nadir-facing parts by Lunar-Earthshine", "", 1)
        .printed("at least 100", 100.0, Rule::AtLeast)
        .is(Stated, "the solar panels gain 93.2")
        .by(|_| Ok(Numbers::both((PANEL[2] / PANEL[0]).min(BODY_2[2] / BODY_2[0])))),
    row("stk-snr-ratio", TABLE, "S/N by moonlight over S/N by starlight", "", 0)
        .formula()
        .is(
            Stated,
            "more than the irradiances' ratio (corrected), while S/N can at most go with the signal: not \
                one definition",
        )
        .by(|_| Ok(Numbers::pair(SNR[1] / SNR[0], IRRADIANCE[1] / IRRADIANCE[0]))),
    row("stk-radiance-unit", TABLE, "mean radiance of the station, from its irradiance", "W m-2 sr-1", 7)
        .printed("1.54e-8 at most", 1.54e-8, Rule::AtMost)
        .is(
            Stated,
            "the table's unit must be W/cm2/sr: 1.31e-13 W/m2 over 1130 arcsec2 (400 km) is 300 times its \
                largest number; \
             corrected: at the 749 km of this pass",
        )
        .by(mean_radiance),
    row("stk-radiance-white", TABLE, "white plate (0.8) under the full Moon", "W cm-2 sr-1", 10)
        .against(1.54e-8, Rule::About)
        .is(Stated, "what the largest radiance printed, 1.54e-8, is to be held against, 0.3-1.05 um")
        .by(|_| {
            let moon_w_m2 = moon()?.irradiance_w_m2(WIDE_NM.0, WIDE_NM.1);
            Ok(Numbers::corrected(0.8 * moon_w_m2 / std::f64::consts::PI / CM2))
        }),
    row("stk-lunar-earthshine", TEXT, "radiance of the moonlit Earth at 550 nm", "W cm-2 sr-1 um-1", 10)
        .printed("1.0e-9", 1e-9, Rule::About)
        .is(Stated, "a Lambert Earth of albedo 0.3 under the full Moon in the zenith is 43 times brighter")
        .by(|_| Ok(Numbers::corrected(0.3 * earth_per_albedo()?))),
    row("stk-lunar-earthshine-albedo", TEXT, "albedo times cosine that radiance stands for", "", 4)
        .is(Additional, "the radiance is to be taken as an input")
        .by(|_| Ok(Numbers::corrected(1e-9 / earth_per_albedo()?))),
];

/// The full Moon outside the air.
fn moon() -> Result<Spectrum> {
    let sun = Spectrum::sun(SolarColumn::Extraterrestrial)?;
    Ok(sun.scaled(flux_of_mag(FULL_MOON_V_MAG - SUN_V_MAG)))
}

/// Radiance of a white Lambert Earth under the full Moon at 550 nm \[W cm⁻² sr⁻¹ µm⁻¹\].
fn earth_per_albedo() -> Result<f64> {
    Ok(moon()?.curve().at(550.0) * 1e3 / CM2 / std::f64::consts::PI)
}

/// Sunlight of V = 0 in the sensor's band \[W/cm²\].
fn v_zero_w_cm2() -> Result<f64> {
    let sun = Spectrum::sun(SolarColumn::Extraterrestrial)?;
    Ok(sun.irradiance_w_m2(WIDE_NM.0, WIDE_NM.1) * flux_of_mag(-SUN_V_MAG) / CM2)
}

fn magnitude(i: usize) -> Result<Numbers> {
    let e_w_cm2 = *IRRADIANCE.get(i).ok_or_else(|| Error::Model { problem: "no such column".into() })?;
    let over = |zero: f64| -2.5 * (e_w_cm2 / zero).log10();
    Ok(Numbers::pair(over(VEGA_W_CM2), over(v_zero_w_cm2()?)))
}

fn mean_radiance(context: &Context) -> Result<Numbers> {
    let area_m2 = context.area_m2(ISS)?;
    let range_m = context.tracker(ISS)?.at(&parse_utc("time", PASS_UTC)?)?.range_km * 1e3;
    // L = E/Ω, Ω = A/d²
    let radiance = |d_m: f64| IRRADIANCE[2] * CM2 / (area_m2 / (d_m * d_m));
    Ok(Numbers::pair(radiance(400e3), radiance(range_m)))
}
