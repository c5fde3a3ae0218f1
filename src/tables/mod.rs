//! Every table of satphot: its definition, and the formats it is read from and written in.

pub mod bands;
pub mod ecsv;
pub mod flags;
pub mod formats;
pub mod guess;
pub mod joined;
pub mod meta;
pub mod read;
pub mod row_passes;
pub mod rows_hash;
pub mod save;
pub mod schema;
pub mod selection;
pub mod unit;
pub mod words;

pub use ecsv::{
    csv_of_cells, csv_text, prediction_cells, read_meta, read_photometry, read_residuals, read_rows, read_stars,
    read_table, write_cells, write_photometry, write_prediction, write_residuals, write_rows, write_stars,
};
pub use formats::Table;
pub use meta::{Meta, MetaValue};
pub use rows_hash::{check_rows_hash, names_rows_hash};
pub use schema::{
    ACCURACY, ALL, AREAS, AccuracyRow, BRDF_CURVE, CHECKED, COMPARED, COMPLIANCE, COMPLIANCE_WORST, CONSTELLATION,
    CheckedRow, Column, ComplianceRow, DAY, DUTY, Datatype, DayRow, Definition, DutyRow, EARTH, EXPLICIT, EXTREMES,
    EarthRow, ExtremeRow, FLUX_MAP, FOOTPRINT, FootprintRow, KEYWORD_CHECKS, KeywordCheckRow, LABELS, LIMITS, LabelRow,
    LimitRow, MONTH, MOON_LAWS, MonthRow, MoonLawRow, NIGHT, NightRow, OBSERVED, ObservedRow, PAPER_STEPS, PARTIAL,
    PASS_STACK, PASSES, PHOTOMETRY, PLAN, PREDICTED, PREDICTION, PUBLISHED, PartialRow, PassStackRow, PhotometryRow,
    PlanRow, PublishedRow, RADIANCE, RAW, RENDERED_TRUTH, RESIDUALS, RadianceRow, RawRow, RenderedTruth, ResidualRow,
    Row, SATELLITES, SED, SEEN, SKY, SKY_SEQUENCE, SNR, STAR_TRUTH, STARS, STREAK, STRIP, SURFACES, SkyRow, SnrRow,
    StarRow, StarTruth, StreakRow, TARGET_TRUTH, TRACK, TargetTruth, TrackRow, UNGROUPED, UngroupedRow, WorstRow,
    constellation_columns, is_listed,
};
