//! Whether a header names the configured camera: names of one camera as makers, drivers and observers spell them.
//!
//! Compared are model designations (letters with a number: ASI6200MM, QHY600M, C3-61000), without case, punctuation,
//! the maker's name and words such as "Pro" or "Camera". It does not cover which sensor is in which camera.

/// The result of comparing the name in a header with the configured camera.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CameraCheck {
    /// It is the configured camera.
    Same,
    /// It is another model.
    Other,
    /// One of the names holds no model: they cannot be compared.
    NoModel,
}

/// Words that do not identify the model.
const NOISE: [&str; 15] = [
    "zwo",
    "zwoptical",
    "qhyccd",
    "camera",
    "cameras",
    "capture",
    "cooled",
    "cool",
    "ccd",
    "cmos",
    "usb",
    "usb2",
    "usb3",
    "pro",
    "imager",
];

/// A hexadecimal number of so many digits is a serial number.
const SERIAL: usize = 9;

/// Compares the camera a header names with the configured one.
///
/// Two names are of the same camera where one model designation holds the other without splitting a number:
/// `ZWO CCD ASI6200MM Pro` is `asi6200mm`, and `asi6200` may be either of its variants; `ASI6200MC` is not `asi6200mm`.
/// A name without a model (`ASI Camera (1)`, `QHYCCD-Cameras-Capture`) is not compared, unless both names are equal.
#[must_use]
pub fn check_camera(in_header: &str, configured: &str) -> CameraCheck {
    let (a, b) = (designation(in_header), designation(configured));
    if a == b {
        return CameraCheck::Same;
    }
    if !names_a_model(&a) || !names_a_model(&b) {
        return CameraCheck::NoModel;
    }
    if holds(&a, &b) || holds(&b, &a) { CameraCheck::Same } else { CameraCheck::Other }
}

/// The name without case, punctuation, numbers in brackets and words that do not identify the model.
fn designation(name: &str) -> String {
    let mut depth = 0_usize;
    let plain: String = name
        .to_ascii_lowercase()
        .chars()
        .map(|c| {
            match c {
                '(' | '[' => depth += 1,
                ')' | ']' => depth = depth.saturating_sub(1),
                _ if depth == 0 && c.is_ascii_alphanumeric() => return c,
                _ => {}
            }
            ' '
        })
        .collect();
    let words = plain.split_whitespace().map(|word| {
        let word = word.strip_prefix("zwo").filter(|rest| !rest.is_empty()).unwrap_or(word);
        word.strip_suffix("pro").filter(|rest| names_a_model(rest)).unwrap_or(word)
    });
    words.filter(|word| !NOISE.contains(word)).collect()
}

/// Whether there is a model in a designation: a number of three digits, or letters with a number; no serial number,
/// which is long and hexadecimal.
fn names_a_model(designation: &str) -> bool {
    if designation.len() >= SERIAL && designation.bytes().all(|b| b.is_ascii_hexdigit()) {
        return false;
    }
    let digits = designation.chars().filter(char::is_ascii_digit).count();
    digits > 0 && (digits < designation.len() || digits >= 3)
}

/// Whether `part` stands in `whole` without a digit next to one of its own at either end.
fn holds(whole: &str, part: &str) -> bool {
    let digit = |c: Option<char>| c.is_some_and(|c| c.is_ascii_digit());
    whole.match_indices(part).any(|(at, _)| {
        let (before, after) = (whole[..at].chars().next_back(), whole[at + part.len()..].chars().next());
        let splits_front = digit(before) && digit(part.chars().next());
        let splits_end = digit(after) && digit(part.chars().next_back());
        !splits_front && !splits_end
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_camera_is_recognised_as_drivers_and_observers_spell_it() {
        for in_header in [
            "asi6200mm",
            "ZWO ASI6200MM Pro",
            "ZWO CCD ASI6200MM Pro",
            "ZWO ASI6200MM-Pro(USB3)",
            "ZWOASI6200MMPro",
            "ASI 6200 MM",
            "ASI6200",
            "CDK24 + ASI6200MM",
        ] {
            assert_eq!(check_camera(in_header, "asi6200mm"), CameraCheck::Same, "{in_header}");
        }
        for (in_header, configured) in [
            ("QHY600M-34b7c1d2e", "qhy600"),
            ("QHYCCD QHY268M", "qhy268m"),
            ("Moravian Instruments, C3-61000 PRO", "c3-61000"),
            ("Atik 383L+", "atik383l"),
            ("fa16", "fa16"),
            ("apogee", "Apogee"),
        ] {
            assert_eq!(check_camera(in_header, configured), CameraCheck::Same, "{in_header} {configured}");
        }
    }

    #[test]
    fn another_model_is_another_camera_and_a_name_without_one_says_nothing() {
        for (in_header, configured) in [
            ("ZWO ASI183MM Pro", "asi6200mm"),
            ("ZWO ASI6200MC Pro", "asi6200mm"),
            ("ZWO ASI620MM", "asi6200mm"),
            ("ASI2600MM Pro", "ASI6200MM Pro"),
            ("QHY600M", "asi6200mm"),
            ("qhy9", "qhy90"),
        ] {
            assert_eq!(check_camera(in_header, configured), CameraCheck::Other, "{in_header} {configured}");
        }
        for in_header in ["ASI Camera (1)", "QHYCCD-Cameras-Capture", "Vatt", "1", "371d420013090900"] {
            assert_eq!(check_camera(in_header, "asi6200mm"), CameraCheck::NoModel, "{in_header}");
        }
    }
}
