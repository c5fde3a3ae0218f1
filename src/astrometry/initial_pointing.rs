//! The approximate pointing of a frame, from its header or the configuration.
//!
//! Degrees, good to a fraction of a degree: precession since J2000 (0.36° by 2026) is not subtracted old mounts'
//! epochs. It does not cover the world coordinates themselves ([`crate::astrometry::wcs`]); their reference point
//! counts as a place.

use hifitime::Epoch;

use crate::astrometry::wcs::Wcs;
use crate::fits::Header;
use crate::frames::Exposure;
use crate::frames::header::{Aliases, sexagesimal};
use crate::orbit::{EarthOrientation, Site, altaz_to_icrs};

/// An approximate position and its source.
#[derive(Debug, Clone, PartialEq)]
pub struct InitialPointing {
    /// Right ascension \[deg\].
    pub ra_deg: f64,
    /// Declination \[deg\].
    pub dec_deg: f64,
    /// The keywords or the key of the configuration.
    pub source: String,
    /// Whether it is the reference point of the world coordinates (CRVAL), which adds nothing to them.
    pub is_reference: bool,
}

/// Keywords of right ascension and declination: the object's, the pointing's, the mount's.
const EQUATORIAL: [(&str, &str); 7] = [
    ("OBJCTRA", "OBJCTDEC"),
    ("RA", "DEC"),
    ("OBJRA", "OBJDEC"),
    ("RA_OBJ", "DEC_OBJ"),
    ("TELRA", "TELDEC"),
    ("RA-MNT", "DEC-MNT"),
    ("RA2000", "DEC2000"),
];
/// Keywords of altitude and azimuth (from north over east).
const HORIZONTAL: [(&str, &str); 5] = [
    ("CENTALT", "CENTAZ"),
    ("OBJCTALT", "OBJCTAZ"),
    ("ALT-OBS", "AZ-OBS"),
    ("ALTITUDE", "AZIMUTH"),
    ("ELEVATIO", "AZIMUTH"),
];

/// Every approximate position of an exposure, the most trusted first: `field` of the configuration, the header's world
/// coordinates at the frame's centre, RA and Dec keywords, CRVAL alone, altitude and azimuth.
///
/// A pair of zeros is not a position. A right ascension that is a bare number below 24 whose comment names no unit is
/// taken as degrees and, after all others, as hours.
#[must_use]
pub fn initial_pointings(
    exposure: &Exposure,
    field: Option<(&str, [f64; 2])>,
    wcs: Option<&Wcs>,
    site: Option<(&Site, &EarthOrientation)>,
    aliases: &Aliases,
) -> Vec<InitialPointing> {
    let header = &exposure.header;
    let mut found: Vec<InitialPointing> = Vec::new();
    let mut as_hours = Vec::new();
    let mut place = |ra_deg: f64, dec_deg: f64, source: String, is_reference: bool| {
        if ra_deg.is_finite() && (-90.0..=90.0).contains(&dec_deg) && (ra_deg, dec_deg) != (0.0, 0.0) {
            found.push(InitialPointing { ra_deg: ra_deg.rem_euclid(360.0), dec_deg, source, is_reference });
        }
    };
    if let Some((name, [ra_deg, dec_deg])) = field {
        place(ra_deg, dec_deg, format!("stars.fields \"{name}\""), false);
    }
    if let Some(wcs) = wcs {
        let (nx, ny) = exposure.size_px;
        let (ra_deg, dec_deg) = wcs.pixel_to_sky(0.5 * nx as f64, 0.5 * ny as f64);
        place(ra_deg, dec_deg, "the header's world coordinates".into(), false);
    }
    let named = |q: &str| aliases.get(q).into_iter().flatten().map(String::as_str).collect::<Vec<_>>();
    let (own_ra, own_dec) = (named("ra"), named("dec"));
    for (ra_key, dec_key) in own_ra.into_iter().zip(own_dec).chain(EQUATORIAL) {
        let (Some(ra), Some(dec)) = (right_ascension(header, ra_key), declination(header, dec_key)) else { continue };
        match ra {
            RightAscension::Deg(ra_deg) => place(ra_deg, dec, format!("{ra_key}/{dec_key}"), false),
            RightAscension::Unknown(value) => {
                place(value, dec, format!("{ra_key}/{dec_key}"), false);
                if (0.0..24.0).contains(&value) {
                    as_hours.push((value * 15.0, dec, format!("{ra_key}/{dec_key} in hours")));
                }
            }
        }
    }
    if wcs.is_none()
        && let (Some(ra), Some(dec)) = (header.number("CRVAL1"), header.number("CRVAL2"))
        && header.text("CTYPE1").is_none_or(|c| c.to_uppercase().starts_with("RA"))
    {
        place(ra, dec, "CRVAL1/CRVAL2".into(), true);
    }
    if let (Some((site, eop)), Some(mid)) = (site, exposure.time.as_ref().map(|t| t.mid)) {
        for (alt_key, az_key) in HORIZONTAL {
            if let Some((ra, dec)) = horizontal(header, alt_key, az_key, site, eop, &mid) {
                place(ra, dec, format!("{alt_key}/{az_key}"), false);
            }
        }
    }
    for (ra, dec, source) in as_hours {
        place(ra, dec, source, false);
    }
    found
}

