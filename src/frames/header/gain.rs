//! GAIN: the camera's setting for amateur programs, electrons per ADU for observatories.
//!
//! Settings in 0.1 dB as the camera counts them, conversion in e⁻/ADU. It does not cover the camera tables
//! ([`crate::frames::camera`]), which win over the header unless the configuration says otherwise.

use super::names::{Aliases, keywords};
use super::sourced::Sourced;
use crate::fits::cards::Header;
use crate::frames::frame::GainSetting;

/// The gain as a header states it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct HeaderGain {
    /// The camera's setting.
    pub setting: Option<Sourced<GainSetting>>,
    /// Electrons per ADU.
    pub e_per_adu: Option<Sourced<f64>>,
    /// Warnings.
    pub warnings: Vec<String>,
}

/// A GAIN below this with a decimal point and nothing else said is e⁻/ADU.
const LARGEST_E_PER_ADU: f64 = 20.0;

/// Setting and electrons per ADU of a header.
///
/// GAIN is a setting unless its comment says electrons, it has decimals, or it is a small number written with a decimal
/// point and no comment (observatories). Zero or negative electrons per ADU are unset.
#[must_use]
pub fn header_gain(header: &Header, aliases: &Aliases) -> HeaderGain {
    let mut stated = HeaderGain::default();
    for key in keywords(aliases, "egain") {
        let Some(text) = header.text(key) else { continue };
        match header.number(key) {
            Some(v) if v > 0.0 => {
                stated.e_per_adu.get_or_insert(Sourced::new(v, key));
            }
            _ => stated.warnings.push(format!("{key} = '{text}' is not a number of e-/ADU: it is not used")),
        }
    }
    let own = aliases.get("gain").into_iter().flatten();
    if let Some((key, setting)) = own.into_iter().find_map(|k| Some((k, header.integer(k)?))) {
        stated.setting = Some(Sourced::new(GainSetting(setting), key.as_str()));
        return stated;
    }
    let Some(text) = header.text("GAIN") else { return stated };
    let Some(value) = header.number("GAIN") else {
        stated.warnings.push(format!("GAIN = '{text}' is not a number"));
        return stated;
    };
    let comment = header.comment("GAIN").unwrap_or_default().to_ascii_lowercase();
    let electrons = (comment.contains("electron") || comment.contains("e-") || comment.contains("e/"))
        && !comment.contains("db")
        && !comment.contains("setting");
    let small = comment.is_empty() && text.contains('.') && value > 0.0 && value < LARGEST_E_PER_ADU;
    if electrons || value.fract() != 0.0 || small {
        if value <= 0.0 {
            stated.warnings.push(format!("GAIN = {text} [{comment}]: not positive, unset"));
        } else if stated.e_per_adu.is_none() {
            stated.e_per_adu = Some(Sourced::new(value, "GAIN"));
            if !electrons {
                stated.warnings.push(format!(
                    "GAIN = {text} is taken as e-/ADU, not as a setting; if it is a setting, name it in header.aliases.gain"
                ));
            }
        }
        return stated;
    }
    stated.setting = header.integer("GAIN").map(|v| Sourced::new(GainSetting(v), "GAIN"));
    stated
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(cards: &str) -> (Option<i64>, Option<f64>) {
        let g = header_gain(&Header::from_text(cards), &Aliases::new());
        (g.setting.map(|s| s.value.0), g.e_per_adu.map(|e| e.value))
    }

    #[test]
    fn gain_is_a_setting_for_amateurs_and_electrons_for_observatories() {
        let nina = "GAIN    =                  120 / Sensor gain\nEGAIN   =     1.00224268436432 / [e-/ADU]\n";
        assert_eq!(of(nina), (Some(120), Some(1.00224268436432)));
        assert_eq!(of("GAIN    =            1.0000000 / [electrons/count] Pixel gain\n"), (None, Some(1.0)));
        assert_eq!(of("GAIN    =                0.000 / [electron/ADU] AD conversion factor\n"), (None, None));
        assert_eq!(of("GAIN    =                  1.5\n"), (None, Some(1.5)));
        assert_eq!(of("GAIN    =                  2.0\n"), (None, Some(2.0)));
        assert_eq!(of("GAIN    =                    2\n"), (Some(2), None));
        assert_eq!(of("GAIN    =                  0.0 / gain or ISO depending on instrument\n"), (Some(0), None));
        assert_eq!(of("GAIN    =                200.0\n"), (Some(200), None));
        assert_eq!(of("CVF     =                 0.35\nGAIN    = '200'\n"), (Some(200), Some(0.35)));
        assert_eq!(of("EGAIN   =                 -1.0\nCVF     = 0.4\n"), (None, Some(0.4)));
    }
}
