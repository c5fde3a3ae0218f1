//! Satellites of old epochs against skyfield 1.55, which has its own table of UT1.

use satphot::base::time::parse_utc;
use satphot::orbit::{EarthOrientation, Elements, Site, Tracker};

const LINE_2: &str = "2 25544  51.6387 309.4583 0002050 206.9520 269.5937 15.49905811513682";
/// Line 1, UTC, altitude and azimuth \[deg\] and range \[km\] over Macquarie, UT1 - UTC \[s\]: skyfield 1.55 with the time scale
/// built into it (`load.timescale(builtin=True)`), WGS84, no polar motion.
const SKYFIELD: [(&str, &str, [f64; 4]); 6] = [
    (
        "1 25544U 98067A   75170.00000000  .00008601  00000+0  15816-3 0  9998",
        "1975-06-19T06:38:40",
        [64.48223, 359.49745, 468.0066, 0.2256],
    ),
    (
        "1 25544U 98067A   78355.00000000  .00008601  00000+0  15816-3 0  9996",
        "1978-12-21T02:24:20",
        [67.01363, 63.39187, 461.8420, -0.3694],
    ),
    (
        "1 25544U 98067A   90240.00000000  .00008601  00000+0  15816-3 0  9993",
        "1990-08-28T02:00:20",
        [59.70527, 56.89139, 487.7426, -0.1185],
    ),
    (
        "1 25544U 98067A   05320.00000000  .00008601  00000+0  15816-3 0  9998",
        "2005-11-16T20:34:20",
        [64.22082, 336.73500, 468.9633, -0.6382],
    ),
    (
        "1 25544U 98067A   16360.00000000  .00008601  00000+0  15816-3 0  9994",
        "2016-12-25T02:24:40",
        [56.65279, 311.44496, 504.6718, -0.4027],
    ),
    (
        "1 25544U 98067A   25160.00000000  .00008601  00000+0  15816-3 0  9992",
        "2025-06-09T14:46:20",
        [59.97771, 129.72289, 489.4837, 0.0298],
    ),
];

fn at(line_1: &str, utc: &str, ut1_utc_s: Option<f64>) -> [f64; 3] {
    let e = Elements::from_tle("", line_1, LINE_2).unwrap();
    let site = Site::new(-33.7703, 151.1113, 70.0).unwrap();
    let eop = EarthOrientation { ut1_utc_s, ..Default::default() };
    let g = Tracker::new(vec![e], None, site, eop).unwrap().at(&parse_utc("test", utc).unwrap()).unwrap();
    [g.alt_rad.to_degrees(), g.az_rad.to_degrees(), g.range_km]
}

#[test]
fn satellites_of_1975_to_2025_stand_where_skyfield_puts_them() {
    let mut worst_without = 0.0_f64;
    for (line_1, utc, [alt, az, range_km, ut1_utc_s]) in SKYFIELD {
        let own = EarthOrientation::default().ut1_utc_s_at(&parse_utc("test", utc).unwrap());
        assert!((own - ut1_utc_s).abs() < 0.006, "{utc}: {own} {ut1_utc_s}");
        let off =
            |[a, z, r]: [f64; 3]| [(a - alt).abs(), (z - az).abs() * alt.to_radians().cos(), (r - range_km).abs()];
        let got = off(at(line_1, utc, None));
        println!("{utc}: UT1 - UTC {own:.4} s, off {got:.6?}; without {:.6?}", off(at(line_1, utc, Some(0.0))));
        // 5 ms of UT1 are 2.3 m at the equator: 0.0003 deg at 460 km
        assert!(got[0] < 4e-4 && got[1] < 4e-4 && got[2] < 0.004, "{utc}: {got:?}");
        worst_without = worst_without.max(off(at(line_1, utc, Some(0.0)))[1]);
    }
    assert!(worst_without > 0.02, "the test could not fail: {worst_without}");
}

#[test]
fn a_value_given_wins_over_the_table() {
    let (line_1, utc, _) = SKYFIELD[3];
    let (table, given, zero) = (at(line_1, utc, None), at(line_1, utc, Some(-0.6382)), at(line_1, utc, Some(0.0)));
    assert!((table[1] - given[1]).abs() < 1e-3 && (table[1] - zero[1]).abs() > 0.02, "{table:?} {given:?} {zero:?}");
}
