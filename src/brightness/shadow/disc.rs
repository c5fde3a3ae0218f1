//! Two discs in the sky: how much of one the other covers.
//!
//! Angles in rad. Uniform discs: no limb darkening.

/// Share of a disc of angular radius `disc_rad` left visible by one of `cover_rad` at separation `sep_rad`, 0 to 1.
///
/// `1 − overlap/(πa²)` of two discs in a plane: within 5e-4 of the caps on the sphere for covers of 20° to 75°.
/// Continuous; with the cover inside the disc (annular) `1 − (b/a)²`.
#[must_use]
pub fn visible_fraction(disc_rad: f64, cover_rad: f64, sep_rad: f64) -> f64 {
    let (a, b, c) = (disc_rad, cover_rad, sep_rad);
    if c >= a + b {
        return 1.0;
    }
    if c <= b - a {
        return 0.0;
    }
    if c <= a - b {
        return 1.0 - (b / a) * (b / a);
    }
    // with x the distance of the chord from the disc's centre, y half its length:
    // overlap = a² acos(x/a) + b² acos((c−x)/b) − c y
    let x = ((c * c + (a - b) * (a + b)) / (2.0 * c)).clamp(-a, a);
    let y = ((a - x) * (a + x)).max(0.0).sqrt();
    // b² acos((c−x)/b) − (c−x) y: the cover's segment, from its half angle to keep digits when it is shallow
    let half = y.atan2(c - x);
    let segment = b * b * (half - half.sin() * half.cos());
    let overlap = a * a * (x / a).acos() - x * y + segment;
    (1.0 - overlap / (std::f64::consts::PI * a * a)).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SUN_RAD: f64 = 0.266_453_107_246_155_7 / 57.295_779_513_082_32;

    #[test]
    fn the_fraction_is_half_at_the_limb_and_annular_far_out() {
        let b = 69.743_727_418_533_2_f64.to_radians();
        assert!((visible_fraction(SUN_RAD, b, b) - 0.500_405_363_585_874_6).abs() < 1e-6);
        let [a, b, c] = [0.2666_f64, 0.2, 0.01].map(f64::to_radians);
        assert!((visible_fraction(a, b, c) - 0.437_218_644_496_082_7).abs() < 1e-9);
    }

    #[test]
    fn the_penumbra_is_monotone_and_continuous() {
        for b in [0.05_f64, 8.7, 20.0, 70.0].map(f64::to_radians) {
            let steps = 20_000;
            let at = |j: i32| {
                let past_limb = 1.2 * SUN_RAD * (2.0 * f64::from(j) / f64::from(steps) - 1.0);
                visible_fraction(SUN_RAD, b, (b + past_limb).max(0.0))
            };
            let mut before = at(0);
            for j in 1..=steps {
                let now = at(j);
                // the steepest slope is 2/(πa) per radian
                assert!(now >= before - 1e-9 && now - before < 1.2 * 2.0 / f64::from(steps), "{b} {j}: {before} {now}");
                before = now;
            }
            assert_eq!(before, 1.0);
        }
    }
}
