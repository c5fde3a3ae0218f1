//! The night of the README: small, reproducible, and reduced by the top-level pipeline.toml.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::path::{Path, PathBuf};

use satphot::base::progress::Silent;
use satphot::config::Config;
use satphot::photometry::Flags;
use satphot::pipeline::options::Options;
use satphot::pipeline::products::summary::Summary;
use satphot::pipeline::run::run;
use satphot::simulate::{Scenario, simulate};
use satphot::tables::read_photometry;

const ROOT: &str = env!("CARGO_MANIFEST_DIR");

fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() { found.extend(files(&path)) } else { found.push(path) }
    }
    found.sort();
    found
}

#[test]
fn the_fixture_is_what_simulate_draws_and_fits_into_8_megabytes() {
    let fixture = Path::new(ROOT).join("fixtures/night");
    let bytes: u64 = files(&Path::new(ROOT).join("fixtures")).iter().map(|p| p.metadata().unwrap().len()).sum();
    assert!(bytes <= 8_000_000, "{bytes} bytes in fixtures/");
    let folder = tempfile::tempdir().unwrap();
    simulate(&Scenario::demo_night(&[]).unwrap(), folder.path(), &Silent).unwrap();
    let drawn = files(folder.path());
    let kept = files(&fixture);
    let names = |list: &[PathBuf], base: &Path| -> Vec<PathBuf> {
        list.iter().map(|p| p.strip_prefix(base).unwrap().to_path_buf()).collect()
    };
    assert_eq!(names(&drawn, folder.path()), names(&kept, &fixture));
    // the pixels come from exp, ln and erf, which may differ in the last place between systems: a count or two
    // in a frame, never more; the tables of truth agree to the figures they hold
    for (a, b) in drawn.iter().zip(&kept).filter(|(a, _)| a.extension().is_some_and(|e| e == "fits")) {
        let (a, b) = (std::fs::read(a).unwrap(), std::fs::read(b).unwrap());
        assert_eq!(a.len(), b.len());
        let different = a.iter().zip(&b).filter(|(x, y)| x != y).count();
        assert!(different <= a.len() / 1000, "{different} of {} bytes differ", a.len());
    }
}

#[test]
fn the_top_level_pipeline_reduces_the_fixture_and_finds_the_simulated_zeropoint() {
    let mut config = Config::load(&Path::new(ROOT).join("pipeline.toml"), &[]).unwrap();
    let folder = tempfile::tempdir().unwrap();
    config.night.output = folder.path().to_path_buf();
    let summary = run(&config, &Options::default(), &Silent).unwrap();
    assert!(summary.poor_error().is_none(), "{:?}", summary.poor);
    assert_eq!((summary.counts.flats, summary.counts.stars, summary.counts.targets), (5, 15, 24));
    assert!(summary.counts.ok >= 22, "{:?}", summary.counts);
    finds_the_zeropoint(&summary);
    let out = folder.path().join("2025-06-13");
    let (residuals, _) = read_photometry(&out.join("photometry.ecsv")).unwrap();
    let used: Vec<_> = residuals.iter().filter(|r| r.verdict == "use").collect();
    assert!(used.len() >= 22 && residuals.iter().any(|r| Flags(r.flags).has(Flags::CONTAMINATED)));
    let lights: std::collections::BTreeSet<_> = used.iter().map(|r| r.illum.as_str()).collect();
    assert!(["sun", "penumbra", "lunar_earthshine"].iter().all(|l| lights.contains(l)), "{lights:?}");
    // the drawn magnitudes scatter by 0.05 mag about the model
    for row in used {
        let (residual, err) = (row.residual_mag.unwrap(), row.v_mag_err.unwrap().hypot(0.05));
        assert!(residual.abs() < 3.5 * err, "{}: {residual} +- {err}", row.frame);
    }
    for name in [
        "photometry.ecsv",
        "residuals.ecsv",
        "stars.ecsv",
        "zeropoint.toml",
        "master_flat.fits",
        "effective.toml",
        "manifest.json",
        "satphot.log",
        "figures/light_curve.svg",
        "figures/residuals_altitude.svg",
        "figures/zeropoint.svg",
        "figures/sky.svg",
        "figures/distribution.svg",
        "figures/phase.svg",
    ] {
        assert!(out.join(name).metadata().is_ok_and(|m| m.len() > 0), "{name} is missing or empty");
    }
    // the configuration in force reads back
    Config::load(&out.join("effective.toml"), &[]).unwrap();
}

#[test]
fn in_the_crowded_night_the_contaminated_frames_are_flagged_and_the_zeropoint_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let simulated = simulate(&Scenario::crowded_night(&[]).unwrap(), folder.path(), &Silent).unwrap();
    let config = Config::load(&simulated.pipeline_toml, &[]).unwrap();
    let summary = run(&config, &Options { no_figures: true, ..Options::default() }, &Silent).unwrap();
    finds_the_zeropoint(&summary);
    let (rows, _) = read_photometry(&config.night.output.join("2025-06-09/photometry.ecsv")).unwrap();
    let contaminated = rows.iter().filter(|r| Flags(r.flags).has(Flags::CONTAMINATED)).count();
    assert!(contaminated >= 18 && rows.len() == 24, "{contaminated} of {}", rows.len());
    assert!(rows.iter().filter(|r| r.verdict == "use").all(|r| r.residual_mag.is_none_or(|d| d.abs() < 0.5)));
}

/// ZP, k and C lie within three of their errors of the simulated ones.
fn finds_the_zeropoint(summary: &Summary) {
    let z = summary.zeropoint.as_ref().unwrap();
    for (i, (found, truth)) in
        [(z.zp_mag, -23.37), (z.k_mag_airmass, 0.12), (z.c_mag_mag, 0.08)].into_iter().enumerate()
    {
        assert!((found - truth).abs() < 3.0 * z.cov[i][i].sqrt(), "term {i}: {found}, truth {truth}");
    }
}
