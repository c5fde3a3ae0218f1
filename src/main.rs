//! The program: parse, run a verb, print what went wrong with its exit code.

mod cli;

use std::process::ExitCode;

use clap::Parser;

fn main() -> ExitCode {
    let args = cli::Cli::parse();
    match args.execute() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            cli::tell(&format!("satphot: {error}"));
            ExitCode::from(cli::exit_code(&error))
        }
    }
}
