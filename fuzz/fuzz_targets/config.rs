//! A text as pipeline.toml and as a scenario; the first line may be a `--set`. What is accepted is written and read again.
#![no_main]

use libfuzzer_sys::fuzz_target;
use satphot::config::Config;
use satphot::frames::Detector;
use satphot::simulate::Scenario;
use satphot::orbit::Site;

const NIGHT: &str = "preset = \"macquarie-cdk24\"\n[night]\nname = \"n\"\ninput = [\".\"]\noutput = \"o\"\n";

satphot_fuzz::entry!();

fuzz_target!(|bytes: &[u8]| {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    let (first, rest) = text.split_once('\n').unwrap_or((text, ""));
    let sets = first.strip_prefix("--set ").map(|s| vec![s.to_string()]);
    let (sets, body) = match sets {
        Some(sets) => (sets, if rest.is_empty() { NIGHT } else { rest }),
        None => (Vec::new(), text),
    };
    let _ = Scenario::crowded_night(&sets);
    let _ = Scenario::from_text(body, &sets);
    let Ok(config) = Config::from_text(body, &sets) else { return };
    let _ = Detector::from_config(&config.detector);
    let _ = Site::from_config(&config.site);
    let saved = config.to_toml().expect("what was read can be written");
    let again = Config::from_text(&saved, &[]).expect("what was written can be read");
    assert_eq!(again.to_toml().expect("toml"), saved);
});
