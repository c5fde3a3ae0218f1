//! `satphot plot moon`: the lunar laws side by side, and the spectrum of moonlight by phase.

use std::path::PathBuf;

use clap::Args;
use satphot::Error;
use satphot::brightness::Band;
use satphot::brightness::light_sources::{SourceSettings, mag_of_flux, moon_spectrum, moon_v_mag};
use satphot::brightness::spectrum::{SolarColumn, Spectrum};
use satphot::config::{Effects, Mode, MoonLaw, Source};
use satphot::figures::{SedCurve, moon_laws};
use satphot::report::summary::text_table;
use satphot::tables::{Meta, MoonLawRow, csv_text, write_rows};

use super::super::predict::OutArgs;
use super::super::{print, tell};

/// Phase angles of the table \[deg\].
const PHASES_DEG: [f64; 25] = [
    0.0, 1.0, 2.0, 3.0, 5.0, 7.0, 10.0, 15.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0, 90.0, 97.0, 100.0, 110.0,
    120.0, 135.0, 150.0, 160.0, 170.0, 180.0,
];

const AFTER_HELP: &str = "\
V outside the atmosphere at mean distances (384400 km, 1 au). cox: -12.73 + 0.026|a| + 4e-9 a^4,
as the paper has it, here tapered to no light past 150 deg; ks: the same with the surge below
7 deg of Krisciunas & Schaefer 1991; rolo: Kieffer & Stone 2005 with zero libration, valid
from 1.55 to 97 deg. * marks numbers outside the range of validity of a law.

The waxing and the waning Moon differ by 0.05 to 0.15 mag near 90 deg; no law here knows that
(Cox has one law for both, and of ROLO the terms that are odd in the Sun's selenographic
longitude are not modelled).

The paper compares Cox with the observations of Holzloehner et al. 2017 (its figure of the
moonshine model) and finds good agreement but for small phase angles. Those observations are
literature only: they are not part of satphot and nothing here is compared with them.

Examples:
  satphot plot moon -o moon.svg
  satphot plot moon --phase-deg 0,45,90 --column global -o figures
  satphot plot moon --csv";

/// The Moon's laws (Cox, Krisciunas & Schaefer, ROLO) against phase, and the spectra of moonlight.
#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub struct Moon {
    /// Phase angles whose spectra are drawn [deg], 0 = full
    #[arg(
        long,
        value_name = "DEG,...",
        value_delimiter = ',',
        default_value = "0,30,60,90,120",
        allow_hyphen_values = true
    )]
    phase_deg: Vec<f64>,
    /// Law that scales the spectra
    #[arg(long, value_name = "LAW", default_value = "cox", value_parser = ["cox", "cox_opposition", "rolo"])]
    law: String,
    /// Spectrum of the Sun: outside the atmosphere, or what reaches the ground (global is what the paper draws)
    #[arg(long, value_name = "COLUMN", default_value = "extraterrestrial", value_parser = ["extraterrestrial", "global", "direct"])]
    column: String,
    /// Print comma-separated values instead of a table
    #[arg(long)]
    csv: bool,
    #[command(flatten)]
    out: OutArgs,
    /// Print no notes
    #[arg(short, long)]
    quiet: bool,
}

impl Moon {
    pub fn execute(self) -> anyhow::Result<()> {
        if let Some(bad) = self.phase_deg.iter().find(|p| !(p.abs() <= 180.0)) {
            let problem = format!("{bad} is outside -180 to 180 deg");
            return Err(Error::Argument { name: "--phase-deg".into(), problem }.into());
        }
        let laws = Laws::new()?;
        let rows: Vec<MoonLawRow> = PHASES_DEG.iter().map(|deg| laws.row(*deg)).collect();
        print(&if self.csv { csv_text(&rows)? } else { table(&rows) });
        let (tables, figures) = self.out.files("moon")?;
        tables.iter().try_for_each(|path| write_rows(path, &rows, &meta()))?;
        if !figures.is_empty() {
            let fine: Vec<MoonLawRow> = (0..=720).map(|i| laws.row(0.25 * f64::from(i))).collect();
            let spectra = self.spectra(&laws)?;
            let subtitle = format!("spectra: {}, {}", self.column, self.law);
            figures.iter().try_for_each(|path| moon_laws(path, &fine, &spectra, &subtitle))?;
        }
        if !self.quiet {
            self.notes(&tables, &figures);
        }
        Ok(())
    }

    fn notes(&self, tables: &[PathBuf], figures: &[PathBuf]) {
        tell(
            "note: waxing and waning Moon differ by 0.05 to 0.15 mag near 90 deg, which these laws do not model; the \
             observations the paper compares with (Holzloehner et al. 2017) are literature only",
        );
        for file in tables.iter().chain(figures) {
            tell(&format!("wrote {}", file.display()));
        }
    }

