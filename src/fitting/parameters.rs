//! What of a satellite's surfaces is free in a fit: strengths, numbers of their laws, how they are held; each by itself or tied to others.
//!
//! A strength and a number of a law enter by their logarithm, angles in tens of degrees. What is not named is held. It does not cover
//! how a fit is done ([`super::problem`]).

use crate::base::error::{Error, Result};
use crate::brightness::predictive::LN_SCALE;
use crate::config::{Attitude, Surface};

/// Unit of angles in the fit \[deg\].
const ANGLE_UNIT_DEG: f64 = 10.0;
/// Angles beyond this are another attitude \[deg\].
const LARGEST_ANGLE_DEG: f64 = 90.0;

/// What a parameter changes.
#[derive(Debug, Clone, PartialEq)]
enum Kind {
    /// The area, which stands for area times reflectance.
    Scale,
    /// A number of the law of the front.
    Law(String),
    /// A surface that faces the Earth is turned forward about the orbit's angular momentum.
    Pitch,
    /// A surface that faces the Sun is turned away from nadir.
    SunOffset,
}

/// A free parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Free {
    kind: Kind,
    surfaces: Vec<usize>,
    /// Its name in the entry.
    pub name: String,
    /// Where the fit begins.
    pub start: f64,
}

fn refused(text: &str, problem: String) -> Error {
    Error::Argument { name: "free".into(), problem: format!("\"{text}\" {problem}") }
}

impl Free {
    /// `SURFACE` is its strength, `SURFACE.KEY` a number of its law, `SURFACE.pitch_deg` and `SURFACE.sun_offset_deg` angles; several
    /// surfaces joined by `+` share the parameter.
    ///
    /// # Errors
    /// [`Error::Argument`]: an unknown surface or key, surfaces that cannot share it, a number that is 0 or negative.
    pub fn parse(text: &str, surfaces: &[Surface]) -> Result<Self> {
        let (names, key) = text.split_once('.').map_or((text, None), |(names, key)| (names, Some(key)));
        let known = || surfaces.iter().map(|s| s.name.as_str()).collect::<Vec<_>>().join(", ");
        let of = |name: &str| {
            let found = surfaces.iter().position(|s| s.name == name);
            found.ok_or_else(|| refused(text, format!("names no surface; there are {}", known())))
        };
        let of_names: Vec<usize> = names.split('+').map(of).collect::<Result<_>>()?;
        let joined = names.replace('+', " and ");
        let free = |kind, name, start| Ok(Self { kind, surfaces: of_names.clone(), name, start });
        match key {
            None => free(Kind::Scale, format!("{LN_SCALE}{names}"), 0.0),
            Some("pitch_deg") => match of_names.iter().find(|s| surfaces[**s].attitude != Attitude::Nadir) {
                None => free(Kind::Pitch, format!("pitch_deg of {joined}"), 0.0),
                Some(s) => {
                    Err(refused(text, format!("is of surfaces that face the Earth; {} does not", surfaces[*s].name)))
                }
            },
            Some("sun_offset_deg") => match of_names.iter().find(|s| surfaces[**s].attitude != Attitude::Sun) {
                None => free(Kind::SunOffset, format!("sun_offset_deg of {joined}"), 0.0),
                Some(s) => {
                    Err(refused(text, format!("is of surfaces that face the Sun; {} does not", surfaces[*s].name)))
                }
            },
            Some(key) => {
                let values: Vec<f64> =
                    of_names.iter().map(|s| law_number(text, &surfaces[*s], key)).collect::<Result<_>>()?;
                match values.iter().find(|v| **v <= 0.0 || **v != values[0]) {
                    None => free(Kind::Law(key.to_owned()), format!("ln {key} of {joined}"), values[0].ln()),
                    Some(v) if *v <= 0.0 => Err(refused(text, format!("is {v}; give it a start above 0"))),
                    Some(_) => Err(refused(text, format!("is not the same for {joined}: {values:?}"))),
                }
            }
        }
    }

    /// Whether the light of a surface is proportional to it, with the logarithm as parameter.
    pub(super) fn is_scale(&self) -> bool {
        self.kind == Kind::Scale
    }

    /// Whether it is an angle of an attitude.
    pub(super) fn is_angle(&self) -> bool {
        matches!(self.kind, Kind::Pitch | Kind::SunOffset)
    }

    /// Whether a surface depends on it.
    pub(super) fn is_of(&self, surface: usize) -> bool {
        self.surfaces.contains(&surface)
    }

    /// The unit of the parameter in the fit: what a value of the fit is multiplied by.
    pub(super) fn unit(&self) -> f64 {
        match self.kind {
            Kind::Scale | Kind::Law(_) => 1.0,
            Kind::Pitch | Kind::SunOffset => ANGLE_UNIT_DEG,
        }
    }

    /// Half the step of a derivative, in the unit of the fit.
    pub(super) fn step(&self) -> f64 {
        match self.kind {
            Kind::Scale | Kind::Law(_) => 0.01,
            Kind::Pitch | Kind::SunOffset => 0.05,
        }
    }

