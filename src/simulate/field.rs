//! Star fields: positions, magnitudes and colours drawn from the scenario, and the catalogue that lists them.

use rand::Rng;
use rand_distr::{Distribution, Normal, Poisson};

use super::noise::stream;
use super::scenario::{Field, Scenario};
use crate::astrometry::wcs::Wcs;

/// A simulated star and what the catalogue says of it.
#[derive(Debug, Clone)]
pub struct Star {
    /// Number in the catalogue.
    pub id: String,
    /// Right ascension \[deg\].
    pub ra_deg: f64,
    /// Declination \[deg\].
    pub dec_deg: f64,
    /// True V \[mag\].
    pub v_mag: f64,
    /// True B−V \[mag\].
    pub b_v_mag: f64,
    /// V of the catalogue \[mag\].
    pub catalogue_v_mag: f64,
}

/// A magnitude from dN/dV ∝ 10^(slope V) between `lo` and `hi`, by inversion.
fn draw_v(rng: &mut impl Rng, slope: f64, lo: f64, hi: f64) -> f64 {
    let (a, b) = (10f64.powf(slope * lo), 10f64.powf(slope * hi));
    (a + rng.random::<f64>() * (b - a)).log10() / slope
}

/// Stars per square degree between `lo` and `hi` where there are `within` in the range of the field: its law continued.
fn density(field: &Field, within: f64, lo: f64, hi: f64) -> f64 {
    let n = |v: f64| 10f64.powf(field.slope_per_mag * v);
    let [v0, v1] = field.v_range_mag;
    within * (n(hi) - n(lo)) / (n(v1) - n(v0)).max(f64::MIN_POSITIVE)
}

/// The stars of one pointing, in a square that covers the frame at any rotation.
pub fn draw_field(scenario: &Scenario, pointing: usize, ra_deg: f64, dec_deg: f64) -> Vec<Star> {
    let field = &scenario.field;
    let mut rng = stream(scenario.seed, super::frames::FIELD_STREAM + pointing as u64, None);
    let scale = scenario.scale_arcsec();
    let half_px = 0.5 * (scenario.frame.nx_px as f64).hypot(scenario.frame.ny_px as f64) + 40.0;
    let area_deg2 = (2.0 * half_px * scale / 3600.0).powi(2);
    let wcs = Wcs::tan(ra_deg, dec_deg, 0.0, 0.0, scale, 0.0, false);
    let expected =
        (density(field, field.stars_per_deg2, field.v_range_mag[0], field.v_range_mag[1]) * area_deg2).max(1e-9);
    let n = Poisson::new(expected).map_or(0, |p: Poisson<f64>| p.sample(&mut rng) as usize);
    let error = Normal::new(0.0, field.catalogue_err_mag).ok();
    (0..n)
        .map(|k| {
            let x = rng.random_range(-half_px..half_px);
            let y = rng.random_range(-half_px..half_px);
            let v_mag = draw_v(&mut rng, field.slope_per_mag, field.v_range_mag[0], field.v_range_mag[1]);
            let b_v_mag = field.bv_range_mag[0] + rng.random::<f64>() * (field.bv_range_mag[1] - field.bv_range_mag[0]);
            let (ra_deg, dec_deg) = wcs.pixel_to_sky(x, y);
            let catalogue_v_mag = v_mag + error.map_or(0.0, |e| e.sample(&mut rng));
            Star { id: format!("{pointing:02}{k:05}"), ra_deg, dec_deg, v_mag, b_v_mag, catalogue_v_mag }
        })
        .collect()
}

/// A star that crosses a tracked frame.
#[derive(Debug, Clone, Copy)]
pub struct Trail {
    /// Middle of the trail \[px\].
    pub centre_px: (f64, f64),
    /// V \[mag\].
    pub v_mag: f64,
    /// B−V \[mag\].
    pub b_v_mag: f64,
}

/// The stars whose trails of (`dx_px`, `dy_px`) can touch the frame.
pub fn draw_trails(scenario: &Scenario, rng: &mut impl Rng, (dx_px, dy_px): (f64, f64)) -> Vec<Trail> {
    let field = &scenario.field;
    let length = dx_px.hypot(dy_px);
    let (ux, uy) = if length > 0.0 { (dx_px / length, dy_px / length) } else { (1.0, 0.0) };
    let half = 0.5 * (scenario.frame.nx_px as f64).hypot(scenario.frame.ny_px as f64) + 40.0;
    let half_along = half + 0.5 * length;
    let area_deg2 = 4.0 * half * half_along * (scenario.scale_arcsec() / 3600.0).powi(2);
    let (lo, hi) = (field.trail_v_min_mag, field.v_range_mag[1]);
    let within = field.trail_stars_per_deg2.unwrap_or(field.stars_per_deg2);
    let expected = density(field, within, lo, hi) * area_deg2;
    let n = Poisson::new(expected.max(1e-9)).map_or(0, |p: Poisson<f64>| p.sample(rng) as usize);
    let (cx, cy) = (scenario.frame.nx_px as f64 / 2.0, scenario.frame.ny_px as f64 / 2.0);
    (0..n)
        .map(|_| {
            let along = rng.random_range(-half_along..half_along);
            let across = rng.random_range(-half..half);
            let v_mag = draw_v(rng, field.slope_per_mag, lo, hi);
            let b_v_mag = field.bv_range_mag[0] + rng.random::<f64>() * (field.bv_range_mag[1] - field.bv_range_mag[0]);
            Trail { centre_px: (cx + along * ux - across * uy, cy + along * uy + across * ux), v_mag, b_v_mag }
        })
        .collect()
}

/// Streams of the star fields lie beyond those of the frames.
pub const FIELD_STREAM: u64 = 1 << 24;
