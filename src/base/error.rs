//! What stops a night, a stage or a file: one enum, grouped by what the observer must do.
//!
//! Each message names the file, the keyword, the value and the remedy. What only taints a row is a flag
//! ([`crate::tables::flags::Flags`]) in that row, never an error.

use std::path::PathBuf;

/// What stops a night. A bad pixel or a lost star sets a flag in its row instead.
///
/// ```
/// let error = satphot::Site::new(95.0, 0.0, 0.0).unwrap_err();
/// assert!(matches!(&error, satphot::Error::Config { key, .. } if key == "site.lat_deg"));
/// assert_eq!(error.exit_code(), 2);
/// ```
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    // --- fix the configuration (exit code 2)
    /// A key or a value of the configuration is wrong.
    #[error("configuration: {key}: {problem}")]
    Config {
        /// Dotted key, e.g. `photometry.clip_radius_px`.
        key: String,
        /// What is wrong and what would be accepted, with the unit.
        problem: String,
    },

    /// An argument of a function, which is an option of the command line, is wrong.
    #[error("argument `{name}`: {problem}")]
    Argument {
        /// Its name, e.g. `step_min`.
        name: String,
        /// What is wrong and what would be accepted, with the unit.
        problem: String,
    },

    /// Several things stand against a night before its work begins; the first decides the exit code.
    #[error("{}", all_of(problems, paste))]
    Preflight {
        /// Each of them.
        problems: Vec<Error>,
        /// Lines that pipeline.toml lacks, by table; empty if none would help.
        paste: String,
    },

    // --- fix the input files (exit code 4)
    /// A file or folder cannot be read or written.
    #[error("{path}: {}", in_words(.source))]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What the operating system said.
        #[source]
        source: std::io::Error,
    },
    /// There is nothing to work on.
    #[error("{path}: {problem}")]
    NoInput {
        /// The folder or file that was looked at.
        path: PathBuf,
        /// What is missing and where to put it.
        problem: String,
    },
    /// A FITS file that is damaged, or of a kind that is not an image.
    #[error("{path}: {problem}")]
    Fits {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        problem: String,
    },
    /// A header keyword is missing or has a value that cannot be used.
    #[error("{path}: header {keyword}: {problem}")]
    Header {
        /// The file.
        path: PathBuf,
        /// The keyword or the list of synonyms looked for.
        keyword: String,
        /// What is wrong, and the configuration key that helps.
        problem: String,
    },
    /// A table (catalogue, elements, zeropoint, photometry) that cannot be parsed.
    #[error("{path}{}: {problem}", line.map(|l| format!(":{l}")).unwrap_or_default())]
    Table {
        /// The file.
        path: PathBuf,
        /// 1-based line, where known.
        line: Option<usize>,
        /// What is wrong.
        problem: String,
    },

    // --- calibration, catalogue or orbit missing (exit code 5)
    /// The camera table has no row for this gain setting: it is never extrapolated.
    #[error(
        "{path}: gain setting {setting} (0.1 dB) is not in the table of camera {camera}; \
         add it to [detector.e_per_adu] (\"{setting}\" = electrons per ADU) or set detector.use_header_egain = true"
    )]
    GainNotTabulated {
        /// The frame.
        path: PathBuf,
        /// GAIN of its header [0.1 dB].
        setting: i64,
        /// The camera whose table was searched.
        camera: String,
    },
    /// No master flat can be made or used.
    #[error("flat: {problem}")]
    Flat {
        /// Why, and what would help.
        problem: String,
    },
    /// The star catalogue is missing or holds no usable star.
    #[error("catalogue {path}: {problem}")]
    Catalogue {
        /// The catalogue file.
        path: PathBuf,
        /// Why, and what would help.
        problem: String,
    },
    /// Orbital elements are missing, too old, not of the object, or the propagation failed (damaged files are
    /// [`Error::Table`]).
    #[error("orbit: {problem}")]
    Orbit {
        /// Why, and what would help.
        problem: String,
    },

    // --- take more stars (exit code 3)
    /// The zeropoint cannot be fitted.
    #[error("zeropoint: {problem}")]
    Zeropoint {
        /// How many stars were left by which cut, how many are needed.
        problem: String,
    },
    /// A model input that makes no physical sense.
    #[error("model: {problem}")]
    Model {
        /// Which quantity, its value and the accepted range.
        problem: String,
    },
    /// Results were written, but they are not good enough to be called a success.
    #[error("{problem}")]
    PoorNight {
        /// What failed, with counts.
        problem: String,
    },

    // --- check what was changed (exit code 6)
    /// A check of finished results against what they say of themselves failed.
    #[error("{problem}")]
    Mismatch {
        /// Which files differ, and how.
        problem: String,
    },

    // --- try again (exit code 75)
    /// Something outside stood in the way that may be gone the next time: another run in the folder, a server.
    #[error("{problem}")]
    Temporary {
        /// What stood in the way, and when to try again.
        problem: String,
    },

    // --- go on later (exit code 128 + signal)
    /// A stop was requested; what was finished is kept.
    #[error("{problem}")]
    Interrupted {
        /// The signal: 2 from the keyboard, 15 from a scheduler.
        signal: u8,
        /// What was finished, and the line that goes on.
        problem: String,
    },
}

impl Error {
    /// The process exit code of this error (`docs/exit_codes.md`).
    #[must_use]
    pub fn exit_code(&self) -> u8 {
        match self {
            Error::Config { .. } | Error::Argument { .. } | Error::Model { .. } => 2,
            Error::PoorNight { .. } | Error::Zeropoint { .. } => 3,
            Error::Io { .. }
            | Error::NoInput { .. }
            | Error::Fits { .. }
            | Error::Header { .. }
            | Error::Table { .. } => 4,
            Error::Preflight { problems, .. } => problems.first().map_or(2, Error::exit_code),
            Error::Mismatch { .. } => 6,
            Error::Temporary { .. } => 75,
            Error::Interrupted { signal, .. } => 128 | signal,
            Error::GainNotTabulated { .. } | Error::Flat { .. } | Error::Catalogue { .. } | Error::Orbit { .. } => 5,
        }
    }

    /// An I/O error with its path.
    #[doc(hidden)]
    pub fn io(path: impl Into<PathBuf>, source: std::io::Error) -> Self {
        Error::Io { path: path.into(), source }
    }
}

/// What the operating system said, without its number.
fn in_words(error: &std::io::Error) -> String {
    use std::io::ErrorKind;
    // one with words of its own
    if error.raw_os_error().is_none() {
        return error.to_string();
    }
    match error.kind() {
        ErrorKind::NotFound => "no such file or folder".into(),
        ErrorKind::IsADirectory => "is a folder; name a file".into(),
        ErrorKind::NotADirectory => "a part of this path is a file, not a folder".into(),
        ErrorKind::PermissionDenied => "permission denied; make it readable for this user".into(),
        _ => {
            let text = error.to_string();
            text.split(" (os error").next().unwrap_or(&text).to_string()
        }
    }
}

/// Problems a line each, and the lines to paste.
fn all_of(problems: &[Error], paste: &str) -> String {
    let mut text = match problems {
        [only] => only.to_string(),
        _ => {
            let lines: Vec<String> = problems.iter().map(|p| format!("  {p}")).collect();
            format!("{} problems before any frame is measured:\n{}", problems.len(), lines.join("\n"))
        }
    };
    if !paste.is_empty() {
        text += &format!("\nlines to paste into pipeline.toml:\n{}", paste.trim_end());
    }
    text
}

/// The result of everything that can stop a night.
pub type Result<T> = std::result::Result<T, Error>;
