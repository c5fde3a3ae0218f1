//! Where a picture goes: FITS, PNG, table.

use std::path::{Path, PathBuf};

use clap::Args;
use ndarray::Array2;
use satphot::Error;
use satphot::brightness::lamps::mag_of_flux;
use satphot::night::clock::iso_utc;
use satphot::orbit::Geometry;
use satphot::report::Meta;
use satphot::report::radiance::fits::{PictureFacts, write_picture};
use satphot::report::radiance::picture::{Tile, write_preview, write_sheet};
use satphot::report::radiance::{RadianceRow, write_radiance};
use satphot::resolved::{ComponentSatellite, RadianceImage, RenderSettings, Rendered};

use super::super::tell;
use super::bad;

/// Where pictures go.
#[derive(Debug, Clone, Args)]
pub struct PictureOut {
    /// Folder for everything, or a file: .fits the picture, .png the preview, .ecsv the table (repeatable)
    #[arg(short, long, value_name = "DIR|FILE")]
    out: Vec<PathBuf>,
    /// Also a PNG with one panel for each light
    #[arg(long, value_name = "FILE.png")]
    lights_png: Option<PathBuf>,
}

/// A picture and all that is told of it.
pub struct Shown<'a> {
    pub satellite: &'a ComponentSatellite,
    pub rendered: &'a Rendered,
    pub rows: &'a [RadianceRow],
    pub geometry: &'a Geometry,
    pub settings: &'a RenderSettings,
    pub quiet: bool,
}

/// Files by their kind.
#[derive(Default)]
pub struct Files {
    pub fits: Vec<PathBuf>,
    pub png: Vec<PathBuf>,
    pub ecsv: Vec<PathBuf>,
    pub folders: Vec<PathBuf>,
}

impl PictureOut {
    /// The files to write, folders made.
    pub fn files(&self, stem: &str) -> anyhow::Result<Files> {
        let mut files = Files::default();
        let made = |folder: &Path| std::fs::create_dir_all(folder).map_err(|e| Error::io(folder, e));
        for out in &self.out {
            let parent = out.parent().filter(|p| !p.as_os_str().is_empty());
            match out.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase).as_deref() {
                Some("fits" | "fit" | "fts") => files.fits.push(out.clone()),
                Some("png") => files.png.push(out.clone()),
                Some("ecsv") => files.ecsv.push(out.clone()),
                Some("svg" | "jpg" | "jpeg" | "csv" | "txt" | "dat" | "pdf") => {
                    let problem = format!("{} is neither .fits, .png nor .ecsv; --csv prints CSV", out.display());
                    return Err(bad("--out", problem));
                }
                _ => {
                    made(out)?;
                    files.fits.push(out.join(format!("{stem}.fits")));
                    files.png.push(out.join(format!("{stem}.png")));
                    files.ecsv.push(out.join(format!("{stem}.ecsv")));
                    files.folders.push(out.clone());
                    continue;
                }
            }
            parent.map_or(Ok(()), made)?;
        }
        Ok(files)
    }

    /// Takes the single .fits files away, and names one in every folder: they are for the frame of a sensor.
    pub fn take_fits(&mut self, stem: &str) -> anyhow::Result<Vec<PathBuf>> {
        let files = self.files(stem)?;
        let in_folder = |path: &PathBuf| files.folders.iter().any(|folder| path.parent() == Some(folder));
        let mut frames: Vec<PathBuf> = files.fits.iter().filter(|path| !in_folder(path)).cloned().collect();
        self.out.retain(|out| !frames.contains(out));
        frames.extend(files.folders.iter().map(|folder| folder.join(format!("{stem}_frame.fits"))));
        Ok(frames)
    }

    /// Writes a picture.
    pub fn write(&self, shown: &Shown) -> anyhow::Result<()> {
        let files = self.files(&shown.satellite.name)?;
        let (image, g) = (&shown.rendered.image, shown.geometry);
        let v_mag = v_of(shown.rendered);
        let facts = PictureFacts {
            object: shown.satellite.title.clone(),
            date_mid: iso_utc(g.epoch, 3),
            v_mag,
            alt_az_deg: Some((g.alt_rad.to_degrees(), g.az_rad.to_degrees())),
            comments: shown.satellite.notes.iter().chain(&shown.rendered.warnings).cloned().collect(),
        };
        for path in &files.fits {
            write_picture(path, image, &facts)?;
        }
        for path in &files.png {
            write_preview(path, &tile(image, total(image), captions(shown)))?;
        }
        if let Some(path) = &self.lights_png {
            let mut tiles = vec![tile(image, total(image), vec!["all lights".into(), peak(&total(image))])];
            for (light, plane) in &image.planes {
                let v = shown.rendered.v_flux.iter().find(|(l, _)| l == light).and_then(|(_, v)| mag_of_flux(*v));
                let v = v.map_or("no light".into(), |v| format!("V {v:.2}"));
                tiles.push(tile(image, plane.clone(), vec![format!("{}  {v}", light.name()), peak(plane)]));
            }
            write_sheet(path, &heading(shown), &tiles, 3)?;
        }
        for path in &files.ecsv {
            write_radiance(path, shown.rows, &meta(shown))?;
        }
        let written = files.fits.iter().chain(&files.png).chain(&self.lights_png).chain(&files.ecsv);
        written.filter(|_| !shown.quiet).for_each(|file| tell(&format!("wrote {}", file.display())));
        Ok(())
    }
}

