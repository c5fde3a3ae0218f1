//! `satphot plot earth`: the Earth lit by Sun or Moon, from a place above it.

use std::path::{Path, PathBuf};

use clap::Args;
use satphot::Error;
use satphot::base::time::{iso_utc, parse_utc};
use satphot::base::vector::{Itrs, Vector};
use satphot::brightness::brdf::EARTH_VEGETATION;
use satphot::brightness::earth_view::{EarthLightSource, EarthPicture, Viewpoint, earth_picture};
use satphot::brightness::light_sources::SourceSettings;
use satphot::brightness::spectrum::{SolarColumn, Spectrum};
use satphot::brightness::{Band, Brdf};
use satphot::config::{Effects, Mode};
use satphot::figures::{EarthMark, earth};
use satphot::orbit::ground_track::{point_under, terminator};
use satphot::orbit::{EarthOrientation, bodies};
use satphot::report::summary::text_table;
use satphot::tables::{EarthRow, Meta, csv_text, write_rows};
use satphot::visibility::earth_tables::{place_text, write_earth_fits};

use super::super::orbit_args::{bad, tell_unknown_ut1};
use super::super::{print, tell};

/// Points of a mean over a pixel, along a side.
const SUB: usize = 3;
/// Points of the terminator.
const TERMINATOR: usize = 180;
/// What the published simulation takes for the moonlit Earth [W cm^-2 sr^-1 um^-1].
const PUBLISHED_W_CM2_SR_UM: f64 = 1e-9;
/// Wavelengths between which the Moon's colour is known [nm].
const MOON_NM: (f64, f64) = (350.0, 2383.0);

const AFTER_HELP: &str = "\
The Earth is the sphere of the brightness model under parallel light and scatters by its law
(vegetation, Phong 0.53, 0.28, n 7.31) unless --albedo makes it Lambertian. There are no clouds, no sea
and no twilight. Pixels have equal solid angles; north is up, east to the right.

Endings of -o: .svg figure, .png colours alone, .fits radiances, .ecsv the numbers; a folder
gets figure and numbers.

Examples:
  satphot plot earth --time 2025-06-09T10:33:00 --light-source moon -o earth.svg
  satphot plot earth --time 2025-06-09T10:33:00 --from 151.1,-33.8,420 --light-source moon -o iss.svg
  satphot plot earth --time 2025-06-09T02:00:00 --light-source sun --albedo 0.3 -o earth.fits";

/// Radiance of the sunlit or moonlit Earth from a place above it.
#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub struct Earth {
    /// Moment, UTC
    #[arg(long, value_name = "UTC")]
    time: String,
    /// Viewpoint: longitude, latitude [deg], height [km]; without it a geostationary satellite (Himawari)
    #[arg(long, value_name = "LON,LAT,KM", default_value = "140.7,0,35786", allow_hyphen_values = true)]
    from: String,
    /// What lights the Earth
    #[arg(long, alias = "lamp", value_name = "SOURCE", default_value = "moon", value_parser = ["sun", "moon"])]
    light_source: String,
    /// Lambertian ground of this albedo instead of the model's
    #[arg(long, value_name = "ALBEDO", allow_hyphen_values = true)]
    albedo: Option<f64>,
    /// Band of the radiances [um]
    #[arg(long, value_name = "FROM,TO", default_value = "0.3,1.05")]
    band_um: String,
    /// Pixels along a side
    #[arg(long, value_name = "N", default_value_t = 512)]
    pixels: usize,
    /// Print comma-separated values instead of a table
    #[arg(long)]
    csv: bool,
    /// Folder, or a file ending in .svg, .png, .fits or .ecsv (repeatable)
    #[arg(short, long, value_name = "DIR|FILE")]
    out: Vec<PathBuf>,
    /// Print no notes
    #[arg(short, long)]
    quiet: bool,
}

