//! The simple model and streaks: surface brightness, trail width, effective exposure, and whether a survey sees them.
//!
//! Satellites in the zenith, distance = height, as the paper has it; Rubin's mirror 8.4 m, seeing 0.7″, 15 s.

use super::context::Context;
use super::entry::{Basis, Entry, Numbers, row};
use super::rule::Rule;
use crate::base::constants::ARCSEC_PER_RAD;
use crate::base::error::{Error, Result};
use crate::brightness::light_sources::FULL_MOON_V_MAG;
use crate::config::Mode;
use crate::visibility::simple::{
    AreaMeaning, Diameter, Panel, PanelLight, SimpleEffects, angle_arcsec, diameter_m, solid_angle_arcsec2,
    surface_brightness,
};
use crate::visibility::streak::{effective_surface_brightness, t_eff_simple_s, width_arcsec, zenith_rate_rad_s};
use crate::visibility::survey::RUBIN;
use Basis::{Additional, Assumed, Stated};

const SIMPLE: &str = "section Simplified Brightness Model";
const ASTRONOMY: &str = "section Implications for Astronomy";
const MONTH: &str = "section Detection Thresholds";
/// Observed median of the ISS \[mag\] and the height it is taken at \[km\].
const ISS_V_MAG: f64 = 12.02;
const ISS_KM: f64 = 400.0;
/// Height at which the published ν comes out \[km\].
const NU_KM: f64 = 420.0;
/// Height of Starcloud, ours \[km\].
const STARCLOUD_KM: f64 = 500.0;
/// Published limit of Rubin in g \[mag\].
const RUBIN_G: f64 = 23.13;

const MU_WHY: &str = "the same inputs give 19.65";

