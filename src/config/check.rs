//! Ranges, checked once: each message gives the key, the value, the accepted range and the unit.

use super::Attitude;
use super::Model;
use super::Source;
use super::Surface;
use super::file::Config;
use super::file::QUANTITIES;
use super::range::{bad, range};
use crate::bands::{Band, Meaning, filter_meaning};
use crate::base::error::{Error, Result};
use crate::base::file::plain_name;

impl Config {
    /// Checks every number of the configuration.
    pub(super) fn check(&self) -> Result<()> {
        range("night.max_failed_frac", self.night.max_failed_frac, 0.0, 1.0, "")?;
        plain_name("night.name", &self.night.name)?;
        range("site.lat_deg", self.site.lat_deg, -90.0, 90.0, "deg, north positive")?;
        range("site.lon_deg", self.site.lon_deg, -180.0, 360.0, "deg, east positive")?;
        range("site.alt_m", self.site.alt_m, -500.0, 9_000.0, "m")?;
        range("telescope.aperture_m", self.telescope.aperture_m, 0.005, 50.0, "m")?;
        range("telescope.focal_length_mm", self.telescope.focal_length_mm, 1.0, 1e6, "mm")?;
        self.check_detector()?;
        self.check_aliases()?;
        self.check_photometry()?;
        if let Some(stars) = &self.stars {
            ordered("stars.bv_range_mag", stars.bv_range_mag, "mag")?;
            ordered("stars.v_range_mag", stars.v_range_mag, "mag")?;
            ordered("stars.airmass_range", stars.airmass_range, "airmass")?;
            range("stars.v_err_max_mag", stars.v_err_max_mag, 0.0, 10.0, "mag")?;
            range("stars.min_snr", stars.min_snr, 0.0, 1e6, "")?;
            range("stars.match_radius_arcsec", stars.match_radius_arcsec, 0.01, 3_600.0, "arcsec")?;
            range("stars.pointing_err_arcsec", stars.pointing_err_arcsec, 0.0, 36_000.0, "arcsec")?;
            range("stars.epoch_jyear", stars.epoch_jyear, 1850.0, 2150.0, "Julian year")?;
            range("stars.solve_radius_deg", stars.solve_radius_deg, 0.0, 10.0, "deg")?;
            range("stars.scale_search_frac", stars.scale_search_frac, 0.0, 0.5, "")?;
            for (object, [ra_deg, dec_deg]) in &stars.fields {
                range(&format!("stars.fields.{object} (RA)"), *ra_deg, -360.0, 360.0, "deg")?;
                range(&format!("stars.fields.{object} (Dec)"), *dec_deg, -90.0, 90.0, "deg")?;
            }
            range("stars.pointing_gap_s", stars.pointing_gap_s, 0.0, 86_400.0, "s")?;
        }
        for (text, filter) in &self.input.filters {
            if matches!(filter_meaning(filter), Meaning::Unknown) && Band::named(filter).is_none() {
                let known = "V, R, g, r, G, TG, Clear, Ha and the like (docs/photometry.md)";
                return Err(bad(
                    &format!("input.filters.{text:?}"),
                    format!("\"{filter}\" is not a known filter; {known}"),
                ));
            }
        }
        for instrument in &self.instruments {
            plain_name("instruments.name", &instrument.name)?;
            if let Some(binning) = instrument.binning {
                range("instruments.binning", f64::from(binning), 1.0, 64.0, "")?;
            }
            let mut own = Self { instruments: Vec::new(), ..self.clone() };
            own.detector = instrument.detector.clone();
            own.telescope = instrument.telescope.clone().unwrap_or(own.telescope);
            own.photometry.clip_radius_px = instrument.clip_radius_px.or(own.photometry.clip_radius_px);
            own.check().map_err(|error| match error {
                Error::Config { key, problem } => {
                    bad(&format!("instruments.{key}"), format!("{}: {problem}", instrument.name))
                }
                other => other,
            })?;
        }
        self.check_zeropoint()?;
        self.check_vetting()?;
        if let Some(orbit) = &self.orbit {
            range("orbit.max_age_d", orbit.max_age_d, 0.0, 36_525.0, "d")?;
            if let Some(ut1_utc_s) = orbit.ut1_utc_s {
                range("orbit.ut1_utc_s", ut1_utc_s, -1.0, 1.0, "s")?;
            }
            range("orbit.xp_arcsec", orbit.xp_arcsec, -2.0, 2.0, "arcsec")?;
            range("orbit.yp_arcsec", orbit.yp_arcsec, -2.0, 2.0, "arcsec")?;
        }
        if let Some(model) = &self.model {
            check_model(model)?;
        }
        self.fetch.check()
    }