    /// The surface with this parameter at a value, strengths as they are.
    fn apply(&self, surface: &mut Surface, value: f64) -> std::result::Result<(), String> {
        let angle_deg = value * ANGLE_UNIT_DEG;
        match &self.kind {
            Kind::Scale => {}
            Kind::Law(key) => {
                let problem = |e: &dyn std::fmt::Display| format!("{} = {:.3e}: {e}", self.name, value.exp());
                let mut law = toml::Value::try_from(&surface.brdf).map_err(|e| problem(&e))?;
                if let Some(number) = law.get_mut(key) {
                    *number = toml::Value::Float(value.exp());
                }
                surface.brdf = law.try_into().map_err(|e: toml::de::Error| problem(&e.message()))?;
            }
            Kind::Pitch | Kind::SunOffset if angle_deg.abs() > LARGEST_ANGLE_DEG => {
                return Err(format!("{} ran to {angle_deg:.0}", self.name));
            }
            Kind::Pitch => {
                let (sin, cos) = angle_deg.to_radians().sin_cos();
                surface.attitude = Attitude::Lvlh([sin, 0.0, cos]);
            }
            Kind::SunOffset => surface.attitude = Attitude::SunOffset { offset_deg: angle_deg },
        }
        Ok(())
    }
}

/// A number of the law of a surface.
fn law_number(text: &str, surface: &Surface, key: &str) -> Result<f64> {
    let law = toml::Value::try_from(&surface.brdf).map_err(|e| refused(text, e.to_string()))?;
    let table = law.as_table().cloned().unwrap_or_default();
    match table.get(key).and_then(toml::Value::as_float) {
        Some(value) => Ok(value),
        None => {
            let numbers: Vec<&str> = table.iter().filter(|(_, v)| v.is_float()).map(|(k, _)| k.as_str()).collect();
            let known =
                if numbers.is_empty() { "has no number".to_owned() } else { format!("has {}", numbers.join(", ")) };
            Err(refused(
                text,
                format!(
                    "is not a number of the law of {}, which {known}; angles are pitch_deg and sun_offset_deg",
                    surface.name
                ),
            ))
        }
    }
}

/// A surface with the parameters at these values, its area as it is.
pub(super) fn shape_at(
    surface: usize,
    surfaces: &[Surface],
    free: &[Free],
    theta: &[f64],
) -> std::result::Result<Surface, String> {
    let mut shape = surfaces[surface].clone();
    for (free, value) in free.iter().zip(theta).filter(|(free, _)| free.is_of(surface)) {
        free.apply(&mut shape, *value)?;
    }
    Ok(shape)
}

/// The surfaces with the parameters of an entry, in the units of their names.
///
/// # Errors
/// [`Error::Model`] for values that make no law.
pub fn surfaces_at(surfaces: &[Surface], free: &[Free], values: &[f64]) -> Result<Vec<Surface>> {
    let theta: Vec<f64> = free.iter().zip(values).map(|(free, value)| value / free.unit()).collect();
    let one = |s: usize| {
        let mut shape = shape_at(s, surfaces, free, &theta).map_err(|problem| Error::Model { problem })?;
        let scales = free.iter().zip(&theta).filter(|(free, _)| free.is_scale() && free.is_of(s));
        shape.area_m2 *= scales.map(|(_, t)| t.exp()).product::<f64>();
        Ok(shape)
    };
    (0..surfaces.len()).map(one).collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::config::Brdf;

    fn surfaces() -> Vec<Surface> {
        let phong = Brdf::Phong { kd: 0.2, ks: 0.3, n: 20.0 };
        let of = |name: &str, attitude| Surface {
            name: name.into(),
            area_m2: 4.0,
            attitude,
            brdf: phong.clone(),
            back: None,
        };
        vec![of("chassis", Attitude::Nadir), of("array", Attitude::Sun)]
    }

    #[test]
    fn parameters_change_what_they_are_of_and_nothing_else() {
        let all = surfaces();
        let free: Vec<Free> =
            ["chassis+array", "chassis.kd", "chassis+array.n", "chassis.pitch_deg", "array.sun_offset_deg"]
                .into_iter()
                .map(|text| Free::parse(text, &all).unwrap())
                .collect();
        let values = [2f64.ln(), 0.1f64.ln(), 50f64.ln(), 10.0, -20.0];
        let [chassis, array] = &surfaces_at(&all, &free, &values).unwrap()[..] else { panic!() };
        assert!((chassis.area_m2 - 8.0).abs() < 1e-12 && (array.area_m2 - 8.0).abs() < 1e-12);
        let Brdf::Phong { kd, ks, n } = chassis.brdf else { panic!() };
        assert!((kd - 0.1).abs() < 1e-12 && ks == 0.3 && (n - 50.0).abs() < 1e-9);
        let Brdf::Phong { kd, n, .. } = array.brdf else { panic!() };
        assert!(kd == 0.2 && (n - 50.0).abs() < 1e-9);
        let Attitude::Lvlh([x, y, z]) = chassis.attitude else { panic!() };
        assert!((x.atan2(z).to_degrees() - 10.0).abs() < 1e-9 && y == 0.0);
        assert_eq!(array.attitude, Attitude::SunOffset { offset_deg: -20.0 });
        assert_eq!(free[0].name, "ln scale of chassis+array");
        assert_eq!(free[2].name, "ln n of chassis and array");
    }

    #[test]
    fn what_is_no_parameter_is_refused_by_name() {
        let all = surfaces();
        let refused = |text: &str| Free::parse(text, &all).unwrap_err().to_string();
        assert!(refused("film").contains("there are chassis, array"));
        assert!(refused("chassis.albedo").contains("has kd, ks, n"), "{}", refused("chassis.albedo"));
        assert!(refused("array.pitch_deg").contains("array does not"));
        assert!(refused("chassis.sun_offset_deg").contains("chassis does not"));
    }
}
