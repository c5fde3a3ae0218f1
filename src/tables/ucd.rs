//! What a column means in the words of the IVOA: one UCD1+ per column name, the same in every table.
//!
//! A name has one meaning throughout satphot, so the UCD hangs on the name. Written into FITS (TUCDn) and VOTable
//! (ucd). Leaves out columns of tables that are not exported.
//!
//! Source: Cecconi, Louys et al., "UCD1+ controlled vocabulary", IVOA Recommendation 1.5 (2023).

use super::columns::Column;
use super::meta::{Meta, MetaValue};
use crate::zeropoint::bands::Band;

/// The UCD1+ of a column in a table of this meta block: magnitudes are of its `band`, modelled ones of its `model_band`.
#[must_use]
pub fn ucd_in(name: &str, meta: &Meta) -> String {
    let ucd = ucd(name);
    let modelled = ucd.ends_with("meta.modelled");
    let band = |key: &str| match meta.get(key) {
        Some(MetaValue::Text(text)) => Band::named(text),
        _ => None,
    };
    // a table of predictions has but one band
    let band = if modelled { band("model_band").or_else(|| band("band")) } else { band("band") };
    match band {
        Some(band) if band != Band::V && !ucd.contains("phot.color") => ucd.replace("em.opt.V", band.ucd()),
        _ => ucd.to_owned(),
    }
}

/// The description of a column in a table of this meta block, where magnitudes are of another band than V.
#[must_use]
pub fn description_in(column: &Column, meta: &Meta) -> String {
    let (of_v, own) = (ucd(column.name), ucd_in(column.name, meta));
    let key = if of_v.ends_with("meta.modelled") { "model_band" } else { "band" };
    match meta.get(key) {
        Some(MetaValue::Text(band)) if of_v != own => {
            let words = column.description.split(' ').map(|word| if word == "V" { band.as_str() } else { word });
            words.collect::<Vec<_>>().join(" ")
        }
        _ => column.description.to_owned(),
    }
}

/// The UCD1+ of a column of magnitudes in V; empty if it has none.
#[must_use]
pub fn ucd(name: &str) -> &'static str {
    match name {
        "frame" => "meta.id;meta.file",
        "frame_sha256" => "meta.checksum",
        "norad_cat_id" | "object_id" | "star_id" => "meta.id",
        "object_name" => "meta.id;meta.main",
        "pass" | "pointing" => "meta.id;obs",
        "n_members" => "meta.number;obs.image",
        "date_mid" | "mjd_mid_d" => "time.epoch;obs",
        "exptime_s" => "time.duration;obs.exposure",
        "time_err_s" => "stat.error;time.epoch",
        "cadence_s" => "time.interval;obs",
        "date_avg_minus_mid_s" => "time.interval;arith.diff",
        "zp_age_d" | "tle_age_d" => "time.age",
        "filter" => "meta.id;instr.filter",
        "gain_setting" => "instr.setup",
        "e_per_adu" => "arith.factor;instr.det",
        "read_noise_e" => "instr.det.noise",
        "fwhm_px" => "instr.det.psf",
        "pix_scale_arcsec" => "phys.angSize;instr.pixel",
        "x_px" => "pos.cartesian.x;instr.det",
        "y_px" => "pos.cartesian.y;instr.det",
        "aper_r_px" | "sky_in_px" | "sky_out_px" => "phys.size.radius;instr.det",
        "aper_a_px" => "phys.size.smajAxis;instr.det",
        "aper_b_px" => "phys.size.sminAxis;instr.det",
        "aper_theta_deg" => "pos.posAng;instr.det",
        "elongation" => "phys.size.axisRatio",
        "extent_fwhm" => "phys.size;arith.ratio",
        "flux_e" => "phot.count",
        "flux_err_e" => "stat.error;phot.count",
        "forced_flux_e" => "phot.count",
        "forced_flux_err_e" => "stat.error;phot.count",
        "sky_e_px" => "instr.background",
        "sky_corner_ratio" => "instr.background;arith.ratio",
        "snr" => "stat.snr",
        "peak_frac_sat" => "instr.saturation;arith.ratio",
        "contam_frac" => "phot.count;arith.ratio",
        "aper_corr_mag" => "phot.mag;arith.diff",
        "inst_mag" => "phot.mag;instr.det",
        "inst_mag_err" => "stat.error;phot.mag;instr.det",
        "v_mag" | "catalogue_v_mag" => "phot.mag;em.opt.V",
        "v_mag_err" | "catalogue_v_mag_err" => "stat.error;phot.mag;em.opt.V",
        "v_mag_err_sys" | "zp_extra_err_mag" => "stat.error.sys;phot.mag;em.opt.V",
        "limit_v_mag" => "phot.mag;em.opt.V;stat.max",
        "mu_mean_mag_arcsec2" => "phot.mag.sb;em.opt.V",
        "mu_peak_mag_arcsec2" => "phot.mag.sb;em.opt.V;stat.max",
        "catalogue_b_v_mag" => "phot.color;em.opt.B;em.opt.V",
        "catalogue_b_v_mag_err" => "stat.error;phot.color;em.opt.B;em.opt.V",
        "alt_deg" | "sun_alt_deg" | "moon_alt_deg" => "pos.az.alt",
        "az_deg" => "pos.az.azi",
        "alt_az_err_deg" => "stat.error;pos.az",
        "range_km" => "pos.distance",
        "rate_deg_s" => "phys.veloc.ang",
        "az_rate_deg_s" => "phys.veloc.ang;pos.az.azi",
        "ra_deg" => "pos.eq.ra",
        "dec_deg" => "pos.eq.dec",
        "match_arcsec" | "moon_sep_deg" => "pos.angDistance",
        "airmass" => "obs.airMass",
        "phase_angle_deg" | "moon_phase_deg" => "pos.phaseAng",
        "moon_illum_pct" | "sun_visible_frac" => "phys.area;arith.ratio",
        "model_v_mag" | "sun_v_mag" | "earthshine_v_mag" | "moon_v_mag" | "lunar_earthshine_v_mag" => {
            "phot.mag;em.opt.V;meta.modelled"
        }
        "model_err_mag" => "stat.error;phot.mag;em.opt.V;meta.modelled",
        "residual_mag" => "phot.mag;em.opt.V;arith.diff",
        "flux_per_e0" => "phot.flux;arith.ratio",
        "fit_weight" => "stat.weight",
        "fit_residual_mag" => "stat.fit.residual",
        "fit_leverage" => "stat.fit.param",
        "illum" | "sky_class" | "paper_label" | "aper_shape" | "time_stamp" => "meta.code",
        "status" => "meta.code.status",
        "verdict" | "flags" => "meta.code.qual",
        "reason" | "skipped" | "time_source" | "e_per_adu_source" => "meta.note",
        _ => "",
    }
}

#[cfg(test)]
mod tests {
    use super::ucd;
    use crate::tables::columns::{PHOTOMETRY, RESIDUALS, SKY, STARS};

    #[test]
    fn every_column_of_an_exported_table_has_a_ucd() {
        for column in PHOTOMETRY.iter().chain(STARS).chain(RESIDUALS).chain(SKY) {
            assert!(!ucd(column.name).is_empty(), "{}", column.name);
        }
    }
}
