//! One file as satphot reads it: everything `satphot inspect` prints, from the header and, where stars are configured,
//! from the sky.
//!
//! Degrees, seconds. Works without a configuration; then gain comes from the camera's table or the header, and nothing is
//! checked against a site. It does not cover the measuring.

use super::inspector::Inspector;
use std::path::Path;

use crate::astrometry::catalogue::Catalogue;
use crate::base::error::{Error, Result};
use crate::base::time::{iso_utc, mjd_utc};
use crate::config::Config;
use crate::fits::guarded;
use crate::frames::header::{
    AnyHeader, SiteCheck, Sourced, binning, calibration, check_site, colour, exposure_time, filter, header_gain,
    header_site, optics, read_any, row_order,
};
use crate::frames::{Detector, Exposure, Role, light_exptime, mid_time, other_satellite, refusals, sorted};
use crate::orbit::{Site, Tracker};
use crate::pipeline::inspect::record::{
    From, InspectedCalibration, InspectedGain, InspectedPointing, InspectedSite, InspectedTime, Inspection,
};
use crate::pipeline::inspect::wcs::{inspected_wcs, positions};
use crate::pipeline::survey::damage::damage;
use crate::pipeline::survey::header_checks::{SUN_UP_DEG, site_problem, sun_alt_deg, sun_words};
use crate::pipeline::survey::header_warnings::other_camera;
use crate::pipeline::survey::header_warnings::{Stamp, cadence_conflicts, egain_warning, header_warnings};
use crate::pipeline::survey::satellite::other_names;

/// A configuration to read headers by, where there is none.
const NO_NIGHT: &str =
    "preset = \"macquarie-cdk24\"\n[night]\nname = \"inspect\"\ninput = [\".\"]\noutput = \"satphot-out\"\n";

impl Inspector {
    /// With the configuration of a night, or without; `sets` are `key=value` on top of none.
    ///
    /// Catalogue and elements of the configuration are used where they can be read; where not, `notes` says so.
    ///
    /// # Errors
    /// [`Error::Config`].
    pub fn new(config: Option<Config>, sets: &[String]) -> Result<Self> {
        let configured = config.is_some();
        let config = match config {
            Some(config) => config,
            None => Config::from_text(NO_NIGHT, sets)?,
        };
        let mut notes = Vec::new();
        let mut kept = |what: &str, error: Error, file: &Path, line: String| {
            let get = if file.exists() { String::new() } else { format!("; `{line}` gets it") };
            notes.push(format!("{what}: {error}{get}"));
        };
        let stars = config.stars.as_ref().filter(|_| configured);
        let catalogue = stars.and_then(|s| {
            Catalogue::read(&s.catalogue, &s.columns)
                .map_err(|e| kept("world coordinates are not checked", e, &s.catalogue, config.fetch_line("stars")))
                .ok()
        });
        let orbit = config.orbit.as_ref().filter(|_| configured);
        let tracker = orbit.and_then(|o| {
            Tracker::from_config(o, &config.site)
                .map_err(|e| kept("the target is not known by name", e, &o.elements, config.fetch_line("elements")))
                .ok()
        });
        let target_names = tracker.as_ref().map(Tracker::names).unwrap_or_default();
        let others = other_names(tracker.as_ref(), &config);
        Ok(Self { others, configured, catalogue, target_names, tracker, notes, config })
    }

    /// Reads and checks one file.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Fits`] for what is neither a FITS file nor the text of a header.
    pub fn inspect(&self, path: &Path) -> Result<Inspection> {
        guarded(path, || self.understood(path))
    }

