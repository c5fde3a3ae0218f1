//! The numbers of the paper and ours: the checklist complete, the values those of an independent computation, the
//! verdicts what the values say, and the committed page what the program says.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::collections::HashSet;
use std::sync::OnceLock;

use satphot::paper::{Basis, Published, Rule, Verdict, entries, published, table};

fn fast() -> &'static [Published] {
    static ROWS: OnceLock<Vec<Published>> = OnceLock::new();
    ROWS.get_or_init(|| published(false).unwrap())
}

fn row(id: &str) -> &'static Published {
    fast().iter().find(|r| r.entry.id == id).unwrap_or_else(|| panic!("no row {id}"))
}

/// Every published number that was looked into, by the ids that stand for it.
const CHECKLIST: &str = "\
    iss-solar-area iss-total-area starlink-v1.5-area starlink-v2-area earendil-area
    night-day-difference night-day-difference-err sigma-phot
    starcloud-gain starcloud-ratio starcloud-moonlit altitude-term t-eff-iss earendil-beam mu-observed nu-iss
    stk-mag-lunar-earthshine stk-mag-moon stk-mag-starlight stk-body1-ratio stk-panel-ratio stk-body1-gain
    limit-full-1 limit-full-5 limit-new-1 limit-new-5 rubin-g rubin-r rubin-i rubin-g-effective
    iss-night-median iss-night-bright iss-night-faint iss-day-median iss-day-bright iss-day-faint
    direct-moon-directions chassis-share nights-moon-up nights-unlit duty-twilight duty-day duty-moon bluebird-mu
    pass-2025-06-08-residual pass-2025-06-10-morning-residual pass-2025-06-10-evening-residual pass-2025-06-12-residual
    pass-2025-06-11-residual pass-2025-06-08-median pass-2025-06-10-morning-median pass-2025-06-10-evening-median pass-2025-06-12-median
    nights-detectable
    iss-chassis-area mu-example mu-results iss-mu-midnight sun-moon-ratio disc-area nadir-panel nadir-panel-albedo
    projected-area brdf-definition streak-scaling nu-iss-400 starcloud-nu starcloud-nu-of-mu starcloud-nu-of-model
    stk-body2-ratio stk-least-gain stk-radiance-unit stk-radiance-white stk-lunar-earthshine
    stk-lunar-earthshine-albedo stk-snr-ratio stk-vega-offset pixel-scale pixel-area-ratio gain-unit zeropoint-gap
    moon-system median-or-mean v3-over-v2-area starlink-count residual residual-scatter lowest-pass missed-pass extinction-global
    extinction-direct
    pass-2024-01-24-moon pass-2024-01-24-sun pass-2024-01-24-moon-alt pass-2025-06-08-moon pass-2025-06-08-sun
    pass-2025-06-08-alt pass-2025-06-09-range pass-2025-06-09-moon pass-2025-06-09-sun pass-2025-06-09-alt
    pass-2025-06-10-morning-moon pass-2025-06-10-morning-sun pass-2025-06-10-morning-alt
    pass-2025-06-10-evening-moon pass-2025-06-10-evening-sun pass-2025-06-10-evening-alt
    pass-2025-06-11-moon pass-2025-06-11-sun pass-2025-06-11-alt pass-2025-06-12-moon pass-2025-06-12-sun
    pass-2025-06-12-alt pass-labels full-moon last-quarter moon-distance-term
    moon-law-2 moon-law-5 moon-law-7 moon-law-10 moon-law-20 moon-law-30 moon-law-60 moon-law-90 moon-surge-2
    moon-law-holzloehner
    chassis-reflectance-0 chassis-reflectance-40 chassis-reflectance-60 chassis-reflectance-85
    array-reflectance-0 array-reflectance-40 array-reflectance-60 array-reflectance-85
    earth-reflectance-0 earth-reflectance-40 earth-reflectance-60 earth-reflectance-85
    phong-reflectance-0 phong-reflectance-40 phong-reflectance-60 phong-reflectance-85
    chassis-peak chassis-half-width lumos-direct lumos-earthshine ab-of-sun
    zp k c median-night median-twilight median-day std-night std-twilight std-day
    pass-2025-06-08-max pass-2025-06-10-morning-max pass-2025-06-10-evening-max pass-2025-06-11-max
    pass-2025-06-12-max pass-2024-01-24-max pass-2025-06-09-css-max pass-2025-06-09-css-median
    count-night count-twilight count-day pointing-rms";

