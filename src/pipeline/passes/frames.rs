//! The flux of the target in every frame of a pass, at the place where it stands.
//!
//! Electrons per second outside the atmosphere, where there is a zeropoint, else as they arrive; seconds since the first frame.
//! It does not cover their mean ([`super::rows`]).

use rayon::ThreadPool;
use rayon::prelude::*;

use crate::base::error::Result;
use crate::base::stats::median;
use crate::base::stop::Stop;
use crate::frames::Exposure;
use crate::photometry::Flags;
use crate::photometry::pass::curve::{EmptyPlaces, FramePoint, Mean, mean};
use crate::photometry::pass::forced::{ForcedFlux, forced_flux};
use crate::photometry::pass::place::{Detection, PassPlace};
use crate::photometry::pass::stack::{FrameMap, PassStack, StackFound, frame_map};
use crate::photometry::pass::width::{MeasuredWidth, Width};
use crate::photometry::target::settings::TargetSettings;
use crate::pipeline::prepared::Calibrated;
use crate::pipeline::target::frame::{settings_of_frame, target_settings};
use crate::pipeline::target::measurement::{CLEAR_SNR, PointAt};
use crate::pipeline::target::place::Place;
use crate::pipeline::target::window::{around, sky_at};
use crate::tables::PhotometryRow;
use crate::tables::words::{ForcedAt, Status, Verdict};

/// A target is resolved where the median of its images is this much longer than a star \[FWHM\] ...
const RESOLVED_FWHM: f64 = 1.3;
/// ... by at least so many of them.
const FEWEST_RESOLVED: usize = 3;
/// Around the place of the target so much is looked at \[FWHM\]: the empty places that check the errors, and their sky.
const SEARCH_FWHM: f64 = 14.0;
/// What makes the flux at a place wrong whatever its error.
const EXCLUDED: Flags =
    Flags(Flags::SATURATED.0 | Flags::CROSSED.0 | Flags::VIGNETTED.0 | Flags::LOWER_LIMIT.0 | Flags::EDGE.0);
/// A pass is bright where half of its detections reach this: then each clear one is its frame's best measure.
const BRIGHT_SNR: f64 = 2.0 * CLEAR_SNR;
/// So many of them that stand at no common place are the target all the same.
const FEWEST_BRIGHT: usize = 3;
/// Detections this bright, and no more of them, refine the place.
const REFINE_SNR: f64 = 8.0;
const MOST_REFINE: usize = 48;
/// A clear detection so far from the place is the target, displaced \[FWHM\]: nearer it is at the place, farther another object.
const NEXT_FWHM: (f64, f64) = (0.5, 4.0);
/// Error of a detection's place times S/N \[FWHM\].
const OUTLINE_PLACE_ERR: f64 = 0.65;
/// Seconds per day.
const DAY_S: f64 = 86_400.0;

/// The frames of a pass that can be stacked.
#[derive(Debug)]
pub struct PassFrames<'a> {
    night: &'a Calibrated,
    /// Row, exposure, time since the first frame \[s\], electrons of a source of unit flux.
    pub frames: Vec<PassFrame<'a>>,
    /// Frames that cannot: of another size or without an airmass.
    pub n_left: usize,
}

/// One of them.
#[derive(Debug, Clone, Copy)]
pub struct PassFrame<'a> {
    /// Its row of the light curve.
    pub row: &'a PhotometryRow,
    exposure: &'a Exposure,
    /// Time since the first frame \[s\].
    pub t_s: f64,
    /// Electrons of a source of unit flux.
    unit_e: f64,
    /// FWHM of the stars \[px\].
    fwhm_px: f64,
}

impl<'a> PassFrame<'a> {
    /// Whether it shows the target, and nothing speaks against its measure.
    fn is_detected(&self) -> bool {
        self.row.status == Status::Ok && self.row.verdict != Verdict::Reject && !self.is_elsewhere()
    }

