//! Every trap of the other keywords, each by name: headers made here, read as `satphot inspect` reads them.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use crate::headers;

use headers::{inspected, inspected_at_macquarie, inspected_with, says, shared};
use satphot::config::Config;
use satphot::frames::Role;
use satphot::pipeline::inspect::inspector::Inspector;
use satphot::pipeline::survey::read::survey;

const START: &str = "EXPTIME = 5.0\nDATE-OBS = '2025-06-09T10:33:00.000'\n";

fn light(lines: &str) -> satphot::pipeline::inspect::record::Inspection {
    inspected(&format!("{START}{lines}"))
}

#[test]
fn every_synonym_of_the_exposure_time_is_read_the_first_wins() {
    for key in ["EXPTIME", "EXPOSURE", "EXP", "EXP_TIME", "TELAPSE", "XPOSURE"] {
        let e = inspected(&format!("{key} = 15. / [s]\nDATE-OBS = '2025-06-09T10:33:00.0'\n")).exptime_s.unwrap();
        assert_eq!((e.value, e.source.as_str()), (15.0, key));
    }
    let e = inspected("HIERARCH EXPOSURETIME = 15.0\nOBJECT = 'x'\n").exptime_s.unwrap();
    assert_eq!((e.value, e.source.as_str()), (15.0, "EXPOSURETIME"));
}

#[test]
fn milliseconds_are_recognised_by_comment_and_by_the_clock() {
    let e = inspected("EXPTIME = 5000 / [ms] exposure\nDATE-OBS = '2025-06-09T10:33:00.0'\n").exptime_s.unwrap();
    assert_eq!(e.value, 5.0);
    let i = inspected("EXPTIME = 5000\nDATE-OBS = '2025-06-09T10:33:00.0'\nDATE-END = '2025-06-09T10:33:05.0'\n");
    assert_eq!(i.exptime_s.unwrap().value, 5.0);
    assert!(says(&i.warnings, &["milliseconds"]), "{:?}", i.warnings);
    assert_eq!(i.time.unwrap().date_mid, "2025-06-09T10:33:02.500000Z");
}

#[test]
fn gain_is_a_setting_for_amateurs_and_electrons_for_observatories() {
    let nina = light("GAIN = 120 / Sensor gain\nEGAIN = 1.00224268436432 / [e-/ADU] Electrons per A/D unit\n").gain;
    assert_eq!((nina.gain_setting, nina.e_per_adu), (Some(120), Some(1.00224268436432)));
    assert_eq!(nina.e_per_adu_source.as_deref(), Some("header EGAIN"));
    let lco = light("GAIN = 1.0000000 / [electrons/count] Pixel gain\n").gain;
    assert_eq!((lco.gain_setting, lco.e_per_adu), (None, Some(1.0)));
    let prism = light("CVF = 0.35 / electrons per adu\n").gain;
    assert_eq!((prism.gain_setting, prism.e_per_adu), (None, Some(0.35)));
    let unset = light("GAIN = 0.000 / [electron/ADU] AD conversion factor\n");
    assert!(unset.gain.e_per_adu.is_none() && says(&unset.warnings, &["GAIN", "unset"]), "{:?}", unset.warnings);
}

#[test]
fn gain_200_is_200_tenths_of_a_decibel_and_the_cameras_table_wins_over_egain() {
    let cards = "INSTRUME = 'ZWO ASI6200MM Pro'\nGAIN = 200\nEGAIN = 0.5\nRDNOISE = 1.5\n";
    let g = light(cards);
    assert_eq!(g.gain.gain_setting, Some(200));
    // 5530 e- of full well over 65535 counts
    assert!((g.gain.e_per_adu.unwrap() - 5530.0 / 65_535.0).abs() < 1e-12, "{:?}", g.gain);
    assert!(says(&g.warnings, &["0.5000 e-/ADU differ"]), "{:?}", g.warnings);
    let own = inspected_at_macquarie(&["detector.e_per_adu.200=0.09"], &format!("{START}{cards}"));
    assert_eq!((own.gain.e_per_adu, own.gain.e_per_adu_source.as_deref()), (Some(0.09), Some("pipeline.toml")));
}

