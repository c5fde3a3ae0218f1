//! Tracked frames with a satellite of components: rendered at mid-exposure, blurred, painted as bright as it was
//! rendered, but for the scenario's offset and scatter.
//!
//! Pixels and electrons, V through the scenario's own zeropoint. Not included: the turn within one exposure.

use ndarray::Array2;

use super::render::PixelPsf;
use super::scenario::PsfKind;
use crate::base::error::Result;
use crate::brightness::light_sources::mag_of_flux;
use crate::orbit::Geometry;
use crate::resolved::sensor::{Blur, Sampling, Seeing, Stamp, stamp};
use crate::resolved::{ComponentSatellite, Light, RadianceImage, RenderSettings, ResolvedScene, render};
use crate::tables::RenderedTruth;

/// Pixels along a side of a picture; finer than any seeing for a satellite up to a few arcminutes.
const PIXELS: usize = 192;
/// Directions that a sample traces towards Earth and sky.
const EARTH_RAYS: usize = 8;
/// Relative tolerance of the light by way of the Earth.
const TOLERANCE: f64 = 1e-3;

/// A satellite rendered for one frame.
pub struct RenderedSatellite {
    /// Its picture in V, all lights together.
    pub picture: RadianceImage,
    /// What goes to the table.
    pub truth: RenderedTruth,
}

/// Renders the satellite in a geometry.
///
/// # Errors
/// As [`render`].
pub fn rendered_satellite(satellite: &ComponentSatellite, geometry: &Geometry) -> Result<RenderedSatellite> {
    let mut settings = RenderSettings { pixels: PIXELS, earth_rays: EARTH_RAYS, ..RenderSettings::default() };
    settings.model.tolerance = TOLERANCE;
    let rendered = render(&ResolvedScene::of(satellite, geometry), &settings)?;
    let flux = |light: Light| rendered.v_flux.iter().filter(|(of, _)| *of == light).map(|(_, f)| f).sum::<f64>();
    // each light in V: the planes are of a wider band, in which the light sources differ in colour
    let mut sum = Array2::zeros((PIXELS, PIXELS));
    for (light, plane) in &rendered.image.planes {
        let all = plane.sum();
        if all > 0.0 {
            sum.scaled_add(flux(*light) / (all * rendered.image.pixel_sr()), plane);
        }
    }
    let v_mag = |light: Light| mag_of_flux(flux(light));
    let truth = RenderedTruth {
        frame: String::new(),
        rendered_v_mag: mag_of_flux(rendered.v_flux.iter().map(|(_, f)| f).sum()),
        sunlight_v_mag: v_mag(Light::Sun),
        earthshine_v_mag: v_mag(Light::Earthshine),
        moonlight_v_mag: v_mag(Light::Moon),
        lunar_earthshine_v_mag: v_mag(Light::LunarEarthshine),
        starlight_v_mag: v_mag(Light::Starlight),
        seen_area_m2: rendered.seen_area_m2,
        pixel_arcsec: rendered.image.pixel_rad.to_degrees() * 3_600.0,
        beside_frac: 0.0,
    };
    let planes = vec![(Light::Sun, sum)];
    Ok(RenderedSatellite { picture: RadianceImage { planes, ..rendered.image }, truth })
}

impl RenderedSatellite {
    /// The picture on the frame's pixels through the frame's air, smeared; its sum is 1. `None` without any light.
    ///
    /// # Errors
    /// As [`stamp`].
    pub fn on_frame(
        &self,
        psf: &PixelPsf,
        scale_arcsec: f64,
        centre_px: (f64, f64),
        smear_px: (f64, f64),
    ) -> Result<Option<Stamp>> {
        let fwhm_arcsec = psf.fwhm_px * scale_arcsec;
        let seeing = match psf.kind {
            PsfKind::Gaussian => Seeing::Gaussian { fwhm_arcsec },
            PsfKind::Moffat => Seeing::Moffat { fwhm_arcsec, beta: psf.beta },
        };
        let drift_arcsec = (smear_px.0 * scale_arcsec, smear_px.1 * scale_arcsec);
        let blur = Blur { seeing, pupil: None, jitter_arcsec: 0.0, drift_arcsec };
        let mut on = stamp(&self.picture, &blur, scale_arcsec, centre_px, &Sampling::default())?;
        let all: f64 = on.planes.iter().map(|(_, p)| p.sum()).sum();
        on.planes.iter_mut().for_each(|(_, p)| p.mapv_inplace(|v| v / all));
        Ok((all > 0.0).then_some(on))
    }
}

/// Share of the light in the brightest pixel of a stamp whose sum is 1.
pub fn peak_share(stamp: &Stamp) -> f64 {
    stamp.planes.iter().flat_map(|(_, p)| p.iter().copied()).fold(0.0, f64::max)
}
