//! Star trails of tracked frames, by a renderer of our own: stars summed along their path from pixel to pixel, on a sphere and
//! through a projection that share nothing with the library's.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use ndarray::Array2;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha12Rng;
use rand_distr::{Distribution, Normal, Poisson};
use satphot::astrometry::trailed::align::{Aligned, Beforehand, MOST_TRAILS, align};
use satphot::astrometry::trailed::image::TrailImage;
use satphot::astrometry::trailed::path::SkyPath;
use satphot::frames::{ElectronsPerAdu, Frame, Gain};
use satphot::photometry::background::background;
use satphot::zeropoint::frame_offset::{FrameOffset, StarRatio, frame_offset};

const SIDE: usize = 300;
const SCALE_ARCSEC: f64 = 1.567;
const ZP: f64 = 23.0;
const CATALOGUE_ERR_MAG: f64 = 0.02;
const MIDDLE: (f64, f64) = (40.0, 25.0);

type Place = (f64, f64);

/// A frame to be drawn.
#[derive(Debug, Clone, Copy)]
struct Scene {
    fwhm_px: f64,
    beta: f64,
    rate_deg_s: f64,
    exptime_s: f64,
    stars_per_deg2: f64,
    cloud_mag: f64,
    /// Time by which the satellite is ahead of its elements.
    ahead_s: f64,
    /// Place of the satellite's path across \[px\].
    cross_px: f64,
    north_rad: f64,
    mirrored: bool,
}

/// What is known wrongly, or not at all: the camera is its angle and the width of its stars.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Wrong {
    Nothing,
    UnknownCamera,
    Field,
    Turn,
    Mirror,
    Rate,
    Exposure,
}

impl Scene {
    fn drawn(rng: &mut ChaCha12Rng, exptime_s: f64, cloudy: f64) -> Self {
        Self {
            fwhm_px: 2.8 + 1.4 * rng.random::<f64>(),
            beta: [2.5, 3.5, 4.5, f64::INFINITY][rng.random_range(0..4)],
            rate_deg_s: 0.3 + 0.4 * rng.random::<f64>(),
            exptime_s,
            stars_per_deg2: 1200.0,
            cloud_mag: if rng.random::<f64>() < cloudy { 0.1 + 0.9 * rng.random::<f64>() } else { 0.0 },
            ahead_s: 0.5 * rng.random::<f64>() - 0.25,
            cross_px: 40.0 * rng.random::<f64>() - 20.0,
            north_rad: std::f64::consts::TAU * rng.random::<f64>(),
            mirrored: rng.random(),
        }
    }

    /// Where the elements put the satellite, `t_s` from mid-exposure: on a great circle, 1 % faster each second.
    fn place(&self, t_s: f64) -> Place {
        let angle = self.rate_deg_s.to_radians() * (t_s + 0.005 * t_s * t_s);
        let (a0, d0) = (MIDDLE.0.to_radians(), MIDDLE.1.to_radians());
        let way = 0.9f64;
        let up = angle.sin() * way.sin();
        let east = angle.sin() * way.cos();
        let s = [
            angle.cos() * d0.cos() * a0.cos() - east * a0.sin() - up * d0.sin() * a0.cos(),
            angle.cos() * d0.cos() * a0.sin() + east * a0.cos() - up * d0.sin() * a0.sin(),
            angle.cos() * d0.sin() + up * d0.cos(),
        ];
        (s[1].atan2(s[0]).to_degrees(), s[2].asin().to_degrees())
    }

    /// A star on the detector from the satellite, `t_s` from mid-exposure.
    fn star_px(&self, star: Place, t_s: f64) -> (f64, f64) {
        let c = self.place(t_s + self.ahead_s);
        let (d0, d, da) = (c.1.to_radians(), star.1.to_radians(), (star.0 - c.0).to_radians());
        let depth = d0.sin() * d.sin() + d0.cos() * d.cos() * da.cos();
        let k = 206_264.806 / SCALE_ARCSEC / depth;
        let (east, north) = (k * d.cos() * da.sin(), k * (d0.cos() * d.sin() - d0.sin() * d.cos() * da.cos()));
        let turn = if self.mirrored { -1.0 } else { 1.0 };
        let (s, c) = self.north_rad.sin_cos();
        (north * c - turn * east * s, north * s + turn * east * c)
    }

    /// Half the side of the box of stars.
    fn reach_deg(&self) -> f64 {
        0.5 * self.rate_deg_s * self.exptime_s + 0.35 * self.rate_deg_s + 0.12
    }

    fn rate_px_s(&self) -> f64 {
        self.rate_deg_s * 3600.0 / SCALE_ARCSEC
    }

