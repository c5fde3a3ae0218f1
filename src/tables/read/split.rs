//! One line of text to its cells, and which sign stands between them.
//!
//! A quote that is opened and not closed costs its own line only, never the rest of the file.

use csv::StringRecord;

/// What stands between the cells of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Between {
    /// One of `,` `;` tab `|`.
    Sign(char),
    /// Any number of blanks.
    Blanks,
}

impl Between {
    /// The sign that occurs most often in a line; blanks if none does.
    pub fn guess(line: &str) -> Between {
        let count = |sign: char| line.chars().filter(|c| *c == sign).count();
        // the earlier of two that occur equally often
        let best = [',', '\t', ';', '|'].into_iter().rev().max_by_key(|sign| count(*sign));
        best.filter(|sign| count(*sign) > 0).map_or(Between::Blanks, Between::Sign)
    }
}

/// Splits a line; cells lose the blanks and the double quotes around them, `""` inside quotes is one quote.
///
/// # Errors
/// A quote is opened and not closed, in words.
pub fn split(line: &str, between: Between, cells: &mut StringRecord) -> Result<(), String> {
    let line = line.trim_end_matches(['\r', '\n']);
    let is_end = |c: char| match between {
        Between::Sign(sign) => c == sign,
        Between::Blanks => c.is_whitespace(),
    };
    let blank = |c: char| c.is_whitespace() && !matches!(between, Between::Sign(sign) if sign == c);
    let mut rest = line;
    loop {
        rest = rest.trim_start_matches(blank);
        if between == Between::Blanks && rest.is_empty() {
            return Ok(());
        }
        let end = if let Some(quoted) = rest.strip_prefix('"') {
            let (cell, after) = unquote(quoted)?;
            cells.push_field(cell.trim());
            rest = after;
            rest.find(is_end)
        } else {
            let end = rest.find(is_end);
            cells.push_field(rest[..end.unwrap_or(rest.len())].trim());
            end
        };
        match end {
            // every sign is one byte, and so is every blank that is skipped here one character
            Some(at) => rest = &rest[at + rest[at..].chars().next().map_or(1, char::len_utf8)..],
            None => return Ok(()),
        }
    }
}

/// The text up to the closing quote, and what follows it.
fn unquote(text: &str) -> Result<(String, &str), String> {
    let mut cell = String::new();
    let mut rest = text;
    loop {
        let at = rest.find('"').ok_or("a quote is opened and not closed")?;
        cell.push_str(&rest[..at]);
        rest = &rest[at + 1..];
        match rest.strip_prefix('"') {
            Some(after) => {
                cell.push('"');
                rest = after;
            }
            None => return Ok((cell, rest)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cells(line: &str, between: Between) -> Vec<String> {
        let mut cells = StringRecord::new();
        split(line, between, &mut cells).unwrap();
        cells.iter().map(str::to_owned).collect()
    }

    #[test]
    fn empty_cells_quotes_and_runs_of_blanks_are_distinguished() {
        assert_eq!(cells("a,,\" b,\"\"c\"\" \", d ,\r\n", Between::Sign(',')), ["a", "", "b,\"c\"", "d", ""]);
        assert_eq!(cells("\t1\t \t\"h:m:s\"", Between::Sign('\t')), ["", "1", "", "h:m:s"]);
        assert_eq!(cells("  a   \"b c\"\td  ", Between::Blanks), ["a", "b c", "d"]);
        assert_eq!(cells("", Between::Sign(',')), [""]);
        assert!(split("a,\"b,c", Between::Sign(','), &mut StringRecord::new()).is_err());
    }

    #[test]
    fn the_sign_that_occurs_most_often_separates() {
        assert_eq!(Between::guess("a;b;c,d"), Between::Sign(';'));
        assert_eq!(Between::guess("a\tb"), Between::Sign('\t'));
        assert_eq!(Between::guess("a b c"), Between::Blanks);
    }
}
