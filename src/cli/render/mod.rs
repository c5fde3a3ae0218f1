//! `satphot render`: the picture of a satellite of many components, light by light, at one instant or along a pass.

mod areas;
mod files;
mod image_args;
mod outputs;
mod paper;
mod pass;
mod sensor;

use clap::Args;
use satphot::base::threads::with_threads;
use satphot::base::time::{iso_utc, parse_utc};
use satphot::figures::radiance::{TOTAL, radiance_rows};
use satphot::orbit::Tracker;
use satphot::report::summary::text_table;
use satphot::resolved::{ComponentSatellite, Rendered, Renderer, ResolvedScene};
use satphot::tables::{RadianceRow, csv_text};

use super::orbit_args::{OrbitArgs, bad};
use super::{print, tell, threads};
use image_args::ImageArgs;

const AFTER_HELP: &str = "\
SATELLITE is a name (--list shows them) or a file of components ending in .toml; --toml prints
one to start from. The picture is what a perfect telescope sees outside the atmosphere: W m-2
sr-1 in the band, north up, east left, at the true range and aspect. Parts hide the Sun, the
Moon, the Earth and the sky from each other; a body that cannot (a convex one) needs no such
rays, and a note says so.

-o takes a folder, or files distinguished by their extension: .fits (the sum, then an image for each
light), .png (a preview; with --lights-png NAME.png one panel for each light), .ecsv (the table).
Grey levels of previews are an inverse hyperbolic sine, asinh(300 L/L_white), so that a thousandth
of the brightest pixel can still be seen: nothing is to be measured from them. The middle of a
picture is the middle of the satellite's extent on the sky; a picture that cuts it off says so,
and the light of the part it holds is listed as the place \"picture\".
--pass makes one strip of --frames pictures of the pass about --time, and -o FOLDER/ also single
ones with --single; --csv prints its table as CSV.

With --sensor a file of -o is of the frame: .fits its raw counts for `satphot run`, .png a preview
of them, .ecsv signal over noise; a folder gets NAME_sensor.* next to the pictures. --csv then
prints the radiances, and the table of signal over noise goes to its .ecsv alone.

Examples:
  satphot render iss --elements iss.tle --site -33.77,151.11,70 \\
      --time 2025-06-09T10:33:12 -o iss.png -o iss.fits
  satphot render iss --elements iss.tle --site -33.77,151.11,70 \\
      --time 2025-06-09T10:33:12 --earth uniform:1e-9 --starlight none
  satphot render css --elements css.tle --site -33.77,151.11,70 \\
      --time 2025-06-09T16:10:00 --pass --frames 30 -o strip.png
  satphot render own.toml -c pipeline.toml --time 2025-06-10T09:44:00 --point wing=wing@3,0,0
  satphot render iss --elements iss.tle --site -33.77,151.11,70 --time 2025-06-09T10:33:12 \
      --sensor macquarie-cdk24 --exptime-s 30 --seed 7 -o frame.fits
  satphot render --list
  satphot render iss --areas
  satphot render --paper-case";

/// Arguments that mean nothing without a picture.
const OF_A_PICTURE: [&str; 7] = ["elements", "time", "points", "out", "lights_png", "pass", "sensor"];

