//! The same verdict from observations: the share of magnitudes brighter than a limit, with those that are only limits themselves.
//!
//! The share is Kaplan and Meier's, a non-detection being fainter than its limit; its interval is Wilson's for as many trials as there
//! are passes, since magnitudes of one pass are not independent. It does not weigh places of the sky by how often they occur.

use crate::tables::ComplianceRow;

use super::limits::BrightnessLimit;
use super::statistics::{BRIGHTEST_FRAC, quantile};

/// One observation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Magnitude {
    /// Magnitude, or the limit than which it is fainter.
    pub v_mag: f64,
    /// Whether it is a limit.
    pub is_limit: bool,
    /// Number of its pass.
    pub pass: usize,
}

/// Share of magnitudes brighter than `v_mag`: `1 − Π (1 − d_i/n_i)` over the magnitudes brighter than it, n_i what is neither brighter
/// nor censored before.
fn kaplan_meier(sorted: &[Magnitude], v_mag: f64) -> f64 {
    let n = sorted.len();
    let brighter = sorted.iter().enumerate().take_while(|(_, m)| m.v_mag < v_mag);
    let fainter: f64 = brighter.filter(|(_, m)| !m.is_limit).map(|(i, _)| 1.0 - 1.0 / (n - i) as f64).product();
    1.0 - fainter
}

/// Wilson's 68 % interval of a share of n trials: `(p + z²/2n ± z sqrt(p(1 − p)/n + z²/4n²))/(1 + z²/n)`, z = 1.
fn wilson(share: f64, n: f64) -> [f64; 2] {
    let middle = share + 0.5 / n;
    let half = (share * (1.0 - share) / n + 0.25 / (n * n)).sqrt();
    [-1.0, 1.0].map(|sign| ((middle + sign * half) / (1.0 + 1.0 / n)).clamp(0.0, 1.0))
}

/// The row of a limit.
#[must_use]
pub fn observed_row(magnitudes: &[Magnitude], limit: &BrightnessLimit) -> ComplianceRow {
    let mut sorted = magnitudes.to_vec();
    // a limit is fainter than a magnitude of the same value
    sorted.sort_by(|a, b| a.v_mag.total_cmp(&b.v_mag).then(a.is_limit.cmp(&b.is_limit)));
    let seen: Vec<f64> = sorted.iter().filter(|m| !m.is_limit).map(|m| m.v_mag).collect();
    let mut passes: Vec<usize> = sorted.iter().map(|m| m.pass).collect();
    passes.sort_unstable();
    passes.dedup();
    let share = (!sorted.is_empty()).then(|| kaplan_meier(&sorted, limit.v_mag));
    let interval = share.map(|share| wilson(share, passes.len() as f64));
    let v_p05_mag = quantile(&seen, BRIGHTEST_FRAC);
    let censored = sorted.len() - seen.len();
    ComplianceRow {
        of: "observations".into(),
        variant: "as observed".into(),
        rule: limit.name.clone(),
        limit_v_mag: limit.v_mag,
        n: sorted.len() as i64,
        n_lit: seen.len() as i64,
        n_passes: Some(passes.len() as i64),
        brighter_frac: share,
        brighter_p16_frac: interval.map(|i| i[0]),
        brighter_p84_frac: interval.map(|i| i[1]),
        lit_brighter_frac: share.filter(|_| censored == 0),
        mean_v_mag: (!seen.is_empty() && censored == 0).then(|| seen.iter().sum::<f64>() / seen.len() as f64),
        v_p05_mag,
        brightest_v_mag: seen.first().copied(),
        margin_mag: v_p05_mag.map(|v| v - limit.v_mag),
        note: if censored > 0 { format!("{censored} limits: no mean") } else { String::new() },
        ..ComplianceRow::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(v_mag: f64, is_limit: bool, pass: usize) -> Magnitude {
        Magnitude { v_mag, is_limit, pass }
    }

    #[test]
    fn without_limits_the_share_is_a_count_and_with_them_kaplan_and_meiers() {
        let plain: Vec<Magnitude> = (0..10).map(|i| of(5.0 + 0.5 * f64::from(i), false, i as usize)).collect();
        let limit = |v_mag| BrightnessLimit { name: "x".into(), v_mag };
        assert!((observed_row(&plain, &limit(7.0)).brighter_frac.unwrap() - 0.4).abs() < 1e-12);
        // the classic: 6+, 6, 6, 6, 7, 9+, 10, 10+, 11+, 13, 16, 17+, 19+, 20+, 22, 23, 25+, 32+, 32+, 34+, 35+ (6-MP, Freireich
        // et al. 1963): S(6) = 0.857, S(10) = 0.753, S(16) = 0.627, S(23) = 0.448
        let times = [
            (6, true),
            (6, false),
            (6, false),
            (6, false),
            (7, false),
            (9, true),
            (10, false),
            (10, true),
            (11, true),
            (13, false),
            (16, false),
            (17, true),
            (19, true),
            (20, true),
            (22, false),
            (23, false),
            (25, true),
            (32, true),
            (32, true),
            (34, true),
            (35, true),
        ];
        let classic: Vec<Magnitude> =
            times.iter().enumerate().map(|(i, (t, is_limit))| of(f64::from(*t), *is_limit, i)).collect();
        for (t, survival) in [(6.5, 0.857), (10.5, 0.753), (16.5, 0.627), (23.5, 0.448)] {
            let share = observed_row(&classic, &limit(t)).brighter_frac.unwrap();
            assert!((1.0 - share - survival).abs() < 5e-4, "{t}: {share}");
        }
    }

    #[test]
    fn the_interval_is_wilsons_by_passes_and_holds_where_all_or_none_are_bright() {
        // 50 of 100: 0.45 to 0.55; 0 of 10: 0 to 1/11
        let [low, high] = wilson(0.5, 100.0);
        assert!((low - 0.450_249).abs() < 1e-4 && (high - 0.549_751).abs() < 1e-4, "{low} {high}");
        let [low, high] = wilson(0.0, 10.0);
        assert!(low == 0.0 && (high - 1.0 / 11.0).abs() < 1e-12);
        // a hundred magnitudes of one pass are one trial
        let one: Vec<Magnitude> = (0..100).map(|_| of(6.0, false, 0)).collect();
        let row = observed_row(&one, &BrightnessLimit { name: "x".into(), v_mag: 7.0 });
        assert_eq!((row.n_passes, row.brighter_frac), (Some(1), Some(1.0)));
        assert!((row.brighter_p16_frac.unwrap() - 0.5).abs() < 1e-12, "{row:?}");
    }
}
