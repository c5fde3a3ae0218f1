//! The report of a finished night, from the files of its folder: tables, manifest, pictures, and the model of its skies.
//!
//! Angles in rad between here and the sky, degrees in rows. What is missing in the folder is a note, not an error; only
//! photometry.ecsv must be there.

use std::ffi::OsStr;
use std::path::{Component, Path, PathBuf};

use crate::base::error::{Error, Result};
use crate::base::file::make_folder;
use crate::base::time::from_mjd_utc;
use crate::base::vector::Vector;
use crate::brightness::catalogue::Satellite;
use crate::brightness::scene::local_radius_km;
use crate::brightness::settings::{ModelSettings, ToleranceOf};
use crate::brightness::sky::{Body, Sky, SkyGrid, sky_map};
use crate::config::{self, Config};
use crate::figures::SkyMark;
use crate::orbit::Tracker;
use crate::orbit::earth::Site;
use crate::pipeline::products::curve::model_curve;
use crate::pipeline::products::provenance::Provenance;
use crate::report::page::{
    NightPage, PassSky, write_campaign, write_distribution_figure, write_night_page, write_phase_figure,
    write_sky_figure,
};
use crate::tables::row_passes::passes;
use crate::tables::{
    Meta, MetaValue, PassStackRow, PhotometryRow, SkyRow, read_meta, read_photometry, read_rows, read_stars,
};
use crate::visibility::forecast::dome::Overhead;
use crate::visibility::forecast::sky_rows;
use crate::zeropoint::fit::{NO_ZEROPOINT, Zeropoint};

/// Directions of the model of a sky: altitudes and azimuths.
const GRID: (usize, usize) = (13, 37);
/// Relative tolerance of the model in the disc of a sky: colours need no more.
const TOLERANCE: f64 = 1e-2;
/// Passes whose sky is drawn; a campaign of them would fill the page.
const MOST_SKIES: usize = 12;

/// Reads a folder of results.
///
/// # Errors
/// [`Error::NoInput`] without photometry.ecsv in it; [`Error::Table`] for a table that cannot be read.
pub fn night_page(folder: &Path) -> Result<NightPage> {
    let photometry = folder.join("photometry.ecsv");
    if !photometry.is_file() {
        return Err(Error::NoInput {
            path: folder.to_path_buf(),
            problem: "holds no photometry.ecsv; name the folder of a finished night (`run` writes it)".into(),
        });
    }
    let (rows, meta) = read_photometry(&photometry)?;
    let mut notes = Vec::new();
    let stars = folder.join("stars.ecsv");
    let stars = if stars.is_file() { read_stars(&stars)?.0 } else { Vec::new() };
    let stacks = folder.join("pass_stack.ecsv");
    let stacks = if stacks.is_file() { read_rows::<PassStackRow>(&stacks)?.0 } else { Vec::new() };
    let zeropoint = folder.join("zeropoint.toml");
    let none = std::fs::read_to_string(&zeropoint).is_ok_and(|text| text.starts_with(NO_ZEROPOINT));
    let zeropoint = if zeropoint.is_file() && !none { Some(Zeropoint::read(&zeropoint)?) } else { None };
    let text = |name: &str| std::fs::read_to_string(folder.join(name)).unwrap_or_default();
    let manifest = serde_json::from_str(&text("manifest.json")).unwrap_or_else(|_| {
        notes.push("no readable manifest.json here: flats, inputs and notes of the run are not shown".into());
        serde_json::Value::Null
    });
    let config_toml = text("effective.toml");
    let config = Config::load(&folder.join("effective.toml"), &[]).ok();
    if config.is_none() {
        notes.push("no readable effective.toml here: the skies are without their model, and light curves have it at the frames alone".into());
    }
    let model = config.as_ref().and_then(|c| c.model.as_ref());
    let skies = skies(&rows, &meta, model, &mut notes);
    let curve = config.as_ref().map_or(Ok(Vec::new()), |config| curve(&rows, config)).unwrap_or_else(|error| {
        notes.push(format!("the model is drawn at the frames alone: {error}"));
        Vec::new()
    });
    let name = match meta.get("night") {
        Some(MetaValue::Text(name)) => name.clone(),
        _ => folder.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned()),
    };
    let cards = cards(&text("gallery.html"));
    Ok(NightPage {
        name,
        rows,
        meta,
        stacks,
        stars,
        zeropoint,
        curve,
        skies,
        manifest,
        config_toml,
        cards,
        notes,
        frames_elsewhere: None,
    })
}

