//! `satphot predict sed`: the Sun's spectrum scaled to the Moon at its phases.

use std::path::PathBuf;

use clap::Args;
use satphot::Error;
use satphot::brightness::Band;
use satphot::brightness::light_sources::{SUN_V_MAG, SourceLight, SourceSettings, mag_of_flux, moon_spectrum};
use satphot::brightness::spectrum::{SolarColumn, Spectrum};
use satphot::config::{Effects, Mode, MoonLaw, Source};
use satphot::figures::{SedCurve, sed};
use satphot::report::summary::text_table;
use satphot::tables::SED;

use super::super::{print, tell};

/// The broad band of the table \[nm\].
const WIDE_NM: (f64, f64) = (300.0, 1050.0);

const AFTER_HELP: &str = "\
The Moon is grey: its spectrum is the Sun's times 10^(-0.4 (m_Moon - m_Sun)), V_Sun = -26.76,
at mean distances. The columns are those of ASTM G-173-03; global and direct are what is left
of sunlight at the ground, as the published model scales it: compared with magnitudes already
corrected for extinction they count it twice.

Columns written: v_mag of the source outside the atmosphere; band_w_m2 is the energy in the
band, the integral of spectrum times transmission; w_m2_300_1050 that from 300 to 1050 nm.

Examples:
  satphot predict sed
  satphot predict sed --phase-deg 0,90 --column global --csv
  satphot predict sed --law rolo --band r -o sed.svg";

/// Spectra of moonlight at phases of the Moon, and what a band collects of them.
#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub struct Sed {
    /// Phase angles of the Moon [deg], 0 = full, 180 = new
    #[arg(
        long,
        value_name = "DEG,...",
        value_delimiter = ',',
        default_value = "0,30,60,90,120",
        allow_hyphen_values = true
    )]
    phase_deg: Vec<f64>,
    /// Spectrum of the Sun: outside the atmosphere, or what reaches the ground
    #[arg(long, value_name = "COLUMN", default_value = "extraterrestrial", value_parser = ["extraterrestrial", "global", "direct"])]
    column: String,
    /// Own spectrum of the Sun at 1 au instead: a file of two columns, nm and W m^-2 nm^-1
    #[arg(long, value_name = "FILE", conflicts_with = "column")]
    spectrum: Option<PathBuf>,
    /// The Moon's magnitude against phase
    #[arg(long, value_name = "LAW", default_value = "cox", value_parser = ["cox", "cox_opposition", "rolo"])]
    law: String,
    /// Pass band: B, V, R, I, g, r, i, z, G (Gaia), or a file of wavelength_nm,transmission
    #[arg(long, value_name = "BAND", default_value = "V")]
    band: String,
    /// Print comma-separated values instead of a table
    #[arg(long)]
    csv: bool,
    /// Draw the spectra into this file (SVG)
    #[arg(short, long, value_name = "FILE.svg", value_parser = crate::cli::svg_file)]
    out: Option<PathBuf>,
    /// Print no notes
    #[arg(short, long)]
    quiet: bool,
}

/// One line of the table, with its spectrum.
struct Row {
    source: &'static str,
    phase_deg: Option<f64>,
    v_mag: Option<f64>,
    band_w_m2: f64,
    wide_w_m2: f64,
    spectrum: Spectrum,
}

impl Sed {
    pub fn execute(self) -> anyhow::Result<()> {
        if let Some(bad) = self.phase_deg.iter().find(|p| !(p.abs() <= 180.0)) {
            let problem = format!("{bad} is outside -180 to 180 deg");
            return Err(Error::Argument { name: "--phase-deg".into(), problem }.into());
        }
        let sun = match &self.spectrum {
            Some(path) => Spectrum::from_file(path)?,
            None => Spectrum::sun(self.solar_column())?,
        };
        let band = Band::of_config(&self.band).map_err(|error| match error {
            Error::Config { problem, .. } => Error::Argument { name: "--band".into(), problem },
            other => other,
        })?;
        let rows = self.rows(&sun, &band)?;
        print(&if self.csv { csv_text(&rows) } else { table_text(&rows, band.name()) });
        match &self.out {
            Some(path) => self.draw(path, &rows, &band),
            None => Ok(()),
        }
    }

