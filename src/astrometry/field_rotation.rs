//! The rotation of the camera on the sky: from the world coordinates of the star frames, for the trails of the tracked
//! ones.
//!
//! Radians on the detector from +x towards +y; position angles from north through east. On an equatorial mount the
//! angle is the same wherever it points, but for half a turn at the meridian, which a trail does not notice. It does
//! not cover mounts that turn the field, whose star frames do not agree: then nothing is known.

use serde::{Deserialize, Serialize};

use crate::astrometry::wcs::Wcs;
use crate::orbit::{Geometry, Site};
use crate::photometry::target::measure::KnownDirection;

/// How much polar alignment and flexure may turn the camera between the star frames and the target \[rad\]: 0.2°.
const MOUNT_ERR_RAD: f64 = 0.0035;
/// Star frames that differ by more than this do not determine the rotation \[rad\]: 2°.
const MOST_ERR_RAD: f64 = 0.035;
/// Step on the sky \[deg\].
const STEP_DEG: f64 = 0.01;

/// Where north is on the detector.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct CameraTurn {
    /// North \[rad\]; half a turn more is the same.
    pub north_rad: f64,
    /// Whether east lies a quarter of a turn from +y towards +x of north.
    pub mirrored: bool,
    /// Standard error \[rad\].
    pub err_rad: f64,
}

impl CameraTurn {
    /// The rotation from one star frame, turned by `rotation_rad` against its world coordinates; `None` outside their
    /// range.
    #[must_use]
    pub fn of_frame(wcs: &Wcs, rotation_rad: f64, (nx, ny): (usize, usize)) -> Option<Self> {
        let (x, y) = (0.5 * (nx as f64 - 1.0), 0.5 * (ny as f64 - 1.0));
        let (ra_deg, dec_deg) = wcs.pixel_to_sky(x, y);
        // away from the nearer pole, and back
        let way = if dec_deg > 0.0 { -1.0 } else { 1.0 };
        let north = wcs.sky_to_pixel(ra_deg, dec_deg + way * STEP_DEG)?;
        let east = wcs.sky_to_pixel(ra_deg + STEP_DEG, dec_deg)?;
        let north = (way * (north.0 - x), way * (north.1 - y));
        let across = north.0 * (east.1 - y) - north.1 * (east.0 - x);
        let north_rad = north.1.atan2(north.0) + rotation_rad;
        (north_rad.is_finite() && across != 0.0).then_some(Self { north_rad, mirrored: across < 0.0, err_rad: 0.0 })
    }

    /// The rotation of a night: the mean of its frames, `err_rad` their scatter and what the mount may add; `None` where
    /// they do not agree.
    ///
    /// Angles half a turn apart are the same: the mean is that of e^(2iθ), R its length, and the scatter √(−2 ln R)/2.
    #[must_use]
    pub fn of_night(frames: &[Self]) -> Option<Self> {
        let first = frames.first()?;
        if frames.iter().any(|f| f.mirrored != first.mirrored) {
            return None;
        }
        let n = frames.len() as f64;
        let sum = |part: fn(f64) -> f64| frames.iter().map(|f| part(2.0 * f.north_rad)).sum::<f64>() / n;
        let (sin, cos) = (sum(f64::sin), sum(f64::cos));
        let scatter_rad = 0.5 * (-2.0 * sin.hypot(cos).clamp(1e-9, 1.0).ln()).sqrt();
        let err_rad = scatter_rad.hypot(MOUNT_ERR_RAD);
        let turn = Self { north_rad: 0.5 * sin.atan2(cos), mirrored: first.mirrored, err_rad };
        (err_rad < MOST_ERR_RAD).then_some(turn)
    }

    /// The direction of the star trails behind a target, its time being `time_err_s` uncertain.
    ///
    /// θ = θ_north ± p, p the position angle of the target's motion among the stars. With s the line of sight and z the
    /// pole, east on the sky is z × s and north s × (z × s). The direction turns no faster than the target moves.
    #[must_use]
    pub fn trails(&self, geometry: &Geometry, site: &Site, time_err_s: f64) -> Option<KnownDirection> {
        let ((sin_lat, cos_lat), m) = (site.lat_rad().sin_cos(), &geometry.motion_enu);
        let ((sin_az, cos_az), (sin_alt, cos_alt)) = (geometry.az_rad.sin_cos(), geometry.alt_rad.sin_cos());
        let s = [cos_alt * sin_az, cos_alt * cos_az, sin_alt];
        let east = cross([0.0, cos_lat, sin_lat], s);
        let north = cross(s, east);
        let along = |v: [f64; 3]| m.x() * v[0] + m.y() * v[1] + m.z() * v[2];
        let angle = along(east).atan2(along(north));
        let theta_rad = self.north_rad + if self.mirrored { -angle } else { angle };
        let err_rad = self.err_rad.hypot(geometry.rate_rad_s * time_err_s);
        (m.norm() > 0.5 && theta_rad.is_finite() && err_rad < MOST_ERR_RAD)
            .then_some(KnownDirection { theta_rad, err_rad })
    }
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[cfg(test)]
mod tests {
    use hifitime::Unit;

