//! Both fluxes against adversarial cases integrated twice by a program of its own, fixtures/brightness/vectors.csv.
//!
//! Bars at each tolerance asked for; a row counts as faint where its flux is below 1e-8 of what the same surface would
//! send under an Earth lit from the zenith of the satellite. Not covered: the command's table, see the tests of the command.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use satphot::brightness::explicit::{Case, Header, explicit, read_row};

/// A case with the fluxes of the reference.
struct Vector {
    id: String,
    tags: String,
    case: Case,
    direct: f64,
    earth: f64,
    /// Relative difference of the reference's two quadratures.
    err: f64,
}

/// What the bars are about, for one row at one tolerance.
struct Outcome {
    text: String,
    /// |got/expected − 1|.
    off: f64,
    /// The error exceeds the estimate by more than 1e-10 of the value.
    beyond_estimate: bool,
    faint: bool,
    nodes: usize,
}

fn vectors() -> Vec<Vector> {
    let own = concat!(env!("CARGO_MANIFEST_DIR"), "/fixtures/brightness/vectors.csv");
    // another file of the same format can be put to the same test
    let path = std::env::var("SATPHOT_VECTORS").unwrap_or_else(|_| own.into());
    let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).from_path(path).unwrap();
    let names = reader.headers().unwrap().clone();
    let header = Header::new(&names).unwrap();
    let place = |name: &str| names.iter().position(|c| c == name).unwrap();
    let [id, tags, direct, earth, err] = ["id", "tags", "direct_per_E0", "earth_per_E0", "err_earth"].map(place);
    reader
        .records()
        .map(|record| {
            let record = record.unwrap();
            let number = |i: usize| record[i].parse::<f64>().unwrap();
            Vector {
                id: record[id].to_string(),
                tags: record[tags].to_string(),
                case: read_row(&header, &record).unwrap_or_else(|e| panic!("{}: {e}", &record[id])).case,
                direct: number(direct),
                earth: number(earth),
                err: number(err),
            }
        })
        .collect()
}

/// The engine on every case whose Earth-reflected flux is not zero.
fn outcomes(vectors: &[Vector], tolerance: f64) -> Vec<Outcome> {
    let started = std::time::Instant::now();
    let all: Vec<Outcome> = vectors
        .iter()
        .filter(|v| v.earth > 0.0)
        .map(|v| {
            let got = explicit(&v.case, tolerance).unwrap();
            assert!(got.earth.is_finite() && got.earth_err.is_finite() && got.earth >= 0.0, "{}: {got:?}", v.id);
            let error = (got.earth - v.earth).abs();
            Outcome {
                text: format!(
                    "{} {} {:?}: off {:.1e}, estimated {:.1e}, {} nodes",
                    v.id,
                    v.tags,
                    v.case.scattering,
                    error / v.earth,
                    got.earth_err / v.earth,
                    got.nodes
                ),
                off: error / v.earth,
                beyond_estimate: error > got.earth_err + (1e-10 + v.err) * v.earth,
                faint: v.earth < 1e-8 * fully_lit(&v.case),
                nodes: got.nodes,
            }
        })
        .collect();
    let mut nodes: Vec<usize> = all.iter().map(|o| o.nodes).filter(|n| *n > 0).collect();
    nodes.sort_unstable();
    let mut off: Vec<f64> = all.iter().filter(|o| !o.faint).map(|o| o.off).collect();
    off.sort_by(f64::total_cmp);
    println!(
        "tolerance {tolerance:e}: {} rows, off median {:.1e}, 99 % {:.1e}, worst {:.1e}; nodes median {}, worst {}; {} beyond the \
         estimate; {:.0} us a row",
        all.len(),
        off[off.len() / 2],
        off[off.len() * 99 / 100],
        off[off.len() - 1],
        nodes[nodes.len() / 2],
        nodes[nodes.len() - 1],
        all.iter().filter(|o| o.beyond_estimate).count(),
        started.elapsed().as_secs_f64() * 1e6 / all.len() as f64
    );
    all
}

/// The flux with the source in the satellite's zenith.
fn fully_lit(case: &Case) -> f64 {
    explicit(&Case { elevation_rad: std::f64::consts::FRAC_PI_2, ..case.clone() }, 1e-3).unwrap().earth
}

/// Rows worse than `limit`; faint ones only where they miss 1e-5 as well.
fn beyond(outcomes: &[Outcome], limit: f64) -> Vec<&str> {
    let misses = outcomes.iter().filter(|o| o.off > if o.faint { limit.max(1e-5) } else { limit });
    misses.map(|o| o.text.as_str()).collect()
}

#[test]
fn the_direct_flux_is_the_reference_to_1e_8() {
    let vectors = vectors();
    assert!(vectors.iter().filter(|v| v.direct > 0.0).count() > 50);
    for v in &vectors {
        let got = explicit(&v.case, 1e-3).unwrap().direct;
        assert!((got - v.direct).abs() <= 1e-8 * v.direct, "{} {}: {got:e}, expected {:e}", v.id, v.tags, v.direct);
    }
}

#[test]
fn where_no_ground_can_send_light_the_flux_is_exactly_zero() {
    for v in vectors().iter().filter(|v| v.earth == 0.0) {
        for tolerance in [1e-3, 1e-9] {
            let got = explicit(&v.case, tolerance).unwrap();
            assert_eq!((got.earth, got.earth_err), (0.0, 0.0), "{} {}", v.id, v.tags);
        }
    }
}

#[test]
fn at_tolerance_1e_9_every_row_is_good_to_1e_8() {
    let outcomes = outcomes(&vectors(), 1e-9);
    let misses = beyond(&outcomes, 1e-8);
    assert!(misses.is_empty(), "{misses:#?}");
}

#[test]
fn at_tolerance_1e_3_or_1e_6_99_rows_in_100_are_within_it_and_none_is_ten_times_worse() {
    let vectors = vectors();
    for tolerance in [1e-3, 1e-6] {
        let outcomes = outcomes(&vectors, tolerance);
        let misses = beyond(&outcomes, tolerance);
        assert!(misses.len() * 100 <= outcomes.len(), "tolerance {tolerance:e}: {misses:#?}");
        let gross = beyond(&outcomes, 10.0 * tolerance);
        assert!(gross.is_empty(), "tolerance {tolerance:e}: {gross:#?}");
    }
}

#[test]
fn the_true_error_is_within_the_estimate_in_99_rows_of_100() {
    let vectors = vectors();
    for tolerance in [1e-3, 1e-6, 1e-9] {
        let outcomes = outcomes(&vectors, tolerance);
        let beyond: Vec<&str> = outcomes.iter().filter(|o| o.beyond_estimate).map(|o| o.text.as_str()).collect();
        assert!(beyond.len() * 100 <= outcomes.len(), "tolerance {tolerance:e}: {beyond:#?}");
    }
}