impl Earth {
    pub fn execute(self) -> anyhow::Result<()> {
        let files = self.files()?;
        let epoch = parse_utc("--time", &self.time)?;
        tell_unknown_ut1(&epoch, self.quiet);
        let [lon, lat, height] = numbers::<3>("--from", &self.from, "longitude, latitude and height")?;
        let [low_um, high_um] = numbers::<2>("--band-um", &self.band_um, "two wavelengths")?;
        if !(0.28 <= low_um && low_um < high_um && high_um <= 4.0) {
            return Err(bad(
                "--band-um",
                format!("{low_um},{high_um} um; accepted are two rising wavelengths from 0.28 to 4 um"),
            ));
        }
        let view = Viewpoint::new(lon, lat, height).map_err(|e| match e {
            Error::Config { problem, .. } => bad("--from", problem),
            other => other.into(),
        })?;
        let ground = self.albedo.map_or(EARTH_VEGETATION, |albedo| Brdf::Lambert { albedo });
        let sky = bodies(&epoch, &EarthOrientation::default())?;
        let (source, body) = match self.light_source.as_str() {
            "sun" => (EarthLightSource::Sun, sky.sun_itrs_km),
            _ => (EarthLightSource::Moon, sky.moon_itrs_km),
        };
        let nm = (1e3 * low_um, 1e3 * high_um);
        let sun_w_m2 = Spectrum::sun(SolarColumn::Extraterrestrial)?.irradiance_w_m2(nm.0, nm.1);
        let coloured = match source {
            EarthLightSource::Sun => Band::of_config("V")?,
            EarthLightSource::Moon => Band::between(nm.0.max(MOON_NM.0), nm.1.min(MOON_NM.1))
                .map_err(|_| bad("--band-um", "the Moon's light is known from 0.35 to 2.38 um".into()))?,
        };
        let settings = SourceSettings::new(&Effects::of(Mode::Corrected), &coloured)?;
        let lit = |place_km: &Vector<Itrs>| {
            source.irradiance_w_m2(place_km, &sky.sun_itrs_km, &sky.moon_itrs_km, &settings, sun_w_m2)
        };
        let (source_w_m2, extrapolated) = lit(&Vector::new(0.0, 0.0, 0.0));
        let near = match source {
            EarthLightSource::Sun => None,
            EarthLightSource::Moon => settings.moon_over_ground(&sky.moon_itrs_km, &sky.sun_itrs_km, view.radius_km),
        };
        let under_source_w_m2 = match body.unit() {
            Some(up) if near.is_some() => lit(&(up * view.radius_km)).0,
            _ => source_w_m2,
        };
        let picture = earth_picture(&view, (&body, near.as_ref()), source_w_m2, &ground, (self.pixels, SUB))?;
        let n = Vector::<Itrs>::new(0.0, 0.0, 1.0);
        let under = point_under(&body).unwrap_or_default();
        let brightest = picture.brightest();
        let limb = 2.0 * (0.5 * view.limb_rad()).sin();
        let lit = picture.radiance.iter().filter(|v| **v > 0.0).count() as f64 * picture.pixel_sr();
        let row = EarthRow {
            date: iso_utc(epoch, 0),
            lamp: source.name().into(),
            view_lon_deg: lon,
            view_lat_deg: lat,
            view_height_km: height,
            lamp_lon_deg: under.0,
            lamp_lat_deg: under.1,
            lamp_w_m2: source_w_m2,
            moon_phase_deg: (sky.sun_itrs_km - sky.moon_itrs_km).angle_to(&-sky.moon_itrs_km).to_degrees(),
            radiance_under_lamp_w_m2_sr: under_source_w_m2 * ground.value(&n, &n, &n),
            radiance_max_w_m2_sr: brightest,
            radiance_max_w_cm2_sr_um: 1e-4 * brightest / (high_um - low_um),
            irradiance_w_m2: picture.irradiance_w_m2(),
            lit_frac: (lit / (std::f64::consts::PI * limb * limb)).min(1.0),
        };
        print(&if self.csv { csv_text(std::slice::from_ref(&row))? } else { table(&row) });
        self.write(&files, &picture, &row, terminator(&body, TERMINATOR)?)?;
        if !self.quiet {
            self.notes(source, &row, extrapolated, &files);
        }
        Ok(())
    }

    /// What is to be written where; folders are made.
    fn files(&self) -> anyhow::Result<Vec<PathBuf>> {
        let mut files = Vec::new();
        for out in &self.out {
            match ending(out).as_deref() {
                Some("svg" | "png" | "fits" | "ecsv") => files.push(out.clone()),
                Some("csv" | "txt" | "jpg" | "pdf") => {
                    let problem = format!("{}: accepted endings are .svg, .png, .fits, .ecsv", out.display());
                    return Err(bad("--out", problem));
                }
                _ => {
                    std::fs::create_dir_all(out).map_err(|e| Error::io(out, e))?;
                    files.extend(["earth.svg", "earth.ecsv"].map(|name| out.join(name)));
                }
            }
        }
        Ok(files)
    }

