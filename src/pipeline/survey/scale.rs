//! The pixel scale: what the configuration says against what the headers say and what the stars solve to.
//!
//! Arcsec/px, mm. FOCALLEN and XPIXSZ are nominal values and cost a warning; world coordinates of star frames are better
//! evidence; the stars decide. It does not cover the place on the sky ([`crate::pipeline::stars::solve`]).

use crate::astrometry::catalogue::Catalogue;
use crate::astrometry::initial_pointing::initial_pointings;
use crate::astrometry::plate::{Effort, SkyStar};
use crate::base::error::{Error, Result};
use crate::base::stats::median;
use crate::base::threads::with_threads;
use crate::config::{Config, Stars};
use crate::frames::header::optics;
use crate::frames::{Exposure, pixel_scale_arcsec};
use crate::photometry::detect::Source;
use crate::pipeline::prepared::Prepared;
use crate::pipeline::shards::products::FrameCache;
use crate::pipeline::stars::solve::{Search, agreement, catalogue_stars, header_wcs, solve_from_with};
use crate::pipeline::stars::solve_file::detections;
use crate::pipeline::survey::files::Survey;

/// Largest share by which the scale of the stars may differ from the configured one.
pub const MOST_FRAC: f64 = 0.02;
/// Share beyond which nominal values of the headers are not due to rounding: refused where no field gives a better scale.
const NOMINAL_FRAC: f64 = 0.2;
/// Star frames that are solved, and that confirm a scale which is not the configured one.
const SAMPLED: usize = 3;
/// Frames that are searched at every scale there may be, where the headers do not state the scale or contradict the
/// configuration; one where they agree with it, so that a night without stars costs little.
const SEARCHED: usize = 2;
/// Largest distance from the approximate position in that search \[deg\].
const SEARCHED_RADIUS_DEG: f64 = 0.3;
/// Its effort at each scale: the brightest stars are there at the right one.
const SEARCHED_EFFORT: Effort = Effort { max_detections: 16, max_levels: 2 };
/// Diagonals of a frame between which the scale is looked for \[deg\].
const DIAGONALS_DEG: (f64, f64) = (0.02, 10.0);
/// Step of that search: each covers a share of [`LADDER_FRAC`] on both sides.
const LADDER_STEP: f64 = 1.8;
const LADDER_FRAC: f64 = 0.3;
/// Name of the product that keeps what the stars said.
const SCALE: &str = "scale";

/// A scale, as a share of the configured one, and where it is from.
#[derive(Debug, Clone, PartialEq)]
pub struct Evidence {
    /// Scale over configured scale.
    pub ratio: f64,
    /// Scale \[arcsec/px\].
    pub scale_arcsec: f64,
    /// Keywords with their values, or the frames that were solved.
    pub source: String,
}

impl Evidence {
    /// Whether it differs from the configured scale by more than a share.
    #[must_use]
    pub fn is_off(&self, frac: f64) -> bool {
        !((self.ratio - 1.0).abs() <= frac)
    }
}

/// The configured scale of an exposure \[arcsec/px\].
pub(crate) fn configured_arcsec(exposure: &Exposure, config: &Config) -> f64 {
    pixel_scale_arcsec(config.detector.pixel_um, exposure.binning, config.telescope.focal_length_mm)
}

