//! How much air a ray crosses, and by how much air bends it.
//!
//! Radians in, airmasses (1 at the zenith) or radians out. Both laws are of the *apparent* altitude, while the rest of
//! the program gives geometric ones: [`airmass`] refracts first, which takes 0.05 airmass at 10° and 0.27 at 5°. The
//! laws themselves differ by 0.02 at 5° (Kasten & Young 10.040, Young 1994 10.059, Pickering 10.064) and by 0.006 at
//! 10°. Not included: the weather of the night, and aerosols, whose own airmass is larger near the horizon.

/// Pressure of the standard atmosphere at sea level \[hPa\]. Source: ISO 2533 (1975).
const SEA_LEVEL_HPA: f64 = 1_013.25;
/// Temperature taken at every site \[°C\], that of Bennett's law: 10 °C more or less change refraction by 3.5 %, which
/// is 0.01 airmass at 5° altitude.
const STANDARD_TEMPERATURE_C: f64 = 10.0;
/// Pressure of Bennett's law \[hPa\].
const BENNETT_HPA: f64 = 1_010.0;
/// Absolute zero \[°C\].
const ABSOLUTE_ZERO_C: f64 = -273.15;

/// Air at an observer, as far as it bends light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Atmosphere {
    /// Pressure \[hPa\].
    pub pressure_hpa: f64,
    /// Temperature \[°C\].
    pub temperature_c: f64,
}

impl Atmosphere {
    /// The standard atmosphere at a height above the sea \[m\], at 10 °C.
    ///
    /// `P = 1013.25 (1 − 2.25577·10⁻⁵ h)^5.25588` hPa, of the troposphere; 0 above 44 km.
    ///
    /// # Source
    /// ISO 2533 (1975).
    #[must_use]
    pub fn at_height_m(height_m: f64) -> Self {
        let share = (1.0 - 2.255_77e-5 * height_m).max(0.0);
        Self { pressure_hpa: SEA_LEVEL_HPA * share.powf(5.255_88), temperature_c: STANDARD_TEMPERATURE_C }
    }

    /// Refraction here over that of Bennett's air (1010 hPa, 10 °C): the density, `P/T`.
    fn density_ratio(&self) -> f64 {
        let kelvin = |c: f64| c - ABSOLUTE_ZERO_C;
        self.pressure_hpa / BENNETT_HPA * kelvin(STANDARD_TEMPERATURE_C) / kelvin(self.temperature_c)
    }
}

/// Airmass of Kasten & Young at a *geometric* altitude; `None` below the horizon.
///
/// `X = 1 / (sin h + 0.50572 (h° + 6.07995)^−1.6364)` with h the refracted altitude ([`apparent_altitude`]): 10.040 at
/// 5° geometric in standard air at sea level, 0.9997 at the zenith.
///
/// # Source
/// Kasten & Young 1989, Applied Optics 28, 4735; the law is of the apparent altitude.
#[must_use]
pub fn airmass(geometric_alt_rad: f64, atmosphere: &Atmosphere) -> Option<f64> {
    above_horizon_deg(geometric_alt_rad)?;
    kasten_young1989(apparent_altitude(geometric_alt_rad, atmosphere))
}

/// Airmass of Kasten & Young at an *apparent* altitude: 37.92 in the horizon; `None` below it.
#[must_use]
pub fn kasten_young1989(apparent_alt_rad: f64) -> Option<f64> {
    let h_deg = above_horizon_deg(apparent_alt_rad)?;
    // X = 1 / (sin h + 0.50572 (h + 6.07995°)^−1.6364)
    Some(1.0 / (apparent_alt_rad.sin() + 0.505_72 * (h_deg + 6.079_95).powf(-1.636_4)))
}