    fn understood(&self, path: &Path) -> Result<Inspection> {
        let AnyHeader { header, kind, problem } = read_any(path)?;
        let mut exposure = sorted(path, header, &self.config, &self.target_names);
        if let Some(reason) = other_satellite(&exposure, &self.config, &self.target_names, &self.others)
            && self.tracker.is_some()
        {
            (exposure.role, exposure.role_reason) = (Role::OtherTarget, reason);
        }
        let header = exposure.header.clone();
        let aliases = &self.config.header.aliases;
        let mut refused: Vec<String> = problem.iter().map(short).collect();
        let (exptime, mut warnings) = exposure_time(&header, aliases);
        let light = matches!(exposure.role, Role::Stars | Role::Target | Role::OtherTarget);
        if let Err((keyword, problem)) = light_exptime(exptime.clone())
            && light
        {
            refused.push(format!("{keyword}: {problem}"));
        }
        if exposure.role == Role::Ignored {
            refused.push(exposure.role_reason.clone());
        }
        if !matches!(exposure.role, Role::Bias | Role::Dark) {
            let mut config = self.config.clone();
            if !self.configured {
                config.detector.pedestal_adu = calibration(&header).zero_adu();
            }
            refused.extend(
                refusals(&header, &config).into_iter().map(|(keyword, problem)| format!("{keyword}: {problem}")),
            );
        }
        exposure.exptime_s = exptime.as_ref().map_or(0.0, |t| t.value).max(0.0);
        let mut time_rejected = Vec::new();
        match mid_time(&header, exposure.exptime_s, &self.config.time, aliases, path) {
            Ok(time) => {
                warnings.extend(time.warnings.iter().cloned());
                time_rejected.clone_from(&time.rejected);
                exposure.time = Some(time);
            }
            Err(error) if light => refused.push(short(&error)),
            Err(_) => {}
        }
        let (site, site_rejected) = header_site(&header, aliases);
        let sun_alt_deg = self.sun_alt_deg(&exposure, site.as_ref().map(|s| (s.lat_deg, s.lon_deg)));
        if let Some(alt_deg) = sun_alt_deg.filter(|alt| *alt > SUN_UP_DEG && light) {
            warnings.push(sun_words(alt_deg));
        }
        let check = site.as_ref().map_or("not given", |s| self.site_check(s));
        if light
            && self.configured
            && let Some((keyword, problem)) = site_problem(&exposure, &self.config)
        {
            let words = format!("{keyword}: {problem}");
            if self.config.header.check_site { refused.push(words) } else { warnings.push(words) }
        }
        if check == "counted west" {
            warnings.push("the longitude is counted west; the configured site is used".into());
        }
        let optics = optics(&header, aliases);
        let (binned, odd) = binning(&header, aliases);
        exposure.binning = binned.value;
        warnings.extend(odd);
        if self.configured
            && self.config.header.check_camera
            && (light || exposure.role == Role::Flat)
            && let Some((keyword, name)) = other_camera(&exposure, &self.config)
        {
            let configured = &self.config.detector.camera;
            refused.push(format!("{keyword}: '{name}' is another camera than detector.camera = \"{configured}\""));
        }
        warnings.extend(header_warnings(&exposure, &self.config, self.configured));
        let gain = self.gain(&mut exposure, optics.camera.as_ref(), &mut warnings);
        let positions = positions(self, &exposure);
        let wcs = inspected_wcs(self, &exposure, optics.scale_arcsec.as_ref(), kind == "FITS" && problem.is_none());
        if kind == "FITS" && problem.is_none() {
            warnings.extend(damage(path, &header));
        }
        Ok(Inspection {
            file: path.display().to_string(),
            kind,
            size_px: [exposure.size_px.0, exposure.size_px.1],
            role: role_name(exposure.role),
            type_reason: exposure.role_reason.clone(),
            object: exposure.object.clone(),
            usable: refused.is_empty(),
            refused,
            time: exposure.time.as_ref().map(|t| InspectedTime {
                date_mid: iso_utc(t.mid, 6),
                mjd_mid_d: mjd_utc(t.mid),
                time_source: t.source.clone(),
                kind: t.kind.name(),
                time_err_s: rounded(t.err_s),
                alt_az_err_deg: self.rate_deg_s(&exposure).map(|rate| rate * t.err_s),
                sun_alt_deg,
            }),
            time_rejected,
            exptime_s: exptime.map(from),
            gain: InspectedGain {
                offset: optics.offset.map(from),
                read_noise_e: optics.read_noise_e.map(from),
                ..gain
            },
            site: site.map(|s| InspectedSite {
                lat_deg: s.lat_deg,
                lon_deg: s.lon_deg,
                alt_m: s.alt_m,
                source: s.source,
                check,
            }),
            site_rejected,
            pointing: positions
                .into_iter()
                .map(|p| InspectedPointing { ra_deg: p.ra_deg, dec_deg: p.dec_deg, source: p.source })
                .collect(),
            airmass: header.number("AIRMASS"),
            camera: optics.camera.map(from),
            filter: filter(&header, aliases).map(from),
            binning: from(binned),
            pix_scale_arcsec: optics.scale_arcsec.map(from),
            temperature_c: optics.temperature_c.map(from),
            calibration: calibrated(&header),
            wcs,
            warnings,
        })
    }

    /// Whether there is a configuration to check against.
    pub(crate) fn configured(&self) -> bool {
        self.configured
    }

