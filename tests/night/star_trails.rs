//! The stars that trail through target frames: stars that are in no catalogue give nothing, and the rows say so.
#![allow(clippy::unwrap_used)]

use satphot::base::progress::Silent;
use satphot::config::Config;
use satphot::pipeline::options::Options;
use satphot::pipeline::run::run;
use satphot::simulate::{Scenario, simulate};
use satphot::tables::read_photometry;

#[test]
fn trails_of_stars_that_are_in_no_catalogue_give_nothing_and_say_so() {
    let folder = tempfile::tempdir().unwrap();
    let sets = [
        "seed=34",
        "target.n=8",
        "target.exptime_range_s=[0.4, 0.4]",
        "target.offset_mag=9.0",
        "target.min_alt_deg=25.0",
        "pointings.n=4",
    ];
    let sets: Vec<String> = sets.iter().map(|s| (*s).to_string()).collect();
    simulate(&Scenario::crowded_night(&sets).unwrap(), folder.path(), &Silent).unwrap();
    let mut config =
        Config::load(&folder.path().join("pipeline.toml"), &["zeropoint.star_trails=true".into()]).unwrap();
    config.night.output = folder.path().join("satphot-out");
    let summary = run(&config, &Options { no_figures: true, ..Options::default() }, &Silent).unwrap();
    let rows = read_photometry(&summary.folder.join("photometry.ecsv")).unwrap().0;
    assert_eq!(rows.len(), 8);
    for row in rows.iter().filter(|r| r.status == "ok") {
        assert!(row.frame_zp_offset_mag.is_none() && row.cross_oc_arcsec.is_none(), "{row:?}");
        assert!(row.frame_zp_note.contains("catalogue") && row.v_mag_zeropoint == "night", "{row:?}");
    }
}
