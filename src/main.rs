//! The program: parse, run a verb, print what went wrong with its exit code.

mod cli;

use std::process::ExitCode;

use clap::{CommandFactory, FromArgMatches};

fn main() -> ExitCode {
    let command = cli::Cli::command();
    let matches = command.clone().get_matches();
    let args = match cli::Cli::from_arg_matches(&matches) {
        Ok(args) => args,
        Err(error) => error.exit(),
    };
    match cli::finite::check(&matches, &command).and_then(|()| args.execute()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            cli::tell(&format!("satphot: {error}"));
            ExitCode::from(cli::exit_code(&error))
        }
    }
}