#[test]
fn own_keywords_are_tried_first_and_a_misspelt_quantity_is_refused() {
    let cards = format!("{START}MYGAIN = 0.77\nEGAIN = 1.5\nCAM-GAIN = 100\nFLT = 'g'\nSHUT = 7.0\n");
    let i = inspected_with(
        &[
            "header.aliases.egain=[\"MYGAIN\"]",
            "header.aliases.gain=[\"CAM-GAIN\"]",
            "header.aliases.filter=[\"FLT\"]",
            "header.aliases.exptime=[\"SHUT\"]",
        ],
        &cards,
    );
    assert_eq!((i.gain.e_per_adu, i.gain.gain_setting), (Some(0.77), Some(100)));
    assert_eq!((i.filter.unwrap().value.as_str(), i.exptime_s.unwrap().value), ("g", 7.0));
    let sets = |s: &str| Inspector::new(None, &[s.to_string()]).map(|_| ()).map_err(|e| e.to_string());
    let error = sets("header.aliases.egian=[\"MYGAIN\"]").unwrap_err();
    assert!(error.contains("header.aliases.egian") && error.contains("egain"), "{error}");
    // the place of older configurations
    let old = inspected_with(&["frames.aliases.egain=[\"MYGAIN\"]"], &cards);
    assert_eq!(old.gain.e_per_adu, Some(0.77));
}

#[test]
fn sites_of_every_program_are_understood() {
    let near = |lines: &str, lat: f64, lon: f64| {
        let s = light(lines).site.unwrap_or_else(|| panic!("no site in {lines}"));
        assert!((s.lat_deg - lat).abs() < 3e-3 && (s.lon_deg - lon).abs() < 3e-3, "{lines}: {s:?}");
    };
    near("SITELAT = '-31 16 24'\nSITELONG = '149 03 52'\n", -31.27333, 149.06444);
    near("SITELAT = '+51 03 00.000'\nSITELONG = '+03 41 00.000'\n", 51.05, 3.68333);
    near("SITELAT = '-22:57:08:99'\nSITELONG = '-68:10:49'\n", -22.95250, -68.18028);
    near("LAT-OBS = -31.16\nLONG-OBS = 149.13\nALT-OBS = 1165.0\n", -31.16, 149.13);
    near("OBS-LAT = -30.2446\nOBS-LONG = -70.7494\nOBS-ELEV = 2663.0\n", -30.2446, -70.7494);
    near("OBSGEO-B = '51.05'\nOBSGEO-L = '3.716667'\nOBSGEO-H = '10'\n", 51.05, 3.716667);
    near("OBSGEO-X = 1815200.221\nOBSGEO-Y = -5213900.700\nOBSGEO-Z = -3187561.361\n", -30.1676541, -70.8046270);
    near("LATITUDE = '-32:22:50'\nLONGITUD = '  20:48:40'\n", -32.38056, 20.81111);
    near("GPS_LAT = -33.77\nGPS_LON = 151.11\n", -33.77, 151.11);
    near("SITELAT = '33 46 13 S'\nSITELONG = '151 06 41 E'\n", -33.77028, 151.11139);
    near("SITELAT = -30.1677\nSITELONG = 289.1954\n", -30.1677, -70.8046);
    let unset = light("SITELAT = '00 00 00'\nSITELONG = '00 00 00'\n");
    assert!(unset.site.is_none() && says(&unset.site_rejected, &["zeros, unset"]), "{:?}", unset.site_rejected);
    // the astride header's ELEVATIO is the telescope's altitude, not the site's
    let s = light("LATITUDE = '-32:22:50'\nLONGITUD = '20:48:40'\nELEVATIO = '48:45:41'\n").site.unwrap();
    assert_eq!(s.alt_m, None);
}

#[test]
fn a_site_a_tenth_of_a_degree_off_is_refused_and_a_longitude_counted_west_is_reported() {
    let at = |lat: &str, lon: &str, sets: &[&str]| {
        inspected_at_macquarie(sets, &format!("{START}SITELAT = {lat}\nSITELONG = {lon}\nGAIN = 200\n"))
    };
    assert!(at("-33.77", "151.11", &[]).usable);
    let off = at("-33.77", "151.31", &[]);
    assert!(!off.usable && says(&off.refused, &["another site", "0.20 deg", "header.check_site"]), "{:?}", off.refused);
    let allowed = at("-33.77", "151.31", &["header.check_site=false"]);
    assert!(allowed.usable && says(&allowed.warnings, &["another site"]), "{:?}", allowed.refused);
    let west = at("-33.77", "-151.11", &[]);
    assert!(west.usable && says(&west.warnings, &["counted west"]), "{:?}", west.refused);
}

