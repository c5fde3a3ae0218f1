//! Vetting: every flag by injection, the words of the reason, and silence over nights that are in order.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use crate::support;

use std::path::Path;

use satphot::base::progress::Silent;
use satphot::config::{Config, Vetting};
use satphot::photometry::Flags;
use satphot::pipeline::options::Options;
use satphot::pipeline::run::run;
use satphot::pipeline::vet::{Judgement, judge, judge_neighbours};
use satphot::tables::{PhotometryRow, read_photometry};

const ROOT: &str = env!("CARGO_MANIFEST_DIR");

/// A frame with nothing wrong.
fn good() -> PhotometryRow {
    PhotometryRow {
        frame: "frame.fits".into(),
        object_name: "ISS (ZARYA)".into(),
        norad_cat_id: Some(25544),
        mjd_mid_d: Some(60_835.45),
        exptime_s: Some(2.0),
        time_err_s: Some(0.5),
        time_source: "DATE-OBS + EXPTIME/2".into(),
        time_stamp: "start".into(),
        gain_setting: Some(200),
        read_noise_e: Some(3.0),
        sky_e_px: Some(400.0),
        sky_corner_ratio: Some(0.98),
        extent_fwhm: Some(4.0),
        elongation: Some(1.8),
        snr: Some(60.0),
        contam_frac: Some(0.004),
        peak_frac_sat: Some(0.2),
        alt_deg: Some(50.0),
        range_km: Some(550.0),
        rate_deg_s: Some(0.9),
        az_rate_deg_s: Some(1.2),
        tle_age_d: Some(0.3),
        status: "ok".into(),
        ..PhotometryRow::default()
    }
}

/// One frame judged by itself.
fn judged(change: impl FnOnce(&mut PhotometryRow)) -> PhotometryRow {
    let mut row = good();
    change(&mut row);
    judge(&row, &Vetting::default()).into_row(row)
}

/// The frame has this verdict, this flag, and these words in its reason.
fn expect(row: &PhotometryRow, verdict: &str, flag: Flags, words: &[&str]) {
    assert_eq!(row.verdict, verdict, "{}", row.reason);
    assert!(Flags(row.flags).has(flag), "{flag} is not in {}", Flags(row.flags));
    for word in words {
        assert!(row.reason.contains(word), "\"{word}\" is not in \"{}\"", row.reason);
    }
}

#[test]
fn a_frame_with_nothing_wrong_is_used_without_a_word() {
    let row = judged(|_| {});
    assert_eq!((row.verdict.as_str(), row.reason.as_str(), row.flags), ("use", "", 0));
    // what was not measured is not judged
    let bare = judge(&PhotometryRow { status: "ok".into(), ..PhotometryRow::default() }, &Vetting::default());
    assert_eq!((bare.verdict.as_str(), bare.reason.as_str(), bare.flags), ("use", "", Flags::default()));
}

#[test]
fn contamination_is_reported_with_its_share_and_rejected_when_it_outshines_the_target() {
    let row = judged(|r| {
        r.contam_frac = Some(0.12);
        r.flags = Flags::TRAIL.0;
    });
    expect(&row, "caution", Flags::CONTAMINATED, &["star trail adds 12 % of the flux (contaminated)"]);
    expect(&judged(|r| r.contam_frac = Some(0.7)), "caution", Flags::CONTAMINATED, &["adds 70 %"]);
    expect(&judged(|r| r.contam_frac = Some(1.2)), "reject", Flags::CONTAMINATED, &["adds 120 %"]);
    assert_eq!(judged(|r| r.contam_frac = Some(0.049)).verdict, "use");
    // the flag alone, and a frame without a detection, whose share is of nothing
    expect(&judged(|r| r.flags = Flags::CONTAMINATED.0), "caution", Flags::CONTAMINATED, &["contaminated"]);
    let missed = judged(|r| (r.status, r.contam_frac) = ("nondetection".into(), Some(9.0)));
    assert_eq!(missed.verdict, "use", "{}", missed.reason);
}

