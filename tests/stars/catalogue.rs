//! Catalogues in every dress they are served in, damaged ones, other catalogues, proper motions, duplicates and neighbours.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::collections::BTreeMap;
use std::io::Write;
use std::path::PathBuf;

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use satphot::astrometry::catalogue::{Catalogue, CatalogueStar, separation_deg};
use satphot::bands::Band;
use satphot::{Error, Result};

/// The file in the shared data, or `None` with a line that says so.
fn shared(name: &str) -> Option<PathBuf> {
    let path = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data/standards")).join(name);
    if !path.exists() {
        println!("skipped: ../shared/data/standards/{name} not present");
        return None;
    }
    Some(path)
}

/// A table made for these tests (invented stars, columns as VizieR names them), written by astropy 8.0.2.
fn data(name: &str) -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/catalogue")).join(name)
}

fn read_bytes(bytes: &[u8], columns: &[(&str, &str)]) -> Result<Catalogue> {
    let mut file = tempfile::NamedTempFile::new().unwrap();
    file.write_all(bytes).unwrap();
    let columns = columns.iter().map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect();
    Catalogue::read(file.path(), &columns)
}

fn read(text: &str) -> Result<Catalogue> {
    read_bytes(text.as_bytes(), &[])
}

fn refused(bytes: &[u8], words: &[&str]) {
    let error = read_bytes(bytes, &[]).unwrap_err();
    assert!(matches!(error, Error::Catalogue { .. }), "{error:?}");
    let message = error.to_string();
    assert!(words.iter().all(|w| message.contains(w)), "{message} should hold {words:?}");
}

#[test]
fn the_apass_tables_read_as_astropy_reads_them() {
    // (file, usable, skipped, sum of V, sum of B−V, unknown errors of V): astropy 8.0.2 Table.read
    let files =
        [("apass_dr9_subset.ecsv", 2, 0, 28.565, 2.375, 0), ("apass_dr9_ey_uma.ecsv", 51, 3, 765.086, 40.964, 5)];
    for (name, n, skipped, v, b_v, unknown) in files {
        let Some(path) = shared(name) else { continue };
        let c = Catalogue::read(&path, &BTreeMap::new()).unwrap();
        assert_eq!((c.stars.len(), c.n_skipped), (n, skipped), "{name}: {:?}", c.skipped);
        // the table has three decimals
        assert!((c.stars.iter().map(|s| s.v_mag).sum::<f64>() - v).abs() < 5e-4);
        assert!((c.stars.iter().filter_map(|s| s.b_v_mag).sum::<f64>() - b_v).abs() < 5e-4);
        assert_eq!(c.stars.iter().filter(|s| s.v_err_mag.is_none()).count(), unknown);
    }
}

#[test]
fn a_row_of_the_subset_has_every_value_in_its_place() {
    let Some(path) = shared("apass_dr9_subset.ecsv") else { return };
    let c = Catalogue::read(&path, &BTreeMap::new()).unwrap();
    let s = &c.stars[1];
    assert_eq!((s.id.as_str(), s.ra_deg, s.dec_deg, s.v_mag), ("16572916", 0.419892, -0.842144, 15.166));
    assert_eq!((s.v_err_mag, s.b_v_mag, s.b_v_err_mag), (Some(0.08), Some(0.957), Some(0.081)));
}

#[test]
fn one_catalogue_reads_the_same_in_every_format() {
    let sums = |c: &Catalogue| {
        let sum = |f: &dyn Fn(&CatalogueStar) -> f64| c.stars.iter().map(f).sum::<f64>();
        [
            sum(&|s| s.v_mag),
            sum(&|s| s.ra_deg),
            sum(&|s| s.dec_deg),
            sum(&|s| f64::from(s.n_obs.unwrap())),
            sum(&|s| f64::from(u8::from(s.v_err_mag.is_none()))),
        ]
    };
    let first = Catalogue::read(&data("apass.ecsv"), &BTreeMap::new()).unwrap();
    // numpy's own sums over the rows whose Vmag is not masked
    let astropy = [469.426, 5044.042416, -368.539142, 652.0, 7.0];
    for (ours, theirs) in sums(&first).iter().zip(astropy) {
        assert!((ours - theirs).abs() < 1e-5, "{ours} against {theirs}");
    }
    for name in ["apass.csv", "apass.tsv", "apass.vot", "apass_binary.vot", "apass_binary2.vot"] {
        let c = Catalogue::read(&data(name), &BTreeMap::new()).unwrap();
        assert_eq!((c.stars.len(), c.n_skipped), (37, 3), "{name}: {:?}", c.skipped);
        for (a, b) in first.stars.iter().zip(&c.stars) {
            assert_eq!((&a.id, a.n_obs), (&b.id, b.n_obs), "{name}");
            let values = |s: &CatalogueStar| {
                [Some(s.ra_deg), Some(s.dec_deg), Some(s.v_mag), s.v_err_mag, s.b_v_mag, s.b_v_err_mag]
            };
            for (x, y) in values(a).iter().zip(values(b)) {
                // three decimals of a magnitude kept as f32
                assert!(
                    x.is_some() == y.is_some() && (x.unwrap_or(0.0) - y.unwrap_or(0.0)).abs() < 1e-5,
                    "{name} {a:?} {b:?}"
                );
            }
        }
    }
}

