//! One stage of the work on full-size frames, measured: what scripts/bench_peers.sh runs with the peers.
//!
//! `cargo bench --bench full_size -- STAGE FOLDER [full|circle]`, FOLDER a night of `satphot simulate` with its
//! pipeline.toml and a master flat at FOLDER/master_{full,circle}.fits; `-- combine FOLDER level|none full|circle` makes one.
//! Prints one line of JSON: CPU seconds (user and system) of one unit of work, wall seconds, peak memory of the process. One
//! thread. Repeats until two seconds of CPU are spent, so that the system's hundredths of a second do not matter; the first
//! round is not counted.
#![allow(clippy::unwrap_used)]

use std::path::Path;
use std::time::Instant;

use satphot::config::{self, Config};
use satphot::frames::flat::{BAND_BYTES, MasterFlat};
use satphot::frames::{Electrons, Exposure, Frame};
use satphot::photometry::aperture::Shape;
use satphot::photometry::background::{Background, background};
use satphot::photometry::detect::detect;
use satphot::photometry::flux::measure_all;
use satphot::photometry::growth::StarWidth;
use satphot::pipeline::prepared::{Calibrated, Flattened, Prepared, Seeing};
use satphot::pipeline::products::manifest::peak_memory_mb;
use satphot::pipeline::survey::read::survey;
use satphot::pipeline::target::frame::measure_frame;
use satphot::pipeline::target::window::Region;

/// Least CPU time of a measurement \[s\].
const LEAST_CPU_S: f64 = 2.0;

/// User and system time of this process \[s\], in hundredths: fields 14 and 15 of /proc/self/stat.
fn cpu_s() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap();
    let after_name = stat.rsplit(')').next().unwrap();
    let ticks: f64 = after_name.split_whitespace().skip(11).take(2).map(|t| t.parse::<f64>().unwrap()).sum();
    ticks / 100.0
}

/// Runs `work` on one piece after another until enough time is spent; prints the mean of one piece.
fn measured<T>(stage: &str, pieces: &[T], mut work: impl FnMut(&T) -> usize) {
    let found = pieces.first().map_or(0, &mut work);
    let (cpu, wall) = (cpu_s(), Instant::now());
    let mut n = 0.0;
    while cpu_s() - cpu < LEAST_CPU_S {
        for piece in pieces {
            work(piece);
            n += 1.0;
        }
    }
    println!(
        r#"{{"stage":"{stage}","cpu":{:.5},"wall":{:.5},"n":{n},"rss_mb":{:.0},"found":{found}}}"#,
        (cpu_s() - cpu) / n,
        wall.elapsed().as_secs_f64() / n,
        peak_memory_mb().unwrap_or(0.0)
    );
}

/// 2000 places spread evenly over the frame, `margin_px` from its edges: Kronecker's sequence of the plastic number
/// (the peers' script uses the same).
fn places((nx, ny): (usize, usize), margin_px: f64) -> Vec<(f64, f64)> {
    let plastic = 1.324_717_957_244_746;
    let place = |k: usize, n: usize, power: i32| {
        margin_px + (n as f64 - 1.0 - 2.0 * margin_px) * (0.5 + k as f64 / f64::powi(plastic, power)).fract()
    };
    (0..2000).map(|k| (place(k, nx, 1), place(k, ny, 2))).collect()
}

fn fluxes(frame: &Frame<Electrons>, sky: &Background, places: &[(f64, f64)]) -> usize {
    let fluxes = measure_all(frame, sky, places, Shape::Circle { r_px: 20.0 }, (30.0, 40.0), 3.0, &[]);
    fluxes.iter().filter(|f| f.flux_e.is_finite()).count()
}

/// Where the target of a frame is looked for if the places of its pilots scatter by a pixel.
fn region(night: &Calibrated, exposure: &Exposure) -> Option<Region> {
    let frame = measure_frame(exposure, None, night);
    let measured = frame.measured?.ok()?.measured;
    let (a_px, ..) = measured.flux.shape.axes();
    let radius_px = 0.5 * a_px + 2.0 * measured.fwhm_px? + 5.0;
    Some(Region {
        x_px: measured.x_px + 2.0,
        y_px: measured.y_px - 2.0,
        radius_px,
        aper_px: a_px,
        bound_px: a_px,
        disc2: None,
    })
}

