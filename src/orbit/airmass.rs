//! How much air a ray crosses, and by how much air bends it.
//!
//! Radians in, airmasses (1 at the zenith) or radians out. Standard air; both laws are of the *apparent* altitude, and
//! the rest of the room gives geometric ones: 0.01 airmass at 10° altitude, nothing above 20°.

/// Airmass of Kasten & Young; `None` below the horizon.
///
/// `X = 1 / (sin h + 0.50572 (h° + 6.07995)^−1.6364)`: 37.92 at the horizon, 0.9997 at the zenith.
///
/// # Source
/// Kasten & Young 1989, Applied Optics 28, 4735.
#[must_use]
pub fn airmass(alt_rad: f64) -> Option<f64> {
    let h_deg = above_horizon_deg(alt_rad)?;
    // X = 1 / (sin h + 0.50572 (h + 6.07995°)^−1.6364)
    Some(1.0 / (alt_rad.sin() + 0.505_72 * (h_deg + 6.079_95).powf(-1.636_4)))
}

/// Airmass of Pickering; `None` below the horizon.
///
/// `X = 1 / sin(h° + 244 / (165 + 47 h°^1.1))`: 38.75 at the horizon.
///
/// # Source
/// Pickering 2002, DIO 12, 3 (note 39).
#[must_use]
pub fn airmass_pickering2002(alt_rad: f64) -> Option<f64> {
    let h_deg = above_horizon_deg(alt_rad)?;
    Some(1.0 / (h_deg + 244.0 / (165.0 + 47.0 * h_deg.powf(1.1))).to_radians().sin())
}

/// Refraction at an *apparent* altitude \[rad\], to subtract from it; zero below −1°.
///
/// `R = cot(h + 7.31/(h + 4.4))` arcmin, for 1010 hPa and 10 °C. Good to 0.07′ above the horizon.
///
/// # Source
/// Bennett 1982, Journal of Navigation 35, 255.
#[must_use]
pub fn refraction_of_apparent(alt_rad: f64) -> f64 {
    let h_deg = alt_rad.to_degrees();
    let arg_deg = h_deg + 7.31 / (h_deg + 4.4);
    arcmin_cot(h_deg, arg_deg)
}

/// Refraction at a *geometric* altitude \[rad\], to add to it; zero below −1°.
///
/// `R = 1.02 cot(h + 10.3/(h + 5.11))` arcmin, for 1010 hPa and 10 °C: the inverse of Bennett to 0.1′.
///
/// # Source
/// Saemundsson 1986, Sky & Telescope 72, 70.
#[must_use]
pub fn refraction_of_geometric(alt_rad: f64) -> f64 {
    let h_deg = alt_rad.to_degrees();
    let arg_deg = h_deg + 10.3 / (h_deg + 5.11);
    1.02 * arcmin_cot(h_deg, arg_deg)
}

fn arcmin_cot(h_deg: f64, arg_deg: f64) -> f64 {
    if h_deg.is_nan() {
        return f64::NAN;
    }
    if h_deg < -1.0 {
        return 0.0;
    }
    // Both laws cross zero a hair before the zenith; air never bends a ray downwards.
    (1.0 / arg_deg.to_radians().tan() / 60.0).to_radians().max(0.0)
}

fn above_horizon_deg(alt_rad: f64) -> Option<f64> {
    (alt_rad >= 0.0 && alt_rad.is_finite()).then(|| alt_rad.to_degrees())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kasten_young_gives_its_published_end_points() {
        assert!((airmass(0.0).unwrap() - 37.92).abs() < 0.005);
        assert!((airmass(std::f64::consts::FRAC_PI_2).unwrap() - 0.9997).abs() < 5e-5);
    }

    #[test]
    fn the_two_laws_agree_with_the_secant_high_up_and_with_each_other_low_down() {
        for h in [30.0_f64, 45.0, 60.0, 80.0] {
            let h_rad = h.to_radians();
            assert!((airmass(h_rad).unwrap() * h_rad.sin() - 1.0).abs() < 0.004, "{h}");
            assert!((airmass(h_rad).unwrap() / airmass_pickering2002(h_rad).unwrap() - 1.0).abs() < 0.002, "{h}");
        }
        assert!((airmass_pickering2002(0.0).unwrap() - 38.75).abs() < 0.01);
    }

    #[test]
    fn there_is_no_airmass_below_the_horizon() {
        assert!(airmass(-1e-9).is_none() && airmass(f64::NAN).is_none() && airmass_pickering2002(-0.1).is_none());
    }

    #[test]
    fn refraction_there_and_back_returns_the_altitude() {
        for h in [0.5_f64, 5.0, 20.0, 70.0, 90.0] {
            let apparent = h.to_radians() + refraction_of_geometric(h.to_radians());
            let back = apparent - refraction_of_apparent(apparent);
            // The authors give 0.1′ for the pair, 0.3′ near the horizon.
            assert!((back.to_degrees() - h).abs() * 60.0 < 0.3, "{h}: {}", back.to_degrees());
        }
        assert!((refraction_of_apparent(0.0).to_degrees() * 60.0 - 34.5).abs() < 0.1);
    }
}
