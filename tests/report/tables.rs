//! The tables: the schema column by column, exact round trips, ECSV that other readers take, and errors with a place.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)] // tests

use std::fs;
use std::path::PathBuf;

use proptest::prelude::*;
use satphot::Error;
use satphot::tables::{
    Column, Meta, MetaValue, PHOTOMETRY, PhotometryRow, RESIDUALS, ResidualRow, STARS, StarRow, read_photometry,
    read_residuals, read_stars, write_photometry, write_residuals, write_stars,
};

/// The law: every column of `photometry.ecsv`, in order, group by group.
const LAW: &str = "frame frame_sha256 norad_cat_id object_id object_name \
    date_mid mjd_mid_d exptime_s time_err_s time_source time_stamp cadence_s date_avg_minus_mid_s \
    filter gain_setting e_per_adu e_per_adu_source read_noise_e fwhm_px pix_scale_arcsec \
    x_px y_px search_radius_px aper_shape aper_r_px aper_a_px aper_b_px aper_theta_deg elongation extent_fwhm source_kind point_log10_odds disc_fwhm2 disc_fwhm2_err \
    sky_in_px sky_out_px \
    flux_e flux_err_e forced_flux_e forced_flux_err_e forced_at forced_x_px forced_y_px sky_e_px sky_corner_ratio snr peak_frac_sat masked_frac contam_frac aper_corr_mag inst_mag v_mag v_mag_err \
    v_mag_err_sys zp_age_d zp_extra_err_mag v_mag_zeropoint \
    frame_zp_offset_mag frame_zp_offset_err_mag frame_zp_stars frame_v_mag frame_v_mag_err_sys frame_zp_note \
    limit_v_mag v_mag_550km v_mag_1000km standard_v_mag \
    mu_mean_mag_arcsec2 mu_peak_mag_arcsec2 \
    alt_deg az_deg range_km rate_deg_s az_rate_deg_s alt_az_err_deg \
    ra_deg dec_deg ra_err_arcsec dec_err_arcsec along_oc_arcsec along_oc_err_arcsec cross_oc_arcsec cross_oc_err_arcsec \
    airmass phase_angle_deg sun_alt_deg sun_alt_sat_deg moon_alt_deg moon_phase_deg \
    moon_illum_pct moon_sep_deg illum sky_class paper_label tle_age_d \
    model_v_mag sun_v_mag earthshine_v_mag moon_v_mag lunar_earthshine_v_mag model_err_mag v_pred_err_mag lit_array_cos \
    residual_mag skipped \
    pointing_sep_deg zero_level status verdict reason flags";

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().unwrap()
}

fn row() -> PhotometryRow {
    PhotometryRow {
        frame: "iss_0001.fits".into(),
        frame_sha256: "0011223344556677".into(),
        norad_cat_id: Some(25544),
        object_id: "1998-067A".into(),
        object_name: "ISS (ZARYA)".into(),
        date_mid: "2025-06-09T10:33:02.500Z".into(),
        mjd_mid_d: Some(60_834.439_612_268_52),
        exptime_s: Some(5.0),
        gain_setting: Some(200),
        flux_e: Some(-12.5),
        v_mag: Some(11.934),
        v_mag_err: Some(0.021),
        status: "ok".into(),
        verdict: "use".into(),
        flags: 16,
        ..Default::default()
    }
}

fn meta() -> Meta {
    let number = |key: &str, value: f64| (key.to_owned(), MetaValue::Number(value));
    let mut meta = Meta::default();
    meta.push("schema", "satphot.photometry/1");
    meta.push("tool", "satphot 0.1.0");
    meta.push("config_sha256", "9e52"); // looks like a number with an exponent, is a text
    meta.push("note", "true");
    meta.push("path", "C:\\data: \"night\", #1 {a} [b] 'c'\nsecond line\tétoile ☾");
    meta.push(
        "site",
        MetaValue::Map(vec![number("lat_deg", -33.7703), number("lon_deg", 151.1113), number("alt_m", 70.0)]),
    );
    let cov = vec![1.2e-7, -3e-9, 0.0, 1e22, 12345.678];
    let cov = ("cov".to_owned(), MetaValue::List(cov.into_iter().map(MetaValue::Number).collect()));
    meta.push("zeropoint", MetaValue::Map(vec![number("zp_mag", -23.37), cov]));
    meta.push("empty", "");
    meta.push(
        "flag_names",
        MetaValue::Map(vec![("1".to_owned(), "saturated".into()), ("2".to_owned(), "masked".into())]),
    );
    meta
}