/// Sum of the lights.
pub fn total(image: &RadianceImage) -> Array2<f64> {
    let shape = image.planes.first().map_or((0, 0), |(_, plane)| plane.dim());
    image.planes.iter().fold(Array2::zeros(shape), |sum, (_, plane)| sum + plane)
}

/// V of all lights.
pub fn v_of(rendered: &Rendered) -> Option<f64> {
    mag_of_flux(rendered.v_flux.iter().map(|(_, v)| v).sum())
}

/// A picture with its scales.
pub fn tile(image: &RadianceImage, radiance: Array2<f64>, captions: Vec<String>) -> Tile {
    Tile {
        radiance,
        captions,
        pixel_m: image.pixel_rad * image.range_km * 1e3,
        pixel_arcsec: image.pixel_rad.to_degrees() * 3600.0,
        white: None,
    }
}

/// The radiance shown white.
pub fn peak(plane: &Array2<f64>) -> String {
    format!("white {:.2e} W/m2/sr", plane.iter().copied().fold(0.0, f64::max))
}

fn heading(shown: &Shown) -> String {
    format!("{}  {} UTC", shown.satellite.name, iso_utc(shown.geometry.epoch, 0).trim_end_matches('Z'))
}

fn captions(shown: &Shown) -> Vec<String> {
    let g = shown.geometry;
    let v = v_of(shown.rendered).map_or("no light".into(), |v| format!("V {v:.2}"));
    let place = format!("{:.0} km, altitude {:.1} deg", g.range_km, g.alt_rad.to_degrees());
    vec![heading(shown), format!("{v}  {place}"), peak(&total(&shown.rendered.image))]
}

fn meta(shown: &Shown) -> Meta {
    let (g, s, image) = (shown.geometry, shown.settings, &shown.rendered.image);
    let mut meta = Meta::default();
    meta.push("schema", "satphot.radiance/1");
    meta.push("satellite", shown.satellite.name.clone());
    meta.push("date_mid", iso_utc(g.epoch, 3));
    meta.push("range_km", g.range_km);
    meta.push("alt_deg", g.alt_rad.to_degrees());
    meta.push("az_deg", g.az_rad.to_degrees());
    meta.push("band_low_um", image.band_um.0);
    meta.push("band_high_um", image.band_um.1);
    meta.push("pixel_arcsec", image.pixel_rad.to_degrees() * 3600.0);
    meta.push("pixels", s.pixels as f64);
    meta.push("samples", s.samples as f64);
    meta.push("earth_rays", s.earth_rays as f64);
    meta.push("seen_area_m2", shown.rendered.seen_area_m2);
    meta.push("convex", if shown.rendered.convex { "yes: no shadow rays needed" } else { "no" });
    match s.uniform_earth_w_cm2_sr_um {
        Some(l) => meta.push("uniform_earth_w_cm2_sr_um", l),
        None => meta.push("earth", format!("{:?}", s.model.earth)),
    }
    meta
}
