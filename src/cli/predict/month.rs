//! `satphot predict month`: surface brightness of satellites around local midnight, night by night, against limits.

use std::path::PathBuf;

use clap::Args;
use satphot::base::threads::with_threads;
use satphot::base::time::parse_date;
use satphot::brightness::catalogue::Standing;
use satphot::brightness::{Brdf, ModelSettings, Satellite, ToleranceOf};
use satphot::config::{Config, Mode};
use satphot::figures::month as draw;
use satphot::orbit::Site;
use satphot::tables::{Meta, MetaValue, MonthRow, csv_text, write_rows};
use satphot::visibility::forecast::dome::Dome;
use satphot::visibility::forecast::month::{
    MonthSatellite, Night, TrackedLimits, days_in_month, nights, predict_month,
};
use satphot::visibility::forecast::prediction_meta;

use super::super::orbit_args::{SiteArg, bad, configuration, tell_unknown_ut1};
use super::super::{bar::Bars, print, tell, threads};
use super::dome_args::{SamplingArgs, height_km, mode_name, site_of};
use super::month_text::{first_mirrors, summary, table, unlit_notes};
use super::{ModelArgs, OutArgs, tolerance};

/// The satellites of the paper.
const SATELLITES: &str = "starlink-v1.5,starlink-v2,starlink-v3,bluebird-fm1,earendil-1,starcloud,starmind,iss";

const AFTER_HELP: &str = "\
The table gives for every night the median, over directions of the sky and moments around local midnight, of
the mean surface brightness of each satellite; whole areas as published, what the observer
sees of them corrected. A night is named by the local date of its evening. Where less than 2 %
of directions and moments have any light, the satellite is not lit and the cells are empty.

The limits are those of a tracked exposure: 1 and 5 sigma per pixel (--limit-per arcsec2: of an
arcsec2, its pixels summed), under the sky of that night's Moon from a table by phase (V, g, r,
i); with the Moon below the horizon at midnight the sky is dark (corrected). Zeropoint and read
noise are those with which the published limits 21.65/19.67 and 22.56/20.27 come out; the
telescope's own measured zeropoint is 1.8 mag worse (`satphot limits tracked`).

A satellite that is all mirror and whose beam never meets the observer is reported, not drawn.

Examples:
  satphot predict month --month 2025-06 --site -33.7703,151.1113,70 -o month
  satphot predict month --month 2025-06 --site -33.7703,151.1113,70 --mode both
  satphot predict month --date 2025-12-20 --nights 45 --satellite iss,bluebird-fm1 \\
      --site 69.65,18.96,100 --utc-offset-h 1 --csv";

/// Predicts the surface brightness of satellites around local midnight for every night, against detection limits.
#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub struct Month {
    /// Configuration with [site]; pipeline.toml where the arguments leave something open
    #[arg(short, long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Set a key of the configuration (repeatable)
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// Month of the calendar
    #[arg(long, value_name = "YYYY-MM", conflicts_with = "date", required_unless_present = "date")]
    month: Option<String>,
    /// First evening instead, local date
    #[arg(long, value_name = "YYYY-MM-DD")]
    date: Option<String>,
    /// Number of nights [default: those of the month, or 30]
    #[arg(long, value_name = "N")]
    nights: Option<usize>,
    /// Satellites of the catalogue (`satphot satellites` lists them)
    #[arg(long, value_name = "NAME,...", value_delimiter = ',', default_value = SATELLITES)]
    satellite: Vec<String>,
    /// Own satellites, in the form of `satphot satellites NAME --toml` (model.satellites)
    #[arg(long, value_name = "FILE")]
    satellites: Option<PathBuf>,
    #[command(flatten)]
    place: SiteArg,
    /// Local time minus UTC [h] [default: the longitude in whole hours]
    #[arg(long, value_name = "H", allow_hyphen_values = true)]
    utc_offset_h: Option<f64>,
    /// Reading of the published model: corrected, as_published or both
    #[arg(long, value_name = "MODE", default_value = "corrected", value_parser = ["corrected", "as_published", "both"])]
    mode: String,
    /// Relative tolerance of the Earth-reflected integrals
    #[arg(long, value_name = "T", default_value_t = 1e-3, value_parser = tolerance)]
    tolerance: f64,
    /// Number of directions of the sky
    #[arg(long, value_name = "N", default_value_t = 300)]
    points: usize,
    #[command(flatten)]
    sampling: SamplingArgs,
    /// Number of moments of a night
    #[arg(long, value_name = "N", default_value_t = 13)]
    steps: usize,
    /// Time from midnight to the first and to the last of them [h]
    #[arg(long, value_name = "H", default_value_t = 1.0, allow_hyphen_values = true)]
    around_h: f64,
    /// Height of all orbits [km] instead of each satellite's
    #[arg(long, value_name = "KM", allow_hyphen_values = true)]
    height_km: Option<f64>,
    /// Azimuth in which the satellites move [deg]
    #[arg(long, value_name = "DEG", default_value_t = 90.0, allow_hyphen_values = true)]
    track_az_deg: f64,
    #[command(flatten)]
    telescope: TelescopeArgs,
    /// Print comma-separated values instead of a summary
    #[arg(long)]
    csv: bool,
    #[command(flatten)]
    out: OutArgs,
    /// Number of threads; 0 = all cores. The result does not depend on it
    #[arg(short, long, value_name = "N", default_value_t = 0, value_parser = threads)]
    jobs: usize,
    /// Print no progress bar and no notes
    #[arg(short, long)]
    quiet: bool,
}

