//! The rules of the verdicts: how near a computed number must be to the printed one, by the kind of number.
//!
//! Tolerances in the unit of the row. A verdict follows from the rule and the numbers alone.

/// What kind of number a row holds, and with it how near is the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rule {
    /// A number that follows from stated ones: one unit of the last digit printed, rounded or cut off.
    Digits,
    /// A number printed as approximate (~, about): 2 %.
    About,
    /// A count: equal.
    Count,
    /// A count printed as approximate: one.
    AboutCount,
    /// A share of the day: 0.5 points of a per cent.
    Share,
    /// The lit share of the Moon at a time: 1 point of a per cent, as `satphot check-table` allows.
    MoonShare,
    /// The altitude of the Sun at a time rounded to ten minutes: 2.5 deg, what it moves in them.
    SunAltitude,
    /// A pass at a time rounded to ten minutes: 10 deg or more of altitude within ten minutes of it.
    Pass,
    /// A limiting or offset magnitude: 0.05 mag.
    Limit,
    /// A modelled magnitude, or the mean of some: 0.3 mag.
    Model,
    /// One pass against the headline residual: its spread, 0.80 mag.
    Residual,
    /// A bound from below: not less.
    AtLeast,
    /// A bound from above: not more.
    AtMost,
    /// A printed formula: 1 % from what the physics gives, 0.05 in magnitudes.
    Formula,
}

/// Lowest altitude that makes a pass \[deg\].
const PASS_ALT_DEG: f64 = 10.0;

impl Rule {
    /// Every rule, in the order of the legend.
    pub const ALL: [Rule; 14] = [
        Self::Digits,
        Self::About,
        Self::Count,
        Self::AboutCount,
        Self::Share,
        Self::MoonShare,
        Self::SunAltitude,
        Self::Pass,
        Self::Limit,
        Self::Model,
        Self::Residual,
        Self::AtLeast,
        Self::AtMost,
        Self::Formula,
    ];

    /// Its name in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Digits => "digits",
            Self::About => "about",
            Self::Count => "count",
            Self::AboutCount => "about a count",
            Self::Share => "share",
            Self::MoonShare => "Moon's share",
            Self::SunAltitude => "Sun's altitude",
            Self::Pass => "pass",
            Self::Limit => "limit",
            Self::Model => "model",
            Self::Residual => "residual",
            Self::AtLeast => "at least",
            Self::AtMost => "at most",
            Self::Formula => "formula",
        }
    }

    /// The criterion in words.
    #[must_use]
    pub fn criterion(self) -> &'static str {
        match self {
            Self::Digits => "within one unit of the last digit printed",
            Self::About => "printed as approximate: within 2 %",
            Self::Count => "the same count",
            Self::AboutCount => "a count printed as approximate: within one",
            Self::Share => "a share of the day: within 0.5 %",
            Self::MoonShare => "the Moon's lit share at a time: within 1 %",
            Self::SunAltitude => "the Sun at a time rounded to ten minutes: within 2.5 deg",
            Self::Pass => "a pass: 10 deg of altitude or more within ten minutes of the time",
            Self::Limit => "a limiting magnitude, or an offset: within 0.05 mag",
            Self::Model => "a modelled magnitude: within 0.3 mag",
            Self::Residual => "one pass against the headline residual: within its spread, 0.80 mag",
            Self::AtLeast => "a lower bound: not less",
            Self::AtMost => "an upper bound: not more",
            Self::Formula => "a printed formula: within 1 % (0.05 mag) of what the physics gives",
        }
    }

    /// How far a number may be from `value` \[unit of the row\]; `printed` gives the digits. 0 for bounds.
    #[must_use]
    pub fn tolerance(self, printed: &str, value: f64, is_mag: bool) -> f64 {
        match self {
            Self::Digits => last_digit(printed),
            Self::About => 0.02 * value.abs(),
            Self::Count | Self::Pass | Self::AtLeast | Self::AtMost => 0.0,
            Self::AboutCount | Self::MoonShare => 1.0,
            Self::Share => 0.5,
            Self::SunAltitude => 2.5,
            Self::Limit => 0.05,
            Self::Model => 0.3,
            Self::Residual => 0.8,
            Self::Formula => {
                if is_mag {
                    0.05
                } else {
                    0.01 * value.abs()
                }
            }
        }
    }

    /// Whether a computed number agrees with `value` by this rule.
    #[must_use]
    pub fn agrees(self, computed: f64, printed: &str, value: f64, is_mag: bool) -> bool {
        // what is left by the arithmetic is no disagreement
        let tolerance = self.tolerance(printed, value, is_mag) + 1e-9 * value.abs();
        match self {
            Self::AtLeast => computed >= value - tolerance,
            Self::AtMost => computed <= value + tolerance,
            Self::Pass => computed >= PASS_ALT_DEG,
            _ => (computed - value).abs() <= tolerance,
        }
    }
}

/// One unit of the last digit of the first number in a text; thousands are set apart by commas.
fn last_digit(printed: &str) -> f64 {
    let from = printed.find(|c: char| c.is_ascii_digit()).unwrap_or(0);
    let number: String = printed[from..].chars().take_while(|c| c.is_ascii_digit() || matches!(c, '.' | ',')).collect();
    let number = number.trim_end_matches([',', '.']);
    match number.split_once('.') {
        Some((_, decimals)) => 10f64.powi(-i32::try_from(decimals.len()).unwrap_or(0)),
        None => 1.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_rule_lets_through_what_it_says_and_no_more() {
        assert_eq!([last_digit("-23.37 ± 0.11"), last_digit("~12.5"), last_digit("16,000,000")], [0.01, 0.1, 1.0]);
        let agrees =
            |rule: Rule, computed: f64, printed: &str, value: f64| rule.agrees(computed, printed, value, false);
        assert!(agrees(Rule::Digits, 1.306, "1.30", 1.30) && !agrees(Rule::Digits, 1.312, "1.30", 1.30));
        assert!(!agrees(Rule::Count, 14.0, "11", 11.0) && agrees(Rule::Count, 11.0, "11", 11.0));
        assert!(agrees(Rule::AboutCount, 7.0, "~6", 6.0) && !agrees(Rule::AboutCount, 8.0, "~6", 6.0));
        assert!(agrees(Rule::About, 727_273.0, "~730,000", 730_000.0));
        assert!(!agrees(Rule::About, 372_529.0, "~400,000", 400_000.0));
        assert!(agrees(Rule::Pass, 32.1, "a pass", 0.0) && !agrees(Rule::Pass, -88.7, "a pass", 0.0));
        assert!(!agrees(Rule::AtLeast, 93.2, "at least 100", 100.0) && agrees(Rule::AtMost, 39.0, "", 40.0));
        assert!(Rule::Formula.agrees(28.0, "", 28.04, true) && !Rule::Formula.agrees(28.0, "", 28.06, true));
        assert!(!agrees(Rule::Model, f64::NAN, "11.25", 11.25));
    }
}
