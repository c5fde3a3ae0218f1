//! `satphot limits tracked`: the exposure-time calculator of a telescope that follows the satellite.

mod figure;
pub(in crate::cli) mod instrument;
mod sky;
mod text;

use clap::Args;
use satphot::tables::{LimitRow, Meta, MetaValue, csv_text, write_rows};
use satphot::visibility::tracked::Area;

use super::super::orbit_args::bad;
use super::super::predict::OutArgs;
use super::super::{print, tell};
use instrument::{Instrument, InstrumentArgs};
use sky::{SkyArgs, SkyCase};

/// Square arcseconds of a steradian.
const ARCSEC2_PER_SR: f64 = 4.254_517_029_615_221e10;
/// Area of the ISS \[m²\] and the distance the paper puts it at \[km\].
const ISS_AREA_M2: f64 = 4_250.25;
const ISS_RANGE_KM: f64 = 400.0;

const AFTER_HELP: &str = "\
S = (k^2 + sqrt(k^4 + 4 k^2 N))/2 electrons give a signal-to-noise ratio of k over
N = (sky + dark) t + n RN^2, n exposures; the limit is ZP - 2.5 lg(S/t). The four limits are
for light that fills one pixel or one arcsec2 (surface brightnesses), a point source
(2.266 FWHM^2), and an extended target (its solid angle and that of a star).

Without options: the CDK24 of Macquarie with its ASI6200MM at gain setting 200, no filter,
10 s, under full and new Moon, and the ISS as the extended target. Every number
used is printed with its source.

Examples:
  satphot limits tracked
  satphot limits tracked -c pipeline.toml --exptime-s 5 --subs 5 --fwhm-arcsec 2.5
  satphot limits tracked --mag 12.02 --snr 5,100 -o limits
  satphot limits tracked --band r --moon-phase-deg 20 --moon-alt-deg 40 --alt-deg 60
  satphot limits tracked --by-moon --csv
  satphot limits tracked --sky-mag 20.1 --omega-arcsec2 300
The published limits 21.65, 19.67 (full Moon) and 22.56, 20.27 (new Moon), of one pixel, in the
g sky of the DECam calculator:
  satphot limits tracked --band g --zp-pixel-mag 21.624 --read-noise-e 2.7 --dark-e-s 0";

/// Faintest magnitudes of a telescope that follows the satellite, and the exposure a magnitude needs.
#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub struct Tracked {
    #[command(flatten)]
    instrument: InstrumentArgs,
    #[command(flatten)]
    sky: SkyArgs,
    /// Exposure time, all exposures together [s]
    #[arg(long, value_name = "S", default_value_t = 10.0, allow_hyphen_values = true)]
    exptime_s: f64,
    /// Number of exposures the time is split into
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    subs: u32,
    /// Signal-to-noise ratios of the limits
    #[arg(long, value_name = "K,...", value_delimiter = ',', default_value = "1,5", allow_hyphen_values = true)]
    snr: Vec<f64>,
    /// Magnitude of a target (all its light): its signal-to-noise ratio, and the time it needs
    #[arg(long, value_name = "MAG", allow_hyphen_values = true)]
    mag: Option<f64>,
    /// Area of the extended target [m2], seen face on
    #[arg(long, value_name = "M2", default_value_t = ISS_AREA_M2, allow_hyphen_values = true)]
    area_m2: f64,
    /// Distance of the extended target [km]
    #[arg(long, value_name = "KM", default_value_t = ISS_RANGE_KM, allow_hyphen_values = true)]
    range_km: f64,
    /// Solid angle of the extended target [arcsec2] instead of area and distance
    #[arg(long, value_name = "ARCSEC2", conflicts_with_all = ["area_m2", "range_km"], allow_hyphen_values = true)]
    omega_arcsec2: Option<f64>,
    /// Print comma-separated values instead of tables
    #[arg(long)]
    csv: bool,
    #[command(flatten)]
    out: OutArgs,
    /// Print no notes
    #[arg(short, long)]
    quiet: bool,
}

impl Tracked {
    pub fn execute(self) -> anyhow::Result<()> {
        let omega_arcsec2 = self.omega_arcsec2()?;
        self.check()?;
        let instrument = self.instrument.instrument()?;
        let skies = self.sky.cases(&instrument.sky_band)?;
        let areas = [Area::Pixel, Area::Arcsec2, Area::Point, Area::Extended(omega_arcsec2)];
        let mut rows = Vec::new();
        for sky in &skies {
            for k in &self.snr {
                for area in areas {
                    rows.push(self.row(&instrument, sky, area, *k)?);
                }
            }
        }
        if self.csv {
            print(&csv_text(&rows)?);
        } else {
            print(&self.text(&instrument, &skies, omega_arcsec2, &rows)?);
        }
        if !self.quiet {
            self.notes(&instrument, &rows);
        }
        let (tables, figures) = self.out.files("limits")?;
        if !tables.is_empty() {
            let meta = self.meta(&instrument, omega_arcsec2);
            tables.iter().try_for_each(|table| write_rows(table, &rows, &meta))?;
        }
        figures.iter().try_for_each(|path| figure::draw(path, &self, &instrument, &skies, omega_arcsec2))?;
        for file in tables.iter().chain(&figures).filter(|_| !self.quiet) {
            tell(&format!("wrote {}", file.display()));
        }
        Ok(())
    }

