//! `satphot limits streak`: how bright the trail of a satellite is in a survey's exposure, and whether it is seen.

use std::path::PathBuf;

use clap::Args;
use satphot::Error;
use satphot::base::time::parse_utc;
use satphot::brightness::{Catalogue, Satellite};
use satphot::figures::{StreakBand, streak as draw};
use satphot::orbit::{Site, Tracker};
use satphot::tables::{Meta, MetaValue, StreakRow, csv_text, write_rows};
use satphot::visibility::published_streaks::{ANCHORS, Anchor, PAPER_MU, Passing, bands, model_mu};
use satphot::visibility::streak::{Camera, Leg, on_circle, t_eff_simple_s};
use satphot::visibility::survey::{PUBLISHED_LIMITS, SeeingMeaning, Survey, Tint, Visit, colour_mag};

use super::super::orbit_args::{OrbitArgs, bad};
use super::super::predict::OutArgs;
use super::super::predict::dome_args::checked_height;
use super::super::{print, tell};
use super::streak_text::{one_text, paper_text};

/// Heights of the figure's band \[km\], those of the paper.
const BAND_KM: [f64; 2] = [300.0, 2000.0];
/// Area of a satellite of which none is stated \[m²\]: never guessed.
const AREA_NEEDED: &str = "is needed for a satellite of one's own; or name one with --satellite";

const AFTER_HELP: &str = "\
Without arguments: the paper's eight satellites in the zenith before Rubin's 15 s in g.

nu is the magnitude per square arcsecond that a source at rest would need to leave the same
trace in the whole exposure. As published it is m + 5 lg(omega t_exp): the flux over the trail
of the whole exposure, times t_eff/t_exp, which averages over time twice. Corrected it is
m + 2.5 lg(width omega t_exp). The published limit is a point's magnitude; next to it are the
limits over a square arcsecond, a pixel and the whole trail, all of 5 sigma. nu is in V; before
it is compared as corrected, the colour of a grey satellite in moonlight (--light) is added.

Magnitudes, unless --mag: one surface brightness for all (--mu, 19.65 of the ISS in the paper),
or --model: the median over the sky of our model under a full Moon, as surface brightness.

Examples:
  satphot limits streak
  satphot limits streak --model -o streak
  satphot limits streak --satellite starcloud --height-km 500 --mag 5.3
  satphot limits streak --area-m2 4250.25 --height-km 420 --mag 12.02
  satphot limits streak --area-m2 100 --mag 7 --height-km 550 --inclination-deg 53 \\
      --alt-deg 40 --az-deg 200 --site -30.2446,-70.7494,2663
  satphot limits streak --elements iss.tle --at 2025-06-10T09:44:41 \\
      --site -33.7703,151.1113,70 --satellite iss --mag 12.42";