/// What FOCALLEN and XPIXSZ of a header, else PIXSCALE, say about the scale; `None` if they are absent.
///
/// XPIXSZ holds the binning in most programs and not in all: the reading that is closer to the configured pixel counts.
#[must_use]
pub fn nominal(exposure: &Exposure, config: &Config) -> Option<Evidence> {
    let configured = configured_arcsec(exposure, config);
    let number =
        |keys: &[&'static str]| keys.iter().find_map(|k| Some((*k, exposure.header.number(k).filter(|v| *v > 0.0)?)));
    let of = |scale_arcsec: f64, source: String| Evidence { ratio: scale_arcsec / configured, scale_arcsec, source };
    let Some((focal_key, focal_mm)) = number(&["FOCALLEN", "FOCAL"]) else {
        let written = optics(&exposure.header, &config.header.aliases).scale_arcsec?;
        return Some(of(written.value, format!("{} = {}", written.source, written.value)));
    };
    let Some((pixel_key, pixel_um)) = number(&["XPIXSZ", "PIXSIZE1", "PIXSZ"]) else {
        let scale = pixel_scale_arcsec(config.detector.pixel_um, exposure.binning, focal_mm);
        return Some(of(scale, format!("{focal_key} = {focal_mm} mm")));
    };
    let source = format!("{focal_key} = {focal_mm} mm with {pixel_key} = {pixel_um:.4} um");
    // with the binning in it or without it: whichever is the configured pitch, as far as either is
    let binned = exposure.binning.max(1);
    let pitches_um = [pixel_um, pixel_um * f64::from(binned)];
    let expected_um = config.detector.pixel_um * f64::from(binned);
    let off = |um: &f64| (um / expected_um).ln().abs();
    let pitch_um = pitches_um.into_iter().min_by(|a, b| off(a).total_cmp(&off(b)))?;
    Some(of(pixel_scale_arcsec(pitch_um, 1, focal_mm), source))
}

/// The words of nominal values that differ from the configured scale.
#[must_use]
pub fn nominal_warning(exposure: &Exposure, config: &Config) -> Option<String> {
    let nominal = nominal(exposure, config).filter(|n| n.is_off(MOST_FRAC))?;
    Some(format!(
        "{} gives {:.4} arcsec/px, {:.1} % from the {:.4} of telescope.focal_length_mm = {} and detector.pixel_um = {}; \
         these keywords are nominal, and the scale the stars solve to decides",
        nominal.source,
        nominal.scale_arcsec,
        100.0 * (nominal.ratio - 1.0).abs(),
        configured_arcsec(exposure, config),
        config.telescope.focal_length_mm,
        config.detector.pixel_um
    ))
}

/// The scale of the world coordinates in the headers of star frames, the median.
#[must_use]
pub fn of_headers(survey: &Survey, config: &Config) -> Option<Evidence> {
    let frames = survey.pointings.iter().flatten();
    let of_header = |e| Some((e, header_wcs(e).ok().flatten()?.scale_arcsec()));
    let all: Vec<(&Exposure, f64)> = frames.filter_map(of_header).collect();
    let mut ratios: Vec<f64> = all.iter().map(|(e, scale)| scale / configured_arcsec(e, config)).collect();
    let ratio = median(&mut ratios)?;
    let scale_arcsec = ratio * configured_arcsec(all.first()?.0, config);
    Some(Evidence {
        ratio,
        scale_arcsec,
        source: format!("world coordinates in the headers of {} star frames", all.len()),
    })
}

/// The nominal scale of the light frames, the median.
#[must_use]
pub fn nominal_of(survey: &Survey, config: &Config) -> Option<Evidence> {
    let mut all: Vec<Evidence> =
        survey.pointings.iter().flatten().chain(&survey.targets).filter_map(|e| nominal(e, config)).collect();
    all.sort_by(|a, b| a.ratio.total_cmp(&b.ratio));
    let middle = all.len() / 2;
    (!all.is_empty()).then(|| all.swap_remove(middle))
}

/// What the headers alone leave of the scale: nothing to check, a contradiction that the stars must decide, or an error where
/// there are no stars to compare with.
pub(crate) fn check_headers(survey: &Survey, prepared: &Prepared) -> Result<bool> {
    let config = &prepared.config;
    if !config.telescope.check_scale {
        return Ok(false);
    }
    let (wcs, nominal) = (of_headers(survey, config), nominal_of(survey, config));
    let can_solve = prepared.catalogue.is_some() && survey.n_star_frames() > 0;
    if can_solve || config.stars.is_some() && prepared.catalogue.is_none() {
        return Ok(can_solve && wcs.iter().chain(&nominal).any(|e| e.is_off(MOST_FRAC)));
    }
    match (wcs, nominal) {
        (Some(wcs), _) if wcs.is_off(MOST_FRAC) => Err(refusal(&wcs, config)),
        (None, Some(nominal)) if nominal.is_off(NOMINAL_FRAC) => Err(refusal(&nominal, config)),
        _ => Ok(false),
    }
}

/// Asks stars of the night for the scale, before anything is measured or written.
///
/// One frame that solves to the configured scale is enough; another scale is confirmed by up to three frames. Where none of
/// three solves near the configured scale or that of its header, up to two are searched at every scale from 0.02 to 10
/// degrees of field. Returns what should be known.
///
/// # Errors
/// [`Error::Config`] naming both values and the key, where the stars solve to another scale than the configured one; also
/// where no field solves and the nominal values of the headers are more than 20 % off.
pub fn check_stars(survey: &Survey, prepared: &Prepared, products: &FrameCache, jobs: usize) -> Result<Vec<String>> {
    let config = &prepared.config;
    let (Some(stars), Some(catalogue)) = (&config.stars, &prepared.catalogue) else { return Ok(Vec::new()) };
    if survey.n_star_frames() == 0 {
        return Ok(Vec::new());
    }
    let (found, sampled) = with_threads(jobs, || solved(survey, prepared, (stars, catalogue), products))?;
    let Some(found) = found else {
        let nominal = nominal_of(survey, config).filter(|n| n.is_off(NOMINAL_FRAC) && config.telescope.check_scale);
        return match nominal {
            Some(nominal) => Err(refusal(&nominal, config)),
            None => Ok(vec![format!(
                "none of {sampled} star frames could be solved before the run: the configured pixel scale is not checked"
            )]),
        };
    };
    // where another scale is used all the same, the star frames report it once
    judged(&found, config).map(|_| Vec::new())
}

/// Whether a scale is the configured one; a note where it is not and that is allowed.
///
/// # Errors
/// [`Error::Config`] where it is not.
pub(crate) fn judged(found: &Evidence, config: &Config) -> Result<Option<String>> {
    match (found.is_off(MOST_FRAC), config.telescope.check_scale) {
        (false, _) => Ok(None),
        (true, true) => Err(refusal(found, config)),
        (true, false) => Ok(Some(format!(
            "{}: {:.4} arcsec/px, {:.1} % from the configured scale, which is used all the same (telescope.check_scale = \
             false)",
            found.source,
            found.scale_arcsec,
            100.0 * (found.ratio - 1.0).abs()
        ))),
    }
}

/// The error of a configured scale that the evidence contradicts.
pub(crate) fn refusal(evidence: &Evidence, config: &Config) -> Error {
    let focal_mm = config.telescope.focal_length_mm;
    let right_mm = focal_mm / evidence.ratio;
    let right = if right_mm < 100.0 { format!("{right_mm:.2}") } else { format!("{right_mm:.0}") };
    let factor = evidence.ratio.max(1.0 / evidence.ratio);
    let whole = factor.round();
    let binning = match (2.0..=8.0).contains(&whole) && (factor / whole - 1.0).abs() < MOST_FRAC {
        true => format!(
            "; or is the factor of {whole} the binning, which XBINNING must give (header.aliases.binning), or \
             detector.pixel_um?"
        ),
        false => String::new(),
    };
    Error::Config {
        key: "telescope.focal_length_mm".into(),
        problem: format!(
            "= {focal_mm} with detector.pixel_um = {} and the binning gives {:.4} arcsec/px, but {:.4} arcsec/px come from \
             the {}: {:.1} % apart, where {:.0} % are allowed; set telescope.focal_length_mm = {right}, or \
             telescope.check_scale = false to use the configured scale all the same{binning}",
            config.detector.pixel_um,
            evidence.scale_arcsec / evidence.ratio,
            evidence.scale_arcsec,
            evidence.source,
            100.0 * (evidence.ratio - 1.0).abs(),
            100.0 * MOST_FRAC
        ),
    }
}

/// The scale the stars solve to, and how many frames were tried.
fn solved(
    survey: &Survey,
    prepared: &Prepared,
    (stars, catalogue): (&Stars, &Catalogue),
    products: &FrameCache,
) -> (Option<Evidence>, usize) {
    let sampled = spread(survey);
    let mut frames: Vec<ScaleFrame> = sampled.iter().map(|exposure| ScaleFrame { exposure, sources: None }).collect();
    let sky = catalogue_stars(catalogue);
    let mut found: Vec<(&str, f64, f64)> = Vec::new();
    let agrees = nominal_of(survey, &prepared.config).is_some_and(|n| !n.is_off(MOST_FRAC));
    let searched = if agrees { 1 } else { SEARCHED };
    for reach in [Reach::Near, Reach::Wide] {
        for frame in frames.iter_mut().take(if reach == Reach::Near { SAMPLED } else { searched }) {
            let exposure = frame.exposure;
            let key = key(exposure, stars, reach, products);
            let name = format!("{SCALE}.{}", exposure.name);
            let kept = key.as_ref().and_then(|key| products.load::<Option<f64>>(&name, key));
            let scale = kept.unwrap_or_else(|| {
                let scale = frame.scale(prepared, (stars, catalogue), &sky, reach);
                key.iter().for_each(|key| products.store(&name, key, &scale));
                scale
            });
            let Some(scale) = scale else { continue };
            found.push((&exposure.name, scale, scale / configured_arcsec(exposure, &prepared.config)));
            let right = (found[0].2 - 1.0).abs() <= MOST_FRAC;
            if right {
                break;
            }
        }
        if !found.is_empty() {
            break;
        }
    }
    let Some(ratio) = median(&mut found.iter().map(|f| f.2).collect::<Vec<_>>()) else { return (None, sampled.len()) };
    let (names, configured) =
        (found.iter().map(|f| f.0).collect::<Vec<_>>().join(", "), found.first().map_or(f64::NAN, |f| f.1 / f.2));
    let source = format!("stars of {names}");
    (Some(Evidence { ratio, scale_arcsec: ratio * configured, source }), sampled.len())
}

/// The frames that are solved: of the first, the middle and the last pointing, and where there are fewer, others.
fn spread(survey: &Survey) -> Vec<&Exposure> {
    let n = survey.pointings.len();
    let mut sampled: Vec<&Exposure> = Vec::new();
    let first = [0, n / 2, n.saturating_sub(1)];
    let middles = first.into_iter().filter_map(|k| survey.pointings.get(k)).filter_map(|p| p.get(p.len() / 2));
    for exposure in middles.chain(survey.pointings.iter().flatten()) {
        if sampled.len() < SAMPLED && sampled.iter().all(|e| e.path != exposure.path) {
            sampled.push(exposure);
        }
    }
    sampled
}

/// What an answer depends on; `None` for a frame that cannot be read.
fn key(exposure: &Exposure, stars: &Stars, reach: Reach, products: &FrameCache) -> Option<String> {
    let (frame, catalogue) = (products.sha256(&exposure.path).ok()?, products.sha256(&stars.catalogue).ok()?);
    Some(products.key(&[SCALE, &exposure.name, &frame, &catalogue, &format!("{reach:?}")]))
}

/// How far from the configured scale is looked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Reach {
    /// As far as `stars.scale_search_frac`, and about the scales the header gives.
    Near,
    /// At every scale there may be.
    Wide,
}

