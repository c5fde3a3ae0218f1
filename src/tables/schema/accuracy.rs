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
        /// front = every setting of this case that is as accurate (err_p95) takes more time, behind = one takes less, both beyond
        /// the errors of the times (5 % apart at least); level = one takes as much, as far as the times can tell
        place: String,
        /// what the errors are: relative, or a unit
        err_unit: String,
        /// median error: half of the cases are better
        err_median: Option<f64>,
        /// 95th percentile of the error: 95 of 100 cases are better
        err_p95: Option<f64>,
        /// the worst case; missing if one case gave no number
        err_worst: Option<f64>,
        /// mean of the errors, signed where an error has a sign
        err_mean: Option<f64>,
        /// standard deviation of the errors about it
        err_sd: Option<f64>,
        /// share of the cases whose error is within the stated 1-sigma error
        coverage_frac: Option<f64>,
        /// cases the errors are from
        n: i64,
        /// what cpu_us is the time of
        work: String,
        /// CPU time of one piece of work, user and system, one thread: median of the repeats
        cpu_us: f64 => "us",
        /// lower end of the interval that holds the median in 95 % of cases, where there are six repeats or more
        cpu_us_low: f64 => "us",
        /// upper end of that interval
        cpu_us_high: f64 => "us",
        /// how often the time was measured
        n_repeats: i64,
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
