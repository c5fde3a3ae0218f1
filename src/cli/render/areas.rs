//! The satellites whose components are known, and the areas of components next to the catalogue's.

use satphot::brightness::Catalogue;
use satphot::report::summary::text_table;
use satphot::resolved::ComponentSatellite;
use satphot::resolved::projected::{AreaRow, areas};
use satphot::tables::AREAS;

use super::super::{print, tell};
use super::image_args::ImageArgs;

/// One line each.
pub fn list() -> anyhow::Result<String> {
    let mut rows = Vec::new();
    for name in ComponentSatellite::names() {
        let satellite = ComponentSatellite::named(name)?;
        rows.push(vec![
            satellite.name.clone(),
            satellite.components.len().to_string(),
            satellite.joints.len().to_string(),
            satellite.catalogue.clone().unwrap_or_default(),
            satellite.title,
        ]);
    }
    Ok(text_table(&["name", "components", "joints", "catalogue", "title"], &rows))
}

/// The areas of one.
pub fn print_areas(satellite: &ComponentSatellite, image: &ImageArgs, csv: bool, quiet: bool) -> anyhow::Result<()> {
    let rows = areas(satellite, image.settings()?.sides)?;
    let number = |v: Option<f64>| v.map_or(String::new(), |v| format!("{v:.2}"));
    let percent = |r: &AreaRow| r.catalogue_m2.map(|c| 100.0 * (r.broadside_m2 / c - 1.0));
    let mut cells: Vec<Vec<String>> = rows
        .iter()
        .map(|r| {
            let off = percent(r).map(|p| if p.abs() < 5e-3 { 0.0 } else { p });
            vec![
                r.part.clone(),
                r.components.to_string(),
                format!("{:.2}", r.broadside_m2),
                format!("{:.2}", r.from_nadir_m2),
                number(r.catalogue_m2),
                number(off),
            ]
        })
        .collect();
    let sum = |of: &dyn Fn(&AreaRow) -> f64| rows.iter().map(of).sum::<f64>();
    cells.push(vec![
        "total".into(),
        satellite.components.len().to_string(),
        format!("{:.2}", sum(&|r| r.broadside_m2)),
        format!("{:.2}", sum(&|r| r.from_nadir_m2)),
        if satellite.catalogue.is_some() {
            format!("{:.2}", sum(&|r| r.catalogue_m2.unwrap_or(0.0)))
        } else {
            String::new()
        },
        String::new(),
    ]);
    if csv {
        let mut text = AREAS.csv_head();
        cells.iter().for_each(|row| text.push_str(&format!("{}\n", row.join(","))));
        print(&text);
    } else {
        let head = ["part", "components", "broadside [m2]", "from nadir [m2]", "catalogue [m2]", "off [%]"];
        print(&text_table(&head, &cells));
    }
    if quiet {
        return Ok(());
    }
    satellite.notes.iter().for_each(|note| tell(&format!("note: {note}")));
    if let Some(name) = &satellite.catalogue {
        Catalogue::load(None)?.find(name)?.warnings().iter().for_each(|w| tell(&format!("note: catalogue: {w}")));
    }
    Ok(())
}
