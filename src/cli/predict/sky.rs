//! `satphot predict sky`: how bright a type of satellite would be in every direction of one sky.

use std::fmt::Write as _;
use std::path::PathBuf;

use clap::Args;
use satphot::base::progress::Progress as _;
use satphot::base::threads::with_threads;
use satphot::base::time::{iso_utc, parse_utc};
use satphot::brightness::catalogue::Standing;
use satphot::brightness::scene::local_radius_km;
use satphot::brightness::sky::{SkyGrid, SkyMap, sky_map};
use satphot::brightness::{ModelSettings, Satellite, ToleranceOf};
use satphot::config::{self, EarthRadius, LunarEclipse};
use satphot::figures::{sky_map as draw, sky_sequence};
use satphot::pipeline::explain::explain_scenes;
use satphot::report::summary::text_table;
use satphot::tables::{
    FLUX_MAP, Meta, MetaValue, SKY_SEQUENCE, SkyRow, csv_of_cells, csv_text, read_rows, write_cells, write_rows,
};
use satphot::visibility::forecast::{flux_per_e0, prediction_meta, sky_rows};

use super::super::orbit_args::{SiteArg, bad, configuration, tell_unknown_ut1};
use super::super::{bar::Bars, print, tell, threads};
use super::dome_args::height_km;
use super::light_sources::{LightSourceArgs, LightSources};
use super::sequence::{SequenceArgs, SkyOfMoment, cells};
use super::shards::{Shards, shard, together};
use super::{Clock, ModelArgs, OutArgs, band_note};

/// Radius of the Earth where no site says which \[km\].
const RADIUS_KM: f64 = 6378.0;

const AFTER_HELP: &str = "\
Every direction of the grid holds one satellite where the line of sight meets the sphere of
its orbits; the observer is on the concentric sphere of the Earth. Give a moment and a site,
and Sun and Moon stand where the ephemeris puts them; or give their altitude and azimuth.
Without --moon-alt-deg a sky of fixed light sources has no Moon. Satellites have no orbit of their own
here: attitudes that follow the orbit take --track-az-deg as the direction of motion.

The summary gives the median and the range of 68 % twice: every area of the sky counted alike
(what a random satellite of a filled sky shows), and every altitude and azimuth counted alike
(as a grid in both is averaged in publications).

The tolerance is that of the sum of the lights: a light that is faint compared with the others is
computed no better than the sum needs.

Examples:
  satphot predict sky --satellite starlink-v1.5 --height-km 550 --site -33.77,151.11,70 \\
      --time 2025-06-09T08:30:00
  satphot predict sky --satellite starlink-v1.5 --height-km 550 --sun-alt-deg -10 \\
      --sun-az-deg 90 -o map
  satphot predict sky --satellite iss --sun-alt-deg -45 --sun-az-deg 90 \\
                      --moon-alt-deg 45 --moon-az-deg 200 --csv
  satphot predict sky --satellite iss --height-km 420 --site -33.7703,151.1113,70 \\
      --time 2025-06-11T04:00:00 --sequence 4 --also 2025-06-18T04:00:00 -o skies
As lumos-sat computes it (parallel light, cylinder shadow, array at right angles to nadir),
flux only:
  satphot predict sky --satellite starlink-v1.5 --height-km 550 --mode as_published \\
      --sphere-radius-km 6378 \\
                      --sun-alt-deg -10 --sun-az-deg 90 --grid 90x180 --flux -j 1

--shard 2/8 computes every eighth azimuth; the tables of all eight, given to --merge, make the
table of the whole, byte for byte (exit code 3 names missing shards).

--flux prints alt_deg,az_deg,flux: the irradiance at the observer in units of the Sun's at 1
au. In all tables altitude runs fastest.";

