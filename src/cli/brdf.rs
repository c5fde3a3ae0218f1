//! `satphot brdf`: fits scattering laws to measured tables, and draws them.

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand, ValueEnum};
use satphot::Error;
use satphot::base::file::write_atomic;
use satphot::brightness::Brdf;
use satphot::brightness::brdf::fit::{BrdfFit, FitLaw, FitOptions, MeasuredTable, fit_brdf};
use satphot::figures::{FittedRow, brdf_curves, brdf_fit};
use satphot::report::summary::text_table;
use satphot::tables::BRDF_CURVE;

use super::{print, tell};

const EXAMPLES: &str = "\
Examples:
  satphot brdf plot starlink-chassis-lab -o chassis.svg
  satphot brdf fit measured.csv --law binomial";

/// Fits scattering laws (BRDFs) to measurements, and draws laws.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct BrdfVerb {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, Subcommand)]
enum What {
    /// Fit a law to a table of measurements: parameters with errors, and the line for a configuration
    #[command(after_help = FIT_HELP)]
    Fit(Fit),
    /// Draw a law: f in the plane of incidence, reflectance against incidence
    #[command(after_help = PLOT_HELP)]
    Plot(Plot),
}

const FIT_HELP: &str = "\
The table has the columns phi_i, theta_i, phi_o, theta_o [deg] and BRDF [1/sr], separated by blanks or commas, under one line
of names; # begins a comment. phi is the angle from the normal, theta the azimuth; the mirror direction of (30, 0) is (30, 180).

Laws are compared by AIC (lower is better, fitted alike to the same rows); rms is that of lg f in dex either way.

Examples:
  satphot brdf fit panel.txt                                which law suits
  satphot brdf fit panel.txt --law phong --toml -           the line for [[model.surfaces]]
  satphot brdf fit panel.txt --law binomial --l1 -3 --l2 3 --plot panel.svg
  satphot brdf fit panel.txt --law phong --bounds n=1:100 --start n=20";

