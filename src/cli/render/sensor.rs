//! The sensor of `satphot render`: telescope, exposure and noise, the frame written, signal over noise printed.

use clap::Args;
use ndarray::Array2;
use satphot::figures::radiance::picture::{Tile, write_preview};
use satphot::figures::radiance::snr::snr_rows;
use satphot::orbit::Geometry;
use satphot::report::summary::text_table;
use satphot::resolved::Light;
use satphot::resolved::sensor::{
    Exposure, FrameFacts, Sensor, SensorSettings, SkyConditions, signal_to_noise, write_frame,
};
use satphot::tables::{SnrRow, write_rows};

use super::super::{print, tell};
use super::bad;
use super::files::Kinds;
use super::outputs::{RenderedPicture, v_of, v_text};

/// Longest exposure \[s\].
const LONGEST_S: f64 = 86_400.0;

/// A telescope and its detector behind the picture.
#[derive(Debug, Clone, Args)]
pub struct SensorArgs {
    /// Expose the picture with this sensor: macquarie-cdk24, or a telescope.toml; files of -o are then those of the
    /// frame
    #[arg(long, value_name = "NAME|FILE")]
    sensor: Option<String>,
    /// Set a key of the sensor, e.g. --sensor-set blur.fwhm_arcsec=1.2 (repeatable)
    #[arg(long, value_name = "KEY=VALUE", requires = "sensor")]
    sensor_set: Vec<String>,
    /// Exposure time [s]
    #[arg(long, value_name = "S", default_value_t = 30.0, allow_hyphen_values = true, requires = "sensor")]
    exptime_s: f64,
    /// Sky [mag/arcsec2] in V or the filter's band [default: dark sky, Moon and twilight of the moment]
    #[arg(long, value_name = "MAG", allow_hyphen_values = true, requires = "sensor")]
    sky_mag: Option<f64>,
    /// Seed of the noise
    #[arg(long, value_name = "N", default_value_t = 1, requires = "sensor")]
    seed: u64,
    /// Print the sensor in force as a telescope.toml and stop
    #[arg(long, requires = "sensor")]
    print_sensor: bool,
}

impl SensorArgs {
    /// Whether a sensor was requested.
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

    /// The settings of the sensor, if one was requested, and an exposure time that can be.
    pub fn settings(&self) -> anyhow::Result<Option<SensorSettings>> {
        let Some(name) = &self.sensor else { return Ok(None) };
        if !(self.exptime_s > 0.0 && self.exptime_s <= LONGEST_S) {
            return Err(bad("--exptime-s", format!("{}; accepted is above 0, at most {LONGEST_S} s", self.exptime_s)));
        }
        if let Some(sky) = self.sky_mag.filter(|m| !m.is_finite()) {
            return Err(bad("--sky-mag", format!("{sky}; accepted is a number [mag/arcsec2]")));
        }
        Ok(Some(SensorSettings::named(name, &self.sensor_set)?))
    }

    /// The sensor for this band with the air of this moment.
    pub fn ready(
        &self,
        settings: &SensorSettings,
        band_um: (f64, f64),
        geometry: &Geometry,
    ) -> anyhow::Result<(Sensor, SkyConditions)> {
        let sensor = Sensor::new(settings, band_um)?;
        let air = match self.sky_mag {
            Some(sky_mag_arcsec2) => {
                let k = sensor.settings().sky.k_mag_airmass;
                SkyConditions { sky_mag_arcsec2, extinction_mag: k * geometry.airmass.unwrap_or(0.0) }
            }
            None => sensor.air(geometry).map_err(|e| bad("--sky-mag", format!("is needed: {e}")))?,
        };
        Ok((sensor, air))
    }