    /// The frame, and its stars with their magnitudes.
    fn frame(&self, rng: &mut ChaCha12Rng) -> (Array2<f32>, (f64, f64), Vec<(Place, f64)>) {
        let reach_deg = self.reach_deg();
        let middle = self.place(self.ahead_s);
        let n = Poisson::new(self.stars_per_deg2 * 4.0 * reach_deg * reach_deg).unwrap().sample(rng) as usize;
        let (lo, hi) = (10f64.powf(0.33 * 8.5), 10f64.powf(0.33 * 15.0));
        let stars: Vec<(Place, f64)> = (0..n)
            .map(|_| {
                let east = (2.0 * rng.random::<f64>() - 1.0) * reach_deg / middle.1.to_radians().cos();
                let north = (2.0 * rng.random::<f64>() - 1.0) * reach_deg;
                ((middle.0 + east, middle.1 + north), (lo + rng.random::<f64>() * (hi - lo)).log10() / 0.33)
            })
            .collect();
        let half = 0.5 * SIDE as f64;
        let target = (half + 6.0 * rng.random::<f64>(), half - 6.0 * rng.random::<f64>());
        // across the motion of the stars
        let (from, to) = (self.star_px(middle, -0.01), self.star_px(middle, 0.01));
        let length = (to.0 - from.0).hypot(to.1 - from.1);
        let across = (-(to.1 - from.1) / length * self.cross_px, (to.0 - from.0) / length * self.cross_px);
        let mut light = Array2::<f64>::from_elem((SIDE, SIDE), 25.0);
        for (place, v) in &stars {
            let e_s = 10f64.powf(0.4 * (ZP - v - self.cloud_mag));
            let steps = (self.rate_px_s() * self.exptime_s).ceil().max(3.0) as usize;
            let reach = if *v < 12.0 { 20 } else { 9 };
            for k in 0..steps {
                let t_s = self.exptime_s * ((k as f64 + 0.5) / steps as f64 - 0.5);
                let at = self.star_px(*place, t_s);
                let (x, y) = (target.0 + at.0 + across.0, target.1 + at.1 + across.1);
                let edge = SIDE as f64 + f64::from(reach);
                if x.min(y) > -f64::from(reach) && x.max(y) < edge {
                    self.add_point(&mut light, (x, y), e_s * self.exptime_s / steps as f64, reach);
                }
            }
        }
        let noise = Normal::new(0.0, 5.0).unwrap();
        let pixels = light.mapv(|e| (Poisson::new(e).unwrap().sample(rng) + noise.sample(rng)) as f32);
        (pixels, target, stars)
    }

    fn add_point(&self, light: &mut Array2<f64>, (x, y): (f64, f64), e: f64, reach: i32) {
        let (i0, j0) = (x.round() as i32, y.round() as i32);
        let side = SIDE as i32 - 1;
        let alpha2 = (0.5 * self.fwhm_px).powi(2) / (2f64.powf(1.0 / self.beta) - 1.0);
        let sigma2 = (self.fwhm_px / 2.354_82).powi(2);
        for j in (j0 - reach).max(0)..=(j0 + reach).min(side) {
            for i in (i0 - reach).max(0)..=(i0 + reach).min(side) {
                let r2 = (f64::from(i) - x).powi(2) + (f64::from(j) - y).powi(2);
                let density = if self.beta.is_infinite() {
                    (-0.5 * r2 / sigma2).exp() / (std::f64::consts::TAU * sigma2)
                } else {
                    (self.beta - 1.0) / (std::f64::consts::PI * alpha2) * (1.0 + r2 / alpha2).powf(-self.beta)
                };
                light[[j as usize, i as usize]] += e * density;
            }
        }
    }