/// Maps the magnitude of one type of satellite over the whole sky, for a moment or for given Sun and Moon.
#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub struct Sky {
    /// Configuration with [site] and [model]; pipeline.toml where the arguments leave something open
    #[arg(short, long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Set a key of the configuration (repeatable)
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    #[command(flatten)]
    model: ModelArgs,
    #[command(flatten)]
    place: SiteArg,
    #[command(flatten)]
    light_sources: LightSourceArgs,
    #[command(flatten)]
    sequence: SequenceArgs,
    /// Height of the orbits [km]; the catalogue's where it has one
    #[arg(long, value_name = "KM", allow_hyphen_values = true)]
    height_km: Option<f64>,
    /// Altitudes from 0 to 90 deg by azimuths from 0 to 360 deg, ends included
    #[arg(long, value_name = "NALTxNAZ", default_value = "31x73", value_parser = grid)]
    grid: SkyGrid,
    /// Only every N-th azimuth, beginning with the I-th: a table, without summary and figure
    #[arg(long, value_name = "I/N", value_parser = shard, default_value = "1/1")]
    shard: (usize, usize),
    /// Tables of shards to merge instead of computing
    #[arg(long, value_name = "FILE", num_args = 1.., conflicts_with = "shard")]
    merge: Vec<PathBuf>,
    /// Azimuth in which the satellites move [deg]
    #[arg(long, value_name = "DEG", default_value_t = 90.0, allow_hyphen_values = true)]
    track_az_deg: f64,
    /// Radius of the spherical Earth instead of the model's [km]
    #[arg(long, value_name = "KM", allow_hyphen_values = true)]
    sphere_radius_km: Option<f64>,
    /// Print comma-separated values instead of a summary
    #[arg(long, conflicts_with = "flux")]
    csv: bool,
    /// Print comma-separated alt_deg,az_deg,flux instead of a summary
    #[arg(long)]
    flux: bool,
    #[command(flatten)]
    out: OutArgs,
    /// Number of threads; 0 = all cores. The result does not depend on it
    #[arg(short, long, value_name = "N", default_value_t = 0, value_parser = threads)]
    jobs: usize,
    /// Report on standard error what was excluded from the directions, why, and the CPU time saved
    #[arg(long)]
    explain: bool,
    /// Print no progress bar and no notes
    #[arg(short, long)]
    quiet: bool,
}

