//! One enum per effect in which paper and physics differ, and the two presets `as_published` and `corrected`.
//!
//! Nothing here computes: the brightness engine reads the resolved [`Effects`].

use serde::{Deserialize, Serialize};

/// Which reading of the paper: as printed, or with its errors corrected.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    /// As the paper prints it.
    AsPublished,
    /// With the errors of the paper corrected.
    #[default]
    Corrected,
}

impl Mode {
    /// The word in tables, in the configuration and on the command line.
    #[must_use]
    pub const fn as_str(self) -> &'static str {
        match self {
            Mode::AsPublished => "as_published",
            Mode::Corrected => "corrected",
        }
    }
}

/// The Earth's shadow on the satellite.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Shadow {
    /// On or off at the cylinder behind the Earth.
    Cylinder,
    /// Share of the source's disc above an airless limb.
    Penumbra,
    /// As `penumbra`, seen through the air: refraction, Rayleigh scattering, ozone.
    Atmospheric,
}

/// Distances of Sun and Moon.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Distances {
    /// 1 au and the Moon's mean distance, always.
    Ignored,
    /// Irradiances fall with the square of the distances.
    Applied,
}

/// The Moon's magnitude against phase.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum MoonLaw {
    /// −12.73 + 0.026|α| + 4·10⁻⁹ α⁴ (Cox 2002).
    Cox,
    /// As `cox`, with the surge below 7° of Krisciunas & Schaefer (1991).
    CoxOpposition,
    /// The disc reflectance of ROLO (Kieffer & Stone 2005), without libration.
    Rolo,
}

/// The Moon's magnitude past 150° of phase.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum MoonPastLimit {
    /// The law as it is.
    Polynomial,
    /// The flux of 150° times ((180° − α)/30°)⁴: dark at new Moon.
    Tapered,
}

/// The Earth's shadow on the Moon.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum LunarEclipse {
    /// The Moon is never eclipsed.
    Ignored,
    /// Its light falls with the share of the Sun its disc sees.
    Applied,
}

/// Moonlight on the ground, where Lunar-Earthshine comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum GroundMoonlight {
    /// Everywhere as at the Earth's centre: one direction, one distance, one phase.
    Parallel,
    /// Every place sees the Moon in its own direction, at its own distance and phase angle: 0.04 mag under a high Moon,
    /// up to 0.8 mag under one that is about to set.
    PerPatch,
}

/// The discs of Sun and Moon in a direct reflection.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum SourceDisc {
    /// Parallel light.
    Point,
    /// Lobes narrower than the disc are averaged over it: a point is wrong by any factor there, and broad laws cost no
    /// more (`satphot accuracy source-disc`).
    Convolved,
}

/// Radius of the spherical Earth.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum EarthRadius {
    /// 6378.000 km.
    Published,
    /// The geocentric radius under the satellite.
    Local,
}

/// Attitude of the surfaces that track the Sun.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Arrays {
    /// As the list of the satellite states.
    AsListed,
    /// The surfaces point to the Sun.
    Sun,
    /// At right angles to nadir, towards the azimuth of the Sun.
    SunAzimuth,
}

/// Backs of surfaces.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Backs {
    /// Black, whatever the list states.
    Black,
    /// As the list of the satellite states.
    AsListed,
}

/// The light that is scaled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Source {
    /// Outside the atmosphere: compares with data corrected for extinction.
    ExoAtmospheric,
    /// As `exo_atmospheric`, with k X on the way from satellite to observer.
    Extincted,
    /// As the Sun is at the ground (ASTM G-173 global), then scaled.
    BottomOfAtmosphere,
}

/// Solid angle of the mean surface brightness.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum MuArea {
    /// The whole area of all surfaces.
    Total,
    /// The area that the observer sees.
    Projected,
}

/// Satellites that are large against their range.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum PlatformSize {
    /// One point.
    Point,
    /// Divided where sqrt(area)/range exceeds 1e-3.
    Subdivided,
}

/// How directions are spread over the sky where its median is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Sampling {
    /// Evenly in altitude and azimuth: crowded at the zenith.
    AltAz,
    /// Evenly in solid angle: every area of the sky counts alike.
    SolidAngle,
}

