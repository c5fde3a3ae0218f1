//! The unit of a foreign column: what a number in it is multiplied by to be in satphot's own.
//!
//! Degrees, km, seconds, magnitudes. A unit of something else is an error, never ignored. Spellings of astropy, FITS 4.0 table 3
//! and VOUnits 1.0. Not supported: products and powers, and magnitudes of a system, which are magnitudes.

/// What a column must be of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Measure {
    /// An angle, in degrees.
    AngleDeg,
    /// A length, in km.
    LengthKm,
    /// A length, in m.
    LengthM,
    /// A duration, in s.
    TimeS,
    /// A magnitude or a difference of magnitudes.
    Mag,
}

/// Unit, what it measures, and its size in degrees, km, s or mag.
const UNITS: &[(&str, Measure, f64)] = &[
    ("deg", Measure::AngleDeg, 1.0),
    ("degree", Measure::AngleDeg, 1.0),
    ("degrees", Measure::AngleDeg, 1.0),
    ("°", Measure::AngleDeg, 1.0),
    ("rad", Measure::AngleDeg, 180.0 / std::f64::consts::PI),
    ("radian", Measure::AngleDeg, 180.0 / std::f64::consts::PI),
    ("radians", Measure::AngleDeg, 180.0 / std::f64::consts::PI),
    ("mrad", Measure::AngleDeg, 0.18 / std::f64::consts::PI),
    ("arcmin", Measure::AngleDeg, 1.0 / 60.0),
    ("arcsec", Measure::AngleDeg, 1.0 / 3600.0),
    ("mas", Measure::AngleDeg, 1.0 / 3.6e6),
    ("hourangle", Measure::AngleDeg, 15.0),
    ("km", Measure::LengthKm, 1.0),
    ("kilometer", Measure::LengthKm, 1.0),
    ("kilometers", Measure::LengthKm, 1.0),
    ("kilometre", Measure::LengthKm, 1.0),
    ("kilometres", Measure::LengthKm, 1.0),
    ("m", Measure::LengthKm, 1e-3),
    ("meter", Measure::LengthKm, 1e-3),
    ("meters", Measure::LengthKm, 1e-3),
    ("metre", Measure::LengthKm, 1e-3),
    ("metres", Measure::LengthKm, 1e-3),
    ("Mm", Measure::LengthKm, 1e3),
    ("ft", Measure::LengthKm, 0.3048e-3),
    ("AU", Measure::LengthKm, crate::base::constants::AU_KM),
    ("au", Measure::LengthKm, crate::base::constants::AU_KM),
    ("s", Measure::TimeS, 1.0),
    ("sec", Measure::TimeS, 1.0),
    ("second", Measure::TimeS, 1.0),
    ("seconds", Measure::TimeS, 1.0),
    ("ms", Measure::TimeS, 1e-3),
    ("us", Measure::TimeS, 1e-6),
    ("min", Measure::TimeS, 60.0),
    ("minute", Measure::TimeS, 60.0),
    ("minutes", Measure::TimeS, 60.0),
    ("h", Measure::TimeS, 3600.0),
    ("hr", Measure::TimeS, 3600.0),
    ("hour", Measure::TimeS, 3600.0),
    ("hours", Measure::TimeS, 3600.0),
    ("d", Measure::TimeS, 86_400.0),
    ("day", Measure::TimeS, 86_400.0),
    ("days", Measure::TimeS, 86_400.0),
    ("mag", Measure::Mag, 1.0),
    ("mags", Measure::Mag, 1.0),
    ("mmag", Measure::Mag, 1e-3),
];

impl Measure {
    /// What the column of a key must be of, by the unit that ends the key: `alt_deg`, `range_km`, `exptime_s`, `v_mag_err`.
    #[must_use]
    pub fn of_key(key: &str) -> Option<Measure> {
        let bare = key.strip_suffix("_err").unwrap_or(key);
        match bare.rsplit('_').next() {
            Some("deg") => Some(Measure::AngleDeg),
            Some("km") => Some(Measure::LengthKm),
            Some("m") => Some(Measure::LengthM),
            Some("s") => Some(Measure::TimeS),
            Some("mag") => Some(Measure::Mag),
            _ => None,
        }
    }

    /// What a number of this unit is multiplied by; `None` for a unit of something else, or one that is not known.
    #[must_use]
    pub fn factor(self, unit: &str) -> Option<f64> {
        let unit = unit.trim().trim_matches(['"', '\'']);
        let of = |name: &str| UNITS.iter().find(|(known, ..)| *known == name);
        // `M` is no metre, `KM` and `Deg` are what they look like
        let small = unit.to_lowercase();
        let known = of(unit).or_else(|| if unit.chars().count() > 1 { of(&small) } else { None });
        match (known, self) {
            (Some((_, Measure::LengthKm, size)), Measure::LengthM) => Some(size * 1e3),
            (Some((_, measure, size)), _) if *measure == self => Some(*size),
            // `mag(AB)`, `vegamag` and the like
            (None, Measure::Mag) => Some(1.0),
            _ => None,
        }
    }

    /// The unit satphot reads it as, and others that are converted.
    #[must_use]
    pub fn accepted(self) -> &'static str {
        match self {
            Measure::AngleDeg => "deg, rad, arcmin, arcsec",
            Measure::LengthKm | Measure::LengthM => "km, m",
            Measure::TimeS => "s, ms, min, h, d",
            Measure::Mag => "mag, mmag",
        }
    }
}

/// Whether a text is a unit that is known.
#[must_use]
pub fn is_unit(text: &str) -> bool {
    UNITS.iter().any(|(known, ..)| *known == text || known.eq_ignore_ascii_case(text) && text.len() > 1)
}

/// The unit that ends the name of a column (`sun_alt_rad`, `height_m`); nothing if none does. Magnitudes end a name whatever
/// their unit.
#[must_use]
pub fn unit_in_name(name: &str) -> &'static str {
    let last = name.rsplit('_').next().unwrap_or_default();
    let ends = ["deg", "rad", "arcsec", "arcmin", "km", "m", "s", "ms"];
    ends.into_iter().find(|unit| *unit == last && name.len() > last.len()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_converted_and_those_of_something_else_are_refused() {
        let close = |a: Option<f64>, b: f64| assert!((a.unwrap() / b - 1.0).abs() < 1e-15, "{a:?} {b}");
        close(Measure::AngleDeg.factor("rad"), 57.295_779_513_082_32);
        close(Measure::AngleDeg.factor("Degrees"), 1.0);
        close(Measure::LengthKm.factor("m"), 1e-3);
        close(Measure::LengthM.factor("km"), 1e3);
        close(Measure::LengthM.factor("m"), 1.0);
        close(Measure::LengthKm.factor("KM"), 1.0);
        close(Measure::TimeS.factor("'ms'"), 1e-3);
        close(Measure::Mag.factor("mag(AB)"), 1.0);
        close(Measure::Mag.factor("mmag"), 1e-3);
        for (measure, unit) in [
            (Measure::AngleDeg, "km"),
            (Measure::LengthKm, "deg"),
            (Measure::LengthKm, "M"),
            (Measure::TimeS, "pix"),
            (Measure::Mag, "s"),
        ] {
            assert_eq!(measure.factor(unit), None, "{unit}");
        }
        assert_eq!(Measure::of_key("v_mag_err"), Some(Measure::Mag));
        assert_eq!(Measure::of_key("norad_cat_id"), None);
    }
}
