//! The words that text columns are made of: each spelled once, compared as values.
//!
//! A column holds the word ([`Status::as_str`]); what decides compares with the value: `row.status == Status::Ok`. Leaves
//! out sentences for people (`reason`, `skipped`, `time_source`), by which nothing is decided.

/// A word of a text column: its spelling, the way back, and comparison with a cell.
macro_rules! words {
    ($(#[$about:meta])* $name:ident: $n:literal { $($(#[$of:meta])* $variant:ident = $word:literal),+ $(,)? }) => {
        $(#[$about])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum $name { $($(#[$of])* $variant),+ }

        impl $name {
            /// All of them, in order.
            pub const ALL: [$name; $n] = [$($name::$variant),+];

            /// The word in the column.
            #[must_use]
            pub const fn as_str(self) -> &'static str {
                match self { $($name::$variant => $word),+ }
            }

            /// The value of a cell; `None` for an empty cell and any other text.
            #[must_use]
            pub fn from_cell(cell: &str) -> Option<Self> {
                Self::ALL.into_iter().find(|value| value.as_str() == cell)
            }
        }

        impl std::fmt::Display for $name {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.pad(self.as_str())
            }
        }

        impl From<$name> for String {
            fn from(value: $name) -> String {
                value.as_str().to_owned()
            }
        }

        impl PartialEq<$name> for String {
            fn eq(&self, value: &$name) -> bool {
                self == value.as_str()
            }
        }

        impl PartialEq<$name> for str {
            fn eq(&self, value: &$name) -> bool {
                self == value.as_str()
            }
        }
    };
}

words! {
    /// What a pass of a night's plan is worth.
    PlanStatus: 9 {
        /// The signal-to-noise ratio that is asked for is reached.
        Observable = "observable",
        /// It has light, and less than that.
        Faint = "faint",
        /// Too near the Moon whenever it is bright enough.
        NearMoon = "near_moon",
        /// Faster than the mount whenever it is bright enough.
        TooFast = "too_fast",
        /// It saturates in the shortest exposure.
        TooBright = "too_bright",
        /// No light reaches it, or none comes from it.
        NoLight = "no_light",
        /// Nothing says which model is the satellite's.
        NoModel = "no_model",
        /// It does not rise high enough while it is dark.
        NotUp = "not_up",
        /// Its elements cannot be used.
        Failed = "failed",
    }
}

words! {
    /// What became of a frame or a star: the column `status`.
    Status: 4 {
        /// Measured.
        Ok = "ok",
        /// Measured, and nothing found: the row has a limit.
        Nondetection = "nondetection",
        /// Not measured, or not used, because of what it is; the reason says why.
        Rejected = "rejected",
        /// Could not be read or measured.
        Failed = "failed",
    }
}

words! {
    /// Where the light of a point is measured: the column `forced_at`.
    ForcedAt: 3 {
        /// At the detection of the frame itself.
        Detection = "detection",
        /// Where the frames of the pass show the target.
        Pass = "pass",
        /// At the expected place.
        Expected = "expected",
    }
}

words! {
    /// What may be done with a frame, from good to bad: the column `verdict`.
    Verdict: 3 {
        /// To be used as it is.
        Use = "use",
        /// To be looked at first.
        Caution = "caution",
        /// Not to be used.
        Reject = "reject",
    }
}

words! {
    /// What the data say of a keyword: the column `standing`.
    Standing: 3 {
        /// They agree with it.
        Agrees = "agrees",
        /// They contradict it.
        Deviates = "deviates",
        /// They do not show it.
        NotCheckable = "not_checkable",
    }
}

words! {
    /// Which moment of the exposure the stamp marks that its time is from: the column `time_stamp`.
    TimeStamp: 4 {
        /// The start; half of EXPTIME was added.
        Start = "start",
        /// The middle.
        Middle = "middle",
        /// The end; half of EXPTIME was subtracted.
        End = "end",
        /// Start and end, two stamps.
        StartAndEnd = "start_end",
    }
}

/// How many frames carry a flag that decides a verdict, in words: `2 frames contaminated by star trails or neighbours`.
#[must_use]
pub fn flagged_frames(flag: &str, n: u64) -> String {
    let words = match flag {
        "saturated" => "saturated",
        "masked" => "with masked pixels",
        "edge" | "clip_edge" => "at the edge of the field",
        "negative" => "with negative flux",
        "no_annulus" => "without an annulus of sky",
        "time_uncertain" => "with an uncertain time",
        "contaminated" => "contaminated by star trails or neighbours",
        "smeared" => "with a smeared target",
        "vignetted" => "vignetted",
        "hit" => "with a cosmic-ray hit",
        "exptime_doubted" => "with a doubtful exposure time",
        "low_altitude" => "at low altitude",
        "old_elements" => "with old elements",
        other => other,
    };
    format!("{n} {} {words}", if n == 1 { "frame" } else { "frames" })
}

#[cfg(test)]
mod tests {
    use super::{Status, TimeStamp, Verdict};

    #[test]
    fn a_word_comes_back_as_its_value_and_no_other_text_does() {
        for status in Status::ALL {
            assert_eq!(Status::from_cell(status.as_str()), Some(status));
            assert!(*status.as_str() == status);
        }
        for stamp in TimeStamp::ALL {
            assert_eq!(TimeStamp::from_cell(stamp.as_str()), Some(stamp));
        }
        assert!(Verdict::Use < Verdict::Caution && Verdict::Caution < Verdict::Reject);
        assert_eq!(Verdict::from_cell("reject"), Some(Verdict::Reject));
        for cell in ["", "OK", "okay", "use ", "rejected frames"] {
            assert_eq!((Status::from_cell(cell), Verdict::from_cell(cell)), (None, None), "{cell:?}");
        }
    }
}
