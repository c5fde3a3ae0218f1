//! One surface in a geometry stated number by number: its direct and its Earth-reflected flux per unit irradiance.
//!
//! For cross-checks with other software, so the conventions are fixed: a point source at infinity, a sphere of
//! 6378.000 km, a cylinder for its shadow, one side of one flat surface. Lengths in km, area in m², flux in W/m² per
//! W/m². Left out: everything a mode could change (discs, penumbra, distances, air).

mod everything;
mod row;

use std::borrow::Cow;
use std::f64::consts::PI;
use std::sync::LazyLock;

use super::brdf::Brdf;
use super::earthshine::{Accuracy, PreparedBrdf};
use super::ground::Ground;
use crate::base::vector::{Itrs, Vector};

pub use everything::everything;
pub use row::{COLUMNS, Header, Row, read_row};

/// Radius of the sphere \[km\].
pub const RADIUS_KM: f64 = 6378.0;
/// Nodes after which one integral stops; `warn` then says that the tolerance was not reached.
const MAX_NODES: usize = 1_000_000;
/// Rounding of what needs no quadrature, relative.
const ROUNDING: f64 = 1e-14;

/// How the surface scatters.
#[derive(Debug, Clone, PartialEq)]
pub enum Scattering {
    /// By a finite f.
    Law(Brdf),
    /// As a mirror that shows the source's disc.
    Mirror {
        /// Share reflected.
        reflectance: f64,
        /// Half angle of the source's disc \[rad\].
        disc_rad: f64,
    },
}

/// One geometry, in the frame with z through the satellite, y towards the source, x = y × z.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// Height of the satellite above the sphere \[km\].
    pub height_km: f64,
    /// Elevation E of the source at the sub-satellite point \[rad\]; the source is at (0, cos E, sin E).
    pub elevation_rad: f64,
    /// The observer, from the centre of the sphere \[km\].
    pub observer_km: Vector<Itrs>,
    /// Unit normal of the surface.
    pub normal: Vector<Itrs>,
    /// Its area \[m²\].
    pub area_m2: f64,
    /// How it scatters.
    pub scattering: Scattering,
    /// How the ground scatters.
    pub earth: Brdf,
}

/// Flux at the observer per unit irradiance of the source \[W/m² per W/m²\].
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Fluxes {
    /// From the source by way of the surface.
    pub direct: f64,
    /// From the source by way of the ground and the surface.
    pub earth: f64,
    /// Estimated error of `earth`.
    pub earth_err: f64,
    /// Nodes the integral took; 0 where none was needed.
    pub nodes: usize,
    /// Why a flux is zero, or what was left out.
    pub skipped: Vec<&'static str>,
    /// The integral stopped before the tolerance was met.
    pub short_of_tolerance: bool,
}

/// Source, satellite and observer as unit vectors, and what both fluxes share.
struct Sight<'a> {
    case: &'a Case,
    satellite_km: Vector<Itrs>,
    source: Vector<Itrs>,
    observer: Vector<Itrs>,
    /// A (n·o)/d².
    spread: f64,
}

/// The law ready for integrals; those known by name, which are costly to make ready, once and for all.
fn prepared(brdf: &Brdf) -> Cow<'static, PreparedBrdf> {
    static KNOWN: LazyLock<Vec<(Brdf, PreparedBrdf)>> = LazyLock::new(|| {
        let laws = row::STARLINK.iter().filter_map(|(_, name)| Brdf::named(name).ok());
        laws.map(|law| (law.clone(), PreparedBrdf::new(&law))).collect()
    });
    match brdf {
        Brdf::Binomial(_) => KNOWN
            .iter()
            .find(|(law, _)| law == brdf)
            .map_or_else(|| Cow::Owned(PreparedBrdf::new(brdf)), |(_, ready)| Cow::Borrowed(ready)),
        _ => Cow::Owned(PreparedBrdf::new(brdf)),
    }
}

