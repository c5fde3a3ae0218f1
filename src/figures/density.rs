//! How magnitudes are spread, for violins: Gaussian kernels of Silverman's width.
//!
//! Magnitudes in, shares of the densest place out. It does not cover every drawing.

/// Least width of the kernel \[mag\].
const KERNEL_MAG: f64 = 0.08;
/// Places between the ends of a violin.
const PLACES: usize = 40;

/// Fewer values than this are drawn as points: they do not say how they are spread.
pub(crate) const LEAST_VALUES: usize = 8;

/// Places \[mag\] from bright to faint and how dense the values are there, the densest 1; empty for fewer than
/// [`LEAST_VALUES`], which are drawn as points.
///
/// `d(m) = Σ exp(−(m − mᵢ)²/2h²)`, `h = max(1.06 σ n^(−1/5), 0.08 mag)` (Silverman 1986, eq. 3.28), cut at
/// the extremes of the values: nothing is drawn where nothing was measured.
pub(crate) fn density(v_mag: &[f64]) -> Vec<(f64, f64)> {
    let values: Vec<f64> = v_mag.iter().copied().filter(|v| v.is_finite()).collect();
    if values.len() < LEAST_VALUES {
        return Vec::new();
    }
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let sigma = (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
    let width = (1.06 * sigma * n.powf(-0.2)).max(KERNEL_MAG);
    let low = values.iter().copied().fold(f64::INFINITY, f64::min);
    let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let at = |v: f64| values.iter().map(|x| (-0.5 * ((v - x) / width).powi(2)).exp()).sum::<f64>();
    if low == high {
        // equal values have no extent: the kernel's own half width, so that there is something to see
        return vec![(low - 0.5 * KERNEL_MAG, 1.0), (high + 0.5 * KERNEL_MAG, 1.0)];
    }
    let places: Vec<(f64, f64)> = (0..=PLACES)
        .map(|i| if i == PLACES { high } else { low + (high - low) * i as f64 / PLACES as f64 })
        .map(|v| (v, at(v)))
        .collect();
    let most = places.iter().map(|p| p.1).fold(0.0, f64::max);
    places.into_iter().map(|(v, d)| (v, d / most)).collect()
}

#[cfg(test)]
mod tests {
    use super::density;

    #[test]
    fn two_clumps_are_two_bulges_and_the_thicker_clump_is_the_wider_bulge() {
        // enough values for a kernel of a fifth of the way between the clumps
        let mut v: Vec<f64> = (0..40).map(|i| 10.0 + 1e-3 * f64::from(i)).collect();
        v.extend((0..20).map(|i| 12.0 + 1e-3 * f64::from(i)));
        let places = density(&v);
        let at = |m: f64| places.iter().min_by(|a, b| (a.0 - m).abs().total_cmp(&(b.0 - m).abs())).unwrap().1;
        assert!(at(10.0) > at(12.0) && at(12.0) > at(11.0), "{places:?}");
        assert!(places.iter().all(|p| (0.0..=1.0).contains(&p.1)));
        assert!((places[0].0, places[places.len() - 1].0) == (v[0], v[59]), "cut at the extremes");
    }

    #[test]
    fn seven_values_are_no_density_and_equal_ones_are_narrow_but_not_nothing() {
        let seven = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];
        assert!(density(&seven).is_empty() && density(&[&seven[..], &[f64::NAN]].concat()).is_empty());
        assert!(!density(&[&seven[..], &[8.0]].concat()).is_empty());
        let places = density(&[5.0; 8]);
        assert_eq!(places, [(4.96, 1.0), (5.04, 1.0)]);
    }
}
