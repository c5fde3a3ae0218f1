//! The order of the rooms, as `ARCHITECTURE.md` writes it down: no room imports one below it, no two files import each other.
//!
//! Read from the source as text: every `use`, and every `crate::` and `super::` path in an expression, followed through
//! re-exports to the file that defines the name. A `mod.rs` that only declares and re-exports is no file of its own.
//! Not seen: paths made by macros, and code inside `#[cfg(test)] mod`.
#![allow(clippy::unwrap_used)]

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

type Graph = BTreeMap<String, BTreeSet<String>>;

/// The rooms of `ARCHITECTURE.md`, in their order: the rows "| `base/` | ...".
fn rooms(page: &str) -> Vec<String> {
    page.lines().filter_map(|l| Some(l.strip_prefix("| `")?.split_once("/`")?.0.to_string())).collect()
}

/// Every module below a folder and its text, without comments and without inline test modules.
fn read_modules(folder: &Path, prefix: &str, out: &mut BTreeMap<String, String>) {
    for entry in fs::read_dir(folder).unwrap().map(Result::unwrap) {
        let path = entry.path();
        let name = path.file_stem().unwrap().to_str().unwrap().to_string();
        if path.is_dir() {
            read_modules(&path, &join(prefix, &name), out);
        } else if path.extension().is_some_and(|e| e == "rs") && !["lib", "main"].contains(&name.as_str()) {
            let tests = name == "tests" || name.ends_with("_tests");
            let module = if name == "mod" { prefix.to_string() } else { join(prefix, &name) };
            if !tests {
                out.insert(module, bare(&fs::read_to_string(&path).unwrap()));
            }
        }
    }
}

/// Text without comments, and without what follows the first `#[cfg(test)] mod`.
fn bare(text: &str) -> String {
    let lines = text.lines().map(|l| l.find("//").map_or(l, |at| &l[..at]));
    let text: String = lines.map(|l| l.to_string() + "\n").collect();
    let text = text.replace("#[cfg(test)]\nmod tests;\n", "");
    text.split("#[cfg(test)]\nmod tests {").next().unwrap().to_string()
}

fn join(a: &str, b: &str) -> String {
    if a.is_empty() { b.to_string() } else { format!("{a}::{b}") }
}

/// The paths of a `use` tree: `a::{b, c::d as e}` is `a::b` and `a::c::d`.
fn leaves(tree: &str, prefix: &str, out: &mut Vec<String>) {
    let (mut depth, mut start) = (0, 0);
    let mut parts = Vec::new();
    for (at, c) in tree.char_indices() {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                parts.push(&tree[start..at]);
                start = at + 1;
            }
            _ => {}
        }
    }
    parts.push(&tree[start..]);
    for part in parts.into_iter().map(str::trim).filter(|p| !p.is_empty()) {
        match part.split_once('{') {
            Some((head, rest)) => {
                leaves(rest.trim_end().trim_end_matches('}'), &format!("{prefix}{}", head.trim()), out);
            }
            None => out.push(format!("{prefix}{}", part.split(" as ").next().unwrap().trim())),
        }
    }
}

/// The `use` trees of a text (with whether each is a re-export), and the text without them.
fn uses(text: &str) -> (Vec<(bool, String)>, String) {
    let (mut found, mut rest, mut statement) = (Vec::new(), String::new(), None::<(bool, String)>);
    for line in text.lines() {
        let words = line.trim_start();
        if let Some((_, tree)) = &mut statement {
            *tree += words;
        } else {
            let (public, after) = match words.strip_prefix("pub") {
                Some(after) if after.starts_with('(') => {
                    (true, after.split_once(')').map_or("", |(_, a)| a).trim_start())
                }
                Some(after) => (true, after.trim_start()),
                None => (false, words),
            };
            match after.strip_prefix("use ") {
                Some(tree) => statement = Some((public, tree.to_string())),
                None => rest += &format!("{line}\n"),
            }
        }
        if let Some((public, tree)) = statement.take_if(|(_, tree)| tree.trim_end().ends_with(';')) {
            found.push((public, tree.trim_end().trim_end_matches(';').to_string()));
        }
    }
    (found, rest)
}