    /// A misspelt quantity would be passed over without a word.
    fn check_aliases(&self) -> Result<()> {
        for (quantity, keywords) in &self.header.aliases {
            let key = format!("header.aliases.{quantity}");
            if !QUANTITIES.contains(&quantity.as_str()) {
                return Err(bad(&key, format!("is not a quantity; known: {}", QUANTITIES.join(", "))));
            }
            if let Some(empty) = keywords.iter().find(|k| k.trim().is_empty()) {
                return Err(bad(&key, format!("\"{empty}\" is not a header keyword; give a name such as GAIN")));
            }
        }
        Ok(())
    }

    fn check_detector(&self) -> Result<()> {
        let d = &self.detector;
        range("detector.pixel_um", d.pixel_um, 0.1, 1_000.0, "µm")?;
        range("detector.pedestal_adu", d.pedestal_adu, -65_536.0, 65_535.0, "ADU")?;
        range("detector.adc_max_adu", d.adc_max_adu, 1.0, 1e10, "ADU")?;
        range("detector.saturation_frac", d.saturation_frac, 0.01, 1.0, "")?;
        if let Some(pattern) = &d.bayer_pattern {
            let known = ["RGGB", "BGGR", "GRBG", "GBRG", "NONE"];
            if !known.contains(&pattern.trim().to_ascii_uppercase().as_str()) {
                return Err(bad(
                    "detector.bayer_pattern",
                    format!("\"{pattern}\" is not one of RGGB, BGGR, GRBG, GBRG, none"),
                ));
            }
        }
        if let Some(err) = d.gain_table_err_mag {
            range("detector.gain_table_err_mag", err, 0.0, 5.0, "mag")?;
        }
        for (table, values, top) in [
            ("e_per_adu", &d.e_per_adu, 1e6),
            ("read_noise_e", &d.read_noise_e, 1e6),
            ("full_well_e", &d.full_well_e, 1e10),
        ] {
            for (setting, value) in values {
                let key = format!("detector.{table}.{setting}");
                if setting.parse::<i64>().is_err() {
                    return Err(bad(&key, format!("\"{setting}\" is not a gain setting; use a whole number [0.1 dB]")));
                }
                range(&key, *value, 1e-9, top, if table == "e_per_adu" { "e-/ADU" } else { "e-" })?;
            }
        }
        Ok(())
    }

    fn check_photometry(&self) -> Result<()> {
        let p = &self.photometry;
        if let Some(r) = p.clip_radius_px {
            range("photometry.clip_radius_px", r, 1.0, 1e6, "px")?;
        }
        if let Some(fwhm) = p.fwhm_px {
            range("photometry.fwhm_px", fwhm, 0.5, 500.0, "px")?;
        }
        range("photometry.aper_r_fwhm", p.aper_r_fwhm, 0.2, 100.0, "FWHM")?;
        range("photometry.sky_in_fwhm", p.sky_in_fwhm, p.aper_r_fwhm, 1_000.0, "FWHM, outside the aperture")?;
        range("photometry.sky_out_fwhm", p.sky_out_fwhm, p.sky_in_fwhm + 0.1, 1_000.0, "FWHM, outside sky_in_fwhm")?;
        range("photometry.mesh_px", p.mesh_px as f64, 8.0, 4_096.0, "px")?;
        range("photometry.detect_sigma", p.detect_sigma, 1.0, 1_000.0, "σ")?;
        range("photometry.clip_sigma", p.clip_sigma, 1.5, 100.0, "σ")?;
        range("flat.min_response", self.flat.min_response, 0.0, 1.0, "")?;
        ordered("flat.level_range_frac", self.flat.level_range_frac, "of full scale")?;
        if let Some(noise) = self.flat.noise_frac {
            range("flat.noise_frac", noise, 1e-5, 0.1, "of the light (0.002 is usual)")?;
        }
        let t = &self.target;
        range("target.search_radius_arcsec", t.search_radius_arcsec, 0.01, 36_000.0, "arcsec")?;
        range("target.detect_sigma", t.detect_sigma, 1.0, 1_000.0, "σ")?;
        range("target.margin_fwhm", t.margin_fwhm, 0.0, 100.0, "FWHM")?;
        range("target.limit_r_fwhm", t.limit_r_fwhm, 0.2, 100.0, "FWHM")?;
        range("target.pass_bin_snr", t.pass_bin_snr, 1.0, 10_000.0, "")?;
        if t.x_px.is_some() != t.y_px.is_some() {
            return Err(bad("target.x_px", "give both target.x_px and target.y_px, or neither".into()));
        }
        range("time.offset_s", self.time.offset_s, -86_400.0, 86_400.0, "s")?;
        if let Some(err) = self.time.err_s {
            range("time.err_s", err, 0.0, 86_400.0, "s")?;
        }
        Ok(())
    }