/// Writes `report.html` of a folder of results, there or elsewhere; returns its path.
///
/// # Errors
/// As [`night_page`], and [`Error::Io`].
pub fn write_report(folder: &Path, out: Option<&Path>) -> Result<PathBuf> {
    let path = out.map_or_else(|| folder.join("report.html"), Path::to_path_buf);
    write_night_page(&path, &night_page(folder)?)?;
    Provenance::of_meta(&read_meta(&folder.join("photometry.ecsv"))?).stamp(&path)?;
    Ok(path)
}

/// Writes `report.html` of a folder of results and, as figures, the parts of it that other figures do not hold:
/// `figures/sky.svg`, `figures/distribution.svg` and `figures/phase.svg`; returns the paths.
///
/// # Errors
/// As [`night_page`], and [`Error::Io`].
pub fn write_report_and_figures(folder: &Path) -> Result<Vec<PathBuf>> {
    let page = night_page(folder)?;
    let figures = folder.join("figures");
    make_folder(&figures)?;
    let figure = |name: &str| figures.join(name);
    let paths = vec![folder.join("report.html"), figure("sky.svg"), figure("distribution.svg"), figure("phase.svg")];
    write_night_page(&paths[0], &page)?;
    write_sky_figure(&paths[1], &page)?;
    write_distribution_figure(&paths[2], &page)?;
    write_phase_figure(&paths[3], &page)?;
    let provenance = Provenance::of_meta(&read_meta(&folder.join("photometry.ecsv"))?);
    paths.iter().try_for_each(|path| provenance.stamp(path))?;
    Ok(paths)
}

/// Writes the page of several nights in order of their dates, which links to the report of each that has one; returns
/// what should be known: nights to which no link leads, and why.
///
/// # Errors
/// As [`night_page`], and [`Error::Io`].
pub fn write_campaign_report(folders: &[PathBuf], out: &Path) -> Result<Vec<String>> {
    let base = out.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let (mut nights, mut notes) = (Vec::new(), Vec::new());
    for folder in folders {
        let report = folder.join("report.html");
        let link = if report.is_file() { relative(base, &report) } else { None };
        if link.is_none() {
            let why = if report.is_file() { "no relative path leads there" } else { "it has no report.html" };
            notes.push(format!("no link to the night in {}: {why} (`report` writes it)", folder.display()));
        }
        nights.push(NightPage { frames_elsewhere: Some(link.unwrap_or_default()), ..night_page(folder)? });
    }
    let start = |n: &NightPage| n.rows.iter().filter_map(|r| r.mjd_mid_d).fold(f64::INFINITY, f64::min);
    nights.sort_by(|a, b| start(a).total_cmp(&start(b)).then_with(|| a.name.cmp(&b.name)));
    write_campaign(out, &nights)?;
    Ok(notes)
}

/// A link from a folder to a file, up with `..` where it lies elsewhere; `None` where no such path leads, as between
/// drives.
fn relative(base: &Path, file: &Path) -> Option<String> {
    let (base, file) = (base.canonicalize().ok()?, file.canonicalize().ok()?);
    let (from, to): (Vec<Component>, Vec<Component>) = (base.components().collect(), file.components().collect());
    let common = from.iter().zip(&to).take_while(|(a, b)| a == b).count();
    if common == 0 {
        return None;
    }
    let up = std::iter::repeat_n("..".to_owned(), from.len() - common);
    let down = to[common..].iter().map(|part| in_link(part.as_os_str()));
    Some(up.chain(down).collect::<Vec<_>>().join("/"))
}

/// A name as part of a link: what means something there is written as `%` and its bytes.
fn in_link(name: &OsStr) -> String {
    let mut text = String::new();
    for chunk in name.as_encoded_bytes().utf8_chunks() {
        for c in chunk.valid().chars() {
            if c.is_alphanumeric() || "-._~+,=@()".contains(c) {
                text.push(c);
            } else {
                c.encode_utf8(&mut [0; 4]).bytes().for_each(|b| text += &format!("%{b:02X}"));
            }
        }
        chunk.invalid().iter().for_each(|b| text += &format!("%{b:02X}"));
    }
    text
}

/// The cards of a gallery with the ids of their frames.
fn cards(gallery: &str) -> Vec<(String, String)> {
    let Some((_, rest)) = gallery.split_once("<ol id=\"gallery\">") else { return Vec::new() };
    let Some((list, _)) = rest.split_once("</ol>") else { return Vec::new() };
    let card = |part: &str| {
        let id = part.split_once('"')?.0;
        Some((id.to_string(), format!("<li id=\"{part}")))
    };
    list.split("<li id=\"").skip(1).filter_map(card).collect()
}

