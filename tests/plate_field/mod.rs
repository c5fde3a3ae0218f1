//! Synthetic fields to be matched: a catalogue, what a frame shows of it, a hint, and the truth. Seeded.
#![allow(dead_code)]

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Exp1, Normal, Poisson};
use satphot::astrometry::catalogue::separation_deg;
use satphot::astrometry::plate::{Detection, Hint, SkyStar, Solution};
use satphot::astrometry::wcs::Wcs;

/// Size of the frames \[px\]: 31' x 21' at 0.194 arcsec/px.
pub const SIZE: (usize, usize) = (9576, 6388);
/// The assumed scale of the optics \[arcsec/px\].
pub const SCALE: f64 = 0.194;

/// What a field is made of.
#[derive(Debug, Clone, Copy)]
pub struct Kind {
    pub name: &'static str,
    pub stars_per_deg2: f64,
    pub false_share: f64,
    pub missing_share: f64,
    pub hint_off_arcmin: f64,
    pub mirrored: bool,
    pub noise_px: f64,
    pub scale_err: f64,
    /// The catalogue is that of another part of the sky.
    pub wrong: bool,
}

/// The ten cases of the acceptance table.
pub const KINDS: [Kind; 10] = [
    Kind {
        name: "rich",
        stars_per_deg2: 1500.0,
        false_share: 0.2,
        missing_share: 0.1,
        hint_off_arcmin: 5.0,
        ..TYPICAL
    },
    TYPICAL,
    Kind { name: "mirrored", mirrored: true, ..TYPICAL },
    Kind { name: "far_off", hint_off_arcmin: 30.0, ..TYPICAL },
    Kind { name: "noisy", noise_px: 2.0, ..TYPICAL },
    Kind { name: "sparse", stars_per_deg2: 150.0, ..TYPICAL },
    Kind { name: "half_false", stars_per_deg2: 150.0, false_share: 0.5, hint_off_arcmin: 15.0, ..TYPICAL },
    Kind { name: "very_sparse", stars_per_deg2: 80.0, ..TYPICAL },
    Kind { name: "scale_20_percent", scale_err: 0.2, ..TYPICAL },
    Kind { name: "wrong_field", wrong: true, ..TYPICAL },
];

pub const TYPICAL: Kind = Kind {
    name: "typical",
    stars_per_deg2: 500.0,
    false_share: 0.3,
    missing_share: 0.2,
    hint_off_arcmin: 10.0,
    mirrored: false,
    noise_px: 0.3,
    scale_err: 0.01,
    wrong: false,
};

/// A field.
pub struct Field {
    pub stars: Vec<SkyStar>,
    pub detections: Vec<Detection>,
    pub hint: Hint,
    pub truth: Wcs,
    /// Detections that are stars.
    pub n_true: usize,
}

/// Stars in a square of two degrees about a place, magnitudes with slope 0.3 up to 15.
pub fn sky(rng: &mut ChaCha8Rng, at_deg: (f64, f64), stars_per_deg2: f64) -> Vec<SkyStar> {
    let n = Poisson::new(stars_per_deg2 * 4.0).unwrap().sample(rng) as usize;
    let plane = Wcs::tan(at_deg.0, at_deg.1, 0.0, 0.0, 3600.0, 0.0, true);
    (0..n)
        .map(|_| {
            let (ra_deg, dec_deg) = plane.pixel_to_sky(rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0));
            let faint: f64 = Exp1.sample(rng);
            SkyStar { ra_deg, dec_deg, v_mag: 15.0 - 1.45 * faint }
        })
        .collect()
}

impl Field {
    /// A field of a kind anywhere between declinations -72 and 72 deg.
    pub fn new(kind: &Kind, seed: u64) -> Field {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let dec_deg = rng.random_range(-0.95f64..0.95).asin().to_degrees();
        let ra_deg = rng.random_range(0.0..360.0);
        Field::at(kind, (ra_deg, dec_deg), &mut rng)
    }

