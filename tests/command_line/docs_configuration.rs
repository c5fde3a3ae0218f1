//! docs/configuration.md says what every key of pipeline.toml is: made from the structs of src/config, which define the keys,
//! and compared with what the reader of the file knows.
//!
//! `SATPHOT_WRITE_DOCS=1 cargo test --test command_line` writes it again.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::path::Path;

use satphot::Config;
use satphot::config::{Effects, Fetch, Mode, QUANTITIES};
use toml::{Table, Value};

/// A night with every table that may be absent, and no key that has a default.
const BASE: &str = "[night]\nname = 'n'\ninput = ['i']\noutput = 'o'\n\
     [site]\nname = 's'\nlat_deg = -33.8\nlon_deg = 151.1\nalt_m = 70.0\n\
     [telescope]\nname = 't'\naperture_m = 0.6\nfocal_length_mm = 3962.0\n\
     [detector]\ncamera = 'asi6200mm'\npixel_um = 3.76\npedestal_adu = 500.0\n\
     [stars]\ncatalogue = 'c.csv'\nbv_range_mag = [0.2, 0.9]\nv_range_mag = [10.0, 15.0]\n\
     [orbit]\nelements = 'e.tle'\n[model]\nsatellite = 'iss'\n";

/// A field of a struct, or a variant of an enum, with its comment and the text of its attributes.
#[derive(Debug, Clone)]
struct Item {
    name: String,
    /// Type of a field; what stands behind the name of a variant.
    shape: String,
    doc: String,
    attributes: String,
}

/// A struct or an enum of src/config.
#[derive(Debug, Clone)]
struct Definition {
    is_enum: bool,
    doc: String,
    attributes: String,
    items: Vec<Item>,
}

/// The structs and enums that a text defines, by name.
fn read_definitions(text: &str, found: &mut BTreeMap<String, Definition>) {
    let (mut doc, mut attributes) = (String::new(), String::new());
    let mut open: Option<(String, Definition)> = None;
    let mut variant: Option<String> = None; // names of the fields of a struct variant
    for line in text.lines() {
        let code = line.trim();
        if line == "#[cfg(test)]" {
            break;
        } else if let Some(words) = code.strip_prefix("///") {
            if variant.is_none() {
                doc = format!("{doc} {}", words.trim()).trim().to_string();
            }
        } else if code.starts_with("#[") {
            if variant.is_none() {
                attributes += code;
            }
        } else if let Some((_, definition)) = &mut open {
            let mut take = |name: &str, shape: String| {
                let (doc, attributes) = (std::mem::take(&mut doc), std::mem::take(&mut attributes));
                definition.items.push(Item { name: name.into(), shape, doc, attributes });
            };
            if let Some(fields) = &mut variant {
                if code == "}," {
                    definition.items.last_mut().unwrap().shape = variant.take().unwrap();
                } else if let Some((field, _)) = code.split_once(':') {
                    *fields += &format!("{}{field}", if fields.is_empty() { "" } else { ", " });
                }
            } else if line == "}" {
                let (name, definition) = open.take().unwrap();
                found.insert(name, definition);
            } else if let Some((name, shape)) = code.strip_prefix("pub ").and_then(|l| l.split_once(": ")) {
                take(name, shape.trim_end_matches(',').into());
            } else if let Some(name) = code.strip_suffix(" {") {
                take(name, String::new());
                variant = Some(String::new());
            } else if let Some((name, shape)) = code.trim_end_matches("),").split_once('(') {
                take(name, shape.into());
            } else if let Some(name) = code.strip_suffix(',') {
                take(name, String::new());
            }
        } else {
            let (doc, attributes) = (std::mem::take(&mut doc), std::mem::take(&mut attributes));
            for (start, is_enum) in [("pub struct ", false), ("pub enum ", true)] {
                if let Some(name) = code.strip_prefix(start).and_then(|l| l.strip_suffix(" {")) {
                    let doc = doc.split(" ```").next().unwrap().to_string();
                    open = Some((
                        name.into(),
                        Definition { is_enum, doc, attributes: attributes.clone(), items: Vec::new() },
                    ));
                }
            }
        }
    }
}

fn definitions() -> BTreeMap<String, Definition> {
    let mut found = BTreeMap::new();
    for entry in std::fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("src/config")).unwrap() {
        read_definitions(&std::fs::read_to_string(entry.unwrap().path()).unwrap(), &mut found);
    }
    found
}

