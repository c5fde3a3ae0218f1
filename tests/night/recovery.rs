//! Injection and recovery: what the simulator puts in, the pipeline must find again.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::collections::HashMap;
use std::path::Path;

use satphot::base::progress::Silent;
use satphot::config::Config;
use satphot::pipeline::options::Options;
use satphot::pipeline::products::summary::Summary;
use satphot::pipeline::run::run;
use satphot::simulate::{Scenario, simulate};
use satphot::tables::{PhotometryRow, StarRow, read_photometry, read_stars};

/// The night of the issue: 20 pointings and 60 target frames at the gain settings 200, 250 and 300 in turn.
const NIGHT: [&str; 9] = [
    "frame.nx_px=640",
    "frame.ny_px=480",
    "photometry.clip_radius_px=400.0",
    "photometry.mesh_px=64",
    "pointings.n=20",
    "pointings.frames=10",
    "target.n=60",
    "field.stars_per_deg2=500.0",
    "field.v_range_mag=[10.5, 14.5]",
];

fn settings(extra: &[&str]) -> Vec<String> {
    NIGHT.iter().chain(extra).map(|s| (*s).to_string()).collect()
}

fn truth(folder: &Path, table: &str) -> Vec<HashMap<String, String>> {
    let mut reader = csv::Reader::from_path(folder.join("truth").join(table)).unwrap();
    reader.deserialize().map(Result::unwrap).collect()
}

fn number(row: &HashMap<String, String>, key: &str) -> f64 {
    row[key].parse().unwrap()
}

/// Pulls of the star fluxes, (measured − total flux · enclosed fraction) / error, of the rows without a flag.
fn pulls(folder: &Path, rows: &[StarRow]) -> Vec<f64> {
    let truth: HashMap<(String, String), HashMap<String, String>> = truth(folder, "stars.csv")
        .into_iter()
        .map(|row| ((row["frame"].clone(), row["star_id"].clone()), row))
        .collect();
    rows.iter()
        .filter(|r| r.flags == 0)
        .map(|r| {
            let t = &truth[&(r.frame.clone(), r.star_id.clone())];
            // Gaussian: 1 − exp(−r²/2σ²)
            let sigma = number(t, "fwhm_px") / 2.354_820_045;
            let enclosed = 1.0 - (-0.5 * (r.aper_r_px.unwrap() / sigma).powi(2)).exp();
            (r.flux_e.unwrap() - number(t, "flux_e") * enclosed) / r.flux_err_e.unwrap()
        })
        .collect()
}