/// Renders a satellite of many components as a telescope would see it: shadows, Earth's light, every light apart.
#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub struct Render {
    /// Satellite, or a file of components
    #[arg(value_name = "SATELLITE", default_value = "iss")]
    satellite: String,
    #[command(flatten)]
    orbit: OrbitArgs,
    /// The instant, UTC, e.g. 2025-06-09T10:33:12
    #[arg(long, value_name = "UTC")]
    time: Option<String>,
    #[command(flatten)]
    image: ImageArgs,
    /// A test point, component or component@x,y,z [m] (repeatable); those of the satellite's file are always listed
    #[arg(long = "point", value_name = "NAME=PLACE", allow_hyphen_values = true, conflicts_with = "pass")]
    points: Vec<String>,
    #[command(flatten)]
    out: files::PictureOut,
    #[command(flatten)]
    pass: pass::PassArgs,
    #[command(flatten)]
    sensor: sensor::SensorArgs,
    /// List the satellites whose components are known
    #[arg(long, conflicts_with_all = OF_A_PICTURE)]
    list: bool,
    /// Print the components' areas next to the catalogue's
    #[arg(long, conflicts_with_all = OF_A_PICTURE)]
    areas: bool,
    /// Print the file of components, to copy and change
    #[arg(long, conflicts_with_all = OF_A_PICTURE, conflicts_with = "areas")]
    toml: bool,
    /// The published simulation of the ISS (9 June 2025, 10:33 UTC) next to ours
    #[arg(long, conflicts_with_all = OF_A_PICTURE, conflicts_with = "earth")]
    paper_case: bool,
    /// Print comma-separated values instead of a table
    #[arg(long)]
    csv: bool,
    /// Number of threads; 0 = all cores. The result does not depend on it
    #[arg(short, long, value_name = "N", default_value_t = 0, value_parser = threads)]
    jobs: usize,
    /// Print no notes
    #[arg(short, long)]
    quiet: bool,
}

impl Render {
    pub fn execute(self) -> anyhow::Result<()> {
        if self.list {
            print(&areas::list()?);
            return Ok(());
        }
        if let Some(text) = self.sensor.text()? {
            print(&text);
            return Ok(());
        }
        if self.toml {
            let text = ComponentSatellite::text(&ComponentSatellite::named(&self.satellite)?.name);
            let text = text.ok_or_else(|| bad("--toml", format!("{} is a file already", self.satellite)))?;
            print(text);
            return Ok(());
        }
        with_threads(self.jobs, || {
            let satellite = ComponentSatellite::named(&self.satellite)?;
            if self.paper_case && satellite.name != "iss" {
                return Err(bad("--paper-case", format!("is of the iss, not of {}", self.satellite)));
            }
            if self.paper_case {
                return paper::print_case(&self.image, self.csv, self.quiet);
            }
            if self.areas {
                return areas::print_areas(&satellite, &self.image, self.csv, self.quiet);
            }
            self.render(&satellite)
        })?
    }

