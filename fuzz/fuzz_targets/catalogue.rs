//! Bytes as a table of stars, whatever its dress: read as a catalogue, then as a table of own results.
#![no_main]

use std::collections::BTreeMap;

use libfuzzer_sys::fuzz_target;
use satphot::astrometry::catalogue::Catalogue;
use satphot_fuzz::as_file;

satphot_fuzz::entry!();

fuzz_target!(|bytes: &[u8]| {
    let path = as_file("csv", bytes);
    if let Ok(mut catalogue) = Catalogue::read(&path, &BTreeMap::new()) {
        let star = catalogue.stars[0].clone();
        assert!((0.0..=360.0).contains(&star.ra_deg) && (-90.0..=90.0).contains(&star.dec_deg), "{star:?}");
        catalogue.mark_ambiguous(5.0);
        let _ = catalogue.near(star.ra_deg, star.dec_deg, 0.5);
        let moved = catalogue.moved_to(2025.5, 2000.0);
        let _ = moved.near(star.ra_deg, star.dec_deg, 0.5);
    }
    let _ = satphot::tables::read_photometry(&path);
    let _ = satphot::tables::read_table(&path);
});