impl Sky {
    pub fn execute(mut self) -> anyhow::Result<()> {
        if !self.merge.is_empty() {
            return self.bring_together();
        }
        let (number, of) = self.shard;
        if of > 1 {
            let mine = |place: &usize| place % of == number - 1;
            let all = self.grid.az_deg.len();
            let az_deg = self.grid.az_deg.iter().enumerate().filter(|(place, _)| mine(place)).map(|(_, az)| *az);
            self.grid.az_deg = az_deg.collect();
            if self.sequence.is_wanted() || self.grid.az_deg.is_empty() {
                let problem = format!("{number}/{of} of one map of {all} azimuths");
                return Err(bad("--shard", problem));
            }
        }
        self.light_sources.check()?;
        if self.light_sources.at_a_time() {
            tell_unknown_ut1(&parse_utc("--time", self.light_sources.moment())?, self.quiet);
        }
        let site = self.place.given()?;
        let no_site = site.is_none() && self.light_sources.at_a_time();
        let missing: Vec<&str> = self.model.missing().into_iter().chain(no_site.then_some("--site")).collect();
        let config = configuration(self.config.as_deref(), &self.sets, &missing)?;
        let model = self.model.over(config.as_ref(), &self.sets)?;
        let satellite = Satellite::from_config(&model)?;
        let mut settings = ModelSettings { tolerance_of: ToleranceOf::Total, ..ModelSettings::try_from(&model)? };
        let site = site.or_else(|| config.as_ref().filter(|_| self.light_sources.at_a_time()).map(|c| c.site.clone()));

        if self.sequence.is_wanted() {
            return self.through_the_day(&model, &satellite, &settings, site.as_ref());
        }
        if self.light_sources.has_own_phase() {
            // a phase of one's own is not that of the directions, so neither is their eclipse
            settings.effects.lunar_eclipse = LunarEclipse::Ignored;
            // moonlight is scaled to it afterwards, so that what is faint now may not be faint then
            settings.tolerance_of = ToleranceOf::EachLight;
        }
        let effects = settings.effects;
        let light_sources = LightSources::new(&self.light_sources, site.as_ref(), &settings)?;
        light_sources.check_attitudes(&satellite)?;
        let radius_km = self.radius_km(&light_sources, &settings)?;
        let height_km = height_km(self.height_km, &model)?;
        let sky = light_sources.sky(radius_km, height_km, self.track_az_deg.to_radians())?;

        if effects.lunar_eclipse == LunarEclipse::Applied && sky.moon_out_of_eclipse() < 1.0 && !self.quiet {
            tell(
                "note: the Moon is in the Earth's shadow; --moon-phase-deg, or --set model.effects.lunar_eclipse=ignored, \
                 leaves it lit",
            );
        }
        let bar = Bars::new(!self.quiet);
        bar.stage("sky", self.grid.az_deg.len());
        let mut map = with_threads(self.jobs, || sky_map(&sky, &self.grid, &satellite, &settings, &|| bar.tick()))??;
        bar.done();
        light_sources.scale_moonlight(&mut map);
        if !self.quiet && map.points.iter().any(|p| p.extrapolated) {
            tell("note: the Moon's phase is outside the range of validity of its law (150 deg; ROLO: 1.55 to 97 deg)");
        }

        if self.flux {
            print(&flux_csv(&map)?);
        }
        let band = band_note(&model);
        if let Some(band) = band.as_ref().filter(|_| !self.quiet) {
            tell(&format!("note: magnitudes are of {band}, also where a name or label says V"));
        }
        let band = band.map(|band| format!(" · {band}")).unwrap_or_default();
        let title = format!("{} at {height_km} km · {}{band}", satellite.name, light_sources.when);
        let (tables, figures) = self.out.files("sky")?;
        if self.csv || !tables.is_empty() || !figures.is_empty() {
            let rows = sky_rows(&map);
            if self.csv {
                print(&csv_text(&rows)?);
            }
            let mut meta = prediction_meta("satphot.sky/1", &model, site.as_ref());
            describe(&mut meta, &light_sources, (radius_km, height_km), self.track_az_deg);
            Shards::one(number, of).state_in(&mut meta);
            tables.iter().try_for_each(|table| write_rows(table, &rows, &meta))?;
            let notes = figure_notes(&map);
            figures
                .iter()
                .filter(|_| of == 1)
                .try_for_each(|figure| draw(figure, &rows, &light_sources.marks, &title, &notes))?;
        }
        if of > 1 && !self.csv && !self.flux {
            print(&format!("shard {number}/{of}: {} directions\n", map.points.len()));
        } else if !self.csv && !self.flux {
            print(&format!("{title}\n{}\n{}{}", light_sources.text(), summary(&map), satellite.standing_line()));
        }
        if self.explain {
            let directions: Vec<(f64, f64)> = self.grid.directions().collect();
            let scene = |(alt, az): &(f64, f64)| sky.scene(alt.to_radians(), (az % 360.0).to_radians());
            let scenes: Vec<_> = directions.iter().map(scene).collect();
            let label = |i: usize| format!("alt {:.0} az {:.0}", directions[i].0, directions[i].1);
            let clock = Clock::start();
            let explained = explain_scenes(&sky.model(&satellite, &settings)?, &scenes, &label, &|| clock.cpu_s())?;
            tell(&explained.text());
        }
        let figures = figures.iter().filter(|_| of == 1);
        for file in tables.iter().chain(figures).filter(|_| !self.quiet) {
            tell(&format!("wrote {}", file.display()));
        }
        Ok(())
    }
}

impl Sky {
    /// The table of the whole from those of its shards: altitude runs fastest, as in one made at once.
    fn bring_together(&self) -> anyhow::Result<()> {
        let (tables, shards, meta) = together(&self.merge)?;
        let mut rows: Vec<SkyRow> = Vec::new();
        for table in &tables {
            rows.extend(read_rows::<SkyRow>(table)?.0);
        }
        rows.sort_by(|a, b| a.az_deg.total_cmp(&b.az_deg).then(a.alt_deg.total_cmp(&b.alt_deg)));
        let (outs, _) = self.out.files("sky")?;
        outs.iter().try_for_each(|out| write_rows(out, &rows, &meta))?;
        let standing = Standing::line_of(&meta).map(|line| format!("model {line}\n")).unwrap_or_default();
        print(&if self.csv { csv_text(&rows)? } else { format!("{} directions\n{standing}", rows.len()) });
        outs.iter().filter(|_| !self.quiet).for_each(|out| tell(&format!("wrote {}", out.display())));
        shards.lacking().map_or(Ok(()), |error| Err(error.into()))
    }

