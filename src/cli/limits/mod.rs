//! `satphot limits`: what a telescope can still see, following a satellite or letting it pass.

mod footprint;
mod simple;
mod streak;
mod streak_text;
pub(super) mod tracked;

use clap::{Args, Subcommand};

use super::orbit_args::bad;

const EXAMPLES: &str = "\
Examples:
  satphot limits tracked --band V
  satphot limits streak --satellite starcloud --height-km 500 --mag 5.3";

/// Faintest magnitudes: of a telescope that follows, and of streaks in a survey.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct Limits {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, Subcommand)]
enum What {
    /// Exposure-time calculator of a telescope that follows the satellite
    Tracked(Box<tracked::Tracked>),
    /// Surface brightness of a streak against the limits of a survey
    Streak(Box<streak::Streak>),
    /// The paper's simple model: one diffuse panel, its magnitude and surface brightness
    Simple(simple::Simple),
    /// The beam of a mirror in orbit: its size, and when it crosses a site
    Footprint(Box<footprint::Footprint>),
}

impl Limits {
    pub fn execute(self) -> anyhow::Result<()> {
        match self.what {
            What::Tracked(v) => v.execute(),
            What::Streak(v) => v.execute(),
            What::Simple(v) => v.execute(),
            What::Footprint(v) => v.execute(),
        }
    }
}

/// Refuses an argument that is not a finite number above 0.
fn positive(key: &str, value: Option<f64>) -> anyhow::Result<()> {
    match value.filter(|v| !(*v > 0.0 && v.is_finite())) {
        Some(v) => Err(bad(key, format!("{v} is not a finite number above 0"))),
        None => Ok(()),
    }
}

/// Refuses an argument outside a range.
fn within(key: &str, value: Option<f64>, low: f64, high: f64) -> anyhow::Result<()> {
    match value.filter(|v| !(low..=high).contains(v)) {
        Some(v) => Err(bad(key, format!("{v} is outside {low} to {high}"))),
        None => Ok(()),
    }
}