/// The names of the header row of a written file.
fn written_names(text: &str) -> Vec<&str> {
    text.lines().find(|l| !l.starts_with('#')).unwrap().split(',').collect()
}

#[test]
fn photometry_has_every_column_of_the_schema_once_and_in_order() {
    let names: Vec<&str> = PHOTOMETRY.columns.iter().map(|c| c.name).collect();
    assert_eq!(names, LAW.split_whitespace().collect::<Vec<_>>());
}

#[test]
fn every_table_writes_its_fields_under_their_own_names() {
    // The rows are written field by field, the header from the columns: serde's own names must agree with the columns.
    fn fields<T: serde::Serialize>(row: &T) -> Vec<String> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        writer.serialize(row).unwrap();
        let bytes = writer.into_inner().unwrap();
        csv::Reader::from_reader(bytes.as_slice()).headers().unwrap().iter().map(str::to_owned).collect()
    }
    let names = |columns: &[Column]| columns.iter().map(|c| c.name.to_owned()).collect::<Vec<_>>();
    assert_eq!(fields(&PhotometryRow::default()), names(PHOTOMETRY.columns));
    assert_eq!(fields(&StarRow::default()), names(STARS.columns));
    assert_eq!(fields(&ResidualRow::default()), names(RESIDUALS.columns));
    for columns in [PHOTOMETRY, STARS, RESIDUALS].map(|table| table.columns) {
        let mut unique = names(columns);
        unique.sort();
        unique.dedup();
        assert_eq!(unique.len(), columns.len());
        assert!(columns.iter().all(|c| !c.description.is_empty()));
    }
}

#[test]
fn a_name_that_ends_in_a_unit_has_that_unit() {
    let ends = [
        ("_mag_arcsec2", "mag / arcsec2"),
        ("_deg_s", "deg / s"),
        ("_e_px", "electron / pix"),
        ("_deg", "deg"),
        ("_px", "pix"),
        ("_km", "km"),
        ("_pct", "%"),
        ("_mag", "mag"),
        ("_s", "s"),
        ("_d", "d"),
        ("_e", "electron"),
    ];
    for column in PHOTOMETRY
        .columns
        .iter()
        .chain(STARS.columns)
        .chain(RESIDUALS.columns)
        .filter(|c| c.datatype.ecsv() == "float64")
    {
        if let Some((_, unit)) = ends.iter().find(|(end, _)| column.name.ends_with(end)) {
            assert_eq!(column.unit, *unit, "{}", column.name);
        }
    }
}

