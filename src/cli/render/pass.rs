//! A strip of pictures along a pass.

use clap::Args;
use hifitime::Epoch;
use rayon::prelude::*;
use satphot::base::time::{iso_utc, seconds_between, shifted};
use satphot::figures::radiance::picture::{Tile, write_preview, write_sheet};
use satphot::orbit::{Tracker, passes};
use satphot::report::summary::text_table;
use satphot::resolved::body::PosedBody;
use satphot::resolved::view::View;
use satphot::resolved::{ComponentSatellite, RenderSettings, Rendered, ResolvedScene, render};
use satphot::tables::STRIP;

use super::super::{print, tell};
use super::bad;
use super::files::PictureOut;
use super::outputs::{laws, peak, tile, total, v_of, v_text};

/// Around the instant requested, where the pass is looked for [s].
const REACH_S: f64 = 3600.0;

/// A pass instead of an instant.
#[derive(Debug, Clone, Args)]
pub struct PassArgs {
    /// A strip of pictures along the pass about --time, or the next one within an hour
    #[arg(long)]
    pass: bool,
    /// Pictures of the strip
    #[arg(long, value_name = "N", default_value_t = 60, requires = "pass")]
    frames: usize,
    /// Pictures side by side [default: as wide as high]
    #[arg(long, value_name = "N", requires = "pass")]
    columns: Option<usize>,
    /// The part of the pass above this altitude [deg]
    #[arg(long, value_name = "DEG", default_value_t = 10.0, requires = "pass")]
    min_alt: f64,
    /// Pixels along a side of each picture of the strip
    #[arg(long, value_name = "N", default_value_t = 192, requires = "pass")]
    frame_pixels: usize,
    /// All pictures at one scale, at which the largest fills its picture
    #[arg(long, requires = "pass")]
    one_scale: bool,
    /// Also every picture alone, into the folder of -o (which must be one)
    #[arg(long, requires = "pass")]
    single: bool,
}

impl PassArgs {
    pub fn wanted(&self) -> bool {
        self.pass
    }