#[test]
fn sexagesimal_columns_of_vizier_are_the_same_places() {
    let degrees = Catalogue::read(&data("apass.csv"), &BTreeMap::new()).unwrap();
    let parts = Catalogue::read(&data("sexagesimal.txt"), &BTreeMap::new()).unwrap();
    assert_eq!(parts.stars.len(), 37);
    for (a, b) in degrees.stars.iter().zip(&parts.stars) {
        // the file has 1e-6 s and 1e-5 arcsec
        assert!(separation_deg(a.ra_deg, a.dec_deg, b.ra_deg, b.dec_deg) * 3600.0 < 1e-4, "{a:?} {b:?}");
    }
}

#[test]
fn a_votable_with_own_names_is_known_by_its_descriptors() {
    let field = |name: &str, ucd: &str| format!("<FIELD name=\"{name}\" datatype=\"double\" ucd=\"{ucd}\"/>");
    let fields = [
        field("alpha", "pos.eq.ra;meta.main"),
        field("delta", "pos.eq.dec;meta.main"),
        field("mag &lt;V&gt;", "phot.mag;em.opt.V"),
        field("s", "stat.error;phot.mag;em.opt.V"),
        field("mu1", "pos.pm;pos.eq.ra").replace("/>", " unit=\"mas/yr\"/>"),
        field("mu2", "pos.pm;pos.eq.dec").replace("/>", " unit=\"mas/yr\"><VALUES null=\"-9999\"/></FIELD>"),
    ];
    let rows = "<TR><TD>10</TD><TD>-20</TD><TD>12.5</TD><TD>0.02</TD><TD>5</TD><TD>-7</TD></TR>\
        <TR><TD>11</TD><TD>-20</TD><TD>13.5</TD><TD/><TD>5</TD><TD>-9999</TD></TR>";
    let xml = |info: &str, body: &str| {
        format!("<?xml version=\"1.0\"?>\n<VOTABLE version=\"1.4\"><RESOURCE>{info}{body}</RESOURCE></VOTABLE>")
    };
    let table = format!("<TABLE>{}<DATA><TABLEDATA>{rows}</TABLEDATA></DATA></TABLE>", fields.concat());
    let overflow = "<INFO name=\"QUERY_STATUS\" value=\"OVERFLOW\"/>";
    let c = read(&xml(overflow, &table)).unwrap();
    let s = &c.stars[0];
    assert_eq!((s.ra_deg, s.dec_deg, s.v_mag, s.v_err_mag), (10.0, -20.0, 12.5, Some(0.02)));
    assert_eq!((s.pm_ra_mas_yr, s.pm_dec_mas_yr), (Some(5.0), Some(-7.0)));
    assert_eq!((c.stars[1].pm_dec_mas_yr, c.stars[1].v_err_mag), (None, None));
    assert!(c.notes.iter().any(|n| n.contains("OVERFLOW")), "{:?}", c.notes);
    let error = "<INFO name=\"QUERY_STATUS\" value=\"ERROR\">no such table</INFO>";
    refused(xml(error, "").as_bytes(), &["no such table"]);
    let whole = xml("", &table);
    refused(&whole.as_bytes()[..whole.find("13.5").unwrap()], &["VOTable"]);
    let old = table.replacen("ucd=\"pos.eq.ra;meta.main\"", "ucd=\"pos.eq.ra;meta.main\" ref=\"B\"", 1);
    let system = "<COOSYS ID=\"B\" system=\"eq_FK4\" equinox=\"B1950\"/>";
    refused(xml(system, &old).as_bytes(), &["eq_FK4 B1950", "J2000"]);
}

