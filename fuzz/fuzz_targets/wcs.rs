//! Lines as header cards, their world coordinates, pixels to the sky and back.
#![no_main]

use libfuzzer_sys::fuzz_target;
use satphot::fits::Header;
use satphot::astrometry::wcs::Wcs;

satphot_fuzz::entry!();

fuzz_target!(|bytes: &[u8]| {
    let header = Header::from_text(&String::from_utf8_lossy(bytes));
    let Ok(Some(wcs)) = Wcs::from_keys(&|key| header.number(key), &|key| header.text(key)) else { return };
    for (x, y) in [(0.0, 0.0), (100.5, 31.25), (-1e6, 1e9), (f64::NAN, 0.0), (1e300, -1e300)] {
        let (ra_deg, dec_deg) = wcs.pixel_to_sky(x, y);
        let _ = wcs.sky_to_pixel(ra_deg, dec_deg);
    }
    for (ra_deg, dec_deg) in [(0.0, 90.0), (359.999, -90.0), (180.0, 0.0), (f64::INFINITY, f64::NAN)] {
        let _ = wcs.sky_to_pixel(ra_deg, dec_deg);
    }
    let _ = (wcs.mirrored(), wcs.rotation_deg(), wcs.is_distorted(), wcs.scale_arcsec());
    let _ = wcs.header_file((100, 100));
    let written = wcs.cards();
    assert!(written.iter().all(|(key, _, _)| key.len() <= 8), "{written:?}");
});
