//! The zeropoint: its terms, their errors and covariance, what the stars say against every quantity, the error budget.
//!
//! V = V_inst − ZP − k X − C (B−V), V_inst of electrons per second. Stars without weight are open circles.

use maud::{Markup, html};

use super::parts::NightPage;
use super::parts::cell;
use super::parts::nothing;
use super::parts::number;
use super::parts::shown;
use super::parts::table;
use crate::base::stats::robust;
use crate::figures::zeropoint_charts;
use crate::tables::selection::is_used;
use crate::tables::{PhotometryRow, StarRow};
use crate::zeropoint::fit::Zeropoint;

/// The section.
pub(super) fn zeropoint(page: &NightPage) -> Markup {
    let Some(z) = &page.zeropoint else {
        return html! {
            (nothing("No zeropoint: magnitudes stay instrumental. Star pointings with a catalogue ([stars]), or zeropoint.previous, give one."))
        };
    };
    html! {
        (terms(z))
        @if page.stars.iter().any(|s| s.fit_residual_mag.is_some()) { (panels(z, &page.stars)) }
        @else { (nothing("No star of this night entered it: it is of another night.")) }
        (budget(page, z))
    }
}

fn terms(z: &Zeropoint) -> Markup {
    let errs: Vec<f64> = (0..4).map(|i| z.cov[i][i].max(0.0).sqrt()).collect();
    let correlation = |i: usize, j: usize| {
        let scale = errs[i] * errs[j];
        if scale > 0.0 { format!("{:+.2}", z.cov[i][j] / scale).replace('-', "−") } else { String::new() }
    };
    let named = [
        ("ZP [mag]", z.zp_mag, "fitted"),
        ("k [mag/airmass]", z.k_mag_airmass, z.k_note.as_str()),
        ("C [mag/mag]", z.c_mag_mag, z.c_note.as_str()),
    ];
    let rows: Vec<Vec<Markup>> = named
        .iter()
        .enumerate()
        .map(|(i, (name, value, note))| {
            let mut row = vec![cell(name), number(Some(*value), 4), number(Some(errs[i]), 4)];
            row.extend((0..3).map(|j| cell(correlation(i, j))));
            row.push(cell(note));
            row
        })
        .collect();
    let scaled = |i: usize, j: usize| cell(format!("{:.2}", 1e6 * z.cov[i][j]).replace('-', "−"));
    let covariance: Vec<Vec<Markup>> =
        (0..3).map(|i| [vec![cell(["ZP", "k", "C"][i])], (0..3).map(|j| scaled(i, j)).collect()].concat()).collect();
    html! {
        (table("", "Terms of the fit, with the correlations of their errors", &["term", "value", "error", "with ZP", "with k", "with C", "how"], &rows))
        p {
            "" @if z.n_stars > 0 { (z.n_words()) " used, " } @else { (z.n_used) " measurements used, " } (z.n_rejected) " without weight, " (z.n_pointings) " pointings, rms "
            (format!("{:.4}", z.rms_mag)) " mag"
            @if z.pointing_scatter_mag.is_finite() { ", pointings scatter by " (format!("{:.4}", z.pointing_scatter_mag)) " mag beyond their stars" }
            ", estimator " (z.estimator) "."
        }
        details { summary { "Covariance" } (table("", "Covariance of (ZP, k, C) [10⁻⁶ mag²]", &["", "ZP", "k", "C"], &covariance)) }
        @if !z.warnings.is_empty() { ul { @for w in &z.warnings { li { (w) } } } }
    }
}

fn panels(z: &Zeropoint, stars: &[StarRow]) -> Markup {
    let charts = zeropoint_charts(stars, (z.zp_mag, z.k_mag_airmass, z.c_mag_mag), (z.band_name(), &z.colour_name()));
    let left = stars.iter().filter(|s| s.fit_weight.is_none_or(|w| w <= 0.0)).count();
    html! {
        div.panels { @for (title, chart) in charts { figure { (shown(chart, &title)) } } }
        p.note { "Full: stars of the fit. Open: " (left) " measurements that are not in it; the reason of each is in stars.ecsv and in its tip." }
    }
}

/// What the error of a magnitude is made of, at the middle of the used frames.
fn budget(page: &NightPage, z: &Zeropoint) -> Markup {
    let used: Vec<&PhotometryRow> =
        page.rows.iter().filter(|r| is_used(&r.status, &r.verdict) && r.v_mag.is_some()).collect();
    let median = |of: fn(&PhotometryRow) -> Option<f64>| {
        robust(&used.iter().filter_map(|r| of(r)).collect::<Vec<_>>()).map(|m| m.0)
    };
    let Some(airmass) = median(|r| r.airmass) else { return html! {} };
    let b_v = if z.target_b_v_mag[0].is_finite() { z.target_b_v_mag } else { [0.65, 0.0] };
    let fit = z.err_mag(airmass, b_v[0], 0.0);
    let one = z.err_one_pointing_mag(airmass, b_v[0], 0.0);
    let part = |whole: f64, of: f64| (whole * whole - of * of).max(0.0).sqrt();
    let (scatter, colour) = (part(one, fit), part(z.err_mag(airmass, b_v[0], b_v[1]), fit));
    let night = median(|r| r.zp_extra_err_mag).unwrap_or(0.0);
    let (random, systematic) = (median(|r| r.v_mag_err), median(|r| r.v_mag_err_sys));
    let named = fit.hypot(scatter).hypot(colour).hypot(night);
    let rows = [
        ("counts, sky, read noise, trails (random)", random, "v_mag_err, median of the used frames"),
        ("zeropoint, extinction, colour term", Some(fit), "their covariance at this airmass and colour"),
        ("scatter of one line of sight", Some(scatter), "how pointings differ beyond their stars"),
        ("colour of the target", Some(colour), &format!("error of {} times C", z.colour_name())),
        ("zeropoint of another night", Some(night), "zp_extra_err_mag"),
        ("gain table, aperture correction", systematic.map(|s| part(s, named)), "what is left of v_mag_err_sys"),
        ("everything systematic", systematic, "v_mag_err_sys, median of the used frames"),
        ("one frame, in all", random.zip(systematic).map(|(r, s)| r.hypot(s)), "random and systematic in quadrature"),
    ];
    let rows: Vec<Vec<Markup>> =
        rows.iter().map(|(name, value, how)| vec![cell(name), number(*value, 4), cell(how)]).collect();
    html! {
        (table("", &format!("Error budget at airmass {airmass:.2}, {} {} [mag]", z.colour_name(), b_v[0]), &["part", "error", "from"], &rows))
    }
}
