//! APASS DR9 tables as VizieR writes them.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::collections::BTreeMap;
use std::path::PathBuf;

use satphot::photometry::catalogue::Catalogue;

/// The file in the shared data, or `None` with a line that says so.
fn shared(name: &str) -> Option<PathBuf> {
    let path = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data/standards")).join(name);
    if !path.exists() {
        println!("skipped: ../shared/data/standards/{name} not present");
        return None;
    }
    Some(path)
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