    fn check_vetting(&self) -> Result<()> {
        let v = &self.vetting;
        range("vetting.contam_caution_frac", v.contam_caution_frac, 0.0, 1e6, "of the flux")?;
        range("vetting.masked_caution_frac", v.masked_caution_frac, 0.0, 1e6, "of the flux")?;
        range("vetting.contam_reject_frac", v.contam_reject_frac, v.contam_caution_frac, 1e6, "of the flux")?;
        range("vetting.smear_caution", v.smear_caution, 1.0, 1e6, "")?;
        range("vetting.aperture_caution", v.aperture_caution, 1.0, 1e6, "times the length in the pass")?;
        range("vetting.outline_caution", v.outline_caution, 1.0, 1e6, "times the length of the light")?;
        range("vetting.corner_ratio_dev", v.corner_ratio_dev, 0.0, 1e6, "")?;
        range("vetting.sky_drop_frac", v.sky_drop_frac, 0.0, 0.99, "of the sky")?;
        range("vetting.min_alt_deg", v.min_alt_deg, -90.0, 90.0, "deg")?;
        range("vetting.dome_rate_deg_s", v.dome_rate_deg_s, 0.0, 1e6, "deg/s")?;
        range("vetting.peak_caution_frac", v.peak_caution_frac, 0.0, 1e6, "")?;
        range("vetting.cadence_min_frac", v.cadence_min_frac, 0.0, 1e6, "of EXPTIME")
    }

    fn check_zeropoint(&self) -> Result<()> {
        let z = &self.zeropoint;
        range("zeropoint.max_rejected_frac", z.max_rejected_frac, 0.0, 0.9, "")?;
        range("zeropoint.min_stars", z.min_stars as f64, 1.0, 1e6, "stars")?;
        let [colour, colour_err] = z.target_colour(None);
        range("zeropoint.target_b_v_mag", colour, -1.0, 4.0, "mag")?;
        range("zeropoint.target_b_v_err_mag", colour_err, 0.0, 4.0, "mag")?;
        range("zeropoint.previous_err_mag", z.previous_err_mag, 0.0, 5.0, "mag")?;
        range("zeropoint.pointing_scatter_prior_mag", z.pointing_scatter_prior_mag, 0.0, 1.0, "mag")?;
        range("zeropoint.no_flat_err_mag", z.no_flat_err_mag, 0.0, 1.0, "mag")?;
        range("zeropoint.k_prior.value", z.k_prior.value, 0.0, 5.0, "mag/airmass")?;
        range("zeropoint.k_prior.err", z.k_prior.err, 1e-4, 5.0, "mag/airmass")?;
        range("zeropoint.c_prior.value", z.c_prior.value, -5.0, 5.0, "mag/mag")?;
        range("zeropoint.c_prior.err", z.c_prior.err, 1e-4, 5.0, "mag/mag")?;
        for (key, pin) in [("zeropoint.pin_k", &z.pin_k), ("zeropoint.pin_c", &z.pin_c)] {
            if let Some(pin) = pin {
                range(&format!("{key}.value"), pin.value, -10.0, 10.0, "mag")?;
                range(&format!("{key}.err"), pin.err, 0.0, 10.0, "mag")?;
            }
        }
        Ok(())
    }
}

