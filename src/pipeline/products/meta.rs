//! The meta block of every table: schema, tool, configuration, site, magnitude system, zeropoint, flag names.

use crate::bands::Band;
use crate::bands::CalibratedBand;
use crate::brightness::catalogue::Standing;
use crate::brightness::columns::effects_meta;
use crate::config::Config;
use crate::photometry::Flags;
use crate::photometry::target::measure::LIMIT_COMPLETENESS;
use crate::pipeline::products::provenance::Provenance;
use crate::tables::meta::NO_BAND;
use crate::tables::{Meta, MetaValue};
use crate::zeropoint::fit::Zeropoint;

/// The meta block of the tables of one run.
#[must_use]
pub fn table_meta(config: &Config, zeropoint: Option<&Zeropoint>, provenance: &Provenance) -> Meta {
    let number = MetaValue::Number;
    let text = |t: &str| MetaValue::Text(t.into());
    let mut meta = Meta::default();
    meta.push("schema", text("satphot.photometry/1"));
    for (key, value) in &provenance.0 {
        meta.push(key, text(value));
    }
    meta.push("night", text(&config.night.name));
    meta.push("time_scale", text("UTC"));
    meta.push("time_ref", text("MIDDLE"));
    let site = vec![
        ("lat_deg".to_string(), number(config.site.lat_deg)),
        ("lon_deg".to_string(), number(config.site.lon_deg)),
        ("alt_m".to_string(), number(config.site.alt_m)),
    ];
    meta.push("site", MetaValue::Map(site));
    meta.push("telescope", text(&config.telescope.name));
    let limit = vec![
        ("completeness".to_string(), number(LIMIT_COMPLETENESS)),
        ("detect_sigma".to_string(), number(config.target.detect_sigma)),
        ("of_nondetections".to_string(), text("point sources anywhere in the search region of the frame")),
        ("of_detections".to_string(), text("the target's own aperture")),
    ];
    meta.push("limit_v_mag", MetaValue::Map(limit));
    // without a zeropoint there are only instrumental and modelled magnitudes
    let band = zeropoint.map(|z| Band::or_v(z.band)).or(config.photometry.band);
    meta.push("mag_system", text(band.map_or("Vega", Band::mag_system)));
    meta.push("band", text(band.map_or(NO_BAND, Band::name)));
    if let Some(light) = zeropoint.and_then(|z| z.light.as_ref()) {
        meta.push("filter", text(&light.filter));
    }
    if let Some(z) = zeropoint {
        meta.push("colour_index", text(&z.colour_name()));
        let [colour, err] = z.target_b_v_mag;
        if colour.is_finite() {
            meta.push("target_colour_mag", MetaValue::List(vec![number(colour), number(err)]));
            meta.push("target_colour_from", text(&config.zeropoint.target_colour_from()));
        }
    }
    if let Some(how) = zeropoint.and_then(Zeropoint::band_text) {
        meta.push("calibration", text(&how));
    }
    if let Some(model) = &config.model {
        meta.push("mode", text(model.mode.as_str()));
        meta.push("effects", effects_meta(model));
        meta.push("satellite", text(&model.satellite));
        if let Ok(standing) = Standing::of(model) {
            standing.push_to(&mut meta);
        }
        meta.push("model_band", text(&model.band));
    }
    if let Some(z) = zeropoint {
        let cov = z.covariance().iter().map(|row| MetaValue::List(row.iter().map(|c| number(*c)).collect())).collect();
        let fields = vec![
            ("zp_mag".to_string(), number(z.zp_mag)),
            ("k_mag_airmass".to_string(), number(z.k_mag_airmass)),
            ("c_mag_mag".to_string(), number(z.c_mag_mag)),
            ("cov".to_string(), MetaValue::List(cov)),
            ("n_used".to_string(), number(z.n_used as f64)),
            ("model".to_string(), text(&format!("{}, {}_inst = -2.5 log10(e-/s)", z.equation(), z.band_name()))),
        ];
        meta.push("zeropoint", MetaValue::Map(fields));
    }
    let flags = Flags::NAMES.iter().map(|(flag, name)| ((*name).to_string(), number(f64::from(flag.0)))).collect();
    meta.push("flags", MetaValue::Map(flags));
    meta
}

/// Writes the chosen band into the meta block of tables whose fit failed: their stars can be fitted again.
pub fn set_band(meta: &mut Meta, calibrated: Option<&CalibratedBand>) {
    if let Some(calibrated) = calibrated {
        meta.set("mag_system", calibrated.band.mag_system());
        meta.set("band", calibrated.band.name());
        meta.set("filter", calibrated.light.filter.as_str());
        meta.set("calibration", calibrated.text());
    }
}
