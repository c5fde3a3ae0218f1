//! Classes of a frame and of a pass from geometry alone: where the Sun stands for the observer, and the paper's label.
//!
//! Altitudes in deg, geometric, of the Sun's centre. The paper labels by the light on the satellite, not by the sky: its pass
//! of 2025-06-11 18:50 is "Twilight" with the Sun at −24°, because the station begins it in sunlight. No weather, no model.

use std::fmt;

use super::scene::scene;
use crate::base::error::Result;
use crate::brightness::{Illum, light_class};
use crate::orbit::Geometry;

/// Altitude of the Sun's centre at sunrise and sunset: 34′ of refraction and 16′ of its radius \[deg\]
/// (Explanatory Supplement to the Astronomical Almanac, 3rd ed., §12.2).
pub const SUNRISE_ALT_DEG: f64 = -0.833;

/// Where the Sun stands for the observer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum SkyClass {
    /// The Sun is up.
    Day,
    /// Down to −6°.
    CivilTwilight,
    /// Down to −12°.
    NauticalTwilight,
    /// Down to −18°.
    AstronomicalTwilight,
    /// Below.
    Night,
}

/// The paper's own label, its table of brightness by time of day.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum PaperLabel {
    /// Sunlight and Earthshine, the observer in daylight.
    Day,
    /// Sunlight, on the satellite or still in the observer's sky.
    Twilight,
    /// Moonlight and Lunar-Earthshine: night sky, satellite in the Earth's shadow.
    Night,
}

impl SkyClass {
    /// The class of an altitude of the Sun \[deg\]; a limit belongs to the brighter class.
    #[must_use]
    pub fn of_sun_alt(sun_alt_deg: f64) -> Self {
        match sun_alt_deg {
            h if h >= SUNRISE_ALT_DEG => Self::Day,
            h if h >= -6.0 => Self::CivilTwilight,
            h if h >= -12.0 => Self::NauticalTwilight,
            h if h >= -18.0 => Self::AstronomicalTwilight,
            _ => Self::Night,
        }
    }
}

impl PaperLabel {
    /// All of them, in the order of a day.
    pub const ALL: [Self; 3] = [Self::Day, Self::Twilight, Self::Night];

    /// The label of one moment: day whenever the Sun is up; else twilight if any sunlight reaches the satellite or the
    /// sky is not yet night; else night.
    #[must_use]
    pub fn of(sky: SkyClass, sunlit: bool) -> Self {
        match sky {
            SkyClass::Day => Self::Day,
            SkyClass::Night if !sunlit => Self::Night,
            _ => Self::Twilight,
        }
    }

    /// The label of a whole pass, as the paper gives it: that of the moment nearest to day. `None` without a moment.
    #[must_use]
    pub fn of_pass(moments: impl IntoIterator<Item = Self>) -> Option<Self> {
        moments.into_iter().min()
    }

    /// The label of this text, as tables spell it, in any case; `None` for anything else.
    #[must_use]
    pub fn from_text(text: &str) -> Option<Self> {
        match text.trim().to_ascii_lowercase().as_str() {
            "day" | "daytime" => Some(Self::Day),
            "twilight" => Some(Self::Twilight),
            "night" | "nighttime" => Some(Self::Night),
            _ => None,
        }
    }

    /// Time of day and source of light, as the paper's table words them.
    #[must_use]
    pub fn wording(self) -> (&'static str, &'static str) {
        match self {
            Self::Day => ("Daytime", "Sunlight + Earthshine"),
            Self::Twilight => ("Twilight", "Sunlight"),
            Self::Night => ("Nighttime", "Moonlight + Lunar-Earthshine"),
        }
    }
}

/// Whether direct sunlight, all or part of it, reaches the satellite.
#[must_use]
pub fn is_sunlit(light: Illum) -> bool {
    matches!(light, Illum::Sun | Illum::Penumbra)
}

/// Both classes of a moment.
///
/// # Errors
/// [`crate::Error::Model`] for an impossible scene.
pub fn classes(geometry: &Geometry) -> Result<(SkyClass, PaperLabel)> {
    let sky = SkyClass::of_sun_alt(geometry.sun_alt_rad.to_degrees());
    Ok((sky, PaperLabel::of(sky, is_sunlit(light_class(&scene(geometry))?))))
}

impl fmt::Display for SkyClass {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Day => "day",
            Self::CivilTwilight => "civil_twilight",
            Self::NauticalTwilight => "nautical_twilight",
            Self::AstronomicalTwilight => "astronomical_twilight",
            Self::Night => "night",
        })
    }
}

impl fmt::Display for PaperLabel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Day => "day",
            Self::Twilight => "twilight",
            Self::Night => "night",
        })
    }
}
