//! Star frames whose world coordinates are absent or wrong: found out, replaced or refused, never silently used.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::path::{Path, PathBuf};

use satphot::astrometry::catalogue::separation_deg;
use satphot::astrometry::wcs::Wcs;
use satphot::base::progress::Silent;
use satphot::config::{Config, Solve};
use satphot::frames::{Exposure, classify};
use satphot::photometry::background::background;
use satphot::photometry::detect::detect;
use satphot::pipeline::options::Options;
use satphot::pipeline::prepared::{Flattened, Prepared};
use satphot::pipeline::run::run;
use satphot::pipeline::stars::solve::{FieldWcs, field_wcs};
use satphot::pipeline::stars::solve_file::FrameSolver;

const NIGHT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/fixtures/night");
const SIZE: (f64, f64) = (300.0, 220.0);

/// Copies a frame with every header card passed through `edit`: `None` drops it. `more` cards come before END.
fn edited(from: &Path, to: &Path, edit: &dyn Fn(&str, f64) -> Option<f64>, more: &[String]) {
    let bytes = std::fs::read(from).unwrap();
    let mut cards: Vec<String> = Vec::new();
    let mut at = 0;
    loop {
        let card = String::from_utf8(bytes[at..at + 80].to_vec()).unwrap();
        at += 80;
        let key = card[..8].trim().to_string();
        if key == "END" {
            break;
        }
        let value = card[10..].split('/').next().unwrap().trim().parse::<f64>();
        match value {
            Ok(value) => match edit(&key, value) {
                Some(new) if new == value => cards.push(card),
                Some(new) => cards.push(format!("{key:<8}= {new:>20.14}")),
                None => {}
            },
            Err(_) if edit(&key, f64::NAN).is_none() => {}
            Err(_) => cards.push(card),
        }
    }
    cards.extend(more.iter().cloned());
    cards.push("END".into());
    let mut out: Vec<u8> = cards.iter().flat_map(|c| format!("{c:<80}").into_bytes()).collect();
    out.resize(out.len().div_ceil(2880) * 2880, b' ');
    out.extend(&bytes[at.div_ceil(2880) * 2880..]);
    std::fs::write(to, out).unwrap();
}

fn is_wcs(key: &str) -> bool {
    ["CTYPE", "CRVAL", "CRPIX", "CD1_", "CD2_", "CUNIT"].iter().any(|k| key.starts_with(k))
}

fn frame_name(k: usize) -> PathBuf {
    Path::new(NIGHT).join(format!("field0{k}_01.fits"))
}

fn wcs_of(exposure: &Exposure) -> Wcs {
    let h = &exposure.header;
    Wcs::from_keys(&|k| h.number(k), &|k| h.text(k)).unwrap().unwrap()
}

/// The header's own coordinates of the fixture: shifted from the truth by what its mount is off, 15 arcsec or so.
fn truth(k: usize, night: &Flattened) -> FieldWcs {
    answer(&frame_name(k), night).unwrap()
}

fn answer(path: &Path, night: &Flattened) -> satphot::base::error::Result<FieldWcs> {
    let exposure = classify(path, &night.config, &[])?;
    let frame = night.reduce(&exposure)?;
    let sky = background(&frame, 32, 3.0)?;
    let sources = detect(&frame, &sky, 5.0, None);
    field_wcs(&exposure, &sources, night, night.catalogue.as_ref().unwrap())
}

fn night(sets: &[&str]) -> Flattened {
    let sets: Vec<String> = sets.iter().map(ToString::to_string).collect();
    let mut config = Config::load(&Path::new(NIGHT).join("pipeline.toml"), &sets).unwrap();
    (config.orbit, config.model) = (None, None);
    let prepared = Prepared::prepare(&config).unwrap();
    Flattened { prepared, flat: None, flat_sha256: String::new(), zero: Default::default(), hot: Default::default() }
}

/// Largest distance of two systems over the corners and the centre \[arcsec\].
fn apart(a: &Wcs, b: &Wcs) -> f64 {
    [(0.0, 0.0), (SIZE.0, 0.0), (0.0, SIZE.1), SIZE, (SIZE.0 / 2.0, SIZE.1 / 2.0)]
        .iter()
        .map(|p| (a.pixel_to_sky(p.0, p.1), b.pixel_to_sky(p.0, p.1)))
        .map(|(a, b)| separation_deg(a.0, a.1, b.0, b.1) * 3600.0)
        .fold(0.0, f64::max)
}

