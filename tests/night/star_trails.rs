//! The stars that trail through target frames: stars that are in no catalogue give nothing, and the rows say so.
#![allow(clippy::unwrap_used)]

use satphot::base::progress::Silent;
use satphot::config::Config;
use satphot::photometry::Flags;
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

#[test]
fn clouds_and_a_late_clock_are_seen_by_the_trails_of_a_night_and_named_in_its_rows() {
    let folder = tempfile::tempdir().unwrap();
    let sets = [
        "seed=36",
        "target.n=10",
        "target.exptime_range_s=[0.12, 0.12]",
        "target.offset_mag=4.0",
        "target.min_alt_deg=35.0",
        "target.catalogue_trails=true",
        "target.cloudy_frac=0.4",
        "target.cloud_range_mag=[0.3, 0.9]",
        "target.clock_err_s=0.25",
        "pointings.n=6",
    ];
    let sets: Vec<String> = sets.iter().map(|s| (*s).to_string()).collect();
    simulate(&Scenario::crowded_night(&sets).unwrap(), folder.path(), &Silent).unwrap();
    let mut config =
        Config::load(&folder.path().join("pipeline.toml"), &["zeropoint.star_trails=true".into()]).unwrap();
    config.night.output = folder.path().join("satphot-out");
    let summary = run(&config, &Options { no_figures: true, ..Options::default() }, &Silent).unwrap();
    let rows = read_photometry(&summary.folder.join("photometry.ecsv")).unwrap().0;
    let measured: Vec<_> = rows.iter().filter(|r| r.frame_zp_offset_mag.is_some()).collect();
    assert!(2 * measured.len() >= rows.len(), "{rows:?}");
    let (mut cloudy, mut placed) = (0, 0);
    for row in &measured {
        let (off, err) = (row.frame_zp_offset_mag.unwrap(), row.frame_zp_offset_err_mag.unwrap());
        // 0.3 to 0.9 mag, or none
        assert!(off.abs() < 4.0 * err || (0.3 - 4.0 * err..0.9 + 4.0 * err).contains(&off), "{row:?}");
        assert_eq!(Flags(row.flags).has(Flags::CLOUD), off > 0.2, "{row:?}");
        cloudy += usize::from(off > 0.2);
        if let (Some(along), Some(rate)) = (row.along_oc_arcsec, row.rate_deg_s) {
            assert!((along / (3600.0 * rate) + 0.25).abs() < 0.02, "{row:?}");
            placed += 1;
        }
        assert_eq!(row.along_oc_arcsec.is_some(), row.ra_deg.is_some(), "{row:?}");
    }
    assert!(cloudy >= 1 && cloudy < measured.len() && placed >= 3, "{cloudy} {placed} {measured:?}");
}