#[test]
fn pointings_are_degrees_in_nina_and_hours_in_maxim() {
    let first = |lines: &str| light(lines).pointing.first().map(|p| ((p.ra_deg * 1e4).round() / 1e4, p.dec_deg));
    assert_eq!(first("RA = 275.2005 / [deg] RA of telescope\nDEC = -16.183\n"), Some((275.2005, -16.183)));
    assert_eq!(first("RA = '18 20 48.12'\nDEC = '-16 10 58.8'\n"), Some((275.2005, -16.183)));
    assert_eq!(first("OBJCTRA = '18 20 48.12'\nOBJCTDEC = '-16 10 58.8'\n"), Some((275.2005, -16.183)));
    assert_eq!(first("RA = 5.5 / [h] RA of the mount\nDEC = -69.0\n"), Some((82.5, -69.0)));
    let unset = light("OBJCTRA = '00 00 00'\nOBJCTDEC = '+00 00 00'\n");
    assert!(unset.pointing.is_empty() && says(&unset.warnings, &["OBJCTRA", "unset"]), "{:?}", unset.warnings);
    let own = inspected_with(
        &["header.aliases.ra=[\"MRA\"]", "header.aliases.dec=[\"MDE\"]"],
        &format!("{START}MRA = '05:30:00'\nMDE = -69.0\n"),
    );
    assert_eq!(own.pointing[0].source, "MRA/MDE");
}

#[test]
fn filter_binning_and_scale_are_read_as_each_program_writes_them() {
    let i = light("FILTER = ''\nFILTER1 = 'gp'\nCCDSUM = '2 2'\nPIXSCALE = 0.78\n");
    assert_eq!((i.filter.unwrap().value.as_str(), i.binning.value), ("gp", 2));
    assert_eq!(i.pix_scale_arcsec.unwrap().value, 0.78);
    assert_eq!(light("BINNING = '2*2     '\n").binning.value, 2);
    assert_eq!(light("XBINNING = '1       '\n").binning.value, 1);
    assert!(says(&light("XBINNING = 2\nYBINNING = 1\n").warnings, &["not square"]));
    assert!(light("OBJECT = 'x'\n").filter.is_none());
    let clear = light("FILTER = 'Clear'\n");
    assert_eq!(clear.filter.unwrap().value, "Clear");
    // XPIXSZ holds the binning: 2 x 3.76 um at 3962 mm
    let s = light("XPIXSZ = 7.52\nXBINNING = 2\nFOCALLEN = 3962.0\n").pix_scale_arcsec.unwrap().value;
    assert!((s - 0.3915).abs() < 1e-4, "{s}");
}

#[test]
fn types_are_recognised_in_every_spelling() {
    for (card, role) in [
        ("IMAGETYP = 'Light Frame'", "light"),
        ("IMAGETYP = 'LIGHT'", "light"),
        ("IMAGETYP = 'object'", "light"),
        ("OBSTYPE = 'EXPOSE'", "light"),
        ("OBSTYPE = 'SCIENCE'", "light"),
        ("IMAGETYP = 'Bias Frame'", "bias"),
        ("IMAGETYP = 'zero'", "bias"),
        ("IMAGETYP = 'DARK'", "dark"),
        ("IMAGETYP = 'FLAT'", "flat"),
        ("IMAGETYP = 'Sky Flat'", "flat"),
        ("FRAME = 'Flat'", "flat"),
        ("FRAME = 17", "light"),
        ("IMAGETYP = 'Master Light'", "ignored"),
        ("CALFRAME = 'MasterFlat'", "ignored"),
    ] {
        assert_eq!(light(&format!("{card}\n")).role, role, "{card}");
    }
}