/// `Outer<Inner>` without `Outer`.
fn inside<'a>(shape: &'a str, outer: &str) -> Option<&'a str> {
    shape.strip_prefix(outer)?.strip_prefix('<')?.strip_suffix('>')
}

fn snake_case(name: &str) -> String {
    let mut out = String::new();
    for c in name.chars() {
        if c.is_ascii_uppercase() && !out.is_empty() {
            out.push('_');
        }
        out.push(c.to_ascii_lowercase());
    }
    out
}

/// A value of an enum as it stands in the file.
fn variant_text(definition: &Definition, item: &Item) -> String {
    let name = if definition.attributes.contains("\"lowercase\"") {
        item.name.to_lowercase()
    } else {
        assert!(definition.attributes.contains("\"snake_case\""), "{definition:?}");
        snake_case(&item.name)
    };
    match item.shape.as_str() {
        "" => format!("\"{name}\""),
        fields if definition.attributes.contains("tag = \"kind\"") => format!("{{ kind = \"{name}\", {fields} }}"),
        fields if fields.starts_with('[') => format!("{{ {name} = [x, y, z] }}"),
        fields => format!("{{ {name} = {{ {fields} }} }}"),
    }
}

/// A Rust type in words.
fn type_words(shape: &str, all: &BTreeMap<String, Definition>) -> String {
    if let Some(inner) = inside(shape, "Option") {
        return type_words(inner, all);
    }
    if let Some(inner) = inside(shape, "Vec") {
        return format!("list of {}", plural(&type_words(inner, all)));
    }
    if let Some(inner) = inside(shape, "BTreeMap").and_then(|s| s.strip_prefix("String, ")) {
        return format!("table of {}", plural(&type_words(inner, all)));
    }
    match shape {
        "f64" => "number".into(),
        "usize" | "u32" | "u64" => "whole number".into(),
        "bool" => "true or false".into(),
        "String" => "text".into(),
        "PathBuf" => "path".into(),
        "[f64; 2]" => "two numbers".into(),
        "Band" => "name of a band".into(),
        _ if all.get(shape).is_some_and(|d| d.is_enum) => "one of the values below".into(),
        _ => panic!("the type {shape} has no words yet"),
    }
}

fn plural(words: &str) -> String {
    match words {
        "text" => "texts".into(),
        "list of texts" => "lists of texts".into(),
        "two numbers" => "pairs of numbers".into(),
        other => format!("{other}s"),
    }
}

/// The unit in `\[...\]` of a comment, and the comment without it.
fn unit_of(doc: &str) -> (String, String) {
    let doc = doc.replace("[`QUANTITIES`]", &QUANTITIES.join(", "));
    match doc.split_once("\\[").and_then(|(before, rest)| Some((before, rest.split_once("\\]")?))) {
        Some((before, (unit, after))) => (unit.to_string(), format!("{}{after}", before.trim_end())),
        None => (String::new(), doc),
    }
}

/// One table of the file: its path, whether there may be several of it, and the struct that reads it.
struct Section {
    path: String,
    repeated: bool,
    definition: Definition,
    doc: String,
}

impl Section {
    fn heading(&self) -> String {
        match (self.path.as_str(), self.repeated) {
            ("", _) => "Top level".into(),
            (path, true) => format!("`[[{path}]]`"),
            (path, false) => format!("`[{path}]`"),
        }
    }

    fn key_path(&self, key: &str) -> String {
        if self.path.is_empty() { key.into() } else { format!("{}.{key}", self.path) }
    }

    /// The keys of this table, with those of tables that are written in one line.
    fn rows(&self, all: &BTreeMap<String, Definition>) -> Vec<Item> {
        let mut rows = Vec::new();
        for item in self.items() {
            match one_line(&item, all) {
                Some(definition) => rows.extend(definition.items.iter().map(|inner| Item {
                    name: format!("{}.{}", item.name, inner.name),
                    doc: match inner.name.as_str() {
                        "value" => item.doc.clone(),
                        _ => format!("{} \\[{}\\]", inner.doc, unit_of(&item.doc).0),
                    },
                    ..inner.clone()
                })),
                None if table_of(&item, all).is_some() => {}
                None => rows.push(item),
            }
        }
        rows
    }

