//! How bright satellites of one type are in every direction of an evening sky.
//!
//! `cargo run --example sky_map`

use satphot::{Epoch, ModelSettings, Satellite, Site, map_sky};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let site = Site::new(-33.7703, 151.1113, 70.0)?;
    let evening: Epoch = "2025-06-09T08:30:00 UTC".parse()?;
    let satellite = Satellite::named("starlink-v1.5").ok_or("the catalogue has no such satellite")?;
    let map = map_sky(&satellite, &ModelSettings::default(), &site, &evening, 550.0, (4, 9))?;

    println!("{} at 550 km, {evening}: V by altitude (down) and azimuth [deg]", satellite.name);
    println!("       {}", (0..9).map(|k| format!("{:7}", 45 * k)).collect::<String>());
    for wanted_deg in [90.0, 60.0, 30.0, 0.0] {
        let row: String = map
            .magnitudes()
            .filter(|(alt_deg, _, _)| *alt_deg == wanted_deg)
            .map(|(_, _, v_mag)| v_mag.map_or("      -".into(), |v| format!("{v:7.2}")))
            .collect();
        println!("{wanted_deg:7.0}{row}");
    }
    if let Some(((alt_deg, az_deg), v_mag)) = map.brightest() {
        println!("brightest: V {v_mag:.2} at altitude {alt_deg:.0}, azimuth {az_deg:.0} deg");
    }
    Ok(())
}
