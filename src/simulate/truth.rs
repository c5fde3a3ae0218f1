//! The truth of a synthetic night: tables, catalogue, elements and the pipeline.toml that reduces it.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::field::Star;
use super::parts::Part;
use super::scenario::Scenario;
use crate::bands::Band;
use crate::base::error::{Error, Result};
use crate::base::file::{make_folder, write_atomic};
use crate::config::{Instrument, SatelliteEntry};
use crate::tables::{RenderedTruth, Row, StarTruth, TargetTruth};

/// Everything the simulator knows.
#[derive(Debug, Default)]
pub struct Truth {
    pub stars: Vec<StarTruth>,
    pub targets: Vec<TargetTruth>,
    pub rendered: Vec<RenderedTruth>,
    pub catalogue: Vec<Star>,
}

impl Truth {
    /// Writes truth/, catalogue.csv, the elements and pipeline.toml; returns the path of the last.
    pub fn write(&self, parts: &[Part], scenario: &Scenario, folder: &Path) -> Result<PathBuf> {
        let truth = folder.join("truth");
        make_folder(&truth)?;
        table(&truth.join("stars.csv"), &self.stars)?;
        table(&truth.join("target.csv"), &self.targets)?;
        if !self.rendered.is_empty() {
            table(&truth.join("resolved.csv"), &self.rendered)?;
        }
        save(&truth.join("scenario.toml"), &to_toml(scenario)?)?;
        let first = parts.first().map_or(scenario, |part| &part.scenario);
        let mut night = format!("[night]\nname = {:?}\ninput = [\".\"]\noutput = \"satphot-out\"\n\n", scenario.name);
        for (name, part) in [
            ("site", to_toml(&first.site)?),
            ("telescope", to_toml(&first.telescope)?),
            ("detector", to_toml(&first.detector)?),
            ("photometry", to_toml(&first.photometry)?),
        ] {
            // sub-tables of a section need its name in front
            let part = part.replace("\n[", &format!("\n[{name}."));
            let _ = writeln!(night, "[{name}]\n{part}");
        }
        if parts.iter().any(|part| part.scenario.pointings.n > 0) {
            self.write_catalogue(parts, &folder.join("catalogue.csv"))?;
            let [lo, hi] = scenario.field.v_range_mag;
            let _ = writeln!(
                night,
                "[stars]\ncatalogue = \"catalogue.csv\"\nbv_range_mag = [0.2, 0.9]\nv_range_mag = [{lo:?}, {hi:?}]\n"
            );
        }
        let targets: Vec<&Scenario> = parts.iter().map(|part| &part.scenario).filter(|s| s.target.n > 0).collect();
        if let Some(tracked) = targets.first() {
            let from = &scenario.target.elements;
            let elements = std::fs::read(from).map_err(|e| Error::io(from, e))?;
            let name = from.file_name().map_or("elements.tle".into(), |n| n.to_string_lossy().into_owned());
            let to = folder.join(&name);
            if std::fs::canonicalize(&to).ok() != std::fs::canonicalize(from).ok() || !to.exists() {
                write_atomic(&to, &elements)?;
            }
            let _ = writeln!(night, "[orbit]\nelements = {name:?}");
            let several = !scenario.satellites.is_empty();
            if let Some(id) = tracked.target.norad_cat_id.filter(|_| !several) {
                let _ = writeln!(night, "norad_cat_id = {id}");
            }
            let _ = writeln!(night, "\n[model]\nsatellite = {:?}", tracked.target.satellite);
            if !several && tracked.band != Band::V.name() {
                let _ = writeln!(night, "band = {:?}", tracked.band);
            }
            if several {
                night += &of_satellites(&targets)?;
            }
        }
        night += &instruments(parts)?;
        let pipeline = folder.join("pipeline.toml");
        save(&pipeline, &night)?;
        Ok(pipeline)
    }

    /// The catalogue with APASS DR9 column names as VizieR writes them, and a column for each further band; its error is that of
    /// V.
    fn write_catalogue(&self, parts: &[Part], path: &Path) -> Result<()> {
        let Some(first) = parts.first() else { return Ok(()) };
        let err = first.scenario.field.catalogue_err_mag.max(0.001);
        let mut others: Vec<&Scenario> =
            parts.iter().map(|p| &p.scenario).filter(|s| s.band != Band::V.name()).collect();
        others.sort_by(|a, b| a.band.cmp(&b.band));
        others.dedup_by(|a, b| a.band == b.band);
        let mut text = String::from("recno,RAJ2000,DEJ2000,Vmag,e_Vmag,B-V,e_B-V");
        others.iter().for_each(|s| _ = write!(text, ",{0}mag,e_{0}mag", s.band));
        text.push('\n');
        for s in &self.catalogue {
            let _ = write!(
                text,
                "{},{:.7},{:.7},{:.4},{err:.3},{:.4},0.001",
                s.id, s.ra_deg, s.dec_deg, s.catalogue_v_mag, s.b_v_mag
            );
            for other in &others {
                let _ = write!(text, ",{:.4},{err:.3}", s.catalogue_v_mag + other.band_minus_v_mag(s.b_v_mag));
            }
            text.push('\n');
        }
        save(path, &text)
    }
}

/// The models of several satellites, by catalogue number.
fn of_satellites(targets: &[&Scenario]) -> Result<String> {
    let mut entries: Vec<SatelliteEntry> = Vec::new();
    for target in targets.iter().map(|s| &s.target) {
        let Some(number) = target.norad_cat_id else {
            let problem = "each satellite of several needs one".into();
            return Err(Error::Config { key: "satellites.target.norad_cat_id".into(), problem });
        };
        let objects = vec![number.to_string()];
        let entry = SatelliteEntry { objects, norad_cat_id: None, model: Some(target.satellite.clone()) };
        if !entries.contains(&entry) {
            entries.push(entry);
        }
    }
    Ok(format!("\n{}", to_toml(&BTreeMap::from([("satellites", entries)]))?))
}

/// The cameras after the first.
fn instruments(parts: &[Part]) -> Result<String> {
    let mut found: Vec<Instrument> = Vec::new();
    let first = parts.first().map(|part| part.scenario.detector.camera.as_str());
    for s in parts.iter().map(|part| &part.scenario).filter(|s| Some(s.detector.camera.as_str()) != first) {
        if found.iter().any(|other| other.detector.camera == s.detector.camera) {
            continue;
        }
        found.push(Instrument {
            name: s.detector.camera.clone(),
            binning: None,
            detector: s.detector.clone(),
            telescope: Some(s.telescope.clone()),
            clip_radius_px: s.photometry.clip_radius_px,
        });
    }
    if found.is_empty() {
        Ok(String::new())
    } else {
        Ok(format!("\n{}", to_toml(&BTreeMap::from([("instruments", found)]))?))
    }
}

fn to_toml<T: Serialize>(value: &T) -> Result<String> {
    toml::to_string(value).map_err(|e| Error::Config { key: "simulate".into(), problem: e.to_string() })
}

fn save(path: &Path, text: &str) -> Result<()> {
    write_atomic(path, text.as_bytes())
}

fn table<T: Row>(path: &Path, rows: &[T]) -> Result<()> {
    let bad = |e: csv::Error| Error::Table { path: path.into(), line: None, problem: e.to_string() };
    let mut writer = csv::Writer::from_writer(Vec::new());
    for row in rows {
        writer.serialize(row).map_err(bad)?;
    }
    write_atomic(path, &writer.into_inner().map_err(|e| bad(e.into_error().into()))?)
}
