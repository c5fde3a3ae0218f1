//! The passes of satellites over a site.

use pyo3::prelude::*;
use pyo3::types::PyList;
use rayon::prelude::*;
use satphot::PassEvent;
use satphot::brightness::light_class;
use satphot::brightness::light_class::{PaperLabel, SkyClass, classes};
use satphot::brightness::scene::scene;
use satphot::orbit::{WholePass, whole_passes};
use satphot::tables::PASSES;

use crate::elements::{Tracked, Watch};
use crate::errors::{bad, raise};
use crate::interrupt::interruptible;
use crate::table::{Columns, Data};
use crate::times::{NOT_A_TIME, epoch, unix_ns};

/// The columns of numbers: name, of which moment, value.
const NUMBERS: [(&str, Moment, fn(&PassEvent) -> f64); 8] = [
    ("rise_az_deg", Moment::Rise, |e| e.az_rad.to_degrees()),
    ("max_alt_deg", Moment::Culmination, |e| e.alt_rad.to_degrees()),
    ("max_az_deg", Moment::Culmination, |e| e.az_rad.to_degrees()),
    ("set_az_deg", Moment::Set, |e| e.az_rad.to_degrees()),
    ("range_km", Moment::Culmination, |e| e.range_km),
    ("sun_alt_deg", Moment::Culmination, |e| e.sun_alt_rad.to_degrees()),
    ("moon_alt_deg", Moment::Culmination, |e| e.moon_alt_rad.to_degrees()),
    ("moon_illum_pct", Moment::Culmination, |e| 100.0 * e.geometry.moon_illum_frac),
];

/// The columns of moments.
const MOMENTS: [(&str, Moment, &str); 3] = [
    ("rise", Moment::Rise, "moment of the rise, UTC; NaT where the satellite does not rise"),
    ("culmination", Moment::Culmination, "moment of the culmination, UTC; NaT where there is none"),
    ("set", Moment::Set, "moment of the set, UTC; NaT where the satellite does not set"),
];

#[derive(Clone, Copy)]
enum Moment {
    Rise,
    Culmination,
    Set,
}

impl Moment {
    fn of(self, pass: &WholePass) -> Option<&PassEvent> {
        match self {
            Moment::Rise => pass.rise.as_ref(),
            Moment::Culmination => pass.culmination.as_ref(),
            Moment::Set => pass.set.as_ref(),
        }
    }
}

/// A pass, and the lights and the label of it.
struct Row {
    satellite: usize,
    pass: WholePass,
    lights: String,
    label: String,
}

/// Columns of the passes of every satellite in a window, and what is to be known of the elements.
#[pyfunction]
#[pyo3(signature = (watch, start_ns, end_ns, is_tai, min_alt_deg, threads))]
pub fn passes<'py>(
    py: Python<'py>,
    watch: Watch,
    start_ns: i64,
    end_ns: i64,
    is_tai: bool,
    min_alt_deg: f64,
    threads: usize,
) -> PyResult<(Bound<'py, PyList>, Vec<String>)> {
    if !(-5.0..90.0).contains(&min_alt_deg) {
        return Err(bad("min_alt_deg", format!("{min_alt_deg} is outside -5 to 90 deg")));
    }
    let (start, end) = (epoch(start_ns, is_tai)?, epoch(end_ns, is_tai)?);
    let middle = start + (end - start) * 0.5;
    let satellites = watch.satellites()?;
    let one = |(satellite, tracked): (usize, &Tracked)| -> satphot::Result<Vec<Row>> {
        let found = whole_passes(&tracked.tracker, &start, &end, min_alt_deg.to_radians())?;
        found.into_iter().map(|pass| row(satellite, pass)).collect()
    };
    let rows = interruptible(py, threads, false, |stopped| {
        let each = satellites.par_iter().enumerate();
        each.map(|s| if stopped() { Ok(Vec::new()) } else { one(s) }).collect::<satphot::Result<Vec<_>>>()
    })?;
    let rows: Vec<Row> = rows.map_err(raise)?.into_iter().flatten().collect();
    let warning = |s: &Tracked| Some(format!("{} {}: {}", s.norad_cat_id, s.name, s.tracker.age_warning(&middle)?));
    let warnings = satellites.iter().filter_map(warning).collect();

    let mut columns = Columns::default();
    let number = |s: usize| i64::try_from(satellites[s].norad_cat_id).unwrap_or(0);
    let text = |value: &dyn Fn(&Row) -> String| Data::Text(rows.iter().map(value).collect());
    let whole = |value: &dyn Fn(usize) -> i64| Data::Int(rows.iter().map(|r| value(r.satellite)).collect());
    columns.own("satellite", "", "place of the satellite among those given, from 0", whole(&|s| s as i64));
    columns.of(&PASSES, "norad_cat_id", whole(&number));
    columns.of(&PASSES, "object_name", text(&|r| satellites[r.satellite].name.clone()));
    for (name, moment, about) in MOMENTS {
        let time = |r: &Row| moment.of(&r.pass).map_or(NOT_A_TIME, |e| unix_ns(e.epoch));
        columns.own(name, "", about, Data::Time(rows.iter().map(time).collect()));
    }
    for (name, moment, value) in NUMBERS {
        let cell = |r: &Row| moment.of(&r.pass).map_or(f64::NAN, value);
        columns.of(&PASSES, name, Data::Float(rows.iter().map(cell).collect()));
    }
    columns.of(&PASSES, "illum", text(&|r| r.lights.clone()));
    let sky = |r: &Row| {
        let top = r.pass.culmination.as_ref();
        top.map_or(String::new(), |e| SkyClass::of_sun_alt(e.sun_alt_rad.to_degrees()).to_string())
    };
    columns.of(&PASSES, "sky_class", text(&sky));
    columns.of(&PASSES, "paper_label", text(&|r| r.label.clone()));
    columns.of(&PASSES, "outside_window", text(&|r| r.pass.outside(&start, &end).join(" ")));
    Ok((columns.into_py(py)?, warnings))
}

/// Light and label of a pass without rise, culmination or set are those of its first, highest and last moment in the window.
fn row(satellite: usize, pass: WholePass) -> satphot::Result<Row> {
    let (mut lights, mut labels) = (Vec::new(), Vec::new());
    for (event, in_window) in
        [(&pass.rise, &pass.inside.rise), (&pass.culmination, &pass.inside.culmination), (&pass.set, &pass.inside.set)]
    {
        let geometry = &event.as_ref().unwrap_or(in_window).geometry;
        let light = light_class(&scene(geometry))?.to_string();
        labels.push(classes(geometry)?.1);
        if lights.last() != Some(&light) {
            lights.push(light);
        }
    }
    let label = PaperLabel::of_pass(labels).map_or(String::new(), |label| label.to_string());
    Ok(Row { satellite, pass, lights: lights.join(">"), label })
}
