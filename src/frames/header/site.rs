//! The observatory as a header states it, and whether it is the configured one.
//!
//! WGS84 degrees, north and east positive, metres. Sexagesimal strings, unset zeros, longitudes counted west and
//! geocentric coordinates are understood. It does not cover which site geometry uses: always the configured one.

use super::names::Aliases;
use super::sexagesimal;
use crate::config;
use crate::fits::cards::Header;

/// Where a header says the telescope stands.
#[derive(Debug, Clone, PartialEq)]
pub struct HeaderSite {
    /// Geodetic latitude, north positive \[deg\].
    pub lat_deg: f64,
    /// Longitude, east positive, -180 to 180 \[deg\].
    pub lon_deg: f64,
    /// Height \[m\], where given.
    pub alt_m: Option<f64>,
    /// The keywords.
    pub source: String,
}

/// A header's site next to the configured one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SiteCheck {
    /// Within 0.1 deg.
    Agrees,
    /// It does with the sign of the longitude turned: counted west, as old MaxIm did.
    WestPositive,
    /// It does not; the larger of both differences \[deg\].
    Differs(f64),
}

/// Header and configuration further apart than this do not agree \[deg\].
const TOLERANCE_DEG: f64 = 0.1;
/// Latitude, longitude and height of the usual programs.
const KEYWORDS: [[&str; 3]; 8] = [
    ["SITELAT", "SITELONG", "SITEELEV"],
    ["LAT-OBS", "LONG-OBS", "ALT-OBS"],
    ["OBS-LAT", "OBS-LONG", "OBS-ELEV"],
    ["OBSGEO-B", "OBSGEO-L", "OBSGEO-H"],
    ["LATITUDE", "LONGITUD", "HEIGHT"],
    ["GPS_LAT", "GPS_LON", "GPS_ALT"],
    ["TELLAT", "TELLONG", "TELALT"],
    ["SITELAT", "SITELON", "SITEALT"],
];

/// The site, and what was present but is not used with the reason.
#[must_use]
pub fn header_site(header: &Header, aliases: &Aliases) -> (Option<HeaderSite>, Vec<String>) {
    let mut rejected = Vec::new();
    let own = |q: &str| aliases.get(q).into_iter().flatten().map(String::as_str).collect::<Vec<_>>();
    let (lats, lons, alts) = (own("site_lat"), own("site_lon"), own("site_alt"));
    let named = lats.iter().zip(&lons).map(|(a, b)| [*a, *b, alts.first().copied().unwrap_or("SITEELEV")]);
    for [lat_key, lon_key, alt_key] in named.chain(KEYWORDS) {
        let (Some(lat), Some(lon)) = (header.text(lat_key), header.text(lon_key)) else { continue };
        let words = format!("{lat_key} = '{lat}', {lon_key} = '{lon}'");
        let (Some(lat_deg), Some(lon_deg)) = (sexagesimal(&lat), sexagesimal(&lon)) else {
            rejected.push(format!("{words}: not angles"));
            continue;
        };
        if lat_deg == 0.0 && lon_deg == 0.0 {
            rejected.push(format!("{words}: zeros, unset"));
            continue;
        }
        if !(-90.0..=90.0).contains(&lat_deg) || !(-360.0..=360.0).contains(&lon_deg) {
            rejected.push(format!("{words}: not on the Earth"));
            continue;
        }
        let comment = header.comment(lon_key).unwrap_or_default().to_ascii_lowercase();
        let west = ["+w", "west positive", "positive west", "deg west", "degrees west", "west of greenwich"];
        let counted_west = west.iter().any(|w| comment.contains(w));
        let (lon_deg, how) = if counted_west { (-lon_deg, " (counted west)") } else { (lon_deg, "") };
        let alt_m = header.text(alt_key).and_then(|t| sexagesimal(&t)).filter(|a| (-500.0..=9_000.0).contains(a));
        let source = format!("{lat_key}/{lon_key}{how}");
        return (Some(HeaderSite { lat_deg, lon_deg: wrapped(lon_deg), alt_m, source }), rejected);
    }
    let xyz = ["OBSGEO-X", "OBSGEO-Y", "OBSGEO-Z"].map(|k| header.number(k));
    if let [Some(x), Some(y), Some(z)] = xyz {
        match geodetic(x, y, z) {
            Some(site) => return (Some(site), rejected),
            None => rejected.push(format!("OBSGEO-X/Y/Z = {x} {y} {z} m: not on the Earth")),
        }
    }
    (None, rejected)
}

