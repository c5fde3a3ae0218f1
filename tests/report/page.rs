//! The report of a night: all sections from any rows, escaped, the same bytes twice, and alive in a browser.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::path::{Path, PathBuf};
use std::process::Command;

use satphot::pipeline::products::page::{night_page, write_campaign_report, write_report};
use satphot::report::page::{NightPage, write_night_page};
use satphot::tables::{Meta, PhotometryRow, write_photometry};

const SECTIONS: [&str; 12] = [
    "summary",
    "light-curve",
    "stacks",
    "residuals",
    "phase-curve",
    "distribution",
    "sky",
    "zeropoint",
    "calibration",
    "frames",
    "timing",
    "provenance",
];

/// The results of the fixture night, made once.
fn night() -> PathBuf {
    static FOLDER: std::sync::OnceLock<PathBuf> = std::sync::OnceLock::new();
    FOLDER
        .get_or_init(|| {
            let out = Path::new(env!("CARGO_TARGET_TMPDIR")).join("report_page");
            let done = Command::new(env!("CARGO_BIN_EXE_satphot"))
                .current_dir(env!("CARGO_MANIFEST_DIR"))
                .args(["run", "-q", "-o"])
                .arg(&out)
                .output()
                .unwrap();
            assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
            out.join("2025-06-13")
        })
        .clone()
}

/// Writes a page of rows and reads it.
fn page_of(rows: Vec<PhotometryRow>) -> String {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("report.html");
    write_night_page(&path, &NightPage { name: "n".into(), rows, ..NightPage::default() }).unwrap();
    std::fs::read_to_string(path).unwrap()
}

#[test]
fn the_night_has_ten_sections_links_that_lead_somewhere_and_needs_no_network() {
    let page = std::fs::read_to_string(night().join("report.html")).unwrap();
    let ids: Vec<&str> = page.split("<section id=\"").skip(1).map(|s| s.split('"').next().unwrap()).collect();
    assert_eq!(ids, SECTIONS, "verdict and passes, light curves, zeropoint, frames, provenance");
    for id in SECTIONS {
        assert!(page.contains(&format!("<a href=\"#{id}\"")), "{id} is not in the navigation");
    }
    assert!(page.len() < 5_000_000);
    // every link is to a place on the page, every place exists once
    for href in page.split("href=\"").skip(1).map(|rest| rest.split('"').next().unwrap()) {
        let id = href.strip_prefix('#').unwrap_or_else(|| panic!("{href} leaves the page"));
        assert_eq!(page.matches(&format!("id=\"{id}\"")).count(), 1, "{href}");
    }
    for outside in ["http:", "https:", "src=\"/", "@import", "url("] {
        assert!(!page.contains(outside), "{outside}");
    }
    // every measured frame is a point, of the night's own 24 frames
    assert_eq!(page.matches("<li id=\"frame-").count(), 24);
    assert!(no_nan(&page));
}

#[test]
fn the_head_says_what_was_drawn_where_and_warnings_come_before_notes() {
    let page = std::fs::read_to_string(night().join("report.html")).unwrap();
    assert!(page.contains("<h1>Night 2025-06-13 (SIMULATED)</h1>"));
    let strip = page.split("<section id=\"summary\"").nth(1).unwrap().split("</section>").next().unwrap();
    for said in ["Macquarie University Observatory", "SIMULATED", ", scatter ", "rejected before measurement"] {
        assert!(strip.contains(said), "{said}");
    }
    let residual = strip.split("observed − modelled").nth(1).unwrap().split("</div>").next().unwrap();
    assert!(residual.contains("median") && residual.contains("scatter") && !residual.contains('±'), "{residual}");
    let warned = strip.find("1 frame contaminated by star trails or neighbours (verdict caution or reject)").unwrap();
    assert!(warned < strip.find(" notes</summary>").unwrap());
    // a failed frame is graver than any doubt
    let row = |status: &str, frame: &str| PhotometryRow {
        frame: frame.into(),
        status: status.into(),
        reason: "truncated".into(),
        ..PhotometryRow::default()
    };
    let page = page_of(vec![row("ok", "a"), row("rejected", "c"), row("failed", "b")]);
    let said =
        ["1 of 3 frames could not be reduced; b: truncated", "1 of 3 frames rejected before measurement; c: truncated"];
    assert!(page.find(said[0]).unwrap() < page.find(said[1]).unwrap());
}