/// A star frame whose scale is measured, with its detections once they are known.
struct ScaleFrame<'a> {
    exposure: &'a Exposure,
    sources: Option<Vec<Source>>,
}

impl ScaleFrame<'_> {
    /// The scale \[arcsec/px\] the frame's stars solve to.
    fn scale(
        &mut self,
        prepared: &Prepared,
        (stars, catalogue): (&Stars, &Catalogue),
        sky: &[SkyStar],
        reach: Reach,
    ) -> Option<f64> {
        let (exposure, config) = (self.exposure, &prepared.config);
        if self.sources.is_none() {
            self.sources = Some(detections(exposure, &config.photometry).unwrap_or_default());
        }
        let sources = self.sources.as_deref().unwrap_or_default();
        let wcs = header_wcs(exposure).ok().flatten();
        let used = (exposure.size_px, config.photometry.clip_radius_px);
        if let Some(fit) = wcs.as_ref().and_then(|wcs| agreement(wcs, sources, used, stars, catalogue))
            && !fit.at_limit()
        {
            return Some(fit.scale_arcsec);
        }
        let field = exposure.object.as_ref().and_then(|name| Some((name.as_str(), *stars.fields.get(name)?)));
        let site = Some((&prepared.site, &prepared.eop));
        let positions = initial_pointings(exposure, field, wcs.as_ref(), site, &config.header.aliases);
        let solve = |scale_arcsec: f64, scale_search_frac: f64, radius_deg: f64, effort: Effort| {
            let search = Search { radius_deg, scale_arcsec, scale_search_frac, mirrored: None };
            let solution = solve_from_with(&positions, sources, exposure.size_px, sky, (search, effort)).ok()?;
            Some(solution.0.scale_arcsec)
        };
        let radius_deg = stars.solve_radius_deg;
        match reach {
            Reach::Near => {
                let configured = configured_arcsec(exposure, config);
                let stated = [wcs.map(|w| w.scale_arcsec()), nominal(exposure, config).map(|n| n.scale_arcsec)];
                let stated = stated.into_iter().flatten().filter(|s| !((s / configured - 1.0).abs() <= MOST_FRAC));
                std::iter::once(configured)
                    .chain(stated)
                    .find_map(|scale| solve(scale, stars.scale_search_frac, radius_deg, Effort::default()))
            }
            Reach::Wide => ladder(exposure)
                .into_iter()
                .find_map(|scale| solve(scale, LADDER_FRAC, radius_deg.min(SEARCHED_RADIUS_DEG), SEARCHED_EFFORT)),
        }
    }
}

/// Scales from the coarsest a frame may have to the finest \[arcsec/px\]: fewer stars bright enough come first.
fn ladder(exposure: &Exposure) -> Vec<f64> {
    let diagonal_px = (exposure.size_px.0 as f64).hypot(exposure.size_px.1 as f64).max(1.0);
    let (finest, coarsest) = (DIAGONALS_DEG.0 * 3600.0 / diagonal_px, DIAGONALS_DEG.1 * 3600.0 / diagonal_px);
    std::iter::successors(Some(coarsest), |scale| Some(scale / LADDER_STEP)).take_while(|s| *s > finest).collect()
}