    /// Exposes a picture, prints signal over noise (not as CSV: that is the picture's), writes the files of the frame.
    pub fn execute(
        &self,
        (sensor, air): &(Sensor, SkyConditions),
        shown: &RenderedPicture,
        files: &Kinds,
        (csv, quiet): (bool, bool),
    ) -> anyhow::Result<()> {
        let image = &shown.rendered.image;
        let exposure = sensor.expose(image, self.exptime_s, air, (0.0, 0.0))?;
        let counts = sensor.read_out(&exposure, self.seed);
        let found = signal_to_noise(&exposure, sensor.gain.read_noise_e, &sets(image.planes.iter().map(|p| p.0)));
        let rows = snr_rows(&found, sensor.n_saturated(&counts));
        if !csv {
            print(&format!("\n{}", table(&rows)));
        }
        let g = shown.of.geometry;
        let facts = FrameFacts {
            object: shown.of.object.clone(),
            norad_cat_id: Some(shown.of.norad_cat_id),
            site: shown.of.site.clone(),
            v_mag: v_of(shown.rendered),
            mid: g.epoch,
            alt_deg: g.alt_rad.to_degrees(),
            az_deg: g.az_rad.to_degrees(),
            seed: self.seed,
            history: shown.history(),
        };
        for path in &files.fits {
            write_frame(path, &counts, sensor, &exposure, image, &facts)?;
        }
        for path in &files.png {
            write_preview(path, &preview(sensor, &exposure, &counts, shown))?;
        }
        for path in &files.ecsv {
            let mut meta = shown.meta("satphot.snr/1");
            meta.push("sensor", sensor.settings().telescope.name.clone());
            meta.push("exptime_s", exposure.exptime_s);
            meta.push("seed", self.seed as f64);
            meta.push("sky_mag_arcsec2", air.sky_mag_arcsec2);
            meta.push("extinction_mag", air.extinction_mag);
            meta.push("zp_mag", sensor.zp_mag);
            meta.push("zp_band", sensor.zp_band.clone());
            write_rows(path, &rows, &meta)?;
        }
        if !quiet {
            notes(sensor, &exposure, air, &rows);
            files.fits.iter().for_each(|file| tell(&format!("wrote {} (raw counts)", file.display())));
            files.png.iter().chain(&files.ecsv).for_each(|file| tell(&format!("wrote {}", file.display())));
        }
        Ok(())
    }
}

/// The counts to look at: sky black, the brightest pixel white.
fn preview(sensor: &Sensor, exposure: &Exposure, counts: &Array2<u16>, shown: &RenderedPicture) -> Tile {
    let sky_adu = sensor.background_adu(exposure);
    let white_adu = counts.iter().copied().max().unwrap_or(0);
    let pixel_rad = (sensor.pixel_arcsec / 3600.0).to_radians();
    let v = v_text(v_of(shown.rendered), shown.rendered.whole);
    Tile {
        radiance: counts.mapv(|n| (f64::from(n) - sky_adu).max(0.0)),
        captions: vec![
            shown.heading(),
            format!("{v}  {} s  {}", exposure.exptime_s, sensor.settings().telescope.name),
            format!("black {sky_adu:.0} ADU (sky)  white {white_adu} ADU"),
        ],
        pixel_m: pixel_rad * shown.rendered.image.range_km * 1e3,
        pixel_arcsec: sensor.pixel_arcsec,
        white: None,
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

fn table(rows: &[SnrRow]) -> String {
    let cells: Vec<Vec<String>> = rows
        .iter()
        .map(|r| {
            vec![
                r.lights.clone(),
                format!("{:.1}", r.signal_e),
                format!("{:.3}", r.snr_pixel),
                format!("{:.3}", r.snr_summed),
                r.n_px.to_string(),
                format!("{:.3}", r.snr_matched),
                if r.saturated_px > 0 { format!("{}: too large", r.saturated_px) } else { "0".into() },
            ]
        })
        .collect();
    let head =
        ["lights", "signal [e-]", "S/N brightest px", "S/N summed", "over [px]", "S/N matched", "saturated [px]"];
    text_table(&head, &cells)
}

fn notes(sensor: &Sensor, exposure: &Exposure, air: &SkyConditions, rows: &[SnrRow]) {
    let s = sensor.settings();
    tell(&format!(
        "note: {}, {}: {:.4} arcsec/px, 1 e-/s at {:.3} mag ({}, without the atmosphere), {:.3e} e-/s per W/m2, {:.4} e-/ADU, read noise {:.2} e-",
        s.telescope.name,
        s.detector.camera,
        sensor.pixel_arcsec,
        sensor.zp_mag,
        sensor.zp_band,
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
    let full = rows.first().map_or(0, |r| r.saturated_px);
    if full > 0 {
        tell(&format!(
            "note: {full} pixels are saturated (from {:.0} ADU up): S/N counts electrons they did not keep; a shorter \
             --exptime-s, or frame.gain_setting",
            sensor.gain.saturation_adu
        ));
    }
    if exposure.outside_frac > 1e-3 {
        tell(&format!("note: {:.1} % of the light fell outside the frame", 100.0 * exposure.outside_frac));
    }
}
