//! The commands of the README and of docs/ are run, and their outputs are compared with the pages.
//!
//! A fenced block marked `console` holds commands (`$ command`, continued after a backslash), each followed by the code it
//! exits with where that is not 0 (`? 2`) and by what it prints. The blocks of a page run in order in one empty folder.
//! `[..]` stands for any part of a line, a line `...` for any lines. Times, memory, versions and the folder are not compared.
//! A line `<!-- uses: a b -->` copies files of the repository into the folder first.
//! `SATPHOT_WRITE_DOCS=1 cargo test --test command_line docs_run` writes the outputs into the pages again.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

/// What stands in a ```sh block is not run: how such a command begins, and why it is not run.
const NOT_RUN: [(&str, &str); 15] = [
    ("sudo apt-get", "changes the machine"),
    ("curl ", "needs the network and changes the machine"),
    ("git clone", "needs the network"),
    ("cargo install", "changes the machine"),
    ("cargo build", "takes minutes"),
    ("cargo test", "takes minutes; this is one of its tests"),
    ("cargo run --release -- run", "the same run is in the console block that follows it, by the built program"),
    ("sbatch", "needs a cluster"),
    ("mdbook build", "needs a program that the tests do not install"),
    ("scripts/", "takes minutes; the tests of scripts/ are its own"),
    ("satphot fetch", "needs the network; tests/export/fetch.rs runs it against a server of its own"),
    ("satphot init", "the file it writes has to be edited for a night of your own; docs/first_night.md runs it"),
    ("satphot run", "needs a night of your own; docs/first_night.md runs it"),
    ("satphot flat --plan", "a template for a night of your own; tests/night/ runs the steps of a plan"),
    ("satphot ", "a template with names of your own; its verb and options are checked"),
];

/// Longer lines are cut when they are written into a page [characters].
const WIDTH: usize = 140;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The README and the pages of docs/, sorted by name.
fn pages() -> Vec<String> {
    let names = std::fs::read_dir(root().join("docs")).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap());
    let mut pages: Vec<String> = names.filter(|n| n.ends_with(".md")).map(|n| format!("docs/{n}")).collect();
    pages.push("README.md".into());
    pages.sort();
    pages
}

/// A command of a page with the lines that are expected of it.
#[derive(Debug)]
struct Call {
    /// Lines of the page from the `$` on, as they stand there.
    shown: Vec<String>,
    code: i32,
    expected: Vec<String>,
}

impl Call {
    fn command(&self) -> String {
        let lines: Vec<&str> = self.shown.iter().map(|l| l.trim_start_matches("$ ").trim_end_matches('\\')).collect();
        lines.concat().replace("cargo run --release -- ", "satphot ")
    }
}

/// A page in parts: text that is left alone, and the calls of a console block.
enum Part {
    Text(String),
    Calls(Vec<Call>),
}

fn parts(page: &str) -> Vec<Part> {
    let mut parts = Vec::new();
    let mut text = String::new();
    let mut lines = page.lines();
    while let Some(line) = lines.next() {
        text.push_str(line);
        text.push('\n');
        if line.trim_end() != "```console" {
            continue;
        }
        parts.push(Part::Text(std::mem::take(&mut text)));
        let mut calls: Vec<Call> = Vec::new();
        for line in lines.by_ref() {
            if line.trim_end() == "```" {
                text.push_str("```\n");
                break;
            }
            if line.starts_with("$ ") {
                calls.push(Call { shown: vec![line.into()], code: 0, expected: Vec::new() });
                continue;
            }
            let call = calls.last_mut().expect("a console block begins with `$ command`");
            if call.expected.is_empty() && call.shown.last().unwrap().ends_with('\\') {
                call.shown.push(line.into());
            } else if let (true, Some(code)) = (call.expected.is_empty(), line.strip_prefix("? ")) {
                call.code = code.trim().parse().unwrap();
            } else {
                call.expected.push(line.into());
            }
        }
        parts.push(Part::Calls(calls));
    }
    parts.push(Part::Text(text));
    parts
}