/// The telescope of the limits.
#[derive(Debug, Clone, Args)]
struct TelescopeArgs {
    /// Surface brightness that gives 1 e-/s in a pixel [mag/arcsec2]
    #[arg(long, value_name = "MAG", default_value_t = 21.62, allow_hyphen_values = true)]
    zp_mag: f64,
    /// Read noise of a pixel [e-]
    #[arg(long, value_name = "E", default_value_t = 2.7, allow_hyphen_values = true)]
    read_noise_e: f64,
    /// Exposure time [s]
    #[arg(long, value_name = "S", default_value_t = 10.0, allow_hyphen_values = true)]
    exptime_s: f64,
    /// Band of the sky's table
    #[arg(long, value_name = "BAND", default_value = "g", value_parser = ["V", "g", "r", "i"])]
    sky_band: String,
    /// What the limits are of: one pixel, or the pixels of one arcsec2 summed
    #[arg(long, value_name = "AREA", default_value = "pixel", value_parser = ["pixel", "arcsec2"])]
    limit_per: String,
    /// Pixel scale for --limit-per arcsec2 [arcsec/px]
    #[arg(long, value_name = "ARCSEC", default_value_t = 0.1957, allow_hyphen_values = true)]
    pixel_scale: f64,
}

impl TelescopeArgs {
    fn limits(&self) -> anyhow::Result<TrackedLimits> {
        if !(self.pixel_scale > 0.0 && self.pixel_scale <= 100.0) {
            return Err(bad("--pixel-scale", format!("{} is outside 0 to 100 arcsec/px", self.pixel_scale)));
        }
        Ok(TrackedLimits {
            zp_mag_arcsec2: self.zp_mag,
            read_noise_e: self.read_noise_e,
            exptime_s: self.exptime_s,
            n_px: if self.limit_per == "arcsec2" { self.pixel_scale.powi(-2) } else { 1.0 },
            band: self.sky_band.clone(),
        })
    }
}

impl Month {
    pub fn execute(self) -> anyhow::Result<()> {
        let given = self.place.given()?;
        let config = configuration(
            self.config.as_deref(),
            &self.sets,
            &given.is_none().then_some("--site").into_iter().collect::<Vec<_>>(),
        )?;
        let place = site_of(given, config.as_ref())?;
        let site = Site::from_config(&place)?;
        let lon_deg = (place.lon_deg + 180.0).rem_euclid(360.0) - 180.0;
        let offset_h = self.utc_offset_h.unwrap_or((lon_deg / 15.0).round());
        if self.utc_offset_h.is_none() && !self.quiet {
            tell(&format!("note: local time is UTC{offset_h:+.0} h by the longitude; --utc-offset-h sets it"));
        }
        let nights = self.nights(offset_h)?;
        if let Some(first) = nights.first() {
            tell_unknown_ut1(&first.midnight, self.quiet);
        }
        let limits = self.telescope.limits()?;
        let satellites = self.all_satellites(&site, config.as_ref())?;
        let bar = Bars::new(!self.quiet);
        let around = (self.around_h, self.steps);
        let rows = with_threads(self.jobs, || predict_month(&site, &satellites, &nights, around, &limits, &bar))??;

        let mut meta = self.meta(config.as_ref(), &place)?;
        meta.push("utc_offset_h", MetaValue::Number(offset_h));
        let (tables, figures) = self.out.files("month")?;
        tables.iter().try_for_each(|table| write_rows(table, &rows, &meta))?;
        let span =
            nights.first().zip(nights.last()).map_or(String::new(), |(a, b)| format!("{} to {}", a.label, b.label));
        let mut written = Vec::new();
        for mode in self.modes() {
            let of_mode: Vec<MonthRow> = rows.iter().filter(|r| r.mode == mode_name(mode)).cloned().collect();
            let title = format!("Surface brightness at local midnight, {span} · {}", mode_name(mode));
            for figure in &figures {
                let path = match self.mode.as_str() {
                    "both" => {
                        let stem = figure.file_stem().unwrap_or_default().to_string_lossy();
                        figure.with_file_name(format!("{stem}_{}.svg", mode_name(mode)))
                    }
                    _ => figure.clone(),
                };
                draw(&path, &of_mode, &title, &unlit_notes(&of_mode))?;
                written.push(path);
            }
        }
        if self.csv {
            print(&csv_text(&rows)?);
        } else {
            for mode in self.modes() {
                let of_mode: Vec<&MonthRow> = rows.iter().filter(|r| r.mode == mode_name(mode)).collect();
                print(&format!("{} · {span}\n{}\n", mode_name(mode), table(&of_mode)));
            }
            print(&summary(&rows));
            self.standings(config.as_ref())?
                .iter()
                .for_each(|(name, s)| print(&format!("model {name}: {}\n", s.text())));
        }
        for row in first_mirrors(&rows).filter(|_| !self.quiet) {
            tell(&format!("note: {} ({}): {}; not drawn", row.object_name, row.mode, row.note));
        }
        for file in tables.iter().chain(&written).filter(|_| !self.quiet) {
            tell(&format!("wrote {}", file.display()));
        }
        Ok(())
    }

