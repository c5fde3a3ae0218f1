//! The sensor of `satphot render`: telescope, exposure and noise, the frame written, signal over noise printed.

use std::path::PathBuf;

use clap::Args;
use satphot::orbit::Geometry;
use satphot::report::summary::text_table;
use satphot::resolved::sensor::{Air, Exposure, FrameFacts, Sensor, SensorSettings, Snr, signal_to_noise, write_frame};
use satphot::resolved::{ComponentSatellite, Light, Rendered};

use super::super::{print, tell};
use super::bad;

/// A telescope and its detector behind the picture.
#[derive(Debug, Clone, Args)]
pub struct SensorArgs {
    /// Expose the picture with this sensor: macquarie-cdk24, or a telescope.toml; a .fits of -o is then the raw frame
    #[arg(long, value_name = "NAME|FILE")]
    sensor: Option<String>,
    /// Set a key of the sensor, e.g. --sensor-set blur.fwhm_arcsec=1.2 (repeatable)
    #[arg(long, value_name = "KEY=VALUE", requires = "sensor")]
    sensor_set: Vec<String>,
    /// Exposure time [s]
    #[arg(long, value_name = "S", default_value_t = 30.0, allow_hyphen_values = true)]
    exptime_s: f64,
    /// Sky [mag/arcsec2] in V or the filter's band [default: dark sky, Moon and twilight of the moment]
    #[arg(long, value_name = "MAG", allow_hyphen_values = true)]
    sky_mag: Option<f64>,
    /// Seed of the noise
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Print the sensor in force as a telescope.toml and stop
    #[arg(long, requires = "sensor")]
    print_sensor: bool,
}

impl SensorArgs {
    /// Whether a sensor was asked for.
    pub fn wanted(&self) -> bool {
        self.sensor.is_some()
    }

    /// The sensor's text, if that is all that is wanted.
    pub fn text(&self) -> anyhow::Result<Option<String>> {
        match &self.sensor {
            Some(name) if self.print_sensor => Ok(Some(SensorSettings::named(name, &self.sensor_set)?.to_toml()?)),
            _ => Ok(None),
        }
    }

    /// Exposes a picture, prints signal over noise, writes the frames.
    pub fn execute(
        &self,
        satellite: &ComponentSatellite,
        rendered: &Rendered,
        geometry: &Geometry,
        frames: &[PathBuf],
        (csv, quiet): (bool, bool),
    ) -> anyhow::Result<()> {
        let Some(name) = &self.sensor else { return Ok(()) };
        let image = &rendered.image;
        let sensor = Sensor::new(&SensorSettings::named(name, &self.sensor_set)?, image.band_um)?;
        let air = match self.sky_mag {
            Some(sky_mag_arcsec2) => {
                let k = sensor.settings().sky.k_mag_airmass;
                Air { sky_mag_arcsec2, extinction_mag: k * geometry.airmass.unwrap_or(0.0) }
            }
            None => sensor.air(geometry).map_err(|e| bad("--sky-mag", format!("is needed: {e}")))?,
        };
        let exposure = sensor.expose(image, self.exptime_s, &air, (0.0, 0.0))?;
        let counts = sensor.read_out(&exposure, self.seed);
        let rows = signal_to_noise(&exposure, sensor.gain.read_noise_e, &sets(image.planes.iter().map(|p| p.0)));
        print("\n");
        print(&if csv { csv_of(&rows) } else { table(&rows) });
        let facts = FrameFacts {
            object: satellite.title.clone(),
            mid: geometry.epoch,
            alt_deg: geometry.alt_rad.to_degrees(),
            az_deg: geometry.az_rad.to_degrees(),
            seed: self.seed,
            history: satellite.notes.iter().chain(&rendered.warnings).cloned().collect(),
        };
        for path in frames {
            write_frame(path, &counts, &sensor, &exposure, image, &facts)?;
        }
        if !quiet {
            notes(&sensor, &exposure, &air);
            frames.iter().for_each(|file| tell(&format!("wrote {} (raw counts)", file.display())));
        }
        Ok(())
    }
}

/// Each light alone, the sums of the published panels where they can be had, and all lights.
fn sets(lights: impl Iterator<Item = Light>) -> Vec<Vec<Light>> {
    let have: Vec<Light> = lights.collect();
    let mut sets: Vec<Vec<Light>> = have.iter().map(|light| vec![*light]).collect();
    let published = [Light::Starlight, Light::Moon, Light::LunarEarthshine];
    for n in 2..=3 {
        if published[..n].iter().all(|l| have.contains(l)) {
            sets.push(published[..n].to_vec());
        }
    }
    if have.len() > 1 && !sets.iter().any(|s| s.len() == have.len()) {
        sets.push(have);
    }
    sets
}

fn names(row: &Snr) -> String {
    row.lights.iter().map(|l| l.name()).collect::<Vec<_>>().join(" + ")
}

fn table(rows: &[Snr]) -> String {
    let cells: Vec<Vec<String>> = rows
        .iter()
        .map(|r| {
            vec![
                names(r),
                format!("{:.1}", r.signal_e),
                format!("{:.3}", r.pixel),
                format!("{:.3}", r.summed),
                r.n_px.to_string(),
                format!("{:.3}", r.matched),
            ]
        })
        .collect();
    text_table(&["lights", "signal [e-]", "S/N brightest px", "S/N summed", "over [px]", "S/N matched"], &cells)
}

fn csv_of(rows: &[Snr]) -> String {
    let mut text = "lights,signal_e,variance_e2_px,snr_pixel,snr_summed,n_px,snr_matched\n".to_owned();
    for r in rows {
        text.push_str(&format!(
            "{},{},{},{},{},{},{}\n",
            names(r),
            r.signal_e,
            r.variance_e2_px,
            r.pixel,
            r.summed,
            r.n_px,
            r.matched
        ));
    }
    text
}

fn notes(sensor: &Sensor, exposure: &Exposure, air: &Air) {
    let s = sensor.settings();
    tell(&format!(
        "note: {}, {}: {:.4} arcsec/px, 1 e-/s at {:.3} mag, {:.3e} e-/s per W/m2, {:.4} e-/ADU, read noise {:.2} e-",
        s.telescope.name,
        s.detector.camera,
        sensor.pixel_arcsec,
        sensor.zp_mag,
        sensor.e_s_per_w_m2,
        sensor.gain.e_per_adu.0,
        sensor.gain.read_noise_e
    ));
    tell(&format!(
        "note: {} s; sky {:.2} mag/arcsec2, {:.2} e-/px; dark current {:.2} e-/px; the air takes {:.3} mag",
        exposure.exptime_s, air.sky_mag_arcsec2, exposure.sky_e_px, exposure.dark_e_px, air.extinction_mag
    ));
    tell(
        "note: S/N = S/sqrt(S + N), N = sky + dark + read noise^2 of every pixel; summed: the fewest pixels with 90 % of \
         all light; matched: the best weights",
    );
    let full = exposure.n_saturated(sensor.full_well_e());
    if full > 0 {
        tell(&format!("note: {full} pixels expect more than the {:.0} e- they hold: saturated", sensor.full_well_e()));
    }
    if exposure.beside_frac > 1e-3 {
        tell(&format!("note: {:.1} % of the light fell beside the frame", 100.0 * exposure.beside_frac));
    }
}
