//! What a single stamp means: start, middle or end, by the comment of its card and the program that wrote it.
//!
//! It does not cover the arithmetic ([`super::candidates`]).

use hifitime::Epoch;

use crate::fits::cards::Header;

/// What a stamp marks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Meaning {
    /// Start of the exposure.
    Start,
    /// Its middle.
    Middle,
    /// Its end.
    End,
    /// Start or end: the comment says when something was created.
    Unclear,
}

/// The programs a header names, in lower case.
pub(super) fn program(header: &Header) -> String {
    let keys = ["SWCREATE", "CREATOR", "SOFTWARE", "PROGRAM", "ORIGIN", "PRODUCER", "SWMODIFY"];
    keys.iter().filter_map(|k| header.text(k)).collect::<Vec<_>>().join(" ").to_ascii_lowercase()
}

/// Meaning of a start keyword's stamp, and why it is not a start.
///
/// SharpCap before version 4 stamps the finished frame (`System Clock-Frame Grabbed`), version 4 names start, middle
/// and end (`System Clock:Est. Frame Start`). INDIGO wrote the end until 2019 (its pull request 265).
pub(super) fn meaning(header: &Header, comment: &str, at: Epoch) -> (Meaning, &'static str) {
    let comment = comment.to_ascii_lowercase();
    let says = |words: &[&str]| words.iter().any(|w| comment.contains(w));
    if says(&[
        "frame grabbed",
        "end of exp",
        "end of the exp",
        "frame end",
        "exposure end",
        "shutter close",
        "end time",
    ]) {
        return (Meaning::End, " by its comment");
    }
    if says(&["mid point", "midpoint", "mid-exp", "mid exp", "middle of", "mid-time"]) {
        return (Meaning::Middle, " by its comment");
    }
    if says(&["created", "creation", "file written", "saved"]) {
        return (Meaning::Unclear, "");
    }
    let before_2020 = at.to_gregorian_utc().0 < 2020;
    if before_2020 && !says(&["start", "begin"]) && program(header).contains("indigo") {
        return (Meaning::End, " as INDIGO wrote it before 2020");
    }
    (Meaning::Start, "")
}

/// What is known of the clock of the program that wrote the header.
pub(super) fn program_warning(header: &Header) -> Option<String> {
    let program = program(header);
    let says = |words: &[&str]| words.iter().any(|w| program.contains(w));
    if says(&["n.i.n.a", "nina"]) {
        return Some(
            "N.I.N.A. stamps the computer's clock when it requests the exposure, before the driver starts it: measure the \
             latency and give time.offset_s"
                .into(),
        );
    }
    if says(&["sequence generator pro"]) {
        return Some(
            "Sequence Generator Pro takes the driver's time of the last exposure, found 4 s late by a user: compare it \
             with a GPS clock and give time.offset_s"
                .into(),
        );
    }
    None
}
