//! Which parts of the sky the star pointings of a night need, and its target frames for their star trails, from headers alone.
//!
//! Degrees. A field is the circle around a frame, widened by how far its pointing may be off. It does not cover the
//! pixels.

use crate::astrometry::catalogue::separation_deg;
use crate::astrometry::initial_pointing::initial_pointings;
use crate::astrometry::wcs::Wcs;
use crate::base::time::shifted;
use crate::config::Config;
use crate::frames::{Exposure, pixel_scale_arcsec};
use crate::orbit::{EarthOrientation, Site, Tracker};
use crate::pipeline::survey::files::Survey;
use crate::pipeline::target::star_trails::along_s;

/// Centres are rounded to this \[deg\], so that another night of the same field sends the same query.
const GRID_DEG: f64 = 0.01;
/// Radii are rounded up to this \[deg\].
const RADIUS_STEP_DEG: f64 = 0.05;
/// Largest radius \[deg\].
const LARGEST_DEG: f64 = 5.0;

/// A circle on the sky.
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    /// Right ascension of the centre, J2000 \[deg\].
    pub ra_deg: f64,
    /// Declination of the centre, J2000 \[deg\].
    pub dec_deg: f64,
    /// Radius \[deg\].
    pub radius_deg: f64,
    /// The source of it, for messages.
    pub source: String,
}

impl Field {
    /// A field by hand.
    #[must_use]
    pub fn new(ra_deg: f64, dec_deg: f64, radius_deg: f64, source: &str) -> Self {
        Self { ra_deg: ra_deg.rem_euclid(360.0), dec_deg, radius_deg, source: source.to_owned() }
    }

    /// Centre on the grid, radius up to the next step that still holds the whole field.
    fn on_grid(self) -> Self {
        let on = |deg: f64| (deg / GRID_DEG).round() * GRID_DEG;
        // the centre moves by half a cell in each direction at most
        let radius_deg = ((self.radius_deg + 0.71 * GRID_DEG) / RADIUS_STEP_DEG).ceil() * RADIUS_STEP_DEG;
        Self {
            ra_deg: on(self.ra_deg).rem_euclid(360.0),
            dec_deg: on(self.dec_deg).clamp(-90.0, 90.0),
            radius_deg: radius_deg.min(LARGEST_DEG),
            ..self
        }
    }

    fn holds(&self, other: &Field) -> bool {
        let apart = separation_deg(self.ra_deg, self.dec_deg, other.ra_deg, other.dec_deg);
        apart + other.radius_deg <= self.radius_deg + 1e-9
    }
}

/// The fields of a night's star pointings, and the frames whose header does not say where they point.
///
/// The radius is half the diagonal of the frame plus `stars.pointing_err_arcsec`, or plus `stars.solve_radius_deg`
/// where the header has no world coordinates; `radius_deg` replaces it. A right ascension without unit counts as
/// degrees and as hours.
#[must_use]
pub fn fields_of_night(config: &Config, survey: &Survey, radius_deg: Option<f64>) -> (Vec<Field>, Vec<String>) {
    let (mut fields, mut silent) = (Vec::new(), Vec::new());
    for exposure in survey.pointings.iter().flatten() {
        let found = fields_of_frame(config, exposure, radius_deg);
        if found.is_empty() {
            silent.push(exposure.name.clone());
        }
        fields.extend(found);
    }
    (fields, silent)
}

/// The fields that the star trails of the target frames come from: the satellite's path during each exposure, as wide as the
/// trails are looked for. Frames without a time, and times without elements, have none.
#[must_use]
pub fn fields_of_passes(tracker: &Tracker, config: &Config, survey: &Survey) -> Vec<Field> {
    let of_frame = |exposure: &Exposure| {
        let time = exposure.time.as_ref()?;
        let reach_s = 0.5 * exposure.exptime_s + along_s(time.err_s);
        let at = |t_s: f64| tracker.icrs_at(&shifted(time.mid, t_s)).ok();
        let ((ra_deg, dec_deg), from, to) = (at(0.0)?, at(-reach_s)?, at(reach_s)?);
        let (nx, ny) = exposure.size_px;
        let scale =
            pixel_scale_arcsec(config.detector.pixel_um, exposure.binning, config.telescope.focal_length_mm) / 3600.0;
        let path_deg =
            [from, to].map(|(ra, dec)| separation_deg(ra_deg, dec_deg, ra, dec)).into_iter().fold(0.0, f64::max);
        let radius_deg = path_deg + 0.5 * scale * (nx as f64).hypot(ny as f64);
        Some(Field::new(ra_deg, dec_deg, radius_deg, &format!("{}, the path of its target", exposure.name)))
    };
    survey.targets.iter().filter_map(of_frame).collect()
}

