//! What would mend a satellite: the same satellite with one thing changed.
//!
//! Half the area of a surface, a diffuse law of the same reflectance, an array held otherwise, a surface tilted. One change at a time.

use std::f64::consts::FRAC_PI_4;

use crate::brightness::{Attitude, Brdf, Satellite, Surface};

/// How far a surface that faces the Earth is tilted, backwards \[deg\].
const TILT_DEG: f64 = 10.0;

/// Every variant with its name; none for a satellite without surfaces.
#[must_use]
pub fn variants(satellite: &Satellite) -> Vec<(String, Satellite)> {
    let mut all = Vec::new();
    for (i, surface) in satellite.surfaces.iter().enumerate() {
        let mut with = |what: String, changed: Surface| {
            let mut surfaces = satellite.surfaces.clone();
            surfaces[i] = changed;
            all.push((what, Satellite { surfaces, ..satellite.clone() }));
        };
        let name = &surface.name;
        with(format!("half the area of {name}"), Surface { area_m2: 0.5 * surface.area_m2, ..surface.clone() });
        if !matches!(surface.brdf, Brdf::Lambert { .. }) {
            // as much light in all, from half-way between grazing and normal
            let albedo = surface.brdf.hemispherical_reflectance(FRAC_PI_4).min(1.0);
            with(format!("{name} diffuse"), Surface { brdf: Brdf::Lambert { albedo }, ..surface.clone() });
        }
        match surface.attitude {
            Attitude::Nadir => {
                let (sin, cos) = TILT_DEG.to_radians().sin_cos();
                let tilted = Surface { attitude: Attitude::Lvlh([-sin, 0.0, cos]), ..surface.clone() };
                with(format!("{name} tilted {TILT_DEG} deg backwards"), tilted);
            }
            Attitude::Sun => {
                with(
                    format!("{name} upright, to the Sun's azimuth"),
                    Surface { attitude: Attitude::SunAzimuth, ..surface.clone() },
                );
            }
            Attitude::SunAzimuth => {
                with(format!("{name} to the Sun"), Surface { attitude: Attitude::Sun, ..surface.clone() });
            }
            _ => {}
        }
    }
    all
}
