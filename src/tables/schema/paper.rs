//! Next to the paper: its numbers and ours, its passes checked, brightness by light class.

use serde::Serialize;

use super::define::table;

table! {
    PUBLISHED = "published.ecsv", "One row per number of the paper of `published`; values are in the unit of the row.";
    /// One published number.
    #[derive(Debug, Clone, Default, PartialEq, Serialize)]
    pub struct PublishedRow {
        /// name of the row
        id: String,
        /// where in the paper
        place: String,
        /// what it is
        quantity: String,
        /// unit of the values of this row; empty for a pure number
        unit: String,
        /// as the paper prints it
        printed: String,
        /// the same as a number
        published: Option<f64>,
        /// computed by the formula and the inputs of the paper
        as_published: Option<f64>,
        /// computed by the corrected physics
        corrected: Option<f64>,
        /// kind of number, by which it is judged: digits, about, count, ...; empty for a row that is not judged
        rule: String,
        /// how far it may be from what it is held against, in the unit of the row; 0 for counts and bounds
        tolerance: Option<f64>,
        /// reproduced, with an assumption, not reproduced, literature, not in the paper, not computed
        verdict: String => ["meta.code.qual"],
        /// why they differ, what was assumed, or the source
        why: String,
    }
}

table! {
    CHECKED = "checked.ecsv", "One row per stated pass of `check-table`.";
    /// One checked pass.
    #[derive(Debug, Clone, Default, PartialEq, Serialize)]
    pub struct CheckedRow {
        /// line in the file that was checked
        line: i64,
        /// date and time as stated
        time: String,
        /// the same in UTC, ISO 8601
        date_utc: String,
        /// satellite as stated
        target: String,
        /// agrees, agrees (sky only), differs, cannot be true
        verdict: String => ["meta.code.qual"],
        /// altitude of the Sun as stated
        stated_sun_alt_deg: Option<f64> => "deg",
        /// altitude of the Sun at the stated time, without refraction
        sun_alt_deg: f64 => "deg" ["pos.az.alt"],
        /// illuminated fraction of the lunar disc as stated
        stated_moon_illum_pct: Option<f64> => "%",
        /// illuminated fraction of the lunar disc
        moon_illum_pct: f64 => "%" ["phys.area;arith.ratio"],
        /// altitude of the Moon, without refraction
        moon_alt_deg: f64 => "deg" ["pos.az.alt"],
        /// phase angle of the Moon (0 = full)
        moon_phase_deg: f64 => "deg" ["pos.phaseAng"],
        /// V of the Moon at that phase and mean distance (Cox 2002)
        moon_v_mag: f64 => "mag" ["phot.mag;em.opt.V;meta.modelled"],
        /// altitude of the satellite at the stated time
        alt_deg: Option<f64> => "deg" ["pos.az.alt"],
        /// culmination of the pass at the stated time, else of the nearest one
        pass_utc: String,
        /// altitude of that culmination
        pass_alt_deg: Option<f64> => "deg",
        /// range there
        pass_range_km: Option<f64> => "km",
        /// light class as stated
        stated_label: String,
        /// light class of the pass from geometry, as Caddy et al. label it
        paper_label: String => ["meta.code"],
        /// what does not agree, and what could not be checked
        remarks: String,
        /// what would make the row true
        remedy: String,
    }
}

table! {
    LABELS = "labels.ecsv", "One row per light class of observed passes of `published`.";
    /// Brightness of one light class.
    #[derive(Debug, Clone, Default, PartialEq, Serialize)]
    pub struct LabelRow {
        /// day, twilight or night, as Caddy et al. label a pass
        paper_label: String => ["meta.code"],
        /// sources of light, as they word it
        light: String,
        /// magnitudes
        n: i64,
        /// their median
        median_v_mag: Option<f64> => "mag",
        /// their standard deviation
        std_v_mag: Option<f64> => "mag",
        /// magnitudes when every frame has its own label, not that of its pass
        n_by_frame: i64,
        /// their median
        median_by_frame_v_mag: Option<f64> => "mag",
        /// magnitudes in the paper, all of the ISS
        published_n: i64,
        /// median in the paper
        published_median_v_mag: f64 => "mag",
        /// standard deviation in the paper
        published_std_v_mag: f64 => "mag",
    }
}