/// Surface brightness of a streak against the limits of a survey, as published and corrected.
#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub struct Streak {
    /// Satellite of the catalogue: its area, and its height unless that is given
    #[arg(long, value_name = "NAME")]
    satellite: Option<String>,
    /// Own satellites, in the form of `satphot satellites NAME --toml`
    #[arg(long, value_name = "FILE")]
    satellites: Option<PathBuf>,
    /// Area of the satellite [m2]
    #[arg(long, value_name = "M2", allow_hyphen_values = true)]
    area_m2: Option<f64>,
    /// Its V magnitude, tracked
    #[arg(long, value_name = "MAG", allow_hyphen_values = true, conflicts_with_all = ["mu", "model"])]
    mag: Option<f64>,
    /// Surface brightness from which magnitudes follow [V mag/arcsec2]
    #[arg(long, value_name = "MAG", allow_hyphen_values = true, conflicts_with = "model")]
    mu: Option<f64>,
    /// Magnitudes from the model: median over the sky under a full Moon
    #[arg(long)]
    model: bool,
    /// Height of a circular orbit [km]
    #[arg(long, value_name = "KM", allow_hyphen_values = true, conflicts_with = "elements")]
    height_km: Option<f64>,
    /// Inclination of that orbit [deg]: the observer's rotation counts then; without it, v/h in the zenith
    #[arg(long, value_name = "DEG", allow_hyphen_values = true, requires = "height_km")]
    inclination_deg: Option<f64>,
    /// Altitude at which it is seen [deg]
    #[arg(long, value_name = "DEG", allow_hyphen_values = true, requires = "inclination_deg")]
    alt_deg: Option<f64>,
    /// Azimuth at which it is seen [deg]
    #[arg(long, value_name = "DEG", allow_hyphen_values = true, requires = "inclination_deg")]
    az_deg: Option<f64>,
    /// Direction of its motion there: northward (ascending) or southward
    #[arg(long, value_name = "LEG", default_value = "ascending", value_parser = ["ascending", "descending"], requires = "inclination_deg")]
    leg: String,
    /// Moment for --elements, UTC, e.g. 2025-06-10T09:44:41
    #[arg(long, value_name = "UTC")]
    at: Option<String>,
    #[command(flatten)]
    orbit: OrbitArgs,
    /// Survey
    #[arg(long, value_name = "NAME", default_value = "rubin")]
    survey: String,
    /// Its band
    #[arg(long, value_name = "BAND", default_value = "g")]
    band: String,
    /// Exposure instead of the survey's [s]
    #[arg(long, value_name = "S", allow_hyphen_values = true)]
    exptime_s: Option<f64>,
    /// Mirror instead of the survey's [m]
    #[arg(long, value_name = "M", allow_hyphen_values = true)]
    mirror_m: Option<f64>,
    /// Seeing instead of the survey's, FWHM [arcsec]
    #[arg(long, value_name = "ARCSEC", allow_hyphen_values = true)]
    fwhm_arcsec: Option<f64>,
    /// Field instead of the survey's, its diameter [deg]
    #[arg(long, value_name = "DEG", allow_hyphen_values = true)]
    fov_deg: Option<f64>,
    /// Sky instead of full Moon's 19.4 [mag/arcsec2]
    #[arg(long, value_name = "MAG", allow_hyphen_values = true)]
    sky_mag_arcsec2: Option<f64>,
    /// What the seeing is: of the air at 500 nm (the paper's limits), or of the images
    #[arg(long, value_name = "WHAT", default_value = "air", value_parser = ["air", "images"])]
    seeing: String,
    /// Light source whose colour a grey satellite has; band: magnitudes are the band's already
    #[arg(long, value_name = "LAMP", default_value = "moon", value_parser = ["moon", "sun", "band"])]
    light: String,
    /// Print comma-separated values instead of a table
    #[arg(long)]
    csv: bool,
    #[command(flatten)]
    out: OutArgs,
    /// Print no notes
    #[arg(short, long)]
    quiet: bool,
}

