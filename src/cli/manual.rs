//! `satphot completions` and `satphot man`: what shells and `man` know of the command line, from the command line
//! itself.

use std::path::PathBuf;

use clap::{Args, Command, CommandFactory};
use clap_complete::Shell;
use satphot::base::file::{make_folder, write_atomic};

use super::{Cli, print, tell};

const COMPLETIONS: &str = "\
Examples:
  satphot completions bash > ~/.local/share/bash-completion/completions/satphot
  satphot completions zsh > ~/.zfunc/_satphot
  satphot completions fish > ~/.config/fish/completions/satphot.fish";

const MAN: &str = "\
Examples:
  satphot man -o ~/.local/share/man/man1     then `man satphot`, `man satphot-run`
  satphot man | man -l -                     the first page without installing it";

/// Prints the completions of a shell.
#[derive(Debug, Args)]
#[command(after_help = COMPLETIONS)]
pub struct Completions {
    /// The shell
    shell: Shell,
}

/// Prints the manual page, or writes the pages of all verbs into a folder.
#[derive(Debug, Args)]
#[command(after_help = MAN)]
pub struct Man {
    /// Folder for the pages, one of each verb
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
}

impl Completions {
    pub fn execute(self) -> anyhow::Result<()> {
        let mut text = Vec::new();
        clap_complete::generate(self.shell, &mut Cli::command(), "satphot", &mut text);
        print(&String::from_utf8_lossy(&text));
        Ok(())
    }
}

impl Man {
    pub fn execute(self) -> anyhow::Result<()> {
        // subcommands of a built command know their full names
        let mut command = Cli::command();
        command.build();
        let Some(folder) = self.out else {
            print(&page(&command)?);
            return Ok(());
        };
        make_folder(&folder)?;
        let mut written = 0;
        pages(&command, "satphot", &mut |name, text| {
            let path = folder.join(format!("{name}.1"));
            written += 1;
            Ok(write_atomic(&path, text.as_bytes())?)
        })?;
        tell(&format!("wrote {written} pages into {}", folder.display()));
        Ok(())
    }
}

fn page(command: &Command) -> anyhow::Result<String> {
    let mut text = Vec::new();
    clap_mangen::Man::new(command.clone()).render(&mut text)?;
    Ok(String::from_utf8_lossy(&text).into_owned())
}

/// A command and everything below it, each with its name as `man` is given it.
fn pages(
    command: &Command,
    name: &str,
    write: &mut impl FnMut(&str, String) -> anyhow::Result<()>,
) -> anyhow::Result<()> {
    write(name, page(command)?)?;
    for below in command.get_subcommands().filter(|c| c.get_name() != "help") {
        pages(below, &format!("{name}-{}", below.get_name()), write)?;
    }
    Ok(())
}