    fn modes(&self) -> Vec<Mode> {
        match self.mode.as_str() {
            "both" => vec![Mode::Corrected, Mode::AsPublished],
            "as_published" => vec![Mode::AsPublished],
            _ => vec![Mode::Corrected],
        }
    }

    fn nights(&self, offset_h: f64) -> anyhow::Result<Vec<Night>> {
        if let Some(text) = &self.month {
            let (year, month, first) =
                satphot::base::instant::read_date(&format!("{}-01", text.trim())).map_err(|problem| {
                    bad("--month", format!("\"{text}\" is not a month: {problem}; accepted is a month such as 2025-06"))
                })?;
            let n = days_in_month(year, month)?;
            return Ok(nights((year, month, first), self.nights.unwrap_or(n), offset_h)?);
        }
        let date = parse_date("--date", self.date.as_deref().unwrap_or_default())?;
        Ok(nights(date, self.nights.unwrap_or(30), offset_h)?)
    }

    fn model_of(&self, name: &str, mode: Mode, config: Option<&Config>) -> anyhow::Result<satphot::config::Model> {
        let args = ModelArgs {
            satellite: Some(name.to_string()),
            satellites: self.satellites.clone(),
            mode: Some(mode_name(mode).into()),
            tolerance: Some(self.tolerance),
        };
        let mut model = args.over(config, &self.sets)?;
        self.sampling.over(&mut model);
        Ok(model)
    }

    /// What observations say of each satellite, once for both modes.
    fn standings(&self, config: Option<&Config>) -> anyhow::Result<Vec<(String, Standing)>> {
        let mode = self.modes().first().copied().unwrap_or_default();
        let of = |name: &String| Ok((name.clone(), Standing::of(&self.model_of(name, mode, config)?)?));
        self.satellite.iter().map(of).collect()
    }

    fn all_satellites(&self, site: &Site, config: Option<&Config>) -> anyhow::Result<Vec<MonthSatellite>> {
        let mut all = Vec::new();
        for mode in self.modes() {
            for name in &self.satellite {
                let model = self.model_of(name, mode, config)?;
                let satellite = Satellite::from_config(&model)?;
                let settings = ModelSettings { tolerance_of: ToleranceOf::Total, ..ModelSettings::try_from(&model)? };
                let height_km = height_km(self.height_km, &model)?;
                all.push(MonthSatellite {
                    name: satellite.name.clone(),
                    mode,
                    dome: Dome::new(site, &satellite, &settings, height_km, self.track_az_deg.to_radians())?,
                    points: self.sampling.points(self.points, &model)?,
                    is_mirror: !satellite.surfaces.is_empty()
                        && satellite.surfaces.iter().all(|s| matches!(s.brdf, Brdf::Mirror { .. })),
                });
            }
        }
        Ok(all)
    }

    /// What the table says of itself; of both modes each row names its own.
    fn meta(&self, config: Option<&Config>, place: &satphot::config::Site) -> anyhow::Result<Meta> {
        let first = self.satellite.first().map_or("iss", String::as_str);
        let mode = self.modes().first().copied().unwrap_or_default();
        let model = self.model_of(first, mode, config)?;
        let mut meta = prediction_meta("satphot.month/1", &model, Some(place));
        meta.entries.retain(|(key, _)| key != "satellite" && key != "flags" && !key.starts_with("model_"));
        let standings = self.standings(config)?.into_iter().map(|(name, s)| (name, s.text().into())).collect();
        meta.push("model_standing", MetaValue::Map(standings));
        if self.mode == "both" {
            meta.entries.retain(|(key, _)| key != "effects" && key != "mode");
            meta.push("mode", "both, see the column");
        }
        meta.push("directions", self.sampling.text(self.points, &model));
        meta.push("moments_per_night", self.steps as f64);
        meta.push("around_h", self.around_h);
        let t = &self.telescope;
        let fields = [
            ("zp_mag_arcsec2", t.zp_mag),
            ("read_noise_e", t.read_noise_e),
            ("exptime_s", t.exptime_s),
            ("pix_scale_arcsec", t.pixel_scale),
        ];
        let mut limits: Vec<(String, MetaValue)> = fields.map(|(k, v)| (k.to_string(), v.into())).to_vec();
        limits.push(("per".into(), t.limit_per.clone().into()));
        limits.push(("sky_band".into(), t.sky_band.clone().into()));
        meta.push("limits", MetaValue::Map(limits));
        Ok(meta)
    }
}