    use super::*;
    use crate::orbit::{EarthOrientation, Elements, Tracker, altaz_to_icrs, passes};

    fn apart(a: f64, b: f64) -> f64 {
        (a - b).sin().abs()
    }

    #[test]
    fn north_is_read_from_world_coordinates_turned_or_mirrored() {
        for (rotation_deg, mirrored) in [(0.0, false), (30.0, false), (200.0, true), (-75.0, true)] {
            for dec_deg in [-89.5, -20.0, 60.0] {
                let wcs = Wcs::tan(120.0, dec_deg, 499.5, 399.5, 0.2, rotation_deg, mirrored);
                let turn = CameraTurn::of_frame(&wcs, 0.0, (1000, 800)).unwrap();
                let (x, y) = wcs.sky_to_pixel(120.0, dec_deg + 0.001).unwrap();
                assert!(apart(turn.north_rad, (y - 399.5).atan2(x - 499.5)) < 1e-3, "{turn:?}");
                let (x, y) = wcs.sky_to_pixel(120.0 + 0.001, dec_deg).unwrap();
                let quarter = if turn.mirrored { -std::f64::consts::FRAC_PI_2 } else { std::f64::consts::FRAC_PI_2 };
                assert!(apart(turn.north_rad + quarter, (y - 399.5).atan2(x - 499.5)) < 1e-3, "{turn:?}");
            }
        }
    }

    #[test]
    fn frames_half_a_turn_apart_agree_and_others_do_not() {
        let turn = |deg: f64| CameraTurn { north_rad: deg.to_radians(), mirrored: false, err_rad: 0.0 };
        let night = CameraTurn::of_night(&[turn(10.0), turn(190.2), turn(9.8)]).unwrap();
        assert!(apart(night.north_rad, 10f64.to_radians()) < 1e-9 && night.err_rad < 0.006, "{night:?}");
        assert_eq!(CameraTurn::of_night(&[turn(10.0), turn(40.0)]), None);
        assert_eq!(CameraTurn::of_night(&[turn(10.0), CameraTurn { mirrored: true, ..turn(10.0) }]), None);
        assert_eq!(CameraTurn::of_night(&[]), None);
    }

    #[test]
    fn trails_run_where_the_target_goes_among_the_stars_however_the_camera_is_turned() {
        let lines = [
            "1 25544U 98067A   25159.07052714  .00008601  00000+0  15816-3 0  9996",
            "2 25544  51.6400 352.2516 0001632 195.4618 310.3088 15.50064259513748",
        ];
        let elements = Elements::from_tle("ISS (ZARYA)", lines[0], lines[1]).unwrap();
        let site = Site::new(-33.7703, 151.1113, 70.0).unwrap();
        let tracker = Tracker::new(vec![elements], None, site, EarthOrientation::default()).unwrap();
        let start: hifitime::Epoch = "2025-06-09T08:00:00 UTC".parse().unwrap();
        let found = passes::passes(&tracker, &start, &(start + 1.0 * Unit::Day), 0.2).unwrap();
        assert!(found.len() >= 3);
        for pass in &found {
            for share in [0.1, 0.5, 0.7] {
                let mid = pass.rise.epoch + (pass.set.epoch - pass.rise.epoch) * share;
                // where it stands among the stars, by its own place a moment before and after
                let place = |after_s: f64| {
                    let at = mid + after_s * Unit::Second;
                    let g = tracker.at(&at).unwrap();
                    altaz_to_icrs(tracker.site(), tracker.earth_orientation(), &at, g.alt_rad, g.az_rad)
                };
                let (ra_deg, dec_deg) = place(0.0);
                for (rotation_deg, mirrored) in [(0.0, false), (37.0, false), (-110.0, true)] {
                    let wcs = Wcs::tan(ra_deg, dec_deg, 499.5, 399.5, 0.2, rotation_deg, mirrored);
                    let pixel = |after_s: f64| {
                        let (ra_deg, dec_deg) = place(after_s);
                        wcs.sky_to_pixel(ra_deg, dec_deg).unwrap()
                    };
                    let (before, after) = (pixel(-0.05), pixel(0.05));
                    let want_rad = (after.1 - before.1).atan2(after.0 - before.0);
                    let turn = CameraTurn::of_night(&[CameraTurn::of_frame(&wcs, 0.0, (1000, 800)).unwrap()]).unwrap();
                    let trails = turn.trails(&tracker.at(&mid).unwrap(), tracker.site(), 0.001).unwrap();
                    // ICRS against the true pole of the date: 0.14 deg at most this far from 2000
                    assert!(apart(trails.theta_rad, want_rad) < 0.006, "{} {want_rad}", trails.theta_rad);
                }
            }
        }
    }
}