/// The line without what differs from machine to machine and from run to run.
fn masked(line: &str) -> String {
    let volatile =
        line.contains("peak memory") || line.contains(" threads if the disk") || line.starts_with("satphot 0.");
    let mut out = String::new();
    for c in line.trim_end().chars() {
        if volatile && (c.is_ascii_digit() || c == '.') {
            if !out.ends_with('#') {
                out.push('#');
            }
        } else {
            out.push(c);
        }
    }
    out
}

/// Whether a line agrees with a pattern in which `[..]` stands for anything.
fn line_agrees(pattern: &str, line: &str) -> bool {
    let (pattern, line) = (masked(pattern), masked(line));
    let pieces: Vec<&str> = pattern.split("[..]").collect();
    let [first, middle @ .., last] = pieces.as_slice() else { return pattern == line };
    let Some(mut rest) = line.strip_prefix(first) else { return false };
    for piece in middle {
        let Some(at) = rest.find(piece) else { return false };
        rest = &rest[at + piece.len()..];
    }
    rest.ends_with(last)
}

fn agrees(expected: &[String], printed: &[String]) -> bool {
    match expected.split_first() {
        None => printed.is_empty(),
        Some((first, rest)) if first == "..." => (0..=printed.len()).any(|n| agrees(rest, &printed[n..])),
        Some((first, rest)) => {
            printed.split_first().is_some_and(|(p, more)| line_agrees(first, p) && agrees(rest, more))
        }
    }
}

/// The printed lines, cut where the page cuts them: around a line `...`, and at `[..]` of lines that still agree.
fn cut(expected: &[String], printed: &[String]) -> Vec<String> {
    let short = |l: &String| match l.char_indices().nth(WIDTH) {
        Some((at, _)) => format!("{}[..]", &l[..at]),
        None => l.clone(),
    };
    let kept = |lines: &[String], shown: &[String]| -> Vec<String> {
        lines.iter().map(|l| shown.iter().find(|s| line_agrees(s, l)).cloned().unwrap_or_else(|| short(l))).collect()
    };
    let is_gap = |l: &String| l == "...";
    let (Some(first), Some(last)) = (expected.iter().position(is_gap), expected.iter().rposition(is_gap)) else {
        return kept(printed, expected);
    };
    let (head, tail) = (first, expected.len() - 1 - last);
    if head + tail >= printed.len() {
        return kept(printed, expected);
    }
    let mut out = kept(&printed[..head], expected);
    out.push("...".into());
    out.extend(kept(&printed[printed.len() - tail..], expected));
    out
}

fn copy(from: &Path, to: &Path) {
    if from.is_dir() {
        std::fs::create_dir_all(to).unwrap();
        for entry in std::fs::read_dir(from).unwrap() {
            let entry = entry.unwrap();
            copy(&entry.path(), &to.join(entry.file_name()));
        }
    } else {
        std::fs::copy(from, to).unwrap();
    }
}

/// An empty folder for a page, with the files of the repository that it names.
fn folder(page: &str, text: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("pages").join(page.replace('/', "_"));
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    let used = text.lines().filter_map(|l| l.strip_prefix("<!-- uses: ")?.strip_suffix(" -->"));
    for name in used.flat_map(str::split_whitespace) {
        let to = folder.join(name);
        std::fs::create_dir_all(to.parent().unwrap()).unwrap();
        copy(&root().join(name), &to);
    }
    folder
}

/// Runs a command as a shell in the folder would; exit code and lines of both outputs.
fn run(command: &str, folder: &Path) -> (i32, Vec<String>) {
    let program = Path::new(env!("CARGO_BIN_EXE_satphot")).parent().unwrap();
    let output = Command::new("sh")
        .args(["-c", &format!("exec 2>&1; {command}")])
        .current_dir(folder)
        .env_clear()
        .env("PATH", format!("{}:/usr/local/bin:/usr/bin:/bin", program.display()))
        .env("HOME", folder)
        .env("TZ", "UTC")
        .env("LC_ALL", "C.UTF-8")
        .env("COLUMNS", "100")
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&output.stdout).replace(&folder.display().to_string(), "[DIR]");
    (output.status.code().unwrap_or(-1), text.lines().map(|l| l.trim_end().to_string()).collect())
}