#[test]
fn what_is_wrong_with_the_pixels_is_reported_and_the_worst_comes_first() {
    let table: [(Flags, &str); 7] = [
        (Flags::SATURATED, "reject"),
        (Flags::EDGE, "reject"),
        (Flags::CLIP_EDGE, "caution"),
        (Flags::MASKED, "caution"),
        (Flags::HIT, "caution"),
        (Flags::NO_ANNULUS, "caution"),
        (Flags::NEGATIVE, "caution"),
    ];
    for (flag, verdict) in table {
        expect(&judged(|r| r.flags = flag.0), verdict, flag, &[&flag.to_string()]);
    }
    let both = judged(|r| r.flags = Flags::HIT.0 | Flags::SATURATED.0);
    assert!(both.verdict == "reject" && both.reason.starts_with("saturated"), "{}", both.reason);
    expect(&judged(|r| r.peak_frac_sat = Some(0.97)), "caution", Flags::default(), &["97 % of saturation"]);
    // masked pixels by the share of the flux they hold
    let masked = |share: f64| judged(|r| (r.flags, r.masked_frac) = (Flags::MASKED.0, Some(share)));
    assert_eq!(masked(0.049).verdict, "use");
    expect(&masked(0.07), "caution", Flags::MASKED, &["hold 7 % of the flux"]);
    // flags that inform decide nothing
    for flag in [Flags::NO_FLAT, Flags::TRAIL, Flags::ELONGATED, Flags::CROWDED_ANNULUS, Flags::OTHER_ZEROPOINT] {
        assert_eq!(judged(|r| r.flags = flag.0).verdict, "use", "{flag}");
    }
}

#[test]
fn low_altitude_a_fast_azimuth_old_elements_and_an_uncertain_clock_are_reported_with_their_numbers() {
    expect(&judged(|r| r.alt_deg = Some(12.3)), "caution", Flags::LOW_ALTITUDE, &["12.3 deg", "min_alt_deg"]);
    assert_eq!(judged(|r| r.alt_deg = Some(15.1)).verdict, "use");
    let fast = judged(|r| r.az_rate_deg_s = Some(4.14));
    let words = "azimuth moves 4.1 deg/s, faster than the dome's 3 (vetting.dome_rate_deg_s)";
    expect(&fast, "caution", Flags::LOWER_LIMIT, &[words, "lower_limit"]);
    assert_eq!(judged(|r| r.az_rate_deg_s = Some(2.9)).verdict, "use");
    let any_dome = Vetting { dome_rate_deg_s: 0.0, ..Vetting::default() };
    let zenith = judge(&PhotometryRow { az_rate_deg_s: Some(180.0), ..good() }, &any_dome);
    assert_eq!(zenith.verdict.as_str(), "use");
    let old = judged(|r| (r.flags, r.tle_age_d) = (Flags::OLD_ELEMENTS.0, Some(-3.4)));
    expect(&old, "use", Flags::OLD_ELEMENTS, &["elements 3.4 d old", "not the magnitude"]);
    let unseen = judged(|r| {
        (r.flags, r.tle_age_d) = (Flags::OLD_ELEMENTS.0, Some(2.2));
        (r.status, r.v_mag) = ("nondetection".into(), None);
    });
    expect(&unseen, "caution", Flags::OLD_ELEMENTS, &["elements 2.2 d old", "outside the search region"]);
    let clock = judged(|r| (r.flags, r.time_err_s) = (Flags::TIME_UNCERTAIN.0, Some(1.5)));
    expect(&clock, "caution", Flags::TIME_UNCERTAIN, &["1.5 s", "1.35 deg"]);
}

#[test]
fn a_failed_frame_keeps_its_reason_and_nothing_else_is_said_of_it() {
    let failed = |r: &mut PhotometryRow| {
        *r = PhotometryRow { status: "failed".into(), reason: "unreadable".into(), alt_deg: Some(3.0), ..good() }
    };
    let row = judged(failed);
    assert_eq!((row.verdict.as_str(), row.reason.as_str(), row.flags), ("reject", "unreadable", 0));
}

// --- a pass of frames ---