#[test]
fn shades_of_penumbra_and_umbra_meet_halfway_and_leave_no_gap() {
    let row = |k: usize, illum: &str| PhotometryRow {
        frame: format!("f{k}"),
        status: "ok".into(),
        verdict: "use".into(),
        mjd_mid_d: Some(60_835.4 + k as f64 / 1440.0),
        v_mag: Some(6.0 + k as f64),
        illum: illum.into(),
        ..PhotometryRow::default()
    };
    let lights = ["sun", "penumbra", "penumbra", "moon", "moon", "sun"];
    let page = page_of(lights.iter().enumerate().map(|(k, light)| row(k, light)).collect());
    let edges = |class: &str| {
        let rect = page.split(&format!("<rect class=\"shade {class}\"")).nth(1).unwrap();
        let number = |key: &str| -> f64 {
            rect.split(&format!("{key}=\"")).nth(1).unwrap().split('"').next().unwrap().parse().unwrap()
        };
        (number(" x"), number(" x") + number(" width"))
    };
    let (penumbra, umbra) = (edges("penumbra"), edges("umbra"));
    assert!((penumbra.1 - umbra.0).abs() < 0.11, "{penumbra:?} {umbra:?}");
    // two minutes each, from halfway to halfway
    assert!(((penumbra.1 - penumbra.0) - (umbra.1 - umbra.0)).abs() < 0.3, "{penumbra:?} {umbra:?}");
}

#[test]
fn sky_and_distribution_are_figures_too_with_the_charts_of_the_page() {
    let page = std::fs::read_to_string(night().join("report.html")).unwrap();
    for (name, section) in [("sky.svg", "sky"), ("distribution.svg", "distribution"), ("phase.svg", "phase-curve")] {
        let svg = std::fs::read_to_string(night().join("figures").join(name)).unwrap();
        assert!(svg.starts_with("<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"174mm\""), "{name}");
        let part =
            page.split(&format!("<section id=\"{section}\"")).nth(1).unwrap().split("</section>").next().unwrap();
        // and the key of the lights in a line of its own
        let charts = part.matches("<svg class=\"chart").count() + usize::from(section == "distribution");
        assert_eq!(svg.matches("class=\"chart").count(), charts, "{name}");
        // programs that draw SVG know no variables, and a figure leads nowhere
        assert!(
            (charts > 1 || section == "phase-curve")
                && !svg.contains("var(--")
                && !svg.contains("href")
                && no_nan(&svg),
            "{name}"
        );
    }
    let manifest = std::fs::read_to_string(night().join("manifest.json")).unwrap();
    assert!(manifest.contains("figures/sky.svg") && manifest.contains("figures/distribution.svg"));
}

#[test]
fn the_report_made_again_from_the_folder_is_the_same_file() {
    let folder = night();
    let again = Path::new(env!("CARGO_TARGET_TMPDIR")).join("report_again.html");
    write_report(&folder, Some(&again)).unwrap();
    assert_eq!(std::fs::read(folder.join("report.html")).unwrap(), std::fs::read(again).unwrap());
}