    /// The Sun, then the Moon at each phase.
    fn rows(&self, sun: &Spectrum, band: &Band) -> anyhow::Result<Vec<Row>> {
        let effects =
            Effects { moon_law: self.moon_law(), source: Source::ExoAtmospheric, ..Effects::of(Mode::Corrected) };
        let sources = SourceSettings::new(&effects, &Band::of_config("V")?)?;
        let row = |source, phase_deg, v_mag, spectrum: Spectrum| Row {
            source,
            phase_deg,
            v_mag,
            band_w_m2: band.irradiance_w_m2(&spectrum),
            wide_w_m2: spectrum.irradiance_w_m2(WIDE_NM.0, WIDE_NM.1),
            spectrum,
        };
        let mut rows = vec![row("sun", None, Some(SUN_V_MAG), sun.clone())];
        for phase_deg in &self.phase_deg {
            let SourceLight { flux, extrapolated } = sources.moonlight_at_phase(*phase_deg);
            if extrapolated && !self.quiet {
                tell(&format!("note: {phase_deg} deg is beyond what the lunar law {} was fitted to", self.law));
            }
            rows.push(row("moon", Some(*phase_deg), mag_of_flux(flux), moon_spectrum(sun, *phase_deg, &sources)));
        }
        let (from, to) = sun.curve().range_nm();
        if (from > WIDE_NM.0 || to < WIDE_NM.1) && !self.quiet {
            tell(&format!("note: the spectrum covers {from} to {to} nm, less than 300 to 1050"));
        }
        Ok(rows)
    }

    fn solar_column(&self) -> SolarColumn {
        match self.column.as_str() {
            "global" => SolarColumn::Global,
            "direct" => SolarColumn::Direct,
            _ => SolarColumn::Extraterrestrial,
        }
    }

    fn moon_law(&self) -> MoonLaw {
        match self.law.as_str() {
            "rolo" => MoonLaw::Rolo,
            "cox_opposition" => MoonLaw::CoxOpposition,
            _ => MoonLaw::Cox,
        }
    }

    fn draw(&self, path: &std::path::Path, rows: &[Row], band: &Band) -> anyhow::Result<()> {
        let points = |c: &satphot::brightness::spectrum::Curve| -> Vec<(f64, f64)> {
            c.nm().iter().copied().zip(c.values().iter().copied()).collect()
        };
        let curves: Vec<SedCurve> = rows
            .iter()
            .filter_map(|r| Some((r.phase_deg?, r)))
            .map(|(deg, r)| SedCurve {
                label: format!("α = {deg}°, {}", r.v_mag.map_or("no light".into(), |v| format!("V {v:.2}"))),
                points: points(r.spectrum.curve()),
            })
            .collect();
        let of = self.spectrum.as_ref().map_or(self.column.clone(), |p| p.display().to_string());
        sed(path, &format!("Moonlight by phase ({of})"), &curves, (band.name(), &points(band.transmission())))?;
        Ok(())
    }
}

fn csv_text(rows: &[Row]) -> String {
    let number = |v: Option<f64>| v.map_or(String::new(), |v| format!("{v}"));
    let mut text = SED.csv_head();
    for r in rows {
        let (phase, v) = (number(r.phase_deg), r.v_mag.map_or(String::new(), |v| format!("{v:.6}")));
        text.push_str(&format!("{},{phase},{v},{:.8e},{:.8e}\n", r.source, r.band_w_m2, r.wide_w_m2));
    }
    text
}

fn table_text(rows: &[Row], band: &str) -> String {
    let in_band = format!("{band} [W/m2]");
    let head = ["source", "phase [deg]", "V [mag]", in_band.as_str(), "300-1050 nm [W/m2]"];
    let cells = |r: &Row| {
        vec![
            r.source.to_owned(),
            r.phase_deg.map_or(String::new(), |d| format!("{d}")),
            r.v_mag.map_or(String::new(), |v| format!("{v:.3}")),
            format!("{:.5e}", r.band_w_m2),
            format!("{:.5e}", r.wide_w_m2),
        ]
    };
    text_table(&head, &rows.iter().map(cells).collect::<Vec<_>>())
}