/// A pass of `n` frames, `cadence_s` apart, as a satellite and the sky change over it, every frame judged by itself.
fn pass(n: usize, cadence_s: f64, change: impl Fn(usize, &mut PhotometryRow)) -> Vec<PhotometryRow> {
    (0..n)
        .map(|k| {
            let t = k as f64 * cadence_s;
            let mut row = good();
            row.frame = format!("target_{k:04}.fits");
            // past the observer: 420 km away at its nearest, in the middle of the pass
            let range = 420.0f64.hypot(7.3 * (t - 0.5 * n as f64 * cadence_s));
            row.range_km = Some(range);
            // 45 m and the seeing
            row.extent_fwhm = Some(1.0f64.hypot(1_500.0 / range));
            // twilight fades by a third a minute; half a per cent of noise that repeats after seven frames
            let noise = 1.0 + 0.005 * [0.3, -1.1, 0.8, 0.1, -0.4, 1.3, -0.9][k % 7];
            row.sky_e_px = Some(400.0 * (-t / 180.0).exp() * noise);
            row.sky_corner_ratio = Some(0.97 + 0.0002 * t + 0.003 * (noise - 1.0) / 0.005);
            row.mjd_mid_d = Some(60_835.45 + t / 86_400.0);
            change(k, &mut row);
            judge(&row, &Vetting::default()).into_row(row)
        })
        .collect()
}

fn config() -> Config {
    Config::load(&Path::new(ROOT).join("pipeline.toml"), &[]).unwrap()
}

/// The rows after the night was judged.
fn vetted(rows: Vec<PhotometryRow>) -> Vec<PhotometryRow> {
    let of: Vec<&PhotometryRow> = rows.iter().collect();
    let mut judgements: Vec<Judgement> = rows.iter().map(Judgement::of).collect();
    judge_neighbours(&of, &mut judgements, &config());
    rows.into_iter().zip(judgements).map(|(row, judgement)| judgement.into_row(row)).collect()
}

/// Numbers of the rows with a flag.
fn flagged(rows: &[PhotometryRow], flag: Flags) -> Vec<usize> {
    (0..rows.len()).filter(|k| Flags(rows[*k].flags).has(flag)).collect()
}

#[test]
fn a_pass_in_order_is_used_whole_and_its_cadence_is_filled() {
    let rows = vetted(pass(40, 5.0, |_, _| {}));
    assert!(rows.iter().all(|r| r.verdict == "use" && r.flags == 0 && r.reason.is_empty()), "{rows:#?}");
    assert_eq!(rows[0].cadence_s, None);
    assert!(rows[1..].iter().all(|r| (r.cadence_s.unwrap() - 5.0).abs() < 1e-5), "one MJD resolves a microsecond");
}

#[test]
fn the_order_of_the_frames_and_another_target_between_them_change_nothing() {
    let dip = |k: usize, r: &mut PhotometryRow| r.sky_e_px = r.sky_e_px.map(|s| if k == 11 { 0.6 * s } else { s });
    let plain = vetted(pass(24, 5.0, dip));
    let mut mixed: Vec<PhotometryRow> = pass(24, 5.0, dip).into_iter().rev().collect();
    mixed.extend(pass(24, 5.0, |k, r| (r.norad_cat_id, r.frame) = (Some(48274), format!("css_{k}.fits"))));
    let mut mixed: Vec<PhotometryRow> = vetted(mixed).into_iter().filter(|r| r.norad_cat_id == Some(25544)).collect();
    mixed.sort_by(|a, b| a.frame.cmp(&b.frame));
    assert_eq!(mixed, plain);
}

#[test]
fn a_failed_frame_counts_for_the_cadence_of_the_next_and_is_not_touched() {
    let failed = |k: usize, r: &mut PhotometryRow| {
        if k == 5 {
            (r.status, r.reason) = ("failed".into(), "unreadable".into());
        }
    };
    let rows = vetted(pass(10, 5.0, failed));
    assert_eq!((rows[5].cadence_s, rows[5].reason.as_str(), rows[5].flags), (None, "unreadable", 0));
    assert!((rows[6].cadence_s.unwrap() - 5.0).abs() < 1e-5);
}

#[test]
fn frames_that_overlap_are_doubted_and_the_frame_that_was_not_over_is_the_wrong_one() {
    // 12 s of exposure, and the next frame begins 5 s after it
    let rows = vetted(pass(20, 5.0, |k, r| {
        if k == 8 {
            r.exptime_s = Some(12.0);
            r.mjd_mid_d = r.mjd_mid_d.map(|m| m + 5.0 / 86_400.0); // DATE-OBS kept: the middle moves
            r.sky_e_px = None;
        }
    }));
    assert_eq!(flagged(&rows, Flags::EXPTIME_DOUBTED), [8]);
    expect(&rows[8], "caution", Flags::EXPTIME_DOUBTED, &["12 s of exposure do not fit", "exptime_doubted"]);
}

