//! What `satphot accuracy` leaves: a table, a figure per method, and one page that holds both.

use std::path::Path;

use maud::{DOCTYPE, Markup, PreEscaped, html};

use crate::accuracy::figure::error_against_time;
use crate::accuracy::{Extreme, Method, Sweep};
use crate::base::error::{Error, Result};
use crate::base::file::write_atomic;
use crate::tables::meta::Meta;
use crate::tables::{AccuracyRow, ExtremeRow, write_rows};

const STYLE: &str = "body{font:16px/1.45 system-ui,sans-serif;max-width:76rem;margin:2rem auto;padding:0 1rem;color:#222}\
table{border-collapse:collapse;font-size:.86rem;margin:.6rem 0 1.6rem}th,td{padding:.15rem .6rem;text-align:right;\
border-bottom:1px solid #ddd}th:first-child,td:first-child,th:nth-child(2),td:nth-child(2){text-align:left}\
table.cases td,table.cases th{text-align:left;vertical-align:top}\
tr.default{font-weight:600}tr.behind{color:#888}svg{max-width:100%;height:auto}h2{margin-top:2.4rem}";

/// The rows of one sweep.
#[must_use]
pub fn accuracy_rows(method: &Method, sweep: &Sweep) -> Vec<AccuracyRow> {
    let finite = |v: f64| v.is_finite().then_some(v);
    let mut rows = Vec::new();
    for series in &sweep.series {
        for (point, place) in series.points.iter().zip(series.places()) {
            rows.push(AccuracyRow {
                method: method.name.into(),
                case: series.label.clone(),
                knob: sweep.knob.into(),
                setting: point.setting.clone(),
                is_default: point.is_default.into(),
                place: place.name().into(),
                err_unit: sweep.error.into(),
                err_median: finite(point.errors.median),
                err_p95: finite(point.errors.p95),
                err_worst: finite(point.errors.worst),
                err_mean: point.errors.bias,
                err_sd: point.errors.scatter,
                coverage_frac: point.errors.coverage_frac,
                n: point.errors.n as i64,
                work: sweep.work.into(),
                cpu_us: point.cpu_us.median_us,
                cpu_us_low: point.cpu_us.low_us,
                cpu_us_high: point.cpu_us.high_us,
                n_repeats: point.cpu_us.repeats as i64,
                memory_kb: point.memory_kb,
                reference: sweep.reference.into(),
            });
        }
    }
    rows
}

/// Writes `accuracy.ecsv`, `accuracy_<method>.svg` and `accuracy.html` into a folder that exists.
///
/// # Errors
/// [`Error::Io`], [`Error::Table`].
pub fn write_accuracy_report(folder: &Path, sweeps: &[(Method, Sweep)], meta: &Meta) -> Result<()> {
    let mut rows = Vec::new();
    let mut sections = Vec::new();
    for (method, sweep) in sweeps {
        let figure = folder.join(format!("accuracy_{}.svg", method.name));
        error_against_time(&figure, method.name, sweep)?;
        let svg = std::fs::read_to_string(&figure).map_err(|e| Error::io(&figure, e))?;
        let own = accuracy_rows(method, sweep);
        sections.push(section(method, sweep, &own, &svg));
        rows.extend(own);
    }
    write_rows(&folder.join("accuracy.ecsv"), &rows, meta)?;
    write_atomic(&folder.join("accuracy.html"), page(sweeps, &sections).into_string().as_bytes())
}

/// A page of cases: its file name without ending, its title, what stands above the table, and the table's head.
#[derive(Debug)]
pub struct CasesPage {
    stem: &'static str,
    title: &'static str,
    intro: &'static str,
    head: [&'static str; 7],
}

impl CasesPage {
    /// Name of its files without ending.
    #[must_use]
    pub fn stem(&self) -> &'static str {
        self.stem
    }
}

/// The stiff and extreme cases.
pub const EXTREMES_PAGE: CasesPage = CasesPage {
    stem: "extremes",
    title: "Stiff and extreme cases",
    intro: "What is expected is a closed form, an independent computation, or a refusal that says why.",
    head: ["area", "case", "expected", "got", "off by", "limit", "verdict"],
};

/// Two independent paths to each quantity.
pub const PATHS_PAGE: CasesPage = CasesPage {
    stem: "paths",
    title: "Two paths to one number",
    intro: "The worst disagreement between two computations that share no formula, no series and no quadrature. The limit is \
            what is known of the lesser of the two.",
    head: ["quantity", "cases", "one path", "another", "worst apart", "limit", "verdict"],
};