#[test]
fn pictures_in_colour_are_refused_with_the_remedy_and_bayer_patterns_and_mono_are_not() {
    for card in ["NAXIS3 = 3", "BAYERPAT = 'XTRANS'", "COLORTYP = 'CMYG'"] {
        let i = light(&format!("{card}\n"));
        assert!(!i.usable && says(&i.refused, &["Bayer pattern", "detector.bayer_pattern"]), "{card}: {:?}", i.refused);
    }
    for card in ["BAYERPAT = 'RGGB'", "CFAIMAGE = 'GBRG'", "COLORTYP = 'RGGB'"] {
        let i = light(&format!("{card}\n"));
        assert!(i.usable, "{card}: {:?}", i.refused);
    }
    assert!(light("CFAIMAGE = 'no'\nBAYERPAT = ''\n").usable);
}

#[test]
fn a_cube_of_other_than_three_planes_is_a_cube_and_no_colour_sensor() {
    for (card, planes) in [("NAXIS3 = 17", "17"), ("NAXIS3 = 2", "2"), ("NAXIS3 = 1\nNAXIS4 = 4", "4")] {
        let i = light(&format!("{card}\n"));
        assert!(!i.usable && says(&i.refused, &["a cube of", planes, "DATE-OBS"]), "{card}: {:?}", i.refused);
        assert!(!says(&i.refused, &["colour"]), "{card}: {:?}", i.refused);
    }
    assert!(light("NAXIS3 = 1\n").usable);
}

#[test]
fn calibration_is_not_done_twice() {
    let done = light("CALSTAT = 'BDF'\nPEDESTAL = -100\n");
    assert!(!done.usable && says(&done.refused, &["CALSTAT", "flat-fielded"]), "{:?}", done.refused);
    assert_eq!((done.calibration.state, done.calibration.pedestal_adu), ("flat divided", Some(-100.0)));
    let half = |sets: &[&str]| inspected_at_macquarie(sets, &format!("{START}CALSTAT = 'BD'\nPEDESTAL = -100\n"));
    let twice = half(&["detector.pedestal_adu=500"]);
    assert!(!twice.usable && says(&twice.refused, &["are subtracted already", "set it to 100"]), "{:?}", twice.refused);
    assert!(half(&["detector.pedestal_adu=100"]).usable);
    assert_eq!(light("OBJECT = 'x'\n").calibration.state, "not stated (raw)");
}

#[test]
fn strings_hierarch_continue_twins_and_absent_keys_are_no_trouble() {
    let i = inspected(
        "EXPTIME = '5.0     '\nHIERARCH CAMERA-DATE-OBS = '2025-06-09T10:33:00.000' / start\nOBJECT = 'a very long name &'\n\
         CONTINUE  'that goes on'\nAIRMASS = '1.25'\nGAIN = '200'\nGAIN = 100\nEGAIN = 8.44D-02\n",
    );
    assert_eq!(i.exptime_s.unwrap().value, 5.0);
    assert_eq!(i.object.as_deref(), Some("a very long name that goes on"));
    assert_eq!((i.airmass, i.gain.gain_setting), (Some(1.25), Some(200)));
    assert_eq!(i.gain.header_e_per_adu.unwrap().value, 0.0844);
    assert!(says(&i.warnings, &["GAIN stands twice", "'200'", "'100'"]), "{:?}", i.warnings);
    let bare = inspected("OBJECT = 'nothing else'\n");
    assert!(!bare.usable && says(&bare.refused, &["EXPTIME", "header.aliases.exptime"]));
    assert!(says(&bare.refused, &["header.aliases.date_obs"]));
}

#[test]
fn a_flat_of_the_other_row_order_is_taken_out_of_the_night() {
    let folder = tempfile::tempdir().unwrap();
    let frame = |name: &str, kind: &str, order: &str| {
        let cards = [
            "SIMPLE  =                    T".to_string(),
            "BITPIX  =                    8".into(),
            "NAXIS   =                    2".into(),
            "NAXIS1  =                    4".into(),
            "NAXIS2  =                    4".into(),
            format!("IMAGETYP= '{kind}'"),
            "EXPTIME =                  5.0".into(),
            "DATE-OBS= '2025-06-09T10:33:00.0'".into(),
            format!("ROWORDER= '{order}'"),
            "END".into(),
        ];
        let mut bytes: Vec<u8> = cards.iter().flat_map(|c| format!("{c:<80}").into_bytes()).collect();
        bytes.resize(2880, b' ');
        bytes.resize(2 * 2880, 0);
        std::fs::write(folder.path().join(name), bytes).unwrap();
    };
    frame("flat_1.fits", "FLAT", "TOP-DOWN");
    frame("flat_2.fits", "FLAT", "BOTTOM-UP");
    frame("light.fits", "LIGHT", "TOP-DOWN");
    let night = format!(
        "preset = \"macquarie-cdk24\"\n[night]\nname = \"n\"\ninput = [{:?}]\noutput = \"o\"\n",
        folder.path().display().to_string()
    );
    let survey = survey(&Config::from_text(&night, &[]).unwrap(), &[], &[]).unwrap();
    assert_eq!((survey.flats.len(), survey.unreadable.len()), (1, 1));
    assert_eq!((survey.flats[0].name.as_str(), survey.flats[0].role), ("flat_1.fits", Role::Flat));
    let why = survey.unreadable[0].error.to_string();
    assert!(why.contains("ROWORDER") && why.contains("upside down"), "{why}");
}

