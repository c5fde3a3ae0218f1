//! The local horizon: what hides the sky at each azimuth.
//!
//! Radians, azimuth from north through east. Between the azimuths that are given the altitude is interpolated linearly. It does not cover
//! what moves, such as a dome.

use std::f64::consts::TAU;

use crate::base::error::{Error, Result};

/// The altitude of what stands around a telescope; a flat one at 0 by default.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LocalHorizon {
    /// Azimuth, 0 to 2π in rising order, and altitude \[rad\].
    points: Vec<[f64; 2]>,
}

impl LocalHorizon {
    /// Of azimuths and altitudes in degrees, in any order.
    ///
    /// # Errors
    /// [`Error::Argument`] for an azimuth outside −360 to 360, an altitude outside 0 to 90, or an azimuth that is given twice.
    pub fn from_degrees(points: &[[f64; 2]]) -> Result<Self> {
        let refuse = |problem| Err(Error::Argument { name: "horizon".into(), problem });
        for [az_deg, alt_deg] in points {
            if !(-360.0..=360.0).contains(az_deg) {
                return refuse(format!("azimuth {az_deg} deg is outside -360 to 360"));
            }
            if !(0.0..=90.0).contains(alt_deg) {
                return refuse(format!("altitude {alt_deg} deg at azimuth {az_deg} is outside 0 to 90"));
            }
        }
        let mut points: Vec<[f64; 2]> =
            points.iter().map(|[az, alt]| [az.rem_euclid(360.0).to_radians(), alt.to_radians()]).collect();
        points.sort_by(|a, b| a[0].total_cmp(&b[0]));
        match points.windows(2).find(|pair| pair[0][0] == pair[1][0]) {
            Some(pair) => refuse(format!("azimuth {} deg is given twice", pair[0][0].to_degrees())),
            None => Ok(Self { points }),
        }
    }

    /// Its altitude at an azimuth \[rad\].
    #[must_use]
    pub fn alt_rad(&self, az_rad: f64) -> f64 {
        let (Some(first), Some(last)) = (self.points.first(), self.points.last()) else { return 0.0 };
        let az = az_rad.rem_euclid(TAU);
        let next = self.points.partition_point(|[at, _]| *at <= az);
        let before = next.checked_sub(1).map_or([last[0] - TAU, last[1]], |i| self.points[i]);
        let after = self.points.get(next).copied().unwrap_or([first[0] + TAU, first[1]]);
        before[1] + (after[1] - before[1]) * (az - before[0]) / (after[0] - before[0])
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn altitudes_are_interpolated_all_around() {
        let horizon = LocalHorizon::from_degrees(&[[270.0, 10.0], [-270.0, 40.0], [180.0, 20.0]]).unwrap();
        let alt = |az: f64| horizon.alt_rad(az.to_radians()).to_degrees();
        for (az, expected) in
            [(90.0, 40.0), (135.0, 30.0), (180.0, 20.0), (225.0, 15.0), (0.0, 25.0), (360.0, 25.0), (450.0, 40.0)]
        {
            assert!((alt(az) - expected).abs() < 1e-9, "{az}: {}", alt(az));
        }
        assert_eq!(LocalHorizon::default().alt_rad(1.0), 0.0);
        let one = LocalHorizon::from_degrees(&[[90.0, 15.0]]).unwrap();
        assert!((one.alt_rad(4.0).to_degrees() - 15.0).abs() < 1e-12);
    }

    #[test]
    fn what_is_no_horizon_is_refused() {
        for (points, word) in [
            ([[400.0, 1.0], [0.0, 0.0]], "400"),
            ([[0.0, 91.0], [1.0, 0.0]], "91"),
            ([[0.0, 1.0], [360.0, 2.0]], "twice"),
        ] {
            assert!(LocalHorizon::from_degrees(&points).unwrap_err().to_string().contains(word));
        }
    }
}