#[test]
fn rows_of_any_kind_make_a_page_and_text_of_headers_stays_text() {
    let empty = page_of(Vec::new());
    assert!(SECTIONS.iter().all(|id| empty.contains(&format!("<section id=\"{id}\""))));
    let evil = "<script>alert(1)</script>\"' &";
    let row = |k: usize| PhotometryRow {
        frame: format!("{evil}{k}"),
        object_name: evil.into(),
        reason: evil.into(),
        status: ["ok", "nondetection", "failed", "rejected"][k % 4].into(),
        verdict: ["use", "caution", "reject"][k % 3].into(),
        date_mid: format!("2025-06-09T10:{:02}:00Z", k % 60),
        mjd_mid_d: Some(60_835.4 + k as f64 / 1440.0),
        v_mag: k.is_multiple_of(4).then_some(12.0 + k as f64 * 1e3 * f64::from(u8::from(k == 8))),
        v_mag_err: Some(0.1),
        limit_v_mag: (k % 4 == 1).then_some(14.0),
        alt_deg: Some(-3.0 + k as f64),
        az_deg: Some(359.0),
        residual_mag: Some(1e9),
        cadence_s: Some(0.0),
        exptime_s: Some(0.0),
        ..PhotometryRow::default()
    };
    let page = page_of((0..20).map(row).collect());
    assert!(!page.contains("<script>alert"), "text of a header became a script");
    assert!(page.contains("&lt;script&gt;alert(1)"));
    let one = page_of(vec![PhotometryRow {
        frame: "a".into(),
        status: "ok".into(),
        v_mag: Some(1.0),
        ..PhotometryRow::default()
    }]);
    assert!(one.contains("<section id=\"distribution\"") && no_nan(&one));
}

#[test]
fn a_night_of_very_many_frames_stays_below_5_mb_and_says_what_it_omitted() {
    let row = |k: usize| PhotometryRow {
        frame: format!("target_{k:06}_of_a_long_night.fits"),
        object_name: "STARLINK-1008".into(),
        status: "ok".into(),
        verdict: "caution".into(),
        reason: "star trail adds 298 % of the flux (contaminated); elements 3.0 d old (old_elements)".into(),
        date_mid: "2025-06-09T10:33:02.500000Z".into(),
        mjd_mid_d: Some(60_835.4 + (k / 100) as f64 / 50.0 + (k % 100) as f64 / 86_400.0),
        v_mag: Some(6.0 + (k % 97) as f64 * 0.01),
        v_mag_err: Some(0.05),
        residual_mag: Some((k % 31) as f64 * 0.01),
        model_v_mag: Some(6.0),
        alt_deg: Some(40.0),
        az_deg: Some((k % 360) as f64),
        phase_angle_deg: Some(60.0 + (k % 7) as f64),
        moon_sep_deg: Some(80.0 + (k % 11) as f64),
        flux_e: Some(1e5 + k as f64),
        extent_fwhm: Some(1.0 + (k % 3) as f64),
        cadence_s: Some(1.0),
        exptime_s: Some(0.5),
        date_avg_minus_mid_s: Some(0.1),
        illum: "sun".into(),
        ..PhotometryRow::default()
    };
    let rows: Vec<PhotometryRow> = (0..6_000).map(row).collect();
    let card = |r: &PhotometryRow| {
        let id = format!("frame-{}", r.frame.replace(['_', '.'], "-"));
        (id.clone(), format!("<li id=\"{id}\">{}</li>", "x".repeat(9_000)))
    };
    let cards = rows.iter().map(card).collect();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("report.html");
    write_night_page(&path, &NightPage { name: "n".into(), rows, cards, ..NightPage::default() }).unwrap();
    let page = std::fs::read_to_string(path).unwrap();
    assert!(page.len() < 5_000_000, "{}", page.len());
    for said in ["points drawn", "The worst ", "of 6000 pictures", "The first 1000"] {
        assert!(page.contains(said), "{said}");
    }
}

#[test]
fn a_folder_without_results_says_what_to_name() {
    let folder = tempfile::tempdir().unwrap();
    let error = night_page(folder.path()).unwrap_err().to_string();
    assert!(error.contains("photometry.ecsv") && error.contains("`run` writes it"), "{error}");
    // a table alone is enough, and what is missing is said
    write_photometry(&folder.path().join("photometry.ecsv"), &[], &Meta::default()).unwrap();
    let page = night_page(folder.path()).unwrap();
    assert!(page.notes.iter().any(|n| n.contains("manifest.json")));
    std::fs::write(folder.path().join("photometry.ecsv"), "not a table").unwrap();
    assert!(night_page(folder.path()).is_err());
}