    fn render(&self, satellite: &ComponentSatellite) -> anyhow::Result<()> {
        let Some(time) = &self.time else {
            return Err(bad("--time", "is needed: an instant, UTC, e.g. 2025-06-09T10:33:12".into()));
        };
        let epoch = parse_utc("--time", time)?;
        let config = self.orbit.configuration(self.orbit.missing()?)?;
        let (orbit, site) = self.orbit.orbit_and_site(config.as_ref())?;
        let tracker = Tracker::from_config(&orbit, &site)?;
        if let Some(warning) = tracker.age_warning(&epoch).filter(|_| !self.quiet) {
            tell(&format!("note: {warning}"));
        }
        let settings = self.image.settings()?;
        if self.pass.wanted() && self.sensor.wanted() {
            return Err(bad("--sensor", "exposes one picture, not the strip of a pass".into()));
        }
        if self.pass.wanted() {
            let (out, print_options) = (&self.out, (self.csv, self.quiet));
            return self.pass.execute(satellite, &tracker, &epoch, &settings, out, print_options);
        }
        let files = self.out.files(&satellite.name, self.sensor.wanted())?;
        let sensor = self.sensor.settings()?;
        if self.csv && sensor.is_some() && files.frame.ecsv.is_empty() {
            let problem = "prints the radiances; signal over noise goes to a file: -o NAME.ecsv, or a folder";
            return Err(bad("--csv", problem.into()));
        }
        let geometry = tracker.at(&epoch)?;
        if !(geometry.alt_rad > 0.0) {
            let problem = format!(
                "at {} {} is {:.1} deg below the horizon; `satphot passes` lists when it is up",
                iso_utc(epoch, 0),
                satellite.name,
                -geometry.alt_rad.to_degrees()
            );
            return Err(bad("--time", problem));
        }
        let renderer = Renderer::new(&ResolvedScene::of(satellite, &geometry), &settings)?;
        let band_um = renderer.around.light_sources.band_um;
        let ready = sensor.map(|s| self.sensor.ready(&s, band_um, &geometry)).transpose()?;
        if ready.is_some() && !renderer.whole() {
            let [west, north] = renderer.view.half_m.map(|half| 2.0 * half / (geometry.range_km * 1e3));
            let arcsec = west.max(north).to_degrees() * 3600.0;
            let problem = format!(
                "the picture cuts off a satellite of {arcsec:.2} arcsec: more --pixels, larger ones, or none of both"
            );
            return Err(bad("--pixel-arcsec", problem));
        }
        let mut points = satellite.points.clone();
        for given in &self.points {
            let (name, place) = given
                .split_once('=')
                .ok_or_else(|| bad("--point", format!("\"{given}\" is not name=component or name=component@x,y,z")))?;
            points.insert(name.trim().to_owned(), satphot::resolved::points::parse_point(place)?);
        }
        let lit = points.iter().map(|(name, point)| renderer.point(name, point)).collect::<Result<Vec<_>, _>>()?;
        files.make_folders()?;
        let rendered = renderer.picture();
        let rows = radiance_rows(&renderer, &rendered, &lit);
        print(&if self.csv { csv_text(&rows)? } else { table(&rows) });
        if !self.quiet {
            outputs::laws(satellite).into_iter().for_each(|line| tell(&format!("note: {line}")));
            notes(&rendered, &renderer);
        }
        let elements = tracker.elements_at(&epoch)?;
        let of = outputs::Target {
            satellite,
            object: elements.label(),
            norad_cat_id: elements.norad_cat_id(),
            site: &site,
            geometry: &geometry,
        };
        let shown = outputs::RenderedPicture { of: &of, rendered: &rendered, rows: &rows, settings: &settings };
        // what the sensor refuses leaves no file behind
        if let Some(ready) = &ready {
            self.sensor.execute(ready, &shown, &files.frame, (self.csv, self.quiet))?;
        }
        shown.write(&files, self.quiet)
    }
}

/// What a reader should know of a picture.
fn notes(rendered: &Rendered, renderer: &Renderer) {
    let image = &rendered.image;
    let side = image.planes.first().map_or(0, |(_, p)| p.nrows());
    tell(&format!(
        "note: {side} x {side} pixels of {:.4} arcsec ({:.3} m), range {:.1} km, seen area {:.1} m2, {} triangles, {} facets",
        image.pixel_rad.to_degrees() * 3600.0,
        image.pixel_rad * image.range_km * 1e3,
        image.range_km,
        rendered.seen_area_m2,
        renderer.body.faces.len(),
        rendered.facets,
    ));
    let rays = rendered.rays;
    tell(&if rendered.convex {
        format!("note: {} rays of sight; convex body, no shadow rays needed", rays.view)
    } else {
        format!(
            "note: {} rays of sight, {} towards Sun and Moon, {} towards Earth and sky",
            rays.view, rays.shadow, rays.earth_and_sky
        )
    });
    rendered.warnings.iter().for_each(|w| tell(&format!("note: {w}")));
}

fn table(rows: &[RadianceRow]) -> String {
    let head = ["place", "view", "light", "L [W/m2/sr]", "E [W/m2]", "V [mag]", "mu V [mag/arcsec2]", "share [%]"];
    let number = |v: Option<f64>, decimals: usize| v.map_or(String::new(), |v| format!("{v:.decimals$}"));
    let cells = |r: &RadianceRow| {
        vec![
            r.place.clone(),
            r.view.clone(),
            r.light.clone(),
            format!("{:.3e}", r.radiance_w_m2_sr),
            r.irradiance_w_m2.map_or(String::new(), |e| format!("{e:.3e}")),
            number(r.v_mag, 2),
            number(r.mu_v_mag_arcsec2, 2),
            number(r.share_frac.map(|s| 100.0 * s).filter(|_| r.light != TOTAL), 2),
        ]
    };
    text_table(&head, &rows.iter().map(cells).collect::<Vec<_>>())
}