    /// A field of a kind at a place.
    pub fn at(kind: &Kind, at_deg: (f64, f64), rng: &mut ChaCha8Rng) -> Field {
        let stars = sky(rng, at_deg, kind.stars_per_deg2);
        let scale = SCALE * (1.0 + rng.random_range(-kind.scale_err..=kind.scale_err));
        let (cx, cy) = (0.5 * SIZE.0 as f64 - 0.5, 0.5 * SIZE.1 as f64 - 0.5);
        let turn = rng.random_range(0.0..360.0);
        let truth = Wcs::tan(at_deg.0, at_deg.1, cx, cy, scale, turn, kind.mirrored);
        let detections = seen(rng, &stars, &truth, kind);
        let n_true = detections.1;
        let angle = rng.random_range(0.0..std::f64::consts::TAU);
        let off = kind.hint_off_arcmin / 60.0;
        let plane = Wcs::tan(at_deg.0, at_deg.1, 0.0, 0.0, 3600.0, 0.0, true);
        let (ra_deg, dec_deg) = plane.pixel_to_sky(off * angle.cos(), off * angle.sin());
        let hint =
            Hint { ra_deg, dec_deg, radius_deg: 1.0, scale_arcsec: SCALE, scale_search_frac: 0.2, mirrored: None };
        let stars = if kind.wrong { sky(rng, at_deg, kind.stars_per_deg2) } else { stars };
        Field { stars, detections: detections.0, hint, truth, n_true }
    }

    /// Whether a solution is that of the truth: every corner within `arcsec`, and so centre, scale, rotation and parity.
    pub fn is_right(&self, solution: &Solution, arcsec: f64) -> bool {
        let (nx, ny) = (SIZE.0 as f64 - 1.0, SIZE.1 as f64 - 1.0);
        [(0.0, 0.0), (nx, 0.0), (0.0, ny), (nx, ny), (nx / 2.0, ny / 2.0)].iter().all(|p| {
            let (a, b) = (solution.wcs.pixel_to_sky(p.0, p.1), self.truth.pixel_to_sky(p.0, p.1));
            separation_deg(a.0, a.1, b.0, b.1) * 3600.0 < arcsec
        })
    }
}

/// What a frame shows of the stars: some missing, false detections among them, brightest first.
pub fn seen(rng: &mut ChaCha8Rng, stars: &[SkyStar], truth: &Wcs, kind: &Kind) -> (Vec<Detection>, usize) {
    let noise = Normal::new(0.0, kind.noise_px).unwrap();
    let scatter = Normal::new(0.0, 0.1).unwrap();
    let mut out = Vec::new();
    for star in stars {
        let Some((x, y)) = truth.sky_to_pixel(star.ra_deg, star.dec_deg) else { continue };
        if x > 0.0 && y > 0.0 && x < SIZE.0 as f64 && y < SIZE.1 as f64 && rng.random::<f64>() > kind.missing_share {
            let flux = 10f64.powf(-0.4 * (star.v_mag - 20.0)) * f64::exp(scatter.sample(rng));
            out.push(Detection { x_px: x + noise.sample(rng), y_px: y + noise.sample(rng), flux });
        }
    }
    let n_true = out.len();
    let n_false = (n_true as f64 * kind.false_share / (1.0 - kind.false_share)).round() as usize;
    for _ in 0..n_false {
        let faint: f64 = Exp1.sample(rng);
        out.push(Detection {
            x_px: rng.random_range(0.0..SIZE.0 as f64),
            y_px: rng.random_range(0.0..SIZE.1 as f64),
            flux: 10f64.powf(-0.4 * (15.0 - 1.45 * faint - 20.0)),
        });
    }
    out.sort_by(|a, b| b.flux.total_cmp(&a.flux));
    (out, n_true)
}

/// CPU time of this thread \[s\], which a busy machine does not lengthen; `None` where the system does not tell.
pub fn cpu_s() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    Some(text.split_whitespace().next()?.parse::<f64>().ok()? * 1e-9)
}
