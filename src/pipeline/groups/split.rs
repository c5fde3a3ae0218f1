//! A night split into groups of frames: one satellite, through one filter, by one camera.
//!
//! Each group is a night of its own for the reduction: its configuration names satellite, filter, model and camera, its files
//! are its target frames with the star frames and flats of the same filter and camera. A night with a single group is
//! reduced as it is.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use super::by_position::Candidates;
use super::objects::{Assigned, Object, Objects, objects_of};
use crate::bands::{Band, Light, Meaning};
use crate::base::error::{Error, Result};
use crate::base::file::file_name;
use crate::base::stop::Stop;
use crate::brightness::Catalogue;
use crate::config::{Config, Model};
use crate::frames::{Exposure, Role, role_by_name};
use crate::pipeline::stages::bias_and_dark;
use crate::pipeline::survey::files::Survey;
use crate::pipeline::survey::filters::{lights, requested_light};
use crate::pipeline::survey::header_warnings::other_camera;
use crate::pipeline::survey::instrument::focal_mm;
use crate::pipeline::survey::read::survey_until;
use crate::pipeline::target::row::without_folder;
use crate::tables::UngroupedRow;
use crate::tables::words::Status;

/// Frames that are reduced together.
#[derive(Debug)]
pub struct Group {
    /// The configuration of a night that consists of them.
    pub config: Config,
    /// Their files: target frames, star frames, flats.
    pub files: Vec<PathBuf>,
    /// Name of the satellite; empty where the night has no elements or one satellite.
    pub satellite: String,
    /// The filter; empty where the night has one.
    pub filter: String,
    /// The camera; empty where the night has one.
    pub instrument: String,
}

/// A night as it is split.
#[derive(Debug, Default)]
pub struct Split {
    /// The groups; one or none means that the night is reduced as it is, with the configuration of that one.
    pub groups: Vec<Group>,
    /// What should be known of the night as a whole.
    pub notes: Vec<String>,
    /// The files that belong to none of several groups.
    pub ungrouped: Vec<UngroupedRow>,
    /// Star frames, target frames and files that cannot be read: those that can fail.
    pub science: usize,
}

/// Focal lengths of two telescopes with the same camera differ by more than this share.
const ANOTHER_OPTICS_FRAC: f64 = 0.1;

/// What distinguishes groups: camera (0 is that of `[detector]`), satellite, filter.
type Key = (usize, Option<u64>, Light);

/// Splits a night by the headers of its files (or of `files`, if any are given).
///
/// # Errors
/// [`Error::Config`] for a model that is not known; damaged or missing elements are the reduction's to report.
pub fn split(config: &Config, files: &[PathBuf], stop: &Stop) -> Result<Split> {
    let objects = objects_of(config).unwrap_or_default();
    check_models(config)?;
    let several = objects.list().len() > 1
        || (objects.list().len() == 1 && !(config.satellites.is_empty() && objects.warnings.is_empty()));
    if let Some(filter) = config.input.filter.as_ref().filter(|_| !several && config.instruments.is_empty()) {
        return Ok(Split { groups: of_other_band(config, &Light::named(filter)), ..Split::default() });
    }
    let names: Vec<String> = match objects.list() {
        [only] => vec![only.name.clone(), only.norad_cat_id.to_string(), only.object_id.clone()],
        _ => config.model.iter().map(|m| m.satellite.clone()).filter(|_| !several).collect(),
    };
    // what is wrong with the inputs is said by the reduction
    let Ok(survey) = survey_until(config, files, &names, stop) else { return Ok(Split::default()) };
    let mut notes = objects.warnings.clone();
    let parted = Parted::of(&survey, config, &objects, several, &mut notes);
    let groups = parted.groups(config, &objects, several)?;
    if groups.len() < 2 {
        return Ok(Split { groups, notes, ..Split::default() });
    }
    if several {
        notes.extend(without_model(&groups));
    }
    let ungrouped = ungrouped(&survey, &groups, &parted.unassigned);
    let science = survey.targets.len() + survey.n_star_frames() + survey.unreadable.len();
    Ok(Split { groups, notes, ungrouped, science })
}