const PLOT_HELP: &str = "\
A law is a name (--list), or a TOML file holding a line such as
  brdf = { kind = \"phong\", kd = 0.3, ks = 0.4, n = 25.0 }

Examples:
  satphot brdf plot starlink-chassis-lab -o chassis.svg
  satphot brdf plot panel.toml --csv > panel.csv";

impl BrdfVerb {
    pub fn execute(self) -> anyhow::Result<()> {
        match self.what {
            What::Fit(v) => v.execute(),
            What::Plot(v) => v.execute(),
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Law {
    /// Every law, the best first
    All,
    /// albedo/pi
    Lambert,
    /// Diffuse part and a power of the cosine
    Phong,
    /// A/(B + D^g)
    Abg,
    /// Gaussian about the mirror direction
    Gaussian,
    /// Greynolds: polynomial and logarithms in D (and V)
    Binomial,
}

/// Arguments of `satphot brdf fit`.
#[derive(Debug, Args)]
struct Fit {
    /// Measurements
    table: PathBuf,
    /// Which law
    #[arg(long, value_enum, default_value = "all")]
    law: Law,
    /// Fit f instead of lg f, so that the peak dominates
    #[arg(long)]
    linear: bool,
    /// Exclude rows with f at or below this [1/sr]
    #[arg(long, value_name = "F", default_value_t = 0.0, allow_hyphen_values = true)]
    clip: f64,
    /// Error of one measurement, 1 sigma [dex, or 1/sr with --linear]; else the scatter about the fit
    #[arg(long, value_name = "ERR")]
    sigma: Option<f64>,
    /// Start of a parameter, e.g. n=20 (repeatable)
    #[arg(long = "start", value_name = "NAME=VALUE", value_parser = start)]
    starts: Vec<(String, f64)>,
    /// Bounds of a parameter, e.g. n=1:100 (repeatable)
    #[arg(long, value_name = "NAME=LOW:HIGH", value_parser = bounds)]
    bounds: Vec<(String, f64, f64)>,
    /// Binomial: rows, the powers of V
    #[arg(long, value_name = "N", default_value_t = 1)]
    rows: usize,
    /// Binomial: columns of B, the powers of D
    #[arg(long, value_name = "M", default_value_t = 2)]
    terms: usize,
    /// Binomial: first power of d
    #[arg(long, value_name = "L1", default_value_t = -3, allow_hyphen_values = true)]
    l1: i32,
    /// Binomial: first power of d that is excluded
    #[arg(long, value_name = "L2", default_value_t = 1, allow_hyphen_values = true)]
    l2: i32,
    /// Binomial: d, or `fit`
    #[arg(long, value_name = "D", default_value = "3", value_parser = base)]
    d: Base,
    /// Write the line for a configuration here; - = print nothing else
    #[arg(long, value_name = "FILE")]
    toml: Option<PathBuf>,
    /// Draw measurements and fit
    #[arg(long, value_name = "FILE.svg", value_parser = super::svg_file)]
    plot: Option<PathBuf>,
}

/// d of a binomial law: fixed, or `None` to fit it.
#[derive(Debug, Clone, Copy)]
struct Base(Option<f64>);

impl Fit {
    fn execute(self) -> anyhow::Result<()> {
        if self.sigma.is_some_and(|s| !(s > 0.0 && s.is_finite())) {
            return Err(bad("--sigma", "must be a number above 0".into()));
        }
        if !self.clip.is_finite() {
            return Err(bad("--clip", format!("{} is not a number", self.clip)));
        }
        let table = MeasuredTable::read(&self.table)?;
        if table.wide_rows > 0 {
            tell(&format!("note: {} rows have more than five columns; the rest is not read", table.wide_rows));
        }
        let options = FitOptions {
            log_space: !self.linear,
            clip_per_sr: self.clip,
            sigma: self.sigma,
            starts: self.starts.clone(),
            bounds: self.bounds.clone(),
        };
        let mut fits = Vec::new();
        for law in self.laws() {
            match fit_brdf(&table, &law, &options) {
                Ok(fit) => fits.push(fit),
                // of all laws, those with too many parameters for the table are reported and excluded
                Err(e) if self.law == Law::All => tell(&format!("note: {}: {e}", law.kind())),
                Err(e) => return Err(e.into()),
            }
        }
        fits.sort_by(|a, b| a.aic.total_cmp(&b.aic));
        let Some(best) = fits.first() else {
            return Err(Error::Model { problem: "no law could be fitted; the notes say why".into() }.into());
        };
        let only_line = self.toml.as_deref() == Some(Path::new("-"));
        if !only_line {
            print(&report(&table, &fits, &options));
        }
        for fit in &fits {
            for warning in &fit.warnings {
                tell(&format!("warning: {}: {warning}", fit.law.kind()));
            }
        }
        let line = format!("{}\n", best.toml());
        match &self.toml {
            Some(path) if !only_line => write_atomic(path, line.as_bytes())?,
            _ => print(&line),
        }
        if let Some(path) = &self.plot {
            let rows: Vec<FittedRow> = table
                .rows
                .iter()
                .filter_map(|row| {
                    Some(FittedRow {
                        off_mirror_deg: row.off_mirror_deg()?,
                        measured_per_sr: row.brdf_per_sr,
                        fitted_per_sr: row.of(&best.brdf)?,
                    })
                })
                .collect();
            brdf_fit(path, &format!("{}: {}", file_name(&self.table), best.law.kind()), &rows)?;
        }
        Ok(())
    }

    fn laws(&self) -> Vec<FitLaw> {
        let binomial = FitLaw::Binomial { rows: self.rows, terms: self.terms, l1: self.l1, l2: self.l2, d: self.d.0 };
        match self.law {
            Law::All => vec![FitLaw::Lambert, FitLaw::Phong, FitLaw::Abg, FitLaw::Gaussian, binomial],
            Law::Lambert => vec![FitLaw::Lambert],
            Law::Phong => vec![FitLaw::Phong],
            Law::Abg => vec![FitLaw::Abg],
            Law::Gaussian => vec![FitLaw::Gaussian],
            Law::Binomial => vec![binomial],
        }
    }
}

/// What was fitted, as text: a line for each law, the parameters of each, the correlations of the best.
fn report(table: &MeasuredTable, fits: &[BrdfFit], options: &FitOptions) -> String {
    let Some(best) = fits.first() else { return String::new() };
    let mut text = format!(
        "{}: {} rows, {} fitted in {}, {} at or below the clip, {} below the surface\n\n",
        table.path.display(),
        table.rows.len(),
        best.used,
        if options.log_space { "lg f" } else { "f" },
        best.clipped,
        best.below_surface
    );
    let laws: Vec<Vec<String>> = fits
        .iter()
        .map(|fit| {
            vec![
                fit.law.kind().to_owned(),
                fit.parameters.len().to_string(),
                format!("{:.4}", fit.rms_dex),
                significant(fit.chi2, 5),
                format!("{:.1}", fit.aic),
                format!("{:.4}", fit.brdf.max_reflectance()),
            ]
        })
        .collect();
    text.push_str(&text_table(&["law", "parameters", "rms dex", "chi2", "AIC", "reflectance max"], &laws));
    let mut rows = Vec::new();
    for fit in fits {
        for p in &fit.parameters {
            let note = p.at_bound.map_or(String::new(), |b| format!("on its bound {b}"));
            let (value, err) = match p.err.filter(|e| *e > 0.0 && e.is_finite()) {
                Some(err) => with_error(p.value, err),
                None => (significant(p.value, 6), String::new()),
            };
            rows.push(vec![fit.law.kind().to_owned(), p.name.clone(), value, err, note]);
        }
    }
    text.push('\n');
    text.push_str(&text_table(&["law", "parameter", "value", "+/- 1 sigma", "note"], &rows));
    let names: Vec<&str> = best.parameters.iter().map(|p| p.name.as_str()).collect();
    if (2..=8).contains(&names.len()) {
        let rows: Vec<Vec<String>> = names
            .iter()
            .zip(&best.correlation)
            .map(|(name, row)| {
                let cells = row.iter().map(|r| r.map_or(String::new(), |r| format!("{r:+.3}")));
                std::iter::once((*name).to_owned()).chain(cells).collect()
            })
            .collect();
        let head: Vec<&str> = std::iter::once("correlation").chain(names).collect();
        text.push('\n');
        text.push_str(&text_table(&head, &rows));
    }
    text.push('\n');
    text
}

/// A value to the second digit of its error.
fn with_error(value: f64, err: f64) -> (String, String) {
    if err < 1e-4 || value.abs() >= 1e5 {
        return (significant(value, 6), significant(err, 2));
    }
    let decimals = (1.0 - err.log10().floor()).clamp(0.0, 8.0) as usize;
    (format!("{value:.decimals$}"), format!("{err:.decimals$}"))
}

/// A number to so many significant digits.
fn significant(value: f64, digits: usize) -> String {
    let size = value.abs();
    if size == 0.0 || !(1e-4..1e6).contains(&size) {
        return format!("{value:.*e}", digits - 1);
    }
    let decimals = (digits as f64 - 1.0 - size.log10().floor()).max(0.0) as usize;
    format!("{value:.decimals$}")
}

/// Arguments of `satphot brdf plot`.
#[derive(Debug, Args)]
struct Plot {
    /// A name, or a TOML file with a line `brdf = { kind = ... }`
    #[arg(value_name = "NAME|FILE.toml", required_unless_present = "list")]
    law: Option<String>,
    /// List the laws known by name, with their reflectance and source
    #[arg(long, conflicts_with = "law")]
    list: bool,
    /// Figure to write; NAME.svg if neither this nor --csv is given
    #[arg(short, long = "out", value_name = "FILE.svg", value_parser = super::svg_file)]
    out: Option<PathBuf>,
    /// Print the rows of the figure as comma-separated values
    #[arg(long)]
    csv: bool,
    /// Angles of incidence [deg]
    #[arg(long, value_name = "DEG", value_delimiter = ',', default_values_t = [0.0, 20.0, 40.0, 60.0, 80.0])]
    incidence: Vec<f64>,
}

impl Plot {
    fn execute(self) -> anyhow::Result<()> {
        let Some(name) = &self.law else { return list() };
        if let Some(wrong) = self.incidence.iter().find(|deg| !(0.0..90.0).contains(*deg)) {
            return Err(bad("--incidence", format!("{wrong} is outside 0 to 90 deg")));
        }
        let (title, law) = law(name)?;
        law.check_parameters(&title)?;
        if law.creates_light() {
            tell(&format!("warning: {title} creates light: reflectance up to {:.3}", law.max_reflectance()));
        }
        let (profile, reflectances) = (law.profile(&self.incidence), law.reflectances());
        if self.csv {
            print(&BRDF_CURVE.csv_head());
            for r in &profile {
                print(&format!("{},{},{:e},\n", r.incidence_deg, r.outgoing_deg, r.f_per_sr));
            }
            for r in &reflectances {
                print(&format!("{},,,{}\n", r.incidence_deg, r.reflectance));
            }
        }
        if let Some(path) = self.out.or_else(|| (!self.csv).then(|| PathBuf::from(format!("{title}.svg")))) {
            brdf_curves(&path, &title, &profile, &reflectances)?;
            tell(&format!("wrote {}", path.display()));
        }
        Ok(())
    }
}

/// Every law known by name.
fn list() -> anyhow::Result<()> {
    let mut rows = Vec::new();
    for name in Brdf::names() {
        let law = Brdf::named(name)?;
        let kind = match law {
            Brdf::Lambert { .. } => "lambert",
            Brdf::Phong { .. } => "phong",
            Brdf::Abg { .. } => "abg",
            Brdf::Gaussian { .. } => "gaussian",
            Brdf::Binomial(_) => "binomial",
            _ => "mirror",
        };
        let reflectance = format!("{:.3}", law.hemispherical_reflectance(0.0));
        rows.push(vec![name.into(), kind.into(), reflectance, Brdf::source(name).unwrap_or_default().into()]);
    }
    print(&text_table(&["name", "kind", "reflectance", "source"], &rows));
    Ok(())
}

/// A law by name, or from a TOML file: its title and itself.
fn law(name: &str) -> anyhow::Result<(String, Brdf)> {
    let path = Path::new(name);
    if !path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml")) {
        return Ok((name.to_owned(), Brdf::named(name)?));
    }
    let text = std::fs::read_to_string(path).map_err(|e| Error::io(path, e))?;
    let wrong = |e: toml::de::Error| bad(name, e.message().to_owned());
    let mut keys: toml::Table = text.parse().map_err(wrong)?;
    let law = match keys.remove("brdf") {
        Some(law) => law,
        None if keys.contains_key("kind") => toml::Value::Table(keys),
        None => return Err(bad(name, "holds no line brdf = { kind = ... }".into())),
    };
    let law: satphot::config::Brdf = law.try_into().map_err(wrong)?;
    let stem = path.file_stem().map_or_else(|| name.to_owned(), |s| s.to_string_lossy().into_owned());
    Ok((stem, Brdf::try_from(&law)?))
}

fn file_name(path: &Path) -> String {
    path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned())
}

fn start(text: &str) -> Result<(String, f64), String> {
    let (name, value) = text.split_once('=').ok_or("not NAME=VALUE")?;
    Ok((name.trim().to_owned(), number(value)?))
}

fn bounds(text: &str) -> Result<(String, f64, f64), String> {
    let (name, range) = text.split_once('=').ok_or("not NAME=LOW:HIGH")?;
    let (low, high) = range.split_once(':').ok_or("not NAME=LOW:HIGH")?;
    Ok((name.trim().to_owned(), number(low)?, number(high)?))
}

fn base(text: &str) -> Result<Base, String> {
    if text == "fit" { Ok(Base(None)) } else { number(text).map(|d| Base(Some(d))) }
}

fn number(text: &str) -> Result<f64, String> {
    text.trim().parse::<f64>().ok().filter(|v| v.is_finite()).ok_or_else(|| format!("\"{text}\" is not a number"))
}

fn bad(key: &str, problem: String) -> anyhow::Error {
    Error::Config { key: key.into(), problem }.into()
}