#[test]
fn which_of_two_overlapping_frames_is_doubted_hangs_on_what_the_stamp_marks_and_on_no_words() {
    // frame 8 is 12 s long in a cadence of 5 s: its own stamp fits, its end and the start of the next do not
    let doubted = |stamp: &str, source: &str| {
        let rows = vetted(pass(20, 5.0, |k, r| {
            (r.time_stamp, r.time_source) = (stamp.into(), source.into());
            if k == 8 {
                (r.exptime_s, r.sky_e_px) = (Some(12.0), None);
                let moved_s = if stamp == "end" { -5.0 } else { 5.0 };
                r.mjd_mid_d = r.mjd_mid_d.map(|m| m + moved_s / 86_400.0);
            }
        }));
        flagged(&rows, Flags::EXPTIME_DOUBTED)
    };
    for source in ["DATE-OBS + EXPTIME/2", "DATE-OBS - EXPTIME/2", "a clock of my own", ""] {
        assert_eq!(doubted("start", source), [8], "{source}");
        assert_eq!(doubted("end", source), [8], "{source}");
    }
}

#[test]
fn milliseconds_taken_for_seconds_are_doubted_in_every_frame_and_stamps_of_whole_seconds_in_none() {
    let rows = vetted(pass(12, 1.0, |k, r| {
        r.exptime_s = Some(500.0);
        r.mjd_mid_d = Some(60_835.45 + (k as f64 + 250.0) / 86_400.0);
    }));
    assert!(flagged(&rows, Flags::EXPTIME_DOUBTED).len() >= 11, "{rows:#?}");
    // 1.2 s apart, cut to whole seconds: spacings of 1 and 2 s for exposures of 1.1 s
    let cut = |k: usize| (1.2 * k as f64).floor();
    let stamped = |k: usize, r: &mut PhotometryRow| {
        (r.exptime_s, r.time_err_s) = (Some(1.1), Some(1.0));
        r.mjd_mid_d = Some(60_835.45 + (cut(k) + 0.55) / 86_400.0);
    };
    assert!(flagged(&vetted(pass(60, 1.2, stamped)), Flags::EXPTIME_DOUBTED).is_empty());
}

#[test]
fn a_run_too_short_for_its_exposures_is_doubted_where_no_pair_of_stamps_could_tell() {
    // 1 s exposures every 0.6 s, stamps good to 0.5 s: each pair is within the error, thirty frames are not
    let rows = vetted(pass(30, 0.6, |_, r| r.exptime_s = Some(1.0)));
    assert_eq!(flagged(&rows, Flags::EXPTIME_DOUBTED).len(), 30);
    assert!(rows[4].reason.contains("this run of frames took"), "{}", rows[4].reason);
}

#[test]
fn the_first_frame_with_a_new_exposure_time_on_old_data_is_doubted_by_its_sky() {
    for (old_s, new_s) in [(1.0, 4.0), (4.0, 1.0), (2.0, 3.0)] {
        let rows = vetted(pass(24, 6.0, |k, r| {
            let real_s = if k <= 12 { old_s } else { new_s };
            r.exptime_s = Some(if k < 12 { old_s } else { new_s });
            r.sky_e_px = r.sky_e_px.map(|s| s / 2.0 * real_s);
        }));
        assert_eq!(flagged(&rows, Flags::EXPTIME_DOUBTED), [12], "{old_s} -> {new_s}");
        assert!(rows[12].reason.contains("old data under a new EXPTIME"), "{}", rows[12].reason);
        assert!(flagged(&rows, Flags::VIGNETTED).is_empty(), "{old_s} -> {new_s}");
        // the same change of exposure time with its own data
        let rows = vetted(pass(24, 6.0, |k, r| {
            let real_s = if k < 12 { old_s } else { new_s };
            (r.exptime_s, r.sky_e_px) = (Some(real_s), r.sky_e_px.map(|s| s / 2.0 * real_s));
        }));
        assert!(rows.iter().all(|r| r.flags == 0), "{old_s} -> {new_s}");
    }
}

