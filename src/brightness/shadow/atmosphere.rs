//! The Earth's shadow through its air: refraction, Rayleigh scattering and ozone, averaged over the source's disc.
//!
//! Angles in rad, lengths in km. A spherical, clear atmosphere the same everywhere; nothing is fitted to satellites.
//! Not included: aerosol and cloud tops, the diffuse light of the twilight air (1e-3 to 1e-6 of daylight), the rays
//! bent past the axis, the colour within a band. Below 15 km the model is too dark by 0.1 to 1.2 mag (ten
//! observations).

use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::OnceLock;

use super::colour::Colour;
use crate::base::quadrature::{gauss, half_cosine};

/// Bending of a ray that grazes the ground \[rad\]: twice the refraction at the horizon, 35′ (Bennett 1982, J. Navig.
/// 35, 255, has 34.5′ at 10 °C and 1010 hPa).
const GRAZING_BEND_RAD: f64 = 70.0 / 60.0 / 180.0 * PI;
/// Height in which refraction falls by e \[km\]. The density of the US Standard Atmosphere 1976 does so in 9.8 km at
/// 5 km height, 6.4 at 20 and 30 km; this is a mean.
const BEND_SCALE_KM: f64 = 7.5;
/// Height in which Rayleigh scattering falls by e \[km\]; the column of that atmosphere is 8.4 km of ground density.
const RAYLEIGH_SCALE_KM: f64 = 8.0;
/// Height and half width σ of the ozone layer \[km\] (US Standard Atmosphere 1976: greatest number density at 22 km).
const OZONE_KM: (f64, f64) = (22.0, 5.0);
/// Above this no ray is bent or dimmed \[km\]: less than 1e-9 in low orbit, 1e-8 beyond the umbra's tip.
const TOP_KM: f64 = 200.0;
/// Heights between which the absorption is one smooth piece \[km\].
const PIECES_KM: [f64; 7] = [0.0, 10.0, 20.0, 30.0, 45.0, 75.0, TOP_KM];
/// Least radius of a disc \[rad\]: the rounding of angles makes arcs of a smaller one coarse.
const POINT_RAD: f64 = 1e-6;
/// Gauss points in a piece: 12 leave 1e-8 of the Sun's light 550 km up and 1e-6 at worst, 8 leave 3e-6 for three
/// quarters of the time (`satphot accuracy penumbra`).
pub(crate) const ORDER: usize = 12;

/// Share of a source's light left by the Earth and its air, 0 to 1: 1 where no ray of the disc passes below 200 km.
///
/// The satellite is `r_km` from the centre of an Earth of `radius_km`; the source has the radius `disc_rad` and is
/// `from_nadir_rad` = c from nadir. A ray whose lowest height is h is bent by `b = 70′ e^(−h/7.5)`; without air it
/// would have passed at `h_g = h − D b`, `D = sqrt(r² − R²)`. It comes from the ring of the disc at ψ from nadir with
/// `h_g = r sin c − R + D (ψ − c)`: straight across the disc, which costs at most 0.02 mag. It arrives spread by `1 + D
/// b/7.5` and dimmed by `k_R sqrt(2πR/8) e^(−h/8)` and by the ozone on its way; rays with h < 0 hit the ground. The
/// mean over the disc takes h as variable: `dh_g = (1 + D b/7.5) dh` cancels the spreading.
///
/// For 550 km and V at h_g = 0, 10 … 50 km of the disc's centre: 3.84, 2.90, 1.51, 0.54, 0.13, 0.03 mag.
#[must_use]
pub fn atmospheric(r_km: f64, radius_km: f64, disc_rad: f64, from_nadir_rad: f64, colour: &Colour) -> f64 {
    mean_over_disc(r_km, radius_km, disc_rad, from_nadir_rad, colour, ORDER)
}