    fn check(&self) -> anyhow::Result<()> {
        if !(self.exptime_s > 0.0 && self.exptime_s <= 1e9) {
            return Err(bad("--exptime-s", format!("{} is not above 0 and at most 1e9 s", self.exptime_s)));
        }
        if let Some(k) = self.snr.iter().find(|k| !(**k > 0.0 && k.is_finite())) {
            return Err(bad("--snr", format!("{k} is not above 0; give a positive number")));
        }
        if let Some(mag) = self.mag.filter(|mag| !(mag.abs() <= 100.0)) {
            return Err(bad("--mag", format!("{mag} is outside -100 to 100")));
        }
        Ok(())
    }

    /// Solid angle of the extended target: given, or area over distance squared.
    fn omega_arcsec2(&self) -> anyhow::Result<f64> {
        let positive = |key: &str, value: f64| {
            let good = value > 0.0 && value.is_finite();
            if good { Ok(value) } else { Err(bad(key, format!("{value} is not above 0; give a positive number"))) }
        };
        if let Some(omega) = self.omega_arcsec2 {
            return positive("--omega-arcsec2", omega);
        }
        let range_m = positive("--range-km", self.range_km)? * 1e3;
        Ok(positive("--area-m2", self.area_m2)? / range_m.powi(2) * ARCSEC2_PER_SR)
    }

    fn row(&self, instrument: &Instrument, sky: &SkyCase, area: Area, snr: f64) -> anyhow::Result<LimitRow> {
        let calculator = &instrument.calculator;
        let limit = calculator.limit(area, sky.mag_arcsec2, self.exptime_s, self.subs, snr)?;
        let surface = matches!(area, Area::Pixel | Area::Arcsec2);
        let mag = self.mag.filter(|_| !surface);
        let exposure_s = self.exptime_s / f64::from(self.subs);
        let mag_snr = mag.map(|m| calculator.snr(area, m, sky.mag_arcsec2, self.exptime_s, self.subs)).transpose()?;
        let needed = mag.map(|m| calculator.needed(area, m, sky.mag_arcsec2, self.subs, snr));
        let (needed, reason) = match needed {
            Some(Err(error)) => (None, error.to_string().trim_start_matches("model: ").to_owned()),
            Some(Ok(needed)) => (Some(needed), String::new()),
            None => (None, String::new()),
        };
        Ok(LimitRow {
            sky: sky.name.clone(),
            moon_phase_deg: sky.moon_phase_deg,
            moon_alt_deg: sky.moon_alt_deg,
            sky_mag_arcsec2: sky.mag_arcsec2,
            sky_e_s_px: calculator.noise_px(sky.mag_arcsec2).sky_e_s,
            exptime_s: self.exptime_s,
            n_sub: i64::from(self.subs),
            snr,
            limit_of: area.name().into(),
            summed_arcsec2: limit.summed_arcsec2,
            n_px: limit.n_px,
            noise_var_e2: limit.variance_e2,
            limit_mag: (!surface).then_some(limit.mag),
            mu_limit_mag_arcsec2: limit.mag_arcsec2,
            saturation_mag: calculator.saturation_mag(area, sky.mag_arcsec2, exposure_s).filter(|_| !surface),
            saturated: i64::from(limit.saturated),
            mag,
            mag_snr,
            mag_exptime_s: needed.map(|n| n.exptime_s),
            mag_n_sub: needed.map(|n| i64::from(n.n_sub)),
            reason,
        })
    }

    fn notes(&self, instrument: &Instrument, rows: &[LimitRow]) {
        if let Some(note) = self.sky.note() {
            tell(&format!("note: {note}"));
        }
        let (full, dark_e_s) = (instrument.calculator.saturation_e, instrument.calculator.dark_e_s_px);
        let exposure_s = self.exptime_s / f64::from(self.subs);
        if let Some(row) = rows.iter().find(|row| (row.sky_e_s_px + dark_e_s) * exposure_s >= full) {
            let longest = full / (row.sky_e_s_px + dark_e_s);
            tell(&format!(
                "note: sky and dark current alone fill the pixels ({}): no exposure may exceed {longest:.3} s; --subs splits \
                 the time",
                row.sky
            ));
        } else if let Some(row) = rows.iter().find(|row| row.saturated == 1) {
            tell(&format!(
                "note: the limit of {} at SNR {} saturates a pixel; --subs splits the time",
                row.limit_of, row.snr
            ));
        }
        if let Some(row) = rows.iter().find(|row| !row.reason.is_empty()) {
            tell(&format!("note: {}", row.reason));
        }
    }

    fn meta(&self, instrument: &Instrument, omega_arcsec2: f64) -> Meta {
        let mut meta = Meta::default();
        meta.push("schema", "satphot.limits_tracked/1");
        meta.push("tool", concat!("satphot ", env!("CARGO_PKG_VERSION")));
        meta.push("instrument", instrument.title.as_str());
        meta.push("mag_system", instrument.mag_system);
        meta.push("sky", self.sky.source());
        meta.push("extended_target_arcsec2", omega_arcsec2);
        for setting in instrument.settings.iter().filter(|s| s.value.is_finite()) {
            let fields = vec![
                ("value".to_owned(), MetaValue::Number(setting.value)),
                ("unit".to_owned(), setting.unit.into()),
                ("from".to_owned(), setting.from.clone().into()),
            ];
            meta.push(&setting.name.replace(' ', "_"), MetaValue::Map(fields));
        }
        meta
    }
}
