//! Two-line and three-line elements, line by line, with the line number and the reason of everything refused.
//!
//! Columns of 69 ASCII characters. Nothing is repaired: a wrong checksum is a wrong orbit until shown otherwise.

use super::elements::set::Problem;
use super::elements::{DamagedSet, Elements, ElementsFile};

/// Every set of a TLE or 3LE file, damaged ones apart.
pub(super) fn parse_file(text: &str) -> Result<ElementsFile, Problem> {
    let mut file = ElementsFile::default();
    let mut name: Option<(usize, &str)> = None;
    let mut line1: Option<(usize, &str)> = None;
    for (i, raw) in text.lines().enumerate() {
        let (number, line) = (i + 1, raw.trim());
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let what = kind(line);
        if let (Some((first, l1)), Kind::Line1 | Kind::Name) = (line1, &what) {
            let title = name.map_or("", |n| n.1);
            file.damaged.push(without_line2((first, l1), title));
            (name, line1) = (None, None);
        }
        match (what, line1) {
            (Kind::Line1, _) => line1 = Some((number, line)),
            (Kind::Line2, Some((first, l1))) => {
                let title = name.map_or("", |n| n.1);
                match parse_set(title, l1, line) {
                    Ok(set) => file.sets.push(set),
                    Err((which, problem)) => file.damaged.push(DamagedSet {
                        line: Some(if which == 2 { number } else { first }),
                        problem,
                        numbers: numbers_of(&[l1, line]),
                        name: title.to_owned(),
                    }),
                }
                (name, line1) = (None, None);
            }
            (Kind::Line2, None) => {
                let title = name.take().map_or("", |n| n.1);
                file.damaged.push(DamagedSet {
                    line: Some(number),
                    problem: format!("line 2 without a line 1 before it: \"{}\"", short(line)),
                    numbers: numbers_of(&[line]),
                    name: title.to_owned(),
                });
            }
            (Kind::Name, _) => {
                if line.starts_with("No GP data found") {
                    return Err((Some(number), GONE.to_owned()));
                }
                file.damaged.extend(orphan(name));
                let title = line.strip_prefix("0 ").unwrap_or(line).trim();
                name = Some((number, title));
            }
        }
    }
    if let Some(l1) = line1 {
        file.damaged.push(without_line2(l1, name.take().map_or("", |n| n.1)));
    }
    file.damaged.extend(orphan(name));
    Ok(file)
}

fn without_line2((first, line1): (usize, &str), name: &str) -> DamagedSet {
    DamagedSet {
        line: Some(first),
        problem: format!("line 1 without a line 2 after it: \"{}\"", short(line1)),
        numbers: numbers_of(&[line1]),
        name: name.to_owned(),
    }
}

/// The catalogue numbers of lines of elements, as far as they can be read, without repeats; `A0001` is 100001
/// (alpha-5).
fn numbers_of(lines: &[&str]) -> Vec<u64> {
    let number = |line: &&str| -> Option<u64> {
        let field = line.strip_prefix("1 ").or_else(|| line.strip_prefix("2 "))?.get(..5)?.trim();
        let (first, rest) = field.split_at_checked(1)?;
        let letter = first.chars().next().filter(char::is_ascii_uppercase);
        match letter {
            // I and O are excluded from the letters
            Some(c) if !matches!(c, 'I' | 'O') && rest.len() == 4 => {
                let skipped = u64::from(c > 'I') + u64::from(c > 'O');
                Some((u64::from(c) - u64::from('A') + 10 - skipped) * 10_000 + rest.parse::<u64>().ok()?)
            }
            _ => field.parse().ok(),
        }
    };
    let mut numbers: Vec<u64> = lines.iter().filter_map(number).collect();
    numbers.dedup();
    numbers
}

/// One set; an error says which line (1 or 2) is wrong.
pub(super) fn parse_set(name: &str, line1: &str, line2: &str) -> Result<Elements, (u8, String)> {
    let who = format!("{} [{}]", short(name), short_id(line1));
    let who = who.trim_start();
    for (which, line) in [(1, line1), (2, line2)] {
        check_line(line).map_err(|problem| (which, format!("{who}, line {which}: {problem}")))?;
    }
    let title = (!name.is_empty()).then(|| name.to_owned());
    let inner = sgp4::Elements::from_tle(title, line1.as_bytes(), line2.as_bytes()).map_err(|e| {
        let of_another = line1.get(2..7) != line2.get(2..7);
        (if !of_another && reads_as_line_1(line1) { 2 } else { 1 }, format!("{who}: {e}"))
    })?;
    let format = if name.is_empty() { "TLE" } else { "3LE" };
    Elements::new(inner, format).map_err(|problem| (2, format!("{who}: {problem}")))
}

/// Whether a first line can be read next to a second line that is right: then what is wrong stands on the other.
fn reads_as_line_1(line1: &str) -> bool {
    // Spacetrack Report No. 3's example but for the number of the object and the checksum
    let mut line2 = *b"2 88888  72.8435 115.9689 0086731  52.6988 110.5714 16.05824518  1050";
    if let (Some(own), Some(number)) = (line1.as_bytes().get(2..7), line2.get_mut(2..7)) {
        number.copy_from_slice(own);
    }
    line2[68] = b'0' + (checksum(&line2[..68]) % 10) as u8;
    sgp4::Elements::from_tle(None, line1.as_bytes(), &line2).is_ok()
}

/// Sum of the digits and the number of minus signs.
fn checksum(columns: &[u8]) -> u32 {
    columns.iter().map(|&b| if b == b'-' { 1 } else { char::from(b).to_digit(10).unwrap_or(0) }).sum()
}

/// What CelesTrak answers for objects it has no TLE of.
const GONE: &str = "\"No GP data found\": the server had no such object in this format; numbers above 99999 have no TLE, \
                    fetch FORMAT=json or csv";

enum Kind {
    Name,
    Line1,
    Line2,
}

/// A name has at most 24 characters, so a longer text that begins with "1 " or "2 " is a line of elements.
fn kind(line: &str) -> Kind {
    match line.as_bytes() {
        [b'1', b' ', ..] if line.len() > 26 => Kind::Line1,
        [b'2', b' ', ..] if line.len() > 26 => Kind::Line2,
        _ => Kind::Name,
    }
}

fn check_line(line: &str) -> Result<(), String> {
    if !line.is_ascii() {
        return Err("holds characters that are not ASCII".to_owned());
    }
    if line.contains('\t') {
        return Err("holds a tab, so that its columns are lost; fetch the set again".to_owned());
    }
    let bytes = line.as_bytes();
    if bytes.len() != 69 {
        return Err(format!("has {} characters, expected 69 (the last is the checksum)", bytes.len()));
    }
    // checksum = (Σ digits + number of minus signs) mod 10
    let (expected, found) = (checksum(&bytes[..68]) % 10, char::from(bytes[68]));
    if found.to_digit(10) != Some(expected) {
        return Err(format!("checksum is '{found}', expected {expected}; the line was altered, fetch the set again"));
    }
    Ok(())
}

/// A name, or a piece of a line, that no lines of elements follow.
fn orphan(name: Option<(usize, &str)>) -> Option<DamagedSet> {
    let (number, text) = name?;
    Some(DamagedSet {
        line: Some(number),
        problem: format!("\"{}\" is not followed by two lines of elements (comments begin with #)", short(text)),
        numbers: numbers_of(&[text]),
        name: text.to_owned(),
    })
}

fn short(line: &str) -> String {
    line.chars().take(40).collect()
}

fn short_id(line1: &str) -> String {
    line1.chars().skip(2).take(5).collect::<String>().trim().to_owned()
}