impl Streak {
    pub fn execute(self) -> anyhow::Result<()> {
        self.check()?;
        let survey = Survey::named(&self.survey)?;
        let visit = self.visit(&survey)?;
        let camera = self.camera(&visit);
        let colour = colour_mag(visit.band.name, self.tint())?;
        let own = self.satellite.is_some() || self.area_m2.is_some() || self.is_placed();
        let passing = if own { vec![self.passing(&survey)?] } else { Passing::of_the_paper()? };
        if !own && self.mag.is_some() {
            return Err(bad("--mag", "is of one satellite: name it with --satellite, or give --area-m2".into()));
        }
        let chosen = self.chosen(&passing)?;
        let row = |p: &Passing, (source, anchor): (&str, &Anchor)| p.row((source, anchor), &camera, &visit, colour);
        let mut rows = Vec::new();
        for (p, (source, anchor)) in passing.iter().zip(&chosen) {
            rows.push(StreakRow { is_modelled: self.model, ..row(p, (source, anchor))? });
        }
        let (tables, figures) = self.out.files("streak")?;
        let mut all = rows.clone();
        if !own {
            let stated = self.mag.is_some() || self.mu.is_some() || self.model;
            for (source, anchor) in ANCHORS.iter().skip(usize::from(!stated)) {
                for p in &passing {
                    all.push(row(p, (source, anchor))?);
                }
            }
        }
        let published = PUBLISHED_LIMITS.iter().find(|(name, _)| *name == visit.band.name).map(|(_, mag)| *mag);
        if self.csv {
            print(&csv_text(&all)?);
        } else if let ([one], true) = (rows.as_slice(), own) {
            print(&one_text(one, &visit, published));
        } else {
            print(&paper_text(&rows, &all, &visit, published));
        }
        let meta = meta(&visit, &camera, colour, published);
        tables.iter().try_for_each(|table| write_rows(table, &all, &meta))?;
        if !figures.is_empty() {
            let mu = match (self.mu, rows.as_slice()) {
                (Some(mu), _) => mu,
                (None, [one]) if own => one.mu_mag_arcsec2.unwrap_or(PAPER_MU),
                _ => PAPER_MU,
            };
            let curves = self.curves(&rows, mu, &camera, &visit, colour)?;
            let title = format!("Trails in {} s of {}, {} band", camera.exptime_s, survey.title, visit.band.name);
            let label = format!("μ = {mu:.2}, {:.0}–{:.0} km", BAND_KM[0], BAND_KM[1]);
            figures.iter().try_for_each(|figure| draw(figure, &title, &rows, &curves, &label))?;
        }
        for file in tables.iter().chain(&figures).filter(|_| !self.quiet) {
            tell(&format!("wrote {}", file.display()));
        }
        Ok(())
    }

    /// The satellite is placed by elements or by an orbit.
    fn is_placed(&self) -> bool {
        self.orbit.elements.is_some() || self.height_km.is_some() || self.at.is_some()
    }

    fn check(&self) -> anyhow::Result<()> {
        for (key, value) in [
            ("--area-m2", self.area_m2),
            ("--exptime-s", self.exptime_s),
            ("--mirror-m", self.mirror_m),
            ("--fwhm-arcsec", self.fwhm_arcsec),
            ("--fov-deg", self.fov_deg),
        ] {
            super::positive(key, value)?;
        }
        self.height_km.map_or(Ok(0.0), checked_height)?;
        for (key, value, low, high) in [
            ("--alt-deg", self.alt_deg, 0.0, 90.0),
            ("--az-deg", self.az_deg, -360.0, 360.0),
            ("--inclination-deg", self.inclination_deg, 0.0, 180.0),
            ("--mag", self.mag, -40.0, 60.0),
            ("--mu", self.mu, -40.0, 60.0),
            ("--sky-mag-arcsec2", self.sky_mag_arcsec2, -30.0, 40.0),
        ] {
            super::within(key, value, low, high)?;
        }
        if self.at.is_none() && self.orbit.elements.is_some() {
            return Err(bad("--at", "elements need a moment, e.g. --at 2025-06-10T09:44:41".into()));
        }
        let placed = self.at.is_some() || self.inclination_deg.is_some();
        if self.orbit.place.given()?.is_some() && !placed {
            return Err(bad(
                "--site",
                "has no effect in the zenith; give --inclination-deg, or elements and --at".into(),
            ));
        }
        if (!self.orbit.sets.is_empty() || self.orbit.norad.is_some()) && self.at.is_none() {
            return Err(bad("--at", "--set and --norad are for elements: give their moment".into()));
        }
        if self.at.is_some() && self.height_km.is_some() {
            return Err(bad("--at", "is a moment of elements; --height-km has none".into()));
        }
        Ok(())
    }

