//! The rows as text, Markdown and the rows of a file.
//!
//! Values with the decimals of their row, in its unit; a row that was excluded as slow says so.

use super::entry::{Published, Verdict};
use super::pass_check::CheckedPass;
use super::rule::Rule;
use crate::base::time::iso_utc;
use crate::report::summary::text_table;
use crate::tables::{CheckedRow, PublishedRow};

/// What stands for a value that was not computed because it takes long.
const SLOW: &str = "(--full)";
/// The order of the page: what the reader must know first.
const ORDER: [(Verdict, &str); 6] = [
    (Verdict::NotReproduced, "Not reproduced, or wrong in print"),
    (Verdict::WithAssumption, "Reproduced with an assumption the paper does not state"),
    (Verdict::Reproduced, "Reproduced"),
    (Verdict::Additional, "Not in the paper: what its numbers rest on"),
    (Verdict::Literature, "Literature: measured, or another's; listed, not judged"),
    (Verdict::NotComputed, "Not computed here"),
];

impl Published {
    /// A value as text: the decimals of the row, scientific where they would be more than six.
    fn number(&self, value: Option<f64>) -> String {
        match (value, usize::try_from(self.entry.decimals).unwrap_or(0)) {
            (None, _) if self.is_skipped => SLOW.to_owned(),
            (None, _) => String::new(),
            // + 0.0: a zero has no sign
            (Some(v), decimals @ 0..=6) => {
                let unit = 10f64.powi(i32::from(self.entry.decimals));
                format!("{:.decimals$}", (v * unit).round() / unit + 0.0)
            }
            (Some(v), _) => format!("{v:.2e}"),
        }
    }

    /// As published, as text.
    #[must_use]
    pub fn as_published_text(&self) -> String {
        self.number(self.numbers.as_published)
    }

    /// Corrected, as text.
    #[must_use]
    pub fn corrected_text(&self) -> String {
        self.number(self.numbers.corrected)
    }

    /// The rule it is judged by; empty for a row that is not.
    #[must_use]
    pub fn rule_text(&self) -> &'static str {
        self.entry.rule.filter(|_| self.is_judged()).map_or("", Rule::name)
    }

    /// The row of a file.
    #[must_use]
    pub fn file_row(&self) -> PublishedRow {
        let e = &self.entry;
        PublishedRow {
            id: e.id.into(),
            place: e.place.into(),
            quantity: e.quantity.into(),
            unit: e.unit.into(),
            printed: e.printed.into(),
            published: e.value,
            as_published: self.numbers.as_published,
            corrected: self.numbers.corrected,
            rule: self.rule_text().into(),
            tolerance: self.tolerance(),
            verdict: self.verdict().text().into(),
            why: e.why.into(),
        }
    }

    /// The line of the page.
    #[must_use]
    pub fn markdown_line(&self) -> String {
        let e = &self.entry;
        let cells = [
            format!("`{}`", e.id),
            e.place.to_owned(),
            e.quantity.to_owned(),
            e.unit.to_owned(),
            e.printed.to_owned(),
            self.as_published_text(),
            self.corrected_text(),
            self.rule_text().to_owned(),
            e.why.to_owned(),
        ];
        format!("| {} |\n", cells.map(|c| c.replace('|', "\\|")).join(" | "))
    }
}

/// A table for reading, without the reasons.
#[must_use]
pub fn text(rows: &[Published]) -> String {
    let head = ["id", "quantity", "unit", "published", "as published", "corrected", "rule", "verdict"];
    let line = |r: &Published| {
        let e = &r.entry;
        vec![
            e.id.to_owned(),
            e.quantity.to_owned(),
            e.unit.to_owned(),
            e.printed.to_owned(),
            r.as_published_text(),
            r.corrected_text(),
            r.rule_text().to_owned(),
            r.verdict().text().to_owned(),
        ]
    };
    text_table(&head, &rows.iter().map(line).collect::<Vec<_>>())
}

/// The tables of the page, one per verdict.
#[must_use]
pub fn markdown(rows: &[Published]) -> String {
    let mut text = format!("{}.\n\n{}\n", counts(rows), legend());
    for (verdict, title) in ORDER {
        let of: Vec<&Published> = rows.iter().filter(|r| r.verdict() == verdict).collect();
        if of.is_empty() {
            continue;
        }
        text.push_str(&format!("### {title} ({})\n\n", of.len()));
        text.push_str("| id | where | quantity | unit | published | as published | corrected | rule | why |\n");
        text.push_str("|---|---|---|---|---|---|---|---|---|\n");
        text.extend(of.iter().map(|r| r.markdown_line()));
        text.push('\n');
    }
    text
}

/// The rules of the verdicts, a line each.
#[must_use]
pub fn legend() -> String {
    let mut text = String::from(
        "Rules of the verdicts: a number is reproduced where the one computed as published (or, where the paper gives no way, \
         corrected) agrees with the printed one by the rule of its kind; with an assumption where the paper does not state all \
         that is needed; otherwise not reproduced.\n\n",
    );
    for rule in Rule::ALL {
        text.push_str(&format!("- {}: {}\n", rule.name(), rule.criterion()));
    }
    text
}

/// How many rows have which verdict, in one line.
#[must_use]
pub fn counts(rows: &[Published]) -> String {
    let count = |verdict| rows.iter().filter(|r| r.verdict() == verdict).count();
    let counted = ORDER.iter().filter(|(verdict, _)| *verdict != Verdict::NotComputed || count(*verdict) > 0);
    let parts: Vec<String> = counted.map(|(verdict, _)| format!("{} {}", count(*verdict), verdict.text())).collect();
    format!("{} rows: {}", rows.len(), parts.join(", "))
}

impl CheckedPass {
    /// The row of a file.
    #[must_use]
    pub fn file_row(&self) -> CheckedRow {
        let text = |l: Option<crate::brightness::light_class::PaperLabel>| l.map_or(String::new(), |l| l.to_string());
        CheckedRow {
            line: i64::try_from(self.stated.line).unwrap_or(0),
            time: self.stated.time.clone(),
            date_utc: iso_utc(self.stated.epoch, 0),
            target: self.stated.target.clone(),
            verdict: self.standing.text().into(),
            stated_sun_alt_deg: self.stated.sun_alt_deg,
            sun_alt_deg: self.sky.sun_alt_deg,
            stated_moon_illum_pct: self.stated.moon_illum_pct,
            moon_illum_pct: self.sky.moon_illum_pct,
            moon_alt_deg: self.sky.moon_alt_deg,
            moon_phase_deg: self.sky.moon_phase_deg,
            moon_v_mag: self.moon_v_mag,
            alt_deg: self.alt_deg,
            pass_utc: self.pass.as_ref().map_or(String::new(), |p| iso_utc(p.epoch, 0)),
            pass_alt_deg: self.pass.as_ref().map(|p| p.alt_deg),
            pass_range_km: self.pass.as_ref().map(|p| p.range_km),
            stated_label: text(self.stated.label),
            paper_label: text(self.pass.as_ref().map(|p| p.label)),
            remarks: self.remarks.join("; "),
            remedy: self.remedy.clone().unwrap_or_default(),
        }
    }
}