/// [`atmospheric`] with `order` Gauss points in a piece.
pub(crate) fn mean_over_disc(
    r_km: f64,
    radius_km: f64,
    disc_rad: f64,
    from_nadir_rad: f64,
    colour: &Colour,
    order: usize,
) -> f64 {
    let disc_rad = disc_rad.max(POINT_RAD);
    let lowest = (from_nadir_rad - disc_rad).max(0.0);
    let air_path = AirPath::new(r_km, radius_km, from_nadir_rad, colour);
    if air_path.tangent_km(lowest) >= TOP_KM {
        return 1.0;
    }
    let disc = Disc { radius: disc_rad, from_nadir: from_nadir_rad };
    // the air from the ground up, cut where a smooth piece of it ends, and where the disc and its full rings do
    let (inner, highest) = ((from_nadir_rad - disc_rad).abs(), from_nadir_rad + disc_rad);
    let ground_km = air_path.lowest_km();
    let mut ends_km = PIECES_KM.map(|h| h.max(ground_km)).to_vec();
    ends_km.extend([inner, highest].map(|psi| air_path.ray_km(psi).clamp(ground_km, TOP_KM)));
    ends_km.sort_by(f64::total_cmp);
    let mut mean = 0.0;
    for ends in ends_km.windows(2) {
        let middle = air_path.psi(0.5 * (ends[0] + ends[1]));
        if ends[1] > ends[0] && middle > lowest && middle < highest {
            mean +=
                integral(order, ends[0], ends[1], |h_km| disc.density(air_path.psi(h_km)) * air_path.left_per_km(h_km));
        }
    }
    // what is above the air is whole
    let top = air_path.psi(TOP_KM).max(lowest);
    for ends in [[top, inner.max(top)], [inner.max(top), highest]] {
        if ends[1] > ends[0] {
            mean += integral(order, ends[0], ends[1], |psi| disc.density(psi));
        }
    }
    mean.clamp(0.0, 1.0)
}

/// ∫ f from a to b, smooth but for square roots at the ends.
fn integral(order: usize, a: f64, b: f64, f: impl Fn(f64) -> f64) -> f64 {
    let (nodes, weights) = gauss(order);
    nodes
        .iter()
        .zip(weights)
        .map(|(t, weight)| {
            let (x, slope) = half_cosine(*t);
            weight * slope * (b - a) * f(a + (b - a) * x)
        })
        .sum()
}

/// The source's disc as rings about nadir.
struct Disc {
    radius: f64,
    from_nadir: f64,
}

impl Disc {
    /// Share of the disc per radian at ψ from nadir: `φ sin ψ / (π (1 − cos a))`, φ half the arc of the ring in the
    /// disc, `sin²(φ/2) = sin((a+c−ψ)/2) sin((a−c+ψ)/2) / (sin c sin ψ)`.
    fn density(&self, psi: f64) -> f64 {
        let (a, c) = (self.radius, self.from_nadir);
        let half_arc = if psi <= a - c {
            PI
        } else {
            let sin2 = (0.5 * (a + c - psi)).sin() * (0.5 * (a - c + psi)).sin() / (c.sin() * psi.sin());
            2.0 * sin2.clamp(0.0, 1.0).sqrt().asin()
        };
        let half_sin = (0.5 * a).sin();
        half_arc * psi.sin() / (2.0 * PI * half_sin * half_sin)
    }
}

/// The air between one satellite and one source.
struct AirPath {
    /// Distance to the horizon D \[km\].
    horizon_km: f64,
    /// Angle from nadir of the disc's centre, and the height at which a straight line to it passes.
    centre: (f64, f64),
    rayleigh_ln: f64,
    ozone_ln: f64,
}

impl AirPath {
    fn new(r_km: f64, radius_km: f64, from_nadir_rad: f64, colour: &Colour) -> Self {
        const LN_PER_MAG: f64 = 0.4 * std::f64::consts::LN_10;
        let sin = from_nadir_rad.sin();
        // above the horizontal the line leaves upwards: continued so that it stays continuous and rises
        let tangent_km = if from_nadir_rad > FRAC_PI_2 { r_km * (2.0 - sin) } else { r_km * sin } - radius_km;
        Self {
            horizon_km: ((r_km - radius_km) * (r_km + radius_km)).max(1e-12).sqrt(),
            centre: (from_nadir_rad, tangent_km),
            rayleigh_ln: LN_PER_MAG * colour.rayleigh_mag * (2.0 * PI * radius_km / RAYLEIGH_SCALE_KM).sqrt(),
            // the way through a layer grows as the root of the radius it is bent with
            ozone_ln: LN_PER_MAG * colour.ozone_mag * (radius_km / OZONE_RADIUS_KM).sqrt(),
        }
    }