#[test]
fn a_dip_of_the_sky_is_something_in_the_beam_and_a_lower_limit() {
    for (first, last) in [(11, 11), (9, 11), (1, 1), (22, 22)] {
        let rows = vetted(pass(24, 5.0, |k, r| {
            if (first..=last).contains(&k) {
                r.sky_e_px = r.sky_e_px.map(|s| 0.7 * s);
            }
        }));
        assert_eq!(flagged(&rows, Flags::VIGNETTED), (first..=last).collect::<Vec<_>>());
        expect(&rows[first], "caution", Flags::VIGNETTED | Flags::LOWER_LIMIT, &["% below", "lower_limit"]);
    }
    // gains that cycle from frame to frame, as the paper's do, hide nothing: electrons have no gain
    let rows = vetted(pass(24, 30.0, |k, r| {
        r.gain_setting = Some([200, 250, 300][k % 3]);
        r.exptime_s = Some([3.0, 2.0, 1.5][k % 3]);
        r.sky_e_px = r.exptime_s.map(|t| 150.0 * t * if k == 10 { 0.7 } else { 1.0 });
    }));
    assert_eq!(flagged(&rows, Flags::VIGNETTED), [10]);
}

#[test]
fn a_good_frame_between_two_dips_is_not_taken_for_one_and_a_change_to_less_sky_for_good_is_none() {
    let rows = vetted(pass(24, 5.0, |k, r| {
        if k == 10 || k == 12 {
            r.sky_e_px = r.sky_e_px.map(|s| 0.6 * s);
            r.sky_corner_ratio = r.sky_corner_ratio.map(|c| c - 0.1);
        }
    }));
    assert_eq!(flagged(&rows, Flags::VIGNETTED), [10, 12]);
    let rows = vetted(pass(24, 5.0, |k, r| r.sky_e_px = r.sky_e_px.map(|s| if k < 12 { s } else { 0.6 * s })));
    assert!(flagged(&rows, Flags::VIGNETTED).is_empty());
}

#[test]
fn the_moon_rising_twilight_and_a_bright_sky_are_no_vignetting() {
    let moonrise = |k: usize, r: &mut PhotometryRow| {
        let since = (k as f64 - 15.0).max(0.0);
        r.sky_e_px = Some(200.0 * (1.0 + 0.4 * since));
        r.sky_corner_ratio = Some(0.97 + 0.004 * since);
    };
    let dawn = |k: usize, r: &mut PhotometryRow| r.sky_e_px = Some(50.0 * (0.15 * k as f64).exp());
    let past_the_moon = |k: usize, r: &mut PhotometryRow| {
        r.sky_e_px = Some(300.0 * (1.0 + 6.0 / (1.0 + (k as f64 - 14.0).powi(2))));
    };
    // below the read noise the pedestal decides
    let dark = |k: usize, r: &mut PhotometryRow| {
        (r.sky_e_px, r.sky_corner_ratio) = (Some([2.0, 0.5, 1.0, 2.9][k % 4]), Some([2.3, 0.7, 1.6, -0.4, 0.9][k % 5]));
    };
    // e- per second of a simulated pass with half a minute between frames: lowest at its culmination
    let culmination = |k: usize, r: &mut PhotometryRow| {
        let level = [260.0, 208.0, 157.0, 123.0, 113.0, 127.0, 159.0, 200.0, 252.0][k.clamp(10, 18) - 10];
        (r.exptime_s, r.sky_e_px) = (Some([3.0, 3.0, 2.0][k % 3]), Some(level * [3.0, 3.0, 2.0][k % 3]));
    };
    let none = |_: usize, r: &mut PhotometryRow| (r.sky_e_px, r.sky_corner_ratio) = (None, None);
    let passes: [&dyn Fn(usize, &mut PhotometryRow); 6] =
        [&moonrise, &dawn, &past_the_moon, &dark, &culmination, &none];
    for (n, change) in passes.into_iter().enumerate() {
        let rows = vetted(pass(30, 5.0, change));
        assert!(rows.iter().all(|r| r.flags == 0), "{n}: {:?}", flagged(&rows, Flags::VIGNETTED));
    }
}