#[test]
fn damaged_files_are_refused_with_what_they_are() {
    let rows = "RAJ2000,DEJ2000,Vmag\n10,20,12.5\n11,21,13.5\n";
    refused(b"", &["empty"]);
    refused(b"RAJ2000,DEJ2000,Vmag\r\n", &["no rows"]);
    refused(b"RAJ2000,DEJ2000\n10,20\n", &["Vmag", "RAJ2000, DEJ2000", "stars.columns.v_mag"]);
    refused(b"RAB1950,DEB1950,Vmag\n10,20,12\n", &["RAB1950", "equinox", "J2000"]);
    refused(b"RAJ2000,DEJ2000,Vmag\n10;20;12.5\n", &["1 cells, but 3 column names", "line 2"]);
    refused(b"SIMPLE  =                    T", &["FITS"]);
    refused(b"\x1f\x8b\x08\x00garbage", &["gzip"]);
    refused(b"\xff\xfeR\x00A\x00", &["UTF-8"]);
    refused(b"<!DOCTYPE html><html><body>Error 503</body></html>", &["web page"]);
    refused(b"<?xml version=\"1.0\"?><kml></kml>", &["no VOTable"]);
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let garbage: Vec<u8> = (0..5_000).map(|_| rng.random()).collect();
    refused(&garbage, &["not a text"]);
    // a cut last row, a lone quote and a row of another table cost themselves only
    let c = read(&format!("{rows}12,2")).unwrap();
    assert_eq!((c.stars.len(), c.n_skipped), (2, 1));
    assert!(c.skipped[0].contains("line 4"), "{:?}", c.skipped);
    let c = read("id,RAJ2000,DEJ2000,Vmag\n\"a,10,20,12.5\nb,11,21,13.5\nc,12,22,14.5\n").unwrap();
    assert_eq!((c.stars.len(), c.n_skipped), (2, 1));
    assert!(c.skipped[0].contains("quote"), "{:?}", c.skipped);
}

#[test]
fn rows_that_take_no_bytes_are_refused_and_an_empty_field_among_others_is_none() {
    let table = |sizes: [&str; 3], bytes: &str| {
        let field = |(name, size): (&str, &str)| match size {
            "" => format!("<FIELD name=\"{name}\" datatype=\"double\"/>"),
            _ => format!("<FIELD name=\"{name}\" datatype=\"char\" arraysize=\"{size}\"/>"),
        };
        let fields: String = ["RAJ2000", "DEJ2000", "Vmag"].into_iter().zip(sizes).map(field).collect();
        let name = field(("id", "0"));
        format!(
            "<?xml version=\"1.0\"?><VOTABLE><RESOURCE><TABLE>{fields}{name}<DATA><BINARY><STREAM encoding=\"base64\">\
             {bytes}</STREAM></BINARY></DATA></TABLE></RESOURCE></VOTABLE>"
        )
    };
    refused(table(["0", "0", "0"], "AAAA").as_bytes(), &["0 bytes", "arraysize", "TABLEDATA"]);
    refused(table(["0x18446744073709551615x9", "0", "0"], "AAAA").as_bytes(), &["VOTable"]);
    // 10, 20 and 12 as doubles
    assert_eq!(read(&table(["", "", ""], "QCQAAAAAAABANAAAAAAAAEAoAAAAAAAA")).unwrap().stars.len(), 1);
}

#[test]
fn a_table_of_more_columns_than_any_has_is_refused() {
    let names: String = (0..20_000).map(|i| format!("c{i},")).collect();
    refused(format!("{names}RAJ2000,DEJ2000,Vmag\n").as_bytes(), &["columns", "not a table"]);
}

#[test]
fn line_ends_marks_and_letters_of_other_systems_do_no_harm() {
    let text = "RAJ2000,DEJ2000,Vmag,id\n10,20,12.5,a\n11,21,13.5,b\n";
    let want = read(text).unwrap().stars;
    for other in
        [text.replace('\n', "\r\n"), text.replace('\n', "\r"), format!("\u{feff}{text}"), format!("\n# x\n{text}\n")]
    {
        assert_eq!(read(&other).unwrap().stars, want, "{other:?}");
    }
    let latin = [b"RAJ2000,DEJ2000,Vmag,id\n10,20,12.5,".as_slice(), b"Kr\xfcger 60\n"].concat();
    assert_eq!(read_bytes(&latin, &[]).unwrap().stars[0].id, "Kr\u{fffd}ger 60");
}

