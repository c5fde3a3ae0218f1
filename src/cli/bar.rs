//! Progress bars on a terminal; nothing when the output is a file, a pipe or `--quiet`.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Instant;

use super::log::{event_line, is_json};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use satphot::base::progress::Progress;
use serde_json::json;

/// One bar per stage.
pub struct Bars {
    start: Instant,
    visible: bool,
    bar: Mutex<ProgressBar>,
    /// Bytes of the files worked on in this stage.
    bytes: Arc<AtomicU64>,
    /// The stage, its pieces of work and those done, for lines of JSON.
    counts: Mutex<(String, usize, usize)>,
}

impl Bars {
    /// Bars on standard error if it is a terminal and `wanted`.
    pub fn new(wanted: bool) -> Self {
        let bytes = Arc::new(AtomicU64::new(0));
        Self {
            start: Instant::now(),
            visible: wanted,
            bar: Mutex::new(ProgressBar::hidden()),
            bytes,
            counts: Mutex::default(),
        }
    }
}

/// Frames and megabytes a second since the stage began; megabytes only where files are read.
fn speed(frames: u64, bytes: u64, elapsed_s: f64) -> String {
    let per_s = |n: f64| n / elapsed_s.max(1e-3);
    let megabytes = if bytes > 0 { format!(", {:.0} MB/s", per_s(bytes as f64 / 1e6)) } else { String::new() };
    format!("{:.1} frames/s{megabytes}", per_s(frames as f64))
}

impl Progress for Bars {
    fn stage(&self, name: &str, total: usize) {
        self.bytes.store(0, Ordering::Relaxed);
        if is_json() {
            if let Ok(mut counts) = self.counts.lock() {
                *counts = (name.to_string(), total, 0);
            }
            return event_line(
                &json!({ "event": "stage", "name": name, "total": total, "elapsed_s": self.elapsed_s() }),
            );
        }
        if !self.visible {
            return;
        }
        // stderr() hides itself when it is not a terminal
        let bar = ProgressBar::with_draw_target(Some(total as u64), ProgressDrawTarget::stderr());
        if let Ok(style) = ProgressStyle::with_template("{prefix:>14} {bar:32} {pos}/{len} {speed} left {eta}") {
            let bytes = self.bytes.clone();
            let speed_text = move |state: &ProgressState, out: &mut dyn std::fmt::Write| {
                let text = speed(state.pos(), bytes.load(Ordering::Relaxed), state.elapsed().as_secs_f64());
                _ = out.write_str(&text);
            };
            bar.set_style(style.with_key("speed", speed_text));
        }
        bar.set_prefix(name.to_string());
        bar.enable_steady_tick(std::time::Duration::from_millis(200));
        if let Ok(mut slot) = self.bar.lock() {
            *slot = bar;
        }
    }
    fn tick(&self) {
        if let (true, Ok(mut counts)) = (is_json(), self.counts.lock()) {
            counts.2 += 1;
            // a hundred lines a stage are enough
            if counts.2 * 100 / counts.1.max(1) != (counts.2 - 1) * 100 / counts.1.max(1) {
                event_line(&json!({
                    "event": "progress", "name": counts.0, "done": counts.2, "total": counts.1,
                    "bytes": self.bytes.load(Ordering::Relaxed), "elapsed_s": self.elapsed_s(),
                }));
            }
        }
        if let Ok(bar) = self.bar.lock() {
            bar.inc(1);
        }
    }
    fn read(&self, bytes: u64) {
        self.bytes.fetch_add(bytes, Ordering::Relaxed);
    }
    fn done(&self) {
        if let (true, Ok(counts)) = (is_json(), self.counts.lock()) {
            event_line(&json!({ "event": "done", "name": counts.0, "done": counts.2, "elapsed_s": self.elapsed_s() }));
        }
        if let Ok(bar) = self.bar.lock() {
            bar.finish();
        }
    }
    fn elapsed_s(&self) -> f64 {
        self.start.elapsed().as_secs_f64()
    }
    fn cpu_s(&self) -> Option<f64> {
        cpu_time::ProcessTime::try_now().ok().map(|t| t.as_duration().as_secs_f64())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn speed_is_frames_and_megabytes_a_second() {
        assert_eq!(speed(50, 5_000_000_000, 10.0), "5.0 frames/s, 500 MB/s");
        assert_eq!(speed(0, 0, 0.0), "0.0 frames/s");
    }
}
