//! A night from its raw frames to calibrated magnitudes.
//!
//! `cargo run --release --example reduce_night [PIPELINE_TOML [FOLDER]]`; without arguments the night in `fixtures/`

use std::path::PathBuf;

use satphot::{Config, reduce_night};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut args = std::env::args().skip(1);
    let fixture = concat!(env!("CARGO_MANIFEST_DIR"), "/fixtures/night/pipeline.toml");
    let file = args.next().map_or_else(|| fixture.into(), PathBuf::from);
    let mut config = Config::load(&file, &[])?;
    config.night.output = args.next().map_or_else(|| std::env::temp_dir().join("satphot-example"), PathBuf::from);

    let night = reduce_night(&config)?;
    for row in &night.rows {
        let v_mag = row.v_mag.map_or("      -".into(), |v| format!("{v:7.3}"));
        let residual = row.residual_mag.map_or("      -".into(), |r| format!("{r:7.3}"));
        println!("{}  V {v_mag}  minus model {residual}  {} {}", row.date_mid, row.status, row.verdict);
    }
    if let Some(zeropoint) = &night.zeropoint {
        println!("zeropoint {:.3} mag from {} stars", zeropoint.zp_mag, zeropoint.n_stars);
    }
    for problem in &night.problems {
        println!("problem: {problem}");
    }
    println!("tables in {}", night.folder.display());
    Ok(())
}
