//! What the data say of the keywords that assign a frame to its group: FILTER, INSTRUME, OBJECT; and what they cannot show.
//!
//! The measures are those of other stages: zeropoint and scale of star frames ([`super::stars::frame_check`]), the ratio of a flat to
//! the master, the distance of a target frame's header from the satellite ([`super::vet`]). It decides nothing.

use std::collections::{BTreeMap, HashMap};

use super::stars::frame_check::FrameCheck;
use super::survey::files::Survey;
use super::survey::scale::MOST_FRAC;
use super::vet::pointing::astray;
use crate::base::file::file_name;
use crate::config::Config;
use crate::frames::Exposure;
use crate::frames::flat::{FlatMember, MasterFlat};
use crate::frames::header::optics;
use crate::tables::words::Standing;
use crate::tables::{KeywordCheckRow, PhotometryRow};

/// A row per frame and keyword, in the order flats, star frames, target frames; a keyword that a header lacks has none.
///
/// `targets` are the rows of the target frames.
#[must_use]
pub fn keyword_checks(
    survey: &Survey,
    flat: Option<&MasterFlat>,
    stars: &[FrameCheck],
    targets: &[PhotometryRow],
    config: &Config,
) -> Vec<KeywordCheckRow> {
    let members: HashMap<String, &FlatMember> =
        flat.iter().flat_map(|f| &f.members).map(|m| (file_name(&m.path), m)).collect();
    let stars: HashMap<&str, &FrameCheck> = stars.iter().map(|check| (check.frame.as_str(), check)).collect();
    let targets: HashMap<&str, &PhotometryRow> = targets.iter().map(|row| (row.frame.as_str(), row)).collect();
    let limit_deg = astray(targets.values().copied());
    let mut rows = Vec::new();
    for exposure in &survey.flats {
        let check = of_flat(members.get(&file_name(&exposure.path)).copied());
        rows.extend(of_group(exposure, "flat", config).map(|row| check.clone().on(row)));
    }
    for exposure in survey.pointings.iter().flatten() {
        let check = stars.get(exposure.name.as_str()).copied();
        rows.extend(of_group(exposure, "stars", config).map(|row| of_star_frame(check, &row.keyword).on(row)));
    }
    for exposure in &survey.targets {
        let row = targets.get(exposure.name.as_str()).copied();
        let object = exposure.object.clone().map(|object| blank(exposure, "target", "OBJECT", object));
        rows.extend(
            of_group(exposure, "target", config).chain(object).map(|r| of_target(row, limit_deg, &r.keyword).on(r)),
        );
    }
    rows
}

/// What is not checkable, and how many frames it is of, in words; what deviates is reported by the stage that found it.
#[must_use]
pub fn not_checkable(rows: &[KeywordCheckRow]) -> Option<String> {
    let mut counts: BTreeMap<(&str, &str), usize> = BTreeMap::new();
    for row in rows.iter().filter(|r| r.standing == Standing::NotCheckable) {
        *counts.entry((&row.keyword, &row.role)).or_default() += 1;
    }
    let listed: Vec<String> = counts
        .iter()
        .map(|((keyword, role), n)| {
            format!(
                "{keyword} of {n} {}",
                if *role == "flat" { "flats".into() } else { format!("{} frames", role.trim_end_matches('s')) }
            )
        })
        .collect();
    (!listed.is_empty()).then(|| format!("not checkable against the data (keyword_checks.ecsv): {}", listed.join(", ")))
}

/// FILTER and INSTRUME of a frame.
fn of_group<'a>(exposure: &'a Exposure, role: &'a str, config: &Config) -> impl Iterator<Item = KeywordCheckRow> + 'a {
    let camera = optics(&exposure.header, &config.header.aliases).camera.map(|camera| camera.value);
    let all = [("FILTER", exposure.filter.clone()), ("INSTRUME", camera)];
    all.into_iter().filter_map(move |(keyword, value)| Some(blank(exposure, role, keyword, value?)))
}