/// Airmass of Pickering at an *apparent* altitude; `None` below the horizon.
///
/// `X = 1 / sin(h° + 244 / (165 + 47 h°^1.1))`: 38.75 at the horizon.
///
/// # Source
/// Pickering 2002, DIO 12, 3 (note 39).
#[must_use]
pub fn airmass_pickering2002(apparent_alt_rad: f64) -> Option<f64> {
    let h_deg = above_horizon_deg(apparent_alt_rad)?;
    Some(1.0 / (h_deg + 244.0 / (165.0 + 47.0 * h_deg.powf(1.1))).to_radians().sin())
}

/// Refraction at an *apparent* altitude \[rad\], to subtract from it; zero below −1°.
///
/// `R = cot(h + 7.31/(h + 4.4))` arcmin for 1010 hPa and 10 °C, times the density of the air. Good to 0.07′ above the
/// horizon.
///
/// # Source
/// Bennett 1982, Journal of Navigation 35, 255.
#[must_use]
pub fn refraction_of_apparent(apparent_alt_rad: f64, atmosphere: &Atmosphere) -> f64 {
    let h_deg = apparent_alt_rad.to_degrees();
    if h_deg.is_nan() {
        return f64::NAN;
    }
    if h_deg < -1.0 {
        return 0.0;
    }
    let arg_deg = h_deg + 7.31 / (h_deg + 4.4);
    // The law crosses zero a hair before the zenith; air never bends a ray downwards.
    let bennett_rad = (1.0 / arg_deg.to_radians().tan() / 60.0).to_radians().max(0.0);
    bennett_rad * atmosphere.density_ratio()
}

/// Where a ray of a *geometric* altitude is seen \[rad\]: the altitude that, less its refraction, gives it back.
#[must_use]
pub fn apparent_altitude(geometric_alt_rad: f64, atmosphere: &Atmosphere) -> f64 {
    // Each round gains a factor of 5 in the horizon and of 100 at 10°.
    let mut apparent = geometric_alt_rad;
    for _ in 0..20 {
        let next = geometric_alt_rad + refraction_of_apparent(apparent, atmosphere);
        let moved = (next - apparent).abs();
        apparent = next;
        if moved < 1e-10 {
            break;
        }
    }
    apparent
}

fn above_horizon_deg(alt_rad: f64) -> Option<f64> {
    (alt_rad >= 0.0 && alt_rad.is_finite()).then(|| alt_rad.to_degrees())
}

#[cfg(test)]
mod tests {
    use super::*;

    const SEA_LEVEL: f64 = 0.0;

    fn standard() -> Atmosphere {
        Atmosphere::at_height_m(SEA_LEVEL)
    }

    /// Young 1994, Applied Optics 33, 1108: of the geometric zenith distance, an independent law.
    fn young1994(geometric_alt_rad: f64) -> f64 {
        let c = geometric_alt_rad.sin();
        (1.002_432 * c * c + 0.148_386 * c + 0.009_646_7)
            / (c.powi(3) + 0.149_864 * c * c + 0.010_296_3 * c + 0.000_303_978)
    }

    #[test]
    fn kasten_young_gives_its_published_end_points() {
        assert!((kasten_young1989(0.0).unwrap() - 37.92).abs() < 0.005);
        assert!((kasten_young1989(std::f64::consts::FRAC_PI_2).unwrap() - 0.9997).abs() < 5e-5);
        assert!((airmass(std::f64::consts::FRAC_PI_2, &standard()).unwrap() - 0.9997).abs() < 5e-5);
    }

    #[test]
    fn the_airmass_of_a_geometric_altitude_is_that_of_the_refracted_one() {
        let alt = 5f64.to_radians();
        let x = airmass(alt, &standard()).unwrap();
        assert!((x - 10.040).abs() < 0.002, "{x}");
        // without refraction the same law gives 10.306
        assert!((kasten_young1989(alt).unwrap() - 10.306).abs() < 0.001);
        // the law of geometric altitudes agrees to the spread of the laws, down to 3°
        for (h, spread) in [(3.0_f64, 0.06), (5.0, 0.025), (10.0, 0.006), (20.0, 0.003), (45.0, 5e-4), (90.0, 4e-4)] {
            let x = airmass(h.to_radians(), &standard()).unwrap();
            assert!((x - young1994(h.to_radians())).abs() < spread, "{h}: {x} {}", young1994(h.to_radians()));
        }
    }

