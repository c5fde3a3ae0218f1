//! How bright satellites are at each phase angle: magnitudes at 1000 km, with the law fitted to them.
//!
//! Magnitudes of used frames in sunlight; a chart for each type of satellite in each band, over all nights of the page. A type are the
//! satellites whose names differ by a number alone (STARLINK-1234). It does not cover other lights, whose source is not the Sun.

use std::collections::BTreeMap;

use maud::{Markup, html};

use super::groups::groups;
use super::parts::{NightPage, count, nothing, shown, tip, verdict_paint};
use crate::brightness::Illum;
use crate::figures::axis::Span;
use crate::figures::canvas::{GREY, INK, Medium, Sheet};
use crate::figures::chart::Chart;
use crate::figures::panel::{Point, Ticks};
use crate::fitting::{Observation, Problem, phase_law};
use crate::tables::PhotometryRow;
use crate::tables::selection::{is_lower_limit, is_used};

/// Degrees of the law that are tried, the highest that the data tell first.
const DEGREES: [usize; 3] = [2, 1, 0];
/// Fewer magnitudes show no curve.
const FEWEST: usize = 5;
/// Points of the drawn line.
const STEPS: usize = 60;

/// The magnitudes of a type of satellite in one band.
pub(super) struct PhaseCurve<'a> {
    /// Type and band.
    pub name: String,
    band: String,
    rows: Vec<&'a PhotometryRow>,
    satellites: usize,
    /// The law, where there is one, and the scatter of magnitudes about it \[mag\].
    fit: Option<(Problem, f64)>,
}

/// Rows with the number of their satellite and of their pass.
type Placed<'a> = Vec<(&'a PhotometryRow, usize, usize)>;

/// Every type and band with enough magnitudes in sunlight.
pub(super) fn phase_curves(nights: &[NightPage]) -> Vec<PhaseCurve<'_>> {
    let mut by_type: BTreeMap<(String, String), Placed> = BTreeMap::new();
    for group in groups(nights) {
        for pass in group.parts.iter().flat_map(|part| &part.passes) {
            let shows = |r: &&&PhotometryRow| {
                is_used(&r.status, &r.verdict)
                    && !is_lower_limit(r.flags)
                    && r.illum == Illum::Sun.as_str()
                    && mag_1000km(r).is_some()
                    && r.phase_angle_deg.is_some()
            };
            let rows: Vec<&PhotometryRow> = pass.1.iter().filter(shows).copied().collect();
            let Some(first) = rows.first() else { continue };
            let placed = by_type.entry((type_of(&first.object_name), group.band.clone())).or_default();
            let of_other = |(r, ..): &&(&PhotometryRow, usize, usize)| r.norad_cat_id == first.norad_cat_id;
            let new = || placed.iter().map(|p| p.1 + 1).max().unwrap_or(0);
            let satellite = placed.iter().find(of_other).map_or_else(new, |p| p.1);
            let number = placed.last().map_or(0, |p| p.2 + 1);
            placed.extend(rows.into_iter().map(|row| (row, satellite, number)));
        }
    }
    by_type.retain(|_, placed| placed.len() >= FEWEST);
    let alone = by_type.len() == 1;
    by_type.into_iter().map(|((kind, band), placed)| curve_of(kind, band, placed, alone)).collect()
}

/// The curve of a type; it has no name where it is the only one.
fn curve_of<'a>(kind: String, band: String, placed: Placed<'a>, alone: bool) -> PhaseCurve<'a> {
    let satellites = placed.iter().map(|p| p.1 + 1).max().unwrap_or(0);
    let observation = |(k, (r, satellite, pass)): (usize, &(&PhotometryRow, usize, usize))| {
        Some(Observation {
            row: k,
            mag_1000km: mag_1000km(r)?,
            v_mag: r.v_mag?,
            err_mag: r.v_mag_err.unwrap_or(0.0),
            is_limit: false,
            phase_deg: r.phase_angle_deg?,
            sun_alt_sat_deg: r.sun_alt_sat_deg,
            range_km: r.range_km?,
            mjd_d: r.mjd_mid_d,
            pass: *pass,
            satellite: *satellite,
            table: 0,
        })
    };
    let observations: Vec<Observation> = placed.iter().enumerate().filter_map(observation).collect();
    let fit = DEGREES.into_iter().find_map(|degree| phase_law(&observations, [degree, 0], &[]).ok());
    let fit = fit.map(|problem| (problem.scatter_mag(&observations), problem)).map(|(scatter, fit)| (fit, scatter));
    let name = if alone { String::new() } else { format!("{kind}, {band}") };
    PhaseCurve { name, band, rows: placed.into_iter().map(|p| p.0).collect(), satellites, fit }
}

/// V at 1000 km: tables of before have no column of it.
fn mag_1000km(row: &PhotometryRow) -> Option<f64> {
    row.v_mag_1000km.or_else(|| Some(row.v_mag? - 5.0 * (row.range_km? / 1000.0).log10()))
}

/// The name of a satellite without the number at its end.
fn type_of(name: &str) -> String {
    let short = name.trim_end_matches(|c: char| c.is_ascii_digit());
    let is_numbered = short.len() < name.len() && short.ends_with(['-', ' ']) && short.len() > 1;
    if is_numbered { short.trim_end_matches(['-', ' ']).to_owned() } else { name.to_owned() }
}