    fn write(
        &self,
        files: &[PathBuf],
        picture: &EarthPicture,
        row: &EarthRow,
        terminator_deg: Vec<(f64, f64)>,
    ) -> anyhow::Result<()> {
        let mark = EarthMark {
            light_source: row.lamp.clone(),
            under_deg: (row.lamp_lon_deg, row.lamp_lat_deg),
            terminator_deg,
            notes: vec![
                row.date.clone(),
                format!("band {} um", self.band_um.replace(',', "-")),
                format!("{}: {:.3e} W m⁻²", row.lamp, row.lamp_w_m2),
                format!("from {}", place_text(row.view_lon_deg, row.view_lat_deg, 1)),
                format!("{:.0} km high", row.view_height_km),
                self.albedo.map_or("ground: vegetation".into(), |a| format!("ground: Lambert {a}")),
                "coasts: Natural Earth".into(),
            ],
            brightest: None,
        };
        for path in files {
            match ending(path).as_deref() {
                Some("fits") => write_earth_fits(path, picture, row)?,
                Some("ecsv") => write_rows(path, std::slice::from_ref(row), &self.meta())?,
                _ => earth(path, picture, &format!("The Earth under the {}", row.lamp), &mark)?,
            }
        }
        Ok(())
    }

    fn meta(&self) -> Meta {
        let mut meta = Meta::default();
        meta.push("schema", "satphot.earth/1");
        meta.push("tool", concat!("satphot ", env!("CARGO_PKG_VERSION")));
        meta.push("time_scale", "UTC");
        meta.push("band_um", self.band_um.as_str());
        meta.push("ground", self.albedo.map_or("vegetation".into(), |a| format!("Lambert, albedo {a}")));
        meta.push("projection", "azimuthal equal-area about nadir, north up, east right");
        meta
    }

    fn notes(&self, source: EarthLightSource, row: &EarthRow, extrapolated: bool, files: &[PathBuf]) {
        if extrapolated {
            tell("note: the Moon's phase is beyond what the lunar law was fitted to");
        }
        if row.radiance_max_w_m2_sr == 0.0 {
            tell("note: no ground in view is lit");
        }
        if source == EarthLightSource::Moon && row.radiance_max_w_m2_sr > 0.0 {
            tell(&format!(
                "note: the brightest ground is {:.1} times the published uniform {PUBLISHED_W_CM2_SR_UM:.0e} W/cm2/sr/um",
                row.radiance_max_w_cm2_sr_um / PUBLISHED_W_CM2_SR_UM
            ));
        }
        for file in files {
            tell(&format!("wrote {}", file.display()));
        }
    }
}

fn ending(path: &Path) -> Option<String> {
    path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase)
}

/// Finite numbers separated by commas.
fn numbers<const N: usize>(key: &str, text: &str, what: &str) -> anyhow::Result<[f64; N]> {
    let parsed: Vec<f64> =
        text.split(',').filter_map(|t| t.trim().parse().ok()).filter(|v: &f64| v.is_finite()).collect();
    let count = text.split(',').count();
    <[f64; N]>::try_from(parsed)
        .ok()
        .filter(|_| count == N)
        .ok_or_else(|| bad(key, format!("\"{text}\" is not {what} separated by commas")))
}

fn table(row: &EarthRow) -> String {
    let point = if row.lamp == "sun" { "subsolar point" } else { "sublunar point" };
    let line = |name: &str, value: String, unit: &str| vec![name.to_owned(), value, unit.to_owned()];
    let cells = vec![
        line("date", row.date.clone(), "UTC"),
        line("light source", row.lamp.clone(), ""),
        line(
            "viewpoint",
            format!("{:.2}, {:.2}, {:.0}", row.view_lon_deg, row.view_lat_deg, row.view_height_km),
            "deg E, deg N, km",
        ),
        line(point, format!("{:.2}, {:.2}", row.lamp_lon_deg, row.lamp_lat_deg), "deg E, deg N"),
        line("irradiance of the light source", format!("{:.4e}", row.lamp_w_m2), "W m-2"),
        line("phase of the Moon", format!("{:.1}", row.moon_phase_deg), "deg"),
        line(&format!("radiance at the {point}"), format!("{:.4e}", row.radiance_under_lamp_w_m2_sr), "W m-2 sr-1"),
        line("brightest in view", format!("{:.4e}", row.radiance_max_w_m2_sr), "W m-2 sr-1"),
        line("the same, mean over the band", format!("{:.4e}", row.radiance_max_w_cm2_sr_um), "W cm-2 sr-1 um-1"),
        line("irradiance of the Earth here", format!("{:.4e}", row.irradiance_w_m2), "W m-2"),
        line("lit share of the disc", format!("{:.3}", row.lit_frac), ""),
    ];
    text_table(&["quantity", "value", "unit"], &cells)
}