/// The files that belong to no group, with the reason of each; `unassigned` are target frames whose satellite is not known.
fn ungrouped(survey: &Survey, groups: &[Group], unassigned: &BTreeMap<&Path, String>) -> Vec<UngroupedRow> {
    let grouped: BTreeSet<&Path> = groups.iter().flat_map(|g| &g.files).map(PathBuf::as_path).collect();
    let row = |path: &Path, role: &str, status: Status, reason: String| UngroupedRow {
        frame: file_name(path),
        role: role.into(),
        status: status.into(),
        reason,
        ..UngroupedRow::default()
    };
    let left = survey.flats.iter().chain(survey.pointings.iter().flatten()).chain(&survey.targets);
    let left = left.filter(|e| !grouped.contains(e.path.as_path())).map(|e| {
        let reason = unassigned.get(e.path.as_path()).cloned();
        let reason = reason.unwrap_or_else(|| "no target frame that is reduced is of its camera and filter".into());
        UngroupedRow {
            object_name: e.object.clone().unwrap_or_default(),
            filter: e.filter.clone().unwrap_or_default(),
            ..row(&e.path, e.role.name(), Status::Rejected, reason)
        }
    });
    let unreadable =
        survey.unreadable.iter().map(|u| row(&u.path, "", Status::Failed, without_folder(&u.error, &u.path)));
    let aside = survey.set_aside.iter().map(|s| row(&s.path, s.role.name(), Status::Rejected, s.reason.clone()));
    left.chain(unreadable).chain(aside).collect()
}

/// Target frames whose OBJECT does not say which satellite they are of.
struct ByPosition<'a> {
    config: &'a Config,
    /// Made when the first frame needs them.
    candidates: Option<Result<Candidates>>,
    found: usize,
    /// OBJECT of frames that name no satellite and follow one, its number, and how many they are.
    following: Vec<(String, u64, usize)>,
    /// The frames that could not be assigned, with the reason.
    unassigned: BTreeMap<&'a Path, String>,
    /// OBJECT and the reason of the first frame that could not be assigned, and how many there are.
    unused: BTreeMap<String, (String, usize)>,
}

impl<'a> ByPosition<'a> {
    fn new(config: &'a Config) -> Self {
        let (following, unassigned, unused) = Default::default();
        Self { config, candidates: None, found: 0, following, unassigned, unused }
    }

    fn candidates(&mut self) -> &Result<Candidates> {
        let config = self.config;
        self.candidates.get_or_insert_with(|| Candidates::of(config))
    }

    /// The satellite that the frames of an OBJECT follow, which names none.
    fn followed(&mut self, object: &str, frames: &[&Exposure]) -> Option<u64> {
        let config = self.config;
        let number = self.candidates().as_ref().ok()?.followed(frames, config)?;
        self.following.push((object.to_owned(), number, frames.len()));
        Some(number)
    }

    /// The satellite that the header points at.
    fn of(&mut self, exposure: &'a Exposure, among: &[u64]) -> Option<u64> {
        let config = self.config;
        let nearest = match self.candidates() {
            Ok(candidates) => candidates.nearest(exposure, among, config),
            Err(error) => Err(error.to_string()),
        };
        match nearest {
            Ok(number) => {
                self.found += 1;
                Some(number)
            }
            Err(reason) => {
                let object = exposure.object.clone().unwrap_or_default();
                self.unassigned
                    .insert(&exposure.path, format!("OBJECT names no satellite of the elements or several; {reason}"));
                let reason = || (format!("{} {reason}", exposure.name), 0);
                self.unused.entry(object).or_insert_with(reason).1 += 1;
                None
            }
        }
    }