    #[test]
    fn the_spread_between_the_laws_at_5_deg_is_the_documented_one() {
        let alt = 5f64.to_radians();
        assert!((young1994(alt) - 10.059).abs() < 0.002, "{}", young1994(alt));
        let pickering = airmass_pickering2002(apparent_altitude(alt, &standard())).unwrap();
        assert!((pickering - 10.064).abs() < 0.004, "{pickering}");
    }

    #[test]
    fn thin_air_bends_less() {
        let alt = 5f64.to_radians();
        let (low, high) = (standard(), Atmosphere::at_height_m(2_400.0));
        // ISO 2533: 756.3 hPa at 2400 m
        assert!((high.pressure_hpa - 756.3).abs() < 0.1, "{}", high.pressure_hpa);
        let lift = |a: &Atmosphere| apparent_altitude(alt, a) - alt;
        assert!((lift(&high) / lift(&low) - 0.746).abs() < 0.01, "{}", lift(&high) / lift(&low));
        assert!(airmass(alt, &high).unwrap() > airmass(alt, &low).unwrap() + 0.05);
        // a balloon at 45 km sees the geometric altitude
        assert_eq!(apparent_altitude(alt, &Atmosphere::at_height_m(45_000.0)), alt);
    }

    #[test]
    fn the_two_laws_agree_with_the_secant_high_up_and_with_each_other_low_down() {
        for h in [30.0_f64, 45.0, 60.0, 80.0] {
            let h_rad = h.to_radians();
            assert!((kasten_young1989(h_rad).unwrap() * h_rad.sin() - 1.0).abs() < 0.004, "{h}");
            assert!(
                (kasten_young1989(h_rad).unwrap() / airmass_pickering2002(h_rad).unwrap() - 1.0).abs() < 0.002,
                "{h}"
            );
        }
        assert!((airmass_pickering2002(0.0).unwrap() - 38.75).abs() < 0.01);
    }

    #[test]
    fn there_is_no_airmass_below_the_horizon() {
        let air = standard();
        assert!(airmass(-1e-9, &air).is_none() && airmass(f64::NAN, &air).is_none());
        assert!(airmass_pickering2002(-0.1).is_none() && kasten_young1989(-1e-9).is_none());
    }

    #[test]
    fn refraction_is_that_of_the_almanac_and_comes_back() {
        // Astronomical Almanac, 1010 hPa and 10 °C: 34.5′ in the apparent horizon, 29′ at a geometric 0°, 9.9′ at 5°,
        // 5.3′ at 10°.
        let air = Atmosphere { pressure_hpa: 1_010.0, temperature_c: 10.0 };
        let arcmin = |rad: f64| rad.to_degrees() * 60.0;
        for (h, r) in [(0.0_f64, 34.5), (5.0, 9.9), (10.0, 5.3), (45.0, 1.0)] {
            assert!((arcmin(refraction_of_apparent(h.to_radians(), &air)) - r).abs() < 0.1, "{h}");
        }
        assert!((arcmin(apparent_altitude(0.0, &air)) - 28.7).abs() < 0.5, "{}", arcmin(apparent_altitude(0.0, &air)));
        for h in [0.0_f64, 0.5, 5.0, 20.0, 70.0, 90.0] {
            let apparent = apparent_altitude(h.to_radians(), &air);
            let back = apparent - refraction_of_apparent(apparent, &air);
            assert!((back.to_degrees() - h).abs() < 1e-8, "{h}: {}", back.to_degrees());
        }
    }
}