#[test]
fn a_file_without_names_and_one_with_names_in_a_remark_are_read() {
    let c = read("# ra dec Vmag B-V\n10 20 12.5 0.5\n11 21 13.5 0.6\n").unwrap();
    assert_eq!((c.stars.len(), c.stars[1].b_v_mag), (2, Some(0.6)));
    let sextractor = "#   1 ALPHA_J2000  Right ascension [deg]\n#   2 DELTA_J2000  Declination [deg]\n\
        #   3 MAG_APER     Magnitudes [mag]\n#   6 V            Catalogue [mag]\n  10.0 20.0 -9.1 -9.2 -9.3 12.5\n";
    let c = read(sextractor).unwrap();
    assert_eq!((c.stars[0].ra_deg, c.stars[0].v_mag), (10.0, 12.5));
    let own = [("ra_deg", "col2"), ("dec_deg", "col3"), ("v_mag", "col4"), ("b_v_mag", "col5")];
    let Some(landolt) = shared("landolt_1992.dat") else { return };
    let own = own.iter().map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect();
    let c = Catalogue::read(&landolt, &own).unwrap();
    assert_eq!((c.stars.len(), c.n_skipped), (526, 0), "{:?}", c.skipped);
    // TPHE_A 00:30:09 -46:31:22, V 14.651
    let s = &c.stars[0];
    assert!((s.ra_deg - 7.5375).abs() < 1e-9 && (s.dec_deg + 46.522_777_777).abs() < 1e-6, "{s:?}");
    assert_eq!((s.v_mag, s.b_v_mag), (14.651, Some(0.793)));
    assert!(c.notes[0].contains("col17"), "{:?}", c.notes);
}

#[test]
fn tycho_and_gaia_columns_give_johnson_magnitudes_and_say_so() {
    let tycho = "TYC1\tTYC2\tTYC3\tRAmdeg\tDEmdeg\tpmRA\tpmDE\tBTmag\te_BTmag\tVTmag\te_VTmag\n\
        \t\t\tdeg\tdeg\tmas/yr\tmas/yr\tmag\tmag\tmag\tmag\n---\t---\t---\t---\t---\t---\t---\t---\t---\t---\t---\n\
        1\t13\t1\t1.12558209\t2.26739400\t27.7\t-0.5\t10.488\t0.038\t8.670\t0.015\n\
        9537\t400\t1\t300.0\t-80.0\t 10.0\t 20.0\t10.500\t0.040\t10.000\t0.030\n";
    let c = read(tycho).unwrap();
    assert!(c.notes[0].contains("Tycho") && c.n_skipped == 1 && c.skipped[0].contains("BT-VT"), "{c:?}");
    let s = &c.stars[0];
    assert_eq!((s.id.as_str(), s.pm_ra_mas_yr), ("9537-400-1", Some(10.0)));
    assert!((s.v_mag - 9.955).abs() < 1e-12 && (s.b_v_mag.unwrap() - 0.425).abs() < 1e-12);
    // √((1.09 0.03)² + (0.09 0.04)² + 0.015²), √(0.85² (0.04² + 0.03²) + 0.05²)
    assert!(
        (s.v_err_mag.unwrap() - 0.036_155).abs() < 1e-5 && (s.b_v_err_mag.unwrap() - 0.065_622).abs() < 1e-5,
        "{s:?}"
    );
    let gaia =
        "RA_ICRS,DE_ICRS,Source,pmRA,pmDE,Gmag,BPmag,RPmag\n10,20,4778,3.5,-2.5,13.0,13.41,12.59\n11,20,4779,,,13,,\n";
    let c = read(gaia).unwrap();
    let s = &c.stars[0];
    assert_eq!((s.id.as_str(), s.epoch_jyear, c.n_skipped), ("4778", Some(2016.0), 1));
    // x = 0.82: G−V = −0.02704 + 0.0116768 − 0.14496944 + 0.00786244
    assert!((s.v_mag - 13.152_470).abs() < 1e-5 && s.v_err_mag.unwrap() >= 0.03, "{s:?}");
    assert!(c.notes[0].contains("Gaia"), "{:?}", c.notes);
}

