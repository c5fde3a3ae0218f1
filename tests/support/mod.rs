//! A tiny simulated night in a folder of its own, and the ways in which a careless observer damages it.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, dead_code)]

use std::path::{Path, PathBuf};
use std::process::Command;

use satphot::base::progress::Silent;
use satphot::config::Config;
use satphot::pipeline::options::Options;
use satphot::pipeline::products::summary::Summary;
use satphot::pipeline::run::run;
use satphot::simulate::{Scenario, simulate};
use satphot::tables::PhotometryRow;

/// 18 frames of 160x120 px, reduced in a third of a second; 39 star measurements, 3 passes.
pub const TINY: &[&str] = &[
    "frame.nx_px=160",
    "frame.ny_px=120",
    "pointings.n=3",
    "target.n=6",
    "target.offset_mag=-1.5",
    "flats.n=4",
    "name=tiny",
];
/// Names of the target frames of the tiny night.
pub const TARGETS: [&str; 6] = [
    "target_0000.fits",
    "target_0001.fits",
    "target_0002.fits",
    "target_0003.fits",
    "target_0004.fits",
    "target_0005.fits",
];

/// Simulates the tiny night with `more` settings into a folder of the build that is emptied first.
pub fn simulated(name: &str, more: &[&str]) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::remove_dir_all(&folder).ok();
    let sets: Vec<String> = TINY.iter().chain(more).map(|s| (*s).to_string()).collect();
    simulate(&Scenario::crowded_night(&sets).unwrap(), &folder, &Silent).unwrap();
    folder
}

/// A copy of a night that may be damaged.
pub struct Night {
    folder: tempfile::TempDir,
    /// `key=value` settings on top of its pipeline.toml.
    pub sets: Vec<String>,
    /// Threads and strictness.
    pub options: Options,
}

impl Night {
    /// Copies the frames, catalogue, elements and pipeline.toml of `original`.
    pub fn copy_of(original: &Path) -> Self {
        let folder = tempfile::tempdir().unwrap();
        for entry in std::fs::read_dir(original).unwrap() {
            let path = entry.unwrap().path();
            if path.is_file() {
                std::fs::copy(&path, folder.path().join(path.file_name().unwrap())).unwrap();
            }
        }
        Self { folder, sets: Vec::new(), options: Options { jobs: 2, no_figures: true, ..Options::default() } }
    }

    /// The night with `key=value` on top.
    pub fn set(mut self, set: &str) -> Self {
        self.sets.push(set.into());
        self
    }

    /// A file in the night's folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// The frames whose name begins with `prefix`, sorted.
    pub fn frames(&self, prefix: &str) -> Vec<PathBuf> {
        let mut found: Vec<PathBuf> =
            std::fs::read_dir(self.folder.path()).unwrap().map(|e| e.unwrap().path()).collect();
        found.retain(|p| {
            let name = p.file_name().unwrap().to_string_lossy();
            name.starts_with(prefix) && (name.ends_with(".fits") || name.ends_with(".fits.fz"))
        });
        found.sort();
        found
    }

    /// Takes away the frames whose name begins with `prefix`.
    pub fn remove(self, prefix: &str) -> Self {
        let frames = self.frames(prefix);
        assert!(!frames.is_empty(), "nothing begins with {prefix}");
        frames.iter().for_each(|p| std::fs::remove_file(p).unwrap());
        self
    }

    /// Takes a table out of pipeline.toml.
    pub fn without_table(self, table: &str) -> Self {
        let text = std::fs::read_to_string(self.path("pipeline.toml")).unwrap();
        let mut toml: toml::Table = text.parse().unwrap();
        toml.remove(table).unwrap();
        std::fs::write(self.path("pipeline.toml"), toml::to_string(&toml).unwrap()).unwrap();
        self
    }

    /// Writes the value of a card as given (20 columns wide) into every frame that begins with `prefix`; `None` takes
    /// the card away.
    pub fn card(self, prefix: &str, keyword: &str, value: Option<&str>) -> Self {
        let frames = self.frames(prefix);
        assert!(!frames.is_empty(), "nothing begins with {prefix}");
        frames.iter().for_each(|p| set_card(p, keyword, value));
        self
    }

    /// Writes `bytes` under a name.
    pub fn file(self, name: &str, bytes: impl AsRef<[u8]>) -> Self {
        std::fs::write(self.path(name), bytes).unwrap();
        self
    }

    /// The configuration in force.
    pub fn config(&self) -> satphot::Result<Config> {
        Config::load(&self.path("pipeline.toml"), &self.sets)
    }

    /// Reduces the night.
    pub fn run(&self) -> satphot::Result<Summary> {
        run(&self.config()?, &self.options, &Silent)
    }

    /// What reducing the night ends with: the exit code and the message.
    pub fn refusal(&self) -> (u8, String) {
        let error = self.run().expect_err("this night should be refused");
        (error.exit_code(), error.to_string())
    }

