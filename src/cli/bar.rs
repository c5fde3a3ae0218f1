//! Progress bars on a terminal; nothing when the output is a file, a pipe or `--quiet`.

use std::sync::Mutex;
use std::time::Instant;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use satphot::night::progress::Progress;

/// One bar per stage.
pub struct Bars {
    start: Instant,
    visible: bool,
    bar: Mutex<ProgressBar>,
}

impl Bars {
    /// Bars on standard error if it is a terminal and `wanted`.
    pub fn new(wanted: bool) -> Self {
        Self { start: Instant::now(), visible: wanted, bar: Mutex::new(ProgressBar::hidden()) }
    }
}

impl Progress for Bars {
    fn stage(&self, name: &str, total: usize) {
        if !self.visible {
            return;
        }
        // stderr() hides itself when it is not a terminal
        let bar = ProgressBar::with_draw_target(Some(total as u64), ProgressDrawTarget::stderr());
        if let Ok(style) = ProgressStyle::with_template("{prefix:>14} {bar:32} {pos}/{len} {per_sec} left {eta}") {
            bar.set_style(style);
        }
        bar.set_prefix(name.to_string());
        bar.enable_steady_tick(std::time::Duration::from_millis(200));
        if let Ok(mut slot) = self.bar.lock() {
            *slot = bar;
        }
    }
    fn tick(&self) {
        if let Ok(bar) = self.bar.lock() {
            bar.inc(1);
        }
    }
    fn done(&self) {
        if let Ok(bar) = self.bar.lock() {
            bar.finish();
        }
    }
    fn elapsed_s(&self) -> f64 {
        self.start.elapsed().as_secs_f64()
    }
}
