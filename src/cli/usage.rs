//! The command line as a whole: the verbs in groups, help that is wrapped once, and wrong arguments answered in the words of
//! all other errors.

use std::error::Error as _;
use std::process::ExitCode;

use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{Command, CommandFactory};

use super::{Cli, tell};

/// The verbs of `satphot --help` in their groups, each group with an example.
pub const GROUPS: [(&str, &[&str], &str); 6] = [
    (
        "Reduce",
        &["run", "watch", "init", "inspect", "flat", "zeropoint", "solve", "measure", "compare", "fit", "verify"],
        "satphot run night.toml",
    ),
    (
        "Predict",
        &["predict", "render", "satellites"],
        "satphot predict sky --satellite iss --sun-alt-deg -10 --sun-az-deg 90",
    ),
    ("Plan", &["passes", "plan-night", "limits", "fetch"], "satphot passes --elements iss.tle --start 2025-06-10"),
    ("Publish", &["report", "export"], "satphot export satphot-out/2025-06-09 --to votable -o night.vot"),
    ("Paper", &["published", "plot", "brdf", "check-table", "accuracy"], "satphot plot moon -o moon"),
    ("Tools", &["simulate", "detector", "plan", "merge", "completions", "man", "help"], "satphot simulate -o raw"),
];

/// The command line with its help as it is printed.
pub fn command() -> Command {
    let command = reflowed(Cli::command());
    let verbs = verbs(&command);
    command.help_template(format!(
        "{{about-with-newline}}\n{{usage-heading}} {{usage}}\n\n{verbs}Options:\n{{options}}{{after-help}}"
    ))
}

/// The groups with what each verb does, in the words of its own help.
fn verbs(command: &Command) -> String {
    let mut text = String::new();
    for (group, verbs, example) in GROUPS {
        text += &format!("{group}\n");
        for verb in verbs {
            let about = command.find_subcommand(verb).and_then(Command::get_about);
            let about = about.map_or("Print the help of a verb".into(), ToString::to_string);
            text += &format!("  {verb:<12} {about}\n");
        }
        text += &format!("  Example: {example}\n\n");
    }
    text
}

/// The command with the texts behind its options, and behind those of its verbs, as one line a paragraph: the terminal
/// wraps them at its own width.
fn reflowed(command: Command) -> Command {
    let after = command.get_after_help().map(|text| paragraphs(&text.to_string()));
    let command = match after {
        Some(text) => command.after_help(text),
        None => command,
    };
    command.mut_subcommands(reflowed)
}

/// Joins the lines of paragraphs. Indented lines (examples, lists), headings and short lines stay as they are.
fn paragraphs(text: &str) -> String {
    /// A line of fewer characters ends where its author meant it to.
    const SHORTEST_WRAPPED: usize = 60;
    let mut out = String::new();
    let mut goes_on = false;
    for line in text.lines() {
        let plain = !line.is_empty() && !line.starts_with([' ', '-']);
        if !out.is_empty() {
            out.push(if goes_on && plain { ' ' } else { '\n' });
        }
        out += line;
        goes_on = plain && line.chars().count() >= SHORTEST_WRAPPED && !line.ends_with(':');
    }
    out
}

/// Help goes to standard output; a wrong argument is an error like any other, exit code 2.
pub fn answer(error: &clap::Error, command: &Command) -> ExitCode {
    match error.kind() {
        ErrorKind::DisplayHelp | ErrorKind::DisplayVersion | ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => {
            super::output::printed(error.print());
            let code = u8::try_from(error.exit_code()).unwrap_or(2);
            if code == 0 { super::answer(Ok(())) } else { ExitCode::from(code) }
        }
        _ => {
            tell(&format!("error: {}", sentence(error, &verb(command, std::env::args().skip(1)))));
            ExitCode::from(2)
        }
    }
}

