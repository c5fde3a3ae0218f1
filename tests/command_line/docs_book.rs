//! The book: every page is in its summary, every link leads somewhere, every option a page names is one of the program.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Options of other programs that the pages call.
const OF_OTHERS: [&str; 14] = [
    "--release",
    "--locked",
    "--features",
    "--path",
    "--nocapture",
    "--test",
    "--profile",
    "--bench",
    "--example",
    "--bin",
    "--array",
    "--mem",
    "--wrap",
    "--published",
];

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The pages of docs/ and the README, by name.
fn pages() -> BTreeMap<String, String> {
    let mut pages = BTreeMap::new();
    for entry in std::fs::read_dir(root().join("docs")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "md") {
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            pages.insert(format!("docs/{name}"), std::fs::read_to_string(&path).unwrap());
        }
    }
    pages.insert("README.md".into(), std::fs::read_to_string(root().join("README.md")).unwrap());
    pages
}

/// Targets of `](target)` outside code blocks.
fn links(text: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut in_code = false;
    for line in text.lines() {
        in_code ^= line.trim_start().starts_with("```");
        if !in_code {
            let ends = line.split("](").skip(1).filter_map(|rest| rest.split_once(')'));
            found.extend(ends.map(|(target, _)| target.to_string()));
        }
    }
    found
}

/// Words such as `--verdicts` in a text.
fn options(text: &str) -> BTreeSet<String> {
    let letter = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
    let mut found = BTreeSet::new();
    for (i, _) in text.match_indices("--") {
        let before = text[..i].chars().next_back();
        let rest: String = text[i + 2..].chars().take_while(|c| letter(*c)).collect();
        let begins = before.is_none_or(|c| c.is_whitespace() || "`([\"'|,/".contains(c));
        if begins && rest.starts_with(|c: char| c.is_ascii_lowercase()) {
            found.insert(format!("--{}", rest.trim_end_matches('-')));
        }
    }
    found
}

/// Options of every verb, by its full name without `satphot`, from the program's own help.
fn verbs() -> BTreeMap<String, BTreeSet<String>> {
    let mut found = BTreeMap::new();
    let mut todo = vec![String::new()];
    while let Some(verb) = todo.pop() {
        let words: Vec<&str> = verb.split_whitespace().chain(["--help"]).collect();
        let output = Command::new(env!("CARGO_BIN_EXE_satphot")).args(words).output().unwrap();
        let help = String::from_utf8(output.stdout).unwrap();
        // the verbs of the program itself stand in groups before its options
        let below = match verb.as_str() {
            "" => help.split("\nOptions:\n").next(),
            _ => help.split("\nCommands:\n").nth(1).map(|rest| rest.split("\n\n").next().unwrap_or_default()),
        };
        for line in below.unwrap_or_default().lines() {
            let name = line.split_whitespace().next().unwrap_or_default();
            if line.starts_with("  ") && !line.starts_with("   ") && name != "help" && name != "Example:" {
                todo.push(format!("{verb} {name}").trim().to_string());
            }
        }
        found.insert(verb, options(&help));
    }
    assert!(found.len() > 30, "{:?}", found.keys());
    found
}

#[test]
fn every_page_is_in_the_summary_and_the_summary_names_no_other() {
    let summary = std::fs::read_to_string(root().join("docs/SUMMARY.md")).unwrap();
    let listed: BTreeSet<String> = links(&summary).into_iter().map(|l| format!("docs/{l}")).collect();
    let there: BTreeSet<String> =
        pages().into_keys().filter(|name| name.starts_with("docs/") && name != "docs/SUMMARY.md").collect();
    assert_eq!(listed, there);
    assert_eq!(links(&summary).len(), listed.len(), "a page is listed twice");
    assert!(root().join("docs/book.toml").exists());
}

#[test]
fn every_link_leads_to_a_file_and_every_anchor_to_a_heading() {
    for (name, text) in pages() {
        let folder: PathBuf = root().join(&name).parent().unwrap().to_path_buf();
        for link in links(&text).into_iter().filter(|l| !l.contains("://") && !l.starts_with("mailto:")) {
            let (file, anchor) = link.split_once('#').unwrap_or((&link, ""));
            let path = if file.is_empty() { root().join(&name) } else { folder.join(file) };
            assert!(path.exists(), "{name}: {link}");
            if !anchor.is_empty() {
                let heading = |line: &str| {
                    let words = line.trim_start_matches('#').trim().to_lowercase().replace(' ', "-");
                    words.chars().filter(|c| c.is_alphanumeric() || "-_".contains(*c)).collect::<String>()
                };
                let target = std::fs::read_to_string(&path).unwrap();
                assert!(target.lines().any(|l| l.starts_with('#') && heading(l) == anchor), "{name}: {link}");
            }
        }
    }
}