#[test]
fn a_step_of_the_corner_ratio_is_vignetting_and_a_lower_limit_only_if_the_level_fell_too() {
    let corner = |k: usize, r: &mut PhotometryRow| {
        r.sky_corner_ratio = r.sky_corner_ratio.map(|c| if k == 13 { c - 0.09 } else { c });
    };
    let rows = vetted(pass(24, 5.0, corner));
    assert_eq!(flagged(&rows, Flags::VIGNETTED), [13]);
    assert!(flagged(&rows, Flags::LOWER_LIMIT).is_empty());
    expect(&rows[13], "caution", Flags::VIGNETTED, &["at the edge of the field over the centre", "less than"]);
    let both = |k: usize, r: &mut PhotometryRow| {
        corner(k, r);
        r.sky_e_px = r.sky_e_px.map(|s| if k == 13 { 0.9 * s } else { s });
    };
    assert_eq!(flagged(&vetted(pass(24, 5.0, both)), Flags::LOWER_LIMIT), [13]);
}

#[test]
fn a_smeared_frame_is_found_among_frames_of_a_resolved_station_and_the_station_itself_is_not() {
    // ranges from 420 to 1100 km: the station is 3.7 FWHM long at its nearest and 1.7 at its farthest
    let rows = vetted(pass(30, 9.0, |k, r| {
        if k == 4 || k == 16 {
            r.extent_fwhm = r.extent_fwhm.map(|e| 1.9 * e);
        }
    }));
    assert_eq!(flagged(&rows, Flags::SMEARED), [4, 16]);
    expect(&rows[16], "caution", Flags::SMEARED, &["FWHM long", "smear_caution"]);
    // a station that turns its long side to the observer and away again
    let turning = |k: usize, r: &mut PhotometryRow| {
        r.extent_fwhm = r.extent_fwhm.map(|e| e * (1.0 - 0.4 * (0.1 * k as f64).sin().powi(2)));
        r.elongation = Some(2.6);
    };
    assert!(flagged(&vetted(pass(30, 9.0, turning)), Flags::SMEARED).is_empty());
    // three frames tell nothing
    let alone = vetted(pass(3, 9.0, |k, r| r.extent_fwhm = Some(if k == 1 { 40.0 } else { 4.0 })));
    assert!(flagged(&alone, Flags::SMEARED).is_empty());
}

#[test]
fn an_aperture_that_is_longer_than_in_the_rest_of_the_pass_holds_something_else() {
    let rows = vetted(pass(30, 9.0, |k, r| {
        // the aperture grows towards the nearest point of the pass, as it should
        let range_km = r.range_km.unwrap();
        r.aper_a_px = Some(if k == 7 { 60.0 } else { 18.0 + 4000.0 / range_km });
    }));
    assert_eq!(flagged(&rows, Flags::CONTAMINATED), [7]);
    expect(&rows[7], "caution", Flags::CONTAMINATED, &["60 px", "end of a star trail", "vetting.aperture_caution 1.5"]);
    // a pass of two frames is held against the other passes of the night
    let mut two = pass(26, 9.0, |k, r| r.aper_r_px = Some(if k == 25 { 90.0 } else { 18.0 }));
    two[24..].iter_mut().for_each(|r| r.mjd_mid_d = r.mjd_mid_d.map(|mjd_d| mjd_d + 0.07));
    assert_eq!(flagged(&vetted(two), Flags::CONTAMINATED), [25]);
    let alone = vetted(pass(3, 9.0, |k, r| r.aper_r_px = Some(if k == 1 { 60.0 } else { 18.0 })));
    assert!(flagged(&alone, Flags::CONTAMINATED).is_empty());
}

