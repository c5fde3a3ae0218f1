//! Tables of numbers: a wavelength column that rises, further columns, comments, at most one header line.
//!
//! Columns are parted by commas, semicolons, tabs or blanks. Units are the caller's.

use std::path::Path;

use crate::base::error::{Error, Result};

/// The rows of a file, `columns` numbers in each, wavelengths strictly rising.
///
/// # Errors
/// [`Error::Io`] when it cannot be read; [`Error::Table`] with its line for a row that is not so many finite numbers,
/// a wavelength that is not above 0 and above the one before, or fewer than two rows.
pub(crate) fn read(path: &Path, columns: usize) -> Result<Vec<Vec<f64>>> {
    let text = std::fs::read_to_string(path).map_err(|e| Error::io(path, e))?;
    parse(&text, path, columns)
}

/// The same of a table that is part of the program.
pub(crate) fn embedded(text: &str, name: &str, columns: usize) -> Result<Vec<Vec<f64>>> {
    parse(text, Path::new(name), columns)
}

fn parse(text: &str, path: &Path, columns: usize) -> Result<Vec<Vec<f64>>> {
    let fault = |line: Option<usize>, problem: String| Error::Table { path: path.to_owned(), line, problem };
    let mut rows: Vec<Vec<f64>> = Vec::new();
    let mut header_allowed = true;
    for (i, line) in text.lines().enumerate() {
        let line = line.trim().trim_start_matches('\u{feff}');
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let fields: Vec<&str> =
            line.split([',', ';', '\t', ' ']).map(str::trim).filter(|field| !field.is_empty()).collect();
        let numbers: std::result::Result<Vec<f64>, _> = fields.iter().map(|f| f.parse::<f64>()).collect();
        let header = header_allowed && fields.first().is_some_and(|f| f.starts_with(|c: char| c.is_alphabetic()));
        header_allowed = false;
        let Ok(row) = numbers else {
            if header {
                continue;
            }
            return Err(fault(Some(i + 1), format!("\"{line}\" is not {columns} numbers")));
        };
        if row.len() != columns || row.iter().any(|v| !v.is_finite()) {
            return Err(fault(Some(i + 1), format!("\"{line}\" is not {columns} finite numbers")));
        }
        let before_nm = rows.last().map_or(0.0, |r| r[0]);
        if row[0] <= before_nm {
            return Err(fault(Some(i + 1), format!("wavelength {} nm does not rise from {before_nm} nm", row[0])));
        }
        rows.push(row);
    }
    if rows.len() < 2 {
        return Err(fault(None, format!("{} rows of numbers; at least 2", rows.len())));
    }
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line_of(text: &str) -> Option<usize> {
        match parse(text, Path::new("t"), 2).unwrap_err() {
            Error::Table { line, .. } => line,
            other => panic!("{other}"),
        }
    }

    #[test]
    fn commas_blanks_tabs_comments_and_a_header_are_all_read() {
        let expected = vec![vec![500.0, 0.1], vec![510.0, 0.2]];
        for text in [
            "wavelength_nm,transmission\n500,0.1\n510,0.2\n",
            "# c\n500 .1\n\n510\t2e-1",
            "\u{feff}500; 0.1\r\n510; 0.2",
        ] {
            assert_eq!(parse(text, Path::new("t"), 2).unwrap(), expected, "{text:?}");
        }
    }

    #[test]
    fn a_damaged_row_is_named_by_its_line() {
        assert_eq!(line_of("a,b\n500,0.1\n510,x\n520,1"), Some(3));
        assert_eq!(line_of("500,0.1\n510\n520,1"), Some(2));
        assert_eq!(line_of("500,0.1\n500,0.2"), Some(2));
        assert_eq!(line_of("500,0.1\n510,nan"), Some(2));
        assert_eq!(line_of("-5,0.1\n510,1"), Some(1));
        assert_eq!(line_of("a,b\nc,d\n1,1"), Some(2));
        assert_eq!(line_of(""), None);
    }
}