#[test]
fn several_nights_make_one_page_with_a_line_each() {
    let base = tempfile::tempdir().unwrap();
    let copy = |name: &str| {
        let folder = base.path().join(name);
        std::fs::create_dir(&folder).unwrap();
        for file in ["photometry.ecsv", "zeropoint.toml", "report.html", "gallery.html"] {
            std::fs::copy(night().join(file), folder.join(file)).unwrap();
        }
        folder
    };
    let folders = [copy("one"), copy("two")];
    let out = base.path().join("campaign.html");
    write_campaign_report(&folders, &out).unwrap();
    let page = std::fs::read_to_string(&out).unwrap();
    assert!(page.contains("href=\"one/report.html#summary\"") && page.contains("href=\"two/report.html#summary\""));
    assert!(page.contains("<h1>2 nights (SIMULATED: 2 of 2)</h1>"));
    // passes are stacked night by night
    for id in SECTIONS.into_iter().filter(|id| *id != "stacks").chain(["month"]) {
        assert_eq!(page.matches(&format!("<section id=\"{id}\"")).count(), 1, "{id}");
    }
    // a point leads to the picture in the report of its night, and nowhere else
    assert!(page.contains("href=\"one/report.html#frame-target-0009-fits\""));
    for href in page.split("href=\"").skip(1).map(|rest| rest.split('"').next().unwrap()) {
        let known = href.starts_with("one/report.html") || href.starts_with("two/report.html");
        assert!(known || page.contains(&format!("id=\"{}\"", &href[1..])), "{href}");
    }
    assert!(no_nan(&page));
    // light curves of each night, and its worst frames under names of their own
    let curves = page.split("<section id=\"light-curve\"").nth(1).unwrap().split("</section>").next().unwrap();
    assert!(curves.matches("<svg class=\"chart").count() >= 4, "{}", curves.len());
    assert!(curves.contains("href=\"two/report.html#frame-"));
    assert_eq!(page.matches("<ol class=\"gallery\">").count(), 2);
    assert_eq!((page.matches("id=\"night1-frame-").count(), page.matches("id=\"night2-frame-").count()), (6, 6));
    let residuals = page.split("<section id=\"residuals\"").nth(1).unwrap().split("</section>").next().unwrap();
    // of the demo night every frame with a residual can be used
    let key = residuals.split("</ul>").next().unwrap();
    for (meaning, there) in [("use", true), ("reject", false), ("beyond the axis", false)] {
        assert_eq!(key.contains(&format!("</svg> {meaning}</li>")), there, "{meaning}: {key}");
    }
    // from a folder next to the nights the links go up
    let pages_folder = base.path().join("pages");
    std::fs::create_dir(&pages_folder).unwrap();
    assert!(write_campaign_report(&folders, &pages_folder.join("c.html")).unwrap().is_empty());
    let page = std::fs::read_to_string(pages_folder.join("c.html")).unwrap();
    assert!(page.contains("href=\"../one/report.html#frame-target-0009-fits\""));
    assert!(page.contains("A point leads to its picture in the report of its night."));
}

#[test]
fn nights_of_a_campaign_stand_by_date_and_one_without_a_report_is_named_and_promises_no_link() {
    let base = tempfile::tempdir().unwrap();
    let make = |name: &str, mjd: f64| {
        let folder = base.path().join(name);
        std::fs::create_dir(&folder).unwrap();
        let row = PhotometryRow {
            frame: "f".into(),
            status: "ok".into(),
            verdict: "use".into(),
            mjd_mid_d: Some(mjd),
            v_mag: Some(6.0),
            ..PhotometryRow::default()
        };
        let mut meta = Meta::default();
        meta.push("night", name);
        write_photometry(&folder.join("photometry.ecsv"), &[row], &meta).unwrap();
        folder
    };
    let out = base.path().join("c.html");
    let notes = write_campaign_report(&[make("late", 60_900.4), make("early", 60_800.4)], &out).unwrap();
    assert!(notes.len() == 2 && notes[0].contains("late") && notes[0].contains("no report.html"), "{notes:?}");
    let page = std::fs::read_to_string(out).unwrap();
    assert!(page.contains("<p>early, late</p>") && !page.contains("A point leads"), "{page}");
}

