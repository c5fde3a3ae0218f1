//! What is read of a night and how: a target's window gives the same as its whole frame; threads, memory and files
//! that vanish change no other row.
#![allow(clippy::unwrap_used)]

use crate::support;

use std::path::PathBuf;
use std::sync::OnceLock;

use satphot::base::error::Error;
use satphot::base::progress::Progress;
use satphot::config::Config;
use satphot::frames::flat::{BAND_BYTES, MasterFlat};
use satphot::photometry::background::background;
use satphot::photometry::target::measure::measure_target;
use satphot::pipeline::prepared::{Calibrated, Flattened, Prepared, Seeing};
use satphot::pipeline::run::run;
use satphot::pipeline::survey::read::survey;
use satphot::pipeline::target::frame::target_settings;
use satphot::pipeline::target::window::{measure_in_window, reach_px};
use support::{Night, TARGETS, simulated};

fn original() -> &'static PathBuf {
    static NIGHT: OnceLock<PathBuf> = OnceLock::new();
    NIGHT.get_or_init(|| simulated("night_reading", &[]))
}

fn night() -> Night {
    Night::copy_of(original())
}

#[test]
fn the_surroundings_of_a_target_tell_the_same_as_its_whole_frame() {
    let large = simulated("night_reading_large", &["frame.nx_px=900", "frame.ny_px=700", "target.n=4"]);
    // the place in the middle, near the edge of the circle, and outside of it, where the whole frame must be read; then boxes of which
    // every fourth row counts for the corner ratio
    let outside = Some([60.0, 60.0]);
    for (circle, place, mesh_px) in
        [(400.0, None, 64), (320.0, Some([350.0, 200.0]), 64), (320.0, outside, 64), (400.0, None, 10)]
    {
        let mut sets = vec![
            format!("photometry.clip_radius_px={circle}"),
            format!("photometry.mesh_px={mesh_px}"),
            "target.search_radius_arcsec=45".to_string(),
        ];
        if let Some([x, y]) = place {
            sets.extend([format!("target.x_px={x}"), format!("target.y_px={y}")]);
        }
        let config = Config::load(&large.join("pipeline.toml"), &sets).unwrap();
        let prepared = Prepared::prepare(&config).unwrap();
        let survey = survey(&config, &[], &prepared.target_names()).unwrap();
        let flat = Some(
            MasterFlat::make(
                &survey.flats,
                &prepared.detector,
                &config.flat,
                config.photometry.clip_radius_px,
                BAND_BYTES,
            )
            .unwrap(),
        );
        assert_eq!(survey.targets.len(), 4);
        let flattened =
            Flattened { prepared, flat, flat_sha256: String::new(), zero: Default::default(), hot: Vec::new() };
        let night = Calibrated { flattened, seeing: Seeing::default(), zeropoint: None };
        for exposure in &survey.targets {
            let settings = target_settings(exposure, &night, None);
            assert!(reach_px(&settings) < 300.0, "a part of the frame is enough: {}", reach_px(&settings));
            let seen = measure_in_window(&night.open(exposure).unwrap(), &night, &settings, None).unwrap();
            let p = &config.photometry;
            let frame = night.reduce(exposure).unwrap();
            let sky = background(&frame, p.mesh_px, p.clip_sigma).unwrap();
            // NaN is NaN: the text of both
            assert_eq!(format!("{:?}", seen.found), format!("{:?}", measure_target(&frame, &sky, &settings)));
            assert_eq!(seen.corner_ratio, sky.corner_ratio());
            assert!(seen.corner_ratio.is_some());
        }
    }
}

#[test]
fn tables_are_the_same_bytes_for_any_threads_and_any_memory() {
    let mut n = night();
    let least = {
        n.options.max_memory_bytes = Some(1);
        let (_, message) = n.refusal();
        let text = message.split("at least ").nth(1).unwrap().split("MB").next().unwrap().to_string();
        text.parse::<usize>().unwrap() * 1_000_000
    };
    let mut seen = Vec::new();
    for (jobs, memory) in
        [(1, None), (2, None), (3, Some(least)), (2, Some(least + 3_000_000)), (2, Some(4_000_000_000))]
    {
        n.options.jobs = jobs;
        n.options.max_memory_bytes = memory;
        n.run().unwrap();
        let names = ["photometry.ecsv", "stars.ecsv", "residuals.ecsv", "zeropoint.toml", "master_flat.fits"];
        seen.push(names.map(|name| std::fs::read(n.result(name)).unwrap()));
    }
    assert!(seen.iter().all(|s| *s == seen[0]));
}