/// A right ascension as a header writes it.
#[derive(Debug, Clone, Copy, PartialEq)]
enum RightAscension {
    Deg(f64),
    /// A number whose unit is not given.
    Unknown(f64),
}

fn right_ascension(header: &Header, key: &str) -> Option<RightAscension> {
    let text = header.text(key)?;
    let comment = header.comment(key).unwrap_or_default().to_ascii_lowercase();
    let degrees = comment.contains("deg");
    // "(hours)" next to a sexagesimal string is what its parts say anyway
    let hours = ["hour", "[h", "hms", "h m s", "hh"].iter().any(|u| comment.contains(u));
    let value = sexagesimal(&text)?;
    let parts = text.trim().split([':', ' ', 'h', 'm']).filter(|p| !p.trim().is_empty()).count();
    if parts > 1 {
        // three parts are hours unless the comment insists: "deg" next to hms means the declination's twin
        return Some(RightAscension::Deg(if degrees && !hours && value.abs() >= 24.0 { value } else { value * 15.0 }));
    }
    match (degrees, hours) {
        (true, _) => Some(RightAscension::Deg(value)),
        (false, true) => Some(RightAscension::Deg(value * 15.0)),
        // object coordinates are hours by convention, but only hours can be below 24
        (false, false) if key == "OBJCTRA" && (0.0..24.0).contains(&value) => Some(RightAscension::Deg(value * 15.0)),
        _ => Some(RightAscension::Unknown(value)),
    }
}

fn declination(header: &Header, key: &str) -> Option<f64> {
    sexagesimal(&header.text(key)?)
}

