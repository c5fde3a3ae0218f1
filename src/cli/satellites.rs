//! `satphot satellites`: what the model knows.

use std::path::PathBuf;

use clap::Args;
use satphot::brightness::catalogue::{Component, Entry, NOT_COMPARED, Shell, Standing};
use satphot::brightness::{Brdf, Catalogue, catalogue_toml};
use satphot::config::{self, Empirical, PhaseLaw};
use satphot::report::summary::text_table;
use satphot::tables::{Definition, SATELLITES, SURFACES};

use super::orbit_args::of_argument;
use super::{print, tell};

const EXAMPLES: &str = "\
Examples:
  satphot satellites                        all of them, one line each
  satphot satellites iss                    surfaces, orbit, counts, parts and sources of one
  satphot satellites iss --toml > own.toml  a copy to change: name, areas, attitudes, scattering
  satphot satellites --satellites own.toml  check that file; its names win over the catalogue's

In pipeline.toml: `satellite = \"iss\"` under [model]; `satellites = \"own.toml\"` for own ones.

Areas are those of the whole surface, not of its projection. An attitude says where its front
points: nadir; sun; sun_azimuth (level, towards the Sun's azimuth); sun_to_nadir (a mirror that
sends sunlight down); sun_one_axis, sun_two_axes (as near to the Sun as the limits allow);
lvlh (x forward, z to nadir); inertial. Backs are black unless given. R(0) and R(60) are the
shares of the light falling in at 0 and 60 deg that leave the front again.";

/// Lists the satellites the model knows, or everything known about one: surfaces, attitudes, scattering, orbits,
/// numbers, parts, sources.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct Satellites {
    /// Show all that is known about this one
    name: Option<String>,
    /// Print in the form of model.satellites, to copy and change
    #[arg(long, conflicts_with = "csv")]
    toml: bool,
    /// Print comma-separated values instead of a table: satellites, or the surfaces of one
    #[arg(long)]
    csv: bool,
    /// Own satellites, as model.satellites
    #[arg(long, value_name = "FILE")]
    satellites: Option<PathBuf>,
}

impl Satellites {
    pub fn execute(self) -> anyhow::Result<()> {
        let catalogue = Catalogue::load(self.satellites.as_deref())?;
        let shown: Vec<Entry> = match &self.name {
            Some(name) => vec![catalogue.find(name).map_err(|e| of_argument("NAME", e))?.clone()],
            None => catalogue.entries().to_vec(),
        };
        if self.toml {
            print(&catalogue_toml(&shown)?);
        } else if self.csv {
            print(&if self.name.is_some() {
                csv(&SURFACES, surfaces(&shown[0])?)?
            } else {
                csv(&SATELLITES, list(&shown))?
            });
        } else if self.name.is_some() {
            print(&whole(&shown[0])?);
        } else {
            let rows: Vec<_> =
                list(&shown).iter().map(|r| [0, 1, 2, 3, 4, 7, 8].map(|i| r[i].clone()).to_vec()).collect();
            print(&text_table(&HEAD, &rows));
        }
        for entry in shown.iter().filter(|_| self.name.is_some()) {
            entry.warnings().iter().for_each(|warning| tell(&format!("note: {warning}")));
        }
        Ok(())
    }
}

const HEAD: [&str; 7] = ["name", "title", "area m2", "surfaces", "orbit", "areas from", "scatter mag"];
const SURFACE_HEAD: [&str; 7] = ["surface", "area m2", "attitude", "scattering", "R(0)", "R(60)", "back"];

/// A line for each satellite.
fn list(entries: &[Entry]) -> Vec<Vec<String>> {
    let source = |e: &Entry| {
        let areas = e.sources.get("areas").map_or("not given", String::as_str);
        areas.split([';', ',', '(']).next().unwrap_or(areas).trim().to_string()
    };
    let row = |e: &Entry| {
        vec![
            e.name.clone(),
            e.title.clone(),
            if e.empirical.is_some() { "-".into() } else { format!("{:.2}", e.area_m2()) },
            match &e.empirical {
                Some(empirical) => format!("none: {}", kind(empirical)),
                None => e.surfaces.iter().map(|s| s.name.as_str()).collect::<Vec<_>>().join(" + "),
            },
            e.orbits.iter().map(short).collect::<Vec<_>>().join(" | "),
            e.counts.as_ref().map_or(String::new(), |c| c.launched.to_string()),
            e.counts.as_ref().map_or(String::new(), |c| c.planned.to_string()),
            source(e),
            e.scatter_mag.map_or(NOT_COMPARED.into(), |s| s.to_string()),
            e.caveat.clone(),
        ]
    };
    entries.iter().map(row).collect()
}