    fn items(&self) -> impl Iterator<Item = Item> {
        self.definition
            .items
            .iter()
            .filter(|i| !i.attributes.contains("serde(skip)") && !i.attributes.contains("serde(skip,"))
            .cloned()
    }

    fn is_required(&self, row: &Item) -> bool {
        let has_default = |attributes: &str| attributes.contains("default");
        !has_default(&row.attributes.replace("is_default", ""))
            && !self.definition.attributes.contains(", default)")
            && inside(&row.shape, "Option").is_none()
    }
}

/// The struct of a field that is a table, and whether there may be several.
fn table_of<'a>(item: &Item, all: &'a BTreeMap<String, Definition>) -> Option<(&'a Definition, bool)> {
    let single = inside(&item.shape, "Option").unwrap_or(&item.shape);
    let shape = inside(single, "Vec").unwrap_or(single);
    all.get(shape).filter(|d| !d.is_enum).map(|d| (d, shape != single))
}

/// The struct of a table that is written in one line, such as `pin_k = { value = 0.12, err = 0.05 }`.
fn one_line<'a>(item: &Item, all: &'a BTreeMap<String, Definition>) -> Option<&'a Definition> {
    let shape = inside(&item.shape, "Option").unwrap_or(&item.shape);
    all.get(shape).filter(|_| shape == "Pin")
}

fn sections(all: &BTreeMap<String, Definition>) -> Vec<Section> {
    let config = all["Config"].clone();
    let mut found = Vec::new();
    let mut open = vec![Section { path: String::new(), repeated: false, doc: config.doc.clone(), definition: config }];
    while !open.is_empty() {
        let section = open.remove(0);
        let below = section.items().filter(|item| one_line(item, all).is_none()).filter_map(|item| {
            let (definition, repeated) = table_of(&item, all)?;
            if section.path == "instruments" {
                return None; // the keys of [detector] and [telescope] again
            }
            let path = section.key_path(&item.name);
            Some(Section { path, repeated, doc: item.doc.clone(), definition: definition.clone() })
        });
        let below: Vec<Section> = below.collect();
        open.splice(0..0, below);
        found.push(section);
    }
    found
}

/// Every default that is in force, by path.
fn defaults() -> Value {
    let config = Config::from_text(BASE, &[]).unwrap();
    let mut table: Table = config.to_toml().unwrap().parse().unwrap();
    table.insert("fetch".into(), Value::try_from(Fetch::default()).unwrap());
    let model = table.get_mut("model").and_then(Value::as_table_mut).unwrap();
    model.insert("effects".into(), Value::try_from(Effects::of(Mode::default())).unwrap());
    Value::Table(table)
}

/// The default of a key in words.
fn default_words(section: &Section, row: &Item, defaults: &Value) -> String {
    if section.is_required(row) {
        return "required".into();
    }
    let path = section.key_path(&row.name);
    let value = path.split('.').try_fold(defaults, |value, key| value.get(key));
    match value {
        Some(Value::Table(table)) if table.is_empty() => "empty".into(),
        Some(Value::Array(list)) if list.is_empty() => "empty".into(),
        Some(value) => format!("`{}`", value.to_string().replace('\n', " ")),
        None if inside(&row.shape, "Option").is_some() => "absent".into(),
        None if row.name == "err" || row.name.ends_with(".err") => "`0.0`".into(),
        None if row.name.ends_with(".value") => "absent".into(),
        None if row.attributes.contains("is_true") => "`true`".into(),
        None if row.attributes.contains("Not::not") => "`false`".into(),
        None if row.attributes.contains("is_empty") => "empty".into(),
        None => panic!("{path}: its default is not known"),
    }
}

