//! Which filter of a night is reduced, and the band of the result.
//!
//! A run reduces the frames of one filter: that of `input.filter`, or the only one among the star and target frames. Frames
//! of others are set aside with their reason and counted. What the filter, the catalogue, a zeropoint of another night and
//! the user say of the band must agree before any pixel is read ([`CalibratedBand::of`]).

use std::collections::BTreeMap;
use std::path::Path;

use crate::bands::Band;
use crate::bands::CalibratedBand;
use crate::bands::Light;
use crate::bands::Meaning;
use crate::bands::filter_meaning;
use crate::base::error::{Error, Result};
use crate::config::Config;
use crate::fits::Header;
use crate::frames::header::filter;
use crate::frames::{Exposure, Role};
use crate::pipeline::prepared::Prepared;
use crate::pipeline::survey::files::Survey;
use crate::zeropoint::fit::Zeropoint;

/// Frames of one filter by role: flats, star frames, target frames.
type Counts = BTreeMap<Light, [usize; 3]>;

/// What the other filters of a night say about R, G and B: `L` with them means a set for colour imaging, V or I
/// Johnson-Cousins.
#[derive(Debug, Clone, Copy, Default)]
struct FilterContext {
    colour_set: bool,
    johnson: bool,
    named: Option<Band>,
}

impl FilterContext {
    fn of<'a>(texts: impl Iterator<Item = &'a str>, config: &Config) -> Self {
        let requested = config.input.filter.as_deref().map(filter_meaning);
        let named = config.photometry.band.or(match requested {
            Some(Meaning::Band(band)) => Some(band),
            _ => None,
        });
        let mut context = Self { named, ..Self::default() };
        for text in texts {
            match filter_meaning(text) {
                Meaning::Band(Band::TriBlue | Band::TriGreen | Band::TriRed) => context.colour_set = true,
                Meaning::Band(Band::U | Band::B | Band::V | Band::R | Band::I | Band::RJohnson | Band::IJohnson) => {
                    context.johnson = true;
                }
                Meaning::Unfiltered if text.trim().to_lowercase().starts_with('l') => context.colour_set = true,
                _ => {}
            }
        }
        context
    }

    /// The filter of a text, with its letter resolved by the other filters.
    fn light(self, text: &str) -> Light {
        let band = |band: Band| Light { filter: band.name().to_owned(), meaning: Meaning::Band(band) };
        match filter_meaning(text) {
            Meaning::Unfiltered => Light::unfiltered(),
            Meaning::Band(own) => band(own),
            Meaning::Either(a, b) => match (self.named, self.johnson, self.colour_set) {
                (Some(named), ..) if named == a || named == b => band(named),
                (_, true, false) if a.mag_system() == "Vega" => band(a),
                (_, false, true) => band(b),
                _ => Light { filter: text.trim().to_owned(), meaning: Meaning::Either(a, b) },
            },
            // widths and spaces aside, `Ha` and `H-alpha 7nm` may be two filters: they stay apart
            meaning => Light { filter: text.trim().to_owned(), meaning },
        }
    }
}

/// The filter of each frame of a night, with ambiguous letters resolved by the other filters.
pub(crate) fn lights(survey: &Survey, config: &Config) -> impl Fn(&Exposure) -> Light {
    let context = FilterContext::of(frames(survey).map(|(_, e)| text_of(e)), config);
    move |exposure| context.light(text_of(exposure))
}

/// The filter that `input.filter` names, in a night of several satellites or cameras.
pub(crate) fn requested_light(survey: &Survey, config: &Config) -> Option<Light> {
    let context = FilterContext::of(frames(survey).map(|(_, e)| text_of(e)), config);
    config.input.filter.as_deref().map(|requested| context.light(requested))
}

fn text_of(exposure: &Exposure) -> &str {
    exposure.filter.as_deref().unwrap_or("")
}

/// Leaves the frames of one filter in the survey and sets those of others aside; [`aside_notes`] reports what was set
/// aside.
///
/// # Errors
/// [`Error::Config`] naming `input.filter`, with every filter and its counts by role and the line to write, where star and
/// target frames are of several filters and none is named, where the one named is not there, and where there are
/// flats but none of the filter of the frames.
pub fn reduce_one_filter(survey: &mut Survey, config: &Config) -> Result<()> {
    let context = FilterContext::of(frames(survey).map(|(_, e)| text_of(e)), config);
    let mut counts = Counts::new();
    for (role, exposure) in frames(survey) {
        counts.entry(context.light(text_of(exposure))).or_default()[role] += 1;
    }
    let Some(light) = chosen(&counts, context, config)? else { return Ok(()) };
    let is_other = |e: &Exposure| context.light(text_of(e)) != light;
    let mut aside: Vec<Exposure> = Vec::new();
    let mut take = |list: &mut Vec<Exposure>| {
        let (other, own): (Vec<_>, Vec<_>) = std::mem::take(list).into_iter().partition(is_other);
        *list = own;
        aside.extend(other);
    };
    take(&mut survey.flats);
    survey.pointings.iter_mut().for_each(&mut take);
    take(&mut survey.targets);
    survey.pointings.retain(|p| !p.is_empty());
    for mut exposure in aside {
        let what = exposure.role.name();
        exposure.role_reason = format!(
            "{what} frame of another filter ({}) than the one reduced, {}",
            shown(text_of(&exposure)),
            light.filter
        );
        exposure.role = Role::OtherFilter;
        survey.others.push(exposure);
    }
    survey.light = Some(light);
    Ok(())
}

