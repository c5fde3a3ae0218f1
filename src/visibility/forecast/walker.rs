//! Satellites placed evenly in shells of circular orbits (Walker's delta pattern): closed form, nothing is stored.
//!
//! km, km/s, rad, s after the start. Two bodies, and the drift of node and phase by the Earth's flattening (J2). Nodes
//! are counted from the equinox of date at the start. Not included: drag, station keeping, eccentricity, which
//! satellites fly.

use std::f64::consts::TAU;

use crate::base::constants::WGS84_A_KM;
use crate::base::error::{Error, Result};
use crate::base::vector::{Teme, Vector};
use crate::brightness::catalogue::Shell;
use crate::brightness::sky::GM_KM3_S2;

/// Second zonal harmonic of the Earth (WGS84).
const J2: f64 = 1.082_629_8e-3;
/// Mean motion of the Sun, which the node of a Sun-synchronous orbit follows \[rad/s\].
const SUN_RAD_S: f64 = 1.990_968_7e-7;
/// Satellites in a plane where nothing else is said: near the 22 of Starlink's shells.
const PER_PLANE: usize = 22;
/// Most satellites.
pub const MAX_SATELLITES: usize = 1_000_000_000;

/// Inclination of the circular orbit at a height \[km\] whose node follows the Sun \[rad\]: `cos i = −ω_Sun / (1.5 n J₂
/// (R/a)²)`. `None` where the flattening is too weak for any.
fn sun_synchronous_rad(height_km: f64) -> Option<f64> {
    let radius_km = WGS84_A_KM + height_km;
    let j2_rad_s = 1.5 * (GM_KM3_S2 / radius_km.powi(3)).sqrt() * J2 * (WGS84_A_KM / radius_km).powi(2);
    let cos_i = -SUN_RAD_S / j2_rad_s;
    (cos_i >= -1.0).then(|| cos_i.acos())
}

/// Where a pattern is wanted to differ from what its shells say.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Pattern {
    /// Height of all orbits \[km\].
    pub height_km: Option<f64>,
    /// Inclination of all orbits \[rad\]; needed where the shells have none.
    pub inclination_rad: Option<f64>,
    /// Planes of each shell.
    pub planes: Option<usize>,
    /// Phasing: neighbours' satellites are offset by F/N of a turn.
    pub phasing: usize,
}

/// One shell: planes even in node, satellites even in each plane.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Ring {
    height_km: [f64; 2],
    inclination: Option<f64>,
    planes: usize,
    phasing: usize,
    /// Satellites of the shell, and how many there are in the shells before.
    count: usize,
    before: usize,
    /// Planes in the shells before.
    planes_before: usize,
}

/// Many satellites, by number.
#[derive(Debug, Clone, PartialEq)]
pub struct Walker {
    rings: Vec<Ring>,
}

/// One plane at one moment.
#[derive(Debug, Clone, Copy)]
pub struct Plane {
    /// Numbers of its satellites.
    pub first: usize,
    /// How many.
    pub count: usize,
    /// Radius of the orbit \[km\].
    pub radius_km: f64,
    /// Speed \[km/s\].
    pub speed_km_s: f64,
    /// Towards the node, and a quarter turn on.
    pub axes: [Vector<Teme>; 2],
    /// Angle from the node of the first satellite \[rad\].
    phase_rad: f64,
}

