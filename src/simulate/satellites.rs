//! The satellites of components that a scenario can name.

use crate::base::error::Error;
use crate::base::error::Result;
use crate::resolved::ComponentSatellite;
use crate::resolved::shape::SIDES;

/// The satellite of components a scenario names, its shapes and meshes looked at.
///
/// # Errors
/// [`Error::Config`] under `target.resolved` for a name that is not known, a file that cannot be read, and shapes that
/// make no sense.
pub fn named(name: &str) -> Result<ComponentSatellite> {
    let checked = || {
        let satellite = ComponentSatellite::named(name)?;
        satellite.components.iter().try_for_each(|part| satellite.triangles(part, SIDES).map(|_| ()))?;
        Ok(satellite)
    };
    checked().map_err(|error: Error| {
        let problem = match error {
            Error::Config { problem, .. } => problem,
            other => other.to_string(),
        };
        Error::Config { key: "target.resolved".into(), problem }
    })
}