#[test]
fn an_aperture_much_longer_than_its_light_holds_a_trail_also_where_most_frames_of_the_pass_have_one() {
    // in 20 of 30 frames the aperture runs along a trail, so that the usual one of the pass is long; the light is 1.2 FWHM long
    let trailed = |k: usize| !k.is_multiple_of(3);
    let rows = |kind: &str, snr: f64| {
        vetted(pass(30, 9.0, |k, r| {
            (r.fwhm_px, r.extent_fwhm, r.snr, r.source_kind) = (Some(4.0), Some(1.2), Some(snr), kind.into());
            (r.aper_a_px, r.elongation) = (Some(if trailed(k) { 80.0 } else { 14.0 }), Some(1.1));
        }))
    };
    let found = rows("extended", 90.0);
    assert_eq!(flagged(&found, Flags::CONTAMINATED), (0..30).filter(|k| trailed(*k)).collect::<Vec<_>>());
    expect(&found[1], "caution", Flags::CONTAMINATED, &["20 FWHM", "1.2 FWHM long", "vetting.outline_caution 3"]);
    // a fixed circle and a shape that is noise are not judged
    assert!(flagged(&rows("point", 90.0), Flags::CONTAMINATED).is_empty());
    assert!(flagged(&rows("extended", 8.0), Flags::CONTAMINATED).is_empty());
    // a margin of 18 FWHM makes every aperture long
    let wide = pass(30, 9.0, |_, r| {
        (r.fwhm_px, r.extent_fwhm, r.snr, r.aper_a_px) = (Some(4.0), Some(1.2), Some(90.0), Some(80.0));
    });
    let of: Vec<&PhotometryRow> = wide.iter().collect();
    let mut config = config();
    config.target.margin_fwhm = 18.0;
    let mut judgements: Vec<Judgement> = of.iter().map(|r| Judgement::of(r)).collect();
    judge_neighbours(&of, &mut judgements, &config);
    assert!(judgements.iter().all(|j| !j.flags.has(Flags::CONTAMINATED)));
}

#[test]
fn a_target_smaller_than_the_seeing_is_smeared_when_it_is_long_and_not_judged_when_it_is_faint() {
    let point = |k: usize, r: &mut PhotometryRow| {
        r.extent_fwhm = Some(1.1);
        r.elongation = Some(if k == 7 { 1.7 } else { 1.1 });
    };
    let rows = vetted(pass(15, 5.0, point));
    assert_eq!(flagged(&rows, Flags::SMEARED), [7]);
    let faint = vetted(pass(15, 5.0, |k, r| {
        point(k, r);
        r.snr = Some(6.0);
    }));
    assert!(flagged(&faint, Flags::SMEARED).is_empty());
}

// --- whole nights ---

/// Shares of the frames of a night that are used, and of those flagged by what only neighbours tell. Frames that truly
/// hold light of a star trail are excluded from the first: they are rightly reported.
fn used_and_alarms(rows: &[PhotometryRow]) -> (Option<f64>, f64) {
    let honest: Vec<&PhotometryRow> = rows.iter().filter(|r| !Flags(r.flags).has(Flags::CONTAMINATED)).collect();
    let used = honest.iter().filter(|r| r.verdict == "use").count() as f64;
    let used = (!honest.is_empty()).then_some(used / honest.len() as f64);
    let alarm = Flags::SMEARED | Flags::VIGNETTED | Flags::EXPTIME_DOUBTED | Flags::LOWER_LIMIT | Flags::HIT;
    (used, rows.iter().filter(|r| Flags(r.flags).any(alarm)).count() as f64 / rows.len() as f64)
}

#[test]
fn the_fixture_night_and_a_simulated_night_raise_no_false_alarm() {
    let mut config = config();
    let folder = tempfile::tempdir().unwrap();
    config.night.output = folder.path().to_path_buf();
    run(&config, &Options { no_figures: true, ..Options::default() }, &Silent).unwrap();
    let (rows, _) = read_photometry(&folder.path().join("2025-06-13/photometry.ecsv")).unwrap();
    let (used, alarms) = used_and_alarms(&rows);
    assert!(
        rows.len() == 24 && used.is_some_and(|used| used > 0.95) && alarms == 0.0,
        "used {used:?}, alarms {alarms}"
    );
    assert!(rows.iter().all(|r| r.az_rate_deg_s.is_some_and(|a| a > 0.0 && a < 3.0)));

    let size = ["frame.nx_px=300", "frame.ny_px=220"];
    // a field of faint stars, so that frames without a trail are left
    let sets = [&size[..], &["target.n=30", "seed=4", "target.offset_mag=-1.0", "field.trail_v_min_mag=13.5"]].concat();
    let night = support::Night::copy_of(&support::simulated("vetting", &sets));
    night.run().unwrap();
    let rows = night.rows();
    let (used, alarms) = used_and_alarms(&rows);
    let reasons: Vec<&String> = rows.iter().map(|r| &r.reason).filter(|r| !r.is_empty()).collect();
    let fine = used.is_some_and(|used| used > 0.95);
    assert!(rows.len() == 30 && fine && alarms == 0.0, "used {used:?}, alarms {alarms}, {reasons:?}");
}

