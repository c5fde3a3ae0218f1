//! One camera, one optics, one read-out: whether the frames of a night belong to the configured instrument, and together.
//!
//! By headers alone. Frames of another camera, and the few whose binning, size, focal length, pixel pitch or read-out mode differs
//! from the rest of their kind, are set aside with a reason; where most frames differ the configuration is wrong. It
//! does not cover the scale the stars solve to ([`super::scale`]) and the filters.

use super::header_warnings::other_camera;
use std::collections::BTreeMap;

use super::findings::Findings;
use crate::base::error::Error;
use crate::config::Config;
use crate::frames::{Exposure, Role};
use crate::pipeline::survey::files::{SetAside, Survey};

/// Focal lengths of one telescope differ by less than this share in the headers of a night.
const SAME_FOCAL_FRAC: f64 = 0.02;
/// Keywords of the read-out mode: N.I.N.A. and ASCOM, MaxIm, PRISM, observatories.
const READOUT: [&str; 4] = ["READOUTM", "READMODE", "CCDMODE", "READOUT"];

/// Sets frames of another instrument aside, and refuses a night most of whose frames are of another.
pub(crate) fn check_instrument(survey: &mut Survey, config: &Config, findings: &mut Findings) {
    let mut kinds: [(&str, Vec<Exposure>); 3] = [
        ("flats", std::mem::take(&mut survey.flats)),
        ("star frames", survey.pointings.iter_mut().flat_map(std::mem::take).collect()),
        ("target frames", std::mem::take(&mut survey.targets)),
    ];
    let mut aside = Vec::new();
    if config.header.check_camera {
        findings.errors.extend(refused_camera(&kinds, config));
    }
    for (kind, frames) in &mut kinds {
        if config.header.check_camera {
            let (same, other) = by_camera(std::mem::take(frames), config);
            *frames = same;
            aside.extend(other);
        }
        for property in PROPERTIES.iter().filter(|p| *kind != "flats" || p.of_flats) {
            let (rest, few) = by_majority(kind, std::mem::take(frames), property, findings);
            *frames = rest;
            aside.extend(few);
        }
    }
    for property in PROPERTIES.iter().filter(|p| p.of_flats) {
        findings.notes.extend(across(&kinds, property));
    }
    let [(_, flats), (_, stars), (_, targets)] = kinds;
    (survey.flats, survey.targets) = (flats, targets);
    survey.group_stars(stars, config);
    aside.sort_by(|a, b| a.path.cmp(&b.path));
    survey.set_aside.extend(aside);
}

/// What frames of one kind have in common.
struct Property {
    /// In messages.
    name: &'static str,
    /// Whether flats must have it in common too; of flats of other sizes and optics the master flat judges itself.
    of_flats: bool,
    /// Whether a night without a majority is refused: magnitudes of the two halves would not compare.
    must_agree: bool,
    /// Its value; `None` where the header does not give it.
    of: fn(&Exposure) -> Option<String>,
    /// Its value as a number whose values may differ by [`SAME_FOCAL_FRAC`].
    number: Option<fn(&Exposure) -> Option<f64>>,
}

const PROPERTIES: [Property; 5] = [
    Property { name: "binning", of_flats: true, must_agree: true, of: |e| Some(e.binning.to_string()), number: None },
    Property {
        name: "size",
        of_flats: false,
        must_agree: false,
        of: |e| Some(format!("{}x{} px", e.size_px.0, e.size_px.1)),
        number: None,
    },
    Property {
        name: "FOCALLEN",
        of_flats: false,
        must_agree: true,
        of: |e| focal_mm(e).map(|mm| format!("{mm} mm")),
        number: Some(focal_mm),
    },
    Property {
        name: "XPIXSZ",
        of_flats: true,
        must_agree: false,
        of: |e| pixel_um(e).map(|um| format!("{um} um")),
        number: Some(pixel_um),
    },
    Property { name: "read-out mode", of_flats: true, must_agree: false, of: readout, number: None },
];

