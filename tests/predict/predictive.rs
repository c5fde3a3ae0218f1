//! The predictive error: magnitudes that were not in a fit lie within it as often as it says, and it is made of the parts it names.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal, StudentT};
use satphot::brightness::catalogue::Catalogue;
use satphot::fitting::{fitted_phase_law, phase_law};
use satphot::{Model, ModelSettings, Satellite, Scene, Vector};

use crate::fit::{BETWEEN_MAG, ERR_MAG, TRUE_LAW, WITHIN_MAG, law, passes};
use crate::support::satphot;

const RADIUS_KM: f64 = 6371.0;

/// A satellite in full sunlight at a phase angle, seen this far from its nadir.
pub fn scene(height_km: f64, off_nadir_rad: f64, phase_rad: f64) -> Scene {
    let r = RADIUS_KM + height_km;
    let satellite_km = Vector::new(r, 0.0, 0.0);
    let toward = |rad: f64| Vector::new(-rad.cos(), rad.sin(), 0.0);
    let half = r * off_nadir_rad.cos();
    let range_km = half - (half * half - r * r + RADIUS_KM * RADIUS_KM).sqrt();
    Scene {
        satellite_km,
        velocity_km_s: Vector::new(0.0, 0.0, 7.6),
        observer_km: satellite_km + toward(off_nadir_rad) * range_km,
        sun_km: satellite_km + toward(off_nadir_rad + phase_rad) * 1.496e8,
        moon_km: Vector::new(0.0, 0.0, -3.844e5),
        sidereal_rad: 0.0,
    }
}

#[test]
fn new_passes_lie_within_the_predictive_error_of_a_fit_as_often_as_it_says() {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let (normal, student) = (Normal::new(0.0, 1.0).unwrap(), StudentT::new(4.0).unwrap());
    let (mut within, mut n, mut parameters) = ([0, 0], 0, 0.0);
    // few passes: the parameters are as uncertain as the satellite is variable
    for (seed, n_passes) in (0..60).map(|k| (9000 + k, if k % 2 == 0 { 8 } else { 40 })) {
        let rows = passes(n_passes, seed, |o, _| law(&TRUE_LAW, o.phase_deg));
        let problem = phase_law(&rows, [2, 0], &[]).unwrap();
        let entry = fitted_phase_law("mine", &problem, &rows, "t.csv");
        let [low, high] = entry.fit.as_ref().unwrap().phase_deg;
        let scatter_mag = entry.scatter_mag.unwrap();
        let satellite = Satellite::try_from(&entry).unwrap();
        let model = Model::new(&satellite, &ModelSettings { moon: false, ..ModelSettings::default() }).unwrap();
        for _ in 0..5 {
            let phase_deg: f64 = rng.random_range(low..high);
            let at = scene(rng.random_range(450.0..600.0), rng.random_range(0.6..1.0), phase_deg.to_radians());
            let answer = model.brightness(&at).unwrap();
            let pred_err_mag = answer.v_pred_err_mag.unwrap();
            assert!(pred_err_mag > scatter_mag);
            parameters += (pred_err_mag.powi(2) - scatter_mag.powi(2)).sqrt() / 300.0;
            let noise = BETWEEN_MAG * normal.sample(&mut rng) + WITHIN_MAG * student.sample(&mut rng);
            let range_km = at.range_km();
            // the law is that of the Sun at 1 au
            let truth = law(&TRUE_LAW, phase_deg) + 5.0 * (range_km / 1000.0f64).log10();
            let observed = truth + noise + ERR_MAG * normal.sample(&mut rng);
            let z = (observed - answer.total_v_mag.unwrap()).abs() / pred_err_mag.hypot(ERR_MAG);
            for (count, limit) in within.iter_mut().zip([1.0, 1.96]) {
                *count += usize::from(z <= limit);
            }
            n += 1;
        }
    }
    let share = within.map(|w| w as f64 / n as f64);
    eprintln!("{n} new passes: {share:?}; the parameters' part is {parameters:.3} mag");
    assert_eq!(n, 300);
    assert!((0.62..=0.74).contains(&share[0]) && share[1] >= 0.90, "{share:?}");
    assert!(parameters > 0.1, "the parameters were of no weight: {parameters}");
}

