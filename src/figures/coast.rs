//! The outline of the continents, for maps: Natural Earth 1:110m, embedded.
//!
//! Longitude and latitude in deg, to 0.1 deg: for the eye, not for measuring.

/// The lines, with their source in the first rows.
const COAST: &str = include_str!("../presets/coast_110m.txt");

/// Every line of the coast as longitudes and latitudes \[deg\].
#[must_use]
pub fn coast() -> Vec<Vec<(f64, f64)>> {
    let point = |pair: &str| {
        let (lon, lat) = pair.split_once(',')?;
        Some((lon.parse().ok()?, lat.parse().ok()?))
    };
    let rows = COAST.lines().filter(|l| !l.starts_with('#'));
    rows.map(|line| line.split_whitespace().filter_map(point).collect()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_coast_is_on_the_earth_and_australia_is_where_it_is() {
        let lines = coast();
        let points: Vec<(f64, f64)> = lines.iter().flatten().copied().collect();
        assert!(lines.len() > 100 && points.len() > 5_000);
        assert!(points.iter().all(|(lon, lat)| lon.abs() <= 180.0 && lat.abs() <= 90.0));
        // Cape Byron, the easternmost point of the mainland: 153.64 E, 28.63 S
        let near = |p: &&(f64, f64)| (p.0 - 153.64).hypot(p.1 + 28.63) < 1.0;
        assert!(points.iter().any(|p| near(&p)));
        assert!(COAST.len() < 60_000 && COAST.contains("public domain"));
    }
}