impl Walker {
    /// `count` satellites in the shells of a catalogue's entry, divided evenly among them; heights of a range go up
    /// from plane to plane.
    ///
    /// # Errors
    /// [`Error::Config`] for no satellite or shell, a height at which nothing stays, an inclination that is not known.
    pub fn new(shells: &[Shell], count: usize, pattern: &Pattern) -> Result<Self> {
        let bad = |name: &str, problem: String| Error::Argument { name: name.into(), problem };
        if !(1..=MAX_SATELLITES).contains(&count) {
            return Err(bad("count", format!("{count} satellites; accepted is 1 to {MAX_SATELLITES}")));
        }
        let alone = [Shell {
            height_km: crate::brightness::catalogue::Span::One(pattern.height_km.unwrap_or(f64::NAN)),
            inclination_deg: None,
            kind: String::new(),
        }];
        // a height of one's own is one shell
        let shells = if pattern.height_km.is_some() { &alone[..] } else { shells };
        if shells.is_empty() {
            return Err(bad("height_km", "no orbit of this satellite is known; give height and inclination".into()));
        }
        let mut rings: Vec<Ring> = Vec::new();
        let (mut before, mut planes_before) = (0, 0);
        for (k, shell) in shells.iter().enumerate() {
            let height_km = shell.height_km.bounds();
            if !height_km.iter().all(|h| (100.0..=1e6).contains(h)) {
                return Err(bad("height_km", format!("{height_km:?} km; accepted is 100 to 1000000 km")));
            }
            let middle = shell.inclination_deg.map(|i| 0.5 * (i.bounds()[0] + i.bounds()[1])).map(f64::to_radians);
            let inclination = pattern.inclination_rad.or(middle);
            if inclination.is_none() && !shell.kind.to_ascii_lowercase().contains("sun-synchronous") {
                let problem = format!("the shell at {} km has none in the catalogue ({})", shell.height_km, shell.kind);
                return Err(bad("inclination_deg", problem));
            }
            if inclination.is_none()
                && let Some(high) = height_km.into_iter().find(|h| sun_synchronous_rad(*h).is_none())
            {
                let problem = format!(
                    "{high} km: no circular orbit above about 5970 km is Sun-synchronous; give argument `inclination_deg`"
                );
                return Err(bad("height_km", problem));
            }
            let own = (k + 1) * count / shells.len() - k * count / shells.len();
            let planes = pattern.planes.unwrap_or(own.div_ceil(PER_PLANE)).clamp(1, own.max(1));
            rings.push(Ring {
                height_km,
                inclination,
                planes,
                phasing: pattern.phasing,
                count: own,
                before,
                planes_before,
            });
            before += own;
            planes_before += planes;
        }
        Ok(Self { rings })
    }

    /// Planes of all shells.
    #[must_use]
    pub fn planes(&self) -> usize {
        self.rings.last().map_or(0, |r| r.planes_before + r.planes)
    }

    /// Satellites of all shells.
    #[must_use]
    pub fn len(&self) -> usize {
        self.rings.last().map_or(0, |r| r.before + r.count)
    }

    /// No satellite.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// A plane `t_s` after the start.
    ///
    /// `Ω = 2π j/P − 1.5 n J₂ (R/a)² cos i t`, `u = 2π (s/S + F j/N) + n [1 + 1.5 J₂ (R/a)² (3 − 4 sin² i)] t`.
    ///
    /// # Source
    /// Walker 1984, J. Br. Interplanet. Soc. 37, 559 (pattern); Kaula 1966, Theory of Satellite Geodesy (secular
    /// rates).
    #[must_use]
    pub fn plane(&self, number: usize, t_s: f64) -> Option<Plane> {
        let at = self.rings.partition_point(|r| r.planes_before <= number).checked_sub(1)?;
        let ring = self.rings.get(at)?;
        let j = number - ring.planes_before;
        if j >= ring.planes {
            return None;
        }
        let first = j * ring.count / ring.planes;
        let count = (j + 1) * ring.count / ring.planes - first;
        let [low, high] = ring.height_km;
        let height_km = low + (high - low) * (j as f64 + 0.5) / ring.planes as f64;
        let radius_km = WGS84_A_KM + height_km;
        let n_rad_s = (GM_KM3_S2 / radius_km.powi(3)).sqrt();
        let j2_rad_s = 1.5 * n_rad_s * J2 * (WGS84_A_KM / radius_km).powi(2);
        let inclination = ring.inclination.or_else(|| sun_synchronous_rad(height_km))?;
        let (sin_i, cos_i) = inclination.sin_cos();
        let node = TAU * j as f64 / ring.planes as f64 - j2_rad_s * cos_i * t_s;
        let offset = (ring.phasing * j) as f64 / ring.count.max(1) as f64;
        let phase_rad = TAU * offset.fract() + (n_rad_s + j2_rad_s * (3.0 - 4.0 * sin_i * sin_i)) * t_s;
        let (sin_n, cos_n) = node.sin_cos();
        Some(Plane {
            first: ring.before + first,
            count,
            radius_km,
            speed_km_s: n_rad_s * radius_km,
            axes: [Vector::new(cos_n, sin_n, 0.0), Vector::new(-sin_n * cos_i, cos_n * cos_i, sin_i)],
            phase_rad: phase_rad % TAU,
        })
    }
}

