//! Every help text shows how the verb is called, and what it shows can be called: each example is parsed.
#![allow(clippy::unwrap_used, clippy::panic)]

use clap::{Command, CommandFactory};

use super::Cli;
use super::usage::{self, GROUPS};

/// The words of a line as a shell would split them, up to a comment (two blanks), a pipe or a redirection.
fn words(line: &str) -> Vec<String> {
    let (mut words, mut word, mut quote) = (Vec::new(), None::<String>, None);
    let mut chars = line.trim().chars().peekable();
    while let Some(c) = chars.next() {
        match (quote, c) {
            (None, ' ') => {
                words.extend(word.take());
                if chars.peek() == Some(&' ') {
                    return words;
                }
            }
            (None, '|' | '>' | ';') => break,
            (None, '2') if word.is_none() && chars.peek() == Some(&'>') => break,
            (None, '\'' | '"') => {
                quote = Some(c);
                word.get_or_insert_default();
            }
            (Some(q), c) if c == q => quote = None,
            _ => word.get_or_insert_default().push(c),
        }
    }
    words.extend(word);
    words
}

/// A line with what was broken off it by backslashes, one blank between the parts.
fn continued(line: &str) -> String {
    let mut parts = line.split('\u{1}');
    let first = parts.next().unwrap_or_default().to_string();
    parts.fold(first, |whole, part| format!("{whole} {}", part.trim_start()))
}

/// Every command below `command`, with its full name.
fn all(command: &Command, name: &str, found: &mut Vec<(String, Command)>) {
    found.push((name.to_string(), command.clone()));
    for below in command.get_subcommands().filter(|c| c.get_name() != "help") {
        all(below, &format!("{name} {}", below.get_name()), found);
    }
}

fn commands() -> Vec<(String, Command)> {
    let mut command = Cli::command();
    command.build();
    let mut found = Vec::new();
    all(&command, "satphot", &mut found);
    found
}

#[test]
fn every_help_text_has_an_example_of_its_own_verb_and_every_example_parses() {
    let mut wrong = Vec::new();
    for (name, command) in commands() {
        // as it was written: a terminal may wrap it
        let help = command.get_after_help().map(ToString::to_string).unwrap_or_default();
        let help = help.split("\\\n").map(str::trim_end).collect::<Vec<_>>().join("\u{1}");
        let whole: Vec<String> = help.lines().map(continued).collect();
        let lines: Vec<&str> = whole.iter().map(String::as_str).filter(|l| l.starts_with("  satphot ")).collect();
        let shown = help.contains("Example") && lines.iter().any(|l| l.trim().starts_with(&name));
        if !shown && name != "satphot" {
            // the examples of `satphot` itself are those of the groups
            wrong.push(format!("{name} --help has no example of it"));
        }
        for line in lines {
            let parsed = Cli::command().try_get_matches_from(words(line));
            wrong.extend(parsed.err().map(|e| format!("{name} --help: `{}`: {e}", line.trim())));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn every_verb_is_in_one_group_of_the_help_and_the_examples_of_the_groups_parse() {
    let mut grouped: Vec<&str> = GROUPS.iter().flat_map(|(_, verbs, _)| verbs.iter().copied()).collect();
    grouped.sort_unstable();
    let mut command = Cli::command();
    command.build();
    let mut verbs: Vec<&str> = command.get_subcommands().map(Command::get_name).collect();
    verbs.sort_unstable();
    assert_eq!(grouped, verbs);
    let help = usage::command().render_help().to_string();
    let first = help.split("Options:").next().unwrap();
    assert!(first.lines().skip(3).all(|l| l.chars().count() <= 80), "wider than a terminal: {first}");
    for (group, verbs, example) in GROUPS {
        assert!(verbs.contains(&words(example)[1].as_str()), "{group}: {example}");
        Cli::command().try_get_matches_from(words(example)).unwrap_or_else(|e| panic!("{group}: {e}"));
    }
}

#[test]
fn every_verb_says_what_it_does_and_every_option_what_it_is_for() {
    for (name, command) in commands() {
        assert!(command.get_about().is_some(), "{name}");
        for arg in command.get_arguments() {
            assert!(arg.get_help().is_some() || arg.get_long_help().is_some(), "{name}: {}", arg.get_id());
        }
    }
}

#[test]
fn an_example_ends_where_its_comment_or_a_pipe_begins() {
    assert_eq!(words("  satphot run a.toml     it all"), ["satphot", "run", "a.toml"]);
    assert_eq!(words("satphot inspect --set 'a=[\"B\"]' x | head"), ["satphot", "inspect", "--set", "a=[\"B\"]", "x"]);
    assert_eq!(words("satphot run -q 2> log"), ["satphot", "run", "-q"]);
    assert_eq!(words("satphot a.2 2"), ["satphot", "a.2", "2"]);
}
