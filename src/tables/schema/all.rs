//! The list of all tables, in the order of `docs/columns.md`.

use super::accuracy::{ACCURACY, EXTREMES};
use super::compliance::{COMPLIANCE, COMPLIANCE_WORST};
use super::constellation::CONSTELLATION;
use super::define::{Definition, same};
use super::earth::{EARTH, MOON_LAWS, TRACK};
use super::forecast::{DAY, DUTY, MONTH, OBSERVED};
use super::limits::{FOOTPRINT, LIMITS, STREAK};
use super::listings::{
    AREAS, BRDF_CURVE, EXPLICIT, FLUX_MAP, PAPER_STEPS, PASSES, SATELLITES, SED, SEEN, STRIP, SURFACES,
};
use super::night::{KEYWORD_CHECKS, NIGHT, UNGROUPED};
use super::paper::{CHECKED, LABELS, PUBLISHED};
use super::pass_stack::PASS_STACK;
use super::photometry::{COMPARED, PHOTOMETRY, PREDICTED, PREDICTION, RAW};
use super::plan::PLAN;
use super::radiance::{RADIANCE, SNR};
use super::residuals::RESIDUALS;
use super::sky::{SKY, SKY_SEQUENCE};
use super::stars::STARS;
use super::truth::{RENDERED_TRUTH, STAR_TRUTH, TARGET_TRUTH};

/// Every table that satphot writes.
pub const ALL: &[Definition] = &[
    PHOTOMETRY,
    RAW,
    RESIDUALS,
    PASS_STACK,
    NIGHT,
    UNGROUPED,
    KEYWORD_CHECKS,
    STARS,
    PREDICTION,
    PREDICTED,
    COMPARED,
    SKY,
    SKY_SEQUENCE,
    DAY,
    OBSERVED,
    MONTH,
    DUTY,
    CONSTELLATION,
    COMPLIANCE,
    COMPLIANCE_WORST,
    PLAN,
    LIMITS,
    STREAK,
    FOOTPRINT,
    EARTH,
    TRACK,
    MOON_LAWS,
    RADIANCE,
    SNR,
    PUBLISHED,
    CHECKED,
    LABELS,
    ACCURACY,
    EXTREMES,
    STAR_TRUTH,
    TARGET_TRUTH,
    RENDERED_TRUTH,
    SEEN,
    PASSES,
    FLUX_MAP,
    EXPLICIT,
    SED,
    SATELLITES,
    SURFACES,
    BRDF_CURVE,
    STRIP,
    AREAS,
    PAPER_STEPS,
];

/// Whether a table is in the list: the writers refuse, when satphot is built, rows of a table that is not.
#[must_use]
pub const fn is_listed(table: &Definition) -> bool {
    let mut i = 0;
    while i < ALL.len() {
        if same(ALL[i].file, table.file) {
            return true;
        }
        i += 1;
    }
    false
}
