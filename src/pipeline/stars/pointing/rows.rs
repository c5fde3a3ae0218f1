//! From the stars of member frames to the rows of the table: one frame by itself, or the median of a pointing.
//!
//! Electrons per second, magnitudes of them; `inst_mag` is of the star's whole light where a profile is known.

use super::member::Member;
use super::member::MemberStar;
use crate::astrometry::catalogue::Catalogue;
use crate::base::constants::MAG_PER_LN;
use crate::base::stats::{median, median_variance_factor};
use crate::base::time::{iso_utc, mjd_utc};
use crate::photometry::Flags;
use crate::tables::StarRow;

/// A rate \[e⁻/s\]: within the aperture, its error, and corrected to the whole light of the star.
struct Rate {
    value: f64,
    err: f64,
    whole: f64,
}

/// Factor from the light in a star's aperture to its whole light; 1 where the profile is not known.
///
/// Its error is common to the stars of a frame and nearly the same for all frames: it moves the zeropoint and the
/// target together, and is not part of a star's own error.
fn to_whole_light(member: &Member, star: &MemberStar) -> f64 {
    let [r_px, inner_px, outer_px] = member.radii_px;
    let flux = &star.flux;
    let mag = member.profile.map_or(0.0, |profile| {
        profile.star_correction_mag(member.fwhm_px, r_px, (inner_px, outer_px), flux.flux_e, flux.sky_rms_e)
    });
    10f64.powf(-0.4 * mag)
}

/// One row per star of a single member.
#[must_use]
pub fn single_rows(member: &Member, pointing: usize, catalogue: &Catalogue) -> Vec<StarRow> {
    member
        .stars
        .iter()
        .map(|star| {
            let value = star.flux.flux_e / member.exptime_s;
            let rate = Rate {
                value,
                err: star.flux.flux_err_e / member.exptime_s,
                whole: value * to_whole_light(member, star),
            };
            row(pointing, &[member], &[star], &rate, catalogue)
        })
        .collect()
}

/// One row per star of a pointing: the median of the members' electrons per second.
///
/// Var(median) = c(n) n / (Σ 1/σᵢ)², c(n) the variance of the median of n Gaussians relative to their mean (→ π/2);
/// for equal σ this is c(n) σ²/n. Flags of all members are kept, so a star saturated in one member is flagged.
/// Stars missing in more than half of the members are excluded.
#[must_use]
pub fn combined_rows(members: &[Member], pointing: usize, catalogue: &Catalogue) -> Vec<StarRow> {
    let mut indices: Vec<usize> = members.iter().flat_map(|m| m.stars.iter().map(|s| s.index)).collect();
    indices.sort_unstable();
    indices.dedup();
    indices
        .into_iter()
        .filter_map(|index| {
            let found: Vec<(usize, &MemberStar)> = members
                .iter()
                .enumerate()
                .filter_map(|(k, m)| {
                    let at = m.stars.binary_search_by_key(&index, |s| s.index).ok()?;
                    m.stars[at].flux.flux_e.is_finite().then_some((k, &m.stars[at]))
                })
                .collect();
            if 2 * found.len() < members.len() || found.is_empty() {
                return None;
            }
            let used: Vec<&Member> = found.iter().map(|(k, _)| &members[*k]).collect();
            let stars: Vec<&MemberStar> = found.iter().map(|(_, s)| *s).collect();
            let mut rates: Vec<f64> = used.iter().zip(&stars).map(|(m, s)| s.flux.flux_e / m.exptime_s).collect();
            let inverse: f64 = used.iter().zip(&stars).map(|(m, s)| m.exptime_s / s.flux.flux_err_e).sum();
            // each frame's own seeing is taken out before the median is taken
            let mut whole: Vec<f64> =
                rates.iter().zip(used.iter().zip(&stars)).map(|(rate, (m, s))| rate * to_whole_light(m, s)).collect();
            let n = rates.len();
            let err = (median_variance_factor(n) * n as f64).sqrt() / inverse;
            let rate = Rate { value: median(&mut rates)?, err, whole: median(&mut whole)? };
            Some(row(pointing, &used, &stars, &rate, catalogue))
        })
        .collect()
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, n) = values.fold((0.0, 0usize), |(s, n), v| (s + v, n + 1));
    sum / n.max(1) as f64
}