pub(super) const ROWS: &[Entry] = &[
    row("iss-diameter-angle", SIMPLE, "ISS, angle of the disc of its area at 400 km", "arcsec", 2)
        .is(Additional, "sqrt(4 A/pi)/d with A = 4250.25 m2")
        .by(|c| Ok(Numbers::both(angle_arcsec(diameter_m(c.area_m2("iss")?, Diameter::Square)?, ISS_KM * 1e3)?))),
    row("iss-solid-angle", SIMPLE, "ISS, solid angle at 400 km", "arcsec2", 1)
        .is(Additional, "A/d2")
        .by(|c| Ok(Numbers::both(solid_angle_arcsec2(c.area_m2("iss")?, ISS_KM * 1e3, Diameter::Square)?))),
    row("mu-observed", MONTH, "ISS, surface brightness of the observed median", "mag arcsec-2", 2)
        .printed("19.65", 19.65, Rule::Digits)
        .is(Stated, "12.02 over 4250.25 m2 at 400 km")
        .by(mu),
    row("mu-example", ASTRONOMY, "the same in the example of a streak", "mag arcsec-2", 2)
        .printed("19.70", 19.70, Rule::Digits)
        .is(Stated, MU_WHY)
        .by(mu),
    row("mu-results", "section Observational Results", "the same in the results", "mag arcsec-2", 2)
        .printed("20.60", 20.60, Rule::Digits)
        .is(Stated, "the same inputs give 19.65; 20.60 needs 2704 arcsec2, an aperture of 52 arcsec perhaps")
        .by(mu),
    row("disc-area", SIMPLE, "surface brightness with A = (pi/4) D as printed", "mag arcsec-2", 2)
        .formula()
        .is(Stated, "A = (pi/4) D2; the linear form makes the disc 5.4 km wide")
        .by(|c| {
            let of = |reading| -> Result<f64> {
                Ok(surface_brightness(ISS_V_MAG, solid_angle_arcsec2(c.area_m2("iss")?, ISS_KM * 1e3, reading)?))
            };
            Ok(Numbers::pair(of(Diameter::Linear)?, of(Diameter::Square)?))
        }),
    row("nadir-panel", SIMPLE, "cosine of incidence on a panel facing nadir, Moon at 45 deg", "", 3)
        .formula()
        .is(
            Stated,
            "cos theta_i = sin alpha_M is that of a panel facing the zenith: a Moon above the horizon \
                shines on the back of \
             this one, which has Lunar-Earthshine alone",
        )
        .by(|c| {
            let panel = panel(c)?;
            let of = |light| panel.cos_incidence(light);
            Ok(Numbers::pair(of(PanelLight::SineOfAltitude), of(PanelLight::Geometric)))
        }),
    row("nadir-panel-albedo", SIMPLE, "reflectance times cosines the observed median would need", "", 4)
        .is(Additional, "direct moonlight on 4250.25 m2 at 400 km; no real surface is so dark")
        .by(|c| {
            let panel = Panel { source_alt_rad: std::f64::consts::FRAC_PI_2, ..panel(c)? };
            let needed = 10f64.powf(-0.4 * (ISS_V_MAG - FULL_MOON_V_MAG));
            Ok(Numbers::corrected(needed / panel.flux_ratio(&SimpleEffects::of(Mode::AsPublished))?))
        }),
    row("projected-area", SIMPLE, "flux with a projected area, over that with the panel's own, seen at 60 deg", "", 2)
        .formula()
        .is(Stated, "a projected area holds the observer's cosine already: printed it counts twice")
        .by(|c| {
            let panel = Panel { emission_rad: 60f64.to_radians(), ..panel(c)? };
            let published = SimpleEffects::of(Mode::AsPublished);
            let own = panel.flux_ratio(&SimpleEffects { area: AreaMeaning::Geometric, ..published })?;
            Ok(Numbers::pair(panel.flux_ratio(&published)? / own, 1.0))
        }),
    row("t-eff-iss", ASTRONOMY, "ISS, effective exposure at 400 km", "ms", 3)
        .is(Additional, "2 sqrt(A/pi (R + d)/GM), R = 6371 km; in the paper a point of a figure")
        .by(|c| Ok(Numbers::both(1e3 * t_eff_simple_s(c.area_m2("iss")?, ISS_KM)?))),
    row("altitude-term", ASTRONOMY, "what 2000 km changes of the effective exposure at 300 km", "%", 1)
        .printed("~12", 12.0, Rule::About)
        .is(Stated, "sqrt(8371/6671)")
        .by(|_| Ok(Numbers::both(100.0 * (t_eff_simple_s(1.0, 2000.0)? / t_eff_simple_s(1.0, 300.0)? - 1.0)))),
    row("trail-width-iss", SIMPLE, "ISS, width of the trail before Rubin", "arcsec", 2)
        .is(Additional, "satellite, defocus and seeing in quadrature")
        .by(|c| Ok(Numbers::both(rubin_width(c.area_m2("iss")?, ISS_KM)?))),
    row("nu-iss", ASTRONOMY, "ISS, effective surface brightness of the streak", "mag arcsec-2", 2)
        .printed("35.78", 35.78, Rule::Digits)
        .is(
            Assumed,
            "at 420 km, not the 400 stated; and with the light thinned twice, over the trail and by \
                t_eff/t_exp. Corrected: \
             once, at 400 km",
        )
        .by(|c| {
            let area_m2 = c.area_m2("iss")?;
            let published = nu(ISS_V_MAG, area_m2, NU_KM, Mode::AsPublished)?;
            Ok(Numbers::pair(published, nu(ISS_V_MAG, area_m2, ISS_KM, Mode::Corrected)?))
        }),
    row("nu-iss-400", ASTRONOMY, "the same at the height stated, 400 km", "mag arcsec-2", 2)
        .is(Additional, "by both readings")
        .by(|c| streak_of(c, "iss", ISS_V_MAG, ISS_KM)),
    row("streak-scaling", ASTRONOMY, "brightness of the streak for 100 times the area", "", 1)
        .printed("100", 100.0, Rule::Formula)
        .is(
            Stated,
            "follows from thinning the light twice. Spread once over a trail as wide as the satellite it is \
                the square root; \
             100 only while the seeing sets the width",
        )
        .by(|c| {
            let area_m2 = c.area_m2("iss")?;
            let gain = |mode| -> Result<f64> {
                let (small, large) =
                    (nu(ISS_V_MAG, area_m2, ISS_KM, mode)?, nu(ISS_V_MAG - 5.0, 100.0 * area_m2, ISS_KM, mode)?);
                Ok(10f64.powf(0.4 * (small - large)))
            };
            Ok(Numbers::pair(gain(Mode::AsPublished)?, gain(Mode::Corrected)?))
        }),
    starcloud("starcloud-nu", "Starcloud's streak at V 5.3, against a limit of 23.13")
        .by(|c| streak_of(c, "starcloud", 5.3, STARCLOUD_KM)),
    starcloud("starcloud-nu-of-mu", "the same at the published 20.05 mag/arcsec2").by(|c| starcloud_of_mu(c, 20.05)),
    starcloud("starcloud-nu-of-model", "the same at 17.7 mag/arcsec2, the model's").by(|c| starcloud_of_mu(c, 17.7)),
];