#[test]
fn an_exposure_longer_than_its_place_among_the_files_of_a_night_is_found_and_counted_in_the_summary() {
    let folder = support::simulated("vetting_late", &["target.n=12", "seed=5", "target.offset_mag=-3.0"]);
    let night = support::Night::copy_of(&folder);
    night.run().unwrap();
    let spacing_s = night.row("target_0002.fits").cadence_s.unwrap();
    // a frame in the middle of a pass claims to have been exposed beyond the start of the next one
    let claimed = format!("{:.1}", spacing_s + 15.0);
    support::set_card(&night.path("target_0001.fits"), "EXPTIME", Some(&claimed));
    let summary = night.run().unwrap();
    let row = night.row("target_0001.fits");
    let words = format!("{claimed} s of exposure do not fit");
    // the header points where the satellite stood half a minute before the middle of such an exposure
    expect(&row, "reject", Flags::EXPTIME_DOUBTED, &[&words, "the header points"]);
    assert_eq!(summary.counts.warnings.get("exptime_doubted"), Some(&1), "{:?}", summary.counts.warnings);
    assert!(summary.text().contains("1 frame with a doubtful exposure time"), "{}", summary.text());
}

/// Rewrites the pixels of a frame: column, row and ADU in, ADU out.
fn map_pixels(path: &Path, nx: usize, change: impl Fn(usize, usize, f64) -> f64) {
    let mut bytes = std::fs::read(path).unwrap();
    let end = bytes.chunks(80).position(|card| card.starts_with(b"END     ")).unwrap();
    let start = ((end + 1) * 80).div_ceil(2880) * 2880;
    for (k, p) in bytes[start..].chunks_exact_mut(2).enumerate() {
        let adu = f64::from(i16::from_be_bytes([p[0], p[1]])) + 32_768.0;
        let new = change(k % nx, k / nx, adu).round().clamp(0.0, 65_535.0) - 32_768.0;
        p.copy_from_slice(&(new as i16).to_be_bytes());
    }
    std::fs::write(path, bytes).unwrap();
}

#[test]
fn a_frame_burnt_out_and_a_frame_behind_the_dome_are_recognised_from_their_pixels() {
    let folder = support::simulated("vetting_pixels", &["target.n=24", "seed=6", "target.offset_mag=-3.0"]);
    let night = support::Night::copy_of(&folder);
    night.run().unwrap();
    // a frame inside a pass: neither the first two nor the last two of it
    let rows = night.rows();
    let gap = |k: usize| rows.get(k).and_then(|r| r.cadence_s).unwrap_or(f64::INFINITY) > 1_200.0;
    let inside: Vec<usize> = (2..22).filter(|k| (k - 1..=k + 2).all(|j| !gap(j))).collect();
    let (burnt, dark) = (&rows[inside[0]], &rows[inside[inside.len() - 1]]);
    let (x, y) = (burnt.x_px.unwrap() as usize, burnt.y_px.unwrap() as usize);
    let near = |i: usize, j: usize| i.abs_diff(x) < 3 && j.abs_diff(y) < 3;
    map_pixels(&night.path(&burnt.frame), 160, |i, j, adu| if near(i, j) { 65_535.0 } else { adu });
    // half the light is lost, of sky and target alike
    map_pixels(&night.path(&dark.frame), 160, |_, _, adu| 500.0 + 0.5 * (adu - 500.0));
    let summary = night.run().unwrap();
    expect(&night.row(&burnt.frame), "reject", Flags::SATURATED, &["saturated pixels in the aperture"]);
    let row = night.row(&dark.frame);
    assert!(Flags(row.flags).has(Flags::VIGNETTED | Flags::LOWER_LIMIT), "{} {}", row.frame, row.reason);
    assert!(
        summary.text().contains("1 frame saturated") && summary.text().contains("1 lower limit"),
        "{}",
        summary.text()
    );
    let others = night.rows().into_iter().filter(|r| r.frame != dark.frame);
    assert!(others.clone().all(|r| !Flags(r.flags).any(Flags::VIGNETTED | Flags::EXPTIME_DOUBTED)));
}