/// The numbers of `[model]`, and that what it requires goes together.
fn check_model(model: &Model) -> Result<()> {
    range("model.tolerance", model.tolerance, 1e-12, 0.5, "(relative)")?;
    if let Some(err) = model.k_mag_airmass_err {
        range("model.k_mag_airmass_err", err, 0.0, 5.0, "mag/airmass")?;
    }
    if let Some(k) = model.k_mag_airmass {
        range("model.k_mag_airmass", k, 0.0, 5.0, "mag/airmass")?;
    }
    if model.resolved_effects().source == Source::Extincted && model.k_mag_airmass.is_none() {
        let problem = "effects.source = \"extincted\" needs the extinction [mag/airmass], e.g. k_mag_airmass = 0.12";
        return Err(bad("model.k_mag_airmass", problem.into()));
    }
    if !Model::BANDS.contains(&model.band.as_str()) && !model.band.contains(['.', '/', '\\']) {
        let known = Model::BANDS.join(", ");
        let problem = format!("\"{}\" is not a band ({known}) and no file name with an ending", model.band);
        return Err(bad("model.band", problem));
    }
    for (at, surface) in model.surfaces.iter().enumerate() {
        let key = format!("model.surfaces.{}", surface.name);
        check_surface(&key, surface)?;
        if model.surfaces[..at].iter().any(|other| other.name == surface.name) {
            return Err(bad(&key, "two surfaces have this name; give each its own".into()));
        }
    }
    Ok(())
}

/// Area and attitude of a surface; `key` is its own, e.g. `model.surfaces.chassis`.
pub(crate) fn check_surface(key: &str, s: &Surface) -> Result<()> {
    range(&format!("{key}.area_m2"), s.area_m2, 1e-6, 1e9, "m²")?;
    let key = |name: &str| format!("{key}.attitude.{name}");
    match s.attitude {
        Attitude::Nadir | Attitude::Sun | Attitude::SunAzimuth | Attitude::SunToNadir => Ok(()),
        Attitude::SunOffset { offset_deg } => range(&key("sun_offset.offset_deg"), offset_deg, -90.0, 90.0, "deg"),
        Attitude::Lvlh(v) => direction(&key("lvlh"), v),
        Attitude::Inertial { ra_deg, dec_deg } => {
            range(&key("inertial.ra_deg"), ra_deg, -360.0, 360.0, "deg")?;
            range(&key("inertial.dec_deg"), dec_deg, -90.0, 90.0, "deg")
        }
        Attitude::SunOneAxis { axis_lvlh, zero_lvlh, limit_deg } => {
            direction(&key("sun_one_axis.axis_lvlh"), axis_lvlh)?;
            direction(&key("sun_one_axis.zero_lvlh"), zero_lvlh)?;
            range(&key("sun_one_axis.limit_deg"), limit_deg, 1e-6, 180.0, "deg")?;
            let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
            let cosine = dot(axis_lvlh, zero_lvlh) / (dot(axis_lvlh, axis_lvlh) * dot(zero_lvlh, zero_lvlh)).sqrt();
            if cosine.abs() > 1e-3 {
                let apart_deg = cosine.clamp(-1.0, 1.0).acos().to_degrees();
                return Err(bad(
                    &key("sun_one_axis.zero_lvlh"),
                    format!("{zero_lvlh:?} is {apart_deg:.2} deg from the axis {axis_lvlh:?}; 90 deg is needed"),
                ));
            }
            Ok(())
        }
        Attitude::SunTwoAxes { azimuth_limit_deg, elevation_deg: [low, high] } => {
            range(&key("sun_two_axes.azimuth_limit_deg"), azimuth_limit_deg, 0.0, 180.0, "deg")?;
            range(&key("sun_two_axes.elevation_deg"), low, -90.0, 90.0, "deg")?;
            range(&key("sun_two_axes.elevation_deg"), high, -90.0, 90.0, "deg")?;
            if low > high {
                let problem = format!("[{low}, {high}] deg: the first must not be above the second");
                return Err(bad(&key("sun_two_axes.elevation_deg"), problem));
            }
            Ok(())
        }
    }
}

/// A vector that has a direction.
fn direction(key: &str, v: [f64; 3]) -> Result<()> {
    let length = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
    if length > 0.0 && length.is_finite() {
        return Ok(());
    }
    Err(bad(key, format!("{v:?} has no direction; three numbers are needed that are not all 0")))
}

fn ordered(key: &str, [lo, hi]: [f64; 2], unit: &str) -> Result<()> {
    if lo < hi {
        return Ok(());
    }
    Err(bad(key, format!("[{lo}, {hi}] {unit}: the first must be smaller than the second")))
}
