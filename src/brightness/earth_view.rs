//! The Earth under one light source as a picture: radiance towards a viewpoint, pixels of equal solid angle, north up,
//! east right.
//!
//! W m⁻² sr⁻¹ in a band, km, rad. The engine's sphere under its light sources, and its scattering law; excluded:
//! clouds, land and sea, the air's own light, twilight, the Moon's colour (light has that of the Sun).

use ndarray::{Array2, Axis};
use rayon::prelude::*;

use super::brdf::Brdf;
use super::ground::Ground;
use super::light_sources::{NearMoon, SourceSettings, moonlight, sunlight};
use super::scene::{impossible, local_radius_km};
use crate::base::constants::AU_KM;
use crate::base::error::Result;
use crate::base::vector::{Enu, Itrs, Vector};
use crate::orbit::Site;

/// Room around the disc, as a share of its radius.
const MARGIN: f64 = 0.04;
/// Most pixels along a side.
const MAX_SIDE: usize = 8_192;

/// Which light source lights the Earth.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EarthLightSource {
    /// The Sun.
    Sun,
    /// The Moon.
    Moon,
}

impl EarthLightSource {
    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            EarthLightSource::Sun => "Sun",
            EarthLightSource::Moon => "Moon",
        }
    }

    /// Irradiance at a place, from the Earth's centre \[km\], across the beam \[W m⁻²\] in a band in which the Sun at 1
    /// au has `sun_w_m2`, and whether the lunar law was stretched. Ratios are those of the band of `light_sources`.
    #[must_use]
    pub fn irradiance_w_m2(
        self,
        place_km: &Vector<Itrs>,
        sun_km: &Vector<Itrs>,
        moon_km: &Vector<Itrs>,
        light_sources: &SourceSettings,
        sun_w_m2: f64,
    ) -> (f64, bool) {
        let light = match self {
            EarthLightSource::Sun => sunlight(sun_km.norm(), light_sources),
            EarthLightSource::Moon => moonlight(place_km, moon_km, sun_km, light_sources),
        };
        (sun_w_m2 * light.flux / sunlight(AU_KM, light_sources).flux, light.extrapolated)
    }
}

/// Somebody above the Earth who looks straight down.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Viewpoint {
    /// Place \[km\].
    pub position_km: Vector<Itrs>,
    /// Radius of the sphere that is seen \[km\]: the ellipsoid's under the place.
    pub radius_km: f64,
    east: Vector<Itrs>,
    north: Vector<Itrs>,
    up: Vector<Itrs>,
}

/// A picture of the Earth.
#[derive(Debug, Clone, PartialEq)]
pub struct EarthPicture {
    /// From where.
    pub view: Viewpoint,
    /// Mean radiance of each pixel \[W m⁻² sr⁻¹\]: `[y, x]`, y to the north, x to the east; 0 in the dark and beyond
    /// the limb.
    pub radiance: Array2<f64>,
    /// Half the side of the picture in the projection's unit, `2 sin(η/2)` with η the angle from nadir.
    pub half_side: f64,
}

impl Viewpoint {
    /// From geodetic longitude and latitude \[deg\] and the height above the ellipsoid \[km\].
    ///
    /// # Errors
    /// [`crate::Error::Config`] for a place that is not on the Earth; [`crate::Error::Model`] for a height that is not
    /// from 10 km to 1e9 km.
    pub fn new(lon_deg: f64, lat_deg: f64, height_km: f64) -> Result<Self> {
        if !(10.0..=1e9).contains(&height_km) {
            return Err(impossible(format!("the viewpoint is {height_km} km high; accepted is 10 to 1e9 km")));
        }
        let site = Site::new(lat_deg, lon_deg, 0.0)?;
        let plumb = site.from_enu(&Vector::<Enu>::new(0.0, 0.0, 1.0));
        let position_km = site.position() + plumb * height_km;
        let up = position_km.unit().unwrap_or(plumb);
        // the site's east is at right angles to the axis and to up, also at the poles
        let east = site.from_enu(&Vector::<Enu>::new(1.0, 0.0, 0.0));
        Ok(Self { position_km, radius_km: local_radius_km(&position_km), east, north: up.cross(&east), up })
    }

    /// Angle from nadir to the limb \[rad\].
    #[must_use]
    pub fn limb_rad(&self) -> f64 {
        (self.radius_km / self.position_km.norm()).asin()
    }

    /// Place of a direction from here in the picture, x to the east and y to the north: Lambert's azimuthal projection,
    /// `r = 2 sin(η/2)`, in which equal areas are equal solid angles.
    fn project(&self, direction: &Vector<Itrs>) -> (f64, f64) {
        let (e, n, d) = (direction.dot(&self.east), direction.dot(&self.north), -direction.dot(&self.up));
        let across = e.hypot(n);
        let r = 2.0 * (0.5 * across.atan2(d)).sin();
        if across > 0.0 { (r * e / across, r * n / across) } else { (0.0, 0.0) }
    }

