//! `satphot predict geometry`: a file of explicit geometries in, a table of fluxes out, row for row.

use std::fs::File;
use std::io::{self, BufRead, BufReader, IsTerminal, Read};
use std::path::PathBuf;

use clap::Args;
use csv::{ByteRecord, StringRecord};
use rayon::prelude::*;
use satphot::Error;
use satphot::base::foreign;
use satphot::base::progress::Progress as _;
use satphot::base::threads::with_threads;
use satphot::brightness::explicit::{COLUMNS, Fluxes, Header, explicit, read_row};
use satphot::pipeline::explain::CasesLeftOut;
use satphot::tables::EXPLICIT;

use super::super::{bar::Bars, output, tell, threads};
use super::{Clock, tolerance};

/// Rows read, computed and written at a time: memory does not grow with the file.
const CHUNK: usize = 4096;
const AFTER_HELP: &str = "\
The conventions are fixed, whatever a configuration says: source a point at infinity, sphere
of 6378.000 km, the shadow a cylinder. Frame: z through the satellite, which is at (0, 0, R +
height_m); the source is at (0, cos E, sin E) with E = src_elev_deg; x = y cross z. The
observer is at obs_x_m, obs_y_m, obs_z_m on the sphere.

Columns read (any order; others are ignored; lines beginning with # are skipped):
  id  height_m  src_elev_deg  obs_x_m obs_y_m obs_z_m  nx ny nz  area_m2
  brdf p1 p2 p3        lambertian (albedo), phong (kd, ks, n), gaussian (A, sigma), abg (A, B, g),
                       binomial_starlink_v15_chassis, binomial_starlink_v15_solar,
                       mirror (rho, alpha = half angle of the source's disc [deg])
  earth_brdf ep1 ep2 ep3   lambertian (albedo), phong (kd, ks, n)

Columns written: direct_per_E0 and earth_per_E0 are the flux at the observer per unit
irradiance of the source [W/m2 per W/m2]; earth_err_est is the estimated error of earth_per_E0
in the same unit; nodes is the size of the quadrature; skipped says why a flux is zero; warn
says what is odd: `energy` for a surface that returns more light than it receives (it is
computed nevertheless), a normal that was normalised, or why a row has no numbers.

Examples:
  satphot predict geometry cases.csv > fluxes.csv
  satphot predict geometry cases.csv --tolerance 1e-9 -j 1
  gunzip -c cases.csv.gz | satphot predict geometry - | head

Exit code 3 if any row could not be computed (the others are written), 4 if the file cannot be
read, 2 if a column is missing.";

/// Computes the direct and the Earth-reflected flux of one surface in geometries stated number by number.
#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub struct Geometry {
    /// Cases, one a line; - reads standard input
    #[arg(value_name = "CASES_CSV")]
    cases: PathBuf,
    /// Relative tolerance of the Earth-reflected integral
    #[arg(short, long, value_name = "T", default_value_t = 1e-4, value_parser = tolerance)]
    tolerance: f64,
    /// Number of threads; 0 = all cores. The result does not depend on it
    #[arg(short, long, value_name = "N", default_value_t = 0, value_parser = threads)]
    jobs: usize,
    /// Report on standard error what was skipped in each case, why, and the CPU time saved
    #[arg(long)]
    explain: bool,
    /// Print no progress bar and no notes
    #[arg(short, long)]
    quiet: bool,
}

impl Geometry {
    pub fn execute(self) -> anyhow::Result<()> {
        let mut seen = CasesLeftOut::default();
        let (rows, failed) = with_threads(self.jobs, || self.run(&mut seen))??;
        if self.explain {
            let clock = Clock::start();
            tell(&seen.explanation(self.tolerance, &|| clock.cpu_s()).text());
        }
        if rows == 0 && !self.quiet {
            tell("note: the file has a header but no case");
        }
        if failed > 0 {
            let problem = format!("{failed} of {rows} rows could not be computed; the column warn says why");
            return Err(Error::PoorNight { problem }.into());
        }
        Ok(())
    }

    /// Reads, computes and writes chunk by chunk; returns how many rows there were and how many failed.
    fn run(&self, seen: &mut CasesLeftOut) -> anyhow::Result<(usize, usize)> {
        let mut reader = csv::ReaderBuilder::new()
            .comment(Some(b'#'))
            .flexible(true)
            .from_reader(without_mark(self.open()?).map_err(|e| Error::io(&self.cases, e))?);
        let unreadable = |e: csv::Error| -> anyhow::Error {
            let line = e.position().map(|p| p.line() as usize);
            match e.into_kind() {
                csv::ErrorKind::Io(source) => Error::io(&self.cases, source).into(),
                other => Error::Table { path: self.cases.clone(), line, problem: format!("{other:?}") }.into(),
            }
        };
        let names = reader.byte_headers().map_err(unreadable)?.clone();
        let names = StringRecord::from_byte_record_lossy(names);
        if names.is_empty() {
            let problem = format!("nothing in it; expected a header with the columns {}", COLUMNS.join(", "));
            return Err(Error::NoInput { path: self.cases.clone(), problem }.into());
        }
        let header =
            Header::new(&names).map_err(|problem| Error::Config { key: self.cases.display().to_string(), problem })?;

        let bar = self.bar();
        let mut listening = output::listening(&EXPLICIT.csv_head());
        let (mut rows, mut failed) = (0, 0);
        let mut records = reader.byte_records();
        while listening {
            let chunk = records.by_ref().take(CHUNK).collect::<Result<Vec<ByteRecord>, _>>().map_err(unreadable)?;
            if chunk.is_empty() {
                break;
            }
            if self.explain {
                let cases = chunk.iter().map(|r| StringRecord::from_byte_record_lossy(r.clone()));
                cases.for_each(|r| {
                    seen.add(read_row(&header, &r).ok().map(|row| (header.id(&r).to_string(), row.case)))
                });
            }
            let lines: Vec<(String, bool)> =
                chunk.into_par_iter().map(|record| line(&header, record, self.tolerance, &bar)).collect();
            rows += lines.len();
            failed += lines.iter().filter(|(_, good)| !good).count();
            let text: String = lines.into_iter().map(|(text, _)| text).collect();
            // nobody waits for the rest behind a closed pipe
            listening = output::listening(&text);
        }
        bar.done();
        Ok((rows, failed))
    }

    fn open(&self) -> anyhow::Result<Box<dyn BufRead + Send>> {
        if self.cases.as_os_str() == "-" {
            return Ok(Box::new(BufReader::new(io::stdin())));
        }
        let file = File::open(&self.cases).map_err(|e| Error::io(&self.cases, e))?;
        Ok(Box::new(BufReader::new(file)))
    }

    /// A bar where it neither mixes with the rows nor has to guess their number.
    fn bar(&self) -> Bars {
        let shown = !self.quiet && io::stderr().is_terminal() && !io::stdout().is_terminal();
        let bar = Bars::new(shown);
        if let Ok(file) =
            File::open(&self.cases).and_then(|f| if shown { Ok(f) } else { Err(io::ErrorKind::Other.into()) })
        {
            bar.stage("geometries", BufReader::new(file).lines().map_while(Result::ok).count().saturating_sub(1));
        }
        bar
    }
}

/// The stream without the byte order mark some editors put first.
fn without_mark(mut stream: Box<dyn BufRead + Send>) -> io::Result<Box<dyn Read + Send>> {
    if stream.fill_buf()?.starts_with(b"\xef\xbb\xbf") {
        stream.consume(3);
    }
    Ok(Box::new(stream))
}

/// The line of one row, and whether it has numbers.
fn line(header: &Header, record: ByteRecord, tolerance: f64, bar: &Bars) -> (String, bool) {
    bar.tick();
    let record = StringRecord::from_byte_record_lossy(record);
    let id = quoted(header.id(&record));
    let computed = read_row(header, &record).and_then(|row| {
        let fluxes =
            explicit(&row.case, tolerance).ok_or("obs_x_m, obs_y_m, obs_z_m: the observer is at the satellite")?;
        if !(fluxes.direct.is_finite() && fluxes.earth.is_finite() && fluxes.earth_err.is_finite()) {
            return Err("the flux is beyond the range of numbers; are the parameters of the brdf meant?".to_owned());
        }
        Ok((fluxes, row.warnings))
    });
    match computed {
        Ok((fluxes, mut warnings)) => {
            let Fluxes { direct, earth, earth_err, nodes, skipped, short_of_tolerance } = fluxes;
            if short_of_tolerance {
                warnings.push("tolerance not reached".into());
            }
            let (skipped, warn) = (quoted(&skipped.join("; ")), quoted(&warnings.join("; ")));
            (format!("{id},{direct:.16e},{earth:.16e},{earth_err:.16e},{nodes},{skipped},{warn}\n"), true)
        }
        Err(why) => (format!("{id},,,,,,{}\n", quoted(&why)), false),
    }
}

/// A cell of CSV that holds a text.
fn quoted(cell: &str) -> String {
    let cell = &*foreign::cell(cell);
    if cell.contains([',', '"', '\n', '\r', '#']) || cell.trim() != cell {
        return format!("\"{}\"", cell.replace('"', "\"\""));
    }
    cell.to_owned()
}