#[test]
fn errors_of_scales_enter_by_the_light_of_their_surfaces() {
    let text = |scales: [f64; 2]| {
        format!(
            "[[satellites]]\nname = \"two\"\nscatter_mag = 0.3\nsurfaces = [\n{}]\n[satellites.fit]\ntable = \"t\"\nn = 9\n\
             n_limits = 0\nn_passes = 3\ndates_utc = [\"\", \"\"]\nphase_deg = [30.0, 120.0]\nrange_km = [500.0, 1500.0]\n\
             within_mag = 0.1\nbetween_mag = 0.2\nparameters = [\"ln scale of a\", \"ln scale of b\"]\nvalues = [0.0, 0.0]\n\
             covariance = [[0.04, -0.03], [-0.03, 0.09]]\n",
            ["a", "b"]
                .iter()
                .zip(scales)
                .zip([("nadir", 0.2), ("sun", 0.6)])
                .map(|((name, scale), (attitude, albedo))| format!(
                    "{{ name = \"{name}\", area_m2 = {}, attitude = \"{attitude}\", brdf = {{ kind = \"lambert\", albedo = {albedo} }} }},\n",
                    10.0 * scale
                ))
                .collect::<String>()
        )
    };
    let d = tempfile::tempdir().unwrap();
    let model = |scales: [f64; 2]| {
        let path = d.path().join("two.toml");
        std::fs::write(&path, text(scales)).unwrap();
        let catalogue = Catalogue::load(Some(&path)).unwrap();
        let satellite = Satellite::try_from(catalogue.find("two").unwrap()).unwrap();
        Model::new(&satellite, &ModelSettings::default()).unwrap()
    };
    let at = scene(550.0, 0.8, 1.0);
    let v_mag = |scales: [f64; 2]| model(scales).brightness(&at).unwrap().total_v_mag.unwrap();
    let step = 1e-3f64;
    let slope = |k: usize| {
        let scales = |sign: f64| [0, 1].map(|j| if j == k { (sign * step).exp() } else { 1.0 });
        (v_mag(scales(1.0)) - v_mag(scales(-1.0))) / (2.0 * step)
    };
    let (a, b) = (slope(0), slope(1));
    assert!(a < -0.01 && b < -0.01, "both send light: {a} {b}");
    let expected = (0.09 + a * a * 0.04 - 2.0 * a * b * 0.03 + b * b * 0.09).sqrt();
    let found = model([1.0, 1.0]).brightness(&at).unwrap().v_pred_err_mag.unwrap();
    assert!((found - expected).abs() < 1e-4, "{found} {expected}");
    // without light, and of surfaces that were never compared, there is none
    let dark = Scene { sun_km: at.satellite_km * -2e4, ..at };
    let answer = model([1.0, 1.0]).brightness(&dark).unwrap();
    assert_eq!(answer.total_v_mag.is_some(), answer.v_pred_err_mag.is_some());
    let plate = Satellite::of("plate", Satellite::named("iss").unwrap().surfaces);
    let plain = Model::new(&plate, &ModelSettings::default()).unwrap().brightness(&at).unwrap();
    assert!(plain.total_v_mag.is_some() && plain.v_pred_err_mag.is_none());
}

#[test]
fn a_map_states_the_predictive_error_wherever_there_is_light() {
    let d = tempfile::tempdir().unwrap();
    let column = |name: &str| -> Vec<f64> {
        let sky =
            ["predict", "sky", "--satellite", "starlink-v2-mini-phase", "--height-km", "550", "--sun-alt-deg", "-12"];
        let rest = ["--sun-az-deg", "250", "--grid", "4x6", "-o", "sky.ecsv"];
        std::fs::remove_file(d.path().join("sky.ecsv")).ok();
        satphot(d.path(), &[&sky[..], &rest[..]].concat()).expect(0, &[]);
        let text = std::fs::read_to_string(d.path().join("sky.ecsv")).unwrap();
        let mut lines = text.lines().filter(|l| !l.starts_with('#'));
        let head: Vec<&str> = lines.next().unwrap().split([',', ' ']).collect();
        let at = head.iter().position(|h| *h == name).unwrap_or_else(|| panic!("no {name} in {head:?}"));
        lines.map(|l| l.split([',', ' ']).nth(at).unwrap().trim_matches('"').parse().unwrap_or(f64::NAN)).collect()
    };
    let exo = column("v_pred_err_mag");
    let lit: Vec<f64> = exo.iter().copied().filter(|e| e.is_finite()).collect();
    assert!(lit.len() > 5 && lit.iter().all(|e| (0.2..1.0).contains(e)), "{exo:?}");
    let magnitudes = column("model_v_mag");
    assert!(exo.iter().zip(&magnitudes).all(|(e, v)| e.is_nan() == v.is_nan()), "{exo:?} {magnitudes:?}");
}