/// What an empirical model is, in a few words.
fn kind(empirical: &Empirical) -> &'static str {
    match empirical {
        Empirical::Polynomial { .. } => "magnitude by phase angle",
        Empirical::Standard { .. } => "standard magnitude",
        Empirical::Sphere { .. } => "diffuse sphere",
    }
}

/// The law of an empirical model, phi in degrees and R in km.
fn equation(empirical: &Empirical) -> String {
    let law = match empirical {
        Empirical::Polynomial { mag_1000km, per_sun_alt_sat, .. } => {
            let term = |x: &str, k: usize, c: &f64| match k {
                0 => format!("{c}"),
                1 => format!("{c:+} {x}"),
                _ => format!("{c:+} {x}^{k}"),
            };
            let phase = mag_1000km.iter().enumerate().map(|(k, c)| term("phi", k, c));
            let sun_alt = per_sun_alt_sat.iter().enumerate().map(|(k, c)| term("h", k + 1, c));
            phase.chain(sun_alt).collect::<Vec<_>>().join(" ")
        }
        Empirical::Standard { mag_1000km, at_phase_deg, law, .. } => {
            let f = match law {
                PhaseLaw::LitFraction => "(1 + cos phi) / 2",
                PhaseLaw::LambertSphere => "[sin phi + (pi - phi) cos phi] / pi",
            };
            format!("{mag_1000km} - 2.5 lg(f(phi) / f({at_phase_deg})), f = {f},")
        }
        Empirical::Sphere { reflecting_area_m2, .. } => {
            format!("that of a diffuse sphere, reflectance times cross-section {reflecting_area_m2} m2,")
        }
    };
    let [low, high] = empirical.phase_deg();
    let sun_alt = match empirical.sun_alt_sat_deg() {
        [-90.0, 90.0] => String::new(),
        [low, high] => format!(", altitudes h of the Sun at the satellite of {low} to {high} deg"),
    };
    format!("V at 1 au of the Sun = {law} + 5 lg(R / 1000 km), phase angles phi of {low} to {high} deg{sun_alt}")
}

/// A line for each surface of one.
fn surfaces(entry: &Entry) -> anyhow::Result<Vec<Vec<String>>> {
    let row = |s: &config::Surface| {
        let front = Brdf::try_from(&s.brdf)?;
        let reflected = |deg: f64| format!("{:.4}", front.hemispherical_reflectance(deg.to_radians()));
        Ok(vec![
            s.name.clone(),
            format!("{:.4}", s.area_m2),
            attitude(&s.attitude),
            law(&s.brdf),
            reflected(0.0),
            reflected(60.0),
            s.back.as_ref().map_or("black".into(), law),
        ])
    };
    entry.surfaces.iter().map(row).collect()
}

/// Everything about one.
fn whole(entry: &Entry) -> anyhow::Result<String> {
    let mut text = format!("{}: {}\n", entry.name, entry.title);
    if !entry.aliases.is_empty() {
        text += &format!("also: {}\n", entry.aliases.join(", "));
    }
    text += &match &entry.empirical {
        Some(empirical) => format!("\n{}\n\n", equation(empirical)),
        None => {
            let surfaces = text_table(&SURFACE_HEAD, &surfaces(entry)?);
            format!("\n{surfaces}total area {:.2} m2\n\n", entry.area_m2())
        }
    };
    for orbit in orbits(entry) {
        text += &format!("orbit: {orbit}\n");
    }
    if let Some(counts) = &entry.counts {
        text += &format!("launched {}, planned {} ({})\n", counts.launched, counts.planned, counts.date);
    }
    if !entry.components.is_empty() {
        text += &format!("\n{}", parts(entry));
    }
    text += &format!("\nobservations: {}\n", Standing::from(entry).text());
    if !entry.notes.is_empty() {
        text += "\n";
        entry.notes.iter().for_each(|note| text += &format!("note: {note}\n"));
    }
    text += "\nsources\n";
    entry.sources.iter().for_each(|(what, source)| text += &format!("  {what}: {source}\n"));
    Ok(text)
}