/// The focal length that the header states \[mm\].
pub(crate) fn focal_mm(exposure: &Exposure) -> Option<f64> {
    ["FOCALLEN", "FOCAL"].iter().find_map(|k| exposure.header.number(k)).filter(|mm| *mm > 0.0)
}

/// The pixel pitch that the header states \[µm\].
fn pixel_um(exposure: &Exposure) -> Option<f64> {
    exposure.header.number("XPIXSZ").filter(|um| *um > 0.0)
}

fn readout(exposure: &Exposure) -> Option<String> {
    READOUT.iter().find_map(|k| exposure.header.text(k)).map(|mode| format!("'{}'", mode.trim()))
}

/// Frames of the configured camera, and those set aside; none is where most are of another: then the night is refused.
fn by_camera(frames: Vec<Exposure>, config: &Config) -> (Vec<Exposure>, Vec<SetAside>) {
    if mostly_other(&frames, config).is_some() {
        return (frames, Vec::new());
    }
    split(frames, |e| {
        let (keyword, name) = other_camera(e, config)?;
        Some(format!(
            "{keyword} = '{name}': another camera than detector.camera = \"{}\"; header.check_camera = false takes it all \
             the same",
            config.detector.camera
        ))
    })
}

/// The other cameras of frames of one kind, where those are most: keyword and name of each frame.
fn mostly_other(frames: &[Exposure], config: &Config) -> Option<Vec<(String, String)>> {
    let others: Vec<(String, String)> = frames.iter().filter_map(|e| other_camera(e, config)).collect();
    (2 * others.len() > frames.len()).then_some(others)
}

/// The error of a night with kinds of frames most of which are of another camera.
fn refused_camera(kinds: &[(&str, Vec<Exposure>); 3], config: &Config) -> Option<Error> {
    let refused: Vec<(&str, usize, Vec<(String, String)>)> =
        kinds.iter().filter_map(|(kind, frames)| Some((*kind, frames.len(), mostly_other(frames, config)?))).collect();
    let (keyword, name) = refused.first()?.2.first()?.clone();
    let counts: Vec<String> =
        refused.iter().map(|(kind, n, others)| format!("{} of {n} {kind}", others.len())).collect();
    let names = counted(refused.iter().flat_map(|(.., others)| others).map(|(_, name)| format!("\"{name}\"")));
    Some(Error::Config {
        key: "detector.camera".into(),
        problem: format!(
            "is \"{}\", but {keyword} of {} is another camera: {names}; set detector.camera = \"{name}\" with its pixel_um, \
             pedestal_adu and gain tables, or header.check_camera = false to use the configured one all the same",
            config.detector.camera,
            counts.join(", ")
        ),
    })
}

/// Frames whose property is that of most frames of their kind, and those set aside.
fn by_majority(
    kind: &str,
    frames: Vec<Exposure>,
    property: &Property,
    findings: &mut Findings,
) -> (Vec<Exposure>, Vec<SetAside>) {
    let groups = values(&frames, property);
    let known: usize = groups.iter().map(|g| g.1).sum();
    if groups.len() < 2 {
        return (frames, Vec::new());
    }
    let Some((most, n)) = groups.iter().find(|(_, n)| 2 * n > known) else {
        let counts = groups.iter().map(|(value, n)| format!("{value} ({n} frames)")).collect::<Vec<_>>().join(", ");
        let problem = format!(
            "{kind} differ in {}, and no value is that of most frames: {counts}; {}name the frames to exclude in frames.ignore, or \
             reduce each setting as a night of its own",
            property.name,
            match property.name {
                "binning" =>
                    "describe the frames of one of them in [[instruments]] with `binning` and its own detector; or ",
                "FOCALLEN" => "describe one of the telescopes in [[instruments]] with its own telescope; or ",
                _ => "",
            }
        );
        match property.must_agree {
            true => findings.errors.push(Error::Config { key: "night.input".into(), problem }),
            false => findings.notes.push(problem),
        }
        return (frames, Vec::new());
    };
    let (most, n) = (most.clone(), *n);
    split(frames, |e| {
        let own = (property.of)(e)?;
        let same = own == most || near(property, e, &most);
        (!same).then(|| {
            format!(
                "{} {own}, but {most} in {n} of {known} {kind}: a frame that differs from the rest is set aside; reduce it \
                 as a night of its own",
                property.name
            )
        })
    })
}

