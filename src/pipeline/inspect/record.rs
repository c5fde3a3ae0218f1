//! What was read from one header, and why: the record behind `satphot inspect`, as text and as JSON.
//!
//! Units are in the names. Filled by [`crate::pipeline::inspect::file`]; nothing is computed here.

use serde::Serialize;

/// A number or a word with the keyword it is from.
#[derive(Debug, Clone, Serialize)]
pub struct From<T> {
    /// The value.
    pub value: T,
    /// Where it is from.
    pub source: String,
}

/// The middle of the exposure.
#[derive(Debug, Clone, Serialize)]
pub struct InspectedTime {
    /// Mid-exposure UTC, ISO 8601.
    pub date_mid: String,
    /// Mid-exposure MJD (UTC) \[d\].
    pub mjd_mid_d: f64,
    /// Keywords and meaning.
    pub time_source: String,
    /// configured, gps, start_end, middle or start.
    pub kind: &'static str,
    /// 1-sigma error \[s\].
    pub time_err_s: f64,
    /// Error of altitude and azimuth it implies \[deg\], where elements are configured.
    pub alt_az_err_deg: Option<f64>,
    /// Altitude of the Sun then \[deg\], where the site is known.
    pub sun_alt_deg: Option<f64>,
}

/// The gain.
#[derive(Debug, Clone, Default, Serialize)]
pub struct InspectedGain {
    /// The camera's setting.
    pub gain_setting: Option<i64>,
    /// Its keyword.
    pub gain_setting_source: Option<String>,
    /// Electrons per ADU that would be used.
    pub e_per_adu: Option<f64>,
    /// Where they are from.
    pub e_per_adu_source: Option<String>,
    /// Electrons per ADU of the header, used or not.
    pub header_e_per_adu: Option<From<f64>>,
    /// Black level setting.
    pub offset: Option<From<f64>>,
    /// Read noise of the header \[e⁻\].
    pub read_noise_e: Option<From<f64>>,
    /// Why the electrons per ADU are unknown.
    pub problem: Option<String>,
}

/// The observatory.
#[derive(Debug, Clone, Serialize)]
pub struct InspectedSite {
    /// Latitude, north positive \[deg\].
    pub lat_deg: f64,
    /// Longitude, east positive \[deg\].
    pub lon_deg: f64,
    /// Height \[m\].
    pub alt_m: Option<f64>,
    /// The keywords.
    pub source: String,
    /// agrees, counted west or differs from the configured site; not checked without a configuration.
    pub check: &'static str,
}

/// Where the frame points.
#[derive(Debug, Clone, Serialize)]
pub struct InspectedPointing {
    /// Right ascension \[deg\].
    pub ra_deg: f64,
    /// Declination \[deg\].
    pub dec_deg: f64,
    /// The keywords.
    pub source: String,
}

/// The calibration of the pixels.
#[derive(Debug, Clone, Serialize)]
pub struct InspectedCalibration {
    /// In words.
    pub state: &'static str,
    /// CALSTAT.
    pub calstat: Option<String>,
    /// PEDESTAL \[ADU\].
    pub pedestal_adu: Option<f64>,
    /// Keywords that name calibration frames.
    pub others: Vec<String>,
    /// ROWORDER.
    pub row_order: Option<String>,
    /// The colour pattern or planes.
    pub colour: Option<String>,
}

/// The world coordinates.
#[derive(Debug, Clone, Serialize)]
pub struct InspectedWcs {
    /// none, read, fits the sky, or refused.
    pub state: &'static str,
    /// Centre of the frame, right ascension \[deg\].
    pub ra_deg: Option<f64>,
    /// Centre of the frame, declination \[deg\].
    pub dec_deg: Option<f64>,
    /// Pixel scale \[arcsec/px\].
    pub scale_arcsec: Option<f64>,
    /// Rotation \[deg\].
    pub rotation_deg: Option<f64>,
    /// Whether east is to the right of north.
    pub mirrored: Option<bool>,
    /// Whether there are distortion terms.
    pub distorted: Option<bool>,
    /// What was checked, or what is wrong, with the remedy.
    pub note: String,
}