#[test]
fn every_verb_and_option_a_page_names_exists_and_belongs_to_the_verb_it_is_shown_with() {
    let verbs = verbs();
    let all: BTreeSet<&String> = verbs.values().flatten().collect();
    let mut wrong = Vec::new();
    for (name, text) in pages() {
        for option in options(&text) {
            if !all.contains(&option) && !OF_OTHERS.contains(&option.as_str()) {
                wrong.push(format!("{name}: no verb has {option}"));
            }
        }
        let mut fence = "";
        for line in text.lines() {
            if let Some(kind) = line.trim_start().strip_prefix("```") {
                fence = kind;
            }
            let is_command = line.starts_with("$ ") || fence == "sh";
            let line = line.trim().trim_start_matches("$ ");
            let Some(call) = line.strip_prefix("satphot ") else { continue };
            let call = call.split(['|', '>', ';', '#']).next().unwrap_or_default();
            let call = call.split("  ").next().unwrap_or_default();
            let words: Vec<&str> = call.split_whitespace().collect();
            let two = words.iter().take(2).copied().collect::<Vec<_>>().join(" ");
            let one = words.first().copied().unwrap_or_default();
            let Some(known) = verbs.get(&two).or_else(|| verbs.get(one)) else {
                if is_command && !one.starts_with('-') {
                    wrong.push(format!("{name}: `satphot {call}`: no such verb"));
                }
                continue;
            };
            let foreign = options(call).into_iter().filter(|o| !known.contains(o));
            wrong.extend(foreign.map(|o| format!("{name}: `satphot {call}`: no {o}")));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn the_table_of_modes_has_every_effect_with_both_presets() {
    use satphot::config::{Effects, Mode};
    let page = std::fs::read_to_string(root().join("docs/modes.md")).unwrap();
    let of = |mode| serde_json::to_value(Effects::of(mode)).unwrap();
    let (published, corrected) = (of(Mode::AsPublished), of(Mode::Corrected));
    for (key, value) in published.as_object().unwrap() {
        let line = page.lines().find(|l| l.starts_with(&format!("| `{key}` |"))).unwrap_or_else(|| panic!("{key}"));
        let cells: Vec<&str> = line.split('|').map(str::trim).collect();
        for (cell, value) in [(cells[2], value), (cells[3], &corrected[key])] {
            assert!(cell.starts_with(&format!("`{}`", value.as_str().unwrap())), "{key}: {cell}, not {value}");
        }
    }
}

#[test]
fn the_page_of_exit_codes_has_every_code_of_the_program() {
    let page = std::fs::read_to_string(root().join("docs/exit_codes.md")).unwrap();
    let help = Command::new(env!("CARGO_BIN_EXE_satphot")).arg("--help").output().unwrap();
    let help = String::from_utf8(help.stdout).unwrap();
    for code in ["0", "1", "2", "3", "4", "5", "6", "75"] {
        assert!(page.contains(&format!("\n| {code} |")), "{code}");
        assert!(help.lines().any(|l| l.trim_start().starts_with(&format!("{code}  "))), "{code} in --help");
    }
    assert!(page.contains("| 130, 143 |") && help.contains("130  interrupted (143"));
}

#[test]
fn the_citation_and_the_badges_agree_with_the_package() {
    let read = |name: &str| std::fs::read_to_string(root().join(name)).unwrap();
    let (citation, readme) = (read("CITATION.cff"), read("README.md"));
    assert!(citation.contains(concat!("\nversion: ", env!("CARGO_PKG_VERSION"), "\n")));
    assert!(citation.contains("\nlicense: MIT\n") && read("LICENSE").starts_with("MIT License"));
    let manifest: toml::Table = read("Cargo.toml").parse().unwrap();
    let package = manifest["package"].as_table().unwrap();
    assert_eq!(package["license"].as_str(), Some("MIT"));
    assert!(readme.contains("badge/licence-MIT-"));
    assert!(readme.contains(&format!("badge/rust-{}%2B-", package["rust-version"].as_str().unwrap())));
}

#[test]
fn every_embedded_file_of_data_is_in_the_licence_of_the_data() {
    let licence = std::fs::read_to_string(root().join("LICENSE-DATA.md")).unwrap();
    for folder in ["src/presets", "src/presets/spectra", "src/frames", "src/paper"] {
        for entry in std::fs::read_dir(root().join(folder)).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            if ["csv", "txt", "tle"].iter().any(|kind| path.extension().is_some_and(|e| e == *kind)) {
                let families = ["sdss_doi_2010_", "bessell_1990_"];
                let family =
                    families.iter().find(|f| name.starts_with(**f)).map_or(name.clone(), |f| format!("{f}*.csv"));
                assert!(
                    licence.contains(&format!("{folder}/{family}`")),
                    "{folder}/{name} has no line in LICENSE-DATA.md"
                );
            }
        }
    }
}
