//! One explicit case: directions, scattering, fluxes.

use crate::base::vector::Itrs;
use crate::base::vector::Vector;
use crate::brightness::brdf::Brdf;
use crate::brightness::earthshine::Accuracy;
use crate::brightness::earthshine::PreparedBrdf;
use crate::brightness::ground::Ground;
use std::borrow::Cow;
use std::f64::consts::PI;
use std::sync::LazyLock;

/// Radius of the sphere \[km\].
pub const RADIUS_KM: f64 = 6378.0;

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
    /// Why a flux is zero, or what was excluded.
    pub skipped: Vec<&'static str>,
    /// The integral stopped before the tolerance was met.
    pub short_of_tolerance: bool,
}

/// Source, satellite and observer as unit vectors, and what both fluxes share.
pub(super) struct Sight<'a> {
    pub(super) case: &'a Case,
    pub(super) satellite_km: Vector<Itrs>,
    pub(super) source: Vector<Itrs>,
    pub(super) observer: Vector<Itrs>,
    /// A (n·o)/d².
    pub(super) spread: f64,
}

impl Sight<'_> {
    /// `A f(s, n, o) (n·s)₊ (n·o)₊ / d²`; a mirror shows the disc whole or not:
    /// `ρ A (n·o) / (d² 2π(1 − cos α))` for an angle of at most α between the mirrored observer and the source.
    pub(super) fn direct(&self, answer: &mut Fluxes) {
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
    pub(super) fn by_the_ground(&self, tolerance: f64, answer: &mut Fluxes) {
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
    pub(super) fn mirrored(&self) -> Vector<Itrs> {
        self.case.normal * (2.0 * self.case.normal.dot(&self.observer)) - self.observer
    }

    /// Radiance per unit irradiance of the ground that m meets, `L = f_E(s, p, −m) (p·s)₊` \[1/sr\]: radiance is
    /// conserved, so no quadrature is needed. Next to it f_E, the slope of L in p·s.
    pub(super) fn ground_in_the_mirror(&self) -> Option<(f64, f64)> {
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

/// Nodes after which one integral stops; `warn` then says that the tolerance was not reached.
pub(super) const MAX_NODES: usize = 1_000_000;

/// Rounding of what needs no quadrature, relative.
pub(super) const ROUNDING: f64 = 1e-14;

/// The law ready for integrals; those known by name, which are costly to make ready, once and for all.
pub(super) fn prepared(brdf: &Brdf) -> Cow<'static, PreparedBrdf> {
    static KNOWN: LazyLock<Vec<(Brdf, PreparedBrdf)>> = LazyLock::new(|| {
        let laws = STARLINK.iter().filter_map(|(_, name)| Brdf::named(name).ok());
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

/// The measured laws: name in the column `brdf`, name in the program.
pub(crate) const STARLINK: [(&str, &str); 2] =
    [("binomial_starlink_v15_chassis", "starlink-chassis-lab"), ("binomial_starlink_v15_solar", "starlink-array-lab")];
