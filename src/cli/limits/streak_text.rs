//! What `satphot limits streak` prints: one satellite number by number, or the paper's satellites as tables.

use std::fmt::Write as _;

use satphot::report::summary::text_table;
use satphot::tables::StreakRow;
use satphot::visibility::survey::{LimitKind, SeeingMeaning, Visit};

/// A number or a dash.
fn cell(value: Option<f64>, decimals: usize) -> String {
    value.map_or("-".into(), |v| format!("{v:.decimals$}"))
}

/// A count of electrons, short.
fn electrons(value: Option<f64>) -> String {
    value.map_or("-".into(), |e| match e {
        _ if e < 10.0 => format!("{e:.3}"),
        _ if e < 1e5 => format!("{e:.1}"),
        _ => format!("{e:.2e}"),
    })
}

/// Everything about one satellite, both readings.
pub fn one_text(r: &StreakRow, visit: &Visit, published: Option<f64>) -> String {
    let height = r.height_km.map_or(String::new(), |h| format!(", height {h:.1} km"));
    let mut text = format!(
        "{}: {} m2, range {:.1} km{height}; {:.4} deg/s ({})\n\n",
        r.object_name, r.area_m2, r.range_km, r.rate_deg_s, r.rate_source
    );
    let mut rows: Vec<Vec<String>> = Vec::new();
    let mut push = |name: &str, value: String, unit: &str, note: &str| {
        rows.push(vec![name.into(), value, unit.into(), note.into()]);
    };
    push("magnitude, tracked", cell(r.v_mag, 3), "V mag", &r.mag_source);
    push("surface brightness, tracked", cell(r.mu_mag_arcsec2, 3), "V mag/arcsec2", "m + 2.5 lg(A/d2)");
    push("angle of the satellite", format!("{:.3}", r.satellite_arcsec), "arcsec", "disc of its area");
    push("blur out of focus", format!("{:.3}", r.defocus_arcsec), "arcsec", "mirror seen from there");
    push("seeing", format!("{:.3}", r.fwhm_arcsec), "arcsec", "FWHM");
    push("trail width", format!("{:.3}", r.trail_width_arcsec), "arcsec", "in quadrature");
    push("trail length in the field", format!("{:.1}", r.trail_length_arcsec), "arcsec", "min(omega t_exp, field)");
    push("time in the field", format!("{:.3}", r.in_field_s), "s", "min(t_exp, field/omega)");
    push("t_eff", format!("{:.4}", 1e3 * r.t_eff_s), "ms", "width/omega");
    push("t_eff, short form", cell(r.t_eff_simple_s.map(|t| 1e3 * t), 4), "ms", "2 sqrt(A/pi (R+h)/GM), in the zenith");
    push("nu as published", cell(r.nu_published_mag_arcsec2, 3), "V mag/arcsec2", "m + 5 lg(omega t_exp)");
    push("nu corrected", cell(r.nu_corrected_mag_arcsec2, 3), "V mag/arcsec2", "m + 2.5 lg(width omega t_exp)");
    push("colour", format!("{:.3}", r.colour_mag), "mag", &format!("{} - V of a grey satellite", r.filter));
    push("brightest pixel", electrons(r.peak_pixel_e), "e-", &format!("saturated: {}", r.saturated));
    text.push_str(&text_table(&["quantity", "value", "unit", "how"], &rows));
    text.push('\n');
    text.push_str(&limits_text(r, visit, published));
    if let (Some(twice), Some(once)) = (r.nu_published_mag_arcsec2, r.nu_corrected_mag_arcsec2) {
        // Writing to a String cannot fail.
        let _ = writeln!(
            text,
            "\nThe published nu is {:.2} mag fainter: it spreads the light over the whole trail and then thins it by\n\
             t_eff/t_exp, the same average over time a second time. Corrected, each place of the trail has the flux over\n\
             the width for the time the satellite takes to pass it.",
            twice - once
        );
    }
    text
}

/// The limits, each by its name, and what is seen.
fn limits_text(r: &StreakRow, visit: &Visit, published: Option<f64>) -> String {
    let seeing = visit.survey.seeing_arcsec;
    let plain = Visit { fwhm_eff_arcsec: seeing, ..*visit }.limit_mag(LimitKind::Point, 5.0).ok();
    let printed = published
        .filter(|_| visit.exptime_s == 15.0)
        .map_or(String::new(), |mag| format!("; the paper prints {mag} mag/arcsec2"));
    let rows = vec![
        vec![
            "a point".into(),
            format!("{:.3}", r.limit_point_mag),
            "mag".into(),
            format!("images of {:.3} arcsec{printed}", visit.fwhm_eff_arcsec),
            r.detected_published.clone() + " (published nu)",
        ],
        vec![
            "a point, images as sharp as the seeing".into(),
            cell(plain, 3),
            "mag".into(),
            format!("images of {seeing} arcsec"),
            String::new(),
        ],
        vec![
            "one square arcsecond".into(),
            format!("{:.3}", r.limit_mag_arcsec2),
            "mag/arcsec2".into(),
            String::new(),
            r.detected_corrected.clone() + " (corrected nu)",
        ],
        vec![
            "one pixel".into(),
            format!("{:.3}", r.limit_pixel_mag_arcsec2),
            "mag/arcsec2".into(),
            String::new(),
            String::new(),
        ],
        vec![
            "the whole trail".into(),
            format!("{:.3}", r.limit_trail_mag_arcsec2),
            "mag/arcsec2".into(),
            "a filter of its shape, its place known".into(),
            r.detected_trail.clone() + " (corrected nu)",
        ],
    ];
    let what = format!("5 sigma limit of {} {} {} s", visit.survey.name, r.filter, visit.exptime_s);
    text_table(&[&what, "value", "unit", "of", "detected"], &rows)
}