/// The two fluxes of a case; the Earth-reflected one to the relative `tolerance`.
///
/// `None` where the observer is at the satellite.
///
/// Rules: both are 0 for an observer with `z < R²/(R+h)` (the satellite is below the horizon); direct is 0 for
/// `E < −arccos(R/(R+h))` (in the cylinder of the shadow).
#[must_use]
pub fn explicit(case: &Case, tolerance: f64) -> Option<Fluxes> {
    let mut answer = Fluxes::default();
    let r_km = RADIUS_KM + case.height_km;
    let satellite_km = Vector::new(0.0, 0.0, r_km);
    let line = case.observer_km - satellite_km;
    let observer = line.unit()?;
    if case.observer_km.z() < RADIUS_KM * RADIUS_KM / r_km {
        answer.skipped.push("observer below the horizon");
        return Some(answer);
    }
    let cos_o = case.normal.dot(&observer);
    if cos_o <= 0.0 {
        answer.skipped.push("surface faces away from the observer");
        return Some(answer);
    }
    let (sin_e, cos_e) = case.elevation_rad.sin_cos();
    let range_m = line.norm() * 1e3;
    let spread = case.area_m2 * cos_o / (range_m * range_m);
    let sight = Sight { case, satellite_km, source: Vector::new(0.0, cos_e, sin_e), observer, spread };
    sight.direct(&mut answer);
    sight.by_the_ground(tolerance, &mut answer);
    Some(answer)
}

