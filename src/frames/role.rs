//! What a frame is for: by the file's name, else by its header.
//!
//! The reason for every decision is kept. It does not cover whether the frame can be used ([`super::exposure`]).

use super::header::keywords;
use crate::config::Config;
use crate::fits::cards::Header;

/// What a frame is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Role {
    /// A flat field.
    Flat,
    /// A star pointing, for the zeropoint.
    Stars,
    /// A frame of the tracked satellite.
    Target,
    /// A bias frame (not used).
    Bias,
    /// A dark frame (not used).
    Dark,
    /// Left alone, for the reason given.
    Ignored,
    /// A frame of another satellite than the one of this run (not used).
    OtherTarget,
    /// A frame of another filter than the one of this run (not used).
    OtherFilter,
}

impl Role {
    /// Every role.
    pub const ALL: [Role; 8] = [
        Role::Flat,
        Role::Stars,
        Role::Target,
        Role::Bias,
        Role::Dark,
        Role::Ignored,
        Role::OtherTarget,
        Role::OtherFilter,
    ];

    /// Its name, in plans and listings.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Role::Flat => "flat",
            Role::Stars => "stars",
            Role::Target => "target",
            Role::Bias => "bias",
            Role::Dark => "dark",
            Role::Ignored => "ignored",
            Role::OtherTarget => "other target",
            Role::OtherFilter => "other filter",
        }
    }
}

/// The role a file's name gives, with the reason: the globs of the configuration.
pub(crate) fn role_by_name(name: &str, config: &Config) -> Option<(Role, String)> {
    let f = &config.frames;
    let lists = [
        (Role::Ignored, "ignore", &f.ignore),
        (Role::Flat, "flat", &f.flat),
        (Role::Stars, "stars", &f.stars),
        (Role::Target, "target", &f.target),
    ];
    lists.into_iter().find_map(|(role, key, globs)| {
        let glob = globs.iter().find(|g| matches_glob(g, name))?;
        Some((role, format!("name matches frames.{key} \"{glob}\"")))
    })
}

/// The role the header gives, with the reason.
pub(super) fn role_by_header(
    header: &Header,
    config: &Config,
    object: Option<&str>,
    target_names: &[String],
) -> (Role, String) {
    // FRAME may as well be a running number
    let states_role = |k: &&str| header.text(k).is_some_and(|v| *k != "FRAME" || v.chars().any(char::is_alphabetic));
    let key = keywords(&config.header.aliases, "imagetyp").into_iter().find(states_role);
    let kind = key.and_then(|k| header.text(k)).unwrap_or_default();
    let reason = key.map_or("no IMAGETYP".to_string(), |k| format!("{k} = '{kind}'"));
    let word = kind.to_ascii_lowercase();
    if word.contains("master") {
        return (Role::Ignored, format!("{reason}: a combined frame, not a raw one"));
    }
    for (part, role) in
        [("dark", Role::Dark), ("bias", Role::Bias), ("zero", Role::Bias), ("offset", Role::Bias), ("flat", Role::Flat)]
    {
        if word.contains(part) {
            return (role, reason);
        }
    }
    let light = ["light", "object", "science", "snapshot", "expose", "sky", "standard", "target", "stars"];
    if !word.is_empty() && !light.iter().any(|l| word.contains(l)) {
        return (
            Role::Ignored,
            format!("{reason} is neither light, flat, bias nor dark; use frames.stars or frames.target"),
        );
    }
    let Some(object) = object else { return (Role::Stars, format!("{reason}, no OBJECT")) };
    if word.is_empty() {
        let plain = letters(object);
        for (start, role) in [
            ("bias", Role::Bias),
            ("zero", Role::Bias),
            ("dark", Role::Dark),
            ("flat", Role::Flat),
            ("skyflat", Role::Flat),
            ("domeflat", Role::Flat),
        ] {
            if plain.starts_with(start) {
                return (role, format!("{reason}, OBJECT = '{object}'"));
            }
        }
    }
    let names = target_names.iter().flat_map(|n| name_variants(n)).chain(config.frames.target_objects.iter().cloned());
    for name in names {
        if names_object(&name, object) {
            return (Role::Target, format!("{reason}, OBJECT = '{object}' contains \"{name}\""));
        }
    }
    match target_names {
        [] => (Role::Stars, format!("{reason}, OBJECT = '{object}'; without a configuration no target is known")),
        _ => (Role::Stars, format!("{reason}, OBJECT = '{object}' is not the target")),
    }
}