impl Plane {
    /// Angle from the node of its k-th satellite: sine and cosine.
    #[must_use]
    pub fn argument(&self, k: usize) -> (f64, f64) {
        (self.phase_rad + TAU * k as f64 / self.count as f64).sin_cos()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brightness::catalogue::Span;

    fn shell(height_km: Span, inclination_deg: Option<f64>, kind: &str) -> Shell {
        Shell { height_km, inclination_deg: inclination_deg.map(Span::One), kind: kind.into() }
    }

    #[test]
    fn every_satellite_is_in_one_plane_on_its_sphere() {
        let shells =
            [shell(Span::One(550.0), Some(53.0), "a"), shell(Span::Range([500.0, 2000.0]), None, "Sun-synchronous")];
        let walker = Walker::new(&shells, 1001, &Pattern { phasing: 3, ..Pattern::default() }).unwrap();
        let mut seen = vec![0; walker.len()];
        for p in 0..walker.planes() {
            let plane = walker.plane(p, 12_345.0).unwrap();
            assert!(plane.axes[0].dot(&plane.axes[1]).abs() < 1e-15);
            assert!(plane.radius_km > WGS84_A_KM + 499.0 && plane.radius_km < WGS84_A_KM + 2001.0);
            (plane.first..plane.first + plane.count).for_each(|i| seen[i] += 1);
        }
        assert!(seen.len() == 1001 && seen.iter().all(|n| *n == 1));
        assert!(walker.plane(walker.planes(), 0.0).is_none());
    }

    #[test]
    fn a_sun_synchronous_node_follows_the_sun_and_the_stations_node_goes_back_five_degrees_a_day() {
        let day = 86_400.0;
        let drift_deg = |shell: Shell| {
            let walker = Walker::new(&[shell], 1, &Pattern::default()).unwrap();
            let node = |t| {
                let x = walker.plane(0, t).unwrap().axes[0];
                x.y().atan2(x.x()).to_degrees()
            };
            node(day) - node(0.0)
        };
        assert!((drift_deg(shell(Span::One(800.0), None, "Sun-synchronous")) - 0.9856).abs() < 1e-3);
        // the ISS of June 2025: -4.95 deg a day
        assert!((drift_deg(shell(Span::One(416.0), Some(51.64), "")) + 4.97).abs() < 0.05);
    }

    #[test]
    fn a_height_without_a_sun_synchronous_orbit_is_refused_and_not_made_retrograde() {
        // Vallado 2013, Fundamentals of Astrodynamics, section 11.4: 98.6 deg at 800 km; none above 5974 km
        assert!((sun_synchronous_rad(800.0).unwrap().to_degrees() - 98.6).abs() < 0.05);
        assert!(sun_synchronous_rad(5_950.0).is_some() && sun_synchronous_rad(6_000.0).is_none());
        let kind = [shell(Span::One(550.0), None, "Sun-synchronous")];
        let high = Pattern { height_km: Some(8_000.0), ..Pattern::default() };
        assert!(Walker::new(&kind, 10, &high).unwrap_err().to_string().contains("8000 km"));
        let inclined = Pattern { inclination_rad: Some(1.7), ..high };
        assert!(Walker::new(&kind, 10, &inclined).is_ok());
    }

    #[test]
    fn what_is_missing_is_requested() {
        let kind = [shell(Span::One(550.0), None, "several inclinations")];
        let refused = |pattern: &Pattern, count| Walker::new(&kind, count, pattern).unwrap_err().to_string();
        assert!(refused(&Pattern::default(), 10).contains("`inclination_deg`"));
        assert!(refused(&Pattern::default(), 0).contains("`count`"));
        let low = Pattern { height_km: Some(80.0), inclination_rad: Some(1.0), ..Pattern::default() };
        assert!(refused(&low, 10).contains("`height_km`"));
        assert!(Walker::new(&kind, 10, &Pattern { inclination_rad: Some(0.9), ..Pattern::default() }).is_ok());
    }
}
