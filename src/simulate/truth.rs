//! The truth of a synthetic night: tables, catalogue, elements and the pipeline.toml that reduces it.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::field::Star;
use super::scenario::Scenario;
use crate::base::error::{Error, Result};
use crate::base::file::{make_folder, write_atomic};
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
    pub fn write(&self, scenario: &Scenario, folder: &Path) -> Result<PathBuf> {
        let truth = folder.join("truth");
        make_folder(&truth)?;
        table(&truth.join("stars.csv"), &self.stars)?;
        table(&truth.join("target.csv"), &self.targets)?;
        if !self.rendered.is_empty() {
            table(&truth.join("resolved.csv"), &self.rendered)?;
        }
        save(&truth.join("scenario.toml"), &to_toml(scenario)?)?;
        let mut night = format!("[night]\nname = {:?}\ninput = [\".\"]\noutput = \"satphot-out\"\n\n", scenario.name);
        for (name, part) in [
            ("site", to_toml(&scenario.site)?),
            ("telescope", to_toml(&scenario.telescope)?),
            ("detector", to_toml(&scenario.detector)?),
            ("photometry", to_toml(&scenario.photometry)?),
        ] {
            // sub-tables of a section need its name in front
            let part = part.replace("\n[", &format!("\n[{name}."));
            let _ = writeln!(night, "[{name}]\n{part}");
        }
        if scenario.pointings.n > 0 {
            self.write_catalogue(scenario, &folder.join("catalogue.csv"))?;
            let [lo, hi] = scenario.field.v_range_mag;
            let _ = writeln!(
                night,
                "[stars]\ncatalogue = \"catalogue.csv\"\nbv_range_mag = [0.2, 0.9]\nv_range_mag = [{lo:?}, {hi:?}]\n"
            );
        }
        if scenario.target.n > 0 {
            let from = &scenario.target.elements;
            let elements = std::fs::read(from).map_err(|e| Error::io(from, e))?;
            let name = from.file_name().map_or("elements.tle".into(), |n| n.to_string_lossy().into_owned());
            let to = folder.join(&name);
            if std::fs::canonicalize(&to).ok() != std::fs::canonicalize(from).ok() || !to.exists() {
                write_atomic(&to, &elements)?;
            }
            let _ = writeln!(night, "[orbit]\nelements = {name:?}");
            if let Some(id) = scenario.target.norad_cat_id {
                let _ = writeln!(night, "norad_cat_id = {id}");
            }
            let _ = writeln!(night, "\n[model]\nsatellite = {:?}", scenario.target.satellite);
        }
        let pipeline = folder.join("pipeline.toml");
        save(&pipeline, &night)?;
        Ok(pipeline)
    }

    /// The catalogue with APASS DR9 column names as VizieR writes them.
    fn write_catalogue(&self, scenario: &Scenario, path: &Path) -> Result<()> {
        let err = scenario.field.catalogue_err_mag.max(0.001);
        let mut text = String::from("recno,RAJ2000,DEJ2000,Vmag,e_Vmag,B-V,e_B-V\n");
        for s in &self.catalogue {
            let _ = writeln!(
                text,
                "{},{:.7},{:.7},{:.4},{err:.3},{:.4},0.001",
                s.id, s.ra_deg, s.dec_deg, s.catalogue_v_mag, s.b_v_mag
            );
        }
        save(path, &text)
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
