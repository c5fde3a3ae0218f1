//! What is drawn over a picture: aperture, annulus or search circle, and a scale bar.
//!
//! Lengths in frame pixels: the drawing's own units are frame pixels, from the upper left corner of the picture, y
//! down. It does not cover the picture itself.

use maud::{Markup, html};

use crate::figures::thumb::Thumb;
use crate::photometry::aperture::Shape;
use crate::tables::PhotometryRow;

/// Longest scale bar as a share of the picture.
const BAR: f64 = 0.4;

/// The drawing over a picture.
pub(super) fn overlay(row: &PhotometryRow, thumb: &Thumb) -> Markup {
    let (width, height) = thumb.size_px();
    let place = |x: f64, y: f64| (x - thumb.x0 as f64 + 0.5, height - (y - thumb.y0 as f64 + 0.5));
    let at = row.x_px.zip(row.y_px).map(|(x, y)| place(x, y));
    html! {
        svg viewBox=(format!("0 0 {width} {height}")) aria-hidden="true" {
            @if let Some([x, y, r]) = thumb.search_px { (circle("search", place(x, y), r)) }
            @if let Some(at) = at {
                @for r in [row.sky_in_px, row.sky_out_px].into_iter().flatten() { (circle("sky", at, r)) }
                (aperture(row, at))
            }
            @if let Some((length, label)) = row.pix_scale_arcsec.and_then(|s| bar(s, width)) { (scale_bar(length, &label, (width, height))) }
        }
    }
}

fn number(v: f64) -> String {
    format!("{v:.2}")
}

/// A circle, dark below its colour so that it is seen on white and on black.
fn circle(class: &str, (x, y): (f64, f64), r: f64) -> Markup {
    html! {
        circle.under cx=(number(x)) cy=(number(y)) r=(number(r)) {}
        circle class=(class) cx=(number(x)) cy=(number(y)) r=(number(r)) {}
    }
}

/// The aperture: the shape of the row about its place, turned against the clock for a frame with y up.
fn aperture(row: &PhotometryRow, (x, y): (f64, f64)) -> Markup {
    let (a, b) = match (row.aper_r_px, row.aper_a_px, row.aper_b_px) {
        (Some(r), ..) => (r, r),
        (None, Some(a), Some(b)) => (a, b),
        _ => return html! {},
    };
    let turn = -row.aper_theta_deg.unwrap_or(0.0);
    let rounding = match Shape::named(&row.aper_shape, a, b) {
        Shape::Rectangle { .. } => Some(0.0),
        Shape::Pill { .. } => Some(b.min(a)),
        _ => None,
    };
    let shape = |class: &str| match rounding {
        Some(r) => html! {
            rect class=(class) x=(number(-a)) y=(number(-b)) width=(number(2.0 * a)) height=(number(2.0 * b)) rx=(number(r)) {}
        },
        None => html! { ellipse class=(class) rx=(number(a)) ry=(number(b)) {} },
    };
    html! {
        g transform=(format!("translate({x:.2} {y:.2}) rotate({turn:.2})")) { (shape("under")) (shape("aperture")) }
    }
}

/// Length \[px\] and name of a scale bar of 1, 2 or 5 times a power of ten arcsec, at most [`BAR`] of the width.
fn bar(scale_arcsec: f64, width_px: f64) -> Option<(f64, String)> {
    let longest = BAR * width_px * scale_arcsec;
    if !(longest.is_finite() && longest > 0.0) {
        return None;
    }
    let power = 10f64.powf(longest.log10().floor());
    let nice = [5.0, 2.0, 1.0].into_iter().map(|n| n * power).find(|l| *l <= longest)?;
    let name = if nice >= 60.0 && nice % 60.0 == 0.0 {
        format!("{}′", nice / 60.0)
    } else {
        format!("{}″", trimmed(nice))
    };
    Some((nice / scale_arcsec, name))
}

/// A number without trailing zeros.
fn trimmed(v: f64) -> String {
    let text = format!("{v:.6}");
    text.trim_end_matches('0').trim_end_matches('.').into()
}

fn scale_bar(length: f64, label: &str, (width, height): (f64, f64)) -> Markup {
    let (x, y) = (0.04 * width, 0.95 * height);
    let line = |class: &str| {
        html! { line class=(class) x1=(number(x)) y1=(number(y)) x2=(number(x + length)) y2=(number(y)) {} }
    };
    let size = number(0.065 * width);
    html! {
        (line("under")) (line("bar"))
        text x=(number(x)) y=(number(y - 0.025 * height)) font-size=(size) stroke-width=(number(0.012 * width)) { (label) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn thumb() -> Thumb {
        Thumb { width: 20, height: 20, bin: 2, x0: 100, y0: 200, search_px: None, levels: vec![0; 400] }
    }

    #[test]
    fn every_shape_of_an_aperture_is_drawn_where_it_was_measured() {
        let mut row = PhotometryRow {
            x_px: Some(109.5),
            y_px: Some(209.5),
            aper_shape: "pill".into(),
            aper_a_px: Some(9.0),
            aper_b_px: Some(4.0),
            aper_theta_deg: Some(30.0),
            sky_in_px: Some(12.0),
            pix_scale_arcsec: Some(0.196),
            ..PhotometryRow::default()
        };
        // 40 px wide from column 100: x = 109.5 is 10 px from the left edge; row 209.5 is 10 px above the lower edge
        let drawn = overlay(&row, &thumb()).into_string();
        assert!(drawn.contains("translate(10.00 30.00) rotate(-30.00)"), "{drawn}");
        assert!(
            drawn.contains(r#"class="aperture" x="-9.00" y="-4.00" width="18.00" height="8.00" rx="4.00""#),
            "{drawn}"
        );
        assert!(drawn.contains(r#"class="sky" cx="10.00" cy="30.00" r="12.00""#) && drawn.contains("2″"), "{drawn}");
        row.aper_shape = "rectangle".into();
        assert!(overlay(&row, &thumb()).into_string().contains(r#"rx="0.00""#));
        row.aper_shape = "ellipse".into();
        assert!(overlay(&row, &thumb()).into_string().contains(r#"rx="9.00" ry="4.00""#));
        (row.aper_r_px, row.aper_theta_deg) = (Some(3.0), None);
        assert!(overlay(&row, &thumb()).into_string().contains(r#"rx="3.00" ry="3.00""#));
    }

    #[test]
    fn a_scale_bar_is_a_round_number_of_arcsec_and_at_most_two_fifths_of_the_picture() {
        for (scale, width) in [(0.196, 40.0), (1.5, 160.0), (0.01, 33.0), (30.0, 640.0)] {
            let (length, name) = bar(scale, width).unwrap();
            assert!(length <= 0.4 * width && length > 0.4 * width / 2.6, "{name}");
        }
        assert_eq!(bar(0.196, 100.0).unwrap().1, "5″");
        assert!(bar(0.0, 100.0).is_none() && bar(f64::NAN, 100.0).is_none());
    }
}