/// Runs the commands of a page; what is wrong, and the page with the outputs of today.
fn check(name: &str) -> (usize, Vec<String>, String) {
    let text = std::fs::read_to_string(root().join(name)).unwrap();
    let mut parts = parts(&text);
    let (mut n, mut wrong, mut written) = (0, Vec::new(), String::new());
    let folder = folder(name, &text);
    for part in &mut parts {
        let calls = match part {
            Part::Text(text) => {
                written.push_str(text);
                continue;
            }
            Part::Calls(calls) => calls,
        };
        for call in calls {
            n += 1;
            let (code, printed) = run(&call.command(), &folder);
            if call.expected == ["..."] {
                call.expected = vec!["shows nothing".into()]; // would agree with any output
            }
            if code != call.code || !agrees(&call.expected, &printed) {
                wrong.push(format!("{name}: {}\n? {code}\n{}", call.shown.join("\n"), printed.join("\n")));
                call.expected = cut(&call.expected, &printed);
                call.code = code;
            }
            let _ = writeln!(written, "{}", call.shown.join("\n"));
            if call.code != 0 {
                let _ = writeln!(written, "? {}", call.code);
            }
            for line in &call.expected {
                let _ = writeln!(written, "{line}");
            }
        }
    }
    let _ = std::fs::remove_dir_all(&folder);
    (n, wrong, written)
}

#[test]
fn every_command_of_the_pages_prints_what_the_page_shows() {
    let results: Vec<_> = std::thread::scope(|scope| {
        let running: Vec<_> = pages().into_iter().map(|p| scope.spawn(move || (check(&p), p))).collect();
        running.into_iter().map(|r| r.join().unwrap()).collect()
    });
    let write = std::env::var_os("SATPHOT_WRITE_DOCS").is_some();
    let (mut n, mut wrong) = (0, Vec::new());
    for ((calls, differ, text), page) in results {
        n += calls;
        if write && !differ.is_empty() {
            std::fs::write(root().join(&page), text).unwrap();
            println!("{page}: {} outputs written", differ.len());
        } else {
            wrong.extend(differ);
        }
    }
    println!("{n} commands run");
    assert!(n >= 20, "only {n} commands are run");
    assert!(
        wrong.is_empty(),
        "{} commands print something else; read the difference, then SATPHOT_WRITE_DOCS=1 cargo test --test command_line \
         docs_run writes them\n\n{}",
        wrong.len(),
        wrong.join("\n\n")
    );
}

#[test]
fn a_command_that_is_not_run_has_a_reason() {
    let (mut n, mut wrong) = (0, Vec::new());
    for name in pages() {
        let text = std::fs::read_to_string(root().join(&name)).unwrap();
        let (mut fence, mut continued) = (String::new(), false);
        for line in text.lines() {
            if let Some(kind) = line.trim_start().strip_prefix("```") {
                fence = if fence.is_empty() { format!("```{kind}") } else { String::new() };
                continued = false;
            } else if fence == "```sh" {
                let command = line.trim();
                if !continued && !command.is_empty() && !command.starts_with('#') && command != "..." {
                    n += 1;
                    if !NOT_RUN.iter().any(|(begin, _)| command.starts_with(begin)) {
                        wrong.push(format!("{name}: not run, without a reason: {command}"));
                    }
                }
                continued = command.ends_with('\\');
            } else if line.starts_with("$ ") && fence != "```console" {
                wrong.push(format!("{name}: a command outside a console block: {line}"));
            }
        }
    }
    println!("{n} commands not run");
    assert!(NOT_RUN.iter().all(|(begin, why)| !begin.is_empty() && why.len() > 10));
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn a_pattern_agrees_with_what_it_stands_for_alone() {
    let lines = |text: &str| text.lines().map(str::to_string).collect::<Vec<_>>();
    assert!(agrees(&lines("a\n...\nz 1[..]"), &lines("a\nb\nc\nz 123")));
    assert!(agrees(
        &lines("0.8 s, 6 MB of frames, 7 MB/s, 40 MB peak memory"),
        &lines("12 s, 6 MB of frames, 1.5 MB/s, 41 MB peak memory")
    ));
    assert!(!agrees(&lines("a\n..."), &lines("b")));
    assert!(!agrees(&lines("ZP -23.37"), &lines("ZP -23.38")));
    assert!(!agrees(&lines("a"), &lines("a\nb")));
}
