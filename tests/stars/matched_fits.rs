//! Zeropoints from FITS tables: BANZAI, FITS_LDAC, stellarphot, as astropy writes them (`scripts/make_tables.py`), and damaged.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::path::{Path, PathBuf};

use satphot::Result;
use satphot::tables::read::{Row, Table};
use satphot::zeropoint::matched::{Matched, Request, fit_matched, without_config};

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/tables");

fn file(name: &str) -> PathBuf {
    Path::new(FOLDER).join(name)
}

fn fit(path: &Path, columns: &[(&str, &str)]) -> Result<Matched> {
    let columns = columns.iter().map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect();
    fit_matched(&without_config(&[])?, &Request { table: path, columns, band: "V", inst_constant_mag: 0.0 })
}

fn refusal(path: &Path, words: &[&str]) {
    let error = fit(path, &[]).map(|m| m.text()).unwrap_err();
    let text = error.to_string();
    assert!(words.iter().all(|w| text.contains(w)), "{words:?} not in {text}");
    assert_eq!(error.exit_code(), 4, "{text}");
}

/// The table of `scripts/make_tables.py` is without noise: its truth comes out within `within_mag`.
fn is_truth(m: &Matched, zp_mag: f64, within_mag: f64) {
    let z = m.zeropoint.as_ref().unwrap_or_else(|e| panic!("{e}\n{}", m.text()));
    let off = [z.zp_mag - zp_mag, z.k_mag_airmass - 0.12, z.c_mag_mag - 0.08];
    assert!(off.iter().all(|d| d.abs() < within_mag), "{off:?}\n{}", m.text());
    assert_eq!(m.rows.len(), 48);
}

#[test]
fn the_catalogue_extension_of_banzai_is_found_behind_its_compressed_image() {
    // counts of a 30 s exposure: 2.5 lg 30 from the truth
    let m = fit(&file("banzai.fits"), &[("exptime_s", "30")]).unwrap();
    is_truth(&m, -23.37, 1e-6);
    assert!(m.rows[0].inst_mag_err.is_some() && m.rows[3].ra_deg.is_some(), "{:?}", m.rows[0]);
    assert!(m.taken.contains(&("inst".into(), "-2.5 log10(flux / 30)".into())), "{:?}", m.taken);
    assert!(m.notes.iter().any(|n| n.contains("not known to be in electrons")), "{:?}", m.notes);
    let named = fit(&file("banzai.fits[CAT]"), &[("exptime_s", "30")]).unwrap();
    assert_eq!(named.rows, m.rows);
    assert_eq!(fit(&file("banzai.fits[2]"), &[("exptime_s", "30")]).unwrap().rows, m.rows);
    for name in ["banzai.fits[SCI]", "banzai.fits[7]", "banzai.fits[]"] {
        refusal(&file(name), &["no binary table of that name", "banzai.fits[CAT]"]);
    }
}

#[test]
fn the_objects_of_an_ldac_file_are_read_and_its_header_table_is_not() {
    let m = fit(&file("ldac.fits"), &[]).unwrap();
    is_truth(&m, -23.37, 1e-6);
    let said = m.notes.iter().find(|n| n.contains("LDAC_IMHEAD")).unwrap();
    assert!(said.contains("ldac.fits[LDAC_OBJECTS] is read"), "{said}");
    // an aperture of several radii is several columns, as in SExtractor's text
    let third = fit(&file("ldac.fits"), &[("flux", "FLUX_APER_2")]).unwrap();
    is_truth(&third, -23.37, 1e-4);
    let second = fit(&file("ldac.fits[LDAC_OBJECTS]"), &[("flux", "FLUX_APER_1")]).unwrap();
    is_truth(&second, -23.37 + 2.5 * 0.9_f64.log10().abs(), 1e-4);
    refusal(&file("ldac.fits[LDAC_IMHEAD]"), &["no column of catalogue magnitudes", "Field Header Card"]);
}

#[test]
fn units_of_a_qtable_are_converted_and_a_masked_cell_is_missing() {
    let m = fit(&file("stellarphot.fits"), &[]).unwrap();
    // the airmass of an altitude in radians, exposures of minutes, catalogue magnitudes in mmag
    is_truth(&m, -23.37, 5e-3);
    for words in ["`altitude` is in rad", "`exposure` is in min", "`cat_v_mag` is in mmag"] {
        assert!(m.notes.iter().any(|n| n.contains(words)), "{words}: {:?}", m.notes);
    }
    assert_eq!(m.rows[5].inst_mag_err, None);
    assert_eq!(m.rows[0].exptime_s, Some(60.0));
    assert!((m.rows[7].mjd_mid_d.unwrap() - 60835.51).abs() < 1e-9);
    assert_eq!(m.inst_unit, "-2.5 log10(electrons per second)");
    let wrong = fit(&file("stellarphot.fits"), &[("exptime_s", "altitude")]).unwrap_err().to_string();
    for words in ["stellarphot.fits", "`altitude` is in `rad`", "exptime_s is needed", "column exptime_s=NAME"] {
        assert!(wrong.contains(words), "{words}: {wrong}");
    }
}