    /// The direction of a place in the picture; `None` beyond the sphere of directions.
    fn direction(&self, x: f64, y: f64) -> Option<Vector<Itrs>> {
        let r = x.hypot(y);
        let eta = 2.0 * (0.5 * r).clamp(-1.0, 1.0).asin();
        if r > 2.0 {
            return None;
        }
        let (sin, cos) = eta.sin_cos();
        let across = if r > 0.0 { (self.east * x + self.north * y) * (sin / r) } else { Vector::new(0.0, 0.0, 0.0) };
        Some(across - self.up * cos)
    }

    /// Place in the picture of a point of the ground given by its geocentric direction; `None` where it is behind the
    /// limb.
    #[must_use]
    pub fn ground_point(&self, toward: &Vector<Itrs>) -> Option<(f64, f64)> {
        let p = toward.unit()?;
        let line = p * self.radius_km - self.position_km;
        // above its horizon: p·(v − R p) > 0
        (p.dot(&line) < 0.0).then(|| line.unit().map(|u| self.project(&u))).flatten()
    }
}

/// Draws the Earth lit from the geocentric direction `light_source` with `source_w_m2` (at the Earth's centre, where every place
/// sees a Moon of its own, `near`), as `n` by `n` pixels, each the mean of
/// `sub` by `sub` points.
///
/// `L = E f_E(s, p, −w) max(0, p·s)`.
///
/// # Errors
/// [`crate::Error::Model`] for a law that is not a reflector, an irradiance that is negative, and sizes out of range.
pub fn earth_picture(
    view: &Viewpoint,
    (light_source, near): (&Vector<Itrs>, Option<&NearMoon>),
    source_w_m2: f64,
    earth: &Brdf,
    (n, sub): (usize, usize),
) -> Result<EarthPicture> {
    earth.check("earth")?;
    if !((2..=MAX_SIDE).contains(&n) && (1..=64).contains(&sub)) {
        return Err(impossible(format!("{n} pixels of {sub} points a side; accepted are 2 to {MAX_SIDE}, 1 to 64")));
    }
    if !(source_w_m2 >= 0.0 && source_w_m2.is_finite()) {
        return Err(impossible(format!(
            "the irradiance of the light source is {source_w_m2} W/m2; it must be a non-negative number"
        )));
    }
    let ground = match near {
        Some(moon) => Ground::under_moon(&view.position_km, view.radius_km, moon, earth),
        None => Ground::new(&view.position_km, view.radius_km, light_source, earth),
    };
    let ground = ground
        .ok_or_else(|| impossible("the viewpoint is inside the Earth, or the light source has no direction".into()))?;
    let half_side = (1.0 + MARGIN) * 2.0 * (0.5 * view.limb_rad()).sin();
    let step = 2.0 * half_side / n as f64;
    let mut radiance = Array2::zeros((n, n));
    radiance.axis_iter_mut(Axis(0)).into_par_iter().enumerate().for_each(|(j, mut row)| {
        for (i, pixel) in row.iter_mut().enumerate() {
            let mut sum = 0.0;
            for k in 0..sub * sub {
                let at = |cell: usize, part: usize| (cell as f64 + (part as f64 + 0.5) / sub as f64) * step - half_side;
                if let Some(w) = view.direction(at(i, k % sub), at(j, k / sub)) {
                    sum += ground.radiance_from(&ground.local(&w));
                }
            }
            *pixel = source_w_m2 * sum / (sub * sub) as f64;
        }
    });
    Ok(EarthPicture { view: *view, radiance, half_side })
}

impl EarthPicture {
    /// Solid angle of a pixel \[sr\], the same for all.
    #[must_use]
    pub fn pixel_sr(&self) -> f64 {
        (2.0 * self.half_side / self.radiance.ncols() as f64).powi(2)
    }

    /// Irradiance of the whole Earth at the viewpoint, on a plane that faces each point of it \[W m⁻²\]: Σ L Δω.
    #[must_use]
    pub fn irradiance_w_m2(&self) -> f64 {
        self.radiance.sum() * self.pixel_sr()
    }

    /// Brightest pixel \[W m⁻² sr⁻¹\].
    #[must_use]
    pub fn brightest(&self) -> f64 {
        self.radiance.iter().copied().fold(0.0, f64::max)
    }