#[test]
fn the_header_is_literally_ecsv() {
    let dir = folder();
    let path = dir.path().join("photometry.ecsv");
    let mut meta = Meta::default();
    meta.push("schema", "satphot.photometry/1");
    meta.push(
        "site",
        MetaValue::Map(vec![("lat_deg".into(), MetaValue::Number(-33.77)), ("alt_m".into(), MetaValue::Number(70.0))]),
    );
    write_photometry(&path, &[row()], &meta).unwrap();
    let text = fs::read_to_string(&path).unwrap();
    assert!(text.starts_with(
        "# %ECSV 1.0\n# ---\n# delimiter: ','\n# datatype:\n\
         # - {name: frame, datatype: string, description: source FITS file name}\n"
    ));
    for line in [
        "# - {name: norad_cat_id, datatype: int64, description: satellite catalogue number}",
        "# - {name: mjd_mid_d, unit: d, datatype: float64, description: mid-exposure MJD (UTC)}",
        "# - {name: moon_illum_pct, unit: \"%\", datatype: float64, description: illuminated fraction of the lunar disc}",
        "# - {name: flags, datatype: int32, description: \"quality bit mask; the bits are named in meta\"}",
        "# meta: !!omap",
        "# - {schema: satphot.photometry/1}",
        "# - {site: {lat_deg: -33.77, alt_m: 70}}",
        "# schema: astropy-2.0",
    ] {
        assert!(text.lines().any(|l| l == line), "missing: {line}\n{text}");
    }
    assert_eq!(written_names(&text).join(" "), LAW.split_whitespace().collect::<Vec<_>>().join(" "));
    let data = text.lines().last().unwrap();
    let start = "iss_0001.fits,0011223344556677,25544,1998-067A,ISS (ZARYA),2025-06-09T10:33:02.500Z,60834.43961226852,5.0,\"\"";
    assert!(data.starts_with(start), "{data}");
    assert!(data.ends_with(",\"\",ok,use,\"\",16"), "{data}");
}

#[test]
fn an_mjd_has_at_least_ten_decimals_and_keeps_every_bit() {
    let dir = folder();
    let path = dir.path().join("t.ecsv");
    let times = [60_834.5, 60_834.0, 60_834.439_612_268_52, 60_834.123_456_789_01];
    let rows: Vec<PhotometryRow> = times.iter().map(|t| PhotometryRow { mjd_mid_d: Some(*t), ..row() }).collect();
    write_photometry(&path, &rows, &Meta::default()).unwrap();
    let text = fs::read_to_string(&path).unwrap();
    for line in text.lines().filter(|l| l.starts_with("iss")) {
        let decimals = line.split(',').nth(6).unwrap().split_once('.').unwrap().1.len();
        assert!(decimals >= 10, "{line}");
    }
    let back = read_photometry(&path).unwrap().0;
    assert!(back.iter().zip(times).all(|(r, t)| r.mjd_mid_d.map(f64::to_bits) == Some(t.to_bits())));
}

#[test]
fn missing_is_not_zero() {
    let dir = folder();
    let path = dir.path().join("t.ecsv");
    let zero = PhotometryRow { flux_e: Some(0.0), gain_setting: Some(0), norad_cat_id: None, flags: 0, ..row() };
    let none = PhotometryRow { flux_e: None, gain_setting: None, norad_cat_id: Some(0), ..row() };
    let rows = vec![zero, none];
    write_photometry(&path, &rows, &Meta::default()).unwrap();
    let back = read_photometry(&path).unwrap().0;
    assert_eq!(back, rows);
    assert_eq!((back[0].flux_e, back[1].flux_e), (Some(0.0), None));
}

#[test]
fn names_with_commas_quotes_hashes_and_unicode_come_back() {
    let dir = folder();
    let path = dir.path().join("t.ecsv");
    let rows: Vec<PhotometryRow> =
        ["a,b", "say \"hi\"", "#1.fits", "météore ☾ 星", "'", "\"", ",", " padded ", "nan", "1e5", "# x"]
            .iter()
            .map(|name| PhotometryRow { frame: (*name).into(), reason: format!("because of {name}"), ..row() })
            .collect();
    write_photometry(&path, &rows, &meta()).unwrap();
    assert_eq!(read_photometry(&path).unwrap().0, rows);
}

#[test]
fn a_line_break_in_a_reason_becomes_a_blank() {
    let dir = folder();
    let path = dir.path().join("t.ecsv");
    let two_lines = PhotometryRow { reason: "bad header\r\nsecond line\nthird".into(), ..row() };
    write_photometry(&path, &[two_lines], &Meta::default()).unwrap();
    assert_eq!(read_photometry(&path).unwrap().0[0].reason, "bad header second line third");
}

#[test]
fn the_meta_block_comes_back_as_it_was() {
    let dir = folder();
    let path = dir.path().join("t.ecsv");
    write_photometry(&path, &[], &meta()).unwrap();
    assert_eq!(read_photometry(&path).unwrap().1, meta());
}