fn wrapped(lon_deg: f64) -> f64 {
    180.0 - (180.0 - lon_deg).rem_euclid(360.0)
}

/// WGS84 coordinates of a geocentric position \[m\].
fn geodetic(x: f64, y: f64, z: f64) -> Option<HeaderSite> {
    // ERFA's number of WGS84
    let ((lon, lat, alt_m), _) = erfars::geodeticgeocentric::Gc2gd(1, &[x, y, z]).ok()?;
    let ok = lat.is_finite() && lon.is_finite() && (-500.0..=9_000.0).contains(&alt_m);
    ok.then(|| HeaderSite {
        lat_deg: lat.to_degrees(),
        lon_deg: wrapped(lon.to_degrees()),
        alt_m: Some(alt_m),
        source: "OBSGEO-X/Y/Z".into(),
    })
}

/// Whether a header's site is the configured one.
#[must_use]
pub fn check_site(stated: &HeaderSite, site: &config::Site) -> SiteCheck {
    let lat = (stated.lat_deg - site.lat_deg).abs();
    let lon = |value: f64| (value - site.lon_deg + 180.0).rem_euclid(360.0) - 180.0;
    let (east, west) = (lon(stated.lon_deg).abs(), lon(-stated.lon_deg).abs());
    if lat.max(east) <= TOLERANCE_DEG {
        SiteCheck::Agrees
    } else if lat.max(west) <= TOLERANCE_DEG {
        SiteCheck::WestPositive
    } else {
        SiteCheck::Differs(lat.max(east))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(cards: &str) -> Option<HeaderSite> {
        header_site(&Header::from_text(cards), &Aliases::new()).0
    }

    #[test]
    fn sites_are_read_from_every_program() {
        let s = of("SITELAT = '-31 16 24' / Latitude\nSITELONG= '149 03 52' / Longitude\n").unwrap();
        assert!((s.lat_deg + 31.273_333).abs() < 1e-6 && (s.lon_deg - 149.064_444).abs() < 1e-6 && s.alt_m.is_none());
        let s = of(
            "SITELAT = '00 00 00'\nSITELONG= '00 00 00'\nLATITUDE= -30.1676541\nLONGITUD= 289.195\nHEIGHT  = 2201.0\n",
        );
        let s = s.unwrap();
        assert!((s.lon_deg + 70.805).abs() < 1e-9 && s.alt_m == Some(2201.0) && s.source.starts_with("LATITUDE"));
        // the geocentric coordinates of an LCO header next to its geodetic ones: -30.1676541, -70.8046270, 2201 m
        let xyz = "OBSGEO-X=  1815200.221\nOBSGEO-Y= -5213900.700\nOBSGEO-Z= -3187561.361\n";
        let s = of(xyz).unwrap();
        // LCO's own two forms differ by some metres
        assert!((s.lat_deg + 30.1676541).abs() < 3e-3 && (s.lon_deg + 70.804627).abs() < 3e-3, "{s:?}");
        let s = of("SITELAT = 40.0\nSITELONG= 71.25 / [deg] longitude, +W\n").unwrap();
        assert_eq!(s.lon_deg, -71.25);
        assert_eq!(of("SITELAT = 'unknown'\nSITELONG= 10.0\n"), None);
    }

    #[test]
    fn a_longitude_counted_west_is_distinguished_from_another_site() {
        let site = config::Site { name: String::new(), lat_deg: -33.77, lon_deg: 151.11, alt_m: 70.0 };
        let at = |lat_deg: f64, lon_deg: f64| {
            check_site(&HeaderSite { lat_deg, lon_deg, alt_m: None, source: String::new() }, &site)
        };
        assert_eq!(at(-33.8, 151.1), SiteCheck::Agrees);
        assert_eq!(at(-33.8, -151.1), SiteCheck::WestPositive);
        assert!(matches!(at(-33.8, 150.9), SiteCheck::Differs(d) if (d - 0.21).abs() < 1e-9));
        assert!(matches!(at(33.77, 151.11), SiteCheck::Differs(_)));
    }
}