impl Sight<'_> {
    /// `A f(s, n, o) (n·s)₊ (n·o)₊ / d²`; a mirror shows the disc whole or not:
    /// `ρ A (n·o) / (d² 2π(1 − cos α))` for an angle of at most α between the mirrored observer and the source.
    fn direct(&self, answer: &mut Fluxes) {
        let normal = &self.case.normal;
        let cos_s = normal.dot(&self.source);
        // arccos(R/(R+h)) = 2 arcsin sqrt(h/(2(R+h))), which keeps its digits for low satellites
        let dip_rad = 2.0 * (0.5 * self.case.height_km / self.satellite_km.z()).sqrt().asin();
        if self.case.elevation_rad < -dip_rad {
            answer.skipped.push("direct: umbra");
        } else if cos_s <= 0.0 {
            answer.skipped.push("direct: surface faces away from the source");
        } else {
            match &self.case.scattering {
                Scattering::Law(brdf) => {
                    answer.direct = self.spread * cos_s * brdf.value(&self.source, normal, &self.observer);
                    if answer.direct == 0.0 {
                        answer.skipped.push("direct: no light scattered this way");
                    }
                }
                Scattering::Mirror { reflectance, disc_rad } => {
                    if self.mirrored().angle_to(&self.source) <= *disc_rad {
                        // 1 − cos α = 2 sin²(α/2)
                        let disc_sr = 4.0 * PI * (0.5 * disc_rad).sin().powi(2);
                        answer.direct = self.spread * reflectance / disc_sr;
                    } else {
                        answer.skipped.push("direct: source not seen in the mirror");
                    }
                }
            }
        }
    }

    /// `A (n·o)₊/d² ∫ f_E (p·s)₊ (p·u)₊ f(−u, n, o) (n·(−u))₊ R²dΩ/D²` over the lit ground in view.
    fn by_the_ground(&self, tolerance: f64, answer: &mut Fluxes) {
        let case = self.case;
        let ground = Ground::new(&self.satellite_km, RADIUS_KM, &self.source, &case.earth);
        let Some(ground) = ground.filter(Ground::lit_in_view) else {
            answer.skipped.push("earth: no lit ground in view");
            return;
        };
        if !ground.seen_by(&case.normal) {
            answer.skipped.push("earth: surface sees no ground");
            return;
        }
        match &case.scattering {
            Scattering::Law(brdf) => {
                let accuracy = Accuracy::relative(tolerance, MAX_NODES);
                let light = prepared(brdf).reflected(&ground, &case.normal, &self.observer, &accuracy);
                answer.earth = self.spread * light.per_sr;
                answer.earth_err = self.spread * light.err_per_sr;
                answer.nodes = light.nodes;
                answer.short_of_tolerance = light.err_per_sr > tolerance * light.per_sr && light.nodes >= MAX_NODES;
                if light.per_sr == 0.0 {
                    answer.skipped.push("earth: surface sees no lit ground");
                }
            }
            Scattering::Mirror { reflectance, .. } => match self.ground_in_the_mirror() {
                Some((per_sr, steepest)) => {
                    answer.earth = self.spread * reflectance * per_sr;
                    // near the terminator p·s is a small difference
                    answer.earth_err = ROUNDING * self.spread * reflectance * steepest;
                }
                None => answer.skipped.push("earth: no lit ground in the mirror"),
            },
        }
    }

    /// m = 2 (n·o) n − o, the direction the observer sees in the surface as a mirror.
    fn mirrored(&self) -> Vector<Itrs> {
        self.case.normal * (2.0 * self.case.normal.dot(&self.observer)) - self.observer
    }

    /// Radiance per unit irradiance of the ground that m meets, `L = f_E(s, p, −m) (p·s)₊` \[1/sr\]: radiance is
    /// conserved, so no quadrature is needed. Beside it f_E, the slope of L in p·s.
    fn ground_in_the_mirror(&self) -> Option<(f64, f64)> {
        let m = self.mirrored();
        let r_km = self.satellite_km.z();
        // |S + t m|² = R², the nearer of the two roots: t = −b − sqrt(b² − (r² − R²)) = (r² − R²)/(−b + sqrt(…))
        let b = r_km * m.z();
        let depth = self.case.height_km * (r_km + RADIUS_KM);
        let under_root = b * b - depth;
        if b >= 0.0 || under_root <= 0.0 {
            return None;
        }
        let reach_km = depth / (-b + under_root.sqrt());
        let place = (self.satellite_km + m * reach_km).unit()?;
        let height = place.dot(&self.source);
        let f = if height > 0.0 { self.case.earth.value(&self.source, &place, &-m) } else { 0.0 };
        (f * height > 0.0).then_some((f * height, f))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn case(scattering: Scattering) -> Case {
        Case {
            height_km: 550.0,
            elevation_rad: 0.5,
            observer_km: Vector::new(0.0, 0.0, RADIUS_KM),
            normal: Vector::new(0.0, 0.0, -1.0),
            area_m2: 2.0,
            scattering,
            earth: Brdf::Lambert { albedo: 0.3 },
        }
    }

    #[test]
    fn a_mirror_is_the_limit_of_a_gaussian_lobe_of_the_same_reflectance() {
        let mirror = explicit(&case(Scattering::Mirror { reflectance: 0.8, disc_rad: 0.005 }), 1e-8).unwrap();
        // ∫ A exp((c − 1)/σ) dω = 2πσA for σ → 0; relative deviation of the order of σ
        let sigma = 1e-6;
        let lobe = Brdf::Gaussian { peak_per_sr: 0.8 / (2.0 * PI * sigma), sigma };
        let narrow = explicit(&case(Scattering::Law(lobe)), 1e-6).unwrap();
        assert!(mirror.earth > 0.0 && (narrow.earth / mirror.earth - 1.0).abs() < 2e-5, "{narrow:?} {mirror:?}");
        assert_eq!((mirror.nodes, mirror.direct), (0, 0.0));
    }

    #[test]
    fn the_mirror_shows_the_disc_to_its_edge_and_not_beyond() {
        let tilt = |off_rad: f64| {
            let mut c = case(Scattering::Mirror { reflectance: 1.0, disc_rad: 0.01 });
            let (sin_e, cos_e) = c.elevation_rad.sin_cos();
            let half = (Vector::<Itrs>::new(0.0, cos_e, sin_e) + Vector::new(0.0, 0.0, -1.0)).unit().unwrap();
            // turning the normal by δ turns the mirrored direction by 2δ
            c.normal = (half + Vector::new(1.0, 0.0, 0.0) * off_rad.tan()).unit().unwrap();
            explicit(&c, 1e-4).unwrap().direct
        };
        assert!(tilt(0.0) > 0.0 && tilt(0.0049) > 0.0);
        assert_eq!(tilt(0.0051 / half_angle()), 0.0);
    }

    /// Turning out of the plane of source and observer moves the mirrored direction less than twice as much.
    fn half_angle() -> f64 {
        ((0.5 + PI / 2.0) / 2.0).cos()
    }

    #[test]
    fn the_shadow_begins_at_the_dip_of_the_horizon_and_the_observer_ends_at_his_own() {
        let lit = |elevation_rad: f64| {
            let mut c = case(Scattering::Law(Brdf::Lambert { albedo: 1.0 }));
            c.normal = Vector::new(0.0, 0.8, -0.6);
            c.elevation_rad = elevation_rad;
            explicit(&c, 1e-4).unwrap()
        };
        let dip = (RADIUS_KM / (RADIUS_KM + 550.0)).acos();
        assert!(lit(-dip + 1e-9).direct > 0.0);
        let dark = lit(-dip - 1e-9);
        assert_eq!((dark.direct, dark.earth), (0.0, 0.0));
        assert_eq!(dark.skipped, ["direct: umbra", "earth: no lit ground in view"]);

        let mut c = case(Scattering::Law(Brdf::Lambert { albedo: 1.0 }));
        for (nudge_rad, seen) in [(-1e-6, true), (1e-6, false)] {
            let (s, k) = (dip + nudge_rad).sin_cos();
            c.observer_km = Vector::new(0.0, s * RADIUS_KM, k * RADIUS_KM);
            let at = explicit(&c, 1e-4).unwrap();
            assert_eq!(at.earth > 0.0, seen, "{at:?}");
        }
    }
}