/// The row of a star measured in `members`.
fn row(pointing: usize, members: &[&Member], stars: &[&MemberStar], rate: &Rate, catalogue: &Catalogue) -> StarRow {
    let (first, entry) = (members[0], &catalogue.stars[stars[0].index]);
    let exptime_s = mean(members.iter().map(|m| m.exptime_s));
    let t0 = first.mid;
    let mid = t0 + hifitime::Unit::Second * mean(members.iter().map(|m| (m.mid - t0).to_seconds()));
    let mut flags = stars.iter().fold(Flags::default(), |f, s| f | s.flux.flags);
    if members.iter().any(|m| !m.flat) {
        flags.set(Flags::NO_FLAT);
    }
    let airmasses: Option<Vec<f64>> = stars.iter().map(|s| s.airmass).collect();
    let same = |f: fn(&Member) -> f64| members.iter().all(|m| f(m) == f(first)).then(|| f(first));
    // of an even number of members near zero light the one may be positive and the other not
    let positive = [rate.value, rate.whole].iter().all(|r| *r > 0.0 && r.is_finite());
    let corrected = positive && members.iter().any(|m| m.profile.is_some());
    let match_px: Vec<f64> = stars.iter().filter_map(|s| s.match_px).collect();
    let detected = 2 * match_px.len() > stars.len() || (match_px.len() == stars.len());
    let full_well = |m: &Member, s: &MemberStar| {
        let well_e = (m.gain.saturation_adu - m.gain.pedestal_adu) * m.gain.e_per_adu.0;
        (s.flux.peak_e + s.flux.sky_e_px) / well_e
    };
    let peak = members.iter().zip(stars).map(|(m, s)| full_well(m, s)).filter(|p| p.is_finite()).fold(0.0, f64::max);
    StarRow {
        frame: first.frame.clone(),
        n_members: Some(members.len() as i64),
        pointing: Some(pointing as i64),
        object_name: first.object.clone(),
        star_id: entry.id.clone(),
        ra_deg: Some(entry.ra_deg),
        dec_deg: Some(entry.dec_deg),
        date_mid: iso_utc(mid, 6),
        mjd_mid_d: Some(mjd_utc(mid)),
        exptime_s: Some(exptime_s),
        gain_setting: members
            .iter()
            .all(|m| m.gain.setting == first.gain.setting)
            .then_some(first.gain.setting)
            .flatten()
            .map(|g| g.0),
        e_per_adu: same(|m| m.gain.e_per_adu.0),
        x_px: Some(stars[0].x_px),
        y_px: Some(stars[0].y_px),
        aper_r_px: Some(mean(members.iter().map(|m| m.radii_px[0]))),
        sky_in_px: Some(mean(members.iter().map(|m| m.radii_px[1]))),
        sky_out_px: Some(mean(members.iter().map(|m| m.radii_px[2]))),
        fwhm_px: Some(mean(members.iter().map(|m| m.fwhm_px))),
        flux_e: Some(rate.value * exptime_s).filter(|f| f.is_finite()),
        flux_err_e: Some(rate.err * exptime_s).filter(|f| f.is_finite()),
        sky_e_px: Some(mean(stars.iter().map(|s| s.flux.sky_e_px))).filter(|f| f.is_finite()),
        snr: Some(rate.value / rate.err).filter(|f| f.is_finite()),
        peak_frac_sat: Some(peak),
        aper_corr_mag: corrected.then(|| -2.5 * (rate.whole / rate.value).log10()),
        inst_mag: positive.then(|| -2.5 * rate.whole.log10()),
        inst_mag_err: positive.then(|| MAG_PER_LN * rate.err / rate.value),
        alt_deg: Some(mean(stars.iter().map(|s| s.alt_rad)).to_degrees()),
        az_deg: Some(stars[0].az_rad.to_degrees()),
        airmass: airmasses.map(|a| mean(a.into_iter())),
        catalogue_v_mag: Some(entry.v_mag),
        catalogue_v_mag_err: entry.v_err_mag,
        catalogue_b_v_mag: entry.b_v_mag,
        catalogue_b_v_mag_err: entry.b_v_err_mag,
        match_arcsec: detected.then(|| mean(match_px.iter().copied()) * first.scale_arcsec),
        flags: flags.0,
        ..StarRow::default()
    }
}