    /// Height \[km\] at which a straight line to the disc at ψ passes: `h_g = r sin c − R + D (ψ − c)`.
    fn tangent_km(&self, psi: f64) -> f64 {
        self.centre.1 + self.horizon_km * (psi - self.centre.0)
    }

    /// D b/7.5: how much a ray is spread.
    fn spread(&self, h_km: f64) -> f64 {
        self.horizon_km * GRAZING_BEND_RAD * (-h_km / BEND_SCALE_KM).exp() / BEND_SCALE_KM
    }

    /// `h_g = h − D b` \[km\].
    fn geometric_km(&self, h_km: f64) -> f64 {
        h_km - BEND_SCALE_KM * self.spread(h_km)
    }

    /// The place in the disc that the ray of height h comes from: ψ.
    fn psi(&self, h_km: f64) -> f64 {
        self.centre.0 + (self.geometric_km(h_km) - self.centre.1) / self.horizon_km
    }

    /// Height \[km\] of the ray from ψ; below 0 it does not pass.
    fn ray_km(&self, psi: f64) -> f64 {
        self.solve(self.tangent_km(psi))
    }

    /// Height of the lowest ray \[km\]: the ground's, or that from nadir where rays reach the axis above the ground.
    fn lowest_km(&self) -> f64 {
        self.ray_km(0.0).clamp(0.0, TOP_KM)
    }

    /// h of h_g: with `u = (h − h_g)/7.5` the root of `u + ln u = ln(D b₀/7.5) − h_g/7.5` (Newton, quadratic, concave).
    fn solve(&self, geometric_km: f64) -> f64 {
        let goal = self.spread(0.0).ln() - geometric_km / BEND_SCALE_KM;
        let mut u = if goal > 1.0 { goal - goal.ln() } else { goal.exp() / (1.0 + goal.exp()) };
        for _ in 0..6 {
            u = u * (1.0 + goal - u.ln()) / (1.0 + u);
            if !(u > 0.0) {
                return geometric_km; // so high that nothing is bent
            }
        }
        geometric_km + BEND_SCALE_KM * u
    }

    /// Light left, per radian of ψ, in a step of h: `10^(−0.4 k(h)) / D`; the spreading cancels `dh_g/dh`.
    fn left_per_km(&self, h_km: f64) -> f64 {
        let depth = self.rayleigh_ln * (-h_km / RAYLEIGH_SCALE_KM).exp() + self.ozone_ln * ozone_mass(h_km);
        (-depth).exp() / self.horizon_km
    }
}

/// Radius the ozone table is made for \[km\]; others scale.
const OZONE_RADIUS_KM: f64 = 6_378.0;
/// Step and end of the ozone table \[km\].
const OZONE_STEP_KM: f64 = 0.125;
const OZONE_END_KM: f64 = 64.0;

/// Ozone along a ray of lowest height h, in vertical columns.
///
/// `∫ n ds = 4 ∫ n(h + y²) (R + h + y²)/sqrt(2(R + h) + y²) dy` from 0, n a Gaussian of column 1, z = h + y².
fn ozone_mass(h_km: f64) -> f64 {
    static TABLE: OnceLock<Vec<f64>> = OnceLock::new();
    let table = TABLE.get_or_init(|| {
        // one entry before 0, so that every step has a neighbour on both sides
        let count = (OZONE_END_KM / OZONE_STEP_KM) as usize + 3;
        (0..count).map(|j| ozone_integral((j as f64 - 1.0) * OZONE_STEP_KM)).collect()
    });
    if h_km >= OZONE_END_KM {
        return 0.0;
    }
    // the cubic through four entries: 1e-7 of the largest
    let x = (h_km / OZONE_STEP_KM).max(0.0);
    let (j, t) = (x as usize, x.fract());
    let [a, b, c, d] = [table[j], table[j + 1], table[j + 2], table[j + 3]];
    let (before, past, beyond) = (t + 1.0, t - 1.0, t - 2.0);
    0.5 * past * beyond * (b * before - a * t / 3.0) - 0.5 * before * t * (c * beyond - d * past / 3.0)
}