/// All that is known of the source: its modules and where each re-exported name comes from.
struct Source {
    modules: BTreeMap<String, String>,
    exports: BTreeMap<(String, String), String>,
}

impl Source {
    fn new(modules: BTreeMap<String, String>) -> Self {
        let mut source = Self { modules, exports: BTreeMap::new() };
        let mut exports = BTreeMap::new();
        for (module, text) in &source.modules {
            for (_, tree) in uses(text).0.into_iter().filter(|(public, _)| *public) {
                let mut paths = Vec::new();
                leaves(&tree, "", &mut paths);
                for path in paths {
                    if let Some(absolute) = source.absolute(module, &path)
                        && let Some((_, name)) = absolute.rsplit_once("::")
                    {
                        exports.insert((module.clone(), name.to_string()), absolute.clone());
                    }
                }
            }
        }
        source.exports = exports;
        source
    }

    /// A folder's module exists even where it has no `mod.rs` of its own.
    fn is_module(&self, path: &str) -> bool {
        let below = format!("{path}::");
        self.modules.contains_key(path)
            || self.modules.range(below.clone()..).next().is_some_and(|(k, _)| k.starts_with(&below))
    }

    /// A path as written in a module, from the root of the crate; `None` for another crate or a local name.
    fn absolute(&self, here: &str, path: &str) -> Option<String> {
        let (mut from, mut path) = (here.to_string(), path);
        if let Some(rest) = path.strip_prefix("crate::") {
            return Some(rest.to_string());
        }
        if let Some(rest) = path.strip_prefix("self::") {
            return Some(join(here, rest));
        }
        if !path.starts_with("super::") {
            let first = path.split("::").next().unwrap();
            return self.is_module(&join(here, first)).then(|| join(here, path));
        }
        while let Some(rest) = path.strip_prefix("super::") {
            from = from.rsplit_once("::").map_or(String::new(), |(up, _)| up.to_string());
            path = rest;
        }
        Some(join(&from, path))
    }

    /// The file that defines what a path from the root names.
    fn definition(&self, path: &str, hops: usize) -> Option<String> {
        let mut module = String::new();
        let mut rest = path.split("::").peekable();
        while let Some(next) = rest.peek().filter(|n| self.is_module(&join(&module, n))) {
            module = join(&module, next);
            rest.next();
        }
        if let Some(name) = rest.next()
            && let Some(origin) = self.exports.get(&(module.clone(), name.to_string()))
            && origin != path
            && hops < 8
        {
            return self.definition(origin, hops + 1);
        }
        (!module.is_empty()).then_some(module)
    }

    /// Whether a module does more than declare and re-export.
    fn is_node(&self, module: &str) -> bool {
        self.modules.get(module).is_some_and(|text| {
            let (_, rest) = uses(text);
            rest.lines().map(str::trim).any(|l| {
                let declares = l.trim_start_matches("pub").trim_start_matches("(crate)").trim_start_matches("(super)");
                !(l.is_empty()
                    || l.starts_with("#[")
                    || l.starts_with("#!")
                    || declares.trim().starts_with("mod ") && l.ends_with(';'))
            })
        })
    }

    fn graph(&self) -> Graph {
        let mut graph = Graph::new();
        for (here, text) in self.modules.iter().filter(|(m, _)| self.is_node(m)) {
            let (trees, rest) = uses(text);
            let mut paths = Vec::new();
            trees.iter().for_each(|(_, tree)| leaves(tree, "", &mut paths));
            for start in ["crate::", "super::"] {
                for (at, _) in rest.match_indices(start).filter(|(at, _)| !rest[..*at].ends_with("::")) {
                    let end = rest[at..].find(|c: char| !c.is_alphanumeric() && c != '_' && c != ':');
                    paths.push(rest[at..at + end.unwrap_or(rest.len() - at)].trim_end_matches(':').to_string());
                }
            }
            let to = graph.entry(here.clone()).or_default();
            for path in paths {
                let found = self.absolute(here, &path).and_then(|p| self.definition(&p, 0));
                to.extend(found.filter(|m| m != here && self.is_node(m)));
            }
        }
        graph
    }
}

