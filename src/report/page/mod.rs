//! The report of a night: one file that opens anywhere, with everything the night's tables say, and where it is from.
//!
//! Inline SVG, a style sheet and a small script; no network, no clock: the same results give the same bytes. Drawn from
//! the files of a run alone. It does not cover most figures for papers ([`crate::figures`]).

mod campaign;
mod checks;
mod compliance;
mod curve;
mod distribution;
mod figure;
mod frames;
mod groups;
mod kinds;
mod parts;
mod passes;
mod phase_curve;
mod plan;
mod provenance;
mod sky;
mod stacks;
mod stars;
mod strip;
mod violins;

pub use parts::{NightPage, PassSky};
pub use plan::{PlanPage, write_plan_page};

use parts::{MOST_BYTES, Section, insert_frames, whole};
use std::path::Path;

use crate::base::error::Result;
use crate::base::file::write_atomic;

pub use campaign::write_campaign;
pub use compliance::{CompliancePage, write_compliance_page};
pub use figure::{write_distribution_figure, write_phase_figure, write_sky_figure};

/// Writes `report.html`.
///
/// # Errors
/// [`crate::Error::Io`] when the file cannot be written.
pub fn write_night_page(path: &Path, page: &NightPage) -> Result<()> {
    let section = |id, title, body| Section { id, title, body };
    let one = std::slice::from_ref(page);
    let mut sections = vec![
        section("summary", "Summary", strip::summary(page)),
        section("light-curve", "Light curves", curve::light_curve(page)),
        section("stacks", "Stacked passes", stacks::stacks(page)),
        section("residuals", "Observed minus modelled", curve::residuals(page, one)),
        section("phase-curve", "Phase curve", phase_curve::section(one)),
        section("distribution", "Distribution", distribution::distribution(one)),
        section("sky", "Sky", sky::skies(page)),
        section("zeropoint", "Zeropoint", stars::zeropoint(page)),
        section("calibration", "Calibration", checks::calibration(page)),
        section("timing", "Timing", checks::timing(page)),
        section("provenance", "Provenance", provenance::provenance(page)),
    ];
    // pictures take what the rest leaves
    let taken: usize = sections.iter().map(|s| s.body.0.len()).sum();
    let frames = frames::frames(page, MOST_BYTES.saturating_sub(taken));
    insert_frames(&mut sections, "Frames", frames);
    let drawn = page.data_mode().map(|mode| format!(" ({mode})")).unwrap_or_default();
    let title = format!("Night {}{drawn}", page.name);
    write_atomic(path, whole(&title, &subtitle(page), &sections).into_string().as_bytes())
}

/// Target, site and telescope in one line.
fn subtitle(page: &NightPage) -> String {
    let mut targets: Vec<&str> =
        page.rows.iter().filter(|r| r.mjd_mid_d.is_some()).map(|r| r.object_name.as_str()).collect();
    targets.sort_unstable();
    targets.dedup();
    let targets: Vec<&str> = targets.into_iter().filter(|t| !t.is_empty()).take(6).collect();
    let parts =
        [page.data_mode(), Some(targets.join(", ")).filter(|t| !t.is_empty()), page.stated("telescope"), page.site()];
    parts.into_iter().flatten().collect::<Vec<_>>().join(" · ")
}