/// The table of components, and what it sums to next to the areas in use.
fn parts(entry: &Entry) -> String {
    let number = |value: Option<f64>| value.map_or(String::new(), |v| format!("{v}"));
    let row = |c: &Component| {
        vec![
            c.name.clone(),
            c.surface.clone(),
            number(c.length_m),
            number(c.diameter_m),
            c.count.to_string(),
            c.total_m2().map_or(String::new(), |a| format!("{a:.4}")),
            if c.excluded { "excluded".into() } else { String::new() },
        ]
    };
    let rows: Vec<Vec<String>> = entry.components.iter().map(row).collect();
    let mut text = text_table(&["part", "surface", "length m", "diameter m", "count", "area m2", ""], &rows);
    for sum in entry.component_sums() {
        text += &format!(
            "{}: listed sum {:.4} m2, published and used {:.4} m2, difference {:+.4} m2\n",
            sum.surface,
            sum.listed_m2,
            sum.published_m2,
            sum.published_m2 - sum.listed_m2
        );
    }
    text
}

/// Height, and inclination or what else the orbit is called.
fn short(shell: &Shell) -> String {
    match &shell.inclination_deg {
        Some(inclination) => format!("{inclination} deg at {} km", shell.height_km),
        None => format!("{} at {} km", shell.kind, shell.height_km),
    }
}

fn orbits(entry: &Entry) -> Vec<String> {
    let words = |shell: &Shell| match &shell.inclination_deg {
        Some(inclination) => format!("{} km, {inclination} deg, {}", shell.height_km, shell.kind),
        None => format!("{} km, {}", shell.height_km, shell.kind),
    };
    entry.orbits.iter().map(words).collect()
}

/// An attitude on one line.
fn attitude(attitude: &config::Attitude) -> String {
    match attitude {
        config::Attitude::Nadir => "nadir".into(),
        config::Attitude::Sun => "sun".into(),
        config::Attitude::SunOffset { offset_deg } => format!("sun, {offset_deg} deg away from nadir"),
        config::Attitude::SunAzimuth => "sun_azimuth".into(),
        config::Attitude::SunToNadir => "sun_to_nadir".into(),
        config::Attitude::SunOneAxis { axis_lvlh, zero_lvlh, limit_deg } => {
            format!("sun_one_axis about {axis_lvlh:?} from {zero_lvlh:?}, +-{limit_deg} deg")
        }
        config::Attitude::SunTwoAxes { azimuth_limit_deg, elevation_deg: [low, high] } => {
            format!("sun_two_axes, azimuth +-{azimuth_limit_deg} deg, elevation {low} to {high} deg")
        }
        config::Attitude::Lvlh(direction) => format!("lvlh {direction:?}"),
        config::Attitude::Inertial { ra_deg, dec_deg } => format!("inertial ra {ra_deg} dec {dec_deg} deg"),
    }
}

/// A scattering law on one line.
fn law(law: &config::Brdf) -> String {
    match law {
        config::Brdf::Lambert { albedo } => format!("lambert {albedo}"),
        config::Brdf::Phong { kd, ks, n } => format!("phong kd {kd} ks {ks} n {n}"),
        config::Brdf::Binomial { b, c, d, l1 } => format!("binomial b {b:?} c {c:?} d {d} l1 {l1}"),
        config::Brdf::Abg { a, b, g } => format!("abg a {a} b {b} g {g}"),
        config::Brdf::Gaussian { peak_per_sr, sigma } => format!("gaussian peak {peak_per_sr}/sr sigma {sigma}"),
        config::Brdf::Mirror { reflectance } => format!("mirror {reflectance}"),
        config::Brdf::Named { name } => name.clone(),
    }
}

/// Rows as comma-separated values, quoted where needed.
fn csv(table: &Definition, rows: Vec<Vec<String>>) -> anyhow::Result<String> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(table.column_names())?;
    rows.iter().try_for_each(|row| writer.write_record(row))?;
    Ok(String::from_utf8(writer.into_inner().map_err(|e| e.into_error())?)?)
}