fn blank(exposure: &Exposure, role: &str, keyword: &str, value: String) -> KeywordCheckRow {
    let (role, keyword) = (role.into(), keyword.into());
    KeywordCheckRow { frame: exposure.name.clone(), role, keyword, value, ..KeywordCheckRow::default() }
}

/// What was found of a keyword.
#[derive(Clone)]
struct Found {
    standing: Standing,
    reason: String,
    measures: KeywordCheckRow,
}

impl Found {
    fn not_checkable(reason: &str) -> Self {
        Self { standing: Standing::NotCheckable, reason: reason.into(), measures: KeywordCheckRow::default() }
    }

    fn on(self, row: KeywordCheckRow) -> KeywordCheckRow {
        let KeywordCheckRow { frame, role, keyword, value, .. } = row;
        KeywordCheckRow {
            frame,
            role,
            keyword,
            value,
            standing: self.standing.into(),
            reason: self.reason,
            ..self.measures
        }
    }
}

fn of_flat(member: Option<&FlatMember>) -> Found {
    let Some((member, scatter, limit)) = member.and_then(|m| Some((m, m.ratio_scatter_frac?, m.ratio_limit_frac?)))
    else {
        return Found::not_checkable("no ratio to the master flat of the night, or fewer than four flats");
    };
    let deviates = scatter > limit;
    Found {
        standing: if deviates { Standing::Deviates } else { Standing::Agrees },
        reason: if deviates { member.reason.clone() } else { String::new() },
        measures: KeywordCheckRow {
            flat_scatter_frac: Some(scatter),
            flat_limit_frac: Some(limit),
            ..KeywordCheckRow::default()
        },
    }
}

fn of_star_frame(check: Option<&FrameCheck>, keyword: &str) -> Found {
    let Some(check) = check else { return Found::not_checkable("its stars were not measured") };
    let (zp_dev_mag, zp_limit_mag) = (check.zp_dev_mag, check.zp_limit_mag);
    let scale_dev_frac = check.scale_dev_frac.filter(|_| keyword == "INSTRUME");
    let measures = KeywordCheckRow { zp_dev_mag, zp_limit_mag, scale_dev_frac, ..KeywordCheckRow::default() };
    let off_scale = scale_dev_frac.filter(|dev| !(dev.abs() <= MOST_FRAC));
    let (standing, reason) = match (off_scale, check.standing, zp_dev_mag.zip(zp_limit_mag)) {
        (Some(dev), ..) => {
            (Standing::Deviates, format!("its stars have a scale {:+.1} % from the others", 100.0 * dev))
        }
        (None, Standing::Deviates, _) => (Standing::Deviates, check.contradiction().unwrap_or_default()),
        (None, Standing::Agrees, _) => (Standing::Agrees, String::new()),
        (None, _, Some((dev, _))) => (
            Standing::NotCheckable,
            format!(
                "all frames of its pointing are {dev:.2} mag fainter than the others: clouds, or another filter or camera"
            ),
        ),
        (None, ..) => (Standing::NotCheckable, "too few stars, or fewer than five star frames".into()),
    };
    Found { standing, reason, measures }
}

fn of_target(row: Option<&PhotometryRow>, limit_deg: Option<f64>, keyword: &str) -> Found {
    match keyword {
        "FILTER" => Found::not_checkable("the brightness of the satellite is not known beforehand"),
        "INSTRUME" => Found::not_checkable("no star of a tracked frame is measured for its scale"),
        _ => {
            let pointing_sep_deg = row.and_then(|r| r.pointing_sep_deg);
            let measures = KeywordCheckRow { pointing_sep_deg, ..KeywordCheckRow::default() };
            match pointing_sep_deg.zip(limit_deg) {
                Some((sep, limit)) if sep > limit => Found {
                    standing: Standing::Deviates,
                    reason: format!("its header points {sep:.1} deg from the satellite, the limit is {limit:.1} deg"),
                    measures,
                },
                Some(_) => Found { standing: Standing::Agrees, reason: String::new(), measures },
                None => Found {
                    measures,
                    ..Found::not_checkable(
                        "the headers of these frames do not follow the satellite, or are fewer than three",
                    )
                },
            }
        }
    }
}
