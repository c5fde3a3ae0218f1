//! Angles as headers write them: sexagesimal with any separator, or a plain number.

/// `-16 10 58.8`, `18:20:48.12`, `18h20m48s`, `-16d10m58s`, `-0 30 0`, `-22:57:08:99` (hundredths of a second), `33 46 S` or
/// a plain number; in the unit of the first part. South and west are negative.
#[must_use]
pub(crate) fn sexagesimal(text: &str) -> Option<f64> {
    let mut text = text.trim();
    let mut sign = 1.0;
    if let Some(rest) = text.strip_suffix(['S', 'W']).or_else(|| text.strip_prefix(['S', 'W'])) {
        (text, sign) = (rest.trim(), -1.0);
    } else if let Some(rest) = text.strip_suffix(['N', 'E']).or_else(|| text.strip_prefix(['N', 'E'])) {
        text = rest.trim();
    }
    if text.starts_with('-') {
        sign = -1.0;
    }
    let bare = text.strip_prefix(['+', '-']).unwrap_or(text);
    let parts: Vec<&str> = bare
        .split(|c: char| c == ':' || c.is_whitespace() || "hdms°'\"".contains(c))
        .filter(|p| !p.is_empty())
        .collect();
    let joined;
    let parts: &[&str] = match parts[..] {
        // the fourth part is the fraction of the seconds
        [d, m, s, f] if [s, f].iter().all(|p| p.bytes().all(|b| b.is_ascii_digit())) => {
            joined = format!("{s}.{f}");
            &[d, m, &joined]
        }
        [_] | [_, _] | [_, _, _] => &parts,
        _ => return None,
    };
    let (mut sum, mut unit) = (0.0, 1.0);
    for (i, part) in parts.iter().enumerate() {
        let plain = part.bytes().all(|b| b.is_ascii_digit() || b"+-.eE".contains(&b));
        let value: f64 = part.parse().ok().filter(|v: &f64| plain && v.is_finite() && *v >= 0.0)?;
        // minutes and seconds stay below 60
        if i > 0 && value >= 60.0 {
            return None;
        }
        sum += value * unit;
        unit /= 60.0;
    }
    Some(sign * sum)
}

#[cfg(test)]
mod tests {
    use super::sexagesimal;

    #[test]
    fn angles_are_read_as_the_programs_write_them() {
        let near = |text: &str, value: f64| {
            let got = sexagesimal(text).unwrap_or(f64::NAN);
            assert!((got - value).abs() < 1e-9, "{text}: {got}, want {value}");
        };
        near("-31 16 24", -31.273_333_333_333);
        near("-22:57:08:99", -(22.0 + 57.0 / 60.0 + 8.99 / 3600.0));
        near("  20:48:40", 20.811_111_111_111);
        near("-0 30 0", -0.5);
        near("33 46 13 S", -33.770_277_777_778);
        near("W 71 14 12", -71.236_666_666_667);
        near("+51 03 00.000", 51.05);
        near("-16d10m58.8s", -16.183);
        near("149.0644", 149.0644);
        for bad in ["", "unknown", "10 75 00", "1 2 3 4 5", "nan", "inf", "-", "1 2 3.5 6", "--5"] {
            assert_eq!(sexagesimal(bad), None, "{bad}");
        }
    }
}