/// As published and corrected as an independent computation has them, and how near is the same.
const EXPECTED: &[(&str, f64, f64, f64)] = &[
    ("iss-solar-area", 2672.36, 2672.36, 0.005),
    ("iss-chassis-area", 1623.9434, 1623.9434, 0.001),
    ("iss-chassis-area-cupola", 1628.4434, 1628.4434, 0.001),
    ("sun-moon-ratio", 372_529.029_846, 398_107.170_553, 0.1),
    ("starcloud-gain", 14.654_243, 14.487_6, 0.001),
    ("starcloud-ratio", 727_272.7, 623_781.7, 1.0),
    ("night-day-difference-err", 1.306, 1.306, 0.001),
    ("sigma-phot", 0.170_293_86, 0.154_301_65, 1e-6),
    ("ab-of-sun", -27.055_758, -26.76, 1e-5),
    ("stk-body2-ratio", 204.237_288, 204.237_288, 1e-4),
    ("stk-body1-ratio", 828.2, 828.2, 0.1),
    ("stk-panel-ratio", 93.2, 93.2, 0.1),
    ("stk-mag-lunar-earthshine", 12.980_897, 12.914_6, 0.001),
    ("stk-mag-moon", 13.456_934, 13.390_6, 0.001),
    ("stk-vega-offset", f64::NAN, 0.066, 0.001),
    ("stk-snr-ratio", 534.0, 294.0, 1.0),
    ("stk-radiance-unit", 4.9e-6, 1.7e-5, 5e-7),
    ("stk-radiance-white", f64::NAN, 6e-8, 1e-9),
    ("stk-lunar-earthshine", f64::NAN, 4.3e-8, 1e-9),
    ("stk-lunar-earthshine-albedo", f64::NAN, 0.0069, 1e-4),
    ("iss-diameter-angle", 37.933_895, 37.933_895, 1e-4),
    ("iss-solid-angle", 1_130.172_563, 1_130.172_563, 1e-3),
    ("mu-observed", 19.652_862, 19.652_862, 1e-4),
    ("disc-area", 28.99, 19.652_862, 0.01),
    ("nadir-panel-albedo", f64::NAN, 0.0149, 1e-4),
    ("nadir-panel", std::f64::consts::FRAC_1_SQRT_2, 0.0, 1e-9),
    ("projected-area", 0.5, 1.0, 1e-9),
    ("t-eff-iss", 9.587_819, 9.587_819, 1e-4),
    ("altitude-term", 12.019_389, 12.019_389, 1e-4),
    ("trail-width-iss", 38.186_815, 38.186_815, 1e-4),
    ("nu-iss", 35.777_846, 27.908_281, 0.002),
    ("nu-iss-400", 35.887, 27.908_281, 0.002),
    ("starcloud-nu", f64::NAN, 25.16, 0.02),
    ("starcloud-nu-of-mu", f64::NAN, 23.8, 0.05),
    ("starcloud-nu-of-model", f64::NAN, 21.5, 0.05),
    ("limit-full-1", 21.651_795, f64::NAN, 0.006),
    ("limit-full-5", 19.671_773, f64::NAN, 0.006),
    ("limit-new-1", 22.56, f64::NAN, 0.01),
    ("limit-new-5", 20.27, f64::NAN, 0.01),
    ("rubin-g", 23.153, 23.55, 0.006),
    ("rubin-r", 23.182, f64::NAN, 0.002),
    ("rubin-i", 23.143, f64::NAN, 0.002),
    ("rubin-g-effective", 23.490_342, 23.490_342, 0.002),
    ("earendil-beam", 5.781_444, 5.781_444, 1e-3),
    ("earendil-sun", -14.444_15, -14.444_15, 1e-3),
    ("earendil-moon", -0.41, -0.41, 0.01),
    ("duty-twilight", 12.4, 12.4, 0.05),
    ("duty-day", 53.8, 53.8, 0.05),
    ("nights-moon-up", 16.0, 16.0, 0.0),
    ("nights-unlit", 7.0, 7.0, 1.0),
    ("pixel-scale", f64::NAN, 0.195_748_5, 1e-6),
    ("pass-2025-06-08-sun", f64::NAN, -44.760_732, 0.03),
    ("pass-2025-06-08-moon", 92.4, 96.65, 0.06),
    ("pass-2025-06-08-alt", -88.741_812, 32.1, 0.05),
    ("pass-2025-06-09-range", f64::NAN, 749.0, 1.0),
    ("pass-2025-06-09-moon", 93.1, 97.1, 0.1),
    ("pass-2025-06-09-alt", -51.0, 72.8, 0.15),
    ("lowest-pass", f64::NAN, 32.1, 0.05),
    ("missed-pass", f64::NAN, 87.5, 0.1),
    // 07:43:50 and 19:19 UTC, to ten seconds and a minute
    ("full-moon", 7.7306, 7.7306, 0.003),
    ("last-quarter", 19.3167, 19.3167, 0.017),
    ("moon-law-2", -12.68, -12.82, 0.006),
    ("moon-law-5", -12.60, -12.61, 0.01),
    ("moon-law-7", -12.55, -12.52, 0.006),
    ("moon-law-10", -12.47, -12.41, 0.006),
    ("moon-law-20", -12.21, -12.12, 0.006),
    ("moon-law-30", -11.95, -11.86, 0.006),
    ("moon-law-60", -11.12, -11.05, 0.006),
    ("moon-law-90", -10.13, -10.07, 0.006),
    ("moon-surge-2", -12.68, -12.92, 0.006),
    ("moon-distance-term", 0.0, 0.11, 0.02),
    ("chassis-reflectance-0", 0.578, 0.578, 5e-4),
    ("chassis-reflectance-40", 0.567, 0.567, 5e-4),
    ("chassis-reflectance-60", 0.543, 0.543, 6e-4),
    ("chassis-reflectance-85", 0.374, 0.374, 5e-4),
    ("array-reflectance-0", 0.0339, 0.0339, 1e-4),
    ("array-reflectance-40", 0.0332, 0.0332, 1e-4),
    ("array-reflectance-60", 0.0301, 0.0301, 1e-4),
    ("array-reflectance-85", 0.0210, 0.0210, 1e-4),
    ("earth-reflectance-0", 0.810, 0.810, 5e-4),
    ("earth-reflectance-40", 0.745, 0.745, 5e-4),
    ("earth-reflectance-60", 0.673, 0.673, 5e-4),
    ("earth-reflectance-85", 0.583, 0.583, 5e-4),
    ("phong-reflectance-0", 1.0, 1.0, 1e-3),
    ("phong-reflectance-40", 0.766, 0.766, 1e-3),
    ("phong-reflectance-60", 0.5, 0.5, 1e-3),
    ("phong-reflectance-85", 0.098, 0.098, 1e-3),
    ("chassis-peak", 2187.762, 1143.0, 2.0),
    ("chassis-half-width", 0.18, 0.18, 0.005),
    ("lumos-direct", 9.439_351_055e-15, 9.439_351_055e-15, 1e-20),
    ("lumos-earthshine", 1.498_020_037e-13, 1.498_020_037e-13, 1.5e-15),
    ("extinction-global", 0.22, 0.0, 0.015),
    ("extinction-direct", 0.36, 0.0, 0.015),
    ("direct-moon-directions", 0.0, 0.0, 0.0),
    ("chassis-share", f64::NAN, 94.0, 2.0),
    // an independent engine with another grid: its own spread
    ("iss-night-median", 11.28, f64::NAN, 0.25),
    ("iss-day-median", -2.6, -1.61, 0.15),
    ("iss-mu-midnight", f64::NAN, 17.7, 0.4),
    ("bluebird-mu", f64::NAN, 16.4, 0.2),
    // medians of the passes: which moments count is not known to better
    ("pass-2025-06-08-median", f64::NAN, 13.15, 0.3),
    ("pass-2025-06-10-morning-median", f64::NAN, 13.24, 0.3),
    ("pass-2025-06-10-evening-median", f64::NAN, 12.40, 0.3),
    ("pass-2025-06-12-median", f64::NAN, 12.08, 0.3),
];