    /// The survey's exposure with what the arguments change.
    fn visit(&self, survey: &Survey) -> anyhow::Result<Visit> {
        let mut survey = *survey;
        survey.seeing_arcsec = self.fwhm_arcsec.unwrap_or(survey.seeing_arcsec);
        survey.exptime_s = self.exptime_s.unwrap_or(survey.exptime_s);
        survey.sky_mag_arcsec2 = self.sky_mag_arcsec2.unwrap_or(survey.sky_mag_arcsec2);
        survey.fov_deg = self.fov_deg.unwrap_or(survey.fov_deg);
        survey.mirror_m = self.mirror_m.unwrap_or(survey.mirror_m);
        let meaning = if self.seeing == "images" { SeeingMeaning::Effective } else { SeeingMeaning::At500nm };
        Ok(survey.visit(survey.band(&self.band)?, meaning))
    }

    fn camera(&self, visit: &Visit) -> Camera {
        Camera {
            exptime_s: visit.exptime_s,
            fov_arcsec: 3600.0 * visit.survey.fov_deg,
            mirror_m: visit.survey.mirror_m,
            fwhm_arcsec: visit.survey.seeing_arcsec,
        }
    }

    fn tint(&self) -> Tint {
        match self.light.as_str() {
            "sun" => Tint::Sun,
            "band" => Tint::None,
            _ => Tint::Moon,
        }
    }

    /// The one satellite of the arguments, where they put it.
    fn passing(&self, survey: &Survey) -> anyhow::Result<Passing> {
        let catalogue = Catalogue::load(self.satellites.as_deref())?;
        let entry = self.satellite.as_deref().map(|name| catalogue.find(name)).transpose().map_err(|e| match e {
            Error::Config { problem, .. } => Error::Argument { name: "--satellite".into(), problem },
            other => other,
        })?;
        let area_m2 = self.area_m2.or(entry.map(|e| e.area_m2()));
        let area_m2 = area_m2.ok_or_else(|| bad("--area-m2", AREA_NEEDED.into()))?;
        let name = entry.map_or("own", |e| e.name.as_str());
        if let Some(at) = &self.at {
            let config = self.orbit.configuration(self.orbit.missing()?)?;
            let (orbit, site) = self.orbit.orbit_and_site(config.as_ref())?;
            let tracker = Tracker::from_config(&orbit, &site)?;
            let epoch = parse_utc("--at", at)?;
            if let Some(warning) = tracker.age_warning(&epoch).filter(|_| !self.quiet) {
                tell(&format!("note: {warning}"));
            }
            let g = tracker.at(&epoch)?;
            if g.alt_rad < 0.0 && !self.quiet {
                let alt = g.alt_rad.to_degrees();
                tell(&format!("note: at that moment the satellite is below the horizon ({alt:.1} deg)"));
            }
            return Ok(Passing {
                name: name.into(),
                area_m2,
                height_km: Some(g.height_km),
                range_km: g.range_km,
                rate_rad_s: g.rate_rad_s,
                rate_source: format!("elements, altitude {:.2} deg", g.alt_rad.to_degrees()),
            });
        }
        let shell = entry.and_then(|e| e.orbits.first()).map(|s| s.height_km.bounds());
        let height_km = self.height_km.or(shell.map(|[low, high]| 0.5 * (low + high)));
        let height_km = height_km
            .ok_or_else(|| bad("--height-km", "is needed, because no orbit is known; give the height [km]".into()))?;
        let Some(inclination_deg) = self.inclination_deg else {
            return Ok(Passing::in_zenith(name, area_m2, height_km)?);
        };
        let site = match self.orbit.place.given()? {
            Some(site) => Site::from_config(&site)?,
            None => Site::new(survey.site.0, survey.site.1, survey.site.2)?,
        };
        let direction = (self.alt_deg.unwrap_or(90.0), self.az_deg.unwrap_or(0.0));
        let (alt_rad, az_rad) = (direction.0.to_radians(), direction.1.to_radians());
        let leg = if self.leg == "descending" { Leg::Descending } else { Leg::Ascending };
        let on = on_circle(&site, height_km, inclination_deg.to_radians(), (alt_rad, az_rad), leg)?;
        Ok(Passing {
            name: name.into(),
            area_m2,
            height_km: Some(height_km),
            range_km: on.range_km,
            rate_rad_s: on.rate_rad_s,
            rate_source: format!(
                "circular, {inclination_deg} deg, {}, altitude {} azimuth {} deg",
                self.leg, direction.0, direction.1
            ),
        })
    }

