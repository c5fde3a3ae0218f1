//! The flux of a star in an aperture, its sky from a ring around it.
//!
//! `cargo run --example aperture`

use satphot::ndarray::Array2;
use satphot::{Aperture, sum_aperture};

/// A star of 10 000 e⁻ and σ = 1.5 px at (20.3, 18.7) on a sky of 50 e⁻/px.
fn image() -> Array2<f64> {
    Array2::from_shape_fn((40, 40), |(j, i)| {
        let (dx, dy) = (i as f64 - 20.3, j as f64 - 18.7);
        let s2 = 1.5 * 1.5;
        50.0 + 10_000.0 / (std::f64::consts::TAU * s2) * (-(dx * dx + dy * dy) / (2.0 * s2)).exp()
    })
}

fn main() {
    let (pixels, x_px, y_px) = (image(), 20.3, 18.7);
    let circle = |r_px: f64| Aperture::Circle { r_px };
    let sum = |aperture: &Aperture| sum_aperture(&pixels, aperture, x_px, y_px);

    let (inner, outer) = (circle(10.0), circle(15.0));
    let sky_e_px = (sum(&outer) - sum(&inner)) / (outer.area_px() - inner.area_px());
    println!("sky {sky_e_px:.3} e-/px");
    for r_px in [2.0, 4.0, 8.0] {
        let star = circle(r_px);
        let flux_e = sum(&star) - star.area_px() * sky_e_px;
        println!("r {r_px} px: {flux_e:.1} e-, inst_mag {:.4}", -2.5 * flux_e.log10());
    }
    let track = Aperture::Pill { a_px: 9.0, b_px: 6.0, theta_rad: 0.4 };
    println!("pill: {:.1} e-", sum(&track) - track.area_px() * sky_e_px);
}
