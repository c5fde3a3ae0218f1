//! Tests of `catalogue`.

use super::*;
use std::io::Write;

fn read(text: &str, columns: &[(&str, &str)]) -> Result<Catalogue> {
    let mut file = tempfile::NamedTempFile::new().unwrap();
    file.write_all(text.as_bytes()).unwrap();
    let columns = columns.iter().map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect();
    Catalogue::read(file.path(), &columns)
}

#[test]
fn comma_semicolon_tab_and_space_tables_read_the_same() {
    let names = ["recno", "RAJ2000", "DEJ2000", "Vmag", "e_Vmag", "B-V", "e_B-V"];
    let row = ["7", "359.5", "-10.25", "12.125", "0.03", "0.65", "0.05"];
    let want = CatalogueStar {
        id: "7".into(),
        ra_deg: 359.5,
        dec_deg: -10.25,
        v_mag: 12.125,
        v_err_mag: Some(0.03),
        b_v_mag: Some(0.65),
        b_v_err_mag: Some(0.05),
        ..CatalogueStar::default()
    };
    for d in [",", ";", "\t", "|", " ", "   "] {
        let c = read(&format!("{}\r\n{}\r\n", names.join(d), row.join(d)), &[]).unwrap();
        assert_eq!((c.stars.len(), &c.stars[0]), (1, &want), "separator {d:?}");
    }
}

#[test]
fn sentinels_are_unknown_and_rows_without_magnitude_are_counted() {
    let c = read(
        "RAJ2000,DEJ2000,Vmag,e_Vmag,B-V,e_B-V,Bmag,e_Bmag\n\
         10,20,12.0,0.0,0.0,0.0,12.6,0.04\n\
         11,20,12.0,99.999,,,99.999,\n\
         12,20,12.0,NaN,99.999,0.1,0.0,\n\
         13,20,12.0,0.03,0.0,0.02,,\n\
         10,20,99.999,,0.5,,,\n\
         10,20,0.0,0.0,0.5,,,\n\
         ,20,12,,0.5,,,\n\
         10,95,12,,0.5,,,\n\
         10,20\n",
        &[],
    )
    .unwrap();
    assert_eq!(c.stars.len(), 4);
    assert!(c.stars[..3].iter().all(|s| s.v_err_mag.is_none()));
    assert!((c.stars[0].b_v_mag.unwrap() - 0.6).abs() < 1e-12); // from Bmag − Vmag
    assert_eq!(c.stars[0].b_v_err_mag, None); // V has no error
    assert_eq!((c.stars[1].b_v_mag, c.stars[2].b_v_mag), (None, None));
    assert_eq!(c.stars[3].b_v_mag, Some(0.0)); // an A0 star with an error is a star
    assert_eq!((c.n_skipped, c.skipped.len()), (5, 5));
    assert!(c.skipped[0].contains("line 6") && c.skipped[0].contains("99.999"), "{:?}", c.skipped);
}

#[test]
fn a_missing_column_is_named_with_those_present_and_the_key_that_helps() {
    let text = "alpha,delta,mag\n1,2,3\n";
    let message = read(text, &[]).unwrap_err().to_string();
    assert!(["RAJ2000", "alpha, delta, mag", "stars.columns.ra_deg"].iter().all(|w| message.contains(w)), "{message}");
    let own = [("ra_deg", "alpha"), ("dec_deg", "delta"), ("v_mag", "mag")];
    assert_eq!(read(text, &own).unwrap().stars[0].v_mag, 3.0);
    let message = read(text, &[("ra_deg", "right"), ("dec_deg", "delta")]).unwrap_err().to_string();
    assert!(message.contains("`right`") && message.contains("stars.columns.ra_deg"), "{message}");
    let e = read(text, &[("declination", "delta")]).unwrap_err();
    assert!(matches!(&e, Error::Config { key, .. } if key == "stars.columns.declination"));
}

#[test]
fn an_empty_file_and_a_file_without_usable_rows_are_errors() {
    for text in ["", "\n", "# comment only\n", "RAJ2000,DEJ2000,Vmag\n", "RAJ2000,DEJ2000,Vmag\n1,2,\n"] {
        assert!(matches!(read(text, &[]), Err(Error::Catalogue { .. })), "{text:?}");
    }
}

#[test]
fn ecsv_keeps_quoted_names_and_reads_the_unit_of_places() {
    let head = "# %ECSV 1.0\n# ---\n# delimiter: ','\n# datatype:\n# - {name: RAJ2000, unit: deg, datatype: float64}\n";
    let body = "RAJ2000,DEJ2000,Vmag,\"g'mag\",e_Vmag\n1.5,2.5,12,\"\",\"\"\n";
    let c = read(&format!("{head}{body}"), &[]).unwrap();
    assert_eq!((c.stars[0].ra_deg, c.stars[0].v_err_mag), (1.5, None));
    let hours = head.replace("unit: deg", "unit: hourangle");
    assert_eq!(read(&format!("{hours}{body}"), &[]).unwrap().stars[0].ra_deg, 22.5);
    let pixels = head.replace("unit: deg", "unit: pix");
    let message = read(&format!("{pixels}{body}"), &[]).unwrap_err().to_string();
    assert!(message.contains("`pix`") && message.contains("degrees"), "{message}");
}

#[test]
fn the_unit_and_dash_lines_of_vizier_text_are_no_rows() {
    let c = read("#RESOURCE=x\nRAJ2000\tDEJ2000\tVmag\ndeg\tdeg\tmag\n---\t---\t---\n1\t2\t12\n", &[]).unwrap();
    assert_eq!((c.stars.len(), c.n_skipped), (1, 0));
}

#[test]
fn near_sees_across_zero_hours_and_the_pole_and_sorts_by_brightness() {
    let c = read("RAJ2000,DEJ2000,Vmag\n359.9,0,13\n0.1,0,12\n1.0,0,11\n90,89.95,10\n270,89.95,9\n", &[]).unwrap();
    let mags = |v: Vec<usize>| v.iter().map(|&i| c.stars[i].v_mag).collect::<Vec<_>>();
    assert_eq!(mags(c.near(0.0, 0.0, 0.2)), [12.0, 13.0]);
    assert_eq!(mags(c.near(0.0, 90.0, 0.1)), [9.0, 10.0]);
}