#[test]
fn a_table_without_rows_is_valid() {
    let dir = folder();
    let path = dir.path().join("t.ecsv");
    write_stars(&path, &[], &Meta::default()).unwrap();
    assert_eq!(read_stars(&path).unwrap(), (vec![], Meta::default()));
    write_residuals(&path, &[], &Meta::default()).unwrap();
    assert_eq!(read_residuals(&path).unwrap(), (vec![], Meta::default()));
    write_photometry(&path, &[], &Meta::default()).unwrap();
    assert_eq!(read_photometry(&path).unwrap(), (vec![], Meta::default()));
}

#[test]
fn identical_rows_give_identical_bytes_and_leave_no_other_file() {
    let dir = folder();
    let (a, b) = (dir.path().join("a.ecsv"), dir.path().join("b.ecsv"));
    write_photometry(&a, &[row(), PhotometryRow::default()], &meta()).unwrap();
    write_photometry(&b, &[row(), PhotometryRow::default()], &meta()).unwrap();
    write_photometry(&b, &[row(), PhotometryRow::default()], &meta()).unwrap(); // over an existing file
    assert_eq!(fs::read(&a).unwrap(), fs::read(&b).unwrap());
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 2);
}

#[test]
fn stars_and_residuals_come_back_as_they_were() {
    let dir = folder();
    let path = dir.path().join("t.ecsv");
    let stars =
        vec![StarRow { star_id: "APASS 1,2".into(), pointing: Some(3), fit_weight: Some(0.0), ..Default::default() }];
    write_stars(&path, &stars, &meta()).unwrap();
    assert_eq!(read_stars(&path).unwrap(), (stars, meta()));
    let residuals =
        vec![ResidualRow { pass: Some(1), residual_mag: Some(-0.1), ..Default::default() }, ResidualRow::default()];
    write_residuals(&path, &residuals, &meta()).unwrap();
    assert_eq!(read_residuals(&path).unwrap(), (residuals, meta()));
}

#[test]
fn a_number_that_is_not_finite_is_refused_by_row_and_column() {
    let dir = folder();
    let path = dir.path().join("t.ecsv");
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let rows = [row(), PhotometryRow { frame: "bad.fits".into(), v_mag: Some(bad), ..row() }];
        let message = write_photometry(&path, &rows, &Meta::default()).unwrap_err().to_string();
        assert!(["row 2", "bad.fits", "v_mag"].iter().all(|part| message.contains(part)), "{message}");
    }
    let mut meta = Meta::default();
    meta.push("zeropoint", MetaValue::Map(vec![("k_mag_airmass".into(), MetaValue::Number(f64::NAN))]));
    let message = write_photometry(&path, &[], &meta).unwrap_err().to_string();
    assert!(message.contains("zeropoint.k_mag_airmass"), "{message}");
    assert!(!path.exists(), "nothing half-written");
}

/// Writes a good file, changes its text, and reads it.
fn reread(change: impl Fn(String) -> String) -> satphot::Result<(Vec<PhotometryRow>, Meta)> {
    let dir = folder();
    let path: PathBuf = dir.path().join("t.ecsv");
    write_photometry(&path, &[row()], &meta()).unwrap();
    fs::write(&path, change(fs::read_to_string(&path).unwrap())).unwrap();
    read_photometry(&path)
}

#[test]
fn columns_are_found_by_name_and_unknown_ones_ignored() {
    let reversed = |text: String| {
        let (head, body): (Vec<&str>, Vec<&str>) = text.lines().partition(|l| l.starts_with('#'));
        let turn = |line: &str| line.split(',').rev().collect::<Vec<_>>().join(",");
        format!("{}\n{},extra\n{},surprise\n", head.join("\n"), turn(body[0]), turn(body[1]))
    };
    assert_eq!(reread(reversed).unwrap().0, vec![row()]);
}