    fn notes(&self, objects: &Objects) -> Vec<String> {
        let mut notes: Vec<String> = Vec::new();
        for (object, number, n) in &self.following {
            let name = objects.get(*number).map(Object::label).unwrap_or_default();
            notes.push(format!(
                "{n} frames with OBJECT = '{object}', which names no satellite of the elements, follow {name} [{number}] across the \
                 sky and are taken as target frames of it; [[satellites]] with objects and norad_cat_id says so for good, \
                 frames.stars makes them star frames"
            ));
        }
        if self.found > 0 {
            notes.push(format!("{} frames are assigned to satellites by where their headers point", self.found));
        }
        notes.extend(self.unused.iter().map(|(object, (reason, n))| {
            format!(
                "{n} target frames with OBJECT = '{object}' are not used: it names no satellite of the elements or several, and \
                 the position does not tell ({reason}); give the number in [[satellites]] with norad_cat_id"
            )
        }));
        notes
    }
}

/// The frames of a night by what distinguishes groups.
struct Parted<'a> {
    targets: BTreeMap<Key, Vec<&'a Exposure>>,
    stars: BTreeMap<(usize, Light), Vec<&'a Exposure>>,
    flats: BTreeMap<(usize, Light), Vec<&'a Exposure>>,
    /// Biases and darks of each camera.
    zeros: BTreeMap<usize, Vec<&'a Exposure>>,
    /// Target frames whose satellite is not known, with the reason.
    unassigned: BTreeMap<&'a Path, String>,
    /// OBJECT of frames that name no satellite and follow one, and its number.
    following: Vec<(String, u64)>,
}

impl<'a> Parted<'a> {
    fn of(survey: &'a Survey, config: &'a Config, objects: &Objects, several: bool, notes: &mut Vec<String>) -> Self {
        let light_of = lights(survey, config);
        let requested = requested_light(survey, config);
        let is_requested = |e: &&Exposure| requested.as_ref().is_none_or(|light| light_of(e) == *light);
        let cameras: Vec<Config> = (0..=config.instruments.len()).map(|i| of_instrument(config, i)).collect();
        let camera = |e: &Exposure| instrument_of(e, &cameras, config);
        // a file name that [frames] makes a star frame wins over OBJECT
        let is_named = |e: &Exposure| role_by_name(&e.name, config).is_some();
        let (targets, stars, flats, zeros, unassigned, following) = Default::default();
        let mut parted = Self { targets, stars, flats, zeros, unassigned, following };
        // frames that are star frames by their OBJECT alone
        let mut unnamed: BTreeMap<&str, Vec<&Exposure>> = BTreeMap::new();
        let mut assigned: BTreeMap<&str, Assigned> = BTreeMap::new();
        let mut by_position = ByPosition::new(config);
        for exposure in survey.pointings.iter().flatten().chain(&survey.targets).filter(is_requested) {
            let object = exposure.object.as_deref().unwrap_or("");
            let named = match several {
                true => assigned.entry(object).or_insert_with(|| objects.assign(object, &config.satellites)).clone(),
                false => Assigned::NoSatellite,
            };
            let (i, light) = (camera(exposure), light_of(exposure));
            match (named, exposure.role) {
                (Assigned::Satellite(number), _) if exposure.role == Role::Target || !is_named(exposure) => {
                    parted.targets.entry((i, Some(number), light)).or_default().push(exposure);
                }
                (_, Role::Target) if !several => parted.targets.entry((i, None, light)).or_default().push(exposure),
                (Assigned::Ambiguous(candidates), _) => {
                    if let Some(number) = by_position.of(exposure, &candidates) {
                        parted.targets.entry((i, Some(number), light)).or_default().push(exposure);
                    }
                }
                (_, Role::Target) => {
                    if let Some(number) = by_position.of(exposure, &[]) {
                        parted.targets.entry((i, Some(number), light)).or_default().push(exposure);
                    }
                }
                _ if several && !is_named(exposure) => unnamed.entry(object).or_default().push(exposure),
                _ => parted.stars.entry((i, light)).or_default().push(exposure),
            }
        }
        for (object, frames) in unnamed {
            let number = if object.is_empty() { None } else { by_position.followed(object, &frames) };
            for exposure in frames {
                let (i, light) = (camera(exposure), light_of(exposure));
                match number {
                    Some(_) => parted.targets.entry((i, number, light)).or_default().push(exposure),
                    None => parted.stars.entry((i, light)).or_default().push(exposure),
                }
            }
        }
        for exposure in survey.flats.iter().filter(is_requested) {
            parted.flats.entry((camera(exposure), light_of(exposure))).or_default().push(exposure);
        }
        for exposure in bias_and_dark(survey, config) {
            parted.zeros.entry(camera(exposure)).or_default().push(exposure);
        }
        notes.extend(by_position.notes(objects));
        parted.unassigned = by_position.unassigned;
        parted.following = by_position.following.into_iter().map(|(object, number, _)| (object, number)).collect();
        parted
    }