#[test]
fn a_column_map_never_takes_the_errors_or_the_colour_of_another_band() {
    let text =
        "RAJ2000,DEJ2000,Vmag,e_Vmag,g_psf,e_g_psf,r_psf,e_r_psf,Bmag\n10,20,12.5,0.5,12.8,0.01,12.3,0.02,13.1\n";
    let one = |columns: &[(&str, &str)]| read_bytes(text.as_bytes(), columns).unwrap().stars[0].clone();
    let s = one(&[("v_mag", "g_psf")]);
    assert_eq!((s.v_mag, s.v_err_mag), (12.8, Some(0.01)));
    assert!((s.b_v_mag.unwrap() - 0.5).abs() < 1e-12, "the colour index of g is g - r");
    let s = one(&[("v_mag", "g_psf"), ("b_v_mag", "g_psf-r_psf")]);
    assert!((s.b_v_mag.unwrap() - 0.5).abs() < 1e-12 && (s.b_v_err_mag.unwrap() - 0.01_f64.hypot(0.02)).abs() < 1e-12);
}

#[test]
fn proper_motions_move_stars_as_astropy_moves_them() {
    let star = |ra_deg, dec_deg, ra, dec| CatalogueStar {
        ra_deg,
        dec_deg,
        pm_ra_mas_yr: Some(ra),
        pm_dec_mas_yr: Some(dec),
        epoch_jyear: Some(2016.0),
        ..CatalogueStar::default()
    };
    let still = CatalogueStar { ra_deg: 5.0, dec_deg: 5.0, ..CatalogueStar::default() };
    let stars = vec![
        star(10.0, -60.0, 1000.0, -2000.0),
        star(359.9999, 89.999, 5000.0, 3000.0),
        star(200.0, 0.0, -300.0, 50.0),
        still,
    ];
    let moved = Catalogue::from_stars(stars.clone()).moved_to(2025.44, 2000.0);
    // astropy 8.0.2, SkyCoord.apply_space_motion, distance 10 kpc
    let astropy = [
        (10.005_245_276, -60.005_244_340_5),
        (117.642_246_518_2, 89.985_199_583_3),
        (199.999_213_333_3, 0.000_131_111_1),
    ];
    for (s, (ra, dec)) in moved.stars.iter().zip(astropy) {
        // 1e-10 deg are printed; near the pole 1e-4 arcsec of the second order of the motion
        assert!(separation_deg(s.ra_deg, s.dec_deg, ra, dec) * 3600.0 < 1e-3, "{s:?} {ra} {dec}");
        assert_eq!(s.epoch_jyear, Some(2025.44));
    }
    assert_eq!(moved.stars[3], stars[3]);
    // positions without an epoch are of the given one, and there and back ends where it began but for
    // the second order of 22 arcsec: 22² / 206265 = 0.0024 arcsec
    let loose = CatalogueStar { epoch_jyear: None, ..stars[0].clone() };
    let there = Catalogue::from_stars(vec![loose.clone()]).moved_to(2010.0, 2000.0);
    let back = there.moved_to(2000.0, 1900.0);
    assert!(separation_deg(back.stars[0].ra_deg, back.stars[0].dec_deg, loose.ra_deg, loose.dec_deg) * 3600.0 < 5e-3);
}

#[test]
fn near_finds_what_a_look_at_every_star_finds() {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let stars: Vec<CatalogueStar> = (0..20_000)
        .map(|k| {
            // a third of them within a degree of a pole
            let z: f64 = rng.random_range(-1.0..1.0);
            let dec_deg =
                if k % 3 == 0 { z.signum() * (90.0 - rng.random_range(0.0..1.0)) } else { z.asin().to_degrees() };
            CatalogueStar {
                ra_deg: rng.random_range(0.0..360.0),
                dec_deg,
                v_mag: rng.random_range(8.0..16.0),
                ..CatalogueStar::default()
            }
        })
        .collect();
    let c = Catalogue::from_stars(stars);
    let (mut found, mut n_cases) = (0, 0);
    for _ in 0..200 {
        let at: (f64, f64) = match n_cases % 4 {
            0 => (rng.random_range(0.0..360.0), 90.0 - rng.random_range(0.0..1.0)),
            1 => (0.0, rng.random_range(-80.0..80.0)),
            _ => (rng.random_range(0.0..360.0), rng.random_range(-90.0..90.0)),
        };
        let radius = [0.1, 2.0, 30.0, 180.0][n_cases % 4];
        n_cases += 1;
        let mut want: Vec<usize> = (0..c.stars.len())
            .filter(|i| separation_deg(at.0, at.1, c.stars[*i].ra_deg, c.stars[*i].dec_deg) <= radius)
            .collect();
        want.sort_by(|a, b| c.stars[*a].v_mag.total_cmp(&c.stars[*b].v_mag));
        found += want.len();
        assert_eq!(c.near(at.0, at.1, radius), want, "{at:?} {radius}");
    }
    assert!(found > 100_000);
}