/// `ISS (ZARYA)` is also known as `ISS` and as `ZARYA`.
pub(crate) fn name_variants(name: &str) -> Vec<String> {
    let mut variants = vec![name.trim().to_string()];
    if let Some((before, rest)) = name.split_once('(') {
        variants.push(before.trim().to_string());
        variants.push(rest.trim_end_matches([')', ' ']).trim().to_string());
    }
    variants.retain(|v| !letters(v).is_empty());
    variants
}

/// Whether `object` contains `name`, ignoring case, spaces and punctuation; numbers and names of up to three
/// letters only as a whole word.
pub(crate) fn names_object(name: &str, object: &str) -> bool {
    let wanted = letters(name);
    if wanted.is_empty() {
        return false;
    }
    if wanted.len() <= 3 || wanted.bytes().all(|b| b.is_ascii_digit()) {
        return object.split(|c: char| !c.is_ascii_alphanumeric()).any(|w| w.to_ascii_lowercase() == wanted);
    }
    // STARLINK-1007 is not in STARLINK-10071
    let plain: Vec<(usize, char)> = object
        .char_indices()
        .filter(|(_, c)| c.is_alphanumeric())
        .flat_map(|(at, c)| c.to_lowercase().map(move |c| (at, c)))
        .collect();
    let wanted: Vec<char> = wanted.chars().collect();
    let digit = |c: Option<&char>| c.is_some_and(char::is_ascii_digit);
    plain.windows(wanted.len()).any(|window| {
        let same = window.iter().map(|(_, c)| c).eq(&wanted);
        let after = window.last().and_then(|(at, c)| object[at + c.len_utf8().min(object.len() - at)..].chars().next());
        same && !(digit(wanted.last()) && digit(after.as_ref()))
    })
}

pub(crate) fn letters(text: &str) -> String {
    text.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect()
}

/// Shell pattern with `*` and `?`, ignoring case.
pub(crate) fn matches_glob(pattern: &str, name: &str) -> bool {
    let pattern: Vec<char> = pattern.to_lowercase().chars().collect();
    let name: Vec<char> = name.to_lowercase().chars().collect();
    let (mut p, mut n, mut star) = (0, 0, None);
    while n < name.len() {
        if p < pattern.len() && pattern[p] == '*' {
            star = Some((p, n));
            p += 1;
        } else if p < pattern.len() && (pattern[p] == '?' || pattern[p] == name[n]) {
            p += 1;
            n += 1;
        } else if let Some((at, from)) = star {
            star = Some((at, from + 1));
            p = at + 1;
            n = from + 1;
        } else {
            return false;
        }
    }
    pattern[p..].iter().all(|c| *c == '*')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_target_is_recognised_by_name_or_number_but_not_by_accident() {
        let found = |name: &str, object: &str| name_variants(name).iter().any(|n| names_object(n, object));
        assert!(found("ISS (ZARYA)", "iss pass 2") && found("ISS (ZARYA)", "ISS-zenith"));
        assert!(!found("ISS (ZARYA)", "Mission field") && !found("25544", "NGC 125544"));
        assert!(found("25544", "norad 25544") && found("STARLINK-2242", "starlink 2242"));
        assert!(!found("", "anything") && !found("()", "x"));
        assert!(!found("STARLINK-1007", "STARLINK-10071") && found("STARLINK-1007", "Starlink 1007 2"));
    }

    #[test]
    fn globs_match_like_a_shell() {
        assert!(matches_glob("flat*.fits", "Flat_001.FITS") && matches_glob("*_?.fit", "a_b_1.fit"));
        assert!(!matches_glob("flat?.fits", "flat.fits") && matches_glob("*", ""));
        assert!(!matches_glob("a*b*c", "a__b__") && matches_glob("a*b*c", "a_bb_c"));
    }
}
