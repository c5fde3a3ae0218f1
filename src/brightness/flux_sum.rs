//! Fluxes of one source of light added over the surfaces of a satellite.

use super::scene::impossible;
use crate::base::error::Result;
use crate::base::vector::Itrs;
use crate::base::vector::Vector;

/// Sum of a light over the surfaces, its numerical error, and what the Earth integrals took.
#[derive(Default)]
pub(super) struct FluxSum {
    pub flux: f64,
    pub err: f64,
    /// Upper bound of what was skipped because it is small; part of the error.
    pub skipped: f64,
    pub quadratures: usize,
    pub nodes: usize,
}

impl FluxSum {
    /// Adds a part, its flux and error scaled.
    pub fn add(&mut self, part: &FluxSum, scale: f64) {
        self.flux += scale * part.flux;
        self.err += scale * part.err;
        self.skipped += scale * part.skipped;
        self.quadratures += part.quadratures;
        self.nodes += part.nodes;
    }
}

pub(super) fn unit(v: Vector<Itrs>, to: &str) -> Result<Vector<Itrs>> {
    v.unit().ok_or_else(|| impossible(format!("no direction from the satellite to the {to}: {:?} km", v.to_array())))
}
