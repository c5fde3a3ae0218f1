//! One frame of the gallery: picture, numbers, verdict and reasons.
//!
//! Magnitudes, degrees, UTC as in the table. It does not cover the drawing over the picture.

use maud::{Markup, html};

use super::overlay::overlay;
use crate::figures::thumb::Thumb;
use crate::photometry::Flags;
use crate::tables::PhotometryRow;
use crate::tables::words::{Status, Verdict};

/// What the card of a frame is called in links.
pub(crate) fn card_id(frame: &str) -> String {
    let plain = frame.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' });
    "frame-".chars().chain(plain).collect()
}

/// The card of a frame; `place` is its place in the order of the page, `png` its picture in base64.
pub(super) fn card(place: usize, row: &PhotometryRow, thumb: &Thumb, png: &str, band: &str) -> Markup {
    let verdict = known_verdict(&row.verdict);
    let side_arcsec = row.pix_scale_arcsec.map(|s| format!(", {:.0} arcsec across", s * thumb.size_px().0));
    let alt = format!("{}: {}{}", row.frame, what(row), side_arcsec.unwrap_or_default());
    let flags = Flags(row.flags).to_string().replace('+', ", ");
    html! {
        li id=(card_id(&row.frame)) class={ "card " (verdict) } data-place=(place) data-verdict=(verdict) data-time=[row.mjd_mid_d]
            data-mag=[magnitude(row)] data-snr=[row.snr] data-alt=[row.alt_deg] data-contam=[row.contam_frac] {
            h3 { (row.frame) }
            div.picture {
                img alt=(alt) width=(thumb.width) height=(thumb.height) src={ "data:image/png;base64," (png) };
                (overlay(row, thumb))
            }
            p.verdict {
                span class={ "badge " (verdict) } { (verdict) } " " (row.object_name)
                @if row.status == Status::Nondetection { ", not detected" }
            }
            dl {
                @for (name, value) in numbers(row, band) { div { dt { (name) } dd { (value) } } }
            }
            @if !row.reason.is_empty() {
                ul.reasons { @for reason in row.reason.split("; ") { li { (reason) } } }
            }
            @if !flags.is_empty() { p.flags { "flags: " (flags) } }
        }
    }
}

/// One of the three verdicts.
fn known_verdict(verdict: &str) -> &'static str {
    Verdict::from_cell(verdict).unwrap_or(Verdict::Use).as_str()
}

/// The magnitude by which frames are ordered: V alone. A limit is not a magnitude and an instrumental one has another
/// zero: frames without V come last.
fn magnitude(row: &PhotometryRow) -> Option<f64> {
    row.v_mag
}

fn what(row: &PhotometryRow) -> &'static str {
    if row.status == Status::Nondetection { "the search circle, nothing found" } else { "the target in its aperture" }
}

/// The numbers of a frame that has them, each with its name.
fn numbers<'a>(row: &PhotometryRow, band: &'a str) -> Vec<(&'a str, String)> {
    let clock: String = row.date_mid.chars().take(22).collect();
    let error = row.v_mag_err.map(|e| format!(" ± {e:.3}")).unwrap_or_default();
    let lower = if Flags(row.flags).has(Flags::LOWER_LIMIT) { " or brighter" } else { "" };
    let light = match (row.v_mag, row.limit_v_mag, row.inst_mag) {
        (Some(v), ..) => Some((band, format!("{v:.3}{error}{lower}"))),
        (None, Some(v), _) => Some((band, format!("fainter than {v:.2}"))),
        (None, None, Some(v)) => Some(("instrumental", format!("{v:.3}{error}{lower}"))),
        _ => None,
    };
    let number =
        |name, value: Option<f64>, decimals: usize, unit: &str| value.map(|v| (name, format!("{v:.decimals$}{unit}")));
    let mut all = vec![("UTC", clock.replace('T', " "))];
    all.retain(|(_, value)| !value.is_empty());
    all.extend(light);
    all.extend(number("S/N", row.snr, 1, ""));
    all.extend(number("altitude", row.alt_deg, 1, "°"));
    all.extend(number("exposure", row.exptime_s, 2, " s"));
    all.extend(number("contamination", row.contam_frac.map(|c| 100.0 * c), 1, " %"));
    all
}