/// Flats (0), star frames (1) and target frames (2).
fn frames(survey: &Survey) -> impl Iterator<Item = (usize, &Exposure)> {
    let stars = survey.pointings.iter().flatten();
    let flats = survey.flats.iter().map(|e| (0, e));
    flats.chain(stars.map(|e| (1, e))).chain(survey.targets.iter().map(|e| (2, e)))
}

fn shown(text: &str) -> String {
    if text.trim().is_empty() { "no FILTER".into() } else { format!("FILTER = '{}'", text.trim()) }
}

/// The filter to reduce; `None` where there are no frames.
fn chosen(counts: &Counts, context: FilterContext, config: &Config) -> Result<Option<Light>> {
    let refuse = |problem: String| Err(Error::Config { key: "input.filter".into(), problem });
    let lights: Vec<&Light> = counts.iter().filter(|(_, n)| n[1] + n[2] > 0).map(|(light, _)| light).collect();
    // `satphot flat` has nothing but flats
    let candidates: Vec<&Light> = if lights.is_empty() { counts.keys().collect() } else { lights };
    let listed = || {
        let line = |(light, [flats, stars, targets]): (&Light, &[usize; 3])| {
            format!("{}: {flats} flats, {stars} star frames, {targets} target frames", light.filter)
        };
        counts.iter().map(line).collect::<Vec<_>>().join("; ")
    };
    let paste = |light: &Light| {
        let name = if light.meaning == Meaning::Unfiltered { "none" } else { &light.filter };
        format!("[input]\nfilter = \"{name}\"")
    };
    // the one with most target frames is the likeliest
    let likely = candidates.iter().max_by_key(|light| counts.get(**light).map_or([0; 3], |n| [n[2], n[1], n[0]]));
    let Some(likely) = likely else { return Ok(None) };
    if let Some(requested) = &config.input.filter {
        let wanted = context.light(requested);
        let spelled = |light: &&&Light| light.filter.eq_ignore_ascii_case(requested.trim());
        let exact = candidates.iter().find(|light| ***light == wanted);
        return match exact.or_else(|| candidates.iter().find(spelled)) {
            Some(light) => Ok(Some((*light).clone())),
            None => refuse(format!(
                "\"{requested}\": no star or target frame is of this filter; the night holds {}",
                listed()
            )),
        };
    }
    if candidates.len() > 1 {
        return refuse(format!(
            "the night has frames of several filters and a run reduces one: {}; name it:\n{}",
            listed(),
            paste(likely)
        ));
    }
    let flats: usize = counts.values().map(|n| n[0]).sum();
    let own_flats = counts.get(*likely).map_or(0, |n| n[0]);
    if flats > 0 && own_flats == 0 && config.flat.master.is_none() {
        return refuse(format!(
            "the flats are of another filter than the frames they should flatten: {}; name a master flat of this filter in \
             flat.master (`flat` makes one, also of flats without FILTER), or reduce \
             without flats:\n{}",
            listed(),
            paste(likely)
        ));
    }
    Ok(Some((*likely).clone()))
}

/// What of the night is not used because it is of another filter or another satellite, and unfiltered frames under several
/// names.
#[must_use]
pub fn aside_notes(survey: &Survey) -> Vec<String> {
    let mut counted: BTreeMap<(Role, String), usize> = BTreeMap::new();
    for e in &survey.others {
        let what = match e.role {
            Role::OtherTarget => e.object.clone().unwrap_or_default(),
            Role::OtherFilter => shown(text_of(e)),
            _ => continue,
        };
        *counted.entry((e.role, what)).or_default() += 1;
    }
    let mut notes: Vec<String> = counted
        .into_iter()
        .map(|((role, what), n)| match role {
            Role::OtherTarget => format!("{n} frames of another satellite, OBJECT = '{what}', are not used"),
            _ => {
                let light = survey.light.as_ref().map_or("", |l| &l.filter);
                format!("{n} frames with {what} are not used: this run reduces {light}")
            }
        })
        .collect();
    let unfiltered = survey.light.as_ref().is_some_and(|l| l.meaning == Meaning::Unfiltered);
    let mut names: Vec<&str> = frames(survey).map(|(_, e)| text_of(e).trim()).collect();
    names.sort_unstable();
    names.dedup();
    if unfiltered && names.len() > 1 {
        let names: Vec<String> = names.into_iter().map(shown).collect();
        notes.push(format!(
            "unfiltered frames are named in several ways ({}) and taken as one filter; if one of them is a piece of glass that \
             the others lack, the zeropoint is off",
            names.join(", ")
        ));
    }
    notes
}