fn horizontal(
    header: &Header,
    alt_key: &str,
    az_key: &str,
    site: &Site,
    eop: &EarthOrientation,
    mid: &Epoch,
) -> Option<(f64, f64)> {
    let (alt, az) = (sexagesimal(&header.text(alt_key)?)?, sexagesimal(&header.text(az_key)?)?);
    if !(-5.0..=90.0).contains(&alt) || (alt, az) == (0.0, 0.0) {
        return None;
    }
    Some(altaz_to_icrs(site, eop, mid, alt.to_radians(), az.to_radians()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::astrometry::catalogue::separation_deg;
    use crate::frames::Role;

    fn exposure(cards: &str) -> Exposure {
        let fixed = |line: &str| line.split_once('=').map(|(k, v)| format!("{:<8}= {}\n", k.trim(), v.trim()));
        let cards: String = cards.lines().filter_map(fixed).collect();
        Exposure {
            path: "x.fits".into(),
            name: "x.fits".into(),
            role: Role::Stars,
            role_reason: String::new(),
            object: None,
            exptime_s: 1.0,
            time: None,
            setting: None,
            header_e_per_adu: None,
            filter: None,
            size_px: (100, 100),
            binning: 1,
            warnings: Vec::new(),
            header: Header::from_text(&cards),
        }
    }

    fn places(cards: &str) -> Vec<(f64, f64)> {
        let round = |v: f64| (v * 1e6).round() / 1e6;
        initial_pointings(&exposure(cards), None, None, None, &Aliases::new())
            .iter()
            .map(|p| (round(p.ra_deg), round(p.dec_deg)))
            .collect()
    }

    #[test]
    fn right_ascension_is_read_in_hours_and_in_degrees_as_the_programs_write_it() {
        let hms = "OBJCTRA = '18 20 48.12'        / [hms J2000]\nOBJCTDEC= '-16 10 58.8'\n";
        assert_eq!(places(hms), [(275.2005, -16.183)]);
        assert_eq!(places("RA = 240.1125 / Object Right Ascension in degrees\nDEC = 20.66\n"), [(240.1125, 20.66)]);
        assert_eq!(places("RA = '15:28:35.7' / Nominal center J2000 RA\nDEC = ' -0:30:00.0'\n"), [(232.14875, -0.5)]);
        assert_eq!(places("RA = '167.6425781635544' / Right ascension (deg)\nDEC = '28.5'\n"), [(167.642578, 28.5)]);
        assert_eq!(places("RA = 5.5 / [h] RA of the mount\nDEC = -69.0\n"), [(82.5, -69.0)]);
        assert_eq!(places("RA-MNT = 65.0 / Degrees\nDEC-MNT = -54.9\n"), [(65.0, -54.9)]);
        // no unit: degrees first, hours as the last resort
        assert_eq!(places("RA = 5.5\nDEC = -69.0\n"), [(5.5, -69.0), (82.5, -69.0)]);
        assert_eq!(places("RA = '05h30m00s'\nDEC = '-69d00m00s'\n"), [(82.5, -69.0)]);
    }

    #[test]
    fn what_is_no_position_is_passed_over() {
        for cards in [
            "OBJCTRA = '00 00 00'\nOBJCTDEC= '+00 00 00'\n",
            "RA = 0.0\nDEC = 0.0\n",
            "RA = 10.0\n",
            "RA = 10.0\nDEC = 95.0\n",
            "RA = 'unknown'\nDEC = '10 75 00'\n",
            "CENTALT = 45.0\nCENTAZ = 10.0\n", // without a time
        ] {
            assert!(places(cards).is_empty(), "{cards}");
        }
    }

    #[test]
    fn altitude_and_azimuth_become_the_place_that_stands_there() {
        let site = Site::new(-33.77, 151.11, 70.0).unwrap();
        let mut e = exposure("CENTALT = 60.0\nCENTAZ = 200.0\n");
        let mid = Epoch::from_gregorian_utc_at_midnight(2025, 6, 9);
        e.time = Some(crate::frames::MidTime {
            mid,
            source: String::new(),
            kind: crate::frames::TimeKind::Start,
            stamp: crate::tables::words::TimeStamp::Start,
            err_s: 0.0,
            avg_minus_mid_s: None,
            rejected: vec![],
            warnings: vec![],
        });
        let eop = EarthOrientation::default();
        let found = initial_pointings(&e, None, None, Some((&site, &eop)), &Aliases::new());
        let (alt, az) = crate::orbit::icrs_to_altaz(&site, &eop, &mid, found[0].ra_deg, found[0].dec_deg);
        assert!((alt.to_degrees() - 60.0).abs() < 1e-6 && (az.to_degrees() - 200.0).abs() < 1e-6);
    }

    #[test]
    fn the_field_of_the_configuration_comes_before_the_header() {
        let e = exposure("RA = 10.0\nDEC = 20.0\nCTYPE1 = 'RA---TAN'\nCRVAL1 = 11.0\nCRVAL2 = 21.0\n");
        let wcs = Wcs::tan(30.0, 40.0, 50.0, 50.0, 1.0, 0.0, false);
        let found = initial_pointings(&e, Some(("SA 110", [280.6, 0.1])), Some(&wcs), None, &Aliases::new());
        assert_eq!(found[0].source, "stars.fields \"SA 110\"");
        assert!(separation_deg(found[1].ra_deg, found[1].dec_deg, 30.0, 40.0) < 1e-6);
        // the header's pair, CRVAL being part of the coordinates, and the pair again in hours
        assert_eq!((found[2].ra_deg, found[3].ra_deg, found.len()), (10.0, 150.0, 4));
        let alone = initial_pointings(&e, None, None, None, &Aliases::new());
        assert!(alone.iter().any(|p| p.source == "CRVAL1/CRVAL2" && p.is_reference));
        assert_eq!(alone.iter().filter(|p| p.is_reference).count(), 1);
    }
}
