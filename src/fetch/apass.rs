//! APASS DR9 as VizieR's ASU service writes it: `#` lines, names, units, dashes, rows with tabs between.
//!
//! A table that was cut, whose rows do not have the columns of its head, or that reached the limit of rows is refused.
//! Degrees and magnitudes, kept as the text they came as.

use super::answers::{Content, words};
use super::query::MOST_STARS;

/// Columns a catalogue cannot do without.
const NEEDED: [&str; 3] = ["RAJ2000", "DEJ2000", "Vmag"];
/// What ends a table.
const END: &str = "#END#";

/// Rows of one field.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Rows {
    /// Names of the columns.
    pub columns: Vec<String>,
    /// Cells, without blanks around them.
    pub cells: Vec<Vec<String>>,
}

/// What an answer holds; `framed`: the server said how long it is.
pub fn check(body: &[u8], framed: bool) -> std::result::Result<Content, String> {
    rows(body, framed).map(|_| Content::Data)
}

/// The rows of an answer; none, and no columns, for a field without stars.
pub fn rows(body: &[u8], framed: bool) -> std::result::Result<Rows, String> {
    let wrong = |what: &str| format!("not a table of stars ({what}) but {}", words(body));
    let text = std::str::from_utf8(body).map_err(|_| wrong("no text"))?;
    // every answer begins with remarks; an error page does not
    if !text.trim_start().starts_with('#') || !text.contains("VizieR") && !text.contains("#RESOURCE") {
        return Err(wrong("VizieR's remarks are missing"));
    }
    if let Some(error) = text.lines().find(|l| l.starts_with("#INFO") && l.contains("Error=")) {
        return Err(format!("VizieR answers {}", words(error.as_bytes())));
    }
    let ended = text.lines().rev().any(|l| l.trim_end() == END);
    if !text.ends_with('\n') || !framed && !ended {
        return Err("the table was cut: its end is missing".into());
    }
    let mut lines = text.lines().enumerate().filter(|(_, l)| !l.trim().is_empty() && !l.starts_with('#'));
    let Some((_, head)) = lines.next() else { return Ok(Rows::default()) };
    let cells = |line: &str| line.split('\t').map(|c| c.trim().to_owned()).collect::<Vec<String>>();
    let columns = cells(head);
    if let Some(missing) = NEEDED.iter().find(|n| !columns.iter().any(|c| c == *n)) {
        return Err(wrong(&format!("no column {missing}")));
    }
    let (units, ruler) = (lines.next(), lines.next());
    let is_ruler = |line: &str| cells(line).iter().all(|c| !c.is_empty() && c.bytes().all(|b| b == b'-'));
    if units.is_none() || !ruler.is_some_and(|(_, line)| is_ruler(line)) {
        return Err(wrong("no line of dashes under the names"));
    }
    let place = |name: &str| columns.iter().position(|c| c == name).unwrap_or_default();
    let (ra, dec, v) = (place(NEEDED[0]), place(NEEDED[1]), place(NEEDED[2]));
    let mut found = Rows { columns: columns.clone(), cells: Vec::new() };
    for (i, line) in lines {
        let row = cells(line);
        let within = |at: usize, lo: f64, hi: f64| row[at].parse::<f64>().is_ok_and(|n| (lo..=hi).contains(&n));
        if row.len() != columns.len() {
            return Err(format!(
                "line {} has {} cells, expected {}: the table was cut",
                i + 1,
                row.len(),
                columns.len()
            ));
        }
        if !within(ra, 0.0, 360.0) || !within(dec, -90.0, 90.0) || !row[v].is_empty() && !within(v, -5.0, 40.0) {
            return Err(format!("line {} is not a star: {}", i + 1, words(line.as_bytes())));
        }
        found.cells.push(row);
    }
    if found.cells.len() >= MOST_STARS {
        return Err(format!(
            "{MOST_STARS} stars, the most that one request returns; use a smaller argument `radius_deg`"
        ));
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEAD: &str = "#\n#   VizieR Astronomical Server vizier.cds.unistra.fr\n#RESOURCE=yCat_2336\n";
    const TABLE: &str = "recno\tRAJ2000\tDEJ2000\tVmag\n\tdeg\tdeg\tmag\n-----\t---\t---\t---\n";

    fn of(rows_text: &str, framed: bool) -> std::result::Result<Rows, String> {
        rows(format!("{HEAD}{TABLE}{rows_text}").as_bytes(), framed)
    }

    #[test]
    fn a_table_is_read_with_its_blank_cells() {
        let found = of("       1\t  0.345154\t -0.907018\t13.399\n2\t0.4\t-0.8\t      \n\n#END#\n", false).unwrap();
        assert_eq!(found.cells, [["1", "0.345154", "-0.907018", "13.399"], ["2", "0.4", "-0.8", ""]]);
    }

    #[test]
    fn a_field_without_stars_is_no_error() {
        assert_eq!(rows(format!("{HEAD}\n#END#\n").as_bytes(), false).unwrap(), Rows::default());
    }

    #[test]
    fn a_table_that_was_cut_anywhere_is_refused_when_nothing_says_how_long_it_is() {
        let whole = format!("{HEAD}{TABLE}1\t0.345154\t-0.907018\t13.399\n2\t0.4\t-0.8\t12.1\n\n#END#\n");
        for n in 1..whole.len() {
            assert!(rows(&whole.as_bytes()[..n], false).is_err(), "cut at {n}");
        }
        assert!(rows(whole.as_bytes(), false).is_ok());
    }

    #[test]
    fn what_is_no_table_of_stars_is_named() {
        for (body, word) in [
            ("<html><head><title>502 Bad Gateway</title></head></html>", "502 Bad Gateway"),
            ("", "empty"),
            ("\u{0}\u{1}\u{2}", "not text"),
            ("#VizieR\n#INFO\tError=No catalogue II/336\n#END#\n", "No catalogue"),
        ] {
            let problem = rows(body.as_bytes(), true).unwrap_err();
            assert!(problem.contains(word), "{problem}");
        }
        assert!(of("1\t400\t0\t12\n", true).unwrap_err().contains("is not a star"));
        assert!(of("1\t40\t0\n", true).unwrap_err().contains("3 cells, expected 4"));
    }
}
