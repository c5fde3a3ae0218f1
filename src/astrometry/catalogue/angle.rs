//! Cells of a catalogue to degrees: decimal degrees, hours, radians, or sexagesimal.
//!
//! Right ascension `12:34:56.7`, `12 34 56.7` and `12h34m56.7s` is in hours, declination in degrees, as everywhere.

use crate::tables::read::{Column, number};

/// How a column of angles is written.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Angle {
    /// A decimal number times this gives degrees; a sexagesimal one is of hours (right ascension) or of degrees.
    Decimal(f64),
    /// Sexagesimal even where the cell is a whole number.
    Sexagesimal,
}

impl Angle {
    /// From the unit of a column; a column without one is in degrees.
    ///
    /// # Errors
    /// The problem of a unit that is not one of an angle, in words.
    pub fn of(column: &Column) -> Result<Angle, String> {
        let unit = column.unit.trim().trim_matches('"').to_ascii_lowercase();
        match unit.as_str() {
            "" | "deg" | "degree" | "degrees" | "degr" | "d" | "°" | "angle[deg]" => Ok(Angle::Decimal(1.0)),
            "h" | "hr" | "hour" | "hours" | "hourangle" => Ok(Angle::Decimal(15.0)),
            "rad" | "radian" | "radians" => Ok(Angle::Decimal(180.0 / std::f64::consts::PI)),
            u if u.contains(':') || matches!(u, "hms" | "dms" | "sexagesimal" | "h m s" | "d m s") => {
                Ok(Angle::Sexagesimal)
            }
            _ => Err(format!(
                "column `{}` is in `{}`; degrees, hours, radians or sexagesimal (\"h:m:s\", \"d:m:s\") are read",
                column.name, column.unit
            )),
        }
    }

    /// Degrees of a cell; `hours` for a right ascension.
    pub fn degrees(self, cell: &str, hours: bool) -> Option<f64> {
        let sexagesimal = || sexagesimal(cell).map(|v| if hours { 15.0 * v } else { v });
        match self {
            Angle::Decimal(factor) => number(cell).map(|v| factor * v).or_else(sexagesimal),
            Angle::Sexagesimal => sexagesimal(),
        }
    }
}

/// `-01 23 45.6`, `-01:23:45.6`, `-01d23m45.6s`, `12 34.5`: the first part with its fractions; `None` for anything else.
pub fn sexagesimal(text: &str) -> Option<f64> {
    let text = text.trim();
    let negative = text.starts_with(['-', '−']);
    let bare = text.trim_start_matches(['+', '-', '−']);
    let parts: Vec<f64> = bare
        .split(|c: char| c.is_whitespace() || ":hdms°'\"′″".contains(c))
        .filter(|p| !p.is_empty())
        .map(|p| Some(p).filter(|p| p.starts_with(|c: char| c.is_ascii_digit())).and_then(number))
        .collect::<Option<_>>()?;
    let whole = |v: &f64| v.fract() == 0.0;
    let below_60 = parts.iter().skip(1).all(|v| *v < 60.0);
    // only the last part may have a fraction
    if parts.is_empty() || parts.len() > 3 || !below_60 || !parts[..parts.len() - 1].iter().all(whole) {
        return None;
    }
    let value = parts.iter().rev().fold(0.0, |sum, part| sum / 60.0 + part);
    Some(if negative { -value } else { value })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sexagesimal_places_are_read_in_every_common_dress() {
        for text in ["-00:30:36", "-00 30 36", "-00d30m36s", "-0°30'36\""] {
            assert!((sexagesimal(text).unwrap() + 0.51).abs() < 1e-12, "{text}");
        }
        assert!((sexagesimal("12 30.5").unwrap() - 12.508_333_333_333_333).abs() < 1e-12);
        for text in ["", "--", "1:60:00", "1:2:3:4", "1.5:20", "n/a", "1:-2:3"] {
            assert_eq!(sexagesimal(text), None, "{text}");
        }
    }

    #[test]
    fn a_right_ascension_in_parts_is_of_hours_and_a_declination_of_degrees() {
        let plain = Angle::Decimal(1.0);
        assert_eq!((plain.degrees("10:00:00", true), plain.degrees("10:00:00", false)), (Some(150.0), Some(10.0)));
        assert_eq!((plain.degrees("10", true), Angle::Sexagesimal.degrees("10", true)), (Some(10.0), Some(150.0)));
        let of = |unit: &str| Angle::of(&Column { unit: unit.into(), ..Column::default() });
        assert_eq!(of("\"h:m:s\""), Ok(Angle::Sexagesimal));
        assert_eq!(of("hourangle"), Ok(Angle::Decimal(15.0)));
        assert!(of("pix").unwrap_err().contains("`pix`"));
    }
}