    /// A night of one kind: the group of a band other than V, for which the configuration need not say more; none for V.
    fn of_one_kind(&self, config: &Config) -> Vec<Group> {
        let Some((_, _, light)) = self.targets.keys().next() else { return Vec::new() };
        if self.stars.keys().all(|(_, of_stars)| of_stars == light) { of_other_band(config, light) } else { Vec::new() }
    }

    fn groups(&self, config: &Config, objects: &Objects, several: bool) -> Result<Vec<Group>> {
        let count = |f: &dyn Fn(&Key) -> String| self.targets.keys().map(f).collect::<BTreeSet<_>>().len();
        let n_lights = count(&|(_, _, light)| light.filter.clone());
        let n_satellites = count(&|(_, number, _)| format!("{number:?}"));
        let n_cameras = count(&|(i, ..)| i.to_string());
        if n_lights * n_satellites * n_cameras == 0 {
            return Ok(Vec::new()); // its faults are the reduction's to report
        }
        if n_lights == 1 && n_cameras == 1 && !several {
            return Ok(self.of_one_kind(config));
        }
        // a filter with targets and without stars cannot be calibrated: the reduction says so, with the counts of all
        let fits = config.stars.is_some() && config.zeropoint.previous.is_none();
        let lacks = |(i, _, light): &Key| !self.stars.contains_key(&(*i, light.clone()));
        if n_lights > 1 && n_cameras == 1 && !several && fits && self.targets.keys().any(lacks) {
            return Ok(Vec::new());
        }
        let mut groups = Vec::new();
        for (key @ (i, number, light), targets) in &self.targets {
            let own = (*i, light.clone());
            let stars = self.stars.get(&own).into_iter().flatten();
            // without own flats those of the other filters are shown to the reduction, which refuses or explains them
            let flats: Vec<&&Exposure> = match self.flats.get(&own) {
                Some(own) => own.iter().collect(),
                None => self.flats.iter().filter(|((camera, _), _)| camera == i).flat_map(|(_, f)| f).collect(),
            };
            let object = number.and_then(|n| objects.get(n));
            let instrument = match i.checked_sub(1).and_then(|at| config.instruments.get(at)) {
                Some(instrument) => instrument.name.clone(),
                None => config.detector.camera.clone(),
            };
            let mut group = Group {
                config: of_instrument(config, *i),
                files: targets
                    .iter()
                    .chain(stars)
                    .chain(flats)
                    .chain(self.zeros.get(i).into_iter().flatten())
                    .map(|e| e.path.clone())
                    .collect(),
                satellite: object.map(Object::label).unwrap_or_default(),
                filter: if n_lights > 1 { light.filter.clone() } else { String::new() },
                instrument: if n_cameras > 1 { instrument } else { String::new() },
            };
            let only = n_lights * n_satellites * n_cameras == 1;
            if let (Some(number), Some(object), Some(orbit)) = (number, object, &mut group.config.orbit) {
                orbit.norad_cat_id = Some(*number);
                group.config.model = model_of(config, object, only)?;
                let follows = self.following.iter().filter(|(_, followed)| followed == number);
                group.config.frames.target_objects.extend(follows.map(|(object, _)| object.clone()));
            }
            if n_lights > 1 {
                through(&mut group.config, light);
            }
            if !only {
                let label = label(&group, n_satellites > 1, key);
                group.config.night.output = config.night.output.join(&config.night.name);
                group.config.night.name = format!("{}-{label}", config.night.name);
            }
            groups.push(group);
        }
        Ok(groups)
    }
}

