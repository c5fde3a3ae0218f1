//! How a surface is held: the direction of its normal in one scene.
//!
//! Angles in rad, directions of any length but 0. LVLH axes: z to the centre of the Earth, y against the orbit's
//! angular momentum, x = y × z, forward. In the Earth's shadow everything that tracks the Sun keeps tracking it. Not
//! included: how fast a gimbal can turn, and cables that keep it from turning on.

use std::f64::consts::{FRAC_PI_2, PI};

use super::scene::{Scene, impossible};
use crate::base::error::Result;
use crate::base::vector::{Itrs, Vector};
use crate::config;

/// Sine of the angle to a singular direction below which the Sun counts as lying in it: 0.2 arcsec.
const SINGULAR: f64 = 1e-6;

/// How a surface is held.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Attitude {
    /// Normal to the centre of the Earth.
    Nadir,
    /// Normal to the geometric Sun, also in the shadow.
    Sun,
    /// Normal to the Sun, turned by an angle away from nadir; not turned while the Sun is at zenith or nadir.
    SunOffset {
        /// The angle \[rad\], −π/2 to π/2.
        offset_rad: f64,
    },
    /// Normal at right angles to nadir, towards the Sun's azimuth; forward while the Sun is at zenith or nadir.
    SunAzimuth,
    /// Normal halfway between Sun and nadir: a mirror that sends sunlight straight down; forward while the Sun is at
    /// zenith, where that mirror would have to be edge-on.
    SunToNadir,
    /// Normal as near to the Sun as turning about one axis allows; at angle 0 while the Sun is on the axis.
    SunOneAxis {
        /// The axis, in LVLH.
        axis_lvlh: [f64; 3],
        /// The normal at angle 0, in LVLH; its part along the axis does not count.
        zero_lvlh: [f64; 3],
        /// Largest turn either way \[rad\], above 0 and at most π.
        limit_rad: f64,
    },
    /// Normal as near to the Sun as azimuth about up, then elevation allow; azimuth 0 (forward) while the Sun is at
    /// zenith or nadir.
    SunTwoAxes {
        /// Largest azimuth either way from forward \[rad\], 0 to π.
        azimuth_limit_rad: f64,
        /// Lowest and highest elevation above the local horizontal \[rad\].
        elevation_rad: [f64; 2],
    },
    /// Normal fixed in LVLH.
    Lvlh([f64; 3]),
    /// Normal fixed among the stars: true equator, equinox of the sidereal angle of the scene.
    Inertial {
        /// Right ascension \[rad\].
        ra_rad: f64,
        /// Declination \[rad\].
        dec_rad: f64,
    },
    /// Normal fixed in the Earth-fixed frame of the scene, for tests.
    Fixed(Vector<Itrs>),
}

impl Attitude {
    /// Whether it belongs to an array: one of the attitudes that keep a panel's front to the Sun.
    #[doc(hidden)]
    #[must_use]
    pub fn tracks_sun(&self) -> bool {
        matches!(
            self,
            Attitude::Sun
                | Attitude::SunOffset { .. }
                | Attitude::SunAzimuth
                | Attitude::SunOneAxis { .. }
                | Attitude::SunTwoAxes { .. }
        )
    }

    /// The attitude under a choice for all arrays; those that do not track the Sun stay as they are.
    #[doc(hidden)]
    #[must_use]
    pub fn with_arrays(self, arrays: config::Arrays) -> Self {
        match arrays {
            config::Arrays::Sun if self.tracks_sun() => Attitude::Sun,
            config::Arrays::SunAzimuth if self.tracks_sun() => Attitude::SunAzimuth,
            _ => self,
        }
    }