#[test]
fn one_star_twice_is_one_and_keeps_what_either_row_knows() {
    // 0.5 arcsec apart, 0.03 mag: one star; the second knows the colour. A third at the same place 2 mag fainter is another
    let text = "id,RAJ2000,DEJ2000,Vmag,e_Vmag,B-V,e_B-V\na,10,20,12.00,0.02,,\nb,10.00014,20,12.03,,0.6,0.05\nc,10,20,14.0,0.02,0.5,0.05\n";
    let c = read(text).unwrap();
    assert_eq!(c.stars.len(), 2);
    let s = c.stars.iter().find(|s| s.id == "b").unwrap();
    assert_eq!((s.b_v_mag, s.v_err_mag), (Some(0.6), Some(0.02)));
    assert!(c.notes.iter().any(|n| n.contains("1 entries")), "{:?}", c.notes);
    // two sources of Gaia are two stars, however close
    let gaia = "RA_ICRS,DE_ICRS,Gmag,BPmag,RPmag\n10,20,13,13.4,12.6\n10.0001,20,13,13.4,12.6\n";
    assert_eq!(read(gaia).unwrap().stars.len(), 2);
}

#[test]
fn stars_that_a_detection_cannot_tell_apart_are_ambiguous() {
    let star =
        |arcsec: f64, v_mag| CatalogueStar { ra_deg: 0.0, dec_deg: arcsec / 3600.0, v_mag, ..CatalogueStar::default() };
    // pairs 4 arcsec apart: alike; 2.5 mag; 4 mag (the fainter may be taken for the brighter, never the brighter for it)
    let stars = vec![
        star(0.0, 12.0),
        star(4.0, 12.5),
        star(100.0, 12.0),
        star(104.0, 14.5),
        star(200.0, 10.0),
        star(204.0, 14.0),
        star(300.0, 9.0),
    ];
    let mut c = Catalogue::from_stars(stars);
    c.mark_ambiguous(5.0);
    let marks: Vec<bool> = c.stars.iter().map(|s| s.ambiguous).collect();
    assert_eq!(marks, [true, true, true, true, false, true, false]);
    assert!((c.stars[4].neighbour_arcsec.unwrap() - 4.0).abs() < 1e-6 && c.stars[6].neighbour_arcsec.is_none());
    c.mark_ambiguous(3.0);
    assert!(c.stars.iter().all(|s| !s.ambiguous && s.neighbour_arcsec.is_none()));
}

/// Run by hand with `cargo test --release -- --ignored --nocapture million`.
#[test]
#[ignore = "writes 60 MB; a measurement of speed"]
fn a_million_rows_are_read_in_seconds() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let mut file = std::io::BufWriter::new(tempfile::NamedTempFile::new().unwrap());
    writeln!(file, "recno,RAJ2000,DEJ2000,B-V,e_B-V,Vmag,e_Vmag").unwrap();
    for k in 0..1_000_000 {
        let (ra, dec, v): (f64, f64, f64) =
            (rng.random_range(0.0..10.0), rng.random_range(-5.0..5.0), rng.random_range(10.0..17.0));
        writeln!(file, "{k},{ra:.6},{dec:.6},0.612,0.050,{v:.3},0.031").unwrap();
    }
    let file = file.into_inner().unwrap();
    let start = std::time::Instant::now();
    let mut c = Catalogue::read(file.path(), &BTreeMap::new()).unwrap();
    println!("read: {:?}, {} stars", start.elapsed(), c.stars.len());
    let start = std::time::Instant::now();
    c.mark_ambiguous(5.0);
    println!("ambiguous: {:?}, {}", start.elapsed(), c.stars.iter().filter(|s| s.ambiguous).count());
    let start = std::time::Instant::now();
    let n: usize = (0..1000).map(|k| c.near(f64::from(k) / 100.0, 0.0, 0.3).len()).sum();
    println!("tree and 1000 fields: {:?}, {n}", start.elapsed());
}