    /// A result of the last run.
    pub fn result(&self, name: &str) -> PathBuf {
        self.path("satphot-out").join("tiny").join(name)
    }

    /// A result of the last run, as text.
    pub fn text(&self, name: &str) -> String {
        let path = self.result(name);
        std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
    }

    /// The photometry of the last run.
    pub fn rows(&self) -> Vec<PhotometryRow> {
        satphot::tables::read_photometry(&self.result("photometry.ecsv")).unwrap().0
    }

    /// The row of one frame.
    pub fn row(&self, frame: &str) -> PhotometryRow {
        let mut rows: Vec<PhotometryRow> = self.rows().into_iter().filter(|r| r.frame == frame).collect();
        assert_eq!(rows.len(), 1, "{frame} has {} rows", rows.len());
        rows.remove(0)
    }

    /// The manifest of the last run.
    pub fn manifest(&self) -> serde_json::Value {
        serde_json::from_str(&self.text("manifest.json")).unwrap()
    }

    /// The lines of the last run's tables without those that name the folder or a hash of configuration and inputs,
    /// and without the rows of `frames`; the time since the frame before is blank: that frame may be among `frames`.
    fn table_lines(&self, frames: &[&str]) -> Vec<String> {
        let folder = self.folder.path().display().to_string();
        let names = ["photometry.ecsv", "stars.ecsv", "residuals.ecsv", "zeropoint.toml"];
        let lines = names.iter().flat_map(|name| self.text(name).lines().map(str::to_string).collect::<Vec<_>>());
        lines
            .filter(|l| !frames.iter().any(|f| l.starts_with(&format!("{f},"))))
            .filter(|l| !l.contains("config_sha256") && !l.contains("input_manifest_sha256") && !l.contains(&folder))
            .map(|l| if l.starts_with("target_") { without_cadence(&l) } else { l })
            .collect()
    }

    /// Apart from the rows of `frames`, the tables are those of `other` to the byte.
    pub fn same_tables_but_for(&self, frames: &[&str], other: &Night) {
        let (mine, theirs) = (self.table_lines(frames), other.table_lines(&[]));
        for (a, b) in mine.iter().zip(&theirs) {
            assert_eq!(a, b, "a line changed by {frames:?}");
        }
        assert_eq!(mine.len(), theirs.len(), "{frames:?} costs more than its row");
    }

    /// Runs the program in this night's folder.
    pub fn satphot(&self, args: &[&str]) -> RunOutput {
        satphot(self.folder.path(), args)
    }
}

/// A line of `photometry.ecsv` or `residuals.ecsv` with nothing under `cadence_s`, if it has that column.
fn without_cadence(line: &str) -> String {
    let columns = satphot::tables::PHOTOMETRY.columns;
    let at = columns.iter().position(|c| c.name == "cadence_s").unwrap();
    // no text before it holds a comma
    let mut cells: Vec<&str> = line.split(',').collect();
    if cells.len() >= columns.len() {
        cells[at] = "";
    }
    cells.join(",")
}

/// What the program said.
#[derive(Debug)]
pub struct RunOutput {
    /// Exit code.
    pub code: i32,
    /// Standard output.
    pub out: String,
    /// Standard error.
    pub err: String,
}

impl RunOutput {
    /// The exit code is `code`, and standard error holds each of `words`.
    pub fn expect(self, code: i32, words: &[&str]) -> Self {
        assert_eq!(self.code, code, "{self:#?}");
        for word in words {
            assert!(self.err.contains(word), "\"{word}\" is not in\n{}", self.err);
        }
        self
    }

    /// Nothing was printed as a result.
    pub fn without_results(self) -> Self {
        assert_eq!(self.out, "", "{}", self.err);
        self
    }
}

/// Runs the program; no message may come from a panic.
pub fn satphot(folder: &Path, args: &[&str]) -> RunOutput {
    let output = Command::new(env!("CARGO_BIN_EXE_satphot")).args(args).current_dir(folder).output().unwrap();
    let run = RunOutput {
        code: output.status.code().unwrap_or(-1),
        out: String::from_utf8(output.stdout).unwrap(),
        err: String::from_utf8(output.stderr).unwrap(),
    };
    for word in ["panicked", "RUST_BACKTRACE", "unwrap()"] {
        assert!(!run.err.contains(word) && !run.out.contains(word), "{run:#?}");
    }
    run
}

const CARD: usize = 80;
const BLOCK: usize = 2880;

/// Position of a card and of the first byte after the header.
fn find_card(bytes: &[u8], keyword: &str) -> (Option<usize>, usize) {
    let mut at = None;
    for (k, card) in bytes.chunks(CARD).enumerate() {
        let name = String::from_utf8_lossy(&card[..8]);
        if name.trim_end() == keyword && at.is_none() {
            at = Some(k * CARD);
        }
        if name.trim_end() == "END" {
            return (at, ((k + 1) * CARD).div_ceil(BLOCK) * BLOCK);
        }
    }
    panic!("no END card");
}

