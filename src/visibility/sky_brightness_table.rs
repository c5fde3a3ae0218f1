//! The brightness of the sky by the Moon's age alone, as exposure calculators take it, and its colour.
//!
//! mag/arcsec² near the zenith, averaged over where the Moon may stand: V in Vega, g, r, i in AB. Real skies with the Moon up
//! are up to 1 mag brighter at half Moon (Patat 2003, A&A 400, 1183): [`super::sky_brightness`] knows where it stands.

use crate::base::error::{Error, Result};

/// Days from new Moon of the table; the last is full Moon.
const DAYS: [f64; 5] = [0.0, 3.0, 7.0, 10.0, 14.0];
/// Days from new Moon to full Moon: half a synodic month.
const NEW_TO_FULL_DAYS: f64 = 14.765;

/// V: Walker 1987, NOAO Newsletter 10, 16 (Cerro Tololo). g and r: the DECam exposure time calculator, version 7, as
/// Gunagala's performance.yaml has it (the paper's 19.4 is its g of full Moon). i: Walker's R and I turned into i by the
/// transformation of Lupton 2005 (SDSS).
const TABLE: [(&str, [f64; 5]); 4] = [
    ("V", [21.8, 21.7, 21.4, 20.7, 20.0]),
    ("g", [22.1, 21.8, 21.2, 20.4, 19.4]),
    ("r", [21.1, 20.9, 20.6, 20.2, 19.7]),
    ("i", [20.5, 20.5, 20.3, 20.0, 19.7]),
];

/// The sky \[mag/arcsec²\] of a band (`V`, `g`, `r`, `i`) at a phase angle of the Moon \[deg\] of either sign, 0 = full.
///
/// Straight lines in the days from new Moon, `(1 − |α|/180°) · 14.765 d`; from 14 days on that of full Moon.
///
/// # Errors
/// [`Error::Model`] for another band, and for a phase beyond ±180°.
pub fn sky_at_moon_phase(band: &str, phase_deg: f64) -> Result<f64> {
    let sky = column(band)?;
    if !(phase_deg.abs() <= 180.0) {
        return Err(Error::Model { problem: format!("the Moon's phase {phase_deg} deg is outside -180 to 180") });
    }
    Ok(between(&DAYS, sky, (1.0 - phase_deg.abs() / 180.0) * NEW_TO_FULL_DAYS))
}

/// The sky in a band where V is known: the table's colour at that V; beyond the table the colour of its end.
///
/// # Errors
/// [`Error::Argument`] for a band that is not in the table.
pub fn sky_of_v(band: &str, v_mag_arcsec2: f64) -> Result<f64> {
    let (v, sky) = (column("V")?, column(band)?);
    let (mut rising, mut colour) = (*v, [0.0; 5]);
    for (k, c) in colour.iter_mut().enumerate() {
        *c = sky[4 - k] - v[4 - k];
        rising[k] = v[4 - k];
    }
    Ok(v_mag_arcsec2 + between(&rising, &colour, v_mag_arcsec2))
}

fn column(band: &str) -> Result<&'static [f64; 5]> {
    TABLE.iter().find(|row| row.0 == band).map(|row| &row.1).ok_or_else(|| Error::Argument {
        name: "band".into(),
        problem: format!("\"{band}\": the brightness of the sky is known in V, g, r, i only; give it itself"),
    })
}

/// Straight lines through the points, the end values beyond them.
fn between(x: &[f64; 5], y: &[f64; 5], at: f64) -> f64 {
    let k = x.partition_point(|x| *x <= at).clamp(1, 4);
    let share = ((at - x[k - 1]) / (x[k] - x[k - 1])).clamp(0.0, 1.0);
    y[k - 1] * (1.0 - share) + y[k] * share
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sky_of_full_and_new_moon_is_that_of_the_calculator_of_the_paper() {
        assert_eq!(sky_at_moon_phase("g", 0.0).unwrap(), 19.4);
        assert_eq!(sky_at_moon_phase("g", 180.0).unwrap(), 22.1);
        assert_eq!(sky_at_moon_phase("V", -180.0).unwrap(), 21.8);
        // 7 days from new Moon are 94.66° of phase
        let seven = 180.0 * (1.0 - 7.0 / NEW_TO_FULL_DAYS);
        assert!((sky_at_moon_phase("r", seven).unwrap() - 20.6).abs() < 1e-12);
    }

    #[test]
    fn the_sky_brightens_towards_full_moon_in_every_band() {
        for (band, _) in TABLE {
            let sky: Vec<f64> = (0..=180).map(|deg| sky_at_moon_phase(band, f64::from(deg)).unwrap()).collect();
            assert!(sky.windows(2).all(|w| w[0] <= w[1] + 1e-12), "{band}"); // rounding where the table is flat
        }
    }

    #[test]
    fn i_is_the_transformation_of_walkers_r_and_i() {
        // Lupton 2005: R = r − 0.2936 (r−i) − 0.1439, I = r − 1.2444 (r−i) − 0.3820
        let walker = [(20.9, 19.9), (20.8, 19.9), (20.6, 19.7), (20.3, 19.5), (19.9, 19.2)];
        for ((big_r, big_i), i) in walker.into_iter().zip(column("i").unwrap()) {
            let r_i: f64 = (big_r - big_i - 0.3820 + 0.1439) / (1.2444 - 0.2936);
            let r = big_r + 0.2936 * r_i + 0.1439;
            assert!((r - r_i - i).abs() < 0.051, "{i}"); // the table has one decimal
        }
    }

    #[test]
    fn at_the_tables_own_v_every_band_is_its_own() {
        for (band, sky) in TABLE {
            for (v, expected) in column("V").unwrap().iter().zip(sky) {
                assert!((sky_of_v(band, *v).unwrap() - expected).abs() < 1e-12, "{band} {v}");
            }
        }
        assert!((sky_of_v("g", 17.0).unwrap() - 16.4).abs() < 1e-12); // the colour of full Moon
    }

    #[test]
    fn other_bands_and_phases_are_refused_by_name() {
        assert!(sky_at_moon_phase("K", 0.0).unwrap_err().to_string().contains("\"K\""));
        assert!(sky_at_moon_phase("V", 181.0).is_err() && sky_at_moon_phase("V", f64::NAN).is_err());
    }
}