#[test]
fn a_file_with_two_tables_that_can_be_meant_names_both() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = std::fs::read(file("ldac.fits")).unwrap();
    // the objects once more behind themselves
    let at = bytes.chunks(2880).position(|b| b.windows(12).any(|w| w == b"LDAC_OBJECTS")).unwrap();
    let begin = (0..=at).rev().find(|k| bytes[k * 2880..].starts_with(b"XTENSION")).unwrap() * 2880;
    let both = folder.path().join("both.fits");
    std::fs::write(&both, [&bytes[..], &bytes[begin..]].concat()).unwrap();
    refusal(&both, &["several of its tables can be meant", "both.fits[2] or", "both.fits[3]"]);
    let second = PathBuf::from(format!("{}[3]", both.display()));
    assert_eq!(fit(&second, &[]).unwrap().rows, fit(&file("ldac.fits"), &[]).unwrap().rows);
}

#[test]
fn damaged_tables_are_refused_with_what_is_wrong_and_packed_ones_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = std::fs::read(file("stellarphot.fits")).unwrap();
    let damaged = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        path
    };
    refusal(&damaged("cut.fits", &bytes[..bytes.len() - 2880]), &["cut.fits", "truncated", "HDU 1 promises"]);
    refusal(&damaged("head.fits", &bytes[..2880]), &["without a binary table", "HDU 0 is an image"]);
    refusal(&damaged("half.fits", &bytes[..4000]), &["half.fits", "END"]);
    let card = |bytes: &[u8], from: &str, to: &str| {
        let mut bytes = bytes.to_vec();
        let at = bytes.windows(from.len()).position(|w| w == from.as_bytes()).unwrap();
        bytes[at..at + to.len()].copy_from_slice(to.as_bytes());
        bytes
    };
    // a table of no rows, and one whose rows are empty
    let none = card(&bytes, "NAXIS2  =                   48", "NAXIS2  =                    0");
    refusal(&damaged("empty.fits", &none), &["no rows", "star_id"]);
    let lies = card(&bytes, "NAXIS2  =                   48", "NAXIS2  =         999999999999");
    refusal(&damaged("lies.fits", &lies), &["truncated"]);
    let form = card(&bytes, "TFORM2  = 'D       '", "TFORM2  = '9D      '");
    refusal(&damaged("form.fits", &form), &["NAXIS1"]);
    // text where numbers are needed: no star has a magnitude
    let words = fit(&file("stellarphot.fits"), &[("inst_mag", "star_id")]).unwrap();
    assert!(words.zeropoint.is_err() && words.excluded["no instrumental magnitude"] == 48, "{}", words.text());

    use std::io::Write as _;
    let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    packed.write_all(&bytes).unwrap();
    let path = damaged("packed.fits.gz", &packed.finish().unwrap());
    assert_eq!(fit(&path, &[]).unwrap().rows, fit(&file("stellarphot.fits"), &[]).unwrap().rows);
    assert_eq!(fit(&damaged("text.gz", b"\x1f\x8bno"), &[]).unwrap_err().exit_code(), 4);
}

#[test]
fn times_of_a_qtable_are_utc_whatever_their_scale_and_no_digit_is_lost() {
    let mut table = Table::open(&file("observations_tai.fits")).unwrap();
    let time = table.column("time").unwrap();
    let names: Vec<&str> = table.columns.iter().map(|c| c.name.as_str()).collect();
    assert_eq!(names, ["satellite_name", "norad_cat_id", "time", "mag", "pixels", "pixels_1"]);
    let (mut row, mut times, mut last) = (Row::default(), Vec::new(), Row::default());
    while table.read(&mut row).unwrap() {
        times.push(row.get(time).to_owned());
        last = row.clone();
    }
    let minutes = ["31:00", "32:00", "33:12", "34:00"];
    assert_eq!(times.len(), 4);
    for (time, minute) in times.iter().zip(minutes) {
        // astropy's two numbers hold microseconds of a nanosecond
        let exact = satphot::base::time::parse_utc("t", &format!("2025-06-09T10:{minute}Z")).unwrap();
        let off_s = (satphot::base::time::parse_utc("t", time).unwrap() - exact).to_seconds();
        assert!(off_s.abs() <= 2e-9, "{time} {minute}");
    }
    assert_eq!((last.get(table.column("mag").unwrap()), last.get(5)), ("", "7.0"));
    // ECSV says the scale beside the text
    let ecsv = Table::open(&file("observations_tai.ecsv")).unwrap();
    assert_eq!(ecsv.columns[ecsv.column("time").unwrap()].time_scale, "tai");
}