#[test]
fn good_world_coordinates_are_kept_as_they_are() {
    let night = night(&[]);
    for k in 0..5 {
        let found = truth(k, &night);
        assert!(!found.replaced && found.note.is_empty(), "{}", found.note);
        let exposure = classify(&frame_name(k), &night.config, &[]).unwrap();
        assert_eq!(found.wcs.pixel_to_sky(7.0, 9.0), wcs_of(&exposure).pixel_to_sky(7.0, 9.0));
    }
}

#[test]
fn wrong_world_coordinates_are_found_out_and_replaced_by_those_of_the_sky() {
    let night = night(&[]);
    let folder = tempfile::tempdir().unwrap();
    type Edit = fn(&str, f64) -> Option<f64>;
    let edits: [(&str, Edit); 8] = [
        ("declination off by a degree", |k, v| Some(if k == "CRVAL2" { v + 0.999 } else { v })),
        ("flipped in x", |k, v| Some(if k == "CD1_1" { -v } else { v })),
        ("scale five times too large", |k, v| Some(if k.starts_with("CD") { v * 5.0 } else { v })),
        ("scale five times too small", |k, v| Some(if k.starts_with("CD") { v / 5.0 } else { v })),
        ("scale 4 % off", |k, v| Some(if k.starts_with("CD") { v * 1.04 } else { v })),
        ("turned by 180 degrees", |k, v| Some(if k.starts_with("CD") { -v } else { v })),
        ("turned by 90 degrees", |k, v| {
            Some(match k {
                "CD1_1" | "CD2_2" => 0.0,
                "CD1_2" => 4.35e-4,
                "CD2_1" => 4.35e-4,
                _ => v,
            })
        }),
        ("the reference pixel of the frame before it was cropped", |k, v| {
            Some(match k {
                "CRPIX1" => v + 298.0,
                "CRPIX2" => v + 226.0,
                _ => v,
            })
        }),
    ];
    for k in [0, 1, 4] {
        let path = folder.path().join("frame.fits");
        let solved = FrameSolver::from_config(&night.config).unwrap().solve(&frame_name(k)).unwrap().solution;
        // the header's coordinates differ from the sky by what the mount was off, the solution by its error
        assert!(apart(&truth(k, &night).wcs, &solved.wcs) < 60.0);
        for (name, edit) in edits {
            edited(&frame_name(k), &path, &edit, &[]);
            let found = answer(&path, &night).unwrap();
            assert!(found.replaced, "field {k}, {name}: kept");
            assert!(apart(&found.wcs, &solved.wcs) < 0.5, "field {k}, {name}: {}", apart(&found.wcs, &solved.wcs));
            assert!(found.note.contains("replaced") && found.note.contains("rms"), "{}", found.note);
        }
    }
}

#[test]
fn a_header_without_world_coordinates_is_solved_from_any_initial_pointing() {
    let night = night(&[]);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("frame.fits");
    let strip = |key: &str, v: f64| (!is_wcs(key)).then_some(v);
    let good = wcs_of(&classify(&frame_name(2), &night.config, &[]).unwrap());
    let (ra, dec) = good.pixel_to_sky(150.0, 110.0);
    let sexagesimal = |v: f64| {
        let (whole, minutes) = (v.abs().trunc(), v.abs().fract() * 60.0);
        format!("{}{whole:02} {:02} {:05.2}", if v < 0.0 { "-" } else { "+" }, minutes.trunc(), minutes.fract() * 60.0)
    };
    let text = |k: &str, v: String| format!("{k:<8}= '{v}'");
    let real = |k: &str, v: f64| format!("{k:<8}= {v:>20.10}");
    for (source, cards) in [
        ("OBJCTRA", vec![text("OBJCTRA", sexagesimal(ra / 15.0)), text("OBJCTDEC", sexagesimal(dec))]),
        ("RA/DEC", vec![real("RA", ra + 0.5), real("DEC", dec - 0.4)]),
        ("in hours", vec![real("RA", ra / 15.0), real("DEC", dec)]),
        ("CRVAL1", vec![real("CRVAL1", ra), real("CRVAL2", dec)]),
    ] {
        edited(&frame_name(2), &path, &strip, &cards);
        let found = answer(&path, &night).unwrap();
        assert!(found.replaced && found.note.contains(source), "{source}: {}", found.note);
        assert!(apart(&found.wcs, &good) < 60.0, "{source}");
    }
    // altitude and azimuth of the fixture's own geometry
    let exposure = classify(&frame_name(2), &night.config, &[]).unwrap();
    let mid = exposure.time.as_ref().unwrap().mid;
    let (alt, az) = satphot::orbit::icrs_to_altaz(&night.site, &night.eop, &mid, ra, dec);
    edited(&frame_name(2), &path, &strip, &[real("CENTALT", alt.to_degrees()), real("CENTAZ", az.to_degrees())]);
    assert!(answer(&path, &night).unwrap().note.contains("CENTALT"));
    // nothing at all: the error names the remedy, and the configuration is one
    edited(&frame_name(2), &path, &strip, &[]);
    let error = answer(&path, &night).unwrap_err().to_string();
    assert!(error.contains("stars.fields") && error.contains("FIELD 02") && error.contains("OBJCTRA"), "{error}");
    let configured = self::night(&[&format!("stars.fields={{ \"FIELD 02\" = [{}, {}] }}", ra + 0.3, dec)]);
    assert!(answer(&path, &configured).unwrap().note.contains("stars.fields"));
}