/// One file, as satphot reads it.
#[derive(Debug, Clone, Serialize)]
pub struct Inspection {
    /// The file.
    pub file: String,
    /// `FITS` or `header text`.
    pub kind: &'static str,
    /// Width and height \[px\].
    pub size_px: [usize; 2],
    /// light, target, flat, bias, dark or ignored.
    #[serde(rename = "type")]
    pub role: &'static str,
    /// Why.
    pub type_reason: String,
    /// OBJECT.
    pub object: Option<String>,
    /// Whether satphot would use the frame, as far as the header shows.
    pub usable: bool,
    /// Why not, each with its remedy.
    pub refused: Vec<String>,
    /// The middle of the exposure.
    pub time: Option<InspectedTime>,
    /// Time stamps that were not used, each with its reason.
    pub time_rejected: Vec<String>,
    /// Exposure time \[s\].
    pub exptime_s: Option<From<f64>>,
    /// The gain.
    pub gain: InspectedGain,
    /// The observatory.
    pub site: Option<InspectedSite>,
    /// Sites that were not used, each with its reason.
    pub site_rejected: Vec<String>,
    /// Where the frame points, the most trusted first.
    pub pointing: Vec<InspectedPointing>,
    /// AIRMASS.
    pub airmass: Option<f64>,
    /// Camera.
    pub camera: Option<From<String>>,
    /// Filter.
    pub filter: Option<From<String>>,
    /// Binning along x.
    pub binning: From<u32>,
    /// Pixel scale by the optics \[arcsec/px\].
    pub pix_scale_arcsec: Option<From<f64>>,
    /// Temperature of the sensor \[°C\].
    pub temperature_c: Option<From<f64>>,
    /// The calibration of the pixels.
    pub calibration: InspectedCalibration,
    /// The world coordinates.
    pub wcs: InspectedWcs,
    /// Warnings.
    pub warnings: Vec<String>,
}

impl Inspection {
    /// The record as lines for a reader.
    #[must_use]
    pub fn text(&self) -> String {
        let mut out = format!("{}\n", self.file);
        let mut line = |label: &str, words: String| {
            out += &format!("  {label:<11} {words}\n");
        };
        line("file", format!("{}, {} x {} px", self.kind, self.size_px[0], self.size_px[1]));
        let object = self.object.as_ref().map(|o| format!("; object {o}")).unwrap_or_default();
        line("type", format!("{} ({}){object}", self.role, self.type_reason));
        match &self.time {
            Some(t) => {
                line("mid-time", format!("{} +- {} s, from {}", t.date_mid, t.time_err_s, t.time_source));
                line("", moved(t));
            }
            None => line("mid-time", "not known".into()),
        }
        for (k, why) in self.time_rejected.iter().enumerate() {
            line(if k == 0 { "  not used" } else { "" }, why.clone());
        }
        line(
            "exposure",
            self.exptime_s.as_ref().map_or("not given".into(), |e| format!("{} s, from {}", e.value, e.source)),
        );
        line("gain", self.gain.text());
        match &self.site {
            Some(s) => {
                let alt = s.alt_m.map(|a| format!(", {a:.0} m")).unwrap_or_default();
                line("site", format!("{:.4} {:.4} deg{alt}, from {}; {}", s.lat_deg, s.lon_deg, s.source, s.check));
            }
            None => line("site", "not given".into()),
        }
        for why in &self.site_rejected {
            line("", format!("not used: {why}"));
        }
        for (k, p) in self.pointing.iter().enumerate() {
            let label = if k == 0 { "pointing" } else { "" };
            line(label, format!("RA {:.4} Dec {:+.4} deg, from {}", p.ra_deg, p.dec_deg, p.source));
        }
        if self.pointing.is_empty() {
            line("pointing", "not given".into());
        }
        if let Some(x) = self.airmass {
            line("", format!("AIRMASS {x:.3}"));
        }
        line("camera", self.camera_text());
        line("filter", self.filter.as_ref().map_or("not given".into(), |f| format!("{}, from {}", f.value, f.source)));
        line("calibration", self.calibration.text());
        line("wcs", self.wcs.text());
        for why in &self.refused {
            line("REFUSED", why.clone());
        }
        for why in &self.warnings {
            line("warning", why.clone());
        }
        out
    }

