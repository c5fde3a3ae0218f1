//! The figures: drawn from rows alone, the same bytes each time, brightness upwards, and no input that breaks them.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)] // tests

use std::fs;
use std::path::{Path, PathBuf};

use satphot::figures::{light_curve, light_curve_pages, light_curves, residuals_altitude, zeropoint_diagnostics};
use satphot::tables::{PhotometryRow, ResidualRow, StarRow};

/// Figures stay in the build folder, where a person can look at them.
fn place(name: &str) -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join(name)
}

/// A small generator of numbers in (−1, 1), the same on every machine.
fn noise(state: &mut u64) -> f64 {
    *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

/// A pass that enters the umbra: bright in sunlight, then seven magnitudes fainter, with what goes wrong in a night.
fn pass(first_mjd: f64, n: usize, seed: u64) -> Vec<PhotometryRow> {
    let mut state = seed;
    (0..n)
        .map(|i| {
            let phase = i as f64 / n as f64;
            let sunlit = phase < 0.4;
            let alt_deg = 20.0 + 48.0 * (std::f64::consts::PI * phase).sin();
            let moon = 12.6 - 0.6 * (alt_deg - 20.0) / 48.0;
            let sun = 5.0 - 2.0 * phase;
            let penumbra = (0.4..0.45).contains(&phase);
            let model = match (sunlit, penumbra) {
                (true, _) => sun,
                (_, true) => 8.0,
                _ => moon - 0.4,
            };
            let v_mag = model + 0.3 * noise(&mut state);
            let mjd = first_mjd + i as f64 * 12.0 / 86_400.0;
            let (status, verdict) = match i {
                17 => ("nondetection", "use"),
                21 => ("rejected", "reject"),
                8 | 25 => ("ok", "caution"),
                _ => ("ok", "use"),
            };
            let illum = match (sunlit, penumbra) {
                (true, _) => "sun",
                (_, true) => "penumbra",
                _ => "lunar_earthshine",
            };
            PhotometryRow {
                frame: format!("iss_{i:04}.fits"),
                norad_cat_id: Some(25544),
                object_name: "ISS (ZARYA)".into(),
                date_mid: "2025-06-11T08:51:02.500Z".into(),
                mjd_mid_d: Some(mjd),
                v_mag: (status != "nondetection").then_some(if i == 21 { v_mag - 9.0 } else { v_mag }),
                v_mag_err: Some(if sunlit { 0.02 } else { 0.17 }),
                v_mag_err_sys: Some(0.05),
                limit_v_mag: Some(13.6),
                alt_deg: Some(alt_deg),
                illum: illum.into(),
                model_v_mag: Some(model),
                sun_v_mag: sunlit.then_some(sun + 0.05),
                earthshine_v_mag: Some(if sunlit { 7.5 + phase } else { 15.5 }),
                moon_v_mag: Some(moon + 0.7),
                lunar_earthshine_v_mag: Some(moon + 0.1),
                model_err_mag: Some(0.15),
                residual_mag: Some(v_mag - model),
                status: status.into(),
                verdict: verdict.into(),
                ..Default::default()
            }
        })
        .collect()
}

fn residuals(n: usize) -> Vec<ResidualRow> {
    let mut state = 7;
    let lights = ["sun", "penumbra", "moon", "lunar_earthshine", "earthshine"];
    (0..n)
        .map(|i| ResidualRow {
            frame: format!("f{i}.fits"),
            alt_deg: Some(20.0 + 60.0 * (i as f64 / n as f64)),
            illum: lights[i * 5 / n].into(),
            residual_mag: Some(0.1 + 0.4 * (noise(&mut state) + noise(&mut state)) + if i == 3 { 6.0 } else { 0.0 }),
            v_mag_err: Some(0.1),
            verdict: match i {
                3 => "reject",
                _ if i % 11 == 0 => "caution",
                _ => "use",
            }
            .into(),
            ..Default::default()
        })
        .collect()
}

fn stars(n: usize) -> Vec<StarRow> {
    let mut state = 3;
    (0..n)
        .map(|i| {
            let (airmass, b_v, v) =
                (1.5 + 0.5 * noise(&mut state), 0.55 + 0.34 * noise(&mut state), 12.0 + 2.0 * noise(&mut state));
            let bad = i % 23 == 5;
            let scatter = 0.04 * (noise(&mut state) + noise(&mut state)) + if bad { 0.9 } else { 0.0 };
            StarRow {
                star_id: format!("s{i}"),
                mjd_mid_d: Some(60_834.4 + 0.3 * i as f64 / n as f64),
                x_px: Some(4788.0 + 2400.0 * noise(&mut state)),
                y_px: Some(3194.0 + 2400.0 * noise(&mut state)),
                inst_mag: Some(v - 23.37 + 0.12 * airmass + 0.08 * b_v + scatter),
                airmass: Some(airmass),
                catalogue_v_mag: Some(v),
                catalogue_b_v_mag: Some(b_v),
                fit_weight: Some(if bad { 0.0 } else { 1.0 }),
                status: "ok".into(),
                ..Default::default()
            }
        })
        .collect()
}

/// Panics where the text is not well-formed XML: tags that nest, quoted attributes, escaped text, no control characters.
fn assert_well_formed(svg: &str) {
    let mut open: Vec<&str> = Vec::new();
    let mut rest = svg;
    let mut elements = 0;
    while let Some(at) = rest.find('<') {
        let text = &rest[..at];
        assert!(!text.contains('>') && text.split('&').skip(1).all(|t| t.contains(';')), "raw text {text:?}");
        let end = at + rest[at..].find('>').expect("a tag that ends");
        let tag = &rest[at + 1..end];
        rest = &rest[end + 1..];
        assert!(tag.matches('"').count().is_multiple_of(2), "unbalanced quotes in <{tag}>");
        let name = tag.trim_start_matches('/').split([' ', '/']).next().unwrap();
        if tag.starts_with('/') {
            assert_eq!(open.pop(), Some(name), "</{name}> closes something else");
        } else if !tag.ends_with('/') {
            open.push(name);
        }
        elements += 1;
    }
    assert!(open.is_empty() && rest.trim().is_empty() && elements > 2, "left open: {open:?}, after the end: {rest:?}");
    assert!(svg.chars().all(|c| c == '\n' || !c.is_control()), "control characters");
}

/// (cx, cy) of the filled circles of observed points, in drawing order; the legend's own circle is last.
fn observed_circles(svg: &str) -> Vec<(f64, f64)> {
    let number = |tag: &str, name: &str| -> f64 {
        let from = tag.find(&format!("{name}=\"")).unwrap() + name.len() + 2;
        tag[from..].split('"').next().unwrap().parse().unwrap()
    };
    let blue = svg.lines().filter(|l| l.starts_with("<circle") && l.contains("fill=\"#0072B2\""));
    blue.map(|l| (number(l, "cx"), number(l, "cy"))).collect()
}

/// All numbers in the attributes of a figure.
fn coordinates(svg: &str) -> Vec<f64> {
    let values = svg.split('"').skip(1).step_by(2).flat_map(|v| v.split([' ', ',']).map(str::to_owned));
    values.filter_map(|v| v.parse().ok()).collect()
}

fn night_of_three() -> Vec<PhotometryRow> {
    let mut rows = pass(60_837.368, 30, 1);
    rows.extend(pass(60_837.433, 24, 2));
    rows.extend(pass(60_837.998, 12, 2));
    rows
}

#[test]
fn identical_rows_give_identical_figures() {
    let twice = |draw: &dyn Fn(&Path)| {
        let (a, b) = (place("twice_a.svg"), place("twice_b.svg"));
        draw(&a);
        draw(&b);
        assert_eq!(fs::read(a).unwrap(), fs::read(b).unwrap());
    };
    twice(&|p| light_curve(p, &night_of_three(), "A night").unwrap());
    twice(&|p| residuals_altitude(p, &residuals(90), "V").unwrap());
    twice(&|p| zeropoint_diagnostics(p, &stars(321), (-23.37, 0.12, 0.08), ("V", "B-V")).unwrap());
}

#[test]
fn a_brighter_observation_is_drawn_higher_and_a_later_one_further_right() {
    let mut rows = pass(60_837.3, 2, 1);
    (rows[0].v_mag, rows[1].v_mag) = (Some(4.6), Some(7.1)); // the first is brighter
    let path = place("direction.svg");
    light_curve(&path, &rows, "Direction").unwrap();
    let circles = observed_circles(&fs::read_to_string(&path).unwrap());
    assert!(circles[0].1 < circles[1].1, "bright {:?} must be above faint {:?}", circles[0], circles[1]);
    assert!(circles[0].0 < circles[1].0, "early {:?} must be left of late {:?}", circles[0], circles[1]);
}

#[test]
fn magnitudes_are_placed_in_proportion() {
    let mut rows = pass(60_837.3, 3, 1);
    (rows[0].v_mag, rows[1].v_mag, rows[2].v_mag) = (Some(5.0), Some(6.0), Some(8.0));
    let path = place("proportion.svg");
    light_curve(&path, &rows, "Proportion").unwrap();
    let y: Vec<f64> = observed_circles(&fs::read_to_string(&path).unwrap()).iter().map(|c| c.1).collect();
    // Each place is rounded to a tenth of a drawn pixel, so a distance is wrong by 0.1 at most and twice a distance by 0.2.
    assert!(((y[2] - y[1]) - 2.0 * (y[1] - y[0])).abs() <= 0.301, "{y:?}");
}

/// Places of the first band of a figure: the way there along its bright edge, and back along the faint one.
fn band(svg: &str) -> Vec<(f64, f64)> {
    let line = svg.lines().find(|l| l.contains("<polygon") && l.contains("0.2")).expect("a band");
    let points = line.split("points=\"").nth(1).unwrap().split('"').next().unwrap();
    let place = |p: &str| p.split_once(',').map(|(x, y)| (x.parse().unwrap(), y.parse().unwrap())).unwrap();
    points.split_whitespace().map(place).collect()
}

#[test]
fn the_error_of_a_prediction_is_a_band_of_its_width_about_the_model() {
    // magnitudes 5 and 6 give the scale of the axis
    let mut rows = pass(60_837.3, 2, 1);
    for (row, v_mag) in rows.iter_mut().zip([5.0, 6.0]) {
        (row.v_mag, row.model_v_mag, row.v_pred_err_mag) = (Some(v_mag), Some(v_mag), Some(0.5));
    }
    let path = place("predicted.svg");
    light_curve(&path, &rows, "Predicted").unwrap();
    let svg = fs::read_to_string(&path).unwrap();
    assert!(svg.contains("68 % of observations") && !svg.contains("model ± error"));
    let y: Vec<f64> = observed_circles(&svg).iter().map(|c| c.1).collect();
    let (edges, one_mag) = (band(&svg), y[1] - y[0]);
    assert_eq!(edges.len(), 4);
    // there, and back
    for (k, back) in [(0, 3), (1, 2)] {
        assert!((y[k] - edges[k].1 - 0.5 * one_mag).abs() < 0.3, "{edges:?} {y:?}");
        assert!((edges[back].1 - y[k] - 0.5 * one_mag).abs() < 0.3, "{edges:?} {y:?}");
    }
    // a satellite that nobody compared has none, but for the numerical error
    rows.iter_mut().for_each(|row| row.v_pred_err_mag = None);
    light_curve(&path, &rows, "Predicted").unwrap();
    assert!(fs::read_to_string(&path).unwrap().contains("model ± error"));
}

#[test]
fn a_wild_rejected_point_does_not_squeeze_the_others() {
    let mut rows = pass(60_837.3, 6, 1);
    let calm = place("calm.svg");
    light_curve(&calm, &rows[..5], "Calm").unwrap();
    rows[5] = PhotometryRow { v_mag: Some(60.0), verdict: "reject".into(), ..rows[4].clone() };
    let wild = place("wild.svg");
    light_curve(&wild, &rows, "Wild").unwrap();
    let y = |p: &Path| observed_circles(&fs::read_to_string(p).unwrap())[..5].iter().map(|c| c.1).collect::<Vec<_>>();
    assert_eq!(y(&calm), y(&wild));
    assert!(fs::read_to_string(&wild).unwrap().contains("1 beyond the axis"));
}

#[test]
fn nothing_is_drawn_outside_the_sheet() {
    let mut rows = night_of_three();
    rows[3].v_mag = Some(1e300);
    rows[4].v_mag_err = Some(1e12);
    rows[5].model_v_mag = Some(-1e9);
    rows[6].alt_deg = Some(1e9);
    let path = place("outside.svg");
    light_curve(&path, &rows, "Outside").unwrap();
    // Three blocks of 860 drawn pixels under a heading of 110, the widest coordinate is the width.
    let extreme = coordinates(&fs::read_to_string(&path).unwrap()).into_iter().fold(0.0, |a: f64, b| a.max(b.abs()));
    assert!(extreme <= 110.0 + 3.0 * 860.0, "{extreme}");
}

#[test]
fn no_input_breaks_a_figure() {
    let missing = PhotometryRow { mjd_mid_d: Some(60_837.3), ..Default::default() };
    let weird = PhotometryRow {
        v_mag: Some(f64::NAN),
        v_mag_err: Some(f64::INFINITY),
        model_v_mag: Some(f64::NEG_INFINITY),
        alt_deg: Some(f64::NAN),
        mjd_mid_d: Some(60_837.3),
        object_name: "<&\"'\u{1}\u{7f}é☾>".into(),
        ..Default::default()
    };
    let timeless = PhotometryRow { mjd_mid_d: Some(f64::NAN), v_mag: Some(5.0), ..Default::default() };
    let same = vec![pass(60_837.3, 1, 1)[0].clone(); 4];
    let cases: Vec<Vec<PhotometryRow>> = vec![
        vec![],
        vec![missing.clone()],
        vec![missing.clone(), missing],
        vec![weird.clone()],
        vec![weird, pass(60_837.3, 1, 1)[0].clone()],
        vec![timeless],
        pass(60_837.3, 1, 1),
        pass(60_837.3, 2, 1),
        same,
        (0..9).flat_map(|i| pass(60_837.0 + 0.07 * f64::from(i), 3, 1)).collect(),
    ];
    for (i, rows) in cases.iter().enumerate() {
        let path = place(&format!("case_{i}.svg"));
        light_curve(&path, rows, "A <title> & \"quotes\" \u{0}").unwrap();
        assert_well_formed(&fs::read_to_string(&path).unwrap());
    }
    for n in [0, 1, 2, 90] {
        residuals_altitude(&place("r.svg"), &residuals(n), "V").unwrap();
        assert_well_formed(&fs::read_to_string(place("r.svg")).unwrap());
        zeropoint_diagnostics(&place("z.svg"), &stars(n), (-23.0, 0.1, 0.0), ("V", "B-V")).unwrap();
        assert_well_formed(&fs::read_to_string(place("z.svg")).unwrap());
    }
    residuals_altitude(&place("r.svg"), &[ResidualRow::default(), ResidualRow::default()], "V").unwrap();
    zeropoint_diagnostics(&place("z.svg"), &[StarRow::default()], (f64::NAN, 0.0, 0.0), ("V", "B-V")).unwrap();
    assert_well_formed(&fs::read_to_string(place("z.svg")).unwrap());
}

#[test]
fn an_empty_figure_says_why() {
    let text = |rows: &[PhotometryRow]| {
        light_curve(&place("why.svg"), rows, "Why").unwrap();
        fs::read_to_string(place("why.svg")).unwrap()
    };
    assert!(text(&[]).contains("no data: no target frame"));
    assert!(text(&[PhotometryRow::default()]).contains("no data: none of 1 frames has a time"));
    residuals_altitude(&place("why_r.svg"), &[], "V").unwrap();
    assert!(fs::read_to_string(place("why_r.svg")).unwrap().contains("no data: no frame has both"));
    zeropoint_diagnostics(&place("why_z.svg"), &[], (-23.0, 0.1, 0.1), ("V", "B-V")).unwrap();
    assert!(fs::read_to_string(place("why_z.svg")).unwrap().contains("no data: no star was measured"));
}

#[test]
fn one_figure_is_written_for_each_pass_and_named_after_it() {
    let mut rows = night_of_three();
    for (row, date) in
        rows.iter_mut().zip(["2025-06-11T08:49:55.200Z"; 30].into_iter().chain(["2025-06-11T10:23:31Z"; 36]))
    {
        row.date_mid = date.into();
    }
    let dir = place("passes");
    fs::create_dir_all(&dir).unwrap();
    let names: Vec<String> = light_curves(&dir, &rows, "A night")
        .unwrap()
        .iter()
        .map(|p| p.file_name().unwrap().to_string_lossy().into_owned())
        .collect();
    let expected =
        ["light_curve_25544_20250611T084955.svg", "light_curve_25544_20250611T102331.svg", "light_curve_3.svg"];
    assert_eq!(names, expected, "the third has the second's date, so it is numbered");
    names.iter().for_each(|name| assert_well_formed(&fs::read_to_string(dir.join(name)).unwrap()));
}

#[test]
fn more_than_three_passes_are_counted_in_a_note_and_have_figures_of_their_own_no_higher_than_a_page() {
    let rows: Vec<PhotometryRow> = (0..9).flat_map(|i| pass(60_837.0 + 0.07 * f64::from(i), 3, 1)).collect();
    light_curve(&place("nine.svg"), &rows, "Nine").unwrap();
    assert!(fs::read_to_string(place("nine.svg")).unwrap().contains("… and 6 more passes"));
    let dir = place("pages");
    fs::create_dir_all(&dir).unwrap();
    let paths = light_curve_pages(&dir, (&rows[..21], &[]), "Seven", "V").unwrap();
    let names: Vec<_> = paths.iter().map(|p| p.file_name().unwrap().to_string_lossy().into_owned()).collect();
    assert_eq!(names, ["light_curve.svg", "light_curve_2.svg", "light_curve_3.svg"]);
    for (path, passes) in paths.iter().zip([3, 3, 1]) {
        let svg = fs::read_to_string(path).unwrap();
        assert_eq!(svg.matches("of 3 frames used").count(), passes, "{}", path.display());
        let height: f64 = svg.split("height=\"").nth(1).unwrap().split("mm\"").next().unwrap().parse().unwrap();
        assert!(svg.contains("width=\"174mm\"") && height < 250.0, "{height} mm");
    }
}

#[test]
fn rejected_stars_are_drawn_open_and_used_ones_full() {
    let path = place("zeropoint.svg");
    let all = stars(321);
    zeropoint_diagnostics(&path, &all, (-23.37, 0.12, 0.08), ("V", "B-V")).unwrap();
    let svg = fs::read_to_string(&path).unwrap();
    let used = all.iter().filter(|s| s.fit_weight != Some(0.0)).count();
    assert_eq!(observed_circles(&svg).len(), 6 * used + 1, "six panels and the legend");
    assert!(svg.contains(&format!("rejected ({})", all.len() - used)));
}