/// Writes the table and the page of cases, `<stem>.ecsv` and `<stem>.html`, into a folder that exists.
///
/// # Errors
/// [`Error::Io`], [`Error::Table`].
pub fn write_cases_report(folder: &Path, which: &CasesPage, cases: &[Extreme], meta: &Meta) -> Result<()> {
    let row = |e: &Extreme| ExtremeRow {
        area: e.area.into(),
        case: e.case.clone(),
        expected: e.expected.clone(),
        got: e.got.clone(),
        error: e.error,
        limit: e.limit,
        verdict: e.verdict.name().into(),
    };
    let rows: Vec<ExtremeRow> = cases.iter().map(row).collect();
    write_rows(&folder.join(format!("{}.ecsv", which.stem)), &rows, meta)?;
    let size = |e: Option<f64>| e.map_or(String::new(), |e| format!("{e:.1e}"));
    let page = whole_page(
        which.title,
        html! {
            h1 { (which.title) }
            p { (which.intro) }
            table.cases {
                tr { @for name in which.head { th { (name) } } }
                @for row in &rows {
                    tr class=(if row.verdict == "ok" { "" } else { "default" }) {
                        td { (row.area) } td { (row.case) } td { (row.expected) } td { (row.got) }
                        td { (size(row.error)) } td { (size(row.limit)) } td { (row.verdict) }
                    }
                }
            }
        },
    );
    write_atomic(&folder.join(format!("{}.html", which.stem)), page.into_string().as_bytes())
}

fn whole_page(title: &str, body: Markup) -> Markup {
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (title) }
                style { (PreEscaped(STYLE)) }
            }
            body { (body) }
        }
    }
}

fn page(sweeps: &[(Method, Sweep)], sections: &[Markup]) -> Markup {
    whole_page(
        "Error against run time",
        html! {
            h1 { "Error against run time" }
            p {
                "Methods with a knob, the knob turned, against a converged reference. CPU time is of one thread on the \
                 machine that wrote this page, the median of repeats with the interval that holds it in 95 of 100 cases; ratios \
                 carry over, seconds do not. Settings in grey are behind another that is as accurate and takes less time, \
                 beyond the errors of both times; bold is what satphot uses by default."
            }
            ul { @for (method, _) in sweeps { li { a href={"#" (method.name)} { (method.name) } ": " (method.about) } } }
            @for section in sections { (section) }
        },
    )
}

/// Three digits at least.
fn micros(us: f64) -> String {
    if us < 100.0 { format!("{us:.3}") } else { format!("{us:.0}") }
}

fn section(method: &Method, sweep: &Sweep, rows: &[AccuracyRow], svg: &str) -> Markup {
    let error = |e: Option<f64>| e.map_or("no number".to_string(), |e| format!("{e:.1e}"));
    let share = |s: Option<f64>| s.map_or(String::new(), |s| format!("{:.0} %", 100.0 * s));
    let judged = rows.iter().any(|r| r.coverage_frac.is_some());
    html! {
        h2 id=(method.name) { (method.name) }
        p { (method.about) ". Reference: " (sweep.reference) ". Default: " (sweep.standing()) "." }
        (PreEscaped(svg))
        table {
            tr {
                th { "case" } th { (sweep.knob) } th { "median error [" (sweep.error) "]" } th { "95 %" } th { "worst" }
                @if judged { th { "bias" } th { "scatter" } th { "within 1 sigma" } }
                th { "cases" } th { "CPU µs, " (sweep.work) } th { "its interval" }
                @if rows.iter().any(|r| r.memory_kb.is_some()) { th { "memory kB" } }
            }
            @for row in rows {
                tr class=(if row.is_default == 1 { "default" } else if row.place == "behind" { "behind" } else { "" }) {
                    td { (row.case) } td { (row.setting) }
                    td { (error(row.err_median)) } td { (error(row.err_p95)) } td { (error(row.err_worst)) }
                    @if judged { td { (error(row.err_mean)) } td { (error(row.err_sd)) } td { (share(row.coverage_frac)) } }
                    td { (row.n) } td { (micros(row.cpu_us)) }
                    td { (micros(row.cpu_us_low)) " to " (micros(row.cpu_us_high)) }
                    @if let Some(kb) = row.memory_kb { td { (format!("{kb:.0}")) } }
                }
            }
        }
    }
}
