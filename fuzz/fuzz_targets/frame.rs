//! A whole FITS file, plain or compressed by tiles: its pixels through our reader, its checksums, its histogram.
#![no_main]

use std::sync::LazyLock;

use libfuzzer_sys::fuzz_target;
use satphot::config::Config;
use satphot::detector::count_values;
use satphot::frames::{Buffers, ElectronsPerAdu, Gain, classify, read};
use satphot::fits::wrong_checksum;
use satphot_fuzz::{as_file, as_fits};

const NIGHT: &str = "preset = \"macquarie-cdk24\"\n[night]\nname = \"n\"\ninput = [\".\"]\noutput = \"o\"\n";
static CONFIG: LazyLock<Config> = LazyLock::new(|| Config::from_text(NIGHT, &[]).expect("a configuration"));

satphot_fuzz::entry!();

fuzz_target!(|bytes: &[u8]| {
    let path = as_file("frame.fits", &as_fits(bytes, &[7; 5760]));
    let Ok(exposure) = classify(&path, &CONFIG, &[]) else { return };
    // what a reader would have to allocate is bounded by the file: an image of many pixels from a few bytes is refused
    let gain = Gain {
        setting: None,
        e_per_adu: ElectronsPerAdu(1.0),
        source: String::new(),
        read_noise_e: 1.0,
        pedestal_adu: 0.0,
        saturation_adu: 65_000.0,
    };
    let buffers = Buffers::default();
    let _ = read(&exposure, gain.clone(), None, None, &buffers);
    let _ = read(&exposure, gain, Some(3.0), None, &buffers);
    let _ = count_values(&exposure, None, 10_000);
    let _ = wrong_checksum(&path, &exposure.header);
});
