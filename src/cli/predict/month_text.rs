//! The words of `satphot predict month`: the table of the nights, what each satellite comes to, what the figure notes.

use satphot::base::time::parse_utc;
use satphot::report::summary::text_table;
use satphot::tables::MonthRow;
use satphot::visibility::forecast::month::LIT_FROM;

/// The first row of each mirror whose beam was looked for.
pub fn first_mirrors(rows: &[MonthRow]) -> impl Iterator<Item = &MonthRow> {
    let mut reported: Vec<(&str, &str)> = Vec::new();
    rows.iter().filter(move |r| {
        let new = r.beam_looked_for && !reported.contains(&(&r.object_name, &r.mode));
        if new {
            reported.push((&r.object_name, &r.mode));
        }
        new
    })
}

/// Satellites in their order, each once with its mode.
fn kinds(rows: &[MonthRow]) -> Vec<(&str, &str)> {
    let mut kinds: Vec<(&str, &str)> = Vec::new();
    for r in rows {
        if !kinds.contains(&(&r.object_name, &r.mode)) {
            kinds.push((&r.object_name, &r.mode));
        }
    }
    kinds
}

fn cell(v: Option<f64>) -> String {
    v.map_or("-".into(), |v| format!("{v:.2}"))
}

/// A line per night, a column per satellite.
pub fn table(rows: &[&MonthRow]) -> String {
    let mut names: Vec<&str> = Vec::new();
    for r in rows {
        if !names.contains(&r.object_name.as_str()) {
            names.push(&r.object_name);
        }
    }
    let mut head = vec!["night", "Moon deg", "Moon %", "sky", "1 sigma", "5 sigma"];
    head.extend(&names);
    let nights: Vec<&&MonthRow> =
        rows.iter().filter(|r| names.first().is_some_and(|first| r.object_name == *first)).collect();
    let lines = nights.iter().map(|night| {
        let of = |name: &&str| rows.iter().find(|r| r.object_name == **name && r.night == night.night);
        let mut line = vec![
            night.night.clone(),
            format!("{:.1}", night.moon_alt_deg),
            format!("{:.0}", night.moon_illum_pct),
            cell(night.sky_mag_arcsec2),
            cell(night.limit_1sigma_mag_arcsec2),
            cell(night.limit_5sigma_mag_arcsec2),
        ];
        line.extend(names.iter().map(|name| cell(of(name).and_then(|r| r.mu_mean_mag_arcsec2))));
        line
    });
    text_table(&head, &lines.collect::<Vec<_>>())
}

/// Nights with the Moon up, lit and detected, of each satellite and mode.
pub fn summary(rows: &[MonthRow]) -> String {
    let head = [
        "satellite",
        "mode",
        "km",
        "nights",
        "Moon up",
        "lit",
        "1 sigma",
        "5 sigma",
        "brightest",
        "not lit, evenings of",
    ];
    let lines = kinds(rows).into_iter().map(|(name, mode)| {
        let own: Vec<&MonthRow> = rows.iter().filter(|r| r.object_name == name && r.mode == mode).collect();
        let count = |of: &dyn Fn(&MonthRow) -> bool| own.iter().filter(|r| of(r)).count().to_string();
        let unlit: Vec<&str> = own.iter().filter(|r| r.lit_frac < LIT_FROM).map(|r| r.night.as_str()).collect();
        vec![
            name.to_string(),
            mode.to_string(),
            own.first().map_or(String::new(), |r| format!("{:.0}", r.height_km)),
            own.len().to_string(),
            count(&|r| r.moon_alt_deg > 0.0),
            count(&|r| r.lit_frac >= LIT_FROM),
            count(&|r| r.detected_1sigma == Some(1)),
            count(&|r| r.detected_5sigma == Some(1)),
            cell(own.iter().filter_map(|r| r.mu_mean_mag_arcsec2).reduce(f64::min)),
            runs(&unlit),
        ]
    });
    text_table(&head, &lines.collect::<Vec<_>>())
}

/// `06-22 to 06-28` for every run of nights that follow each other.
fn runs(nights: &[&str]) -> String {
    let day = |night: &str| parse_utc("night", &format!("{night}T00:00:00")).ok();
    let mut text: Vec<String> = Vec::new();
    let mut from: Option<&str> = None;
    for (i, night) in nights.iter().enumerate() {
        let start = *from.get_or_insert(night);
        let next = nights.get(i + 1);
        let follows = next.and_then(|n| Some((day(n)? - day(night)?).to_seconds() < 90_000.0)).unwrap_or(false);
        if !follows {
            let short = |n: &str| n.get(5..).unwrap_or(n).to_string();
            text.push(if start == *night { short(start) } else { format!("{} to {}", short(start), short(night)) });
            from = None;
        }
    }
    text.join(", ")
}

/// For the figure: which nights the satellites of each height are not lit.
pub fn unlit_notes(rows: &[MonthRow]) -> Vec<String> {
    let mirrors: Vec<&str> = rows.iter().filter(|r| r.beam_looked_for).map(|r| r.object_name.as_str()).collect();
    let rows: Vec<&MonthRow> = rows.iter().filter(|r| !mirrors.contains(&r.object_name.as_str())).collect();
    let mut heights: Vec<f64> = rows.iter().map(|r| r.height_km).collect();
    heights.sort_by(f64::total_cmp);
    heights.dedup();
    // heights that follow each other with the same nights share a line
    let mut lines: Vec<(f64, f64, String)> = Vec::new();
    for height_km in heights {
        let mut unlit: Vec<&str> = rows
            .iter()
            .filter(|r| r.height_km == height_km && r.lit_frac < LIT_FROM)
            .map(|r| r.night.as_str())
            .collect();
        unlit.sort_unstable();
        unlit.dedup();
        let text = if unlit.is_empty() { "every night".to_string() } else { format!("not {}", runs(&unlit)) };
        match lines.last_mut().filter(|(_, _, before)| *before == text) {
            Some(line) => line.1 = height_km,
            None => lines.push((height_km, height_km, text)),
        }
    }
    let km = |low: f64, high: f64| if low == high { format!("{low:.0}") } else { format!("{low:.0}–{high:.0}") };
    let reported = lines.into_iter().map(|(low, high, text)| format!("{} km: {text}", km(low, high)));
    std::iter::once("lit at midnight:".to_string()).chain(reported).collect()
}