/// The model between the frames; nothing without orbit and model.
fn curve(rows: &[PhotometryRow], config: &Config) -> Result<Vec<PhotometryRow>> {
    match (&config.orbit, &config.model) {
        (Some(orbit), Some(model)) => model_curve(rows, &Tracker::from_config(orbit, &config.site)?, model),
        _ => Ok(Vec::new()),
    }
}

/// Sun, Moon, frames and model of every pass.
fn skies(rows: &[PhotometryRow], meta: &Meta, model: Option<&config::Model>, notes: &mut Vec<String>) -> Vec<PassSky> {
    let all = passes(rows);
    if all.len() > MOST_SKIES {
        notes.push(format!("the skies of the first {MOST_SKIES} of {} passes are drawn", all.len()));
    }
    let site = site(meta);
    let mut drawn = Vec::new();
    for (i, pass) in all.iter().take(MOST_SKIES).enumerate() {
        let (Some(first), Some(middle)) = (pass.first(), pass.get(pass.len() / 2)) else { continue };
        let clock: String = first.date_mid.chars().take(19).collect();
        let mut sky = PassSky {
            title: format!("Pass {}: {} from {}", i + 1, first.object_name, clock.replace('T', " ")),
            track: pass.iter().map(|r| (*r).clone()).collect(),
            grid: GRID,
            ..PassSky::default()
        };
        if let Some(site) = &site {
            match lit_sky(site, middle, pass, model) {
                Ok((marks, cells)) => (sky.marks, sky.cells) = (marks, cells),
                Err(error) => notes.push(format!("{}: no model of its sky: {error}", sky.title)),
            }
        }
        drawn.push(sky);
    }
    drawn
}

/// The site of the meta block.
fn site(meta: &Meta) -> Option<Site> {
    let number = |field| meta.number_in("site", field);
    Site::new(number("lat_deg")?, number("lon_deg")?, number("alt_m")?).ok()
}

/// Sun and Moon at the middle of a pass, and the model in every direction at the height of the satellite.
fn lit_sky(
    site: &Site,
    middle: &PhotometryRow,
    pass: &[&PhotometryRow],
    model: Option<&config::Model>,
) -> Result<(Vec<SkyMark>, Vec<SkyRow>)> {
    let epoch = from_mjd_utc(middle.mjd_mid_d.unwrap_or(f64::NAN));
    let Overhead { sun, moon, sidereal_rad, .. } = Overhead::at(site, &epoch)?;
    let mark = |name: &str, b: &Body| SkyMark {
        name: name.into(),
        alt_deg: b.alt_rad.to_degrees(),
        az_deg: b.az_rad.to_degrees(),
    };
    let marks = vec![mark("Sun", &sun), mark("Moon", &moon)];
    let radius_km = local_radius_km(&site.position());
    let (Some(model), Some(height_km)) = (model, height_km(middle, radius_km)) else { return Ok((marks, Vec::new())) };
    let axes =
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|[x, y, z]| site.from_enu(&Vector::new(x, y, z)));
    let mut sky = Sky::new(axes, (radius_km, height_km), track_az_rad(pass), sun, Some(moon))?;
    sky.sidereal_rad = sidereal_rad;
    let settings =
        ModelSettings { tolerance: TOLERANCE, tolerance_of: ToleranceOf::Total, ..ModelSettings::try_from(model)? };
    let map = sky_map(&sky, &SkyGrid::new(GRID.0, GRID.1)?, &Satellite::from_config(model)?, &settings, &|| ())?;
    Ok((marks, sky_rows(&map)))
}

/// Height of the satellite over a sphere through the observer: h = √(R² + d² + 2 R d sin a) − R \[km\].
fn height_km(row: &PhotometryRow, radius_km: f64) -> Option<f64> {
    let (d, sin_a) = (row.range_km?, row.alt_deg?.to_radians().sin());
    let h = (radius_km * radius_km + d * d + 2.0 * radius_km * d * sin_a).sqrt() - radius_km;
    (h > 1.0).then_some(h)
}

/// Azimuth of the motion over the ground: from the first to the last frame of a pass, each seen from above.
fn track_az_rad(pass: &[&PhotometryRow]) -> f64 {
    let ground = |r: &&PhotometryRow| {
        let (d, alt, az) = (r.range_km?, r.alt_deg?.to_radians(), r.az_deg?.to_radians());
        Some((d * alt.cos() * az.sin(), d * alt.cos() * az.cos()))
    };
    match (pass.first().and_then(ground), pass.last().and_then(ground)) {
        (Some(a), Some(b)) if a != b => (b.0 - a.0).atan2(b.1 - a.1).rem_euclid(std::f64::consts::TAU),
        _ => 0.0,
    }
}
