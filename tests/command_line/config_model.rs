//! The keys of `[model]` and of a surface: what is refused, and by which words.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use satphot::config::{Arrays, Config, Effects, Mode};

const NIGHT: &str = "preset = \"macquarie-cdk24\"\n[night]\nname = \"n\"\ninput = [\"in\"]\noutput = \"out\"\n";

fn model(keys: &str) -> satphot::base::error::Result<Config> {
    Config::from_text(&format!("{NIGHT}[model]\nsatellite = \"iss\"\n{keys}"), &[])
}

fn surface(attitude: &str) -> satphot::base::error::Result<Config> {
    model(&format!(
        "[[model.surfaces]]\nname = \"wing\"\narea_m2 = 4.0\nattitude = {attitude}\nbrdf = {{ kind = \"lambert\", albedo = 0.2 }}\n"
    ))
}

#[test]
fn every_attitude_can_be_written_in_the_file() {
    for attitude in [
        "\"nadir\"",
        "\"sun\"",
        "\"sun_azimuth\"",
        "\"sun_to_nadir\"",
        "{ lvlh = [1, 0, 0.5] }",
        "{ inertial = { ra_deg = 83.6, dec_deg = 22 } }",
        "{ sun_one_axis = { axis_lvlh = [0, 1, 0], zero_lvlh = [0, 0, -1] } }",
        "{ sun_one_axis = { axis_lvlh = [0, 1, 0], zero_lvlh = [0, 0, -1], limit_deg = 60 } }",
        "{ sun_two_axes = {} }",
        "{ sun_two_axes = { azimuth_limit_deg = 90, elevation_deg = [0, 45] } }",
    ] {
        surface(attitude).unwrap_or_else(|e| panic!("{attitude}: {e}"));
    }
}

#[test]
fn attitudes_without_direction_and_limits_out_of_range_name_their_key() {
    for (attitude, words) in [
        ("{ lvlh = [0, 0, 0] }", &["model.surfaces.wing.attitude.lvlh", "no direction"][..]),
        ("{ lvlh = [nan, 0, 1] }", &["model.surfaces.wing.attitude.lvlh"]),
        ("{ lvlh = [0, 1] }", &["model.surfaces"]),
        ("{ inertial = { ra_deg = 0, dec_deg = 91 } }", &["inertial.dec_deg", "91", "deg"]),
        ("{ sun_one_axis = { axis_lvlh = [0, 0, 0], zero_lvlh = [0, 0, 1] } }", &["axis_lvlh"]),
        ("{ sun_one_axis = { axis_lvlh = [0, 1, 0], zero_lvlh = [0, 1, 0] } }", &["zero_lvlh", "0.00 deg", "90 deg"]),
        ("{ sun_one_axis = { axis_lvlh = [0, 1, 0], zero_lvlh = [1, 0, 0], limit_deg = 0 } }", &["limit_deg"]),
        ("{ sun_two_axes = { elevation_deg = [30, 10] } }", &["sun_two_axes.elevation_deg", "10"]),
        ("{ sun_two_axes = { azimuth_limit_deg = 181 } }", &["azimuth_limit_deg", "181"]),
        ("\"zenith\"", &["attitude", "zenith"]),
    ] {
        let message = surface(attitude).unwrap_err().to_string();
        for word in words {
            assert!(message.contains(word), "{word} is not in: {message}");
        }
    }
}

#[test]
fn numbers_and_names_of_the_model_are_checked() {
    for (keys, words) in [
        ("tolerance = 0.0", &["model.tolerance"][..]),
        ("k_mag_airmass = -0.1", &["model.k_mag_airmass", "mag/airmass"]),
        ("[model.effects]\nsource = \"extincted\"", &["model.k_mag_airmass", "extincted"]),
        ("band = \"Q\"", &["model.band", "B, V, R, I, g, r, i, z, G"]),
        ("[model.effects]\nshadow = \"square\"", &["model.effects.shadow", "square"]),
        ("[model.effects]\nshade = \"cylinder\"", &["did you mean \"shadow\""]),
    ] {
        let message = model(keys).unwrap_err().to_string();
        for word in words {
            assert!(message.contains(word), "{word} is not in: {message}");
        }
    }
    model("band = \"filters/clear.csv\"\nk_mag_airmass = 0.2\n[model.effects]\nsource = \"extincted\"").unwrap();
}

#[test]
fn two_surfaces_of_one_name_are_refused() {
    let one = "[[model.surfaces]]\nname = \"wing\"\narea_m2 = 4.0\nattitude = \"sun\"\nbrdf = { kind = \"lambert\", albedo = 0.2 }\n";
    let message = model(&format!("{one}{one}")).unwrap_err().to_string();
    assert!(message.contains("model.surfaces.wing") && message.contains("two surfaces"), "{message}");
}

#[test]
fn an_effect_of_the_file_wins_over_the_preset_of_the_mode() {
    let config = model("mode = \"as_published\"\n[model.effects]\narrays = \"as_listed\"").unwrap();
    let expected = Effects { arrays: Arrays::AsListed, ..Effects::of(Mode::AsPublished) };
    assert_eq!(config.model.unwrap().resolved_effects(), expected);
}

#[test]
fn a_file_of_satellites_is_looked_for_next_to_the_configuration() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("pipeline.toml");
    std::fs::write(&path, format!("{NIGHT}[model]\nsatellite = \"iss\"\nsatellites = \"own.toml\"\n")).unwrap();
    let config = Config::load(&path, &[]).unwrap();
    assert_eq!(config.model.unwrap().satellites.unwrap(), folder.path().join("own.toml"));
}
