//! The colour of a satellite, measured where two bands saw it within a pass.
//!
//! Magnitudes. What a satellite is brighter than its model, whose surfaces are grey, in one band is interpolated to the times of the
//! other; the median difference is the excess of its colour over the Sun's, which the relation of stars takes to the index of each
//! band's colour term. Without a model, magnitudes at 1000 km are compared. It does not cover a colour that changes along a pass, which
//! is part of the scatter and so of the error, and unfiltered frames, which are calibrated to V by the colour itself.

use super::split::Group;
use crate::bands::{Band, ColourIndex};
use crate::base::stats::{mad_sigma, mean_and_sd, median};
use crate::config::Model;
use crate::frames::Detector;
use crate::pipeline::products::summary::Summary;
use crate::tables::words::{Status, Verdict};
use crate::tables::{PhotometryRow, read_photometry};
use crate::zeropoint::fit::Zeropoint;

/// A magnitude is interpolated between two that are at most this far from it \[s\].
const REACH_S: f64 = 60.0;
/// Fewest differences that give a colour.
const FEWEST: usize = 4;
/// Error of one index made of another by the relation of stars \[mag\].
const RELATION_ERR_MAG: f64 = 0.05;
/// B−V between which the slope of that relation is taken, about the Sun's \[mag\].
const ABOUT_SUN_MAG: [f64; 2] = [0.5, 0.8];

/// The colour of a satellite in the index of one group.
#[derive(Debug, Clone, PartialEq)]
pub struct TargetColour {
    /// The colour \[mag\].
    pub mag: f64,
    /// Its error \[mag\].
    pub err_mag: f64,
    /// What it is made of, in words.
    pub from: String,
}

/// A group in one band, calibrated with an assumed colour.
struct OneBand<'a> {
    group: &'a Group,
    band: Band,
    zeropoint: &'a Zeropoint,
    /// Time \[s\], magnitude less what is expected of its change with time, and random error of the used frames, in the order of time.
    points: Vec<[f64; 3]>,
    /// Whether that is the model's; else the change with range.
    less_model: bool,
    /// Systematic error without those of the assumed colour and of the gain table \[mag\].
    err_sys_mag: f64,
    /// Error of the gain table \[mag\]: the same for all bands of a camera.
    gain_err_mag: f64,
}

/// Whether a colour may be measured for a group: its satellite was seen in another band too, and the configuration states none.
pub(super) fn has_partner(group: &Group, all: &[Group]) -> bool {
    let is_partner = |other: &&Group| other.satellite == group.satellite && other.filter != group.filter;
    group.config.zeropoint.target_b_v_mag.is_none()
        && !group.satellite.is_empty() | group.config.orbit.is_some()
        && all.iter().any(|other| is_partner(&other))
}

/// The colour of the satellite of each group in the index of its band; `None` where none is measured better than it is assumed.
/// A group that could not be reduced has no summary.
pub(super) fn target_colours(reduced: &[(&Group, Option<&Summary>)]) -> Vec<Option<TargetColour>> {
    let bands: Vec<OneBand> = reduced.iter().filter_map(|(group, summary)| OneBand::of(group, (*summary)?)).collect();
    let one = |(group, summary): &(&Group, Option<&Summary>)| {
        let zeropoint = (*summary)?.zeropoint.as_ref()?;
        let [_, assumed_err_mag] = zeropoint.target_b_v_mag;
        let of_satellite: Vec<&OneBand> = bands.iter().filter(|b| b.group.satellite == group.satellite).collect();
        let pairs = of_satellite.iter().flat_map(|a| of_satellite.iter().map(move |b| (*a, *b)));
        let ordered = pairs.filter(|(a, b)| (a.band as u8) < (b.band as u8));
        let found = ordered.filter_map(|(blue, red)| colour(blue, red, zeropoint.colour.unwrap_or(ColourIndex::B_V)));
        found.min_by(|a, b| a.err_mag.total_cmp(&b.err_mag)).filter(|c| c.err_mag < assumed_err_mag)
    };
    reduced.iter().map(|r| if r.0.config.zeropoint.target_b_v_mag.is_some() { None } else { one(r) }).collect()
}

impl<'a> OneBand<'a> {
    fn of(group: &'a Group, summary: &'a Summary) -> Option<Self> {
        let zeropoint = summary.zeropoint.as_ref()?;
        let unfiltered =
            zeropoint.light.as_ref().is_none_or(|light| light.meaning == crate::bands::Meaning::Unfiltered);
        let band = zeropoint.band?.reference();
        if unfiltered || band == Band::GaiaG || !Model::BANDS.contains(&band.name()) {
            return None;
        }
        let rows = read_photometry(&summary.folder.join("photometry.ecsv")).ok()?.0;
        let used: Vec<&PhotometryRow> =
            rows.iter().filter(|r| r.status == Status::Ok && r.verdict == Verdict::Use).collect();
        let less_model = used.iter().any(|r| r.residual_mag.is_some());
        let point = |r: &&PhotometryRow| {
            let at_1000_km = || Some(r.v_mag? - 5.0 * (r.range_km? / 1000.0).log10());
            let mag = if less_model { r.residual_mag } else { at_1000_km() };
            Some([r.mjd_mid_d? * 86_400.0, mag?, r.v_mag_err?])
        };
        let mut points: Vec<[f64; 3]> =
            used.iter().filter_map(point).filter(|p| p.iter().all(|v| v.is_finite())).collect();
        points.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let [_, assumed_err_mag] = zeropoint.target_b_v_mag;
        let err_sys = median(&mut used.iter().filter_map(|r| r.v_mag_err_sys).collect::<Vec<_>>())?;
        let of_colour = zeropoint.c_mag_mag * assumed_err_mag;
        let gain_err_mag = Detector::from_config(&group.config.detector).ok()?.gain_table_err_mag();
        let err_sys_mag = (err_sys * err_sys - of_colour * of_colour - gain_err_mag * gain_err_mag).max(0.0).sqrt();
        Some(Self { group, band, zeropoint, points, less_model, err_sys_mag, gain_err_mag })
    }