    fn site_check(&self, stated: &crate::frames::header::HeaderSite) -> &'static str {
        if !self.configured {
            return "not checked";
        }
        match check_site(stated, &self.config.site) {
            SiteCheck::Agrees => "agrees with the configured site",
            SiteCheck::WestPositive => "counted west",
            SiteCheck::Differs(_) => "differs from the configured site",
        }
    }

    /// Altitude of the Sun at the configured site, else at the header's.
    fn sun_alt_deg(&self, exposure: &Exposure, header: Option<(f64, f64)>) -> Option<f64> {
        let site = if self.configured {
            Site::from_config(&self.config.site).ok()?
        } else {
            let (lat_deg, lon_deg) = header?;
            Site::new(lat_deg, lon_deg, 0.0).ok()?
        };
        sun_alt_deg(&site, exposure)
    }

    /// Setting and conversion: the configured detector's, else the camera's table, else the header's.
    fn gain(
        &self,
        exposure: &mut Exposure,
        camera: Option<&Sourced<String>>,
        warnings: &mut Vec<String>,
    ) -> InspectedGain {
        let header = header_gain(&exposure.header, &self.config.header.aliases);
        warnings.extend(header.warnings);
        exposure.setting = header.setting.as_ref().map(|s| s.value);
        exposure.header_e_per_adu = header.e_per_adu.as_ref().map(|e| e.value);
        let mut inspected = InspectedGain {
            gain_setting: header.setting.as_ref().map(|s| s.value.0),
            gain_setting_source: header.setting.map(|s| s.source),
            header_e_per_adu: header.e_per_adu.clone().map(from),
            ..InspectedGain::default()
        };
        let named = camera.filter(|_| !self.configured).map(|c| {
            let detector = crate::config::Detector { camera: c.value.clone(), ..self.config.detector.clone() };
            Detector::from_config(&detector)
        });
        let detector = if self.configured { Some(Detector::from_config(&self.config.detector)) } else { named };
        match detector.and_then(std::result::Result::ok).map(|d| d.gain(exposure)) {
            Some(Ok(gain)) => {
                inspected.e_per_adu = Some(gain.e_per_adu.0);
                inspected.e_per_adu_source = Some(gain.source);
            }
            Some(Err(error)) if self.configured => inspected.problem = Some(short(&error)),
            _ => {
                inspected.e_per_adu = exposure.header_e_per_adu;
                inspected.e_per_adu_source = header.e_per_adu.as_ref().map(|e| format!("header {}", e.source));
            }
        }
        let used =
            inspected.e_per_adu.map(|value| (value, inspected.e_per_adu_source.as_deref().unwrap_or("the table")));
        warnings.extend(egain_warning(exposure.header_e_per_adu, used));
        inspected
    }

    /// Angular rate of the configured satellite at mid-exposure \[deg/s\].
    fn rate_deg_s(&self, exposure: &Exposure) -> Option<f64> {
        let geometry = self.tracker.as_ref()?.at(&exposure.time.as_ref()?.mid).ok()?;
        Some(geometry.rate_rad_s.to_degrees())
    }
}

fn from<T>(sourced: Sourced<T>) -> From<T> {
    From { value: sourced.value, source: sourced.source }
}

/// An error without the file's name, which stands above it.
fn short(error: &Error) -> String {
    match error {
        Error::Header { keyword, problem, .. } => format!("{keyword}: {problem}"),
        Error::Fits { problem, .. } => problem.clone(),
        other => other.to_string(),
    }
}

/// To a microsecond: differences of stamps leave digits of no meaning.
fn rounded(s: f64) -> f64 {
    (s * 1e6).round() / 1e6
}

fn role_name(role: Role) -> &'static str {
    match role {
        Role::Flat => "flat",
        Role::Stars => "light",
        Role::Target => "target",
        Role::Bias => "bias",
        Role::Dark => "dark",
        Role::Ignored => "ignored",
        Role::OtherTarget => "other target",
        Role::OtherFilter => "other filter",
    }
}

fn calibrated(header: &crate::fits::Header) -> InspectedCalibration {
    let c = calibration(header);
    InspectedCalibration {
        state: c.state(),
        calstat: c.calstat,
        pedestal_adu: c.pedestal_adu,
        others: c.others,
        row_order: row_order(header),
        colour: colour(header).map(|(k, v)| format!("{k} = '{v}'")),
    }
}

/// Warns of exposures that do not fit between their neighbours of the same camera: an exposure time in another unit, or
/// the first frames after it was changed.
pub fn mark_cadence(mut frames: Vec<&mut Inspection>) {
    let stamp = |i: &Inspection| {
        let exptime_s = i.exptime_s.as_ref()?.value;
        let time = i.time.as_ref()?;
        Some(Stamp {
            name: i.file.clone(),
            camera: i.camera.as_ref().map(|c| c.value.clone()),
            start_s: time.mjd_mid_d * 86_400.0 - exptime_s / 2.0,
            exptime_s,
            err_s: time.time_err_s,
        })
    };
    let (places, stamps): (Vec<usize>, Vec<Stamp>) =
        frames.iter().enumerate().filter_map(|(k, i)| Some((k, stamp(i)?))).unzip();
    for (k, words) in cadence_conflicts(&stamps) {
        frames[places[k]].warnings.push(words);
    }
}