    /// Whether what it shows stands where no other frame shows anything.
    fn is_elsewhere(&self) -> bool {
        Flags(self.row.flags).has(Flags::UNCONFIRMED)
    }

    /// The place of its own detection where that is no brighter than one that other frames may miss \[px\].
    fn shown(&self) -> Option<(f64, f64)> {
        let is_faint = self.is_detected() && self.row.snr <= Some(REFINE_SNR);
        self.row.x_px.zip(self.row.y_px).filter(|_| is_faint)
    }

    /// The flux of its own detection; `None` where what disturbs it makes that wrong whatever its error.
    fn own(&self, zero_mag: Option<f64>) -> Option<PassPoint<'a>> {
        let row = self.row;
        let mag = if zero_mag.is_some() { row.v_mag } else { row.inst_mag };
        let is_usable = self.is_detected() && !Flags(row.flags).any(EXCLUDED);
        let (mag, flux_e, err_e) = (mag.filter(|_| is_usable)?, row.flux_e?, row.flux_err_e?);
        let flux = 10f64.powf(-0.4 * (mag - zero_mag.unwrap_or(0.0)));
        let per_e = flux / flux_e;
        let variance = (err_e * err_e - flux_e.max(0.0)).max(0.0) * per_e * per_e;
        let point = FramePoint { t_s: self.t_s, flux, variance, variance_per_flux: per_e, moved_frac: 0.0 };
        let own = PassPoint { frame: *self, point, flags: Flags(row.flags), is_own: true };
        (variance > 0.0 && variance.is_finite()).then_some(own)
    }

    /// Where the target stands in this frame \[px\]: at the place of the pass, unless a clear and undisturbed detection stands next
    /// to it.
    fn place(&self, place: &PassPlace) -> (f64, f64) {
        let (row, at) = (self.row, place.at(self.t_s));
        let own = row.x_px.zip(row.y_px).filter(|_| row.verdict == Verdict::Use && row.snr > Some(REFINE_SNR));
        let next_to_it = NEXT_FWHM.0 * self.fwhm_px..NEXT_FWHM.1 * self.fwhm_px;
        own.filter(|(x, y)| next_to_it.contains(&(x - at.0).hypot(y - at.1))).unwrap_or(at)
    }
}

/// Where the place of the target is from.
#[derive(Debug, Clone, PartialEq)]
pub enum PlaceFrom {
    /// Detections of single frames.
    Detections(PassPlace),
    /// Their sum, with its significance.
    Stack(PassPlace, f64),
    /// Its detections are averaged: they are resolved, all bright, bright and at no common place, or of all frames and too far from it.
    Frames,
    /// Nowhere: significance a target must have, error of a flux in the search region, where that is seen, and number of frames, if
    /// they could be stacked.
    None(Option<(f64, Option<f64>, usize)>),
}

/// The flux of the target in one frame.
#[derive(Debug)]
pub struct PassPoint<'a> {
    /// The frame.
    pub frame: PassFrame<'a>,
    /// The flux.
    pub point: FramePoint,
    /// Its flags.
    pub flags: Flags,
    /// Whether it is that of the frame's own detection, which has no part in the error of the width.
    pub is_own: bool,
}

/// The fluxes of a pass.
#[derive(Debug)]
pub struct PassCurve<'a> {
    /// Where the target stands.
    pub place: PlaceFrom,
    /// The flux in each frame that has one, in order of time.
    pub points: Vec<PassPoint<'a>>,
    /// The width that the fluxes were measured with.
    pub width: Width,
    /// Frames in which the target's place is off the frame, masked or disturbed.
    pub without: Vec<PassFrame<'a>>,
    /// Fluxes of empty places.
    pub empty: EmptyPlaces,
}

impl<'a> PassCurve<'a> {
    fn at(place: PlaceFrom) -> Self {
        Self { place, points: Vec::new(), width: Width::default(), without: Vec::new(), empty: EmptyPlaces::default() }
    }