    /// Magnitude and error at a time, between two frames that are near.
    fn at(&self, time_s: f64) -> Option<(f64, f64)> {
        let after = self.points.partition_point(|p| p[0] < time_s);
        let ([t0, m0, e0], [t1, m1, e1]) = (*self.points.get(after.checked_sub(1)?)?, *self.points.get(after)?);
        if time_s - t0 > REACH_S || t1 - time_s > REACH_S {
            return None;
        }
        let share = if t1 > t0 { (time_s - t0) / (t1 - t0) } else { 0.5 };
        Some((m0 + share * (m1 - m0), (e0 * (1.0 - share)).hypot(e1 * share)))
    }

    /// d(own index) / d(blue − red) of stars, times the colour term: how far the magnitude moves with the measured index.
    fn moves(&self, index: ColourIndex) -> Option<f64> {
        Some(self.zeropoint.c_mag_mag * slope(self.zeropoint.colour.unwrap_or(ColourIndex::B_V), index)?)
    }
}

/// How much an index changes with another, of stars of about the Sun's colour.
fn slope(of: ColourIndex, with: ColourIndex) -> Option<f64> {
    let [low, high] = ABOUT_SUN_MAG;
    let slope = (of.of_b_v(high) - of.of_b_v(low)) / (with.of_b_v(high) - with.of_b_v(low));
    if of == with { Some(1.0) } else { Some(slope).filter(|s| s.is_finite()) }
}

/// The colour in the index `wanted`, of two bands.
///
/// With J = blue − red as calibrated with the Sun's colour, C and s the colour terms and the slopes of their indices with J:
/// δ = (J − J⊙) / (1 + C_blue s_blue − C_red s_red), and the index is its value for the Sun plus s δ.
fn colour(blue: &OneBand, red: &OneBand, wanted: ColourIndex) -> Option<TargetColour> {
    let index = ColourIndex { blue: blue.band, red: red.band };
    let (mut differences, mut formal) = (Vec::new(), Vec::new());
    for [time_s, mag, err_mag] in &blue.points {
        if let Some((other_mag, other_err_mag)) = red.at(*time_s) {
            differences.push(mag - other_mag);
            formal.push(err_mag.hypot(other_err_mag));
        }
    }
    if differences.len() < FEWEST || blue.less_model != red.less_model {
        return None;
    }
    let of_model = if blue.less_model { index.sun_mag()? } else { 0.0 };
    let measured = of_model + median(&mut differences.clone())?;
    // flicker between the frames is in the scatter; neighbours share frames, so that half of them are independent
    let scatter = mad_sigma(&mut differences.clone())?.max(mean_and_sd(&formal).0);
    let err_random = 1.253 * scatter / (0.5 * differences.len() as f64).sqrt();
    let bend = 1.0 + blue.moves(index)? - red.moves(index)?;
    let own = slope(wanted, index)?;
    let delta = (measured - index.sun_mag()?) / bend;
    // an error of the gain moves both bands of one camera alike
    let of_gain =
        if blue.group.instrument == red.group.instrument { 0.0 } else { blue.gain_err_mag.hypot(red.gain_err_mag) };
    let err_index = err_random.hypot(blue.err_sys_mag).hypot(red.err_sys_mag).hypot(of_gain) / bend.abs();
    let err_relation = if wanted == index { 0.0 } else { RELATION_ERR_MAG };
    let index_mag = index.sun_mag()? + delta;
    let mag = wanted.sun_mag()? + own * delta;
    let err_mag = (own * err_index).hypot(err_relation);
    [mag, err_mag].iter().all(|v| v.is_finite()).then(|| TargetColour {
        mag,
        err_mag,
        from: format!(
            "measured: {index} = {index_mag:.3} +- {err_index:.3} mag by {} frames within passes",
            differences.len()
        ),
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn indices_of_stars_rise_with_each_other() {
        let v_r = ColourIndex { blue: Band::V, red: Band::R };
        assert_eq!(slope(v_r, v_r), Some(1.0));
        let slope = slope(ColourIndex::B_V, v_r).unwrap();
        // Caldwell et al. 1993: V−R rises by 0.5 to 0.6 for each magnitude of B−V of stars like the Sun
        assert!((1.5..2.2).contains(&slope), "{slope}");
    }
}