#[test]
fn the_middle_a_header_states_is_held_against_start_and_exposure_with_median_and_scatter() {
    let row = |k: usize, off_s: Option<f64>| PhotometryRow {
        frame: format!("f{k}"),
        status: "ok".into(),
        verdict: "use".into(),
        mjd_mid_d: Some(60_835.4 + k as f64 / 1440.0),
        date_avg_minus_mid_s: off_s,
        ..PhotometryRow::default()
    };
    let page = page_of((0..5).map(|k| row(k, Some(0.25 + 0.01 * k as f64))).collect());
    assert!(page.contains("median +0.270 s, scatter 0.015 s over 5 frames"), "{page}");
    assert!(page_of(vec![row(0, None)]).contains("No header states both its middle"));
}

#[test]
fn a_pass_of_eight_magnitudes_is_a_violin_and_one_of_seven_is_its_points() {
    let row = |k: usize, pass: f64| PhotometryRow {
        frame: format!("f{k}-{pass}"),
        object_name: "ISS".into(),
        status: "ok".into(),
        verdict: "use".into(),
        mjd_mid_d: Some(60_835.4 + pass / 10.0 + k as f64 / 1440.0),
        date_mid: "2025-06-09T10:33:02Z".into(),
        illum: "moon".into(),
        v_mag: Some(12.0 + 0.1 * k as f64),
        ..PhotometryRow::default()
    };
    let of = |rows: Vec<PhotometryRow>| {
        let page = page_of(rows);
        let part = page.split("<section id=\"distribution\"").nth(1).unwrap().split("</section>").next().unwrap();
        (part.matches("column violin").count(), part.matches("circle class=\"point moon").count())
    };
    let passes = |n: [usize; 2]| (0..n[0]).map(|k| row(k, 0.0)).chain((0..n[1]).map(|k| row(k, 1.0))).collect();
    // one violin for each pass, and one for all of this target under this light
    assert_eq!(of(passes([8, 9])).0, 3);
    assert_eq!(of(passes([8, 7])), (2, 7));
    assert_eq!(of(passes([3, 2])), (0, 10));
}

/// A frame of a pass, lit by one light of the model.
fn of_pass(k: usize, satellite: &str, filter: &str, light: &str) -> PhotometryRow {
    let lit = |name: &str| (name == light).then_some(12.0 + 0.1 * k as f64);
    PhotometryRow {
        frame: format!("{satellite}-{filter}-{k}"),
        object_name: satellite.into(),
        filter: filter.into(),
        status: "ok".into(),
        verdict: "use".into(),
        mjd_mid_d: Some(60_835.4 + k as f64 / 1440.0),
        date_mid: format!("2025-06-09T10:{:02}:02Z", k % 60),
        illum: light.into(),
        v_mag: Some(12.0 + 0.1 * k as f64),
        v_mag_err: Some(0.1),
        model_v_mag: Some(12.0 + 0.1 * k as f64),
        residual_mag: Some(0.01),
        sun_v_mag: lit("sun"),
        moon_v_mag: lit("moon"),
        lunar_earthshine_v_mag: lit("lunar_earthshine"),
        ..PhotometryRow::default()
    }
}

/// A section of a page.
fn section<'p>(page: &'p str, id: &str) -> &'p str {
    page.split(&format!("<section id=\"{id}\"")).nth(1).unwrap().split("</section>").next().unwrap()
}

