//! The program: parse, run a verb, print what went wrong with its exit code.

mod cli;

use std::process::ExitCode;

use clap::FromArgMatches;

fn main() -> ExitCode {
    cli::signals::report_file_limit();
    let command = cli::usage::command();
    let parsed = command.clone().try_get_matches().and_then(|m| cli::Cli::from_arg_matches(&m).map(|args| (m, args)));
    let (matches, args) = match parsed {
        Ok(parsed) => parsed,
        Err(error) => return cli::usage::answer(&error, &command),
    };
    cli::answer(cli::finite::check(&matches, &command).and_then(|()| args.execute()))
}
