//! A satellite of one's own: a box with a solar array, and where its light is from as it crosses the sky.
//!
//! `cargo run --example own_satellite`

use satphot::{Attitude, Brdf, Epoch, Model, ModelSettings, Satellite, Scene, Site, Surface, Tracker, passes};

const ORBIT: &str = "1 25544U 98067A   25159.07052714  .00008601  00000+0  15816-3 0  9996
2 25544  51.6400 352.2516 0001632 195.4618 310.3088 15.50064259513748";

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let body = Surface {
        name: "body".into(),
        area_m2: 4.0,
        attitude: Attitude::Nadir,
        brdf: Brdf::Phong { kd: 0.3, ks: 0.2, n: 20.0 },
        back: None,
    };
    let array = Surface {
        name: "array".into(),
        area_m2: 12.0,
        attitude: Attitude::Sun,
        brdf: Brdf::named("starlink-array-lab")?,
        back: Some(Brdf::Lambert { albedo: 0.4 }),
    };
    let model = Model::new(&Satellite::of("own", vec![body, array]), &ModelSettings::default())?;

    let tracker = Tracker::from_text(ORBIT, Site::new(-33.7703, 151.1113, 70.0)?)?;
    let (start, end): (Epoch, Epoch) = ("2025-06-09T10:00:00 UTC".parse()?, "2025-06-09T11:00:00 UTC".parse()?);
    let cell = |v_mag: Option<f64>| v_mag.map_or("     -".into(), |v| format!("{v:6.2}"));
    for pass in passes(&tracker, &start, &end, 10f64.to_radians())? {
        for moment in [&pass.rise, &pass.culmination, &pass.set] {
            let b = model.brightness(&Scene::from(&moment.geometry))?;
            let lights = [b.sun, b.earthshine, b.moon, b.lunar_earthshine].map(|light| cell(light.v_mag)).join(" ");
            println!("{}  V {}  Sun, earthshine, Moon, lunar: {lights}", moment.epoch, cell(b.total_v_mag));
        }
    }
    Ok(())
}