#[test]
fn never_refuses_what_auto_would_replace_and_always_solves_what_auto_would_keep() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("frame.fits");
    edited(&frame_name(1), &path, &|k, v| Some(if k == "CRVAL2" { v + 0.9 } else { v }), &[]);
    let never = night(&["stars.solve=\"never\""]);
    assert_eq!(never.config.stars.as_ref().unwrap().solve, Solve::Never);
    let error = answer(&path, &never).unwrap_err().to_string();
    assert!(error.contains("does not fit the sky") && error.contains("stars.solve"), "{error}");
    assert!(!answer(&frame_name(1), &never).unwrap().replaced);
    let always = answer(&path, &night(&["stars.solve=\"always\""])).unwrap();
    assert!(always.replaced && always.note.contains("always"), "{}", always.note);
    // a header that the solution confirms was right: it is refined and not reported as replaced
    let right = answer(&frame_name(1), &night(&["stars.solve=\"always\""])).unwrap();
    assert!(!right.replaced && right.note.is_empty(), "{}", right.note);
    let own = wcs_of(&classify(&frame_name(1), &never.config, &[]).unwrap());
    assert!(apart(&right.wcs, &own) > 1.0, "the solution is used, not the header");
}

#[test]
fn a_place_or_a_scale_that_is_wrong_altogether_is_refused_with_what_was_tried() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("frame.fits");
    edited(&frame_name(1), &path, &|k, v| Some(if k == "CRVAL2" { v + 5.0 } else { v }), &[]);
    let error = answer(&path, &night(&[])).unwrap_err().to_string();
    assert!(error.contains("the header's world coordinates") && error.contains("solve_radius_deg"), "{error}");
    // the optics of another telescope, and no good header to save the frame
    edited(&frame_name(1), &path, &|k, v| Some(if k == "CD1_1" { -v } else { v }), &[]);
    let error = answer(&path, &night(&["telescope.focal_length_mm=2000.0"])).unwrap_err().to_string();
    assert!(error.contains("focal_length_mm") && error.contains("arcsec/px"), "{error}");
}

#[test]
fn a_night_without_world_coordinates_gives_the_zeropoint_of_the_night_with_them() {
    let (folder, out) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    for entry in std::fs::read_dir(NIGHT).unwrap() {
        let path = entry.unwrap().path();
        if !path.is_file() {
            continue; // results of a run
        }
        let to = folder.path().join(path.file_name().unwrap());
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if name.starts_with("field") {
            let h = classify(&path, &night(&[]).config, &[]).unwrap();
            let (ra, dec) = wcs_of(&h).pixel_to_sky(100.0, 200.0);
            let cards = [format!("RA      = {ra:>20.8} / deg"), format!("DEC     = {dec:>20.8}")];
            edited(&path, &to, &|key, v| (!is_wcs(key)).then_some(v), &cards);
        } else if !name.starts_with("target") {
            std::fs::copy(&path, &to).unwrap();
        }
    }
    let reduce = |input: &Path, out: &Path| {
        let mut config = Config::load(&Path::new(NIGHT).join("pipeline.toml"), &[]).unwrap();
        config.night.input = vec![input.to_path_buf()];
        config.night.output = out.to_path_buf();
        (config.orbit, config.model) = (None, None);
        run(&config, &Options { no_figures: true, ..Options::default() }, &Silent).unwrap().zeropoint.unwrap()
    };
    let (with, without) =
        (reduce(Path::new(NIGHT), &out.path().join("a")), reduce(folder.path(), &out.path().join("b")));
    println!("{} stars with, {} without world coordinates", with.n_used, without.n_used);
    // the same pixels measured at places that differ by a tenth of a pixel
    assert!((with.zp_mag - without.zp_mag).abs() < 0.01, "{} {}", with.zp_mag, without.zp_mag);
    assert!(without.n_used + 3 >= with.n_used);
}