#[test]
fn magnitudes_of_a_band_come_from_its_own_column_or_are_made_from_others() {
    let read = |text: &str, band: Band| {
        let mut file = tempfile::NamedTempFile::new().unwrap();
        file.write_all(text.as_bytes()).unwrap();
        Catalogue::read_band(file.path(), &BTreeMap::new(), band).unwrap()
    };
    let apass = "RAJ2000,DEJ2000,Vmag,e_Vmag,B-V,e_B-V,Bmag,e_Bmag,g'mag,e_g'mag,r'mag,e_r'mag,i'mag,e_i'mag\n\
        10,20,12.0,0.02,0.65,0.03,12.65,0.02,12.30,0.02,11.85,0.02,11.73,0.03\n";
    // band, magnitude and index of the Sun at V = 12 (Willmer 2018), and how well
    for (band, mag, index, colour) in [
        (Band::V, 12.0, "B-V", 0.65),
        (Band::B, 12.65, "B-V", 0.65),
        (Band::R, 11.61, "B-V", 0.65),
        (Band::I, 11.29, "B-V", 0.65),
        (Band::SloanG, 12.30, "g-r", 0.45),
        (Band::SloanR, 11.85, "r-i", 0.12),
        (Band::SloanI, 11.73, "r-i", 0.12),
    ] {
        let c = read(apass, band);
        assert_eq!((c.band, c.colour.unwrap().to_string().as_str()), (Some(band), index));
        let star = &c.stars[0];
        assert!((star.v_mag - mag).abs() < 0.06, "{band}: {}", star.v_mag);
        assert!((star.b_v_mag.unwrap() - colour).abs() < 1e-9 && star.b_v_err_mag.is_some(), "{band}: {star:?}");
    }
    let gaia = "RA_ICRS,DE_ICRS,Gmag,e_Gmag,BPmag,e_BPmag,RPmag,e_RPmag\n10,20,11.86,0.003,12.18,0.003,11.36,0.003\n";
    for (band, mag) in [(Band::R, 11.61), (Band::SloanR, 11.83), (Band::GaiaG, 11.86), (Band::GaiaBp, 12.18)] {
        let c = read(gaia, band);
        assert_eq!((c.band, c.colour.unwrap().to_string().as_str()), (Some(band), "BP-RP"), "{band}");
        assert!((c.stars[0].v_mag - mag).abs() < 0.06, "{band}: {}", c.stars[0].v_mag);
        assert!((c.stars[0].b_v_mag.unwrap() - 0.82).abs() < 1e-9);
    }
    // ATLAS-REFCAT2 has Gaia's and Pan-STARRS' magnitudes: R from r, g from its own column
    let refcat = "RA_ICRS,DE_ICRS,Gmag,e_Gmag,BPmag,e_BPmag,RPmag,e_RPmag,gmag,e_gmag,gcontrib,rmag,e_rmag,imag,e_imag,zmag\n\
        10,20,11.86,0.003,12.18,0.003,11.36,0.003,12.22,0.01,7f,11.83,0.01,11.71,0.01,11.69\n";
    for (band, mag, index) in [
        (Band::R, 11.61, "g-r"),
        (Band::SloanG, 12.22, "g-r"),
        (Band::SloanZ, 11.69, "i-z"),
        (Band::GaiaG, 11.86, "BP-RP"),
    ] {
        let c = read(refcat, band);
        assert_eq!((c.band, c.colour.unwrap().to_string().as_str()), (Some(band), index), "{band}");
        assert!((c.stars[0].v_mag - mag).abs() < 0.03, "{band}: {}", c.stars[0].v_mag);
    }
    // Tycho-2 has no R: V, and it says so
    let tycho = "RAmdeg,DEmdeg,BTmag,e_BTmag,VTmag,e_VTmag\n10,20,9.5,0.02,9.0,0.02\n";
    assert_eq!(read(tycho, Band::R).band, Some(Band::V));
}