    /// Error of the mean of some fluxes by that of the width of the target's images, as a share of it, at their middle airmass.
    #[must_use]
    pub fn width_err_frac(&self, of: &[PassPoint]) -> f64 {
        let mut airmasses: Vec<f64> = of.iter().filter_map(|p| p.frame.row.airmass).collect();
        let by_width = of.iter().filter(|p| !p.is_own).count() as f64 / of.len().max(1) as f64;
        if by_width > 0.0 { by_width * self.width.flux_err_frac(median(&mut airmasses)) } else { 0.0 }
    }

    /// The mean of all its fluxes, with their errors as they are; `None` without any.
    #[must_use]
    pub fn mean(&self) -> Option<Mean> {
        mean(&self.points.iter().map(|p| p.point).collect::<Vec<_>>(), 1.0)
    }

    /// By how much a place that was chosen for the largest flux makes it too large: k σ²/2F for k free parameters, since the
    /// largest response of a smooth field exceeds that of the truth by χ²_k in its square.
    #[must_use]
    pub fn selection_bias(&self) -> f64 {
        let PlaceFrom::Stack(place, snr) = self.place else { return 0.0 };
        self.mean().map_or(0.0, |m| 0.5 * place.freedoms as f64 / snr * m.empty_err)
    }

    /// The light of a point at the place of the pass in each of its frames, but those that show the target clearly themselves;
    /// `None` in those that do not show the place, nothing at all where the pass has no place.
    ///
    /// σ² = s² σ₀² + p F + (m F)²: s what empty places make of the errors, p F the photons of the target, m F what its jitter
    /// and the error of its width make of it, F there at least the mean of the pass: the flux of a target next to the place is too
    /// small, and so would be its error.
    #[must_use]
    pub fn light_of_frames(&self) -> Vec<(PassFrame<'a>, Option<PointAt>)> {
        let (PlaceFrom::Detections(place) | PlaceFrom::Stack(place, _)) = self.place else { return Vec::new() };
        let (scale, bias) = (self.empty.error_scale(), self.selection_bias());
        let of_pass = self.mean().map_or(0.0, |m| m.flux);
        let light = |p: &PassPoint<'a>| {
            let (frame, point) = (p.frame, &p.point);
            let (x_px, y_px) = frame.place(&place);
            let flux = point.flux - bias;
            let moved = flux.max(of_pass) * point.moved_frac.hypot(self.width.flux_err_frac(frame.row.airmass));
            let variance = scale * scale * point.variance + flux.max(0.0) * point.variance_per_flux + moved * moved;
            let (flux_e, err_e) = (flux * frame.unit_e, variance.sqrt() * frame.unit_e);
            (frame, Some(PointAt { at: ForcedAt::Pass, x_px, y_px, flux_e, err_e }))
        };
        self.points
            .iter()
            .filter(|p| !p.is_own)
            .map(light)
            .chain(self.without.iter().map(|frame| (*frame, None)))
            .collect()
    }
}

impl<'a> PassFrames<'a> {
    /// Those of the rows, in order of time, that have a time and were looked at.
    pub fn new(rows: impl Iterator<Item = (&'a PhotometryRow, &'a Exposure)>, night: &'a Calibrated) -> Self {
        let looked_at = |r: &PhotometryRow| r.status == Status::Ok || r.status == Status::Nondetection;
        let mut rows: Vec<_> = rows.filter(|(r, _)| looked_at(r) && r.mjd_mid_d.is_some()).collect();
        rows.sort_by(|a, b| mjd(a.0).total_cmp(&mjd(b.0)));
        let mut out = Self { night, frames: Vec::new(), n_left: 0 };
        let Some((first, of_first)) = rows.first().copied() else { return out };
        for (row, exposure) in rows {
            let same = (exposure.size_px, exposure.binning) == (of_first.size_px, of_first.binning);
            match out.unit_e(row, exposure).filter(|unit_e| same && *unit_e > 0.0 && unit_e.is_finite()) {
                Some(unit_e) => {
                    let t_s = (mjd(row) - mjd(first)) * DAY_S;
                    let fwhm_px = target_settings(exposure, night, night.seeing.fwhm_arcsec(row.airmass)).fwhm_px;
                    out.frames.push(PassFrame { row, exposure, t_s, unit_e, fwhm_px });
                }
                None => out.n_left += 1,
            }
        }
        out
    }