#[test]
fn a_limit_too_small_for_one_frame_is_refused_with_the_least_that_works() {
    let mut n = night();
    n.options.max_memory_bytes = Some(20_000_000);
    let (code, message) = n.refusal();
    assert_eq!(code, 2, "{message}");
    for word in ["`max_memory`", "20 MB", "at least", "MB is needed", "clip_radius_px"] {
        assert!(message.contains(word), "\"{word}\" is not in: {message}");
    }
}

/// Damages files when the target stage begins: after they were surveyed.
struct Saboteur {
    gone: PathBuf,
    cut: PathBuf,
}

impl Progress for Saboteur {
    fn stage(&self, name: &str, _: usize) {
        if name == "target frames" {
            std::fs::remove_file(&self.gone).unwrap();
            let bytes = std::fs::read(&self.cut).unwrap();
            std::fs::write(&self.cut, &bytes[..bytes.len() / 2]).unwrap();
        }
    }
    fn tick(&self) {}
    fn done(&self) {}
    fn elapsed_s(&self) -> f64 {
        0.0
    }
}

#[test]
fn files_that_vanish_or_shrink_during_the_night_cost_a_row_each() -> Result<(), Error> {
    let whole = night().set("night.max_failed_frac=0.5");
    whole.run()?;
    let n = night().set("night.max_failed_frac=0.5");
    let saboteur = Saboteur { gone: n.path(TARGETS[1]), cut: n.path(TARGETS[3]) };
    run(&n.config()?, &n.options, &saboteur)?;
    for frame in TARGETS {
        let row = n.row(frame);
        if frame == TARGETS[1] || frame == TARGETS[3] {
            assert_eq!((row.status.as_str(), row.verdict.as_str()), ("failed", "reject"), "{}", row.reason);
            assert!(row.reason.contains(frame), "{}", row.reason);
        } else {
            let other = whole.row(frame);
            assert_eq!(
                (row.flux_e, row.v_mag, row.sky_corner_ratio),
                (other.flux_e, other.v_mag, other.sky_corner_ratio)
            );
        }
    }
    Ok(())
}

/// Packs a file as a whole and takes the plain one away; returns the packed one.
fn packed(path: &std::path::Path, ending: &str) -> std::path::PathBuf {
    use std::io::Write as _;
    let bytes = std::fs::read(path).unwrap();
    let out = std::path::PathBuf::from(format!("{}.{ending}", path.display()));
    let file = std::fs::File::create(&out).unwrap();
    if ending == "gz" {
        let mut encoder = flate2::write::GzEncoder::new(file, flate2::Compression::fast());
        encoder.write_all(&bytes).unwrap();
        encoder.finish().unwrap();
    } else {
        let mut encoder = bzip2::write::BzEncoder::new(file, bzip2::Compression::fast());
        encoder.write_all(&bytes).unwrap();
        encoder.finish().unwrap();
    }
    std::fs::remove_file(path).unwrap();
    out
}

#[test]
fn frames_packed_with_gzip_and_bzip2_give_the_same_numbers_and_a_cut_one_is_a_row() {
    let plain = Night::copy_of(&simulated("packed", &[]));
    plain.run().unwrap();
    let night = Night::copy_of(&simulated("packed-twin", &[]));
    for (k, path) in ["flat", "field", "target"].iter().flat_map(|kind| night.frames(kind)).enumerate() {
        packed(&path, if k % 2 == 0 { "gz" } else { "bz2" });
    }
    let summary = night.run().unwrap();
    assert_eq!(summary.counts.unreadable, 0, "{}", summary.brief());
    let numbers = |n: &Night| -> Vec<(String, Option<f64>, Option<f64>)> {
        let stem = |frame: &str| frame.split('.').next().unwrap().to_owned();
        n.rows().iter().map(|r| (stem(&r.frame), r.v_mag, r.v_mag_err)).collect()
    };
    assert_eq!(numbers(&night), numbers(&plain));
    // one that was cut off while it was copied
    let all: Vec<_> = std::fs::read_dir(night.path(".")).unwrap().map(|e| e.unwrap().path()).collect();
    let one = all.iter().find(|p| p.to_string_lossy().contains("target_0001")).unwrap();
    let bytes = std::fs::read(one).unwrap();
    std::fs::write(one, &bytes[..bytes.len() / 2]).unwrap();
    let summary = night.run().unwrap();
    assert_eq!(summary.counts.unreadable, 1, "{}", summary.brief());
    let row = night.rows().into_iter().find(|r| r.frame.contains("target_0001")).unwrap();
    assert!(row.reason.contains("stream is damaged or cut off"), "{}", row.reason);
}