impl PhaseCurve<'_> {
    /// The law at a phase angle.
    fn law(&self, phase_deg: f64) -> Option<f64> {
        Some(self.fit.as_ref()?.0.fit.theta.iter().rev().fold(0.0, |sum, c| sum * phase_deg + c))
    }

    /// Error of a magnitude predicted by it at a phase angle: σ² = σ_scatter² + Jᵀ C J, J_k = φ^k.
    fn pred_err_mag(&self, phase_deg: f64) -> Option<f64> {
        let (problem, scatter_mag) = self.fit.as_ref()?;
        let power = |k: usize| phase_deg.powi(k as i32);
        let row =
            |(a, row): (usize, &Vec<f64>)| row.iter().enumerate().map(|(b, c)| power(a) * c * power(b)).sum::<f64>();
        let by_parameters: f64 = problem.fit.cov.iter().enumerate().map(row).sum();
        Some((scatter_mag * scatter_mag + by_parameters.max(0.0)).sqrt())
    }

    /// The chart; faint is below.
    pub(super) fn chart(&self, medium: Medium) -> Option<Sheet> {
        let phase = |r: &PhotometryRow| r.phase_angle_deg;
        let x = Span::around(self.rows.iter().filter_map(|r| phase(r)), 5.0)?;
        let y = Span::around(self.rows.iter().filter_map(|r| mag_1000km(r)), 0.5)?.reversed();
        let chart = Chart {
            size: if medium == Medium::Page { (460, 280) } else { (940, 360) },
            x,
            y,
            x_label: "phase angle Sun–satellite–observer [deg]",
            y_label: &format!("{} at 1000 km [mag]", self.band),
            ticks: Ticks::Numbers,
        };
        let point = |r: &&PhotometryRow| {
            Some(Point {
                x: phase(r)?,
                y: mag_1000km(r)?,
                err: r.v_mag_err,
                paint: verdict_paint(r),
                tip: format!("{:.2} at 1000 km, {}", mag_1000km(r)?, tip(r)),
                ..Point::default()
            })
        };
        let points: Vec<Point> = self.rows.iter().filter_map(point).collect();
        let (low, high) =
            self.rows.iter().filter_map(|r| phase(r)).fold((180.0f64, 0.0f64), |(a, b), p| (a.min(p), b.max(p)));
        let at = |k: usize| low + (high - low) * k as f64 / STEPS as f64;
        let line: Vec<(f64, Option<f64>)> = (0..=STEPS).map(|k| (at(k), self.law(at(k)))).collect();
        let limits = |(phase_deg, mag): &(f64, Option<f64>)| {
            let (mag, err_mag) = ((*mag)?, self.pred_err_mag(*phase_deg)?);
            Some((*phase_deg, mag - err_mag, mag + err_mag))
        };
        let band: Vec<(f64, f64, f64)> = line.iter().filter_map(limits).collect();
        Some(chart.draw(
            medium,
            |_| {},
            |panel| {
                panel.band(&band, GREY.class("law"));
                panel.points(&points);
                panel.polyline(&line, INK.class("law"), 2);
            },
        ))
    }

    /// How many magnitudes there are, and the law in short.
    pub(super) fn caption(&self) -> String {
        let frames = count(self.rows.len(), "magnitude", "magnitudes");
        let of = if self.satellites > 1 { format!(" of {} satellites", self.satellites) } else { String::new() };
        let Some((problem, _)) = &self.fit else {
            return format!("{frames}{of}; too few passes or phase angles for a law");
        };
        let term = |(k, c): (usize, &f64)| match k {
            0 => format!("{c:.3}"),
            1 => format!(" {} {:.5} φ", sign(*c), c.abs()),
            _ => format!(" {} {:.3e} φ²", sign(*c), c.abs()),
        };
        let law: String = problem.fit.theta.iter().enumerate().map(term).collect();
        format!("{frames}{of}; {} = {law} (φ in deg)", self.band)
    }

    /// The errors of the law and what scatters about it.
    fn errors(&self) -> Option<String> {
        let (problem, scatter_mag) = self.fit.as_ref()?;
        let fit = &problem.fit;
        let errs: Vec<String> = fit.errs().iter().map(|err| format!("{err:.1e}")).collect();
        Some(format!(
            "Errors of the coefficients: {}. Scatter: {:.2} mag within passes, {:.2} mag between them. Band: 68 % of magnitudes of new passes \
             ({scatter_mag:.2} mag about the law, and the errors of its coefficients).",
            errs.join(", "),
            fit.within_mag,
            fit.between_mag
        ))
    }
}

/// + or −.
fn sign(value: f64) -> char {
    if value < 0.0 { '−' } else { '+' }
}

/// The section.
pub(super) fn section(nights: &[NightPage]) -> Markup {
    let curves = phase_curves(nights);
    if curves.is_empty() {
        return nothing("Fewer than five used magnitudes are of satellites in sunlight.");
    }
    html! {
        div.panels {
            @for curve in &curves {
                figure {
                    @if !curve.name.is_empty() { h3 { (curve.name) } }
                    @if let Some(chart) = curve.chart(Medium::Page) { (shown(chart, "Magnitude at 1000 km against phase angle")) }
                    figcaption { (curve.caption()) ". " (curve.errors().unwrap_or_default()) }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::type_of;

    #[test]
    fn a_type_is_a_name_without_its_number() {
        assert_eq!(type_of("STARLINK-30123"), "STARLINK");
        assert_eq!(type_of("COSMOS 2251"), "COSMOS");
        assert_eq!(type_of("ISS (ZARYA)"), "ISS (ZARYA)");
        assert_eq!(type_of("25544"), "25544");
        assert_eq!(type_of("BLUEWALKER3"), "BLUEWALKER3");
    }
}
