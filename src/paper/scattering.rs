//! Scattering laws and the engine behind them: what the paper takes from lumos-sat and Fankhauser et al. 2023.
//!
//! Reflectances as shares of the light, f in 1/sr. None of these is printed in the paper; all of its magnitudes rest on them.

use crate::base::search::{Until, bisect};
use std::convert::Infallible;
use std::f64::consts::FRAC_PI_2;

use super::context::{Context, settings};
use super::entry::{Basis, Entry, Numbers, row};
use crate::base::constants::{AU_KM, SUN_RADIUS_KM};
use crate::base::error::Result;
use crate::base::vector::{Itrs, Vector};
use crate::brightness::explicit::RADIUS_KM;
use crate::brightness::light_sources::SUN_V_MAG;
use crate::brightness::light_sources::flux_of_mag;
use crate::brightness::{Brdf, Model, ModelSettings, Scene, direct_reflection};
use crate::config::{Arrays, Distances, Mode, Shadow, Source, SourceDisc};
use Basis::Additional;

const LAWS: &str = "section Lumos-sat, Two Component Model";

/// A directional-hemispherical reflectance at 0, 40, 60, 85°.
const fn reflectance(id: &'static str, quantity: &'static str) -> Entry {
    row(id, LAWS, quantity, "", 4).is(Additional, "at most 1: no law creates light")
}

pub(super) const ROWS: &[Entry] = &[
    reflectance("chassis-reflectance-0", "reflectance of the chassis law, light from 0 deg").by(dhr::<0, 0>),
    reflectance("chassis-reflectance-40", "the same, 40 deg").by(dhr::<0, 40>),
    reflectance("chassis-reflectance-60", "the same, 60 deg").by(dhr::<0, 60>),
    reflectance("chassis-reflectance-85", "the same, 85 deg").by(dhr::<0, 85>),
    reflectance("array-reflectance-0", "reflectance of the array law, light from 0 deg").by(dhr::<1, 0>),
    reflectance("array-reflectance-40", "the same, 40 deg").by(dhr::<1, 40>),
    reflectance("array-reflectance-60", "the same, 60 deg").by(dhr::<1, 60>),
    reflectance("array-reflectance-85", "the same, 85 deg").by(dhr::<1, 85>),
    reflectance("earth-reflectance-0", "reflectance of the Earth, Phong 0.53, 0.28, 7.31, light from 0 deg")
        .by(dhr::<2, 0>),
    reflectance("earth-reflectance-40", "the same, 40 deg").by(dhr::<2, 40>),
    reflectance("earth-reflectance-60", "the same, 60 deg").by(dhr::<2, 60>),
    reflectance("earth-reflectance-85", "the same, 85 deg").by(dhr::<2, 85>),
    reflectance("phong-reflectance-0", "reflectance of Phong 0, 1, n = 100, light from 0 deg").by(dhr::<3, 0>),
    reflectance("phong-reflectance-40", "the same, 40 deg").by(dhr::<3, 40>),
    reflectance("phong-reflectance-60", "the same, 60 deg: (n + 2)/2 pi normalises at 0 deg only").by(dhr::<3, 60>),
    reflectance("phong-reflectance-85", "the same, 85 deg").by(dhr::<3, 85>),
    row("chassis-peak", LAWS, "peak of the chassis law, light from 0 deg", "sr-1", 0)
        .is(Additional, "corrected: averaged over the Sun's disc, 0.70 mag less")
        .by(chassis_peak),
    row("chassis-half-width", LAWS, "half width of that peak", "deg", 2)
        .is(Additional, "narrower than the Sun's radius of 0.267 deg, so that the disc matters")
        .by(|_| half_width()),
    row("lumos-direct", LAWS, "Starlink V1.5, direct light, over the Sun's irradiance", "", 21)
        .is(Additional, "550 km, 10 deg past the terminator, observer 5 deg off: lumos-sat's own to seven digits")
        .by(|context| lumos(context, 10.0, (5.0, 200.0), 0)),
    row("lumos-earthshine", LAWS, "Starlink V1.5, Earthshine, over the Sun's irradiance", "", 18)
        .is(
            Additional,
            "550 km, 10 deg before the terminator; converged. lumos-sat at its default density is off by up \
                to a factor of two",
        )
        .by(|context| lumos(context, -10.0, (6.0, 290.0), 1)),
];

const UP: Vector<Itrs> = Vector::new(0.0, 0.0, 1.0);

fn law(i: usize) -> Result<Brdf> {
    match i {
        0 => Brdf::named("starlink-chassis-lab"),
        1 => Brdf::named("starlink-array-lab"),
        2 => Ok(settings(Mode::AsPublished).earth),
        _ => Ok(Brdf::Phong { kd: 0.0, ks: 1.0, n: 100.0 }),
    }
}

fn dhr<const LAW: usize, const DEG: u32>(_: &Context) -> Result<Numbers> {
    Ok(Numbers::both(law(LAW)?.hemispherical_reflectance(f64::from(DEG).to_radians())))
}

fn chassis_peak(_: &Context) -> Result<Numbers> {
    let disc_rad = (SUN_RADIUS_KM / AU_KM).asin();
    let of = |disc| Ok(direct_reflection(&law(0)?, &UP, &UP, &UP, disc_rad, disc));
    Ok(Numbers::pair(of(SourceDisc::Point)?, of(SourceDisc::Convolved)?))
}

/// Where the chassis law falls to half of its peak, light from 0°.
fn half_width() -> Result<Numbers> {
    let law = law(0)?;
    let f = |rad: f64| law.value(&UP, &UP, &Vector::new(rad.sin(), 0.0, rad.cos()));
    let above_half = |rad: f64| Ok::<bool, Infallible>(f(rad) > 0.5 * f(0.0));
    let Ok([low, _]) = bisect(0.0, FRAC_PI_2, Until::Steps(60), above_half);
    Ok(Numbers::both(low.to_degrees()))
}

/// One of the four lights of lumos-sat's frame: satellite over the pole, Sun `past_deg` below its horizontal.
fn lumos(context: &Context, past_deg: f64, (theta_deg, phi_deg): (f64, f64), light: usize) -> Result<Numbers> {
    let ((st, ct), (sp, cp)) = (theta_deg.to_radians().sin_cos(), phi_deg.to_radians().sin_cos());
    let (sin_past, cos_past) = past_deg.to_radians().sin_cos();
    let scene = Scene {
        satellite_km: UP * (RADIUS_KM + 550.0),
        velocity_km_s: Vector::new(7.6, 0.0, 0.0),
        observer_km: Vector::new(st * cp, st * sp, ct) * RADIUS_KM,
        sun_km: Vector::new(0.0, cos_past, -sin_past) * 1e14,
        moon_km: UP * -4e5,
        sidereal_rad: 0.0,
    };
    let mut s =
        ModelSettings { earth_radius_km: Some(RADIUS_KM), moon: false, ..ModelSettings::new(Mode::Corrected, 1e-6) };
    s.effects.distances = Distances::Ignored;
    s.effects.source = Source::ExoAtmospheric;
    s.effects.source_disc = SourceDisc::Point;
    s.effects.shadow = Shadow::Cylinder;
    s.effects.arrays = Arrays::SunAzimuth;
    let b = Model::new(&context.satellite("starlink-v1.5")?, &s)?.brightness(&scene)?;
    let flux = if light == 0 { b.sun.flux_ratio } else { b.earthshine.flux_ratio };
    Ok(Numbers::both(flux / flux_of_mag(SUN_V_MAG)))
}
