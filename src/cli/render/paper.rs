//! The published simulation of the resolved ISS next to ours.

use satphot::paper::resolved_case::{CaseRow, resolved_case};
use satphot::report::summary::text_table;
use satphot::tables::PAPER_STEPS;

use super::super::{print, tell};
use super::image_args::ImageArgs;

/// Prints the case: as printed, with the paper's uniform Earth, and with moonlit ground.
pub fn print_case(image: &ImageArgs, csv: bool, quiet: bool) -> anyhow::Result<()> {
    let (rows, notes) = resolved_case(&image.settings()?)?;
    let number = |r: &CaseRow, k: usize| match r.steps[k] {
        None => String::new(),
        Some(v) if r.quantity.contains("mag") => format!("{v:.2}"),
        Some(v) => format!("{v:.2e}"),
    };
    let gain = |r: &CaseRow| match (r.quantity, r.steps) {
        ("panel" | "body1" | "body2", [Some(star), _, Some(all)]) if star > 0.0 => format!("{:.1}", all / star),
        _ => String::new(),
    };
    let unit = |quantity: &str| match quantity {
        "irradiance" => "W/cm2",
        "magnitude" | "v_mag" => "mag",
        _ => "W/m2/sr",
    };
    let cells: Vec<Vec<String>> = rows
        .iter()
        .map(|r| {
            let mut row = vec![r.quantity.to_owned(), unit(r.quantity).to_owned(), r.of.clone()];
            row.extend((0..3).map(|k| number(r, k)));
            row.push(gain(r));
            row
        })
        .collect();
    if csv {
        let mut text = PAPER_STEPS.csv_head();
        for row in &cells {
            let quoted = row.iter().map(|c| if c.contains(',') { format!("\"{c}\"") } else { c.clone() });
            text.push_str(&format!("{}\n", quoted.collect::<Vec<_>>().join(",")));
        }
        print(&text);
    } else {
        let head = ["quantity", "unit", "of", "starlight", "+ moonlight", "+ Lunar-Earthshine", "all/starlight"];
        print(&text_table(&head, &cells));
    }
    if !quiet {
        notes.iter().for_each(|note| tell(&format!("note: {note}")));
    }
    Ok(())
}