    pub fn execute(
        &self,
        satellite: &ComponentSatellite,
        tracker: &Tracker,
        about: &Epoch,
        settings: &RenderSettings,
        out: &PictureOut,
        (csv, quiet): (bool, bool),
    ) -> anyhow::Result<()> {
        if !(1..=600).contains(&self.frames) {
            return Err(bad("--frames", format!("{}; accepted is 1 to 600", self.frames)));
        }
        if !(0.0..90.0).contains(&self.min_alt) {
            return Err(bad("--min-alt", format!("{} is outside 0 to 90 deg", self.min_alt)));
        }
        let found = passes(tracker, &shifted(*about, -REACH_S), &shifted(*about, REACH_S), self.min_alt.to_radians())?;
        let distance = |p: &satphot::orbit::Pass| seconds_between(p.culmination.epoch, *about).abs();
        let pass = found.iter().min_by(|a, b| distance(a).total_cmp(&distance(b))).ok_or_else(|| {
            bad("--pass", format!("no pass above {} deg within an hour of {}", self.min_alt, iso_utc(*about, 0)))
        })?;
        let length_s = seconds_between(pass.rise.epoch, pass.set.epoch).abs();
        let epochs: Vec<Epoch> = (0..self.frames)
            .map(|k| shifted(pass.rise.epoch, length_s * (k as f64 + 0.5) / self.frames as f64))
            .collect();
        let mut settings = RenderSettings { pixels: self.frame_pixels, ..settings.clone() };
        settings.check()?;
        let files = out.files(&format!("{}_pass", satellite.name), false)?;
        if let Some(other) = files.picture.fits.iter().chain(&files.picture.ecsv).find(|_| files.folders.is_empty()) {
            return Err(bad(
                "--out",
                format!("{}: a strip is a .png, or a folder; --csv prints the table", other.display()),
            ));
        }
        if self.single && files.folders.is_empty() {
            return Err(bad("--single", "puts the pictures into a folder: name one with -o, e.g. -o pass/".into()));
        }
        files.make_folders()?;
        if self.one_scale && settings.pixel_rad.is_none() {
            let scale = |epoch: &Epoch| one_scale_rad(satellite, tracker, epoch, &settings);
            let scales = epochs.par_iter().map(scale).collect::<satphot::Result<Vec<f64>>>()?;
            settings.pixel_rad = scales.into_iter().reduce(f64::max);
        }
        let frames: Vec<(Rendered, f64, f64)> = epochs
            .par_iter()
            .map(|epoch| {
                let geometry = tracker.at(epoch)?;
                let rendered = render(&ResolvedScene::of(satellite, &geometry), &settings)?;
                Ok((rendered, geometry.alt_rad.to_degrees(), geometry.range_km))
            })
            .collect::<satphot::Result<_>>()?;
        let mut tiles: Vec<Tile> = Vec::new();
        let mut rows = Vec::new();
        for (epoch, (rendered, alt_deg, range_km)) in epochs.iter().zip(&frames) {
            let (image, sum) = (&rendered.image, total(&rendered.image));
            let v = v_text(v_of(rendered), rendered.whole);
            let clock = iso_utc(*epoch, 0);
            let time = clock.get(11..19).unwrap_or(&clock);
            let place = format!("{alt_deg:.0} deg {range_km:.0} km");
            let captions = [format!("{time}  {v}"), place].into_iter().chain(peak(&sum, image)).collect();
            rows.push(row(&clock, *alt_deg, rendered));
            tiles.push(tile(image, sum, captions));
        }
        let columns = self.columns.unwrap_or_else(|| (self.frames as f64).sqrt().ceil() as usize);
        let title = format!("{}  {}", satellite.name, iso_utc(pass.culmination.epoch, 0).get(..10).unwrap_or_default());
        for path in &files.picture.png {
            write_sheet(path, &title, &tiles, columns)?;
        }
        let mut single = Vec::new();
        for folder in files.folders.iter().filter(|_| self.single) {
            for (k, tile) in tiles.iter().enumerate() {
                let path = folder.join(format!("{}_{:03}.png", satellite.name, k + 1));
                write_preview(&path, tile)?;
                single.push(path);
            }
        }
        if csv {
            print(&STRIP.csv_head());
            rows.iter().for_each(|row| print(&format!("{}\n", row.join(","))));
        } else {
            let head = ["UTC", "alt [deg]", "range [km]", "V [mag]", "brightest light", "share [%]", "whole"];
            print(&text_table(&head, &rows));
        }
        if quiet {
            return Ok(());
        }
        laws(satellite).into_iter().for_each(|line| tell(&format!("note: {line}")));
        let parts = frames.iter().filter(|(rendered, ..)| !rendered.whole).count();
        if parts > 0 {
            tell(&format!(
                "note: in {parts} pictures the satellite reaches beyond the picture: V is that of the part in it"
            ));
        }
        files.picture.png.iter().for_each(|file| tell(&format!("wrote {}", file.display())));
        if let (Some(first), Some(last)) = (single.first(), single.last()) {
            tell(&format!("wrote {} pictures, {} to {}", single.len(), first.display(), last.display()));
        }
        Ok(())
    }
}

/// The pixel with which the satellite fills its picture at an instant \[rad\].
fn one_scale_rad(
    satellite: &ComponentSatellite,
    tracker: &Tracker,
    epoch: &Epoch,
    settings: &RenderSettings,
) -> satphot::Result<f64> {
    let geometry = tracker.at(epoch)?;
    let scene = ResolvedScene::of(satellite, &geometry).scene;
    let body = PosedBody::new(satellite, &scene, settings.sides)?;
    let toward = (scene.observer_km - scene.satellite_km).unit();
    let toward = toward.ok_or_else(|| satphot::Error::Model { problem: "the satellite is at the observer".into() })?;
    Ok(View::new(&body, &toward)?.filling_pixel_m(settings.pixels) / (geometry.range_km * 1e3))
}

fn row(time: &str, alt_deg: f64, rendered: &Rendered) -> Vec<String> {
    let image = &rendered.image;
    let total: f64 = image.planes.iter().map(|(l, _)| image.irradiance_w_m2(*l)).sum();
    let brightest =
        image.planes.iter().map(|(l, _)| (*l, image.irradiance_w_m2(*l))).max_by(|a, b| a.1.total_cmp(&b.1));
    let (name, share) = match brightest {
        Some((light, e)) if total > 0.0 => (light.name().to_owned(), format!("{:.1}", 100.0 * e / total)),
        _ => ("none".into(), String::new()),
    };
    vec![
        time.to_owned(),
        format!("{alt_deg:.1}"),
        format!("{:.1}", image.range_km),
        v_of(rendered).map_or(String::new(), |v| format!("{v:.2}")),
        name,
        share,
        if rendered.whole { "yes" } else { "part" }.into(),
    ]
}