    /// What the library makes of the frame.
    fn measured(&self, rng: &mut ChaCha12Rng, wrong: Wrong) -> Result<(Aligned, FrameOffset), String> {
        let (pixels, target, stars) = self.frame(rng);
        let gain = Gain {
            e_per_adu: ElectronsPerAdu(1.0),
            source: String::new(),
            read_noise_e: 5.0,
            saturation_adu: 1e9,
            pedestal_adu: 0.0,
            setting: None,
        };
        let frame = Frame::from_electrons("trails.fits".into(), pixels, gain);
        let sky = background(&frame, 32, 3.0).unwrap();
        let image = TrailImage::new(&frame, &sky, target, &[(target.0, target.1, 10.0)], 3.5);
        let err = Normal::new(0.0, CATALOGUE_ERR_MAG).unwrap();
        let (middle, reach_deg) = (self.place(self.ahead_s), self.reach_deg());
        let wide = reach_deg / middle.1.to_radians().cos();
        let (west, south) = (middle.0 - wide, middle.1 - reach_deg);
        let lit: Vec<(Place, f64)> = stars
            .iter()
            .filter(|(_, v)| *v < 14.5)
            .map(|((ra, dec), v)| {
                // other stars as many: those of the field, moved on and round within its box
                let moved = |x: f64, from: f64, side: f64, by: f64| from + (x - from + by * side).rem_euclid(side);
                let place = if wrong == Wrong::Field {
                    (moved(*ra, west, 2.0 * wide, 0.37), moved(*dec, south, 2.0 * reach_deg, 0.29))
                } else {
                    (*ra, *dec)
                };
                (place, 10f64.powf(0.4 * (ZP - v - err.sample(rng))))
            })
            .collect();
        let (speed, time) = match wrong {
            Wrong::Rate => (1.25, 1.0),
            Wrong::Exposure => (1.0, 1.25),
            _ => (1.0, 1.0),
        };
        let path_at = |ahead_s: f64| {
            let at = |k: u32| {
                let t_s = time * self.exptime_s * (f64::from(k) / 8.0 - 0.5);
                let (ra_deg, dec_deg) = self.place(speed * (t_s + ahead_s));
                (t_s, ra_deg, dec_deg)
            };
            SkyPath::new(&(0..9).map(at).collect::<Vec<_>>())
        };
        let turn = if wrong == Wrong::Turn { 0.4 } else { 0.002 };
        let is_known = wrong != Wrong::UnknownCamera;
        let camera = (self.north_rad + turn, self.mirrored != (wrong == Wrong::Mirror), 0.004);
        let known = Beforehand {
            turn: is_known.then_some(camera),
            scale_arcsec: SCALE_ARCSEC,
            fwhm_px: is_known.then_some(3.5),
            beta: if is_known { self.beta } else { 3.5 },
            along_px: 0.6 * self.rate_px_s(),
            across_px: 77.0,
            most_trails: MOST_TRAILS,
        };
        let aligned = align(&image, &path_at, &lit, known)?;
        let ratio = |l: &satphot::astrometry::trailed::fit::TrailLight| StarRatio {
            ratio: l.ratio,
            err: l.err,
            predicted_err_mag: CATALOGUE_ERR_MAG,
        };
        let offset = frame_offset(&aligned.lights().map(ratio).collect::<Vec<_>>(), 0.0, true)?;
        let offset = if aligned.ends_unknown() { offset.without_ends() } else { offset };
        Ok((aligned, offset))
    }
}

/// Of frames of an exposure time: what was found against what was put in.
#[derive(Debug, Default)]
struct Tally {
    frames: usize,
    measured: usize,
    within: usize,
    clouds: usize,
    seen: usize,
    clear: usize,
    false_alarms: usize,
    wild: usize,
    refused: std::collections::BTreeMap<String, usize>,
    along_px: Vec<f64>,
    clock_s: Vec<f64>,
    cross_px: Vec<f64>,
}

fn tally(seed: u64, frames: u64, exptime_s: f64, wrong: Wrong) -> Tally {
    let mut t = Tally { frames: frames as usize, ..Tally::default() };
    for k in 0..frames {
        let mut rng = ChaCha12Rng::seed_from_u64(seed * 1_000_003 + k);
        let scene = Scene::drawn(&mut rng, exptime_s, 0.25);
        let (aligned, found) = match scene.measured(&mut rng, wrong) {
            Ok(found) => found,
            Err(why) => {
                *t.refused.entry(why.replace(|c: char| c.is_ascii_digit(), "")).or_default() += 1;
                continue;
            }
        };
        let (off, err) = (found.offset_mag - scene.cloud_mag, found.err_mag);
        t.measured += 1;
        t.within += usize::from(off.abs() < err);
        t.wild += usize::from(off.abs() > 5.0 * err);
        let flagged = found.offset_mag > 3.0 * err;
        t.clouds += usize::from(scene.cloud_mag > 4.0 * err);
        t.seen += usize::from(scene.cloud_mag > 4.0 * err && flagged);
        t.clear += usize::from(scene.cloud_mag == 0.0);
        t.false_alarms += usize::from(scene.cloud_mag == 0.0 && flagged);
        t.cross_px.push((aligned.fit.across_px.0 - scene.cross_px).abs());
        if let Some((along_px, _)) = aligned.fit.along_px {
            let ahead_s = aligned.ahead_s + along_px / aligned.speed_px_s;
            t.along_px.push(((ahead_s - scene.ahead_s) * aligned.speed_px_s).abs());
            t.clock_s.push((ahead_s - scene.ahead_s).abs());
        }
    }
    [&mut t.along_px, &mut t.clock_s, &mut t.cross_px].into_iter().for_each(|v| v.sort_by(f64::total_cmp));
    let at = |v: &[f64], share: f64| v.get((share * v.len() as f64) as usize).copied();
    println!(
        "{wrong:?} {exptime_s} s, seed {seed}: {} of {frames} frames measured, {} within 1 sigma, {} wild; {} of {} clouds \
         seen, {} false alarms in {} clear frames; across p50 {:?} p95 {:?} px; along of {} frames p50 {:?} p95 {:?} px, clock \
         p95 {:?} s; refused {:?}",
        t.measured,
        t.within,
        t.wild,
        t.seen,
        t.clouds,
        t.false_alarms,
        t.clear,
        at(&t.cross_px, 0.5),
        at(&t.cross_px, 0.95),
        t.along_px.len(),
        at(&t.along_px, 0.5),
        at(&t.along_px, 0.95),
        at(&t.clock_s, 0.95),
        t.refused,
    );
    t
}

