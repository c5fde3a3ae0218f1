//! From celestial to Earth-fixed axes: error and cost of neglected terms.
//!
//! Errors in arcsec over directions all around the sky. The reference is the chain satphot uses, IAU 2006/2000A with
//! UT1 and polar motion; UT1 − UTC 0.2 s and a pole 0.3″ away stand for what Bulletin A gives.

use hifitime::{Duration, Epoch};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha12Rng;

use super::effort::Stopwatch;
use super::sweep::{Errors, Series, Sweep, SweepPoint, cpu_us};
use crate::base::constants::ARCSEC_PER_RAD;
use crate::base::error::Result;
use crate::base::vector::{Itrs, Vector};
use crate::orbit::EarthOrientation;
use crate::orbit::earth::{Gcrs, gcrs_to_itrs};
use crate::orbit::time::{TwoPartJd, tt, ut1};

type Matrix = [f64; 9];

/// What Bulletin A may say.
pub(super) const EOP: EarthOrientation = EarthOrientation { ut1_utc_s: Some(0.2), xp_arcsec: 0.18, yp_arcsec: 0.24 };
const IDENTITY: Matrix = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];

/// A matrix times a vector.
pub(super) fn turned(m: &Matrix, v: &Vector<Gcrs>) -> Vector<Itrs> {
    let [x, y, z] = v.to_array();
    Vector::new(m[0] * x + m[1] * y + m[2] * z, m[3] * x + m[4] * y + m[5] * z, m[6] * x + m[7] * y + m[8] * z)
}

fn polar_motion((t1, t2): TwoPartJd) -> Matrix {
    let mut m = [0.0; 9];
    let [xp, yp] = [EOP.xp_arcsec, EOP.yp_arcsec].map(|a| a / ARCSEC_PER_RAD);
    erfars::precnutpolar::Pom00(xp, yp, erfars::precnutpolar::Sp00(t1, t2), &mut m);
    m
}

/// The older chain: precession and nutation of 1976/1980, sidereal time of 1982/1994. It shares no series with that of
/// 2006, and lacks the 0.02″ by which the axes were tied to the quasars and the corrections found since.
pub(super) fn iau_1980(epoch: &Epoch) -> Matrix {
    let ((t1, t2), (u1, u2)) = (tt(epoch), ut1(epoch, EOP.ut1_utc_s_at(epoch)));
    let (mut precession_nutation, mut m) = ([0.0; 9], [0.0; 9]);
    erfars::precnutpolar::Pnm80(t1, t2, &mut precession_nutation);
    let sidereal = erfars::rotationtime::Gst94(u1, u2);
    erfars::precnutpolar::C2teqx(&precession_nutation, sidereal, &polar_motion((t1, t2)), &mut m);
    m
}

fn iau_2000b(epoch: &Epoch) -> Matrix {
    let ((t1, t2), (u1, u2)) = (tt(epoch), ut1(epoch, EOP.ut1_utc_s_at(epoch)));
    let [xp, yp] = [EOP.xp_arcsec, EOP.yp_arcsec].map(|a| a / ARCSEC_PER_RAD);
    let mut m = [0.0; 9];
    erfars::precnutpolar::C2t00b(t1, t2, u1, u2, xp, yp, &mut m);
    m
}

fn without_nutation(epoch: &Epoch) -> Matrix {
    let ((t1, t2), (u1, u2)) = (tt(epoch), ut1(epoch, EOP.ut1_utc_s_at(epoch)));
    let (mut precession, mut m) = ([0.0; 9], [0.0; 9]);
    erfars::precnutpolar::Pmat06(t1, t2, &mut precession);
    let sidereal = erfars::rotationtime::Gmst06(u1, u2, t1, t2);
    erfars::precnutpolar::C2teqx(&precession, sidereal, &polar_motion((t1, t2)), &mut m);
    m
}