/// The part of a group's name that distinguishes it from the others: `iss-zarya`, `iss-zarya-V`, `V-qhy600m`.
fn label(group: &Group, several_satellites: bool, (_, number, _): &Key) -> String {
    let plain = |text: &str| {
        let words = text.split(|c: char| !c.is_ascii_alphanumeric()).filter(|w| !w.is_empty());
        words.collect::<Vec<_>>().join("-")
    };
    let satellite = if several_satellites { plain(&group.satellite).to_lowercase() } else { String::new() };
    let satellite = match number.filter(|_| several_satellites && satellite.is_empty()) {
        Some(number) => number.to_string(),
        None => satellite,
    };
    let parts = [satellite, plain(&group.filter), plain(&group.instrument).to_lowercase()];
    parts.into_iter().filter(|p| !p.is_empty()).collect::<Vec<_>>().join("-")
}

/// Which instrument a frame is of: the one of its camera, and of several those of its binning and focal length; 0, that of
/// `[detector]`, where none is of its camera.
fn instrument_of(exposure: &Exposure, cameras: &[Config], config: &Config) -> usize {
    let binning = |i: usize| config.instruments.get(i.checked_sub(1)?)?.binning;
    let of_camera = |i: &usize| {
        other_camera(exposure, &cameras[*i]).is_none() && binning(*i).is_none_or(|own| own == exposure.binning)
    };
    let focal_mm = focal_mm(exposure);
    let of_optics = |i: &usize| {
        focal_mm.is_none_or(|mm| (cameras[*i].telescope.focal_length_mm / mm - 1.0).abs() < ANOTHER_OPTICS_FRAC)
    };
    let own: Vec<usize> = (0..cameras.len()).filter(of_camera).collect();
    let narrow = |of: &dyn Fn(&usize) -> bool| own.iter().find(|i| of(i)).copied();
    narrow(&|i| binning(*i).is_some() && of_optics(i))
        .or_else(|| narrow(&of_optics))
        .or_else(|| narrow(&|i| binning(*i).is_some()))
        .or_else(|| own.first().copied())
        .unwrap_or(0)
}

/// The configuration with the camera and the optics of `[[instruments]]`; 0 is that of `[detector]`.
fn of_instrument(config: &Config, i: usize) -> Config {
    let mut own = config.clone();
    own.instruments.clear();
    if let Some(instrument) = i.checked_sub(1).and_then(|at| config.instruments.get(at)) {
        own.detector = instrument.detector.clone();
        own.telescope = instrument.telescope.clone().unwrap_or(own.telescope);
        own.photometry.clip_radius_px = instrument.clip_radius_px.or(own.photometry.clip_radius_px);
    }
    own
}

/// The group of a night of one filter, if that is of a band other than V.
fn of_other_band(config: &Config, light: &Light) -> Vec<Group> {
    if !matches!(light.meaning, Meaning::Band(band) if band.reference() != Band::V) {
        return Vec::new();
    }
    let mut own = config.clone();
    in_band(&mut own, light);
    let (satellite, filter, instrument) = Default::default();
    vec![Group { config: own, files: Vec::new(), satellite, filter, instrument }]
}

