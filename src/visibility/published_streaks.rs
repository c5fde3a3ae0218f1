//! The paper's satellites before a survey: area, height, magnitude, rate, and whether their trails are seen.
//!
//! m², km, mag, in the units of [`StreakRow`]. Magnitudes come from one surface brightness for all, from one magnitude
//! scaled with area, or from the model under a full Moon.

use crate::base::error::Result;
use crate::base::vector::Vector;
use crate::brightness::light_sources::{FULL_MOON_V_MAG, mag_of_flux};
use crate::brightness::sky::{Body, Sky, SkyGrid, sky_map};
use crate::brightness::{Attitude, Brdf, Catalogue, ModelSettings, Satellite, Surface, ToleranceOf};
use crate::config::{Distances, LunarEclipse, Mode};
use crate::tables::StreakRow;
use crate::visibility::simple::{Diameter, Panel, solid_angle_arcsec2};
use crate::visibility::streak::{
    Camera, Crossing, MEAN_RADIUS_KM, Trail, effective_surface_brightness, t_eff_simple_s, zenith_rate_rad_s,
};
use crate::visibility::survey::{LimitKind, Visit};

/// The eight satellites of the paper's figure.
pub const PAPER_SATELLITES: [&str; 8] =
    ["starlink-v1.5", "starlink-v2", "starlink-v3", "bluebird-fm1", "earendil-1", "starmind", "iss", "starcloud"];
/// The "average orbital altitude" of the ISS in the paper's example \[km\]; its printed ν needs 420.
const PAPER_ISS_HEIGHT_KM: f64 = 400.0;
/// The surface brightness the paper measures on the ISS, `12.02 + 2.5 lg Ω` at 400 km \[mag/arcsec²\].
pub const PAPER_MU: f64 = 19.65;
/// Standard deviations of every limit.
const SNR: f64 = 5.0;

/// Where the magnitude of a satellite comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Anchor {
    /// Stated \[mag\].
    Mag(f64),
    /// One surface brightness \[mag/arcsec²\]: `m = μ − 2.5 lg Ω`.
    Mu(f64),
    /// A magnitude scaled with the area alone: `m = mag − 2.5 lg(A/A₀)`.
    Area {
        /// Magnitude of the satellite scaled from.
        mag: f64,
        /// Its area \[m²\].
        area_m2: f64,
    },
    /// No light.
    Dark,
}

/// The choices of magnitude the paper's own numbers allow, with what each is.
pub const ANCHORS: [(&str, Anchor); 4] = [
    ("mu 19.65, measured on the ISS", Anchor::Mu(PAPER_MU)),
    ("mu 20.05, modelled peak of the ISS", Anchor::Mu(20.05)),
    ("20 mag for 22 m2, scaled by area", Anchor::Area { mag: 20.0, area_m2: 22.0 }),
    ("mu 17.7, two-plane model of the ISS", Anchor::Mu(17.7)),
];

/// One satellite in one place.
#[derive(Debug, Clone, PartialEq)]
pub struct Passing {
    /// Name.
    pub name: String,
    /// Area \[m²\].
    pub area_m2: f64,
    /// Height of the orbit \[km\], where it is known.
    pub height_km: Option<f64>,
    /// Observer to satellite \[km\].
    pub range_km: f64,
    /// Angular rate against the stars \[rad/s\].
    pub rate_rad_s: f64,
    /// Where the rate is from.
    pub rate_source: String,
}

impl Passing {
    /// In the zenith at a height, with the rate v/h of the paper.
    ///
    /// # Errors
    /// [`crate::Error::Model`] for a height that is not above 0.
    pub fn in_zenith(name: &str, area_m2: f64, height_km: f64) -> Result<Self> {
        Ok(Self {
            name: name.into(),
            area_m2,
            height_km: Some(height_km),
            range_km: height_km,
            rate_rad_s: zenith_rate_rad_s(height_km)?,
            rate_source: "zenith, v/h".into(),
        })
    }

    /// The satellites of the paper's figure in the zenith at the heights of the catalogue, the ISS at the paper's.
    ///
    /// # Errors
    /// [`crate::Error::Config`] only if the catalogue is damaged.
    pub fn of_the_paper() -> Result<Vec<Self>> {
        let catalogue = Catalogue::load(None)?;
        let one = |name: &&str| {
            let entry = catalogue.find(name)?;
            let [low, high] = entry.orbits.first().map_or([550.0, 550.0], |shell| shell.height_km.bounds());
            let height_km = if *name == "iss" { PAPER_ISS_HEIGHT_KM } else { 0.5 * (low + high) };
            Self::in_zenith(name, entry.area_m2(), height_km)
        };
        PAPER_SATELLITES.iter().map(one).collect()
    }