    /// Where the magnitude of each satellite comes from.
    fn chosen(&self, passing: &[Passing]) -> anyhow::Result<Vec<(String, Anchor)>> {
        if let Some(mag) = self.mag {
            return Ok(vec![("stated".into(), Anchor::Mag(mag)); passing.len()]);
        }
        if let Some(mu) = self.mu {
            return Ok(vec![(format!("mu {mu}, stated"), Anchor::Mu(mu)); passing.len()]);
        }
        if !self.model {
            let (source, anchor) = ANCHORS[0];
            return Ok(vec![(source.to_owned(), anchor); passing.len()]);
        }
        let one = |p: &Passing| -> anyhow::Result<(String, Anchor)> {
            let satellite = Satellite::named(&p.name)
                .ok_or_else(|| bad("--model", format!("\"{}\" is not in the catalogue: give --satellite", p.name)))?;
            let height_km = p
                .height_km
                .ok_or_else(|| bad("--height-km", "is needed for the model; give the height [km]".into()))?;
            Ok(match model_mu(&satellite, height_km)? {
                Some(mu) => (format!("model, median mu {mu:.2} under a full Moon"), Anchor::Mu(mu)),
                None => ("model: no light in any direction".into(), Anchor::Dark),
            })
        };
        passing.iter().map(one).collect()
    }

    /// The bands of the figure, over areas that hold every row's.
    fn curves(
        &self,
        rows: &[StreakRow],
        mu: f64,
        camera: &Camera,
        visit: &Visit,
        colour: f64,
    ) -> anyhow::Result<Vec<StreakBand>> {
        let ends = rows.iter().map(|r| r.area_m2.log10());
        let (low, high) = ends.fold((1.0_f64, 7.7_f64), |(lo, hi), a| (lo.min(a - 0.3), hi.max(a + 0.3)));
        let areas: Vec<f64> = (0..=200).map(|i| 10f64.powf(low + (high - low) * f64::from(i) / 200.0)).collect();
        let middle_km = 0.5 * (BAND_KM[0] + BAND_KM[1]);
        let mut curves = Vec::new();
        for b in bands(mu, &areas, BAND_KM, camera, visit, colour)? {
            curves.push(StreakBand {
                area_m2: b.area_m2,
                published: b.published,
                corrected: b.corrected,
                trail_limit: b.trail_limit,
                t_eff_s: t_eff_simple_s(b.area_m2, middle_km)?,
            });
        }
        Ok(curves)
    }
}

/// What the table says about the survey it is of.
fn meta(visit: &Visit, camera: &Camera, colour: f64, published: Option<f64>) -> Meta {
    let mut meta = Meta::default();
    let number = MetaValue::Number;
    meta.push("schema", "satphot.streak/1");
    meta.push("tool", concat!("satphot ", env!("CARGO_PKG_VERSION")));
    meta.push("survey", visit.survey.name);
    meta.push("filter", visit.band.name);
    meta.push("mag_system", "v_mag, mu and nu: V, Vega; limits: AB of the filter");
    meta.push("exptime_s", number(camera.exptime_s));
    meta.push("mirror_m", number(camera.mirror_m));
    meta.push("fov_deg", number(visit.survey.fov_deg));
    meta.push("fwhm_eff_arcsec", number(visit.fwhm_eff_arcsec));
    meta.push("sky_mag_arcsec2", number(visit.sky_mag_arcsec2));
    meta.push("full_well_e", number(visit.survey.full_well_e));
    meta.push("colour_mag", number(colour));
    if let Some(mag) = published {
        meta.push("published_limit_mag", number(mag));
    }
    meta
}