/// Brings filter, catalogue, master flat, zeropoint of another night and the user's declaration together, before pixels are
/// read, and puts the band of the result on the prepared; returns what should be known. `fits` = the run fits a zeropoint to
/// its own star frames unless another night's is given.
///
/// # Errors
/// [`Error::Config`] where they contradict each other: `photometry.band`, `flat.master`, `zeropoint.previous`, `model.band`.
pub fn agree_on_band(survey: &Survey, prepared: &mut Prepared, fits: bool) -> Result<Vec<String>> {
    let mut notes = aside_notes(survey);
    let Some(light) = survey.light.clone() else { return Ok(notes) };
    let declared = prepared.config.photometry.band;
    if let Some(path) = &prepared.config.flat.master {
        notes.extend(check_master(path, &light, &prepared.config)?);
    }
    let reference = match (&prepared.config.zeropoint.previous, &prepared.catalogue) {
        (Some(path), _) => {
            // a file that cannot be read is reported where its numbers are read
            let previous = Zeropoint::read(path)?;
            notes.extend(check_previous(&previous, path, &light)?);
            let file =
                path.file_name().map_or_else(|| path.display().to_string(), |n| n.to_string_lossy().into_owned());
            Some((Some(Band::or_v(previous.band)), format!("the zeropoint {file}")))
        }
        (None, Some(catalogue)) if fits && survey.n_star_frames() > 0 => {
            Some((catalogue.band, catalogue.band_from.clone()))
        }
        _ => None,
    };
    let Some((band, from)) = reference else { return Ok(notes) };
    let calibrated = CalibratedBand::of(&light, (band, &from), declared)?;
    notes.push(format!("magnitudes are {}", calibrated.text()));
    notes.extend(crate::pipeline::compare::band_of_model(&prepared.config, calibrated.band)?);
    prepared.band = Some(calibrated);
    Ok(notes)
}

/// A master flat of another filter flattens nothing.
///
/// # Errors
/// [`Error::Config`] where its header names another filter.
pub(crate) fn check_master(path: &Path, light: &Light, config: &Config) -> Result<Option<String>> {
    // damage to the file is reported when its pixels are read
    let Ok(header) = Header::read(path) else { return Ok(None) };
    let Some(stated) = filter(&header, &config.header.aliases) else {
        let known = light.meaning != Meaning::Unfiltered;
        let note =
            || format!("the master flat {} does not say its filter; the frames are {}", path.display(), light.filter);
        return Ok(known.then(note));
    };
    let meant = config.input.filter_of(Some(stated.value.clone())).unwrap_or_default();
    let own = FilterContext { named: band_of(light), ..FilterContext::default() }.light(&meant);
    if own == *light {
        return Ok(None);
    }
    Err(Error::Config {
        key: "flat.master".into(),
        problem: format!(
            "{} is a flat of {} ({} = '{}'), the frames are {}; name the master of their own filter",
            path.display(),
            own.filter,
            stated.source,
            stated.value,
            light.filter
        ),
    })
}

fn band_of(light: &Light) -> Option<Band> {
    match light.meaning {
        Meaning::Band(band) => Some(band),
        _ => None,
    }
}

/// A zeropoint holds for the filter it was made through.
fn check_previous(zeropoint: &Zeropoint, path: &Path, light: &Light) -> Result<Option<String>> {
    let unknown = |what: &str, taken: &str| {
        Ok(Some(format!("the zeropoint {} does not say its {what}: it is taken as {taken}", path.display())))
    };
    match (&zeropoint.light, zeropoint.band) {
        (Some(own), _) if own == light || band_of(light).is_some_and(|b| own.meaning == Meaning::Band(b)) => Ok(None),
        (Some(own), _) => Err(Error::Config {
            key: "zeropoint.previous".into(),
            problem: format!(
                "{} was made with frames of {}, these are of {}; name a zeropoint of the same filter",
                path.display(),
                own.filter,
                light.filter
            ),
        }),
        (None, Some(band)) => unknown("filter", &format!("that of these frames, {}, its band is {band}", light.filter)),
        (None, None) => unknown("band and filter", "V, through the filter of these frames"),
    }
}
