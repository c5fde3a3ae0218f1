//! One call of `satphot fetch`: which object, which moment, which fields, and the files they go to.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use hifitime::Epoch;
use satphot::Error;
use satphot::astrometry::catalogue::Catalogue;
use satphot::base::file::write_atomic;
use satphot::base::time::{iso_utc, parse_utc, shifted};
use satphot::config::{self, Config};
use satphot::fetch::{
    Client, Field, Object, Wanted, WhichService, apass_query, element_queries, fetch_elements, fetch_stars,
    fields_of_night, fields_of_passes, one_query_each,
};
use satphot::orbit::{Tracker, element_names, nearest, read_elements_for};
use satphot::pipeline::survey::files::Survey;
use satphot::pipeline::survey::read::survey;

use super::super::orbit_args::bad;
use super::super::print;
use super::args::{ElementFormat, ElementSource, Fetch};

/// One call: what was requested, with what it needs.
pub struct Job<'a> {
    pub verb: &'a Fetch,
    pub config: Option<&'a Config>,
    pub settings: &'a config::Fetch,
    pub client: &'a Client<'a>,
    pub say: &'a dyn Fn(&str),
}

impl Job<'_> {
    fn note(&self, text: &str) {
        (self.say)(&format!("note: {text}"));
    }

    pub fn elements_file(&self) -> anyhow::Result<PathBuf> {
        let of_config = || self.config.and_then(|c| c.orbit.as_ref()).map(|o| o.elements.clone());
        self.verb.out.clone().or_else(of_config).ok_or_else(|| {
            bad("-o", "say where the elements go: -o FILE, or a configuration (-c) with orbit.elements".into())
        })
    }

    pub fn stars_file(&self) -> anyhow::Result<PathBuf> {
        let of_config = || self.config.and_then(|c| c.stars.as_ref()).map(|s| s.catalogue.clone());
        self.verb.out.clone().or_else(of_config).ok_or_else(|| {
            bad("-o", "say where the stars go: -o FILE, or a configuration (-c) with stars.catalogue".into())
        })
    }

    /// Elements first: by their names target frames are known from star pointings.
    pub fn what_is_missing(&self) -> anyhow::Result<()> {
        let Some(config) = self.config else {
            let problem = "no pipeline.toml here: name one with -c, or say what to fetch, e.g. `satphot fetch elements \
                           --norad 25544 -o iss.json`";
            return Err(bad("-c", problem.into()));
        };
        if config.orbit.is_none() && config.stars.is_none() {
            return Err(bad("-c", "the configuration has neither [orbit] nor [stars]: nothing to fetch".into()));
        }
        if let Some(orbit) = &config.orbit {
            if orbit.elements.exists() && !self.verb.force {
                self.there(&orbit.elements);
                self.doubt_old_elements(orbit);
            } else {
                self.elements(&orbit.elements)?;
            }
        }
        if let Some(stars) = &config.stars {
            if stars.catalogue.exists() && !self.verb.force {
                self.there(&stars.catalogue);
            } else {
                self.stars(&stars.catalogue)?;
            }
        }
        Ok(())
    }

    fn there(&self, path: &Path) {
        self.note(&format!("{} is there and stays; --force fetches it again", path.display()));
    }

    /// Elements that are there but too old for the night are a reason to fetch.
    fn doubt_old_elements(&self, orbit: &config::Orbit) {
        let Ok((at, from)) = self.moment() else { return };
        let norad = self.verb.norad.or(orbit.norad_cat_id);
        let Ok((sets, _)) = read_elements_for(&orbit.elements, norad) else { return };
        let Ok(set) = nearest(&sets, norad, &at) else { return };
        let age_d = set.age_d(&at).abs();
        if age_d > orbit.max_age_d {
            self.note(&format!(
                "its elements of {} are {age_d:.1} d from {} ({from}), more than orbit.max_age_d = {} d",
                set.label(),
                iso_utc(at, 0),
                orbit.max_age_d
            ));
        }
    }

    fn object(&self) -> anyhow::Result<Object> {
        let of_config = || self.config.and_then(|c| c.orbit.as_ref()).and_then(|o| o.norad_cat_id);
        match (&self.verb.name, self.verb.norad.or_else(of_config)) {
            (Some(name), _) => Ok(Object::Name(name.trim().to_owned())),
            (None, Some(number)) => Ok(Object::Number(number)),
            (None, None) => {
                let problem = "which object? Give its catalogue number, e.g. --norad 25544 for the ISS, or orbit.norad_cat_id \
                               in the configuration, or --name \"ISS (ZARYA)\"";
                Err(bad("--norad", problem.into()))
            }
        }
    }

    /// The moment elements are for, and its source.
    fn moment(&self) -> anyhow::Result<(Epoch, &'static str)> {
        if let Some(date) = &self.verb.date {
            let at = parse_utc("--date", date)?;
            // a date alone means its noon: elements of either side of it serve
            let is_date_only = satphot::base::instant::read(date).is_ok_and(|t| t.is_date_only && !t.has_zone);
            return Ok((if is_date_only { shifted(at, 43_200.0) } else { at }, "--date"));
        }
        let Some(config) = self.config else { return Ok((*self.client.now(), "now")) };
        if let Ok(survey) = survey(config, &[], &[]) {
            let lights = survey.targets.iter().chain(survey.pointings.iter().flatten());
            let mut mids: Vec<Epoch> = lights.filter_map(|e| e.time.as_ref().map(|t| t.mid)).collect();
            mids.sort();
            if let Some(mid) = mids.get(mids.len() / 2) {
                return Ok((*mid, "the night's frames"));
            }
        }
        let name = config.night.name.get(..10).unwrap_or_default();
        match parse_utc("night.name", &format!("{name}T12:00:00")) {
            Ok(noon) => Ok((noon, "night.name")),
            Err(_) => {
                self.note("no frames and no date in night.name: elements for now; --date names another moment");
                Ok((*self.client.now(), "now"))
            }
        }
    }

    pub fn elements(&self, path: &Path) -> anyhow::Result<()> {
        self.may_write(path)?;
        let object = self.object()?;
        let (at, from) = self.moment()?;
        let tle_name =
            path.extension().is_some_and(|e| ["tle", "3le", "txt"].iter().any(|t| e.eq_ignore_ascii_case(t)));
        let tle = match (self.verb.format, &object) {
            (Some(format), _) => format == ElementFormat::Tle,
            // numbers above 69999 are about to have no TLE any more
            (None, Object::Number(number)) => tle_name && *number < 70_000,
            (None, Object::Name(_)) => false,
        };
        let of_config = self.config.and_then(|c| c.orbit.as_ref()).map(|o| o.max_age_d);
        let wanted = Wanted {
            object,
            at,
            service: match self.verb.source {
                None => WhichService::Auto,
                Some(ElementSource::Celestrak) => WhichService::CelesTrak,
                Some(ElementSource::Satchecker) => WhichService::SatChecker,
            },
            tle,
            max_age_d: self.verb.max_age_d.or(of_config).unwrap_or(14.0),
        };
        if self.verb.dry_run {
            let queries = element_queries(&wanted, self.settings, self.client.now());
            queries.iter().for_each(|q| print(&format!("{}\n", q.shown())));
            if queries.len() > 1 {
                self.note("the second address only if the first has no elements near enough");
            }
            return Ok(());
        }
        (self.say)(&format!("elements of {} for {} ({from})", wanted.object.label(), iso_utc(at, 0)));
        let fetched = fetch_elements(self.client, &wanted, self.settings)?;
        let set = &fetched.elements;
        write_atomic(path, fetched.text.as_bytes())?;
        let age_d = set.age_d(&at);
        let side = if age_d < 0.0 { "after" } else { "before" };
        (self.say)(&format!(
            "wrote {}: {} of {}, {}, {:.1} d {side} {}",
            path.display(),
            set.label(),
            iso_utc(set.epoch(), 0),
            set.format(),
            age_d.abs(),
            iso_utc(at, 0)
        ));
        if age_d.abs() > 2.0 {
            self.note(&format!("elements {:.1} d from the night: positions may be off by kilometres", age_d.abs()));
        }
        if !tle && !set.format().starts_with("OMM") {
            self.note(
                "the archive keeps TLE for that date: the file holds one, whatever its name or --format; satphot determines the format by \
                 its content",
            );
        }
        if tle_name && set.format().starts_with("OMM") {
            self.note(
                "the file holds OMM JSON, which satphot recognises by its content; other programs may go by its name",
            );
        }
        print(&format!("{}\n", path.display()));
        Ok(())
    }

    pub fn stars(&self, path: &Path) -> anyhow::Result<()> {
        self.may_write(path)?;
        let fields = self.fields()?;
        if self.verb.dry_run {
            for f in &fields {
                print(&format!("{}\n", apass_query(self.settings, f.ra_deg, f.dec_deg, f.radius_deg).shown()));
            }
            return Ok(());
        }
        (self.say)(&format!("stars of {} fields, from {}", fields.len(), fields[0].source));
        let fetched = fetch_stars(self.client, &fields, self.settings)?;
        let n_read = self.write_catalogue(path, &fetched.text)?;
        let mut also = String::new();
        for (n, what) in [(fetched.n_repeated, "in several fields"), (fetched.n_without_v, "without V skipped")] {
            if n > 0 {
                also += &format!(", {n} {what}");
            }
        }
        (self.say)(&format!("wrote {}: {} stars of APASS DR9{also}; {n_read} usable", path.display(), fetched.n));
        fetched.empty.iter().for_each(|field| self.note(&format!("no star at {field}")));
        print(&format!("{}\n", path.display()));
        Ok(())
    }

    /// Fields of the command line, else of the night's frames.
    fn fields(&self) -> anyhow::Result<Vec<Field>> {
        if let (Some(ra_deg), Some(dec_deg)) = (self.verb.ra_deg, self.verb.dec_deg) {
            let radius_deg = self.verb.radius_deg.unwrap_or(0.5);
            return Ok(vec![Field::new(ra_deg, dec_deg, radius_deg, "--ra-deg --dec-deg")]);
        }
        let Some(config) = self.config else {
            let problem =
                "needs a field: --ra-deg, --dec-deg and --radius-deg, or a configuration (-c) with star frames";
            return Err(bad("--ra-deg", problem.into()));
        };
        let night = survey(config, &[], &self.target_names(config))?;
        let (mut fields, silent) = fields_of_night(config, &night, self.verb.radius_deg);
        if let Some(first) = silent.first() {
            let n = silent.len();
            self.note(&format!(
                "{n} star frames do not say where they point, first {first}: --ra-deg and --dec-deg do"
            ));
        }
        if config.zeropoint.star_trails && !night.targets.is_empty() {
            match config.orbit.as_ref().map(|orbit| Tracker::from_config(orbit, &config.site)) {
                Some(Ok(tracker)) => fields.extend(fields_of_passes(&tracker, config, &night)),
                Some(Err(error)) => {
                    self.note(&format!("without the stars of the passes (zeropoint.star_trails): {error}"))
                }
                None => self.note("without the stars of the passes (zeropoint.star_trails): there is no [orbit]"),
            }
        }
        if fields.is_empty() {
            return Err(no_fields(config, &night, silent.len()));
        }
        Ok(one_query_each(fields))
    }

    /// Names of the target, by which its frames are distinguished from star pointings: of its elements, or as the model calls
    /// it.
    fn target_names(&self, config: &Config) -> Vec<String> {
        let Some(orbit) = &config.orbit else { return Vec::new() };
        if let Ok((sets, _)) = read_elements_for(&orbit.elements, orbit.norad_cat_id) {
            return element_names(&sets);
        }
        let names: Vec<String> =
            config.model.iter().map(|m| m.satellite.clone()).chain(self.verb.name.clone()).collect();
        self.note(&format!(
            "no elements yet: frames of the target are those whose OBJECT holds {}; any other light is taken for a star \
             pointing",
            names.iter().chain(&config.frames.target_objects).map(|n| format!("\"{n}\"")).collect::<Vec<_>>().join(" or ")
        ));
        names
    }

    /// Whether a file may be written, before anything is requested.
    fn may_write(&self, path: &Path) -> anyhow::Result<()> {
        let shown = path.display();
        if path.is_dir() {
            return Err(bad("-o", format!("{shown} is a folder; name a file")));
        }
        if path.exists() && !self.verb.force {
            return Err(bad("-o", format!("{shown} exists already; --force overwrites it, -o names another")));
        }
        let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        if !folder.is_dir() {
            let problem = "no such folder; make it first".into();
            return Err(Error::NoInput { path: folder.to_owned(), problem }.into());
        }
        Ok(())
    }

    /// Writes a catalogue that satphot's reader has taken; the number of stars it found.
    fn write_catalogue(&self, path: &Path, text: &str) -> anyhow::Result<usize> {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let draft = path.with_file_name(format!(".{name}.draft.{}.csv", std::process::id()));
        let columns = self.config.and_then(|c| c.stars.as_ref()).map(|s| s.columns.clone()).unwrap_or_default();
        let written = std::fs::File::create(&draft).and_then(|mut f| f.write_all(text.as_bytes()));
        let read = written.map_err(|e| Error::io(path, e)).and_then(|()| Catalogue::read(&draft, &columns));
        let _ = std::fs::remove_file(&draft); // a draft that stays is a hidden file too many, no error
        let n = read.map_err(|e| match e {
            Error::Catalogue { problem, .. } => Error::Catalogue { path: path.to_owned(), problem },
            other => other,
        })?;
        write_atomic(path, text.as_bytes())?;
        Ok(n.stars.len())
    }
}

/// Why a night has no field to fetch.
fn no_fields(config: &Config, night: &Survey, n_silent: usize) -> anyhow::Error {
    let problem = match n_silent {
        0 => {
            format!("no star pointings among {} files; --ra-deg, --dec-deg and --radius-deg name a field", night.len())
        }
        n => format!(
            "none of {n} star frames says where it points (world coordinates, RA/DEC, OBJCTRA/OBJCTDEC, CENTALT/CENTAZ): give \
             --ra-deg, --dec-deg and --radius-deg, or stars.fields"
        ),
    };
    let path = config.night.input.first().cloned().unwrap_or_default();
    Error::NoInput { path, problem }.into()
}