#[test]
fn a_wcs_that_contradicts_the_pointing_is_refused_and_a_mosaics_reference_is_not() {
    let wcs = "CTYPE1 = 'RA---TAN'\nCTYPE2 = 'DEC--TAN'\nCRVAL1 = 232.2755534\nCRVAL2 = 0.0963\nCD1_1 = 8.444E-4\nCD1_2 = -2.5E-6\n\
               CD2_1 = 2.5E-6\nCD2_2 = 8.444E-4\nCRPIX2 = 256.5\n";
    let wrong = light(&format!("{wcs}CRPIX1 = -511.5\nRA = '15:28:35.7'\nDEC = '-0:00:00.0'\n")).wcs;
    assert!(wrong.state == "refused" && wrong.note.contains("does not fit the sky"), "{wrong:?}");
    assert!(wrong.note.contains("`solve` finds") && wrong.note.contains("pixel position"), "{wrong:?}");
    let right = light(&format!("{wcs}CRPIX1 = 500.0\nRA = '15:28:35.7'\nDEC = '-0:00:00.0'\n")).wcs;
    assert_eq!(right.state, "read");
    let mosaic = light(&format!("{wcs}CRPIX1 = -5110.5\nRA = 232.2755534\nDEC = 0.0963\n")).wcs;
    assert_eq!(mosaic.state, "read");
    let chip = light(&format!("{wcs}CRPIX1 = -511.5\nRA = '15:28:35.7'\nDEC = '-0:00:00.0'\nCCDNUM = 7\n")).wcs;
    assert_eq!(chip.state, "read", "a chip of a mosaic does not contain the pointing");
    let scale = light(&format!("{wcs}CRPIX1 = 500.0\nXPIXSZ = 3.76\nFOCALLEN = 3962.0\n")).wcs;
    assert!(scale.state == "refused" && scale.note.contains("arcsec/px"), "{scale:?}");
    let none =
        light("CTYPE1 = 'RA---TAN'\nCTYPE2 = 'DEC--TAN'\nCRVAL1 = 1.0\nCRVAL2 = 2.0\nCRPIX1 = 5\nCRPIX2 = 5\n").wcs;
    assert!(none.state == "refused" && none.note.contains("CD1_1") && none.note.contains("`solve` finds"), "{none:?}");
}

#[test]
fn the_real_frame_with_the_wrong_wcs_is_refused_and_still_measurable() {
    let Some(frames) = shared("data/frames") else { return };
    let i = Inspector::new(None, &[]).unwrap().inspect(&frames.join("astride_long.fits")).unwrap();
    assert!(i.wcs.state == "refused" && i.wcs.note.contains("`solve` finds"), "{:?}", i.wcs);
    assert!(i.usable, "the pixels are fine: {:?}", i.refused);
    assert!(i.time.as_ref().unwrap().time_source.starts_with("JD - EXPTIME/2"), "{:?}", i.time);
    assert!(says(&i.time_rejected, &["26/07/102"]), "{:?}", i.time_rejected);
    for good in ["huntsman_science.fits", "cutout_lco_bi327715.fits", "cutout_vatt_v.fits", "cutout_HSCA21787010.fits"]
    {
        let i = Inspector::new(None, &[]).unwrap().inspect(&frames.join(good)).unwrap();
        assert_eq!(i.wcs.state, "read", "{good}: {:?}", i.wcs);
    }
}
