//! `satphot fit` of surfaces: strengths, numbers of laws and angles of attitude that were put into simulated passes are recovered, and
//! their errors hold the truth as often as they say; flares move nothing; what the data do not tell is refused by name.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal, StudentT};
use satphot::brightness::Surface;
use satphot::config;
use satphot::fitting::{Free, Observation, Problem, fit_surfaces, surfaces_at};
use satphot::{Scene, Vector};

const RADIUS_KM: f64 = 6371.0;
const WITHIN_MAG: f64 = 0.06;
const BETWEEN_MAG: f64 = 0.15;
const ERR_MAG: f64 = 0.03;
/// What is free, and the truth of it in the units of its names.
const FREE: [&str; 5] = ["chassis", "chassis.n", "chassis.pitch_deg", "array", "array.sun_offset_deg"];
const TRUTH: [f64; 5] = [0.3, 0.4, 8.0, -0.5, -15.0];

/// A chassis that faces the Earth, an array that faces the Sun, and what else is lit, which is held: where the fit begins.
fn start() -> [config::Surface; 3] {
    let surface = |name: &str, area_m2, attitude, brdf| config::Surface {
        name: name.into(),
        area_m2,
        attitude,
        brdf,
        back: None,
    };
    [
        surface("chassis", 10.0, config::Attitude::Nadir, config::Brdf::Phong { kd: 0.2, ks: 0.4, n: 15.0 }),
        surface("array", 25.0, config::Attitude::Sun, config::Brdf::Phong { kd: 0.05, ks: 0.3, n: 8.0 }),
        surface("bus", 2.0, config::Attitude::Nadir, config::Brdf::Lambert { albedo: 0.3 }),
    ]
}

/// The free parameters and their truth; a number of a law is its logarithm, which the truth multiplies.
fn free_and_truth() -> (Vec<Free>, Vec<f64>) {
    let free: Vec<Free> = FREE.iter().map(|text| Free::parse(text, &start()).unwrap()).collect();
    let truth = TRUTH.iter().enumerate().map(|(k, t)| if k == 1 { 15f64.ln() + t } else { *t }).collect();
    (free, truth)
}

/// A sunlit satellite after dusk over a spherical Earth.
fn scene(rng: &mut ChaCha8Rng) -> Scene {
    let r_km = RADIUS_KM + rng.random_range(480.0..600.0);
    let off_nadir_rad = rng.random_range(0.05..1.0f64);
    let (azimuth_rad, sun_az_rad) =
        (rng.random_range(0.0..std::f64::consts::TAU), rng.random_range(0.0..std::f64::consts::TAU));
    let below_rad = rng.random_range(0.02..0.38f64);
    let toward = Vector::new(
        -off_nadir_rad.cos(),
        off_nadir_rad.sin() * azimuth_rad.cos(),
        off_nadir_rad.sin() * azimuth_rad.sin(),
    );
    let half_km = r_km * off_nadir_rad.cos();
    let range_km = half_km - (half_km * half_km - r_km * r_km + RADIUS_KM * RADIUS_KM).sqrt();
    let satellite_km = Vector::new(r_km, 0.0, 0.0);
    let sun = Vector::new(-below_rad.sin(), below_rad.cos() * sun_az_rad.cos(), below_rad.cos() * sun_az_rad.sin());
    Scene {
        satellite_km,
        velocity_km_s: Vector::new(0.0, 0.0, 7.6),
        observer_km: satellite_km + toward * range_km,
        sun_km: satellite_km + sun * 1.496e8,
        moon_km: Vector::new(0.0, 0.0, -3.844e5),
        sidereal_rad: 0.0,
    }
}

/// Direct sunlight of one surface in each scene, relative to the Sun's: A f(i, n, o) cos i cos o / R².
fn flux(scenes: &[Scene], surface: &config::Surface) -> satphot::Result<Vec<f64>> {
    let surface = Surface::try_from(surface)?;
    let sent = |scene: &Scene| {
        let i = (scene.sun_km - scene.satellite_km).unit().unwrap();
        let o = (scene.observer_km - scene.satellite_km).unit().unwrap();
        let n = surface.normal(scene).unwrap();
        let (cos_i, cos_o, range_m) = (n.dot(&i), n.dot(&o), 1e3 * scene.range_km());
        if cos_i <= 0.0 || cos_o <= 0.0 {
            return 0.0;
        }
        surface.area_m2 * surface.brdf.value(&i, &n, &o) * cos_i * cos_o / (range_m * range_m)
    };
    Ok(scenes.iter().map(sent).collect())
}