    /// The unit normal in a scene; `None` where it has no direction.
    ///
    /// No direction: a vector of length 0 or not finite, a satellite at the Earth's centre or in the Sun, and an
    /// attitude that needs the orbit when position and velocity span no plane.
    #[must_use]
    pub fn normal(&self, scene: &Scene) -> Option<Vector<Itrs>> {
        let nadir = (-scene.satellite_km).unit()?;
        let sun = (scene.sun_km - scene.satellite_km).unit()?;
        match *self {
            Attitude::Nadir => Some(nadir),
            Attitude::Sun => Some(sun),
            Attitude::SunOffset { offset_rad } => {
                let up = sun * nadir.dot(&sun) - nadir;
                if up.norm() > SINGULAR {
                    (sun * offset_rad.cos() + up.unit()? * offset_rad.sin()).unit()
                } else {
                    Some(sun)
                }
            }
            Attitude::SunAzimuth => {
                let level = sun - nadir * nadir.dot(&sun);
                if level.norm() > SINGULAR { level.unit() } else { Some(Lvlh::of(scene)?.x) }
            }
            Attitude::SunToNadir => {
                let between = sun + nadir;
                if between.norm() > SINGULAR { between.unit() } else { Some(Lvlh::of(scene)?.x) }
            }
            Attitude::SunOneAxis { axis_lvlh, zero_lvlh, limit_rad } => {
                let lvlh = Lvlh::of(scene)?;
                one_axis(&lvlh.point(axis_lvlh)?, &lvlh.point(zero_lvlh)?, limit_rad, &sun)
            }
            Attitude::SunTwoAxes { azimuth_limit_rad, elevation_rad } => {
                two_axes(&Lvlh::of(scene)?, azimuth_limit_rad, elevation_rad, &sun)
            }
            Attitude::Lvlh(direction) => Lvlh::of(scene)?.point(direction),
            Attitude::Inertial { ra_rad, dec_rad } => {
                // R₃(θ) (cos δ cos α, cos δ sin α, sin δ)
                let ((sin_dec, cos_dec), hour) = (dec_rad.sin_cos(), ra_rad - scene.sidereal_rad);
                Vector::new(cos_dec * hour.cos(), cos_dec * hour.sin(), sin_dec).unit()
            }
            Attitude::Fixed(v) => v.unit(),
        }
    }

    /// Refuses vectors without a direction and limits out of range.
    ///
    /// # Errors
    /// [`crate::Error::Model`] naming `what`, the value and what is accepted.
    #[doc(hidden)]
    pub fn check(&self, what: &str) -> Result<()> {
        let refuse = |problem: String| Err(impossible(format!("{what}: {problem}")));
        let direction = |name: &str, v: [f64; 3]| match Vector::<Itrs>::new(v[0], v[1], v[2]).unit() {
            Some(_) => Ok(()),
            None => refuse(format!("{name} = {v:?} has no direction")),
        };
        match *self {
            Attitude::SunOffset { offset_rad } if offset_rad.is_nan() || offset_rad.abs() > FRAC_PI_2 => {
                refuse(format!("an offset of {offset_rad} rad from the Sun; accepted is −π/2 to π/2"))
            }
            Attitude::SunOneAxis { axis_lvlh, zero_lvlh, limit_rad } => {
                direction("axis_lvlh", axis_lvlh)?;
                direction("zero_lvlh", zero_lvlh)?;
                let [axis, zero] = [axis_lvlh, zero_lvlh].map(|[x, y, z]| Vector::<Itrs>::new(x, y, z));
                if axis.cross(&zero).norm() <= SINGULAR * axis.norm() * zero.norm() {
                    return refuse(format!("zero_lvlh {zero_lvlh:?} lies along the axis {axis_lvlh:?}"));
                }
                if !(limit_rad > 0.0 && limit_rad <= PI) {
                    return refuse(format!("a limit of {limit_rad} rad; accepted is above 0, at most π"));
                }
                Ok(())
            }
            Attitude::SunTwoAxes { azimuth_limit_rad, elevation_rad: [low, high] } => {
                if !(0.0..=PI).contains(&azimuth_limit_rad) {
                    return refuse(format!("an azimuth limit of {azimuth_limit_rad} rad; accepted is 0 to π"));
                }
                if !(-FRAC_PI_2 <= low && low <= high && high <= FRAC_PI_2) {
                    return refuse(format!("elevations [{low}, {high}] rad; accepted is −π/2 to π/2, ascending"));
                }
                Ok(())
            }
            Attitude::Lvlh(v) => direction("lvlh", v),
            Attitude::Inertial { ra_rad, dec_rad } if !(ra_rad.is_finite() && dec_rad.abs() <= FRAC_PI_2) => {
                refuse(format!("right ascension {ra_rad} rad, declination {dec_rad} rad; accepted is −π/2 to π/2"))
            }
            Attitude::Fixed(v) => direction("the normal", v.to_array()),
            _ => Ok(()),
        }
    }
}