/// What a folder's `mod.rs`, which is no file of its own, hands on from a room below it.
fn upward_exports(source: &Source, rooms: &[String]) -> Vec<String> {
    let rank = |m: &str| rooms.iter().position(|r| *r == m.split("::").next().unwrap());
    let mut wrong = Vec::new();
    for ((here, _), origin) in source.exports.iter().filter(|((here, _), _)| !source.is_node(here)) {
        let from = source.definition(origin, 0);
        wrong.extend(
            from.filter(|from| rank(from) > rank(here)).map(|from| format!("{here} re-exports upward: {from}")),
        );
    }
    wrong
}

/// What breaks the order of the rooms.
fn upward(graph: &Graph, rooms: &[String]) -> Vec<String> {
    let rank = |m: &str| rooms.iter().position(|r| *r == m.split("::").next().unwrap());
    let mut wrong = Vec::new();
    for (here, to) in graph {
        let Some(mine) = rank(here) else {
            wrong.push(format!("{here}: ARCHITECTURE.md knows no such room"));
            continue;
        };
        wrong.extend(to.iter().filter(|t| rank(t) > Some(mine)).map(|t| format!("{here} imports upward: {t}")));
    }
    wrong
}

/// Every file a file leads to, over any number of imports.
fn reached<'a>(graph: &'a Graph, from: &'a str) -> BTreeSet<&'a str> {
    let (mut found, mut next) = (BTreeSet::new(), vec![from]);
    while let Some(file) = next.pop() {
        let to = graph.get(file).into_iter().flatten();
        next.extend(to.map(String::as_str).filter(|t| found.insert(*t)));
    }
    found
}

/// The groups of files that lead to one another, each group a line.
fn circles(graph: &Graph) -> Vec<String> {
    let leads: BTreeMap<&str, BTreeSet<&str>> = graph.keys().map(|k| (k.as_str(), reached(graph, k))).collect();
    let mut found = BTreeSet::new();
    for (file, to) in leads.iter().filter(|(file, to)| to.contains(*file)) {
        let group = to.iter().filter(|t| leads.get(*t).is_some_and(|back| back.contains(file)));
        found.insert(format!("circle: {}", group.copied().collect::<Vec<_>>().join(", ")));
    }
    found.into_iter().collect()
}

fn source_of(files: &[(&str, &str)]) -> Source {
    Source::new(files.iter().map(|(m, t)| (m.to_string(), bare(t))).collect())
}

