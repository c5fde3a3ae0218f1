//! No option takes an infinite number or NaN: checked once for every number of the command line.

use clap::{ArgMatches, Command};

use super::orbit_args::bad;

/// Refuses an option whose value is not a finite number, with its name.
pub fn check(matches: &ArgMatches, command: &Command) -> anyhow::Result<()> {
    for id in matches.ids() {
        // groups, and options that are no numbers, have no such values
        let Ok(Some(values)) = matches.try_get_many::<f64>(id.as_str()) else { continue };
        if let Some(value) = values.into_iter().find(|v| !v.is_finite()) {
            let argument = command.get_arguments().find(|a| a.get_id() == id);
            let name = match argument.and_then(|a| a.get_long()) {
                Some(long) => format!("--{long}"),
                None => format!("--{}", id.as_str().replace('_', "-")),
            };
            return Err(bad(&name, format!("{value} is not a number that can be used; accepted is a finite number")));
        }
    }
    match matches.subcommand() {
        Some((name, inner)) => command.find_subcommand(name).map_or(Ok(()), |c| check(inner, c)),
        None => Ok(()),
    }
}