/// A streak of Starcloud: the paper finds it too faint for Rubin.
const fn starcloud(id: &'static str, quantity: &'static str) -> Entry {
    row(id, ASTRONOMY, quantity, "mag arcsec-2", 2).printed("too faint", RUBIN_G, Rule::Formula).is(
        Stated,
        "the verdict hangs on how often the light is thinned and on the surface brightness taken: corrected \
            it goes from 2 mag \
         below the limit to 1.7 above it. V is compared with a limit in g, of a point",
    )
}

fn mu(context: &Context) -> Result<Numbers> {
    let omega_arcsec2 = solid_angle_arcsec2(context.area_m2("iss")?, ISS_KM * 1e3, Diameter::Square)?;
    Ok(Numbers::both(surface_brightness(ISS_V_MAG, omega_arcsec2)))
}

/// The station as a white panel facing nadir, the Moon at 45°.
fn panel(context: &Context) -> Result<Panel> {
    Ok(Panel {
        albedo: 1.0,
        area_m2: context.area_m2("iss")?,
        range_m: ISS_KM * 1e3,
        source_alt_rad: 45f64.to_radians(),
        emission_rad: 0.0,
    })
}

fn rubin_width(area_m2: f64, height_km: f64) -> Result<f64> {
    width_arcsec(area_m2, height_km * 1e3, RUBIN.mirror_m, RUBIN.seeing_arcsec)
}

/// Effective surface brightness in the zenith before Rubin.
fn nu(v_mag: f64, area_m2: f64, height_km: f64, mode: Mode) -> Result<f64> {
    let rate_arcsec_s = zenith_rate_rad_s(height_km)? * ARCSEC_PER_RAD;
    effective_surface_brightness(v_mag, rubin_width(area_m2, height_km)?, rate_arcsec_s, RUBIN.exptime_s, mode)
        .ok_or_else(|| Error::Model { problem: "a satellite that does not move leaves no streak".into() })
}

fn streak_of(context: &Context, name: &str, v_mag: f64, height_km: f64) -> Result<Numbers> {
    let area_m2 = context.area_m2(name)?;
    let [as_published, corrected] =
        [Mode::AsPublished, Mode::Corrected].map(|mode| nu(v_mag, area_m2, height_km, mode));
    Ok(Numbers::pair(as_published?, corrected?))
}

fn starcloud_of_mu(context: &Context, mu_mag_arcsec2: f64) -> Result<Numbers> {
    let omega_arcsec2 = solid_angle_arcsec2(context.area_m2("starcloud")?, STARCLOUD_KM * 1e3, Diameter::Square)?;
    // m = μ − 2.5 lg Ω
    streak_of(context, "starcloud", surface_brightness(mu_mag_arcsec2, 1.0 / omega_arcsec2), STARCLOUD_KM)
}