fn without_precession(epoch: &Epoch) -> Matrix {
    let ((t1, t2), (u1, u2)) = (tt(epoch), ut1(epoch, EOP.ut1_utc_s_at(epoch)));
    let mut m = [0.0; 9];
    erfars::precnutpolar::C2tcio(&IDENTITY, erfars::rotationtime::Era00(u1, u2), &polar_motion((t1, t2)), &mut m);
    m
}

/// A direction anywhere.
pub(super) fn direction(rng: &mut ChaCha12Rng) -> Vector<Gcrs> {
    let (z, turn): (f64, f64) = (rng.random_range(-1.0..1.0), rng.random_range(0.0..std::f64::consts::TAU));
    let level = (1.0 - z * z).sqrt();
    Vector::new(level * turn.cos(), level * turn.sin(), z)
}

/// A way from celestial to Earth-fixed axes.
type Way = fn(&Epoch, &Vector<Gcrs>) -> Vector<Itrs>;

pub(super) fn sweep(stopwatch: &Stopwatch) -> Result<Sweep> {
    let ways: [(&str, Way); 7] = [
        ("IAU 2006/2000A, every term", |e, v| gcrs_to_itrs(e, &EOP).apply(v)),
        ("IAU 2000B", |e, v| turned(&iau_2000b(e), v)),
        ("IAU 1976/1980", |e, v| turned(&iau_1980(e), v)),
        ("no polar motion", |e, v| {
            gcrs_to_itrs(e, &EarthOrientation { ut1_utc_s: EOP.ut1_utc_s, ..Default::default() }).apply(v)
        }),
        ("no UT1 - UTC", |e, v| gcrs_to_itrs(e, &EarthOrientation { ut1_utc_s: Some(0.0), ..EOP }).apply(v)),
        ("no nutation", |e, v| turned(&without_nutation(e), v)),
        ("no precession", |e, v| turned(&without_precession(e), v)),
    ];
    let mut series = Vec::new();
    for (label, mjd) in [("2005", 53_371.0), ("2025", 60_676.0), ("2045", 67_981.0)] {
        let mut rng = ChaCha12Rng::seed_from_u64(stopwatch.seed(24));
        let cases: Vec<(Epoch, Vector<Gcrs>)> = (0..stopwatch.effort.of(40, 1000))
            .map(|_| {
                (Epoch::from_mjd_utc(mjd) + Duration::from_days(rng.random_range(0.0..365.0)), direction(&mut rng))
            })
            .collect();
        let exact: Vec<Vector<Itrs>> = cases.iter().map(|(e, v)| (ways[0].1)(e, v)).collect();
        let points = ways.iter().filter_map(|(setting, way)| {
            let off: Vec<f64> =
                cases.iter().zip(&exact).map(|((e, v), exact)| ARCSEC_PER_RAD * (way(e, v) - *exact).norm()).collect();
            let us = cpu_us(stopwatch, || {
                cases.iter().for_each(|(e, v)| {
                    std::hint::black_box(way(e, v));
                });
            });
            Errors::of(&off).map(|errors| SweepPoint {
                setting: (*setting).into(),
                errors,
                cpu_us: us / cases.len() as f64,
                memory_kb: None,
                is_default: *setting == ways[0].0,
            })
        });
        series.push(Series { label: label.into(), points: points.collect() });
    }
    Ok(Sweep {
        knob: "terms",
        work: "one rotation",
        error: "arcsec",
        reference: "IAU 2006/2000A with UT1 and polar motion",
        default_because: "the whole chain costs about as much as the lights of one row and leaves no error to think about; IAU \
                          2000B would do with 0.001 arcsec in a tenth of the time. UT1 comes from the IERS table of this version (or \
                          orbit.ut1_utc_s); the pole comes from orbit.xp_arcsec and orbit.yp_arcsec and is 0 unless given: \
                          the line \"no polar motion\", far below the error of elements",
        series,
    })
}
