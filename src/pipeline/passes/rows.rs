//! The rows of a pass: the mean of its frames, its limit, and the bins of its light curve.
//!
//! Electrons per second and magnitudes. It does not cover the fluxes of the frames ([`super::frames`]).

use super::frames::{PassCurve, PassFrame, PassFrames, PlaceFrom};
use crate::base::constants::MAG_PER_LN;
use crate::base::stats::median;
use crate::photometry::Flags;
use crate::photometry::pass::curve::{FramePoint, bins, mean};
use crate::photometry::target::measure::LIMIT_MARGIN_SIGMA;
use crate::tables::{PassStackRow, PhotometryRow};

/// Seconds per day.
const DAY_S: f64 = 86_400.0;

/// The row of the whole pass, then those of its bins, where there are more than one.
#[must_use]
pub fn rows_of(number: i64, pass: &PassFrames, curve: &PassCurve) -> Vec<PassStackRow> {
    let Some(first) = pass.frames.first() else { return Vec::new() };
    let (scale, bias) = (curve.empty.error_scale(), curve.selection_bias());
    let of_pass = curve.mean().map_or(0.0, |m| m.flux);
    let of = OfPass { number, pass, curve, first, scale, bias, of_pass };
    if curve.points.is_empty() {
        return vec![of.without_flux()];
    }
    let points: Vec<FramePoint> = curve.points.iter().map(|p| p.point).collect();
    let bins = bins(&points, pass.night().config.target.pass_bin_snr, of.scale);
    let mut rows = vec![of.row(0, 0..points.len(), &points)];
    if bins.len() > 1 {
        rows.extend((1..).zip(bins).map(|(k, range)| of.row(k, range, &points)));
    }
    rows
}

struct OfPass<'a> {
    number: i64,
    pass: &'a PassFrames<'a>,
    curve: &'a PassCurve<'a>,
    first: &'a PassFrame<'a>,
    scale: f64,
    bias: f64,
    /// The mean flux of the pass.
    of_pass: f64,
}

impl OfPass<'_> {
    /// Identity, times and circumstances of some frames.
    fn of_frames<'b>(&self, bin: i64, frames: impl Iterator<Item = &'b PassFrame<'b>>) -> PassStackRow {
        let rows: Vec<&PhotometryRow> = frames.map(|f| f.row).collect();
        let mean = |of: fn(&PhotometryRow) -> Option<f64>| {
            let values: Vec<f64> = rows.iter().filter_map(|r| of(r)).collect();
            (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
        };
        PassStackRow {
            pass: Some(self.number),
            bin,
            norad_cat_id: self.first.row.norad_cat_id,
            object_name: self.first.row.object_name.clone(),
            frames: rows.len() as i64,
            date_first: rows.first().map(|r| r.date_mid.clone()).unwrap_or_default(),
            date_last: rows.last().map(|r| r.date_mid.clone()).unwrap_or_default(),
            exptime_s: Some(rows.iter().filter_map(|r| r.exptime_s).sum()),
            range_km: mean(|r| r.range_km),
            phase_angle_deg: mean(|r| r.phase_angle_deg),
            v_mag_err_sys: median(&mut rows.iter().filter_map(|r| r.v_mag_err_sys).collect::<Vec<_>>()),
            ..PassStackRow::default()
        }
    }

    /// Frames of the pass that are not among `n`.
    fn excluded(&self, n: usize) -> i64 {
        (self.pass.frames.len() + self.pass.n_left).saturating_sub(n) as i64
    }

    /// A pass in which the target stands out nowhere: its limit.
    fn without_flux(&self) -> PassStackRow {
        let mut row = self.of_frames(0, self.pass.frames.iter());
        row.mjd_mid_d = self.first.row.mjd_mid_d.zip(self.pass.frames.last().and_then(|f| f.row.mjd_mid_d)).map(mid);
        row.v_mag_err_sys = None;
        if let PlaceFrom::None(Some((threshold, flux_err, n_frames))) = self.curve.place {
            row.place_from = "none".into();
            row.frames = n_frames as i64;
            row.frames_excluded = self.excluded(n_frames);
            row.threshold_sigma = Some(threshold);
            row.limit_v_mag = flux_err.and_then(|err| self.mag((threshold + LIMIT_MARGIN_SIGMA) * err));
            row.reason = format!("nothing above {threshold:.2} sigma in the sum of the frames");
            if flux_err.is_none() {
                row.reason +=
                    "; no limit: more than 5 % of the search region is hidden by what stands out in every frame";
            }
        } else {
            row.place_from = "none".into();
            row.frames = 0;
            row.frames_excluded = self.excluded(0);
            row.reason = "no frame of the pass can be stacked".into();
        }
        row
    }

    /// The mean of a range of frames.
    fn row(&self, bin: i64, range: std::ops::Range<usize>, points: &[FramePoint]) -> PassStackRow {
        let of_bin = &self.curve.points[range.clone()];
        let mut row = self.of_frames(bin, of_bin.iter().map(|p| &p.frame));
        row.frames_excluded = if bin == 0 { self.excluded(of_bin.len()) } else { 0 };
        row.flags = of_bin.iter().fold(Flags::default(), |all, p| all | p.flags).0;
        row.place_from = match self.curve.place {
            PlaceFrom::Detections(_) => "detections",
            PlaceFrom::Stack(..) => "stack",
            PlaceFrom::Frames => "frames",
            PlaceFrom::None(_) => "none",
        }
        .into();
        let Some(m) = mean(&points[range], self.scale) else {
            row.reason = "no frame with an error".into();
            return row;
        };
        let flux = m.flux - self.bias;
        let err = m.err_of_expected(self.of_pass);
        let detect_sigma = self.pass.night().config.target.detect_sigma;
        row.mjd_mid_d = self.first.row.mjd_mid_d.map(|mjd| mjd + m.t_s / DAY_S);
        if let PlaceFrom::Detections(place) | PlaceFrom::Stack(place, _) = self.curve.place {
            let (x, y) = place.at(m.t_s);
            (row.x_px, row.y_px, row.jitter_px) = (Some(x), Some(y), Some(place.jitter_px));
            (row.drift_x_px_s, row.drift_y_px_s) = (Some(place.drift_px_s.0), Some(place.drift_px_s.1));
        }
        (row.flux_e_s, row.flux_err_e_s, row.snr) = (Some(flux), Some(err), Some(flux / err));
        (row.chi2_dof, row.err_scale) = (m.chi2_dof, Some(self.scale));
        row.threshold_sigma = Some(detect_sigma);
        row.limit_v_mag = self.mag(m.limit(detect_sigma));
        self.magnitude(&mut row, (flux, err), self.curve.width_err_frac(of_bin), detect_sigma);
        row
    }

    fn magnitude(&self, row: &mut PassStackRow, (flux, err): (f64, f64), width_err_frac: f64, detect_sigma: f64) {
        if flux < detect_sigma * err {
            row.reason = format!("S/N {:.1} is below {detect_sigma} (target.detect_sigma)", flux / err);
            return;
        }
        row.inst_mag = Some(-2.5 * flux.log10());
        row.v_mag = self.mag(flux);
        row.v_mag_err = Some(MAG_PER_LN * (err / flux).hypot(width_err_frac));
        if row.v_mag.is_none() {
            row.reason = "no zeropoint: v_mag left empty".into();
        }
    }

    /// V of a flux.
    fn mag(&self, flux: f64) -> Option<f64> {
        Some(self.pass.zero_mag()? - 2.5 * flux.log10()).filter(|m| m.is_finite())
    }
}

fn mid((a, b): (f64, f64)) -> f64 {
    0.5 * (a + b)
}