fn page() -> String {
    let (all, defaults) = (definitions(), defaults());
    let mut listed: BTreeMap<String, String> = BTreeMap::new(); // enum and the first key that has its values
    let mut text = String::from(
        "# Every key of pipeline.toml\n\n`satphot init` writes a file with every key, commented. An unknown key is an error that names \
         the nearest known one. Units are in the names. Paths are relative to the folder of the file. A key that is `required` \
         must be there if its table is there, unless the preset has it; a key whose default is `absent` has no value unless it \
         is given. `--set table.key=value` overrides a key for one run.\n",
    );
    for section in sections(&all) {
        let _ = write!(text, "\n## {}\n\n{}\n", section.heading(), section.doc);
        if section.path == "model.effects" {
            let mode = Mode::default().as_str();
            let _ = write!(
                text,
                "\nThe defaults are those of `mode = \"{mode}\"`; [Modes and effects](modes.md) compares both modes.\n"
            );
        }
        let rows = section.rows(&all);
        if rows.is_empty() {
            continue;
        }
        text.push_str("\n| key | type | unit | default | meaning |\n|---|---|---|---|---|\n");
        for row in &rows {
            let (unit, meaning) = unit_of(&row.doc);
            let default = default_words(&section, row, &defaults);
            let words = [type_words(&row.shape, &all), unit, default, meaning].map(|w| w.replace('|', "\\|"));
            let _ = writeln!(text, "| `{}` | {} |", row.name, words.join(" | "));
        }
        for row in &rows {
            let shape = inside(&row.shape, "Option").unwrap_or(&row.shape);
            let Some(definition) = all.get(shape).filter(|d| d.is_enum) else { continue };
            if let Some(first) = listed.get(shape) {
                let _ = write!(text, "\nThe values of `{}` are those of `{first}`.\n", row.name);
                continue;
            }
            listed.insert(shape.to_string(), section.key_path(&row.name));
            let _ = write!(text, "\nValues of `{}`:\n\n", row.name);
            for item in &definition.items {
                let _ = writeln!(text, "- `{}`: {}", variant_text(definition, item), unit_of(&item.doc).1);
            }
        }
    }
    text
}

#[test]
fn the_page_of_keys_is_that_of_the_configuration() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/configuration.md");
    if std::env::var_os("SATPHOT_WRITE_DOCS").is_some() {
        std::fs::write(&path, page()).unwrap();
    }
    assert_eq!(
        std::fs::read_to_string(path).unwrap(),
        page(),
        "write it again: SATPHOT_WRITE_DOCS=1 cargo test --test command_line"
    );
}

/// The keys that the reader of the file knows in a table: those it names when it refuses another.
fn known_keys(section: &Section, key: Option<&str>) -> BTreeSet<String> {
    let error = if section.repeated {
        let text = format!("{BASE}[[{}]]\nno_such_key = 1\n", section.path);
        Config::from_text(&text, &[]).unwrap_err()
    } else {
        let path = [section.path.as_str(), key.unwrap_or_default(), "no_such_key"];
        let path: Vec<&str> = path.into_iter().filter(|part| !part.is_empty()).collect();
        Config::from_text(BASE, &[format!("{}=1", path.join("."))]).unwrap_err()
    };
    let message = error.to_string();
    let known = message.split_once("Known here: ").unwrap_or_else(|| panic!("{}: {message}", section.path)).1;
    known.trim_end_matches('.').split(", ").map(str::to_string).collect()
}

#[test]
fn the_page_names_every_key_that_the_reader_of_the_file_knows_and_no_other() {
    let all = definitions();
    let mut n_keys = 0;
    for section in sections(&all) {
        let documented: BTreeSet<String> = section.items().map(|item| item.name).collect();
        assert_eq!(documented, known_keys(&section, None), "[{}]", section.path);
        n_keys += documented.len();
        for item in section.items() {
            if let Some(definition) = one_line(&item, &all) {
                let documented: BTreeSet<String> = definition.items.iter().map(|inner| inner.name.clone()).collect();
                assert_eq!(documented, known_keys(&section, Some(&item.name)), "{}", item.name);
            }
        }
    }
    assert!(n_keys > 120, "{n_keys}");
}

#[test]
fn every_key_says_what_it_does_and_a_name_with_a_unit_states_it() {
    let all = definitions();
    for section in sections(&all) {
        for row in section.rows(&all) {
            let (unit, meaning) = unit_of(&row.doc);
            assert!(meaning.len() > 4 && !meaning.contains("  ") && !meaning.contains('\\'), "{}: {meaning}", row.name);
            let suffixes = ["_px", "_deg", "_arcsec", "_adu", "_um", "_mm", "_fwhm", "_d", "_s", "_h", "_mb"];
            if suffixes.iter().any(|suffix| row.name.ends_with(suffix)) {
                assert!(!unit.is_empty(), "[{}] {} states no unit", section.path, row.name);
            }
        }
    }
}
