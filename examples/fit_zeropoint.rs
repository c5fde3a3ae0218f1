//! Zeropoint, extinction and colour term from a table of matched stars.
//!
//! `cargo run --example fit_zeropoint [TABLE [KEY=COLUMN]...]`, e.g. `stars.csv inst_mag=MAG_AUTO airmass=1.2`

use std::path::PathBuf;

use satphot::fit_zeropoint;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut args = std::env::args().skip(1);
    let table =
        args.next().map_or_else(|| concat!(env!("CARGO_MANIFEST_DIR"), "/examples/stars.csv").into(), PathBuf::from);
    let named: Vec<String> = args.collect();
    let columns: Vec<(&str, &str)> = named.iter().filter_map(|arg| arg.split_once('=')).collect();

    let zeropoint = fit_zeropoint(&table, &columns)?;
    let err = |i: usize| zeropoint.cov[i][i].sqrt();
    println!("ZP {:.4} +- {:.4} mag", zeropoint.zp_mag, err(0));
    println!("k  {:.4} +- {:.4} mag/airmass ({})", zeropoint.k_mag_airmass, err(1), zeropoint.k_note);
    println!("C  {:.4} +- {:.4} mag/mag ({})", zeropoint.c_mag_mag, err(2), zeropoint.c_note);
    println!("{} stars used, {} outliers, rms {:.4} mag", zeropoint.n_used, zeropoint.n_rejected, zeropoint.rms_mag);
    for warning in &zeropoint.warnings {
        println!("note: {warning}");
    }
    println!("V of -12.0 mag at airmass 1.2, B-V 0.6: {:.3}", zeropoint.v_mag(-12.0, 1.2, 0.6));
    Ok(())
}