    /// Pixel coordinates (x to the right, y upwards, 0 in the lower left corner, in pixels) of a place of the
    /// projection.
    #[must_use]
    pub fn pixel_of(&self, (x, y): (f64, f64)) -> (f64, f64) {
        let scale = self.radiance.ncols() as f64 / (2.0 * self.half_side);
        ((x + self.half_side) * scale, (y + self.half_side) * scale)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    const LAMBERT: Brdf = Brdf::Lambert { albedo: 0.3 };

    #[test]
    fn from_far_away_the_earth_is_the_lambert_sphere_of_the_books() {
        // E/E_source = (2/3) ρ (R/d)² (sin α + (π − α) cos α)/π
        for alpha_deg in [0.0f64, 30.0, 90.0, 140.0] {
            let view = Viewpoint::new(20.0, 0.0, 3e7).unwrap();
            let a = alpha_deg.to_radians();
            let toward = view.position_km.unit().unwrap();
            let side = Vector::new(0.0, 0.0, 1.0);
            let light_source = toward * a.cos() + side * a.sin();
            let picture = earth_picture(&view, (&light_source, None), 1_361.0, &LAMBERT, (256, 4)).unwrap();
            let k = view.radius_km / view.position_km.norm();
            let expected = 1_361.0 * 2.0 / 3.0 * 0.3 * k * k * (a.sin() + (PI - a) * a.cos()) / PI;
            let ratio = picture.irradiance_w_m2() / expected;
            assert!((ratio - 1.0).abs() < 1e-3, "{alpha_deg}: {ratio}");
        }
    }

    #[test]
    fn under_the_light_source_the_ground_has_albedo_e_over_pi_and_behind_the_terminator_none() {
        let view = Viewpoint::new(100.0, 10.0, 35_786.0).unwrap();
        let light_source = view.up;
        let picture = earth_picture(&view, (&light_source, None), 3.0e-3, &LAMBERT, (301, 1)).unwrap();
        assert!((picture.radiance[[150, 150]] / (0.3 * 3.0e-3 / PI) - 1.0).abs() < 1e-4);
        // a light source in the east: its terminator passes through nadir, the west is dark, the east is lit
        let picture = earth_picture(&view, (&view.east, None), 1.0, &LAMBERT, (300, 1)).unwrap();
        assert_eq!(picture.radiance[[150, 149]], 0.0);
        assert!(picture.radiance[[150, 150]] > 0.0 && picture.radiance[[150, 100]] == 0.0);
        // beyond the limb there is nothing
        assert_eq!((picture.radiance[[0, 0]], picture.radiance[[299, 299]]), (0.0, 0.0));
    }

    #[test]
    fn ground_points_are_drawn_where_their_light_is_seen() {
        let view = Viewpoint::new(151.0, -33.0, 420.0).unwrap();
        let picture = earth_picture(&view, (&view.up, None), 1.0, &LAMBERT, (200, 2)).unwrap();
        let (x, y) = picture.pixel_of(view.ground_point(&view.position_km).unwrap());
        assert!((x - 100.0).abs() < 1e-9 && (y - 100.0).abs() < 1e-9);
        // north is up, east to the right, the antipode behind
        let north = view.ground_point(&(view.up + view.north * 0.1)).unwrap();
        let east = view.ground_point(&(view.up + view.east * 0.1)).unwrap();
        assert!(north.1 > 0.0 && north.0.abs() < 1e-12 && east.0 > 0.0 && east.1.abs() < 1e-12);
        assert!(view.ground_point(&-view.position_km).is_none());
        // the limb is where the ground's horizon passes through the viewpoint
        let limb = 2.0 * (0.5 * view.limb_rad()).sin();
        let seen = (0..9_000).filter_map(|i| {
            let t = f64::from(i) * 1e-4;
            view.ground_point(&(view.up * t.cos() + view.east * t.sin()))
        });
        let farthest = seen.map(|p| p.0).fold(0.0, f64::max);
        assert!((farthest / limb - 1.0).abs() < 1e-3, "{farthest} {limb}");
    }

    #[test]
    fn every_pixel_sees_the_same_solid_angle() {
        // an isotropic sphere of radiance 1 subtends 2π(1 − cos η): a Lambert ground under a light source in each
        // point's zenith cannot be had, so the law is evaluated by the picture's own area
        let view = Viewpoint::new(0.0, 90.0, 1_000.0).unwrap();
        let disc = PI * (2.0 * (0.5 * view.limb_rad()).sin()).powi(2);
        assert!((disc / (2.0 * PI * (1.0 - view.limb_rad().cos())) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn impossible_views_are_refused() {
        assert!(Viewpoint::new(0.0, 91.0, 400.0).is_err());
        assert!(Viewpoint::new(0.0, 0.0, -5.0).unwrap_err().to_string().contains("-5 km"));
        let view = Viewpoint::new(0.0, 0.0, 400.0).unwrap();
        let light_source = view.up;
        assert!(earth_picture(&view, (&light_source, None), f64::NAN, &LAMBERT, (100, 1)).is_err());
        assert!(earth_picture(&view, (&light_source, None), 1.0, &LAMBERT, (1, 1)).is_err());
        assert!(earth_picture(&view, (&light_source, None), 1.0, &Brdf::Lambert { albedo: 2.0 }, (100, 1)).is_err());
    }
}