fn mean_and_sd(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    (mean, (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt())
}

fn reduce(folder: &Path, sets: &[&str], out: &str) -> (Summary, Vec<StarRow>, Vec<PhotometryRow>) {
    let sets: Vec<String> = sets.iter().map(|s| (*s).to_string()).collect();
    let mut config = Config::load(&folder.join("pipeline.toml"), &sets).unwrap();
    config.night.output = folder.join("satphot-out").join(out);
    let options = Options { no_figures: true, ..Options::default() };
    let summary = run(&config, &options, &Silent).unwrap();
    let stars = read_stars(&summary.folder.join("stars.ecsv")).unwrap().0;
    let rows = read_photometry(&summary.folder.join("photometry.ecsv")).unwrap().0;
    (summary, stars, rows)
}

#[test]
fn fluxes_zeropoint_and_magnitudes_of_a_mixed_gain_night_are_recovered() {
    let folder = tempfile::tempdir().unwrap();
    let scenario = Scenario::crowded_night(&settings(&["target.scatter_mag=0.0"])).unwrap();
    simulate(&scenario, folder.path(), &Silent).unwrap();

    // every frame by itself: thousands of star measurements
    let (_, singles, _) = reduce(folder.path(), &["stars.combine=none"], "none");
    let single_pulls = pulls(folder.path(), &singles);
    let (mean, sd) = mean_and_sd(&single_pulls);
    let n = single_pulls.len();
    println!("single: N {n}, mean pull {mean:+.4}, sd {sd:.4}");
    assert!(n >= 3000, "{n} star measurements without flags");
    assert!(mean.abs() < 3.0 / (n as f64).sqrt(), "mean pull {mean}");
    assert!((sd - 1.0).abs() < 0.05, "sd of the pulls {sd}");

    // combined: the error is that of a median
    let (summary, combined, rows) = reduce(folder.path(), &[], "median");
    let combined_pulls = pulls(folder.path(), &combined);
    let (mean, sd) = mean_and_sd(&combined_pulls);
    let n = combined_pulls.len() as f64;
    println!("combined: N {n}, mean pull {mean:+.4}, sd {sd:.4}");
    assert!(mean.abs() < 3.0 / n.sqrt(), "mean pull of combined stars {mean}");
    // 3 standard errors of a standard deviation
    assert!((sd - 1.0).abs() < 3.0 / (2.0 * n).sqrt(), "sd of the combined pulls {sd}");

    // ZP, k, C within 3 sigma of truth
    let z = summary.zeropoint.unwrap();
    let p = &scenario.photometric;
    let found = [z.zp_mag, z.k_mag_airmass, z.c_mag_mag];
    for (i, truth) in [p.zp_mag, p.k_mag_airmass, p.c_mag_mag].into_iter().enumerate() {
        let err = z.cov[i][i].sqrt();
        println!("term {i}: {:.4} +- {err:.4}, truth {truth}", found[i]);
        assert!((found[i] - truth).abs() < 3.0 * err, "term {i}: {} +- {err}, truth {truth}", found[i]);
    }

    // one zeropoint for all gains: the residuals of the single measurements agree between the settings
    let residuals_at = |setting: i64| -> Vec<f64> {
        let at = singles.iter().filter(|r| r.gain_setting == Some(setting) && r.status == "ok");
        at.filter_map(|r| Some(r.fit_residual_mag? / r.inst_mag_err?.hypot(0.01))).collect()
    };
    for setting in [200, 250, 300] {
        let values = residuals_at(setting);
        let (mean, _) = mean_and_sd(&values);
        println!("gain {setting}: N {}, mean residual {mean:+.4} sigma", values.len());
        // members of one star share the catalogue's error, so N/10 are independent
        assert!(mean.abs() < 4.0 / (values.len() as f64 / 10.0).sqrt(), "gain {setting}: {mean}");
    }

    // the target: magnitudes come back where the verdict says so
    let truth: HashMap<String, f64> = truth(folder.path(), "target.csv")
        .into_iter()
        .filter(|r| !r["v_mag"].is_empty())
        .map(|r| (r["frame"].clone(), number(&r, "v_mag")))
        .collect();
    let errors: Vec<f64> = rows
        .iter()
        .filter(|r| r.status == "ok" && r.verdict != "reject")
        .map(|r| r.v_mag.unwrap() - truth[&r.frame])
        .collect();
    let (median, sigma) = satphot::base::stats::robust(&errors).unwrap();
    println!("target: {} of 60 frames, median V error {median:+.3}, robust sigma {sigma:.3}", errors.len());
    // trails cross nearly every frame: the verdict keeps back those they outshine
    let detected = rows.iter().filter(|r| r.status == "ok").count();
    assert!(detected >= 55, "only {detected} of 60 target frames detected");
    assert!(errors.len() >= 54, "only {} of 60 target frames usable", errors.len());
    assert!(median.abs() < 0.03, "median error of V {median}");
    assert!(sigma < 0.08, "scatter of V {sigma}");
}

#[test]
fn the_same_seed_gives_the_same_bytes_on_any_number_of_threads() {
    let sets: Vec<String> =
        ["pointings.n=1", "pointings.frames=2", "target.n=2", "flats.n=3"].iter().map(|s| (*s).to_string()).collect();
    let scenario = Scenario::crowded_night(&sets).unwrap();
    let bytes = |threads: usize| -> Vec<(String, Vec<u8>)> {
        let folder = tempfile::tempdir().unwrap();
        let made = satphot::base::threads::with_threads(threads, || simulate(&scenario, folder.path(), &Silent));
        let mut files = made.unwrap().unwrap().frames;
        files.push(folder.path().join("truth/stars.csv"));
        files.push(folder.path().join("truth/target.csv"));
        let name = |p: &Path| p.file_name().unwrap().to_string_lossy().into_owned();
        files.iter().map(|p| (name(p), std::fs::read(p).unwrap())).collect()
    };
    assert_eq!(bytes(1), bytes(2));
}
