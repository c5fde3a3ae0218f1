//! The exposure time: seconds, unless comment, unit or the other keywords say milliseconds; the first keyword above
//! zero.
//!
//! It does not cover the range a light frame may have ([`crate::frames::exposure`]) and the cadence of the night.

use super::names::{Aliases, keywords};
use super::sourced::Sourced;
use crate::fits::cards::{Header, parse_number};
use crate::frames::clock::span_s;

/// Keywords that disagree by more than this share are reported.
const DISAGREE_FRAC: f64 = 0.05;

/// Exposure time \[s\] with its keyword, and what is odd: unreadable values, zeros, keywords that disagree,
/// milliseconds.
///
/// A value of zero or less is passed over where another keyword has a positive one (some drivers write `EXPTIME = 0`
/// next to a right `EXPOSURE`), and a warning says so; where all are zero the first is returned.
///
/// Milliseconds are recognised by the comment (`[ms]`), by the unit in a string (`'5000 ms'`), and where another
/// keyword or end minus start is a thousand times shorter.
#[must_use]
pub fn exposure_time(header: &Header, aliases: &Aliases) -> (Option<Sourced<f64>>, Vec<String>) {
    let mut warnings = Vec::new();
    let mut found: Vec<(&str, f64, bool)> = Vec::new();
    for key in keywords(aliases, "exptime") {
        let Some(text) = header.text(key) else { continue };
        let comment = header.comment(key).unwrap_or_default().to_ascii_lowercase();
        match duration_s(&text, &comment) {
            Some((seconds, milli)) => found.push((key, seconds, milli)),
            None => warnings.push(format!("{key} = '{text}' is not an exposure time")),
        }
    }
    if let Some(positive) = found.iter().position(|(_, seconds, _)| *seconds > 0.0) {
        let used = found[positive];
        for (key, seconds, _) in found.drain(..positive) {
            warnings.push(format!(
                "{key} = {seconds} s is not an exposure time; {} = {} s is used instead",
                used.0, used.1
            ));
        }
    }
    let Some(&(key, mut seconds, milli)) = found.first() else { return (None, warnings) };
    let mut source = if milli { format!("{key} (milliseconds)") } else { key.to_string() };
    let others = found.iter().skip(1).filter(|(k, ..)| *k != "TELAPSE").map(|(k, s, _)| (*s, (*k).to_string()));
    let others: Vec<(f64, String)> = others.chain(span_s(header)).filter(|(s, _)| *s > 0.0).collect();
    let thousandth = others.iter().find(|(s, _)| !milli && near(seconds * 1e-3, *s) && seconds >= 50.0 * s);
    if let Some((s, other)) = thousandth {
        warnings.push(format!("{key} = {seconds} but {other} = {s:.3} s: {key} is taken as milliseconds"));
        seconds *= 1e-3;
        source = format!("{key} (milliseconds by {other})");
    }
    for (other, s, _) in found.iter().skip(1).filter(|(k, ..)| *k != "TELAPSE") {
        if !near(seconds, *s) && !near(seconds, *s * 1e-3) {
            warnings.push(format!("{key} = {seconds} s, {other} = {s} s: they disagree, {key} is used"));
        }
    }
    (Some(Sourced::new(seconds, source)), warnings)
}

fn near(a: f64, b: f64) -> bool {
    (a - b).abs() <= DISAGREE_FRAC * a.abs().max(b.abs())
}

/// Seconds of `5`, `'120.00'`, `'300 s'`, `'5000 ms'`; whether they were milliseconds.
fn duration_s(text: &str, comment: &str) -> Option<(f64, bool)> {
    let text = text.trim().to_ascii_lowercase();
    let number =
        text.trim_end_matches(|c: char| c.is_ascii_alphabetic() || c == ' ' || c == '.' || c == '[' || c == ']');
    let unit = text[number.len()..].trim().trim_matches(['[', ']', '.', ' ']);
    // `5.` and `1.5e` are left to the number
    let (value, unit) = match parse_number(&text) {
        Some(value) => (value, ""),
        None => (parse_number(number)?, unit),
    };
    let milli = match unit {
        "" => ["[ms]", "(ms)", "in ms", "millisec", "msec"].iter().any(|m| comment.contains(m)),
        "s" | "sec" | "secs" | "second" | "seconds" => false,
        "ms" | "msec" | "millisec" | "milliseconds" => true,
        _ => return None,
    };
    Some((if milli { value * 1e-3 } else { value }, milli))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(cards: &str) -> (Option<Sourced<f64>>, Vec<String>) {
        exposure_time(&Header::from_text(cards), &Aliases::new())
    }

    #[test]
    fn milliseconds_are_recognised_by_comment_unit_and_by_the_other_keywords() {
        let value = |cards: &str| of(cards).0.map(|t| t.value);
        assert_eq!(value("EXPTIME = 5000 / [ms] exposure\n"), Some(5.0));
        assert_eq!(value("EXPTIME = '5000 ms'\n"), Some(5.0));
        assert_eq!(value("EXPTIME = '120.00  '           / Exposure time in seconds\n"), Some(120.0));
        assert_eq!(value("EXPTIME = '300 s'\n"), Some(300.0));
        let (stated, warnings) = of("EXPTIME =                 5000\nEXPOSURE=                  5.0\n");
        assert_eq!(stated.unwrap().value, 5.0);
        assert!(warnings[0].contains("milliseconds"), "{warnings:?}");
        let span = "EXPTIME = 5000\nDATE-OBS= '2025-06-09T10:33:00.0'\nDATE-END= '2025-06-09T10:33:05.1'\n";
        assert_eq!(value(span), Some(5.0));
    }

    #[test]
    fn a_zero_is_passed_over_where_a_synonym_is_positive_and_that_is_said() {
        let (stated, warnings) = of("EXPTIME =                  0.0\nEXPOSURE=                  5.0\n");
        assert_eq!(stated.unwrap(), Sourced::new(5.0, "EXPOSURE"));
        assert!(warnings.len() == 1 && warnings[0].contains("EXPTIME = 0 s") && warnings[0].contains("EXPOSURE = 5"));
        for (cards, seconds) in [
            ("EXPTIME = 0\nXPOSURE = 2.5\n", 2.5),
            ("EXPTIME = -1.0\nEXPOSURE= 0\nEXP_TIME= '300 s'\n", 300.0),
            ("EXPTIME = 0\nTELAPSE = 7.5\n", 7.5),
            ("EXPTIME = 0\nEXPOSURE= 2500 / [ms]\n", 2.5),
        ] {
            assert_eq!(of(cards).0.unwrap().value, seconds, "{cards}");
        }
        // nothing positive: the zero stands, and whoever needs an exposure refuses it by its keyword
        let (stated, warnings) = of("EXPTIME = 0\nEXPOSURE= 0\n");
        assert_eq!((stated.unwrap(), warnings.len()), (Sourced::new(0.0, "EXPTIME"), 0));
    }

    #[test]
    fn what_is_no_number_is_reported_and_the_next_synonym_used() {
        let (stated, warnings) = of("EXPTIME = 'long'\nEXPOSURE=                 30.0\n");
        assert_eq!(stated.unwrap(), Sourced::new(30.0, "EXPOSURE"));
        assert!(warnings[0].contains("'long'"), "{warnings:?}");
        assert_eq!(of("OBJECT  = 'x'\n"), (None, vec![]));
        let (stated, warnings) = of("EXPTIME =                 30.0\nEXPOSURE=                 10.0\n");
        assert_eq!(stated.unwrap().value, 30.0);
        assert!(warnings[0].contains("disagree"), "{warnings:?}");
    }
}
