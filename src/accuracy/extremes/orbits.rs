//! Extremes of the orbit: poles, old and decayed elements, geostationary satellites, leap seconds, new years.

use hifitime::{Duration, Epoch};

use super::{Extreme, absolute, holds, or_wrong, refused, relative};
use crate::base::error::Result;
use crate::orbit::time::days_between;
use crate::orbit::{Atmosphere, EarthOrientation, Elements, Propagator, Site, Tracker, airmass::airmass, check_age};

const AREA: &str = "orbit";
/// The ISS of 2025-06-08 (CelesTrak).
pub(super) const ISS: [&str; 2] = [
    "1 25544U 98067A   25159.07052714  .00008601  00000+0  15816-3 0  9996",
    "2 25544  51.6400 352.2516 0001632 195.4618 310.3088 15.50064259513748",
];
/// A geostationary satellite of the SGP4 verification set (Vallado et al. 2006, AIAA 2006-6753).
pub(super) const GEO: [&str; 2] = [
    "1 25954U 99060A   04039.68057285 -.00000108  00000-0  00000-0 0  6847",
    "2 25954   0.0004 243.8136 0001765  15.5294  22.7134  1.00271289 15615",
];

fn elements([one, two]: [&str; 2]) -> Result<Elements> {
    Elements::from_tle("satellite", one, two)
}

pub(super) fn track(lines: [&str; 2], lat_deg: f64, lon_deg: f64) -> Result<Tracker> {
    Tracker::new(vec![elements(lines)?], None, Site::new(lat_deg, lon_deg, 0.0)?, EarthOrientation::default())
}

pub(super) fn cases() -> Vec<Extreme> {
    let mut all = vec![
        or_wrong(AREA, "a satellite below the ground", decayed()),
        or_wrong(AREA, "elements ten years old", old()),
        or_wrong(AREA, "geostationary", geostationary()),
    ];
    for (case, from, to, seconds) in [
        ("over a leap second", "2016-12-31T23:59:59", "2017-01-01T00:00:00", 2.0),
        ("over a new year", "2017-12-31T23:59:59", "2018-01-01T00:00:00", 1.0),
    ] {
        all.push(or_wrong(AREA, case, moved(case, from, to, seconds)));
    }
    all.push(or_wrong(AREA, "a leap second by its own name", leap_second()));
    for lat_deg in [90.0, -90.0] {
        let case = format!("an observer at latitude {lat_deg}");
        all.push(or_wrong(AREA, &case, pole(&case, lat_deg)));
    }
    let air = Atmosphere::at_height_m(0.0);
    all.push(absolute(AREA, "airmass at the zenith", 1.0, airmass(90f64.to_radians(), &air).unwrap_or(f64::NAN), 5e-4));
    all.push(holds(
        AREA,
        "airmass below the horizon",
        "none",
        airmass(-0.01, &air).is_none(),
        format!("{:?}", airmass(-0.01, &air)),
    ));
    all.push(refused(AREA, "a site at latitude 91", "lat", Site::new(91.0, 0.0, 0.0)));
    all
}

/// Twelve years of drag bring the ISS down.
fn decayed() -> Result<Extreme> {
    let state = Propagator::new(&elements(ISS)?)?.state_after(5_000.0 * 1_440.0);
    Ok(refused(AREA, "the ISS 5000 days after its elements", "decayed", state))
}

fn old() -> Result<Extreme> {
    let e = elements(ISS)?;
    let later = e.epoch() + Duration::from_days(3653.0);
    Ok(refused(AREA, "elements ten years old", "orbit.force_age", check_age(&e, &later, 14.0, false)))
}

/// It stays where it is: over three days the range changes by its eccentricity and inclination only.
fn geostationary() -> Result<Extreme> {
    let tracker = track(GEO, 20.0, -101.0)?;
    let start = elements(GEO)?.epoch();
    let mut ranges_km = Vec::new();
    for hour in 0..72 {
        ranges_km.push(tracker.at(&(start + Duration::from_seconds(3600.0 * f64::from(hour))))?.range_km);
    }
    let (low, high) = ranges_km.iter().fold((f64::INFINITY, 0.0f64), |(l, h), r| (l.min(*r), h.max(*r)));
    Ok(holds(
        AREA,
        "geostationary: range over three days",
        "35 800 to 38 000 km, steady to 40 km",
        low > 35_800.0 && high < 38_000.0 && high - low < 40.0,
        format!("{low:.0} to {high:.0} km"),
    ))
}

/// How many seconds of its own speed a satellite moves between two times.
fn moved(case: &str, from: &str, to: &str, seconds: f64) -> Result<Extreme> {
    let near = elements(["1 25544U 98067A   16366.50000000  .00008601  00000+0  15816-3 0  9995", ISS[1]])?;
    let propagator = Propagator::new(&near)?;
    let at = |text: &str| {
        let wrong = |e: hifitime::HifitimeError| crate::Error::Orbit { problem: format!("{text}: {e}") };
        propagator.state(&Epoch::from_gregorian_str(text).map_err(wrong)?)
    };
    let ((p, v), (q, _)) = (at(from)?, at(to)?);
    Ok(relative(AREA, format!("seconds of motion {case}"), seconds, (q - p).norm() / v.norm(), 5e-4))
}

/// 23:59:60 is a second of its own.
fn leap_second() -> Result<Extreme> {
    let at = |text: &str| crate::base::time::parse_utc("time", text);
    let elapsed_s = 86_400.0 * days_between(&at("2016-12-31T23:59:59")?, &at("2016-12-31T23:59:60")?);
    let case = "seconds from 23:59:59 to 23:59:60 of 2016-12-31".to_string();
    Ok(relative(AREA, case, 1.0, elapsed_s, 1e-9))
}

/// Altitude and azimuth at a pole are numbers for a whole turn.
fn pole(case: &str, lat_deg: f64) -> Result<Extreme> {
    let tracker = track(ISS, lat_deg, 0.0)?;
    let start = elements(ISS)?.epoch();
    let mut worst = (0.0f64, true);
    for minute in 0..93 {
        let g = tracker.at(&(start + Duration::from_seconds(60.0 * f64::from(minute))))?;
        worst.1 &= g.alt_rad.is_finite() && g.az_rad.is_finite() && g.range_km > 0.0;
        worst.0 = worst.0.max(g.alt_rad.to_degrees());
    }
    // 51.64 deg of inclination never rise above about 0 deg at the pole
    let got = format!("highest at {:.1} deg", worst.0);
    Ok(holds(AREA, case, "finite, never high in the sky", worst.1 && worst.0 < 10.0, got))
}