/// The paper's satellites: numbers, limits, and the verdicts by every choice of magnitude.
pub fn paper_text(rows: &[StreakRow], all: &[StreakRow], visit: &Visit, published: Option<f64>) -> String {
    let Some(first) = rows.first() else { return String::new() };
    let mut text = format!(
        "{} {} band, {} s, in the zenith; magnitudes: {}\n\n",
        visit.survey.name,
        first.filter,
        visit.exptime_s,
        if rows.iter().all(|r| r.mag_source == first.mag_source) { &first.mag_source } else { "model, full Moon" }
    );
    let head = [
        "satellite",
        "area m2",
        "km",
        "V",
        "mu",
        "width \"",
        "deg/s",
        "t_eff ms",
        "nu pub.",
        "nu corr.",
        "peak e-",
        "saturated",
    ];
    let line = |r: &StreakRow| {
        vec![
            r.object_name.clone(),
            format!("{}", r.area_m2),
            cell(r.height_km, 0),
            cell(r.v_mag, 2),
            cell(r.mu_mag_arcsec2, 2),
            format!("{:.2}", r.trail_width_arcsec),
            format!("{:.3}", r.rate_deg_s),
            format!("{:.3}", 1e3 * r.t_eff_s),
            cell(r.nu_published_mag_arcsec2, 2),
            cell(r.nu_corrected_mag_arcsec2, 2),
            electrons(r.peak_pixel_e),
            r.saturated.clone(),
        ]
    };
    text.push_str(&text_table(&head, &rows.iter().map(line).collect::<Vec<_>>()));
    text.push('\n');
    text.push_str(&band_limits(visit, published));
    let _ = writeln!(
        text,
        "\nDetected: as published (nu published against the point's limit) / corrected over one arcsec2 / corrected\n\
         over the whole trail; nu corrected is made {} by {:+.2} mag (grey satellite) before it is compared.\n",
        first.filter, first.colour_mag
    );
    let mut sources: Vec<&str> = Vec::new();
    for r in all {
        if !sources.contains(&r.mag_source.as_str()) && !r.is_modelled {
            sources.push(&r.mag_source);
        }
    }
    let modelled = all.iter().any(|r| r.is_modelled);
    let mut head: Vec<&str> = vec!["satellite"];
    head.extend(modelled.then_some("model"));
    head.extend(&sources);
    let verdict = |r: &StreakRow| format!("{} / {} / {}", r.detected_published, r.detected_corrected, r.detected_trail);
    let lines: Vec<Vec<String>> = rows
        .iter()
        .map(|own| {
            let of = |wanted: &dyn Fn(&StreakRow) -> bool| {
                all.iter().find(|r| r.object_name == own.object_name && wanted(r)).map_or(String::new(), &verdict)
            };
            let mut cells = vec![own.object_name.clone()];
            if modelled {
                cells.push(of(&|r| r.is_modelled));
            }
            cells.extend(sources.iter().map(|s| of(&|r| r.mag_source == *s)));
            cells
        })
        .collect();
    text.push_str(&text_table(&head, &lines));
    text
}

/// The limits of every band of the survey.
fn band_limits(visit: &Visit, published: Option<f64>) -> String {
    let limit = |v: &Visit, kind| cell(v.limit_mag(kind, 5.0).ok(), 3);
    let rows: Vec<Vec<String>> = visit
        .survey
        .bands
        .iter()
        .map(|band| {
            let of = |meaning| Visit { sky_mag_arcsec2: visit.sky_mag_arcsec2, ..visit.survey.visit(*band, meaning) };
            let (air, images) = (of(SeeingMeaning::At500nm), of(SeeingMeaning::Effective));
            let printed = satphot::visibility::survey::PUBLISHED_LIMITS
                .iter()
                .find(|(name, _)| *name == band.name && published.is_some())
                .map_or(String::new(), |(_, mag)| format!("{mag}"));
            vec![
                band.name.to_owned(),
                printed,
                limit(&air, LimitKind::Point),
                limit(&images, LimitKind::Point),
                limit(&air, LimitKind::SquareArcsec),
                limit(&air, LimitKind::Pixel),
            ]
        })
        .collect();
    let seeing = visit.survey.seeing_arcsec;
    let images = format!("point, images {seeing}\"");
    text_table(&["5 sigma", "printed", "point", &images, "1 arcsec2", "1 pixel (per arcsec2)"], &rows)
}
