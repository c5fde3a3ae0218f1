//! Bytes as a file, lines as the cards of one: scanned, classified under a configuration, and inspected without one.
#![no_main]

use std::sync::LazyLock;

use libfuzzer_sys::fuzz_target;
use satphot::config::Config;
use satphot::fits::Header;
use satphot::frames::classify;
use satphot::pipeline::inspect::inspector::Inspector;
use satphot_fuzz::{as_file, as_fits};

const NIGHT: &str =
    "preset = \"macquarie-cdk24\"\n[night]\nname = \"n\"\ninput = [\".\"]\noutput = \"o\"\n[detector]\nuse_header_egain = true\n";
static CONFIG: LazyLock<Config> = LazyLock::new(|| Config::from_text(NIGHT, &[]).expect("a configuration"));
static INSPECTOR: LazyLock<Inspector> = LazyLock::new(|| Inspector::new(None, &[]).expect("an inspector"));

satphot_fuzz::entry!();

fuzz_target!(|bytes: &[u8]| {
    let path = as_file("fits", &as_fits(bytes, &[0; 2880]));
    if let Ok(exposure) = classify(&path, &CONFIG, &["ISS".to_string()]) {
        let detector = satphot::frames::Detector::from_config(&CONFIG.detector).expect("a detector");
        let _ = detector.gain(&exposure);
    }
    let _ = INSPECTOR.inspect(&path);
    let text = as_file("txt", bytes);
    let _ = INSPECTOR.inspect(&text);
    let header = Header::from_text(&String::from_utf8_lossy(bytes));
    for card in header.cards() {
        assert!(header.card(&card.keyword).is_some() || card.keyword.trim() != card.keyword, "{card:?}");
    }
});
