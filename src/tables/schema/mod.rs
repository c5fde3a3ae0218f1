//! Every table that satphot writes, each defined once.
//!
//! Units are spelled as ECSV readers (astropy) understand them; an empty unit is a pure number or a text. An empty text and
//! `None` mean missing, zero is a value; a number is never NaN: the writer refuses it.

mod accuracy;
mod all;
mod compliance;
mod constellation;
mod define;
mod earth;
mod forecast;
mod limits;
mod listings;
mod night;
mod paper;
mod pass_stack;
mod photometry;
mod plan;
mod radiance;
mod residuals;
mod sky;
mod stars;
mod truth;

pub use accuracy::{ACCURACY, AccuracyRow, EXTREMES, ExtremeRow};
pub use all::{ALL, is_listed};
pub use compliance::{COMPLIANCE, COMPLIANCE_WORST, ComplianceRow, WorstRow};
pub use constellation::{CONSTELLATION, constellation_columns};
pub use define::{Column, Datatype, Definition, Row};
pub use earth::{EARTH, EarthRow, MOON_LAWS, MoonLawRow, TRACK, TrackRow};
pub use forecast::{DAY, DUTY, DayRow, DutyRow, MONTH, MonthRow, OBSERVED, ObservedRow};
pub use limits::{FOOTPRINT, FootprintRow, LIMITS, LimitRow, STREAK, StreakRow};
pub use listings::{
    AREAS, BRDF_CURVE, EXPLICIT, FLUX_MAP, PAPER_STEPS, PASSES, SATELLITES, SED, SEEN, STRIP, SURFACES,
};
pub use night::{KEYWORD_CHECKS, KeywordCheckRow, NIGHT, NightRow, UNGROUPED, UngroupedRow};
pub use paper::{CHECKED, CheckedRow, LABELS, LabelRow, PUBLISHED, PublishedRow};
pub use pass_stack::{PASS_STACK, PassStackRow};
pub use photometry::{COMPARED, PARTIAL, PHOTOMETRY, PREDICTED, PREDICTION, PartialRow, PhotometryRow, RAW, RawRow};
pub use plan::{PLAN, PlanRow};
pub use radiance::{RADIANCE, RadianceRow, SNR, SnrRow};
pub use residuals::{RESIDUALS, ResidualRow};
pub use sky::{SKY, SKY_SEQUENCE, SkyRow};
pub use stars::{STARS, StarRow};
pub use truth::{RENDERED_TRUTH, RenderedTruth, STAR_TRUTH, StarTruth, TARGET_TRUTH, TargetTruth};
