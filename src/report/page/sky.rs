//! The sky of each pass as a disc: the model's magnitude in colour, the observed ones on the same scale, Sun and Moon.
//!
//! Zenith in the middle, North up and East left, as one looks up; equal steps of altitude are equal steps of radius.

use maud::{Markup, PreEscaped, html};

use super::parts::NightPage;
use super::parts::PassSky;
use super::parts::nothing;
use super::parts::tip;
use crate::figures::canvas::{Medium, Sheet};
use crate::figures::interaction::Interaction;
use crate::figures::{Levels, PassDisc};

/// The skies with a frame of which the place is known.
pub(super) fn drawn(page: &NightPage) -> Vec<&PassSky> {
    page.skies.iter().filter(|s| s.track.iter().any(|r| r.alt_deg.is_some())).collect()
}

/// The sky of every pass, each with its title, and the scale of their colours.
pub(super) fn charts(page: &NightPage, medium: Medium) -> (Vec<(&PassSky, Sheet)>, Option<Sheet>) {
    let drawn = drawn(page);
    let of = |s: &&PassSky| -> Vec<f64> {
        s.cells.iter().filter_map(|c| c.model_v_mag).chain(s.track.iter().filter_map(|r| r.v_mag)).collect()
    };
    let levels = Levels::of_magnitudes(drawn.iter().flat_map(of));
    let interaction = Interaction { link: &|r| page.link(r), tip: &tip };
    let disc = |sky: &PassSky| {
        let disc = PassDisc { cells: &sky.cells, track: &sky.track, marks: &sky.marks };
        disc.draw(medium, levels.as_ref(), &interaction)
    };
    (drawn.iter().map(|sky| (*sky, disc(sky))).collect(), levels.as_ref().map(|levels| levels.across(medium)))
}

/// The section.
pub(super) fn skies(page: &NightPage) -> Markup {
    let (discs, scale) = charts(page, Medium::Page);
    if discs.is_empty() {
        return nothing("No frame has a place on the sky ([orbit] is needed).");
    }
    html! {
        div.panels.domes {
            @for (sky, disc) in discs {
                figure {
                    (PreEscaped(disc.into_page("chart dome", "group", &format!("Sky of {}", sky.title))))
                    figcaption { (sky.title) @if sky.cells.is_empty() { " (no model)" } }
                }
            }
        }
        @if let Some(scale) = scale { (PreEscaped(scale.into_page("chart scale", "img", "Scale of colours, V in magnitudes"))) }
        p.note {
            "Colour: V of the model in every direction at the middle of the pass, at the range its height gives; dots: what "
            "was observed, on the same scale; the arrow is the direction of motion. Grey and hatched: no light. A ring on the horizon: Sun or Moon below it. North up, East left, horizon outside."
        }
    }
}