    /// Its magnitude by an anchor; `None` = no light.
    ///
    /// # Errors
    /// [`crate::Error::Model`] for an area or range that is not above 0.
    pub fn mag(&self, anchor: &Anchor) -> Result<Option<f64>> {
        let omega = solid_angle_arcsec2(self.area_m2, 1e3 * self.range_km, Diameter::Square)?;
        Ok(match *anchor {
            Anchor::Mag(mag) => Some(mag),
            Anchor::Mu(mu) => Some(mu - 2.5 * omega.log10()),
            Anchor::Area { mag, area_m2 } => Some(mag - 2.5 * (self.area_m2 / area_m2).log10()),
            Anchor::Dark => None,
        })
    }

    /// Its row before one visit of a survey. `colour_mag` is the band less V; saturation is that of one exposure.
    ///
    /// # Errors
    /// [`crate::Error::Model`] naming what is out of range.
    pub fn row(
        &self,
        (mag_source, anchor): (&str, &Anchor),
        camera: &Camera,
        visit: &Visit,
        colour_mag: f64,
    ) -> Result<StreakRow> {
        let mag = self.mag(anchor)?;
        let crossing =
            Crossing { area_m2: self.area_m2, range_m: 1e3 * self.range_km, rate_rad_s: self.rate_rad_s, mag };
        let trail = Trail::new(&crossing, camera)?;
        let limit = |kind| visit.limit_mag(kind, SNR);
        let (point, square) = (limit(LimitKind::Point)?, limit(LimitKind::SquareArcsec)?);
        let whole = limit(LimitKind::Trail(trail.solid_angle_arcsec2()))?;
        let in_band = trail.nu_corrected_mag_arcsec2.map(|nu| nu + colour_mag);
        let peak_pixel_e = mag
            .map(|m| {
                let e_per_s = visit.e_per_s(m + colour_mag);
                trail.peak_pixel_e(e_per_s, visit.survey.pix_arcsec, camera.fwhm_arcsec)
            })
            .transpose()?;
        let full = peak_pixel_e.map(|e| (e + visit.sky_e_px()) / visit.survey.full_well_e);
        Ok(StreakRow {
            object_name: self.name.clone(),
            mag_source: mag_source.into(),
            is_modelled: false,
            area_m2: self.area_m2,
            height_km: self.height_km,
            range_km: self.range_km,
            rate_deg_s: self.rate_rad_s.to_degrees(),
            rate_source: self.rate_source.clone(),
            v_mag: mag,
            mu_mag_arcsec2: trail.mu_mag_arcsec2,
            diameter_m: trail.diameter_m,
            satellite_arcsec: trail.satellite_arcsec,
            defocus_arcsec: trail.defocus_arcsec,
            fwhm_arcsec: camera.fwhm_arcsec,
            trail_width_arcsec: trail.width_arcsec,
            trail_length_arcsec: trail.length_arcsec,
            exptime_s: camera.exptime_s,
            in_field_s: trail.in_field_s,
            t_eff_s: trail.t_eff_s,
            t_eff_simple_s: self.height_km.map(|h| t_eff_simple_s(self.area_m2, h)).transpose()?,
            nu_published_mag_arcsec2: trail.nu_published_mag_arcsec2,
            nu_corrected_mag_arcsec2: trail.nu_corrected_mag_arcsec2,
            filter: visit.band.name.into(),
            colour_mag,
            limit_point_mag: point,
            limit_mag_arcsec2: square,
            limit_pixel_mag_arcsec2: limit(LimitKind::Pixel)?,
            limit_trail_mag_arcsec2: whole,
            detected_published: verdict(mag, trail.nu_published_mag_arcsec2, point),
            detected_corrected: verdict(mag, in_band, square),
            detected_trail: verdict(mag, in_band, whole),
            peak_pixel_e,
            peak_frac_sat: full,
            saturated: full.map_or("no light", |f| if f > 1.0 { "yes" } else { "no" }).into(),
        })
    }
}

/// `yes` or `no`; `no light` without a magnitude, `undefined` for a satellite that stands still, as published.
fn verdict(mag: Option<f64>, nu: Option<f64>, limit: f64) -> String {
    match (mag, nu) {
        (None, _) => "no light",
        (_, None) => "undefined",
        (_, Some(nu)) if nu <= limit => "yes",
        _ => "no",
    }
    .into()
}

/// Effective surface brightness against area for one surface brightness, at the two ends of a range of heights.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BandPoint {
    /// Area \[m²\].
    pub area_m2: f64,
    /// As published, at the lower and the upper height \[mag/arcsec²\].
    pub published: [f64; 2],
    /// Corrected.
    pub corrected: [f64; 2],
    /// 5 σ limit over the whole trail, in V as the curves are, at the lower height \[mag/arcsec²\].
    pub trail_limit: f64,
}