    /// The night the frames are of.
    #[must_use]
    pub fn night(&self) -> &'a Calibrated {
        self.night
    }

    /// V of unit flux outside the atmosphere; `None` without a zeropoint.
    #[must_use]
    pub fn zero_mag(&self) -> Option<f64> {
        self.mag_of_unit(0.0)
    }

    fn mag_of_unit(&self, airmass: f64) -> Option<f64> {
        let zeropoint = self.night.zeropoint.as_ref()?;
        let [colour, _] = self.night.config.zeropoint.target_colour(zeropoint.colour);
        Some(zeropoint.v_mag(0.0, airmass, colour))
    }

    /// t 10^(0.4 (K(X) − K(0))), K the magnitude of one electron per second at an airmass: electrons of unit flux.
    fn unit_e(&self, row: &PhotometryRow, exposure: &Exposure) -> Option<f64> {
        let extinction = match self.zero_mag() {
            Some(zero) => self.mag_of_unit(row.airmass?)? - zero,
            None => 0.0,
        };
        Some(exposure.exptime_s * 10f64.powf(0.4 * extinction))
    }

    /// The flux of the target in every frame, at most `at_once` of them in memory.
    ///
    /// # Errors
    /// A stop.
    pub fn curve(&self, threads: &ThreadPool, at_once: usize, stop: &Stop) -> Result<PassCurve<'a>> {
        let detected: Vec<&PassFrame> = self.frames.iter().filter(|f| f.is_detected()).collect();
        let zero_mag = self.zero_mag();
        // by the pass, not by the noise of a frame
        let median_snr = median(&mut detected.iter().filter_map(|f| f.row.snr).collect::<Vec<_>>());
        let is_bright_pass = median_snr > Some(BRIGHT_SNR);
        let is_bright = |f: &PassFrame| is_bright_pass && f.is_detected() && f.row.snr > Some(CLEAR_SNR);
        let of_frames = || {
            let points = self.frames.iter().filter_map(|f| f.own(zero_mag)).collect();
            PassCurve { points, ..PassCurve::at(PlaceFrom::Frames) }
        };
        if resolved(&detected) || self.frames.iter().all(is_bright) {
            return Ok(of_frames());
        }
        let fwhm_px = self.frames.first().map_or(f64::NAN, |f| f.fwhm_px);
        let width = Width::of(&detected.iter().filter_map(|f| measured_width(f)).collect::<Vec<_>>());
        let detections: Vec<Detection> = detected.iter().filter_map(|f| detection(f)).collect();
        // none is missing that the threshold of a detection would have chosen
        let is_clear = median_snr > Some(REFINE_SNR);
        let all_seen = is_clear && self.frames.iter().all(|f| f.row.status == Status::Ok);
        // so far above the threshold that it chooses little of them
        let is_seen = is_clear && 2 * detected.len() > self.frames.len();
        let place = match PassPlace::of_detections(&detections, fwhm_px) {
            Some(place) if all_seen && place.is_loose(fwhm_px) => return Ok(of_frames()),
            Some(place) => PlaceFrom::Detections(self.refined(place, &width, &detected, threads)),
            // seen in single frames, but at no common place
            None if is_seen || self.frames.iter().filter(|f| is_bright(f)).count() >= FEWEST_BRIGHT => {
                return Ok(of_frames());
            }
            None => self.search(threads, at_once, stop)?,
        };
        let mut curve = PassCurve { width, ..PassCurve::at(place) };
        let (PlaceFrom::Detections(place) | PlaceFrom::Stack(place, _)) = curve.place else { return Ok(curve) };
        let mut unsure = Vec::new();
        for frames in self.frames.chunks(at_once.max(1)) {
            stop.check(|| "stopped while passes were stacked; run the same line again".into())?;
            let measured = |f: &PassFrame<'a>| match f.own(zero_mag).filter(|_| is_bright(f)) {
                Some(own) => (Some(own), None),
                None => (None, self.forced(f, &place, &width)),
            };
            let measured: Vec<(Option<PassPoint>, Option<ForcedFlux>)> =
                threads.install(|| frames.par_iter().map(measured).collect());
            for (frame, (own, forced)) in frames.iter().zip(measured) {
                if let Some(own) = own {
                    curve.points.push(own);
                    continue;
                }
                let forced = forced.map(|f| (Flags(frame.row.flags & EXCLUDED.0) | f.flags, f));
                let Some((flags, forced)) = forced.filter(|(flags, _)| !flags.any(EXCLUDED)) else {
                    curve.without.push(*frame);
                    continue;
                };
                let unit = frame.unit_e;
                let empty: Vec<Option<(f64, f64)>> =
                    forced.empty.iter().map(|e| e.map(|(flux, v)| (flux / unit, v / (unit * unit)))).collect();
                curve.empty.add(&empty);
                let point = FramePoint {
                    t_s: frame.t_s,
                    flux: forced.flux_e / unit,
                    variance: forced.variance_e2 / (unit * unit),
                    variance_per_flux: forced.variance_per_e / unit,
                    moved_frac: forced.moved_frac,
                };
                // without light at the place, what stands elsewhere may be a bright target itself
                let is_displaced = is_bright_pass && frame.is_elsewhere() && point.snr() < REFINE_SNR;
                let is_unsure = forced.is_sharp || is_displaced;
                let of = if is_unsure { &mut unsure } else { &mut curve.points };
                of.push(PassPoint { frame: *frame, point, flags, is_own: false });
            }
        }
        // light that is sharper than a star is the target with noise on it where it is as bright as in the others, else a hit
        let mean = curve.mean();
        for point in unsure {
            if mean.is_some_and(|m| m.may_be(&point.point)) {
                curve.points.push(point);
            } else {
                curve.without.push(point.frame);
            }
        }
        curve.points.sort_by(|a, b| a.point.t_s.total_cmp(&b.point.t_s));
        Ok(curve)
    }

    /// The place by the light of the brightest detections, whose outlines give it less well.
    fn refined(&self, place: PassPlace, width: &Width, detected: &[&PassFrame], threads: &ThreadPool) -> PassPlace {
        let snr = |f: &PassFrame| f.row.snr.unwrap_or(0.0);
        let on_place = |f: &PassFrame| f.place(&place) == place.at(f.t_s);
        let mut bright: Vec<&PassFrame> =
            detected.iter().copied().filter(|f| snr(f) > REFINE_SNR && on_place(f)).collect();
        bright.sort_by(|a, b| snr(b).total_cmp(&snr(a)).then(a.t_s.total_cmp(&b.t_s)));
        bright.truncate(MOST_REFINE);
        let Some(fwhm_px) = bright.first().map(|f| f.fwhm_px) else { return place };
        let offsets: Vec<(f64, f64, f64)> =
            threads.install(|| bright.par_iter().filter_map(|f| self.forced(f, &place, width)?.offset_px).collect());
        place.refined(&offsets, fwhm_px)
    }

    /// Looks for the target in the sum of the frames.
    fn search(&self, threads: &ThreadPool, at_once: usize, stop: &Stop) -> Result<PlaceFrom> {
        let n = self.frames.len();
        let Some(settings) = self.settings_of_stack() else { return Ok(PlaceFrom::None(None)) };
        let mut stack: Option<PassStack> = None;
        for (first, frames) in self.frames.chunks(at_once.max(1)).enumerate() {
            stop.check(|| "stopped while passes were stacked; run the same line again".into())?;
            let map = |f: &PassFrame| self.map(f, &settings);
            let maps: Vec<Option<FrameMap>> = threads.install(|| frames.par_iter().map(map).collect());
            for (k, (frame, map)) in frames.iter().zip(maps).enumerate() {
                let Some(map) = map else { continue };
                let stack = stack.get_or_insert_with(|| PassStack::like(&map));
                stack.add(&map, frame.t_s, (first * at_once.max(1) + k, n));
            }
        }
        let Some(stack) = stack else { return Ok(PlaceFrom::None(None)) };
        let found = threads.install(|| stack.find(&settings));
        Ok(match found {
            Some(StackFound { place: Some(place), snr, .. }) => PlaceFrom::Stack(place, snr),
            Some(StackFound { threshold, flux_err, n_frames, .. }) => {
                PlaceFrom::None(Some((threshold, flux_err, n_frames)))
            }
            None => PlaceFrom::None(None),
        })
    }

    fn settings(&self, frame: &PassFrame) -> TargetSettings {
        let place = Place::of(frame.exposure, self.night);
        settings_of_frame(place.seen(), frame.exposure, self.night)
    }

    /// Those of all frames of a stack: one region, in cells of one size, with stars of the middle width.
    fn settings_of_stack(&self) -> Option<TargetSettings> {
        let first = self.frames.first()?;
        let scale_arcsec = self.night.scale_arcsec(first.exposure);
        let fwhm_px = median(&mut self.frames.iter().map(|f| f.fwhm_px).collect::<Vec<_>>())?;
        let settings = target_settings(first.exposure, self.night, Some(fwhm_px * scale_arcsec));
        Some(TargetSettings { profile: self.night.seeing.profile, ..settings })
    }

    fn map(&self, frame: &PassFrame, of_stack: &TargetSettings) -> Option<FrameMap> {
        let own = self.settings(frame);
        let settings = TargetSettings {
            trail_direction: own.trail_direction,
            trail_length_px: own.trail_length_px,
            is_fwhm_known: own.is_fwhm_known,
            ..*of_stack
        };
        let reader = self.night.open(frame.exposure).ok()?;
        let pixels = around(&reader, self.night, &settings).ok()??;
        frame_map(&pixels, &settings, frame.unit_e, frame.shown())
    }

    fn forced(&self, frame: &PassFrame, place: &PassPlace, width: &Width) -> Option<ForcedFlux> {
        let (x_px, y_px) = frame.place(place);
        let settings = self.settings(frame);
        let fwhm_px = settings.fwhm_px * width.fwhm_ratio(frame.row.airmass);
        let settings = TargetSettings { x_px, y_px, fwhm_px, search_radius_px: SEARCH_FWHM * fwhm_px, ..settings };
        let reader = self.night.open(frame.exposure).ok()?;
        let pixels = around(&reader, self.night, &settings).ok()??;
        let p = &self.night.config.photometry;
        let sky = sky_at(&pixels, p.mesh_px, p.clip_sigma, &settings)?;
        forced_flux(&pixels, &sky, &settings, place.jitter_px)
    }
}

/// Whether the detections show a target larger than a star.
fn resolved(detected: &[&PassFrame]) -> bool {
    let mut extents: Vec<f64> = detected.iter().filter_map(|f| f.row.extent_fwhm).collect();
    extents.len() >= FEWEST_RESOLVED && median(&mut extents).is_some_and(|e| e > RESOLVED_FWHM)
}

fn measured_width(frame: &&PassFrame) -> Option<MeasuredWidth> {
    Some((frame.row.disc_fwhm2?, frame.row.disc_fwhm2_err?, frame.row.airmass?))
}

fn detection(frame: &&PassFrame) -> Option<Detection> {
    let row = frame.row;
    // that of a Gaussian is 0.43 FWHM over S/N, of the middle of an outline half as much again
    let err_px = OUTLINE_PLACE_ERR * frame.fwhm_px / row.snr?.max(1.0);
    Some(Detection { t_s: frame.t_s, x_px: row.x_px?, y_px: row.y_px?, err_px })
}

fn mjd(row: &PhotometryRow) -> f64 {
    row.mjd_mid_d.unwrap_or(f64::NAN)
}