    /// Radius of the sphere the observer is on.
    fn radius_km(&self, light_sources: &LightSources, settings: &ModelSettings) -> anyhow::Result<f64> {
        let radius_km = match (self.sphere_radius_km, &light_sources.site_km) {
            (Some(radius_km), _) => radius_km,
            (None, Some(site_km)) if settings.effects.earth_radius == EarthRadius::Local => local_radius_km(site_km),
            (None, _) => RADIUS_KM,
        };
        if !(1.0..=1e6).contains(&radius_km) {
            return Err(bad("--sphere-radius-km", format!("{radius_km} is outside 1 to 1000000 km")));
        }
        Ok(radius_km)
    }

    /// Maps every few hours: one sheet, one table, a line each.
    fn through_the_day(
        &self,
        model: &config::Model,
        satellite: &Satellite,
        settings: &ModelSettings,
        site: Option<&config::Site>,
    ) -> anyhow::Result<()> {
        let days = self.sequence.moments(self.light_sources.moment())?;
        let height_km = height_km(self.height_km, model)?;
        let bar = Bars::new(!self.quiet);
        bar.stage("skies", days.iter().map(Vec::len).sum::<usize>() * self.grid.az_deg.len());
        let (mut skies, mut lines) = (Vec::new(), Vec::new());
        let mut meta = prediction_meta("satphot.sky_sequence/1", model, site);
        let across = days.first().map_or(1, Vec::len);
        for epoch in days.into_iter().flatten() {
            let light_sources = LightSources::new(&self.light_sources.at(iso_utc(epoch, 9)), site, settings)?;
            let radius_km = self.radius_km(&light_sources, settings)?;
            if skies.is_empty() {
                meta.push("sphere_radius_km", radius_km);
                meta.push("height_km", height_km);
                meta.push("track_az_deg", self.track_az_deg);
            }
            let sky = light_sources.sky(radius_km, height_km, self.track_az_deg.to_radians())?;
            let map = with_threads(self.jobs, || sky_map(&sky, &self.grid, satellite, settings, &|| bar.tick()))??;
            let sky = SkyOfMoment { epoch, rows: sky_rows(&map), marks: light_sources.marks };
            let equal_areas = settings.effects.sampling == config::Sampling::SolidAngle;
            let (text, lit) = spread(&map, equal_areas).unwrap_or(("no light".into(), 0.0));
            lines.push(sky.line(&text, lit));
            skies.push(sky);
        }
        bar.done();
        let title = format!("{} at {height_km} km through the day", satellite.name);
        let (tables, figures) = self.out.files("sky_sequence")?;
        if self.csv || !tables.is_empty() {
            let records = cells(&skies)?;
            tables.iter().try_for_each(|table| write_cells(table, &records, SKY_SEQUENCE.columns, &meta))?;
            if self.csv {
                print(&csv_of_cells(SKY_SEQUENCE.columns, &records)?);
            }
        }
        let panels: Vec<_> = skies.iter().map(SkyOfMoment::panel).collect();
        figures.iter().try_for_each(|figure| sky_sequence(figure, &panels, across, &title))?;
        if !self.csv {
            let head = ["UTC", "Sun deg", "Moon deg", "lit %", "V over the sky"];
            print(&format!("{title}\n{}{}", text_table(&head, &lines), satellite.standing_line()));
        }
        for file in tables.iter().chain(&figures).filter(|_| !self.quiet) {
            tell(&format!("wrote {}", file.display()));
        }
        Ok(())
    }
}

/// `NALTxNAZ` as a grid.
fn grid(text: &str) -> Result<SkyGrid, String> {
    let (n_alt, n_az) = text
        .split_once(['x', 'X'])
        .and_then(|(a, b)| Some((a.trim().parse().ok()?, b.trim().parse().ok()?)))
        .ok_or("not two whole numbers such as 31x73: altitudes x azimuths")?;
    SkyGrid::new(n_alt, n_az).map_err(|e| e.to_string())
}

fn flux_csv(map: &SkyMap) -> anyhow::Result<String> {
    let mut text = FLUX_MAP.csv_head();
    for ((alt, az), point) in map.grid.directions().zip(&map.points) {
        writeln!(text, "{alt},{az},{:e}", flux_per_e0(map, point))?;
    }
    Ok(text)
}