/// Every effect, decided.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Effects {
    /// The Earth's shadow on the satellite.
    pub shadow: Shadow,
    /// Distances of Sun and Moon.
    pub distances: Distances,
    /// The Moon's magnitude against phase.
    pub moon_law: MoonLaw,
    /// The Moon's magnitude past 150° of phase.
    pub moon_past_limit: MoonPastLimit,
    /// The Earth's shadow on the Moon.
    pub lunar_eclipse: LunarEclipse,
    /// Moonlight on the ground, where Lunar-Earthshine comes from.
    pub ground_moonlight: GroundMoonlight,
    /// The discs of Sun and Moon in a direct reflection.
    pub source_disc: SourceDisc,
    /// Radius of the spherical Earth.
    pub earth_radius: EarthRadius,
    /// Attitude of the surfaces that track the Sun.
    pub arrays: Arrays,
    /// How the backs of surfaces scatter.
    pub backs: Backs,
    /// Where the sunlight and moonlight of the model are taken: outside or below the atmosphere.
    pub source: Source,
    /// Solid angle of the mean surface brightness.
    pub mu_area: MuArea,
    /// Satellites that are large against their range.
    pub platform_size: PlatformSize,
    /// How directions are spread over the sky where its median is taken.
    pub sampling: Sampling,
}

/// `[model.effects]`: what differs from the preset.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct EffectsTable {
    /// The Earth's shadow on the satellite.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shadow: Option<Shadow>,
    /// Distances of Sun and Moon.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub distances: Option<Distances>,
    /// The Moon's magnitude against phase.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub moon_law: Option<MoonLaw>,
    /// The Moon's magnitude past 150° of phase.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub moon_past_limit: Option<MoonPastLimit>,
    /// The Earth's shadow on the Moon.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lunar_eclipse: Option<LunarEclipse>,
    /// Moonlight on the ground, where Lunar-Earthshine comes from.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ground_moonlight: Option<GroundMoonlight>,
    /// The discs of Sun and Moon in a direct reflection.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub source_disc: Option<SourceDisc>,
    /// Radius of the spherical Earth.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub earth_radius: Option<EarthRadius>,
    /// Attitude of the surfaces that track the Sun.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub arrays: Option<Arrays>,
    /// How the backs of surfaces scatter.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub backs: Option<Backs>,
    /// Where the sunlight and moonlight of the model are taken: outside or below the atmosphere.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub source: Option<Source>,
    /// Solid angle of the mean surface brightness.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mu_area: Option<MuArea>,
    /// Satellites that are large against their range.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub platform_size: Option<PlatformSize>,
    /// How directions are spread over the sky where its median is taken.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sampling: Option<Sampling>,
}

impl Effects {
    /// The preset of a mode.
    #[must_use]
    pub fn of(mode: Mode) -> Self {
        match mode {
            Mode::AsPublished => Self {
                shadow: Shadow::Cylinder,
                distances: Distances::Ignored,
                moon_law: MoonLaw::Cox,
                moon_past_limit: MoonPastLimit::Polynomial,
                lunar_eclipse: LunarEclipse::Ignored,
                ground_moonlight: GroundMoonlight::Parallel,
                source_disc: SourceDisc::Point,
                earth_radius: EarthRadius::Published,
                arrays: Arrays::SunAzimuth,
                backs: Backs::Black,
                source: Source::BottomOfAtmosphere,
                mu_area: MuArea::Total,
                platform_size: PlatformSize::Point,
                sampling: Sampling::AltAz,
            },
            Mode::Corrected => Self {
                shadow: Shadow::Atmospheric,
                distances: Distances::Applied,
                moon_law: MoonLaw::Cox,
                moon_past_limit: MoonPastLimit::Tapered,
                lunar_eclipse: LunarEclipse::Applied,
                ground_moonlight: GroundMoonlight::PerPatch,
                source_disc: SourceDisc::Convolved,
                earth_radius: EarthRadius::Local,
                arrays: Arrays::AsListed,
                backs: Backs::AsListed,
                source: Source::ExoAtmospheric,
                mu_area: MuArea::Projected,
                platform_size: PlatformSize::Subdivided,
                sampling: Sampling::SolidAngle,
            },
        }
    }
}

impl EffectsTable {
    /// These over a preset.
    #[must_use]
    pub fn over(&self, preset: Effects) -> Effects {
        Effects {
            shadow: self.shadow.unwrap_or(preset.shadow),
            distances: self.distances.unwrap_or(preset.distances),
            moon_law: self.moon_law.unwrap_or(preset.moon_law),
            moon_past_limit: self.moon_past_limit.unwrap_or(preset.moon_past_limit),
            lunar_eclipse: self.lunar_eclipse.unwrap_or(preset.lunar_eclipse),
            ground_moonlight: self.ground_moonlight.unwrap_or(preset.ground_moonlight),
            source_disc: self.source_disc.unwrap_or(preset.source_disc),
            earth_radius: self.earth_radius.unwrap_or(preset.earth_radius),
            arrays: self.arrays.unwrap_or(preset.arrays),
            backs: self.backs.unwrap_or(preset.backs),
            source: self.source.unwrap_or(preset.source),
            mu_area: self.mu_area.unwrap_or(preset.mu_area),
            platform_size: self.platform_size.unwrap_or(preset.platform_size),
            sampling: self.sampling.unwrap_or(preset.sampling),
        }
    }
}
