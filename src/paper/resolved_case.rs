//! The published simulation of the resolved ISS next to ours: radiances of three test points, irradiance, magnitudes.
//!
//! W m⁻² sr⁻¹ and W cm⁻² in 0.3 to 1.05 µm. The paper's picture is of 9 June 2025, 10:33 UTC, above Sydney; its
//! radiances are per cm², whatever the table says, and are shown as such. Each of ours is computed again.

use super::context::Context;
use crate::base::error::{Error, Result};
use crate::base::time::parse_utc;
use crate::brightness::Brdf;
use crate::brightness::light_sources::mag_of_flux;
use crate::resolved::settings::PAPER_EARTH_W_CM2_SR_UM;
use crate::resolved::{ComponentSatellite, Light, RenderSettings, Renderer, ResolvedScene};

/// Culmination of the pass simulated.
pub const PASS_UTC: &str = "2025-06-09T10:33:12";
/// Irradiance of magnitude 0 in the paper \[W cm⁻²\].
const VEGA_W_CM2: f64 = 2.04e-12;
/// Square centimetres in a square metre.
const CM2: f64 = 1e4;

/// Starlight; with moonlight; with Lunar-Earthshine.
pub type Steps = [f64; 3];

/// The printed table, its radiances as printed \[W cm⁻² sr⁻¹ in truth\].
const PRINTED: [(&str, Steps); 5] = [
    ("panel", [1.48e-12, 1.48e-12, 1.38e-10]),
    ("body1", [1.63e-11, 1.35e-8, 1.54e-8]),
    ("body2", [2.36e-11, 2.36e-11, 4.82e-9]),
    ("irradiance", [2.87e-20, 8.45e-18, 1.31e-17]),
    ("magnitude", [19.63, 13.46, 12.98]),
];

/// One quantity, as printed and as computed here.
#[derive(Debug, Clone, PartialEq)]
pub struct CaseRow {
    /// `panel`, `body1`, `body2` \[W m⁻² sr⁻¹\], `irradiance` \[W cm⁻²\], `magnitude` (that of the paper, broad band
    /// over its Vega), `v_mag`.
    pub quantity: &'static str,
    /// Whose: `printed`, `printed, in W/m2` (its radiances per cm² as they must be), or the ground of ours.
    pub of: String,
    /// Starlight; with moonlight; with Lunar-Earthshine. `None` = not printed, or no light.
    pub steps: [Option<f64>; 3],
}

/// The case: rows by quantity, and what must be said of them.
///
/// # Errors
/// Those of the renderer; [`Error::Model`] if the embedded elements or components are damaged.
pub fn resolved_case(settings: &RenderSettings) -> Result<(Vec<CaseRow>, Vec<String>)> {
    let context = Context::new()?;
    let geometry = context.tracker("iss")?.at(&parse_utc("time", PASS_UTC)?)?;
    let satellite = ComponentSatellite::named("iss")?;
    let scene = ResolvedScene::of(&satellite, &geometry);
    let grounds: [(&str, Option<f64>, Brdf); 3] = [
        ("uniform 1e-9, as published", Some(PAPER_EARTH_W_CM2_SR_UM), Brdf::Lambert { albedo: 0.3 }),
        ("moonlit ground, Lambert 0.3", None, Brdf::Lambert { albedo: 0.3 }),
        ("moonlit ground, vegetation", None, Brdf::named("earth-vegetation")?),
    ];
    let mut rows: Vec<CaseRow> = Vec::new();
    for (quantity, printed) in PRINTED {
        rows.push(CaseRow { quantity, of: "printed".into(), steps: printed.map(Some) });
        if quantity.starts_with("panel") || quantity.starts_with("body") {
            rows.push(CaseRow { quantity, of: "printed, in W/m2".into(), steps: printed.map(|l| Some(l * CM2)) });
        }
    }
    let mut points = Vec::new();
    for (name, uniform, earth) in grounds {
        let mut own = settings.clone();
        own.uniform_earth_w_cm2_sr_um = uniform;
        own.model.earth = earth;
        let renderer = Renderer::new(&scene, &own)?;
        let rendered = renderer.picture();
        let image = &rendered.image;
        let until = [
            &[Light::Starlight][..],
            &[Light::Starlight, Light::Moon, Light::Sun, Light::Earthshine][..],
            &Light::ALL[..],
        ];
        let mut row = |quantity, steps| rows.push(CaseRow { quantity, of: name.into(), steps });
        points.clear();
        for quantity in ["panel", "body1", "body2"] {
            let point = satellite.points.get(quantity).ok_or_else(|| Error::Model {
                problem: format!("the components of the ISS name no point {quantity}"),
            })?;
            let light = renderer.point(quantity, point)?;
            row(quantity, until.map(|lights| Some(light.of(lights))));
            points.push(light);
        }
        let w_cm2 = until.map(|lights| lights.iter().map(|l| image.irradiance_w_m2(*l)).sum::<f64>() / CM2);
        row("irradiance", w_cm2.map(Some));
        row("magnitude", w_cm2.map(|e| mag_of_flux(e / VEGA_W_CM2)));
        let v = |lights: &[Light]| rendered.v_flux.iter().filter(|(l, _)| lights.contains(l)).map(|(_, v)| v).sum();
        row("v_mag", until.map(|lights| mag_of_flux(v(lights))));
    }
    let order = ["panel", "body1", "body2", "irradiance", "magnitude", "v_mag"];
    rows.sort_by_key(|r| order.iter().position(|q| *q == r.quantity));
    let mut notes: Vec<String> = REASONS.iter().map(|s| (*s).to_owned()).collect();
    for point in &points {
        notes.push(format!(
            "{}: {}, for the observer {}, cosine to nadir {:+.2}",
            point.name, point.component, point.view, point.cos_nadir
        ));
    }
    notes.push(format!(
        "geometry: altitude {:.1} deg, range {:.1} km, Moon at altitude {:.1} deg, {:.1} % lit",
        geometry.alt_rad.to_degrees(),
        geometry.range_km,
        geometry.moon_alt_rad.to_degrees(),
        100.0 * geometry.moon_illum_frac
    ));
    Ok((rows, notes))
}

/// Why the numbers differ.
const REASONS: &[&str] = &[
    "unit: the printed radiances are per cm2, not per m2: the printed irradiance over the station's solid angle needs it",
    "ratio: body 2 gains 4.82e-9/2.36e-11 = 204 times, printed twice as ~240",
    "ground: 1e-9 W/cm2/sr/um from all of the Earth is 43 times below a Lambert ground of albedo 0.3 under the full Moon in the zenith; ours falls with the Moon's height and ends at the terminator",
    "starlight: ours is a sky of 22 mag/arcsec2 above and an airglow of 22 below; the printed floor is 10 to 20 times fainter",
    "magnitude: the paper's zero, 2.04e-12 W/cm2 in 0.3-1.05 um, lies 0.066 mag from sunlight of V = 0; v_mag is V",
    "surfaces: the reflectances of the commercial tool's station are not stated; ours are those inferred for Starlink, white radiators, and our own backs",
    "places: where on the station panel, body 1 and body 2 are is not stated; ours are named in the file of components",
];
