//! Results for others: observations in the formats of archives and of space-surveillance houses.
//!
//! Magnitudes are V, apparent, outside the atmosphere, without any correction for range; times are mid-exposure UTC.
//! A non-detection or a lower limit is never written as a magnitude. It does not cover measured positions: satphot has
//! none, and what follows from the elements is not an observation.

mod facts;
mod iod;
mod score;
mod score_check;
mod score_form;
mod score_rules;
mod select;
mod sound;
mod tdm;
mod udl;

pub use facts::{DataMode, Facts, Zeropoint};
pub use iod::iod_text;
pub use score::Scored;
pub use score::score_text;
pub use score_check::{Finding, check_score};
pub use score_form::HEADER as SCORE_HEADER;
pub use select::{Choice, ExportedRow, Selected, select};
pub use sound::sound;
pub use tdm::{TdmNames, tdm_text};
pub use udl::{UdlNames, udl_text};