/// The master flat alone: `satphot flat` without the hashes of its files and without writing.
fn combine(config: &Config, prepared: &Prepared, rest: &[String]) {
    let [scale, part] = rest else { return println!("combine FOLDER level|none full|circle") };
    let scale = if scale == "none" { config::FlatScale::None } else { config::FlatScale::Level };
    let flat = config::Flat { scale, ..config.flat.clone() };
    let clip = config.photometry.clip_radius_px.filter(|_| part == "circle");
    let survey = survey(config, &[], &prepared.target_names()).unwrap();
    measured(&format!("combine {part}"), &[()], |()| {
        let master = MasterFlat::make(&survey.flats, &prepared.detector, &flat, clip, BAND_BYTES);
        master.unwrap().members.len()
    });
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let [stage, folder, rest @ ..] = arguments.as_slice() else {
        // `cargo bench` without arguments runs every bench: there is nothing to measure without frames
        println!("usage: cargo bench --bench full_size -- STAGE FOLDER [full|circle]; see scripts/bench_peers.sh");
        return;
    };
    let part = rest.first().map_or("circle", String::as_str);
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global().unwrap();
    let mut config = Config::load(&Path::new(folder).join("pipeline.toml"), &[]).unwrap();
    config.photometry.mesh_px = 64;
    if part == "full" {
        config.photometry.clip_radius_px = None;
    }
    let prepared = Prepared::prepare(&config).unwrap();
    if stage == "combine" {
        return combine(&config, &prepared, rest);
    }
    let survey = survey(&config, &[], &prepared.target_names()).unwrap();
    let master = Path::new(folder).join(format!("master_{part}.fits"));
    let flat = Some(MasterFlat::read(&master, config.photometry.clip_radius_px, &config.flat).unwrap());
    let flattened = Flattened { prepared, flat, flat_sha256: String::new(), zero: Default::default(), hot: Vec::new() };
    // what star pointings would have given
    let width = StarWidth { fwhm_arcsec: 2.0, airmass: None, exponent: 0.0, scatter: 0.0, frames: (0.0, None) };
    let seeing = Seeing { width: Some(width), ..Seeing::default() };
    let night = Calibrated { flattened, seeing, zeropoint: None };
    let stars = &survey.pointings[0];
    let name = format!("{stage} {part}");
    let chain = |frame: &Frame<Electrons>| {
        let sky = background(frame, 64, 3.0).unwrap();
        let sources = detect(frame, &sky, 5.0, Some(10.0));
        let places: Vec<(f64, f64)> = sources.iter().map(|s| (s.x_px, s.y_px)).collect();
        fluxes(frame, &sky, &places)
    };
    match stage.as_str() {
        "read" => measured(&name, stars, |e| night.reduce(e).unwrap().pixels.len()),
        "frame" => measured(&name, stars, |e| chain(&night.reduce(e).unwrap())),
        "target" => measured(&name, &survey.targets, |e| {
            usize::from(matches!(measure_frame(e, None, &night).measured, Some(Ok(_))))
        }),
        // between the pilots of its pass, which stand a few pixels from where they are expected
        "followed" => {
            let of = |e| Some((e, region(&night, e)?));
            let is_there = |(e, at): &(&Exposure, Region)| {
                let seen = measure_frame(e, Some(at), &night).measured;
                matches!(seen, Some(Ok(m)) if m.measured.search_radius_px == at.radius_px)
            };
            let frames: Vec<_> = survey.targets.iter().filter_map(of).filter(is_there).collect();
            measured(&name, &frames, |(e, at)| {
                usize::from(matches!(measure_frame(e, Some(at), &night).measured, Some(Ok(_))))
            });
        }
        "background" | "detect" | "apertures" => {
            let frame = night.reduce(&stars[0]).unwrap();
            let sky = background(&frame, 64, 3.0).unwrap();
            let places = places(frame.full_size_px, 60.0);
            measured(&name, &[()], |()| match stage.as_str() {
                "background" => usize::from(background(&frame, 64, 3.0).is_ok()),
                "detect" => detect(&frame, &sky, 5.0, Some(10.0)).len(),
                _ => fluxes(&frame, &sky, &places),
            });
        }
        other => {
            println!("no stage {other}: combine, read, background, detect, apertures, frame, target, followed")
        }
    }
}