#[test]
fn rooms_import_downward_and_files_form_no_circles() {
    let rooms = rooms(&fs::read_to_string("ARCHITECTURE.md").unwrap());
    assert!(rooms.len() > 15, "{rooms:?}");
    let mut modules = BTreeMap::new();
    read_modules(Path::new("src"), "", &mut modules);
    let source = Source::new(modules);
    let graph = source.graph();
    assert!(graph.len() > 400 && graph.values().map(BTreeSet::len).sum::<usize>() > 1000, "the reader lost the source");
    let wrong = [upward(&graph, &rooms), upward_exports(&source, &rooms), circles(&graph)].concat();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn an_upward_import_is_found_in_use_lines_expressions_and_through_re_exports() {
    let rooms = ["base", "frames", "cli"].map(str::to_string);
    for text in [
        "use crate::frames::Frame;",
        "fn f() -> crate::frames::Frame { todo() }",
        "use crate::{frames::{Frame, self}};",
    ] {
        let source = source_of(&[
            ("base::error", &format!("{text}\nfn g() {{}}")),
            ("frames", "pub mod frame;\npub use frame::Frame;"),
            ("frames::frame", "pub struct Frame;"),
        ]);
        let graph = source.graph();
        assert_eq!(upward(&graph, &rooms), ["base::error imports upward: frames::frame"], "{text}");
        assert!(circles(&graph).is_empty());
    }
    let stranger = source_of(&[("attic::a", "fn f() {}")]);
    assert_eq!(upward(&stranger.graph(), &rooms), ["attic::a: ARCHITECTURE.md knows no such room"]);
}

#[test]
fn an_upward_re_export_of_a_folder_is_found() {
    let rooms = ["base", "frames", "cli"].map(str::to_string);
    let planted = source_of(&[
        ("base", "pub mod error;\npub use crate::frames::Frame;\npub use error::Error;"),
        ("base::error", "pub struct Error;"),
        ("frames", "pub mod frame;\npub use frame::Frame;\npub use crate::base::Error;"),
        ("frames::frame", "pub struct Frame;"),
    ]);
    assert!(upward(&planted.graph(), &rooms).is_empty());
    assert_eq!(upward_exports(&planted, &rooms), ["base re-exports upward: frames::frame"]);
}

#[test]
fn a_circle_is_found_and_a_folder_that_only_re_exports_is_none() {
    let through_the_folder = source_of(&[
        ("frames", "mod a;\nmod b;\npub use a::A;\npub(super) use b::B;"),
        ("frames::a", "use super::B;\npub struct A;"),
        ("frames::b", "// use super::A;\npub struct B;\n#[cfg(test)]\nmod tests { use super::super::A; }"),
    ]);
    assert!(circles(&through_the_folder.graph()).is_empty());
    let circle = source_of(&[
        ("frames", "mod a;\nmod b;\npub use a::A;\npub(super) use b::B;"),
        ("frames::a", "use super::B;\npub struct A;"),
        ("frames::b", "pub struct B(super::A);"),
    ]);
    assert_eq!(circles(&circle.graph()), ["circle: frames::a, frames::b"]);
}

/// Verbs of the program that are no words of everyday sentences after "satphot".
const VERBS: [&str; 22] = [
    "accuracy",
    "brdf",
    "compare",
    "detector",
    "export",
    "fetch",
    "flat",
    "init",
    "inspect",
    "limits",
    "measure",
    "merge",
    "passes",
    "plan",
    "predict",
    "render",
    "report",
    "run",
    "satellites",
    "solve",
    "verify",
    "zeropoint",
];
/// Lines to paste that these files still spell: what fetches a catalogue or elements, what makes a report's night again.
const STILL: [&str; 5] = [
    "config::load",
    "orbit::elements::select",
    "pipeline::stars::pointing",
    "pipeline::stars::solve_file",
    "report::page::provenance",
];

/// The string literals of a text without comments, those over several lines in one.
fn literals(text: &str) -> Vec<String> {
    let (mut found, mut open, mut escaped) = (Vec::new(), None::<String>, false);
    let mut before = '\0';
    for c in text.chars() {
        match &mut open {
            Some(_) if c == '"' && !escaped => found.extend(open.take()),
            Some(literal) => literal.push(c),
            None if c == '"' && before != '\'' => open = Some(String::new()),
            None => {}
        }
        escaped = c == '\\' && !escaped && open.is_some();
        before = c;
    }
    found
}

/// Whether a text names an option or a verb of the terminal.
fn names_the_terminal(literal: &str) -> bool {
    let after = |mark: &str| literal.split(mark).skip(1).map(str::to_owned).collect::<Vec<_>>();
    let option = [" --", "`--"].iter().flat_map(|mark| after(mark)).any(|rest| rest.starts_with(char::is_lowercase));
    let verb = after("satphot ").iter().any(|rest| {
        let word: String = rest.chars().take_while(char::is_ascii_lowercase).collect();
        VERBS.contains(&word.as_str())
    });
    option || verb
}

#[test]
fn the_library_names_no_verb_and_no_option_of_the_terminal() {
    let mut modules = BTreeMap::new();
    read_modules(Path::new("src"), "", &mut modules);
    let library = modules.iter().filter(|(m, _)| !m.starts_with("cli") && !STILL.contains(&m.as_str()));
    let wrong: Vec<String> = library
        .flat_map(|(m, text)| literals(text).into_iter().map(move |literal| (m, literal)))
        .filter(|(_, literal)| names_the_terminal(literal))
        .map(|(m, literal)| format!("{m}: {literal}"))
        .collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert_eq!(literals("let a = \"x \\\" y\"; let b = '\"'; f(\"z\")"), ["x \\\" y", "z"]);
    for planted in ["run `satphot fetch elements`", "give --norad", "`--norad` is missing"].map(|t| format!("so: {t}"))
    {
        assert!(names_the_terminal(&planted), "{planted}");
    }
    assert!(!names_the_terminal("is nothing satphot reads -- or so"));
}