#[test]
fn the_key_of_light_curves_lists_only_lights_and_verdicts_that_occur() {
    let key = |rows: Vec<PhotometryRow>| {
        let page = page_of(rows);
        let key =
            section(&page, "light-curve").split("<ul class=\"key\">").nth(1).unwrap().split("</ul>").next().unwrap();
        ["model", "Sunlight", "Earthshine", "Moonlight", "Lunar-Earthshine", "use", "caution", "reject", "fainter than"]
            .into_iter()
            .filter(|name| key.contains(&format!("> {name}</li>")) || key.contains(&format!(": {name}</li>")))
            .collect::<Vec<_>>()
    };
    let moonlit = || (0..5).map(|k| of_pass(k, "ISS", "", "lunar_earthshine")).collect::<Vec<_>>();
    assert_eq!(key(moonlit()), ["model", "Lunar-Earthshine", "use"]);
    let mut mixed = moonlit();
    mixed.extend((5..9).map(|k| of_pass(k, "ISS", "", "sun")));
    mixed[0].verdict = "caution".into();
    (mixed[1].v_mag, mixed[1].limit_v_mag, mixed[1].status) = (None, Some(13.0), "nondetection".into());
    assert_eq!(key(mixed), ["model", "Sunlight", "Lunar-Earthshine", "use", "caution", "fainter than"]);
}

#[test]
fn two_satellites_in_two_bands_have_charts_and_tables_of_their_own_and_one_of_each_has_no_heading() {
    let satellites = [("ISS", "V"), ("ISS", "g"), ("CSS", "V"), ("CSS", "g")];
    let rows = satellites.iter().flat_map(|(name, filter)| (0..4).map(|k| of_pass(k, name, filter, "moon")));
    let page = page_of(rows.collect());
    let names = ["CSS, V", "CSS, g", "ISS, V", "ISS, g"];
    for id in ["light-curve", "residuals", "distribution"] {
        let heads: Vec<&str> =
            section(&page, id).split("<h3>").skip(1).map(|s| s.split("</h3>").next().unwrap()).collect();
        assert_eq!(heads, names, "{id}");
    }
    let curves = section(&page, "light-curve");
    assert_eq!(curves.matches("<svg class=\"chart").count(), 4);
    assert!(curves.contains(">g [mag]</text>") && curves.contains(">V [mag]</text>"));
    let summary = section(&page, "summary");
    for name in names {
        assert!(summary.contains(&format!("<caption>Passes of {name};")), "{name}");
        assert!(summary.contains(&format!("{name}: median ")), "{name}");
    }
    let plain = page_of((0..4).map(|k| of_pass(k, "ISS", "V", "moon")).collect());
    assert!(!section(&plain, "light-curve").contains("<h3>") && plain.contains("<caption>Passes of ISS; V in mag"));
}

#[test]
fn the_verdict_and_the_passes_come_before_everything_else() {
    let page = std::fs::read_to_string(night().join("report.html")).unwrap();
    let summary = section(&page, "summary");
    let at = |text: &str| summary.find(text).unwrap_or_else(|| panic!("{text}"));
    assert!(at("class=\"lead\"") < at("<caption>Passes") && at("<caption>Passes") < at("<dl class=\"strip\""));
    let lead = summary.split("class=\"lead\">").nth(1).unwrap().split("</p>").next().unwrap();
    for said in ["target frames in ", " that can be used. ", ": median V ", " than the model with a scatter of "] {
        assert!(lead.contains(said), "{said}: {lead}");
    }
    let unusable = PhotometryRow { verdict: "reject".into(), ..of_pass(0, "ISS", "", "moon") };
    assert!(section(&page_of(vec![unusable]), "summary").contains("<strong>No magnitude can be used. </strong>"));
}

#[test]
fn the_model_is_a_smooth_curve_between_the_frames() {
    let page = std::fs::read_to_string(night().join("report.html")).unwrap();
    let lines = section(&page, "light-curve").split("<g data-series=\"model\"><polyline").skip(1);
    let places: Vec<usize> =
        lines.map(|l| l.split("points=\"").nth(1).unwrap().split('"').next().unwrap().split(' ').count()).collect();
    assert!(!places.is_empty() && places.iter().all(|n| (50..=200).contains(n)), "{places:?}");
    // without elements it goes through the frames, and the page says so
    let folder = tempfile::tempdir().unwrap();
    std::fs::copy(night().join("photometry.ecsv"), folder.path().join("photometry.ecsv")).unwrap();
    let bare = night_page(folder.path()).unwrap();
    assert!(bare.curve.is_empty() && bare.notes.iter().any(|n| n.contains("effective.toml")));
}