    fn camera_text(&self) -> String {
        let mut words = vec![self.camera.as_ref().map_or("not given".into(), |c| c.value.clone())];
        words.push(format!("binning {} ({})", self.binning.value, self.binning.source));
        words.extend(self.pix_scale_arcsec.as_ref().map(|s| format!("{:.4} arcsec/px ({})", s.value, s.source)));
        words.extend(self.temperature_c.as_ref().map(|t| format!("{:.1} C", t.value)));
        words.join(", ")
    }
}

/// The effect of the error of the time on the place on the sky.
fn moved(t: &InspectedTime) -> String {
    let sun = t.sun_alt_deg.map(|a| format!("; Sun at {a:+.0} deg")).unwrap_or_default();
    match t.alt_az_err_deg {
        Some(deg) => format!("{deg:.3} deg of altitude and azimuth by that error{sun}"),
        None => format!("a pass at 1 deg/s moves {:.3} deg in that error{sun}", t.time_err_s),
    }
}

impl InspectedGain {
    fn text(&self) -> String {
        let source = |s: &Option<String>| s.clone().unwrap_or_default();
        let mut words = Vec::new();
        match self.gain_setting {
            Some(g) => words.push(format!("setting {g} ({})", source(&self.gain_setting_source))),
            None => words.push("no setting".into()),
        }
        if let Some(e) = self.e_per_adu {
            words.push(format!("{e:.4} e-/ADU ({})", source(&self.e_per_adu_source)));
        }
        if let Some(h) = self.header_e_per_adu.as_ref().filter(|h| Some(h.value) != self.e_per_adu) {
            words.push(format!("header {} = {:.4} e-/ADU", h.source, h.value));
        }
        words.extend(self.offset.as_ref().map(|o| format!("offset {}", o.value)));
        words.extend(self.read_noise_e.as_ref().map(|r| format!("read noise {} e-", r.value)));
        words.extend(self.problem.clone());
        words.join(", ")
    }
}

impl InspectedCalibration {
    fn text(&self) -> String {
        let mut words = vec![self.state.to_string()];
        words.extend(self.calstat.as_ref().map(|c| format!("CALSTAT '{c}'")));
        words.extend(self.pedestal_adu.map(|p| format!("PEDESTAL {p}")));
        words.extend(self.others.clone());
        words.extend(self.row_order.as_ref().map(|r| format!("rows {r}")));
        words.extend(self.colour.as_ref().map(|c| format!("colour {c}")));
        words.join(", ")
    }
}

impl InspectedWcs {
    fn text(&self) -> String {
        let mut words = vec![self.state.to_string()];
        if let (Some(ra), Some(dec)) = (self.ra_deg, self.dec_deg) {
            words.push(format!("centre RA {ra:.4} Dec {dec:+.4} deg"));
        }
        words.extend(self.scale_arcsec.map(|s| format!("{s:.4} arcsec/px")));
        words.extend(self.rotation_deg.map(|r| format!("rotation {r:.2} deg")));
        words.extend(self.mirrored.filter(|m| *m).map(|_| "mirrored".to_string()));
        words.extend(self.distorted.filter(|d| *d).map(|_| "distorted".to_string()));
        let note = if self.note.is_empty() { String::new() } else { format!(": {}", self.note) };
        words.join(", ") + &note
    }
}
