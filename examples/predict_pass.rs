//! The passes of a satellite over a site, and how bright the model says it is at the top of each.
//!
//! `cargo run --example predict_pass`

use satphot::{Epoch, Model, ModelSettings, Satellite, Scene, Site, Tracker, passes};

const ISS: &str = "ISS (ZARYA)
1 25544U 98067A   25159.07052714  .00008601  00000+0  15816-3 0  9996
2 25544  51.6400 352.2516 0001632 195.4618 310.3088 15.50064259513748";

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let tracker = Tracker::from_text(ISS, Site::new(-33.7703, 151.1113, 70.0)?)?;
    let satellite = Satellite::named("iss").ok_or("the catalogue has no such satellite")?;
    let model = Model::new(&satellite, &ModelSettings::default())?;

    let start: Epoch = "2025-06-09T06:00:00 UTC".parse()?;
    let end: Epoch = "2025-06-09T20:00:00 UTC".parse()?;
    for pass in passes(&tracker, &start, &end, 10f64.to_radians())? {
        let top = &pass.culmination;
        let answer = model.brightness(&Scene::from(&top.geometry))?;
        println!(
            "{}  altitude {:4.1} deg  range {:6.1} km  {}  V {}",
            top.epoch,
            top.alt_rad.to_degrees(),
            top.range_km,
            answer.illum,
            answer.total_v_mag.map_or("-".into(), |v| format!("{v:.2}")),
        );
    }
    Ok(())
}