/// The configuration of frames through one of several filters: its name, its band, and the model in it.
fn through(config: &mut Config, light: &Light) {
    let unfiltered = light.meaning == Meaning::Unfiltered;
    config.input.filter = Some(if unfiltered { "none".into() } else { light.filter.clone() });
    in_band(config, light);
}

/// The configuration of frames of a known band: the catalogue's magnitudes and the model are of it.
fn in_band(config: &mut Config, light: &Light) {
    let Meaning::Band(band) = light.meaning else { return };
    if config.photometry.band.is_some() {
        return; // what the observer declares
    }
    config.photometry.band = Some(band);
    if let Some(model) = config.model.as_mut().filter(|m| m.band == Band::V.name()) {
        let name = band.reference().name();
        if Model::BANDS.contains(&name) {
            model.band = name.into();
        } else {
            config.model = None; // a model of V says nothing of this band
        }
    }
}

/// The model of a satellite: that of the first entry of `[[satellites]]` that is of it, else `[model]` where that is a
/// model of this satellite or the night has no other.
pub fn model_of(config: &Config, object: &Object, only: bool) -> Result<Option<Model>> {
    let of = |name: &String| match &config.model {
        Some(model) if model.satellite == *name => model.clone(),
        Some(model) => Model { satellite: name.clone(), surfaces: Vec::new(), ..model.clone() },
        None => Model::of(name),
    };
    let is_of = |rule: &&crate::config::SatelliteEntry| {
        rule.norad_cat_id == Some(object.norad_cat_id) || rule.objects.iter().any(|p| object.is_of(p))
    };
    if let Some(rule) = config.satellites.iter().find(is_of) {
        return Ok(rule.model.as_ref().map(of));
    }
    let Some(model) = &config.model else { return Ok(None) };
    let catalogue = Catalogue::load(model.satellites.as_deref())?;
    let is_of_model = catalogue.find(&model.satellite).is_ok_and(|e| e.is_of(&object.name, object.norad_cat_id));
    Ok((only || is_of_model).then(|| model.clone()))
}

/// The satellites without a model, and the bands without one, said once.
fn without_model(groups: &[Group]) -> Vec<String> {
    let (mut of_satellites, mut of_bands) = (BTreeSet::new(), BTreeSet::new());
    let has_model = |name: &str| groups.iter().any(|g| g.satellite == name && g.config.model.is_some());
    for group in groups.iter().filter(|g| g.config.model.is_none()) {
        match has_model(&group.satellite) {
            true => of_bands.insert(group.filter.as_str()),
            false => of_satellites.insert(group.satellite.as_str()),
        };
    }
    let listed = |names: &BTreeSet<&str>| {
        let shown = names.iter().take(5).copied().collect::<Vec<_>>().join(", ");
        if names.len() > 5 { format!("{shown} and {} more", names.len() - 5) } else { shown }
    };
    let mut notes = Vec::new();
    if !of_satellites.is_empty() {
        notes.push(format!(
            "{}: measured without a model, so without residuals; [[satellites]] with objects and model names one",
            listed(&of_satellites)
        ));
    }
    if !of_bands.is_empty() {
        notes.push(format!(
            "filter {}: measured without a model, which knows the Sun in {} alone",
            listed(&of_bands),
            Model::BANDS.join(", ")
        ));
    }
    notes
}

/// Refuses a model of `[[satellites]]` that is not known.
fn check_models(config: &Config) -> Result<()> {
    let named: Vec<&String> = config.satellites.iter().filter_map(|s| s.model.as_ref()).collect();
    if named.is_empty() {
        return Ok(());
    }
    let catalogue = Catalogue::load(config.model.as_ref().and_then(|m| m.satellites.as_deref()))?;
    for name in named {
        catalogue.find(name).map_err(|error| match error {
            Error::Config { problem, .. } => Error::Config { key: "satellites.model".into(), problem },
            other => other,
        })?;
    }
    Ok(())
}