fn ozone_integral(h_km: f64) -> f64 {
    let (centre_km, sigma_km) = OZONE_KM;
    let end = (centre_km + 10.0 * sigma_km - h_km).max(0.0).sqrt();
    let (nodes, weights) = gauss(80);
    nodes
        .iter()
        .zip(weights)
        .map(|(t, weight)| {
            let rise_km = (end * t) * (end * t);
            let off = (h_km + rise_km - centre_km) / sigma_km;
            let density = (-0.5 * off * off).exp() / (sigma_km * (2.0 * PI).sqrt());
            let from_centre_km = OZONE_RADIUS_KM + h_km;
            weight * end * 4.0 * density * (from_centre_km + rise_km) / (2.0 * from_centre_km + rise_km).sqrt()
        })
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_over_the_disc_is_good_to_1e_6() {
        let mut worst = [0.0_f64; 4];
        for (k, r_km) in [6_378.0 + 450.0, 6_378.0 + 1200.0, 42_164.0, 384_400.0].into_iter().enumerate() {
            for disc_rad in [0.2666_f64.to_radians(), 0.26_f64.to_radians(), 1e-5] {
                for j in 0..400 {
                    let tangent_km = -8.0 * disc_rad * r_km + f64::from(j) / 400.0 * (16.0 * disc_rad * r_km + 200.0);
                    let from_nadir = ((6_378.0 + tangent_km) / r_km).clamp(0.0, 1.0).asin();
                    let of = |order| mean_over_disc(r_km, 6_378.0, disc_rad, from_nadir, &Colour::V, order);
                    worst[k] = worst[k].max((of(ORDER) - of(72)).abs());
                }
            }
        }
        println!("{worst:?}");
        assert!(worst.iter().all(|w| *w < 1e-6), "{worst:?}");
    }

    #[test]
    fn ozone_between_the_entries_of_its_table_is_the_integral() {
        for h_km in [0.0, 0.06, 11.71, 16.99, 22.03, 40.2, 63.9] {
            // 17 columns at most
            assert!((ozone_mass(h_km) - ozone_integral(h_km)).abs() < 1e-6, "{h_km}");
        }
        assert!(ozone_mass(64.0) == 0.0 && ozone_integral(64.0) < 1e-10);
        // a thin shell at 22 km seen from the ground's tangent, twice: 2 / sin of the slant; its thickness adds 4 %
        let shell = 2.0 * (OZONE_RADIUS_KM + 22.0) / (22.0 * (2.0 * OZONE_RADIUS_KM + 22.0_f64)).sqrt();
        assert!((ozone_mass(0.0) / shell - 1.0).abs() < 0.05);
    }

    #[test]
    fn the_height_of_a_ray_is_the_root_of_its_equation() {
        for r_km in [6_378.0 + 300.0, 42_164.0, 1e6] {
            let air_path = AirPath::new(r_km, 6_378.0, 0.1, &Colour::V);
            for h_km in [0.0, 3.0, 11.0, 40.0, 90.0, 199.0] {
                assert!(
                    (air_path.solve(air_path.geometric_km(h_km)) - h_km).abs() < 1e-9 * r_km.max(1e4) / 1e4,
                    "{r_km} {h_km}"
                );
            }
        }
    }

    #[test]
    fn one_fraction_takes_a_few_microseconds() {
        // the fastest of many short batches: other programs on the machine slow the rest
        let (mut sum, mut each_us) = (0.0, f64::INFINITY);
        for batch in 0..100 {
            let start = std::time::Instant::now();
            for j in 0..200 {
                let from_nadir = 1.17 + 1e-6 * f64::from(200 * batch + j);
                sum += atmospheric(6_928.0, 6_378.0, 0.004_653, from_nadir, &Colour::V);
            }
            each_us = each_us.min(start.elapsed().as_secs_f64() * 1e6 / 200.0);
        }
        println!("{each_us:.2} µs, mean {:.4}", sum / 20_000.0);
        assert!(each_us < 60.0, "{each_us} µs"); // 6 on a free core, optimised
    }
}