/// Writes the value of a card of the first header as given; `None` blanks the card.
pub fn set_card(path: &Path, keyword: &str, value: Option<&str>) {
    let mut bytes = std::fs::read(path).unwrap();
    let at = find_card(&bytes, keyword).0.unwrap_or_else(|| panic!("no card {keyword} in {}", path.display()));
    let text = value.map_or(String::new(), |v| format!("{keyword:<8}= {v:>20}"));
    bytes[at..at + CARD].copy_from_slice(format!("{text:<80}").as_bytes());
    std::fs::write(path, bytes).unwrap();
}

/// Writes another card, `KEYWORD = value / comment`, over one of the first header.
pub fn replace_card(path: &Path, keyword: &str, card: &str) {
    let mut bytes = std::fs::read(path).unwrap();
    let at = find_card(&bytes, keyword).0.unwrap_or_else(|| panic!("no card {keyword} in {}", path.display()));
    assert!(card.len() <= CARD, "{card}");
    bytes[at..at + CARD].copy_from_slice(format!("{card:<80}").as_bytes());
    std::fs::write(path, bytes).unwrap();
}

/// Gives every pixel of a u16 frame the same value \[ADU\].
pub fn fill(path: &Path, value_adu: u16) {
    let mut bytes = std::fs::read(path).unwrap();
    let start = find_card(&bytes, "SIMPLE").1;
    let stored = (i32::from(value_adu) - 32_768) as i16;
    bytes[start..].chunks_exact_mut(2).for_each(|p| p.copy_from_slice(&stored.to_be_bytes()));
    std::fs::write(path, bytes).unwrap();
}

/// Adds a trail to a u16 frame of `width` columns: from (x, y) along `theta` \[rad\], `length_px` long, with a Gaussian profile of
/// `fwhm_px` and ends as sharp as that.
pub fn trail(
    path: &Path,
    width: usize,
    (x, y): (f64, f64),
    theta: f64,
    (length_px, fwhm_px): (f64, f64),
    peak_adu: f64,
) {
    let mut bytes = std::fs::read(path).unwrap();
    let start = find_card(&bytes, "SIMPLE").1;
    let sigma = fwhm_px / 2.355;
    for (k, pixel) in bytes[start..].chunks_exact_mut(2).enumerate() {
        let (dx, dy) = ((k % width) as f64 - x, (k / width) as f64 - y);
        let (u, v) = (dx * theta.cos() + dy * theta.sin(), dy * theta.cos() - dx * theta.sin());
        let beyond = (-u).max(u - length_px).max(0.0);
        let light = peak_adu * (-0.5 * (v * v + beyond * beyond) / (sigma * sigma)).exp();
        let adu = f64::from(i16::from_be_bytes([pixel[0], pixel[1]])) + light.round();
        pixel.copy_from_slice(&(adu.min(f64::from(i16::MAX)) as i16).to_be_bytes());
    }
    std::fs::write(path, bytes).unwrap();
}

/// Moves the pixels of a u16 frame of `width` columns to the right; those that leave it come in again.
pub fn shift(path: &Path, width: usize, by: usize) {
    let mut bytes = std::fs::read(path).unwrap();
    let start = find_card(&bytes, "SIMPLE").1;
    bytes[start..].chunks_exact_mut(2 * width).for_each(|row| row.rotate_right(2 * by));
    std::fs::write(path, bytes).unwrap();
}

/// Turns a 160x120 frame into 32-bit floats that are all NaN.
pub fn fill_nan(path: &Path) {
    set_card(path, "BITPIX", Some("-32"));
    set_card(path, "BZERO", None);
    set_card(path, "BSCALE", None);
    let mut bytes = std::fs::read(path).unwrap();
    bytes.truncate(find_card(&bytes, "SIMPLE").1);
    bytes.extend(f32::NAN.to_be_bytes().repeat(160 * 120));
    bytes.resize(bytes.len().div_ceil(BLOCK) * BLOCK, 0);
    std::fs::write(path, bytes).unwrap();
}

/// Keeps the first 80x60 pixels' worth of a frame's data and says so in its header.
pub fn shrink(path: &Path) {
    set_card(path, "NAXIS1", Some("80"));
    set_card(path, "NAXIS2", Some("60"));
    let mut bytes = std::fs::read(path).unwrap();
    let start = find_card(&bytes, "SIMPLE").1;
    bytes.truncate(start + (80 * 60 * 2_usize).div_ceil(BLOCK) * BLOCK);
    std::fs::write(path, bytes).unwrap();
}

/// SHA-256 of every file of a folder, without results.
pub fn hashes(folder: &Path) -> Vec<(PathBuf, String)> {
    let mut all: Vec<(PathBuf, String)> = std::fs::read_dir(folder)
        .unwrap()
        .map(|e| e.unwrap().path())
        .filter(|p| p.is_file())
        .map(|p| {
            let hash = satphot::base::hash::sha256_16(&p).unwrap();
            (p, hash)
        })
        .collect();
    all.sort();
    all
}