#[test]
fn a_table_rewritten_by_astropy_is_read() {
    // astropy's default: blanks between cells, no `delimiter` line, nested meta without braces, plain `9e52`.
    let rewritten = |text: String| {
        let (head, body): (Vec<&str>, Vec<&str>) = text.lines().partition(|l| l.starts_with('#'));
        let head = head.into_iter().filter(|l| !l.contains("delimiter")).collect::<Vec<_>>().join("\n");
        let head = head
            .replace("- {site: {", "- site: {")
            .replace("alt_m: 70}}", "\n#     alt_m: 70}")
            .replace("\"9e52\"", "9e52");
        let mut writer =
            csv::WriterBuilder::new().delimiter(b' ').quote_style(csv::QuoteStyle::Always).from_writer(vec![]);
        for record in csv::ReaderBuilder::new().has_headers(false).from_reader(body.join("\n").as_bytes()).records() {
            writer.write_record(&record.unwrap()).unwrap();
        }
        format!("{head}\n{}", String::from_utf8(writer.into_inner().unwrap()).unwrap())
    };
    let (rows, read_meta) = reread(rewritten).unwrap();
    assert_eq!(rows, vec![row()]);
    assert_eq!(read_meta, meta());
}

#[test]
fn a_missing_column_is_named() {
    let error = reread(|text| text.replace(",v_mag,", ",vmag,")).unwrap_err();
    assert!(matches!(error, Error::Table { .. }));
    assert!(error.to_string().contains("column v_mag is missing"), "{error}");
}

#[test]
fn a_bad_number_is_named_with_its_line() {
    for (good, bad, column) in
        [(",11.934,", ",bright,", "v_mag"), (",25544,", ",255.44,", "norad_cat_id"), (",11.934,", ",nan,", "v_mag")]
    {
        let error = reread(|text| text.replace(good, bad)).unwrap_err();
        let line = PHOTOMETRY.columns.len() + 4 + 1 + meta().entries.len() + 1 + 2; // head, columns, meta, schema, names, row 1
        let Error::Table { line: Some(at), ref problem, .. } = error else { panic!("{error}") };
        assert_eq!(at, line, "{error}");
        assert!(problem.contains(&format!("column {column}:")), "{error}");
    }
}

#[test]
fn a_short_line_a_plain_csv_and_an_empty_file_are_refused() {
    assert!(reread(|text| format!("{text}only,three,cells\n")).is_err());
    assert!(reread(|text| text.lines().filter(|l| !l.starts_with('#')).collect::<Vec<_>>().join("\n")).is_err());
    assert!(reread(|_| String::new()).is_err());
    assert!(reread(|text| text.lines().filter(|l| l.starts_with('#')).collect::<Vec<_>>().join("\n")).is_err());
    assert!(matches!(read_photometry(&folder().path().join("absent.ecsv")), Err(Error::Io { .. })));
}

proptest! {
    #[test]
    fn any_finite_number_and_any_printable_text_come_back_exactly(
        number in prop::num::f64::NORMAL | prop::num::f64::SUBNORMAL | prop::num::f64::ZERO,
        integer in any::<i64>(),
        flags in any::<i32>(),
        text in "[\\PC--[\u{2028}\u{2029}]]{0,20}",
    ) {
        let dir = folder();
        let path = dir.path().join("t.ecsv");
        let rows = vec![PhotometryRow {
            frame: text.clone(),
            reason: text.clone(),
            flux_e: Some(number),
            mjd_mid_d: Some(number),
            norad_cat_id: Some(integer),
            flags,
            ..Default::default()
        }];
        let mut meta = Meta::default();
        meta.push("text", text.as_str());
        meta.push(&format!("key {text}"), number);
        meta.push("list", MetaValue::List(vec![text.as_str().into(), MetaValue::Map(vec![(text, 1.0.into())])]));
        write_photometry(&path, &rows, &meta).unwrap();
        prop_assert_eq!(read_photometry(&path).unwrap(), (rows, meta));
    }
}