    /// The spectrum of moonlight at each phase.
    fn spectra(&self, laws: &Laws) -> anyhow::Result<Vec<SedCurve>> {
        let column = match self.column.as_str() {
            "global" => SolarColumn::Global,
            "direct" => SolarColumn::Direct,
            _ => SolarColumn::Extraterrestrial,
        };
        let (sun, sources) = (Spectrum::sun(column)?, laws.named(&self.law));
        let curve = |deg: &f64| {
            let spectrum = moon_spectrum(&sun, *deg, sources);
            let curve = spectrum.curve();
            SedCurve {
                label: format!("α = {deg}°"),
                points: curve.nm().iter().copied().zip(curve.values().iter().copied()).collect(),
            }
        };
        Ok(self.phase_deg.iter().map(curve).collect())
    }
}

/// The three laws in V.
struct Laws {
    cox: SourceSettings,
    ks: SourceSettings,
    rolo: SourceSettings,
}

impl Laws {
    fn new() -> anyhow::Result<Self> {
        let v = Band::of_config("V")?;
        let of = |moon_law| {
            let effects = Effects { moon_law, source: Source::ExoAtmospheric, ..Effects::of(Mode::Corrected) };
            SourceSettings::new(&effects, &v)
        };
        Ok(Self { cox: of(MoonLaw::Cox)?, ks: of(MoonLaw::CoxOpposition)?, rolo: of(MoonLaw::Rolo)? })
    }

    fn named(&self, law: &str) -> &SourceSettings {
        match law {
            "rolo" => &self.rolo,
            "cox_opposition" => &self.ks,
            _ => &self.cox,
        }
    }

    fn row(&self, phase_deg: f64) -> MoonLawRow {
        let of = |sources: &SourceSettings| {
            let light = sources.moonlight_at_phase(phase_deg);
            (mag_of_flux(light.flux), i64::from(light.extrapolated))
        };
        let ((cox, cox_extrapolated), (ks, ks_extrapolated), (rolo, rolo_extrapolated)) =
            (of(&self.cox), of(&self.ks), of(&self.rolo));
        let less = |law: Option<f64>| law.zip(cox).map(|(law, cox)| law - cox);
        MoonLawRow {
            phase_deg,
            illum_frac: 0.5 * (1.0 + phase_deg.to_radians().cos()),
            cox_v_mag: cox,
            cox_extrapolated,
            ks_v_mag: ks,
            ks_extrapolated,
            rolo_v_mag: rolo,
            rolo_extrapolated,
            ks_minus_cox_mag: less(ks),
            rolo_minus_cox_mag: less(rolo),
            cox_polynomial_v_mag: moon_v_mag(phase_deg),
        }
    }
}

fn meta() -> Meta {
    let mut meta = Meta::default();
    meta.push("schema", "satphot.moon_laws/1");
    meta.push("tool", concat!("satphot ", env!("CARGO_PKG_VERSION")));
    meta.push("mag_system", "Vega");
    meta.push("band", "V");
    meta.push("moon_distance_km", 384_400.0);
    meta.push("sun_distance_au", 1.0);
    meta.push("asymmetry", "waxing and waning differ by 0.05 to 0.15 mag near 90 deg: not modelled");
    meta.push(
        "holzloehner_2017",
        "literature only: the paper's comparison with observations is not part of this table",
    );
    meta
}

fn table(rows: &[MoonLawRow]) -> String {
    let mag = |v: Option<f64>, extrapolated: i64| {
        let star = if extrapolated == 1 { "*" } else { "" };
        v.map_or("no light".to_owned(), |v| format!("{v:.3}")) + star
    };
    let difference = |v: Option<f64>| v.map_or(String::new(), |v| format!("{v:+.3}"));
    let cells = |r: &MoonLawRow| {
        vec![
            format!("{}", r.phase_deg),
            format!("{:.1}", 100.0 * r.illum_frac),
            mag(r.cox_v_mag, r.cox_extrapolated),
            mag(r.ks_v_mag, r.ks_extrapolated),
            mag(r.rolo_v_mag, r.rolo_extrapolated),
            difference(r.ks_minus_cox_mag),
            difference(r.rolo_minus_cox_mag),
            format!("{:.3}", r.cox_polynomial_v_mag),
        ]
    };
    let head = ["phase [deg]", "lit [%]", "Cox V", "K&S V", "ROLO V", "K&S - Cox", "ROLO - Cox", "Cox as printed"];
    text_table(&head, &rows.iter().map(cells).collect::<Vec<_>>())
}
