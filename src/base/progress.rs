//! What the library reports while it works; the caller decides whether that is a bar, a log or nothing.

/// A listener. Called from worker threads.
pub trait Progress: Sync {
    /// A stage of `total` steps begins.
    fn stage(&self, name: &str, total: usize);
    /// One step is done.
    fn tick(&self);
    /// A file of so many bytes was worked on.
    fn read(&self, _bytes: u64) {}
    /// The stage is over.
    fn done(&self);
    /// Seconds since the listener was made: the library itself never reads the clock.
    fn elapsed_s(&self) -> f64;
    /// Time all cores have worked for this program \[s\], where the listener can tell.
    fn cpu_s(&self) -> Option<f64> {
        None
    }
}

/// Listens to nothing.
#[derive(Debug, Clone, Copy, Default)]
pub struct Silent;

impl Progress for Silent {
    fn stage(&self, _: &str, _: usize) {}
    fn tick(&self) {}
    fn done(&self) {}
    fn elapsed_s(&self) -> f64 {
        0.0
    }
}