/// Values of a property with the number of frames, the most frequent first.
fn values(frames: &[Exposure], property: &Property) -> Vec<(String, usize)> {
    let mut all: BTreeMap<String, usize> = BTreeMap::new();
    frames.iter().filter_map(property.of).for_each(|value| *all.entry(value).or_default() += 1);
    let mut groups: Vec<(String, usize)> = all.into_iter().collect();
    groups.sort_by_key(|(_, n)| std::cmp::Reverse(*n));
    if property.number.is_some() {
        // values that differ by rounding are one
        let mut merged: Vec<(String, usize)> = Vec::new();
        for (value, n) in groups {
            match merged.iter_mut().find(|(of, _)| close(leading(of), leading(&value))) {
                Some((_, count)) => *count += n,
                None => merged.push((value, n)),
            }
        }
        merged.sort_by_key(|(_, n)| std::cmp::Reverse(*n));
        return merged;
    }
    groups
}

fn near(property: &Property, exposure: &Exposure, most: &str) -> bool {
    property.number.and_then(|of| of(exposure)).is_some_and(|value| close(Some(value), leading(most)))
}

fn leading(value: &str) -> Option<f64> {
    value.split(' ').next()?.parse().ok()
}

fn close(a: Option<f64>, b: Option<f64>) -> bool {
    a.zip(b).is_some_and(|(a, b)| (a / b - 1.0).abs() < SAME_FOCAL_FRAC)
}

/// Kinds of frames that differ from one another as a whole.
fn across(kinds: &[(&str, Vec<Exposure>); 3], property: &Property) -> Option<String> {
    let of_kinds: Vec<(&str, String)> = kinds
        .iter()
        .filter_map(|(kind, frames)| Some((*kind, values(frames, property).into_iter().next()?.0)))
        .collect();
    let differs = of_kinds.iter().any(|(_, value)| *value != of_kinds[0].1);
    differs.then(|| {
        let words: Vec<String> = of_kinds.iter().map(|(kind, value)| format!("{kind} {value}")).collect();
        format!(
            "the {} differs between kinds of frames: {}; a zeropoint or flat of one may not hold for the other",
            property.name,
            words.join(", ")
        )
    })
}

fn split(frames: Vec<Exposure>, reason: impl Fn(&Exposure) -> Option<String>) -> (Vec<Exposure>, Vec<SetAside>) {
    let (mut kept, mut aside) = (Vec::new(), Vec::new());
    for exposure in frames {
        match reason(&exposure) {
            None => kept.push(exposure),
            Some(reason) => aside.push(SetAside { path: exposure.path, role: exposure.role, reason }),
        }
    }
    (kept, aside)
}

fn counted(names: impl Iterator<Item = String>) -> String {
    let mut all: BTreeMap<String, usize> = BTreeMap::new();
    names.for_each(|name| *all.entry(name).or_default() += 1);
    all.iter().map(|(name, n)| format!("{name} ({n} frames)")).collect::<Vec<_>>().join(", ")
}

/// In messages: the kind of a frame that was set aside.
pub(crate) fn kind_of(role: Role) -> &'static str {
    match role {
        Role::Flat => "flat",
        Role::Stars => "star frame",
        Role::Target => "target frame",
        Role::Bias | Role::Dark | Role::Ignored | Role::OtherTarget | Role::OtherFilter => "frame",
    }
}