fn fields_of_frame(config: &Config, exposure: &Exposure, radius_deg: Option<f64>) -> Vec<Field> {
    let header = &exposure.header;
    let wcs = Wcs::of_header(header).ok().flatten();
    let (eop, site) = (EarthOrientation::default(), Site::from_config(&config.site).ok());
    let named = config.stars.as_ref().zip(exposure.object.as_ref());
    let field = named.and_then(|(stars, name)| Some((name.as_str(), *stars.fields.get(name)?)));
    let places =
        initial_pointings(exposure, field, wcs.as_ref(), site.as_ref().map(|s| (s, &eop)), &config.header.aliases);
    let (nx, ny) = exposure.size_px;
    let scale =
        pixel_scale_arcsec(config.detector.pixel_um, exposure.binning, config.telescope.focal_length_mm) / 3600.0;
    let (pointing_deg, solve_deg) =
        config.stars.as_ref().map_or((0.1, 1.0), |s| (s.pointing_err_arcsec / 3600.0, s.solve_radius_deg));
    let off_deg = if wcs.is_some() { pointing_deg } else { solve_deg };
    let radius = radius_deg.unwrap_or(0.5 * scale * (nx as f64).hypot(ny as f64) + off_deg);
    let first = places.first().cloned();
    let in_hours = places.into_iter().skip(1).find(|p| {
        let key = p.source.strip_suffix(" in hours");
        key.is_some() && key == first.as_ref().map(|f| f.source.as_str())
    });
    let named = |source: &str| format!("{}, {source}", exposure.name);
    first.into_iter().chain(in_hours).map(|p| Field::new(p.ra_deg, p.dec_deg, radius, &named(&p.source))).collect()
}

/// Fields on the grid, largest first, one question each: a field within another is excluded, and one that is less than
/// half of its radius next to another (a dither, a drift) widens that one instead.
#[must_use]
pub fn one_query_each(fields: Vec<Field>) -> Vec<Field> {
    let mut sorted: Vec<Field> = fields.into_iter().map(Field::on_grid).collect();
    sorted.sort_by(|a, b| b.radius_deg.total_cmp(&a.radius_deg)); // stable: of equals the first of the night
    let mut kept: Vec<Field> = Vec::new();
    for field in sorted {
        if kept.iter().any(|k| k.holds(&field)) {
            continue;
        }
        let widened_deg = |k: &Field| {
            let apart = separation_deg(k.ra_deg, k.dec_deg, field.ra_deg, field.dec_deg);
            let radius_deg = ((apart + field.radius_deg) / RADIUS_STEP_DEG).ceil() * RADIUS_STEP_DEG;
            (apart <= 0.5 * field.radius_deg && radius_deg <= LARGEST_DEG).then_some(radius_deg)
        };
        match kept.iter_mut().find_map(|k| widened_deg(k).map(|radius_deg| (k, radius_deg))) {
            Some((k, radius_deg)) => k.radius_deg = k.radius_deg.max(radius_deg),
            None => kept.push(field),
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pointings_that_were_repeated_ask_once_and_fields_apart_ask_for_themselves() {
        let fields = [(10.0, 20.0), (10.001, 20.002), (10.0, 21.0), (359.999, 0.0), (0.001, 0.0)];
        let queries = one_query_each(fields.map(|(ra, dec)| Field::new(ra, dec, 0.3, "")).to_vec());
        assert_eq!(queries.len(), 3, "{queries:?}");
    }

    #[test]
    fn a_dithered_field_is_one_question_that_holds_every_frame() {
        let frames: Vec<Field> = (0..30)
            .map(|i| Field::new(85.3 + 0.004 * f64::from(i % 6), -61.8 + 0.006 * f64::from(i / 6), 0.12, ""))
            .collect();
        let queries = one_query_each(frames.clone());
        assert_eq!(queries.len(), 1, "{queries:?}");
        assert!(frames.iter().all(|f| queries[0].holds(f)));
        assert!(queries[0].radius_deg < 0.26, "{queries:?}");
    }

    #[test]
    fn the_rounded_circle_holds_the_frame_it_is_for() {
        for i in 0..200 {
            let k = f64::from(i);
            let field = Field::new(1.2345 * k, 88.0 * (0.37 * k).sin(), 0.11 + 0.004 * k, "");
            assert!(field.clone().on_grid().holds(&field), "{field:?}");
        }
    }
}