#[test]
fn no_number_of_the_checklist_is_missing_and_no_id_is_there_twice() {
    let mut seen = HashSet::new();
    for entry in entries() {
        assert!(seen.insert(entry.id), "{} twice", entry.id);
        assert!(!entry.place.is_empty() && !entry.quantity.is_empty(), "{}", entry.id);
        let explained = entry.basis == Basis::Stated || !entry.why.is_empty();
        assert!(explained, "{}: no reason", entry.id);
        assert_eq!(entry.printed.is_empty(), entry.value.is_none(), "{}", entry.id);
    }
    let missing: Vec<&str> = CHECKLIST.split_whitespace().filter(|id| !seen.contains(id)).collect();
    assert!(missing.is_empty(), "{missing:?}");
}

#[test]
fn every_computed_value_is_that_of_an_independent_computation() {
    let mut wrong = Vec::new();
    for (id, as_published, corrected, within) in EXPECTED {
        let numbers = row(id).numbers;
        for (what, got, expected) in
            [("as published", numbers.as_published, as_published), ("corrected", numbers.corrected, corrected)]
        {
            let near = expected.is_nan() || got.is_some_and(|got| (got - expected).abs() <= *within);
            if !near {
                wrong.push(format!("{id} {what}: {got:?}, expected {expected} +- {within}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn every_verdict_follows_from_its_rule_and_the_numbers() {
    let mut wrong = Vec::new();
    for r in fast() {
        let e = &r.entry;
        let judged = matches!(e.basis, Basis::Stated | Basis::Assumed);
        assert!(!judged || e.rule.is_some(), "{}: no rule", e.id);
        // the rule written out once more, without the program's
        let number = r.numbers.as_published.or(r.numbers.corrected);
        let held = if e.rule == Some(Rule::Formula) { r.numbers.corrected } else { e.against.or(e.value) };
        let agrees = match (e.rule, number, held, r.tolerance()) {
            (Some(Rule::AtLeast), Some(n), Some(v), _) => n >= v,
            (Some(Rule::AtMost), Some(n), Some(v), _) => n <= v,
            (Some(Rule::Pass), ..) => r.judged.is_some_and(|alt_deg| alt_deg >= 10.0),
            (Some(_), Some(n), Some(v), Some(tolerance)) => (n - v).abs() <= tolerance * (1.0 + 1e-9) + 1e-9 * v.abs(),
            _ => false,
        };
        let expected = match e.basis {
            Basis::Literature => Verdict::Literature,
            Basis::Additional => Verdict::Additional,
            _ if r.is_skipped => Verdict::NotComputed,
            _ if !agrees => Verdict::NotReproduced,
            Basis::Stated => Verdict::Reproduced,
            Basis::Assumed => Verdict::WithAssumption,
        };
        if r.verdict() != expected {
            wrong.push(format!("{}: {:?}, by its rule {expected:?}: {:?}", e.id, r.verdict(), r.numbers));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn a_tolerance_is_one_of_its_kind_and_none_is_a_rows_own() {
    for r in fast().iter().filter(|r| r.is_judged() && !r.is_skipped) {
        let (Some(rule), Some(value), Some(tolerance)) = (r.entry.rule, r.held_against(), r.tolerance()) else {
            continue;
        };
        let of_kind = match rule {
            Rule::Count | Rule::Pass | Rule::AtLeast | Rule::AtMost => tolerance == 0.0,
            Rule::AboutCount | Rule::MoonShare => tolerance == 1.0,
            Rule::Share => tolerance == 0.5,
            Rule::SunAltitude => tolerance == 2.5,
            Rule::Limit => tolerance == 0.05,
            Rule::Model => tolerance == 0.3,
            Rule::Residual => tolerance == 0.8,
            Rule::About => tolerance == 0.02 * value.abs(),
            Rule::Formula => tolerance == 0.05 || tolerance == 0.01 * value.abs(),
            // a power of ten not above one
            Rule::Digits => tolerance <= 1.0 && (tolerance.log10() - tolerance.log10().round()).abs() < 1e-9,
        };
        assert!(of_kind, "{}: {rule:?} {tolerance}", r.entry.id);
    }
    // fourteen nights are not eleven: whatever is computed, a count is equal or not reproduced
    let nights = entries().into_iter().find(|e| e.id == "nights-detectable").unwrap();
    assert_eq!((nights.rule, nights.value), (Some(Rule::Count), Some(11.0)));
    assert!(!Rule::Count.agrees(14.0, "11", 11.0, false) && !Rule::Count.agrees(10.0, "11", 11.0, false));
}

#[test]
fn the_headline_residual_is_that_of_the_printed_medians_and_the_untuned_model() {
    // by hand from the rows of the medians
    let ids = ["pass-2025-06-08", "pass-2025-06-10-morning", "pass-2025-06-10-evening", "pass-2025-06-12"];
    let residuals: Vec<f64> = ids
        .iter()
        .map(|id| {
            let median = row(&format!("{id}-median"));
            let residual = median.entry.value.unwrap() - median.numbers.as_published.unwrap();
            assert!((row(&format!("{id}-residual")).numbers.as_published.unwrap() - residual).abs() < 1e-9, "{id}");
            residual
        })
        .collect();
    let mean = residuals.iter().sum::<f64>() / 4.0;
    let std = (residuals.iter().map(|r| (r - mean).powi(2)).sum::<f64>() / 3.0).sqrt();
    let (headline, scatter) = (row("residual"), row("residual-scatter"));
    assert!((headline.numbers.as_published.unwrap() - mean).abs() < 1e-9);
    assert!((scatter.numbers.as_published.unwrap() - std).abs() < 1e-9);
    // -0.8 +- 1.1 by an evaluation of its own
    assert!((mean + 0.8).abs() < 0.1 && (std - 1.1).abs() < 0.1, "{mean} {std}");
    assert_eq!((headline.verdict(), headline.entry.value), (Verdict::NotReproduced, Some(0.03)));
}

#[test]
fn the_rules_stand_above_the_table_and_in_its_meta_block() {
    let text = table::legend();
    for rule in Rule::ALL {
        assert!(text.contains(&format!("- {}: {}\n", rule.name(), rule.criterion())), "{rule:?}");
    }
    let page = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/paper.md")).unwrap();
    assert!(page.contains(&text), "run scripts/reproduce_paper.sh");
}

#[test]
fn the_corrected_values_of_wrong_numbers_are_as_documented() {
    // what is printed, and by how much ours is another
    for (id, printed, corrected) in [
        ("stk-body2-ratio", 240.0, 204.2),
        ("iss-chassis-area", 1577.89, 1623.94),
        ("mu-example", 19.70, 19.65),
        ("mu-results", 20.60, 19.65),
        ("pixel-scale", 1.0, 0.1957),
        ("gain-unit", 100.0, 10.0),
        ("v3-over-v2-area", 4.0, 3.62),
        ("streak-scaling", 100.0, 10.0),
    ] {
        let r = row(id);
        assert_eq!((r.verdict(), r.entry.value), (Verdict::NotReproduced, Some(printed)), "{id}");
        let got = r.numbers.corrected.unwrap();
        assert!((got - corrected).abs() < 0.011 * corrected, "{id}: {got}");
    }
}

/// The texts of a figure with their places from the left.
fn texts(svg: &str) -> Vec<(f64, &str)> {
    let text = |part: &'_ str| -> Option<f64> { part.split(" x=\"").nth(1)?.split('"').next()?.parse().ok() };
    let parts = svg.split("<text").skip(1);
    parts.filter_map(|part| Some((text(part)?, part.split_once('>')?.1.split("</text>").next()?))).collect()
}

/// The labels of a colour bar: the texts that stand `right` of its heading.
fn bar<'s>(svg: &'s str, heading: &str, right: f64) -> Vec<&'s str> {
    let texts = texts(svg);
    let left = texts.iter().find(|t| t.1 == heading).unwrap_or_else(|| panic!("no {heading}")).0;
    texts.iter().filter(|t| (t.0 - left - right).abs() < 0.2).map(|t| t.1).collect()
}

#[test]
fn the_figures_of_the_paper_have_one_scale_for_both_modes_and_do_not_depend_on_threads() {
    let base = tempfile::tempdir().unwrap();
    let draw = |jobs: &str| {
        let folder = base.path().join(jobs);
        let done = std::process::Command::new(env!("CARGO_BIN_EXE_satphot"))
            .args(["published", "-q", "-j", jobs, "--figures"])
            .arg(&folder)
            .output()
            .unwrap();
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        let mut names: Vec<_> = std::fs::read_dir(&folder).unwrap().map(|f| f.unwrap().file_name()).collect();
        names.sort();
        let read = |name: &std::ffi::OsString| {
            (name.to_string_lossy().into_owned(), std::fs::read_to_string(folder.join(name)).unwrap())
        };
        names.iter().map(read).collect::<std::collections::BTreeMap<_, _>>()
    };
    let figures = draw("2");
    assert!(figures == draw("1"), "the figures depend on the number of threads");
    let committed = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/figures/paper");
    for name in figures.keys() {
        assert!(committed.join(name).is_file(), "run scripts/reproduce_paper.sh: {name}");
    }
    for (name, heading, right) in
        [("skies", "V [mag]", 76.0), ("earth", "radiance", 76.0), ("resolved", "radiance", 66.0)]
    {
        let labels = |mode: &str| bar(&figures[&format!("{name}_{mode}.svg")], heading, right);
        assert_eq!(labels("as_published"), labels("corrected"), "{name}");
        assert!(labels("corrected").len() > 3, "{name}");
    }
    // the resolved station: two rows, each with a bar; a pass in both modes under one bar
    assert_eq!(figures["resolved_corrected.svg"].matches("<image").count(), 6);
    let pass = &figures["pass_and_sky.svg"];
    for (text, times) in [(">V [mag]<", 3), (">altitude [deg]<", 1), ("ISS, as published", 1), ("ISS, corrected", 1)] {
        assert_eq!(pass.matches(text).count(), times, "{text}");
    }
    assert_eq!(figures["three_lights.svg"].matches("<image").count(), 3);
    for light in ["Sunlight", "Earthshine", "Moonlight", "Lunar-Earthshine"] {
        assert!(texts(&figures["four_lights.svg"]).iter().any(|t| t.1 == light), "{light}");
    }
}

#[test]
fn literature_is_listed_with_its_source_and_slow_rows_say_so() {
    let literature: Vec<&Published> = fast().iter().filter(|r| r.verdict() == Verdict::Literature).collect();
    assert!(literature.len() > 25);
    assert!(literature.iter().all(|r| !r.entry.why.is_empty()));
    let slow: Vec<&Published> = fast().iter().filter(|r| r.entry.slow).collect();
    assert!(!slow.is_empty() && slow.iter().all(|r| r.is_skipped && r.as_published_text() == "(--full)"));
}

#[test]
fn the_committed_page_says_what_the_program_says() {
    let page = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/paper.md")).unwrap();
    let between = page.split("<!-- published:begin -->").nth(1).and_then(|t| t.split("<!-- published:end -->").next());
    let between = between.expect("the markers of the table are in docs/paper.md");
    let lines: HashSet<&str> = between.lines().collect();
    let mut missing = Vec::new();
    for r in fast() {
        let line = r.markdown_line();
        let id = format!("| `{}` |", r.entry.id);
        let there =
            if r.is_skipped { lines.iter().any(|l| l.starts_with(&id)) } else { lines.contains(line.trim_end()) };
        if !there {
            missing.push(line);
        }
    }
    assert!(missing.is_empty(), "run scripts/reproduce_paper.sh; not on the page:\n{}", missing.concat());
    let ids = between.lines().filter(|l| l.starts_with("| `")).count();
    assert_eq!(ids, fast().len(), "rows of the page that the program does not know");
}
