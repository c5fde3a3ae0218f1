//! Error against run time, and the extreme cases.

use serde::{Deserialize, Serialize};

use super::define::table;

table! {
    ACCURACY = "accuracy.ecsv", "One row per setting of a knob of `accuracy`.";
    /// One setting of a knob: a row of `accuracy.ecsv`.
    #[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
    pub struct AccuracyRow {
        /// what is computed
        method: String,
        /// the situation
        case: String,
        /// what is set
        knob: String,
        /// its value
        setting: String,
        /// 1 = the default setting
        is_default: i32,
        /// 1 = no other setting of this case has both a smaller err_p95 and less CPU time
        on_front: i32,
        /// what the errors are: relative, or a unit
        err_unit: String,
        /// median error: half of the cases are better
        err_median: Option<f64>,
        /// 95th percentile of the error: 95 of 100 cases are better
        err_p95: Option<f64>,
        /// the worst case; missing if one case gave no number
        err_worst: Option<f64>,
        /// cases the errors are from
        n: i64,
        /// what cpu_us is the time of
        work: String,
        /// CPU time of one piece of work, user and system, one thread
        cpu_us: f64 => "us",
        /// memory of one piece of work, where it depends on the setting
        memory_kb: Option<f64> => "kbyte",
        /// what the errors are measured against
        reference: String,
    }
}

table! {
    EXTREMES = "extremes.ecsv", "One row per stiff or extreme case of the extremes of `accuracy`; paths.ecsv has the same columns.";
    /// One stiff or extreme case: a row of `extremes.ecsv`.
    #[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
    pub struct ExtremeRow {
        /// part of the program
        area: String,
        /// the case, with the unit of its numbers
        case: String,
        /// what is expected: a number from a closed form or an independent computation, or a refusal
        expected: String,
        /// what came out
        got: String,
        /// how far off it is, relative or in the unit of the case; missing for refusals
        error: Option<f64>,
        /// how far off it may be
        limit: Option<f64>,
        /// ok, known limit or WRONG
        verdict: String => ["meta.code.qual"],
    }
}
