//! A strip of pictures along a pass.

use clap::Args;
use hifitime::Epoch;
use rayon::prelude::*;
use satphot::night::clock::{iso_utc, seconds_between, shifted};
use satphot::orbit::{Tracker, passes};
use satphot::report::radiance::picture::{Tile, write_preview, write_sheet};
use satphot::report::summary::text_table;
use satphot::resolved::{ComponentSatellite, RenderSettings, Rendered, ResolvedScene, render};

use super::super::{print, tell};
use super::bad;
use super::outputs::{PictureOut, peak, tile, total, v_of};

/// Around the instant asked for, where the pass is looked for [s].
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
    /// All pictures at one scale, that of the nearest
    #[arg(long, requires = "pass")]
    one_scale: bool,
    /// Also every picture alone, into the folder of -o
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
        quiet: bool,
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
        if self.one_scale && settings.pixel_rad.is_none() {
            let scene = ResolvedScene::of(satellite, &pass.culmination.geometry);
            let renderer = satphot::resolved::Renderer::new(&scene, &settings)?;
            settings.pixel_rad = Some(renderer.pixel_m() / (pass.culmination.range_km * 1e3));
        }
        settings.check()?;
        let files = out.files(&format!("{}_pass", satellite.name))?;
        if let Some(other) = files.fits.iter().chain(&files.ecsv).find(|_| files.folders.is_empty()) {
            return Err(bad("--out", format!("{}: a strip is a .png, or a folder", other.display())));
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
            let v = v_of(rendered).map_or("no light".into(), |v| format!("V {v:.2}"));
            let clock = iso_utc(*epoch, 0);
            let time = clock.get(11..19).unwrap_or(&clock);
            let captions = vec![format!("{time}  {v}"), format!("{alt_deg:.0} deg {range_km:.0} km"), peak(&sum)];
            rows.push(row(&clock, *alt_deg, rendered));
            tiles.push(tile(image, sum, captions));
        }
        let columns = self.columns.unwrap_or_else(|| (self.frames as f64).sqrt().ceil() as usize);
        let title = format!("{}  {}", satellite.name, iso_utc(pass.culmination.epoch, 0).get(..10).unwrap_or_default());
        for path in &files.png {
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
        print(&text_table(&["UTC", "alt [deg]", "range [km]", "V [mag]", "brightest light", "share [%]"], &rows));
        files.png.iter().filter(|_| !quiet).for_each(|file| tell(&format!("wrote {}", file.display())));
        if let (Some(last), false) = (single.last(), quiet) {
            tell(&format!("wrote {} pictures to {}", single.len(), last.display()));
        }
        Ok(())
    }
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
    ]
}