fn judge(t: &Tally) {
    assert!(10 * t.measured >= 4 * t.frames, "{t:?}");
    assert_eq!(t.wild, 0, "{t:?}");
    // 68 % of n, three binomial deviations
    let (n, hits) = (t.measured as f64, t.within as f64);
    assert!((hits / n - 0.683).abs() < 3.0 * (0.683 * 0.317 / n).sqrt(), "{t:?}");
    assert!(t.seen as f64 >= 0.95 * t.clouds as f64, "{t:?}");
    assert!(t.false_alarms as f64 <= 0.01 * t.clear as f64, "{t:?}");
}

/// Frames of an unknown camera have four orientations to choose from: fewer are measured, and none wrongly.
fn judge_unknown(t: &Tally) {
    assert!(4 * t.measured >= t.frames && t.wild == 0 && t.false_alarms == 0, "{t:?}");
    assert!(t.seen == t.clouds && t.along_px.iter().all(|off| *off < 2.0), "{t:?}");
}

#[test]
fn trails_across_the_frame_give_its_zeropoint_and_nothing_along_the_track() {
    let t = tally(91, 12, 0.8, Wrong::Nothing);
    judge(&t);
    // few of these trails end in the frame: then nothing is said, or what is right
    assert!(t.along_px.iter().all(|off| *off < 4.0), "{t:?}");
}

#[test]
fn trails_that_end_in_the_frame_give_its_place_along_the_track_too() {
    let t = tally(92, 12, 0.08, Wrong::Nothing);
    judge(&t);
    assert!(2 * t.along_px.len() > t.measured, "{t:?}");
    let median = |v: &[f64]| v[v.len() / 2];
    assert!(median(&t.along_px) < 0.4 && median(&t.cross_px) < 0.2 && *t.clock_s.last().unwrap() < 0.02, "{t:?}");
}

#[test]
fn trails_alone_show_how_the_camera_is_turned_and_how_wide_its_stars_are() {
    judge_unknown(&tally(98, 8, 0.15, Wrong::UnknownCamera));
}

#[test]
fn a_frame_of_another_field_turn_or_camera_has_no_offset() {
    for (seed, wrong) in [(93, Wrong::Field), (94, Wrong::Turn), (95, Wrong::Mirror)] {
        for exptime_s in [0.08, 0.6] {
            let t = tally(seed, 3, exptime_s, wrong);
            assert_eq!(t.measured, 0, "{wrong:?}: {t:?}");
        }
    }
}

#[test]
fn trails_of_another_length_are_refused_where_their_ends_are_seen() {
    for (seed, wrong) in [(96, Wrong::Rate), (97, Wrong::Exposure)] {
        let t = tally(seed, 4, 0.08, wrong);
        assert_eq!(t.measured, 0, "{wrong:?}: {t:?}");
    }
}

/// `scripts/prove_trails.sh`.
#[test]
#[ignore = "long: scripts/prove_trails.sh"]
fn star_trails_over_many_frames() {
    let frames = std::env::var("FRAMES").ok().and_then(|n| n.parse().ok()).unwrap_or(200);
    let right: Vec<Tally> = [(291, 1.2), (292, 0.6), (293, 0.15), (294, 0.08)]
        .into_iter()
        .map(|(seed, exptime_s)| tally(seed, frames, exptime_s, Wrong::Nothing))
        .collect();
    judge_unknown(&tally(297, frames / 4, 0.15, Wrong::UnknownCamera));
    for wrong in [Wrong::Rate, Wrong::Exposure, Wrong::Field, Wrong::Turn, Wrong::Mirror] {
        for (seed, exptime_s) in [(295, 0.08), (296, 0.6)] {
            let t = tally(seed, frames / 4, exptime_s, wrong);
            assert!(matches!(wrong, Wrong::Rate | Wrong::Exposure) || t.measured == 0, "{wrong:?}: {t:?}");
        }
    }
    right.iter().for_each(judge);
}
