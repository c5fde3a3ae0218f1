//! The gallery: every frame's picture with its aperture, its numbers and the reasons of its verdict, the worst first.
//!
//! One file that needs no other: pictures as data, a little script to sort, no network. Everything a header says is
//! escaped. The bytes depend on the rows and pictures alone. It does not cover light curves and tables of the night.

pub(super) mod card;
mod overlay;

use std::cmp::Ordering;
use std::path::Path;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use maud::{DOCTYPE, Markup, PreEscaped, html};
use sha2::{Digest, Sha256};

use crate::base::error::{Error, Result};
use crate::base::file::write_atomic;
use crate::figures::thumb::{MARKS_RGB, Thumb};
use crate::tables::PhotometryRow;
use crate::tables::words::{Status, Verdict};

const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");

/// Indices of rows, the worst first: frames that failed, then verdict reject, caution, use; within a verdict the more
/// contaminated, then the lower S/N, then the earlier.
#[must_use]
pub fn worst_first<'a>(rows: impl IntoIterator<Item = &'a PhotometryRow>) -> Vec<usize> {
    let rows: Vec<&PhotometryRow> = rows.into_iter().collect();
    let mut order: Vec<usize> = (0..rows.len()).collect();
    order.sort_by(|&a, &b| compare(rows[a], rows[b]).then(a.cmp(&b)));
    order
}

fn compare(a: &PhotometryRow, b: &PhotometryRow) -> Ordering {
    let rank = |r: &PhotometryRow| match (Status::from_cell(&r.status), Verdict::from_cell(&r.verdict)) {
        (Some(Status::Failed | Status::Rejected), _) => 0,
        (_, Some(Verdict::Reject)) => 1,
        (_, Some(Verdict::Caution)) => 2,
        _ => 3,
    };
    let contam = |r: &PhotometryRow| r.contam_frac.unwrap_or(0.0);
    let snr = |r: &PhotometryRow| r.snr.unwrap_or(f64::NEG_INFINITY);
    let time = |r: &PhotometryRow| r.mjd_mid_d.unwrap_or(f64::NEG_INFINITY);
    (rank(a).cmp(&rank(b)))
        .then(contam(b).total_cmp(&contam(a)))
        .then(snr(a).total_cmp(&snr(b)))
        .then(time(a).total_cmp(&time(b)))
        .then_with(|| a.frame.cmp(&b.frame))
}

/// Writes the gallery of `rows`, each with its picture if it has one (`thumbs` may be shorter than `rows`): at most
/// `most` pictures, the worst first, magnitudes of `band`.
///
/// # Errors
/// [`Error::Io`].
pub fn write_gallery(
    path: &Path,
    rows: &[PhotometryRow],
    thumbs: &[Option<Thumb>],
    title: &str,
    (most, band): (usize, &str),
) -> Result<()> {
    let order = worst_first(rows);
    let picture = |i: usize| thumbs.get(i).and_then(Option::as_ref);
    let mut cards = Vec::new();
    for (place, i) in order.iter().filter(|i| picture(**i).is_some()).take(most).enumerate() {
        let Some(thumb) = picture(*i) else { continue };
        let png = thumb.png().map_err(|e| Error::io(path, e))?;
        cards.push(card::card(place, &rows[*i], thumb, &STANDARD.encode(png), band));
    }
    let failed: Vec<&PhotometryRow> = order
        .iter()
        .map(|i| &rows[*i])
        .filter(|r| matches!(Status::from_cell(&r.status), Some(Status::Failed | Status::Rejected)))
        .collect();
    let page = page(title, rows, &failed, &cards, most);
    write_atomic(path, page.into_string().as_bytes())
}

/// The whole page.
fn page(title: &str, rows: &[PhotometryRow], failed: &[&PhotometryRow], cards: &[Markup], most: usize) -> Markup {
    let script_hash = STANDARD.encode(Sha256::digest(SCRIPT.as_bytes()));
    let policy =
        format!("default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'sha256-{script_hash}'");
    let measured = rows.len() - failed.len();
    let with = |verdict: Verdict| {
        rows.iter()
            .filter(|r| {
                !matches!(Status::from_cell(&r.status), Some(Status::Failed | Status::Rejected)) && r.verdict == verdict
            })
            .count()
    };
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta http-equiv="Content-Security-Policy" content=(policy);
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { "Gallery of " (title) }
                style { (PreEscaped(STYLE)) }
            }
            body {
                header {
                    h1 { "Gallery of " (title) }
                    p {
                        (measured) " target frames: " (with(Verdict::Use)) " use, " (with(Verdict::Caution)) " caution, "
                        (with(Verdict::Reject)) " reject; " (failed.len()) " not measured. "
                        @if cards.len() < measured { "The worst " (cards.len()) " are shown." }
                    }
                    (legend())
                }
                main {
                    @if !failed.is_empty() { (not_measured(failed, most)) }
                    h2 { "Frames" }
                    @if cards.is_empty() { p { "No frame has a picture." } } @else {
                        (controls())
                        ol #gallery { @for card in cards { (card) } }
                    }
                }
                script { (PreEscaped(SCRIPT)) }
            }
        }
    }
}

/// Frames without pixels, as text.
fn not_measured(failed: &[&PhotometryRow], most: usize) -> Markup {
    html! {
        h2 { "Not measured" }
        ul.failed {
            @for row in failed.iter().take(most) {
                li { strong { (row.frame) } " " span.badge.reject { (row.status) } " " (row.reason) }
            }
            @if failed.len() > most { li { "and " (failed.len() - most) " more, in photometry.ecsv" } }
        }
    }
}

/// Order and choice; shown by the script, without which the order is worst first.
pub(super) fn controls() -> Markup {
    let orders = [
        ("place", "worst first"),
        ("time", "time"),
        ("mag", "brightest first"),
        ("snr", "lowest S/N first"),
        ("alt", "lowest first"),
        ("contam", "most contaminated first"),
    ];
    html! {
        form #controls hidden {
            label { "Order " select #order { @for (key, name) in orders { option value=(key) { (name) } } } }
            fieldset {
                legend { "Show" }
                @for verdict in [Verdict::Reject, Verdict::Caution, Verdict::Use] {
                    label { input type="checkbox" name="verdict" value=(verdict) checked; " " (verdict) }
                }
            }
            output #shown aria-live="polite" {}
        }
    }
}

/// What lines and colours mean.
pub(super) fn legend() -> Markup {
    let marks = ["masked or NaN", "saturated", "outside the frame or the clip circle"];
    html! {
        ul.legend {
            @for (class, name) in [("aperture", "aperture"), ("sky", "sky annulus"), ("search", "search circle")] {
                li { svg width="34" height="12" aria-hidden="true" { line class=(class) x1="2" y1="6" x2="32" y2="6" {} } " " (name) }
            }
            @for (rgb, name) in MARKS_RGB.iter().zip(marks) {
                li {
                    svg width="14" height="14" aria-hidden="true" {
                        rect width="14" height="14" fill=(format!("rgb({},{},{})", rgb[0], rgb[1], rgb[2])) {}
                    }
                    " " (name)
                }
            }
            li { "grey: asinh of the light; x to the right, y up" }
        }
    }
}