impl From<&config::Attitude> for Attitude {
    fn from(attitude: &config::Attitude) -> Self {
        match *attitude {
            config::Attitude::Nadir => Attitude::Nadir,
            config::Attitude::Sun => Attitude::Sun,
            config::Attitude::SunOffset { offset_deg } => Attitude::SunOffset { offset_rad: offset_deg.to_radians() },
            config::Attitude::SunAzimuth => Attitude::SunAzimuth,
            config::Attitude::SunToNadir => Attitude::SunToNadir,
            config::Attitude::SunOneAxis { axis_lvlh, zero_lvlh, limit_deg } => {
                Attitude::SunOneAxis { axis_lvlh, zero_lvlh, limit_rad: limit_deg.to_radians() }
            }
            config::Attitude::SunTwoAxes { azimuth_limit_deg, elevation_deg } => Attitude::SunTwoAxes {
                azimuth_limit_rad: azimuth_limit_deg.to_radians(),
                elevation_rad: elevation_deg.map(f64::to_radians),
            },
            config::Attitude::Lvlh(direction) => Attitude::Lvlh(direction),
            config::Attitude::Inertial { ra_deg, dec_deg } => {
                Attitude::Inertial { ra_rad: ra_deg.to_radians(), dec_rad: dec_deg.to_radians() }
            }
        }
    }
}

/// Local vertical, local horizontal: unit axes along the Earth-fixed ones.
struct Lvlh {
    x: Vector<Itrs>,
    y: Vector<Itrs>,
    z: Vector<Itrs>,
}

impl Lvlh {
    /// `z = −r̂, y = −(r × v)^, x = y × z` with the inertial velocity; `None` when r and v span no plane.
    fn of(scene: &Scene) -> Option<Self> {
        let z = (-scene.satellite_km).unit()?;
        let y = (scene.velocity_km_s.unit()?).cross(&scene.satellite_km.unit()?);
        let y = if y.norm() > SINGULAR { y.unit()? } else { return None };
        Some(Self { x: y.cross(&z), y, z })
    }

    /// The unit vector of LVLH components.
    fn point(&self, [x, y, z]: [f64; 3]) -> Option<Vector<Itrs>> {
        (self.x * x + self.y * y + self.z * z).unit()
    }
}

/// The normal on the circle about `axis` that is nearest to the Sun within the limit.
///
/// `n(θ) = z cosθ + (a × z) sinθ`, `n·s = |s_⊥| cos(θ − θ*)`, largest at `θ* = atan2((a × z)·s, z·s)`; beyond the limit
/// it is largest at the nearer one, at θ* = ±π that of the sign of θ*.
fn one_axis(axis: &Vector<Itrs>, zero: &Vector<Itrs>, limit_rad: f64, sun: &Vector<Itrs>) -> Option<Vector<Itrs>> {
    let zero = (*zero - *axis * axis.dot(zero)).unit()?;
    let quarter = axis.cross(&zero);
    let (along_zero, along_quarter) = (zero.dot(sun), quarter.dot(sun));
    if along_zero.hypot(along_quarter) <= SINGULAR {
        return Some(zero);
    }
    let turn = along_quarter.atan2(along_zero).max(-limit_rad).min(limit_rad);
    (zero * turn.cos() + quarter * turn.sin()).unit()
}

/// The normal nearest to the Sun within limits of azimuth about up and elevation.
///
/// `n·s = cos e cos e_s cos(a − a_s) + sin e sin e_s`: for every e the nearest azimuth is best, and there
/// `n·s ∝ cos(e − e*)` with `e* = atan2(sin e_s, cos e_s cos(a − a_s))`, so that beyond a limit the better limit is
/// taken.
fn two_axes(lvlh: &Lvlh, azimuth_limit_rad: f64, [low, high]: [f64; 2], sun: &Vector<Itrs>) -> Option<Vector<Itrs>> {
    let (forward, side, up) = (lvlh.x.dot(sun), lvlh.y.dot(sun), -lvlh.z.dot(sun));
    let level = forward.hypot(side);
    let azimuth_of_sun = if level > SINGULAR { side.atan2(forward) } else { 0.0 };
    let azimuth = azimuth_of_sun.max(-azimuth_limit_rad).min(azimuth_limit_rad);
    let best = up.atan2(level * (azimuth - azimuth_of_sun).cos());
    let elevation = if (low..=high).contains(&best) {
        best
    } else if (best - low).cos() > (best - high).cos() {
        low
    } else {
        high
    };
    let level_normal = lvlh.x * azimuth.cos() + lvlh.y * azimuth.sin();
    (level_normal * elevation.cos() + -lvlh.z * elevation.sin()).unit()
}