/// The bands of the figure: `areas_m2` in the zenith at two heights \[km\].
///
/// # Errors
/// [`crate::Error::Model`] naming what is out of range.
pub fn bands(
    mu: f64,
    areas_m2: &[f64],
    heights_km: [f64; 2],
    camera: &Camera,
    visit: &Visit,
    colour_mag: f64,
) -> Result<Vec<BandPoint>> {
    let one = |area_m2: &f64| {
        let mut point =
            BandPoint { area_m2: *area_m2, published: [0.0; 2], corrected: [0.0; 2], trail_limit: f64::NAN };
        for (k, height_km) in heights_km.into_iter().enumerate().rev() {
            let passing = Passing::in_zenith("", *area_m2, height_km)?;
            let mag = passing.mag(&Anchor::Mu(mu))?;
            let (range_m, rate_rad_s) = (1e3 * height_km, passing.rate_rad_s);
            let trail = Trail::new(&Crossing { area_m2: *area_m2, range_m, rate_rad_s, mag }, camera)?;
            let nu = |mode| {
                let rate = trail.rate_arcsec_s;
                mag.and_then(|m| effective_surface_brightness(m, trail.width_arcsec, rate, camera.exptime_s, mode))
            };
            point.published[k] = nu(Mode::AsPublished).unwrap_or(f64::NAN);
            point.corrected[k] = nu(Mode::Corrected).unwrap_or(f64::NAN);
            point.trail_limit = visit.limit_mag(LimitKind::Trail(trail.solid_angle_arcsec2()), SNR)? - colour_mag;
        }
        Ok(point)
    };
    areas_m2.iter().map(one).collect()
}

/// The median over the sky of a satellite's surface brightness by the model, under a full Moon 45° high
/// \[mag/arcsec²\].
///
/// All of its area over the range squared is its solid angle, as [`Anchor::Mu`] has it; equal areas of sky. Sun 50°
/// down on the other side (phase 5°), corrected effects, the Earth 6371 km. `None` without light in any direction.
///
/// # Errors
/// Those of [`sky_map`].
pub fn model_mu(satellite: &Satellite, height_km: f64) -> Result<Option<f64>> {
    let axes = [Vector::new(1.0, 0.0, 0.0), Vector::new(0.0, 1.0, 0.0), Vector::new(0.0, 0.0, 1.0)];
    let (sun, moon) = (Body::sun((-50f64).to_radians(), 0.0), Body::moon(45f64.to_radians(), std::f64::consts::PI));
    let sky = Sky::new(axes, (MEAN_RADIUS_KM, height_km), 0.5, sun, Some(moon))?;
    let grid = SkyGrid::new(19, 25)?;
    let settings = ModelSettings { tolerance_of: ToleranceOf::Total, ..ModelSettings::new(Mode::Corrected, 1e-3) };
    let map = sky_map(&sky, &grid, satellite, &settings, &|| ())?;
    let area_m2: f64 = satellite.surfaces.iter().map(|s| s.area_m2).sum();
    let mut lit = Vec::new();
    for (point, weight) in map.points.iter().zip(grid.weights(true)) {
        if point.flux() > 0.0 {
            // flux over solid angle: its magnitude is the surface brightness
            let omega = solid_angle_arcsec2(area_m2, 1e3 * point.range_km, Diameter::Square)?;
            lit.push((point.flux() / omega, weight));
        }
    }
    lit.sort_by(|a, b| b.0.total_cmp(&a.0));
    let half = 0.5 * lit.iter().map(|(_, w)| w).sum::<f64>();
    let mut sum = 0.0;
    let median = lit.iter().find(|(_, w)| {
        sum += w;
        sum >= half
    });
    Ok(median.and_then(|(flux, _)| mag_of_flux(*flux)))
}

/// V of the simple model's panel by Lunar-Earthshine, with the whole model: facing nadir over the observer, a Moon of
/// `moon_mag` at the panel's light source altitude; `None` without any.
///
/// Direct moonlight is excluded; the ground is the model's, the Earth 6371 km.
///
/// # Errors
/// Those of [`Panel::check`] and of the model.
pub fn nadir_panel_mag(panel: &Panel, moon_mag: f64) -> Result<Option<f64>> {
    panel.check()?;
    let plate = Surface {
        name: "panel".into(),
        area_m2: panel.area_m2,
        attitude: Attitude::Nadir,
        brdf: Brdf::Lambert { albedo: panel.albedo },
        back: None,
    };
    let axes = [Vector::new(1.0, 0.0, 0.0), Vector::new(0.0, 1.0, 0.0), Vector::new(0.0, 0.0, 1.0)];
    let (alt, az) = (panel.source_alt_rad, std::f64::consts::PI);
    let sky =
        Sky::new(axes, (MEAN_RADIUS_KM, 1e-3 * panel.range_m), 0.5, Body::sun(-alt, 0.0), Some(Body::moon(alt, az)))?;
    let mut settings = ModelSettings { sun: false, ..ModelSettings::new(Mode::Corrected, 1e-4) };
    // the Sun only says how full the Moon is
    settings.effects.lunar_eclipse = LunarEclipse::Ignored;
    settings.effects.distances = Distances::Ignored;
    let model = sky.model(&Satellite::of("panel", vec![plate]), &settings)?;
    let light = model.brightness(&sky.scene(std::f64::consts::FRAC_PI_2, 0.0))?.lunar_earthshine;
    // the scene's Moon is full; another is as much fainter
    Ok(light.v_mag.map(|v| v + moon_mag - FULL_MOON_V_MAG))
}