/// Passes of 2 to 8 magnitudes of the satellite as it truly is, each with a flare of this probability.
fn simulated(n_passes: usize, seed: u64, flares: f64) -> (Vec<Observation>, Vec<Scene>) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (free, truth) = free_and_truth();
    let real = surfaces_at(&start(), &free, &truth).unwrap();
    let (mut scenes, mut passes) = (Vec::new(), Vec::new());
    for pass in 0..n_passes {
        for _ in 0..rng.random_range(2..9) {
            scenes.push(scene(&mut rng));
            passes.push(pass);
        }
    }
    let sent: Vec<Vec<f64>> = real.iter().map(|surface| flux(&scenes, surface).unwrap()).collect();
    let normal = Normal::new(0.0, 1.0).unwrap();
    let student = StudentT::new(4.0).unwrap();
    let offsets: Vec<f64> = (0..n_passes).map(|_| BETWEEN_MAG * normal.sample(&mut rng)).collect();
    let mut rows = Vec::new();
    for (row, pass) in passes.into_iter().enumerate() {
        let noise = offsets[pass] + WITHIN_MAG * student.sample(&mut rng) + ERR_MAG * normal.sample(&mut rng);
        let flare_mag = if rng.random::<f64>() < flares { rng.random_range(1.0..4.0) } else { 0.0 };
        let v_mag = -2.5 * sent.iter().map(|of| of[row]).sum::<f64>().log10() + noise - flare_mag;
        rows.push(Observation {
            row,
            mag_1000km: v_mag,
            v_mag,
            err_mag: ERR_MAG,
            is_limit: false,
            phase_deg: 90.0,
            sun_alt_sat_deg: None,
            range_km: 1000.0,
            mjd_d: None,
            pass,
            satellite: pass,
            table: 0,
        });
    }
    (rows, scenes)
}

fn fitted(rows: &[Observation], scenes: &[Scene], free: &[Free]) -> satphot::Result<Problem> {
    fit_surfaces(rows, &start(), free, &|_, surface| flux(scenes, surface), &[])
}

/// Fits `sets` simulated sets and prints and checks how often each error, and twice it, holds the truth.
fn coverage(sets: u64, n_passes: usize, seed: u64, [low, high, twice]: [f64; 3]) {
    let (free, truth) = free_and_truth();
    let mut within = vec![[0usize; 2]; truth.len()];
    let mut means = vec![0.0; truth.len()];
    let (mut n, mut refused) = (0usize, 0usize);
    for set in 0..sets {
        let (rows, scenes) = simulated(n_passes, seed + set, 0.0);
        let problem = match fitted(&rows, &scenes, &free) {
            Ok(problem) => problem,
            Err(error) => {
                eprintln!("set {set}: {error}");
                refused += 1;
                continue;
            }
        };
        n += 1;
        for (k, err) in problem.fit.errs().into_iter().enumerate() {
            let off = problem.fit.theta[k] - truth[k];
            means[k] += off / err;
            [1.0, 2.0].iter().enumerate().for_each(|(j, limit)| within[k][j] += usize::from(off.abs() <= limit * err));
        }
    }
    eprintln!(
        "{n} sets of {n_passes} passes, {refused} refused; within the error, within twice it, mean deviation in errors:"
    );
    for (k, name) in FREE.iter().enumerate() {
        let share = within[k].map(|w| w as f64 / n as f64);
        eprintln!("  {name:22} {:.3} {:.3} {:+.2}", share[0], share[1], means[k] / n as f64);
    }
    let share = |j: usize| within.iter().map(|w| w[j]).sum::<usize>() as f64 / (n * truth.len()) as f64;
    eprintln!("  {:22} {:.3} {:.3}", "all", share(0), share(1));
    assert!(refused * 20 <= sets as usize, "{refused} of {sets} sets were refused");
    assert!((low..=high).contains(&share(0)) && share(1) >= twice, "{} {}", share(0), share(1));
}

#[test]
fn errors_of_numbers_of_laws_and_angles_of_attitude_hold_the_truth_as_often_as_they_say() {
    // 16 sets of five parameters, which are not independent: 68 % +- 7 %
    coverage(16, 30, 31_000, [0.54, 0.82, 0.86]);
}

/// The same of many sets: `scripts/prove_fit.sh`.
#[test]
#[ignore = "minutes"]
fn errors_of_hundreds_of_fits_hold_the_truth() {
    let sets = std::env::var("SETS").ok().and_then(|sets| sets.parse().ok()).unwrap_or(200);
    for n_passes in [20, 40, 80] {
        coverage(sets, n_passes, 77_000, [0.63, 0.73, 0.92]);
    }
}

#[test]
fn flares_of_a_twentieth_of_the_rows_move_no_parameter() {
    let (free, truth) = free_and_truth();
    let mut within = 0;
    for set in 0..4 {
        let (rows, scenes) = simulated(40, 52_000 + set, 0.05);
        let problem = fitted(&rows, &scenes, &free).unwrap();
        for (k, err) in problem.fit.errs().into_iter().enumerate() {
            let z = (problem.fit.theta[k] - truth[k]) / err;
            assert!(z.abs() < 4.0, "{}: {z:.1} errors off", FREE[k]);
            within += usize::from(z.abs() <= 2.0);
        }
    }
    assert!(within >= 16, "{within} of 20 within two errors");
}

#[test]
fn the_offset_of_an_array_that_no_row_sees_lit_is_refused_by_name() {
    let (free, _) = free_and_truth();
    let (rows, scenes) = simulated(60, 3, 0.0);
    let array = flux(&scenes, &start()[1]).unwrap();
    let dark: Vec<usize> = (0..rows.len()).filter(|i| array[*i] == 0.0).collect();
    assert!(dark.len() > 20, "{}", dark.len());
    let rows: Vec<Observation> =
        dark.iter().enumerate().map(|(k, i)| Observation { pass: k, row: k, ..rows[*i].clone() }).collect();
    let scenes: Vec<Scene> = dark.iter().map(|i| scenes[*i]).collect();
    let why = fitted(&rows, &scenes, &free[3..4]).unwrap_err().to_string();
    assert!(why.contains("array"), "{why}");
}
