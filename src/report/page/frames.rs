//! Every frame: its picture with aperture and annulus where there is one, then all of them as a table.
//!
//! The cards are those of gallery.html, as many as a page can carry.

use maud::{Markup, PreEscaped, html};

use super::parts::MOST_ROWS;
use super::parts::NightPage;
use super::parts::cell;
use super::parts::link;
use super::parts::nothing;
use super::parts::number;
use super::parts::table;
use super::parts::time_of;
use crate::report::gallery::{controls, legend};
use crate::tables::PhotometryRow;

/// What a row of the table takes, generously \[bytes\].
const BYTES_PER_ROW: usize = 800;

/// The section; pictures and rows take `room` bytes at most.
pub(super) fn frames(page: &NightPage, room: usize) -> Markup {
    if page.rows.is_empty() {
        return nothing("There is no frame.");
    }
    let mut left = room.saturating_sub(BYTES_PER_ROW * page.rows.len().min(MOST_ROWS));
    let fits = |card: &&(String, String)| {
        let fits = card.1.len() <= left;
        left -= card.1.len().min(left);
        fits
    };
    let cards: Vec<&(String, String)> = page.cards.iter().take_while(fits).collect();
    html! {
        @if cards.is_empty() { p.none { "No frame has a picture (vetting.gallery_frames = 0, or no figures were requested)." } }
        @else {
            (legend())
            (controls())
            @if cards.len() < page.cards.len() { p { "The worst " (cards.len()) " of " (page.cards.len()) " pictures; all are in gallery.html." } }
            ol #gallery { @for (_, card) in &cards { (PreEscaped(card)) } }
        }
        (all(page, &cards))
    }
}

/// The table of all frames; a frame without a card is the target of links itself.
fn all(page: &NightPage, cards: &[&(String, String)]) -> Markup {
    let name = |row: &PhotometryRow| {
        let carded = link(row).is_some_and(|l| cards.iter().any(|c| l[1..] == c.0));
        let id = link(row).map(|l| l[1..].to_string());
        html! {
            @if carded { a href=[link(row)] { (row.frame) } }
            @else { span id=[id] { (row.frame) } }
        }
    };
    let line = |row: &PhotometryRow| {
        vec![
            name(row),
            cell(time_of(row)),
            number(row.v_mag, 3),
            number(row.limit_v_mag.filter(|_| row.v_mag.is_none()), 2),
            number(row.v_mag_err, 3),
            number(row.residual_mag, 3),
            number(row.snr, 1),
            number(row.alt_deg, 1),
            cell(row.illum.replace('_', "-")),
            cell(&row.status),
            html! { span class={ "badge " (super::parts::verdict_paint(row).class) } { (row.verdict) } },
            cell(&row.reason),
        ]
    };
    let rows: Vec<Vec<Markup>> = page.rows.iter().take(MOST_ROWS).map(line).collect();
    let head = [
        "frame",
        "UTC",
        page.band(),
        "fainter than",
        "error",
        "O − C",
        "S/N",
        "altitude",
        "light",
        "status",
        "verdict",
        "reason",
    ];
    html! {
        details open[page.rows.len() <= 40] {
            summary { "All " (page.rows.len()) " frames as a table" }
            @if page.rows.len() > MOST_ROWS { p { "The first " (MOST_ROWS) "; all are in photometry.ecsv." } }
            (table("sortable", "Frames; a click on a heading sorts", &head, &rows))
        }
    }
}
