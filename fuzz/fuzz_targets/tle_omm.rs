//! A text as a file of elements (TLE, 3LE, OMM in JSON, KVN, CSV, XML); each set is propagated from its epoch.
#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use satphot::orbit::{EarthOrientation, Propagator, Site, Tracker, check_age, element_names, elements_from_bytes};

satphot_fuzz::entry!();

fuzz_target!(|bytes: &[u8]| {
    let Ok(sets) = elements_from_bytes(bytes.to_vec(), Path::new("fuzz.tle")) else { return };
    for set in sets.iter().take(4) {
        let Ok(propagator) = Propagator::new(set) else { continue };
        for minutes in [0.0, 1.0, -1_440.0, 100_000.0] {
            if let Ok((position, velocity)) = propagator.state_after(minutes) {
                assert!(position.norm().is_finite() && velocity.norm().is_finite());
            }
        }
        let _ = propagator.state(&set.epoch());
        let _ = propagator.caveat();
        let _ = check_age(set, &set.epoch(), 3.0, false);
    }
    let _ = element_names(&sets);
    let epoch = sets[0].epoch();
    let norad = sets[0].norad_cat_id();
    let site = Site::new(-33.77, 151.11, 65.0).expect("a site");
    if let Ok(tracker) = Tracker::new(sets, Some(norad), site, EarthOrientation::default()) {
        let _ = tracker.at(&epoch);
    }
});