/// The verb of a command line, e.g. `satphot predict sky`.
fn verb(command: &Command, arguments: impl Iterator<Item = String>) -> String {
    let (mut here, mut name) = (command, "satphot".to_owned());
    for argument in arguments {
        let Some(inner) = here.find_subcommand(&argument) else { break };
        name += &format!(" {argument}");
        here = inner;
    }
    name
}

/// What is wrong, what is accepted, and where to read on.
fn sentence(error: &clap::Error, verb: &str) -> String {
    let values = |kind: ContextKind| match error.get(kind) {
        Some(ContextValue::String(text)) => vec![text.clone()],
        Some(ContextValue::Strings(texts)) => texts.clone(),
        _ => Vec::new(),
    };
    let text = |kind: ContextKind| values(kind).join(", ");
    let argument = text(ContextKind::InvalidArg);
    let option = argument.split(' ').next().unwrap_or_default();
    let value = text(ContextKind::InvalidValue);
    let did_you_mean = |kind: ContextKind| match values(kind).first() {
        Some(near) => format!("; did you mean `{near}`?"),
        None => ".".into(),
    };
    let help = format!("`{verb} --help` lists the options");
    match error.kind() {
        ErrorKind::UnknownArgument if option.starts_with('-') => {
            format!("{option}: unknown option{} {help}", did_you_mean(ContextKind::SuggestedArg))
        }
        ErrorKind::UnknownArgument => format!("\"{argument}\": `{verb}` takes no such argument; {help}"),
        ErrorKind::InvalidSubcommand => {
            let known = did_you_mean(ContextKind::SuggestedSubcommand);
            let wrong = text(ContextKind::InvalidSubcommand);
            format!("\"{wrong}\": unknown verb{known} `{verb} --help` lists the verbs")
        }
        ErrorKind::MissingSubcommand => format!("`{verb}` needs a verb; `{verb} --help` lists them"),
        ErrorKind::InvalidValue if value.is_empty() => format!("{option}: needs a value, as in `{argument}`; {help}"),
        ErrorKind::InvalidValue => {
            let accepted = text(ContextKind::ValidValue);
            format!(
                "{option}: \"{value}\" must be one of {accepted}{}",
                match values(ContextKind::SuggestedValue).first() {
                    Some(near) => format!("; did you mean \"{near}\"?"),
                    None => String::new(),
                }
            )
        }
        ErrorKind::ValueValidation => {
            let why = error.source().map(ToString::to_string).unwrap_or_default();
            let why = match why.as_str() {
                "invalid digit found in string" => "must be a whole number",
                "invalid float literal" if value.ends_with(['N', 'S', 'E', 'W']) => {
                    "must be a number; south and west are negative, such as -33.77,151.11,70"
                }
                "invalid float literal" | "cannot parse float from empty string" => "must be a number",
                "cannot parse integer from empty string" => "must be a whole number",
                other => other,
            };
            format!("{option}: \"{value}\" {why}")
        }
        ErrorKind::MissingRequiredArgument => {
            format!("`{verb}` needs {}; `{verb} --help` has examples", argument)
        }
        ErrorKind::ArgumentConflict => match text(ContextKind::PriorArg) {
            prior if prior.is_empty() => format!("{argument}: cannot be used together with others; {help}"),
            prior if prior == argument => format!("{argument}: given more than once; give it once"),
            prior => format!("{argument}: cannot be used with {prior}; give one of them"),
        },
        // the first line of what the parser says
        _ => {
            let rendered = error.render().to_string();
            let first = rendered.lines().next().unwrap_or_default();
            format!("{}; {help}", first.strip_prefix("error: ").unwrap_or(first))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_a_paragraph_are_joined_and_examples_are_not() {
        let long = "a ".repeat(40);
        let text = format!("{long}\nsecond.\n\nExamples:\n  satphot run\n  satphot init\nshort\nline");
        assert_eq!(
            paragraphs(&text),
            format!("{long} second.\n\nExamples:\n  satphot run\n  satphot init\nshort\nline")
        );
    }
}