/// What the table says about the sky it is of.
fn describe(meta: &mut Meta, light_sources: &LightSources, (radius_km, height_km): (f64, f64), track_az_deg: f64) {
    let number = MetaValue::Number;
    meta.push("sky", MetaValue::Text(light_sources.when.clone()));
    for mark in &light_sources.marks {
        let fields = vec![("alt_deg".into(), number(mark.alt_deg)), ("az_deg".into(), number(mark.az_deg))];
        meta.push(&mark.name.to_lowercase(), MetaValue::Map(fields));
    }
    meta.push("sphere_radius_km", number(radius_km));
    meta.push("height_km", number(height_km));
    meta.push("track_az_deg", number(track_az_deg));
}

/// Median and 68 % of the lit sky, as text.
fn spread(map: &SkyMap, equal_areas: bool) -> Option<(String, f64)> {
    let (quantiles, lit) = map.quantiles(&[0.5, 0.16, 0.84], equal_areas);
    match quantiles.as_slice() {
        [Some(median), Some(bright), Some(faint)] => {
            Some((format!("median V {median:.2}, 16 to 84 % {bright:.2} to {faint:.2}"), lit))
        }
        _ => None,
    }
}

fn figure_notes(map: &SkyMap) -> Vec<String> {
    let (quantiles, lit) = map.quantiles(&[0.5, 0.16, 0.84], true);
    let mut notes = vec!["equal areas of sky:".to_string()];
    if let [Some(median), Some(bright), Some(faint)] = quantiles.as_slice() {
        notes.push(format!("median V {median:.2}"));
        notes.push(format!("16–84 % {bright:.2}–{faint:.2}"));
    }
    notes.extend(map.brightest().map(|(_, v)| format!("brightest V {v:.2}")));
    notes.push(format!("{:.0} % of it lit", 100.0 * lit));
    notes.push("North up, East left".into());
    notes
}

/// The statistics, and a few directions as a table.
fn summary(map: &SkyMap) -> String {
    let mut text = String::new();
    let Some((areas, lit)) = spread(map, true) else {
        return "no light in any direction: the satellites are in the Earth's shadow\n".into();
    };
    // Writing to a String cannot fail.
    let _ = writeln!(text, "equal areas of sky           {areas}  ({:.1} % of the sky lit)", 100.0 * lit);
    if let Some((uniform, lit)) = spread(map, false) {
        let _ = writeln!(text, "equal altitudes and azimuths {uniform}  ({:.1} % lit)", 100.0 * lit);
    }
    if let Some(((alt, az), v)) = map.brightest() {
        let _ = writeln!(text, "brightest                    V {v:.2} at altitude {alt:.1}, azimuth {az:.1} deg");
    }
    let err = map.points.iter().map(|p| p.err_mag).fold(0.0, f64::max);
    let _ = writeln!(text, "largest numerical error      {err:.1e} mag\n");
    text.push_str(&compass(map));
    text
}

/// V at eight points of the compass and a few altitudes, from the grid's nearest directions.
fn compass(map: &SkyMap) -> String {
    let nearest = |values: &[f64], wanted: f64| {
        let off = |i: &usize| (values[*i] - wanted).abs();
        (0..values.len()).min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(0)
    };
    let mut altitudes: Vec<usize> =
        [90.0, 75.0, 60.0, 45.0, 30.0, 20.0, 10.0].map(|alt| nearest(&map.grid.alt_deg, alt)).to_vec();
    altitudes.dedup();
    let azimuths = [0.0, 45.0, 90.0, 135.0, 180.0, 225.0, 270.0, 315.0].map(|az| nearest(&map.grid.az_deg, az));
    let rows: Vec<Vec<String>> = altitudes
        .into_iter()
        .map(|i| {
            let v = |j: &usize| map.points.get(j * map.grid.alt_deg.len() + i).and_then(|p| p.v_mag());
            let cells = azimuths.iter().map(|j| v(j).map_or("-".into(), |v| format!("{v:.2}")));
            std::iter::once(format!("{:.1}", map.grid.alt_deg[i])).chain(cells).collect()
        })
        .collect();
    text_table(&["V at alt", "N", "NE", "E", "SE", "S", "SW", "W", "NW"], &rows)
}