/// Whether everything but the script is free of numbers that are none.
fn no_nan(page: &str) -> bool {
    // pictures are letters of base64, in which NaN may stand by chance
    let mut parts = page.split("<script>").next().unwrap().split("base64,");
    let first = parts.next().unwrap().to_string();
    let shown = parts.fold(first, |shown, part| shown + part.split_once('"').map_or("", |(_, after)| after));
    let shown = shown.replace("masked or NaN", "");
    !shown.contains("NaN") && !shown.contains(">inf")
}

/// The first browser of the Chromium family on this machine.
fn browser() -> Option<&'static str> {
    let answers = |name: &&str| Command::new(name).arg("--version").output().is_ok_and(|o| o.status.success());
    ["chromium", "chromium-browser", "google-chrome"].into_iter().find(answers)
}

#[test]
fn in_a_browser_the_gallery_sorts_a_point_leads_to_its_cutout_and_nothing_is_complained_about() {
    let Some(browser) = browser() else {
        println!("skipped: no Chromium here");
        return;
    };
    let page = std::fs::read_to_string(night().join("report.html")).unwrap();
    // the page polices its scripts, so the one that tries it is let in by taking the policy off
    let policy = page.find("<meta http-equiv").unwrap();
    let end = policy + page[policy..].find('>').unwrap() + 1;
    let trial = "<script>(() => {\
        const said = [];\
        const order = document.getElementById('order');\
        const first = () => [...document.querySelectorAll('#gallery li')].map((l) => l.id).join();\
        const before = first(); order.value = 'snr'; order.dispatchEvent(new Event('change', {bubbles: true}));\
        said.push('sorted ' + (first() !== before));\
        const point = document.querySelector('#light-curve a');\
        said.push('leads ' + (document.querySelector(point.getAttribute('href')) !== null));\
        const box = document.querySelector('input[data-toggle=model]'); box.click();\
        said.push('toggled ' + (document.querySelector('g[data-series=model]').style.display === 'none'));\
        const fill = () => getComputedStyle(document.querySelector('#light-curve a .point')).fill;\
        const plain = fill(); document.querySelector('input[data-by]').click();\
        said.push('coloured ' + (fill() !== plain));\
        const head = document.querySelector('#frames th:nth-child(3) button'); head.click();\
        said.push('table ' + head.parentElement.getAttribute('aria-sort'));\
        said.push('errors ' + errors.length); document.title = said.join(', ');\
        })();</script></body>";
    let watch = "<script>const errors = []; window.addEventListener('error', (e) => errors.push(e.message));</script>";
    let tried = format!("{}{watch}{}", &page[..policy], &page[end..]).replace("</body>", trial);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("tried.html");
    std::fs::write(&path, tried).unwrap();
    let dump = |path: &Path| {
        let done = Command::new(browser)
            .args(["--headless", "--no-sandbox", "--disable-gpu", "--dump-dom", "--enable-logging=stderr", "--v=0"])
            .arg(format!("--user-data-dir={}", folder.path().join("profile").display()))
            .arg(format!("file://{}", path.display()))
            .output()
            .unwrap();
        (String::from_utf8_lossy(&done.stdout).into_owned(), String::from_utf8_lossy(&done.stderr).into_owned())
    };
    let (dom, _) = dump(&path);
    let title = dom.split("<title>").nth(1).and_then(|t| t.split("</title>").next()).unwrap_or_default();
    assert_eq!(title, "sorted true, leads true, toggled true, coloured true, table ascending, errors 0");
    // and untouched, under its own policy, it has nothing to say on the console
    let (dom, console) = dump(&night().join("report.html"));
    assert!(dom.contains("24 of 24 shown"), "the script did not run under the page's own policy");
    assert!(!console.contains("CONSOLE"), "{console}");
}
