//! Numbers of the paper that are measurements, or another's: listed with their source, computed by nobody here.
//!
//! The pipeline that would measure them is tested on synthetic nights (README, "How far to trust it").

use super::entry::{Basis, Entry, row};
use super::rule::Rule;
use Basis::Literature;

const REDUCTION: &str = "section Data Reduction";
const RESULTS: &str = "table of brightness by time of day";
const OBSERVATIONS: &str = "section Description of Observations";
const LUMOS: &str = "section Lumos-sat, Two Component Model";
const STK: &str = "table of STK radiances";

const FIT: &str = "fit to 321 stars of the night of 10 June 2025";
const MEASURED: &str = "observed, June 2025; the frames are not public";
const HUNTSMAN: &str = "Caddy et al. 2025, Huntsman Telescope Pathfinder, by day";
const SIMULATED: &str =
    "Ansys STK, a three-dimensional model that is not public; ratios of it are in rows of their own";

pub(super) const ROWS: &[Entry] = &[
    row("zp", REDUCTION, "zeropoint in V", "mag", 2).printed("-23.37 ± 0.11", -23.37, Rule::Digits).is(Literature, FIT),
    row("k", REDUCTION, "extinction in V", "mag/airmass", 2)
        .printed("0.12 ± 0.05", 0.12, Rule::Digits)
        .is(Literature, FIT),
    row("c", REDUCTION, "colour term", "mag/mag", 2).printed("0.08 ± 0.12", 0.08, Rule::Digits).is(Literature, FIT),
    row("stars", REDUCTION, "stars of the zeropoint", "", 0)
        .printed("321", 321.0, Rule::Digits)
        .is(Literature, MEASURED),
    row("star-pointings", REDUCTION, "star pointings", "", 0)
        .printed("21", 21.0, Rule::Digits)
        .is(Literature, MEASURED),
    row("flats", REDUCTION, "flat frames", "", 0).printed("42", 42.0, Rule::Digits).is(Literature, MEASURED),
    row("pointing-rms", OBSERVATIONS, "pointing model", "arcsec", 1)
        .printed("15.5", 15.5, Rule::Digits)
        .is(Literature, MEASURED),
    row("count-night", RESULTS, "observations by night", "", 0)
        .printed("147", 147.0, Rule::Digits)
        .is(Literature, MEASURED),
    row("count-twilight", RESULTS, "observations in twilight", "", 0)
        .printed("52", 52.0, Rule::Digits)
        .is(Literature, MEASURED),
    row("count-day", RESULTS, "observations by day", "", 0)
        .printed("363", 363.0, Rule::Digits)
        .is(Literature, HUNTSMAN),
    row("median-night", RESULTS, "median V by night", "mag", 2)
        .printed("12.02 ± 0.17", 12.02, Rule::Digits)
        .is(Literature, MEASURED),
    row("median-twilight", RESULTS, "median V in twilight", "mag", 2)
        .printed("6.41 ± 0.17", 6.41, Rule::Digits)
        .is(Literature, MEASURED),
    row("median-day", RESULTS, "median V by day", "mag", 2)
        .printed("-1.10 ± 0.05", -1.10, Rule::Digits)
        .is(Literature, HUNTSMAN),
    row("std-night", RESULTS, "standard deviation by night", "mag", 2)
        .printed("1.00 ± 0.17", 1.0, Rule::Digits)
        .is(Literature, MEASURED),
    row("std-twilight", RESULTS, "standard deviation in twilight", "mag", 2)
        .printed("1.93 ± 0.17", 1.93, Rule::Digits)
        .is(Literature, MEASURED),
    row("std-day", RESULTS, "standard deviation by day", "mag", 2)
        .printed("0.84 ± 0.05", 0.84, Rule::Digits)
        .is(Literature, HUNTSMAN),
    row("median-or-mean", "section Conclusions", "ISS by night", "mag", 2)
        .printed("mean 12.02 ± 1.00", 12.02, Rule::Digits)
        .is(
            Literature,
            "the column is a median, the caption and the conclusions call it a mean; ± is the spread of single \
            observations",
        ),
    row("earth-law", LUMOS, "Phong law of the Earth, diffuse, specular, exponent", "", 2)
        .printed("0.53, 0.28, 7.31", 0.53, Rule::Digits)
        .is(Literature, "land, Fankhauser et al. 2023: vegetation. The mean Earth reflects about 0.3"),
    row("earendil-reflectance", "section Satellites Considered", "reflectance of the mirror", "", 2)
        .printed("96%", 0.96, Rule::Digits)
        .is(Literature, "FCC filing DA-26-706A1"),
    row("earendil-divergence", "section Satellites Considered", "divergence of the beam", "deg", 2)
        .printed("0.53", 0.53, Rule::Digits)
        .is(Literature, "the Sun's diameter"),
    row("stk-snr-starlight", STK, "S/N, starlight only", "", 3)
        .printed("0.575", 0.575, Rule::Digits)
        .is(Literature, SIMULATED),
    row("stk-snr-moon", STK, "S/N, moonlight", "", 0).printed("307", 307.0, Rule::Digits).is(Literature, SIMULATED),
    row("stk-snr-lunar-earthshine", STK, "S/N, with Lunar-Earthshine", "", 0)
        .printed("467", 467.0, Rule::Digits)
        .is(Literature, SIMULATED),
    row("stk-panel-radiance", STK, "solar panel, starlight; with Lunar-Earthshine", "W cm-2 sr-1", 12)
        .printed("1.48e-12; 1.38e-10", 1.48e-12, Rule::Digits)
        .is(Literature, SIMULATED),
    row("stk-body1-radiance", STK, "body 1, starlight; moonlight; with Lunar-Earthshine", "W cm-2 sr-1", 11)
        .printed("1.63e-11; 1.35e-8; 1.54e-8", 1.63e-11, Rule::Digits)
        .is(Literature, SIMULATED),
    row("stk-body2-radiance", STK, "body 2, starlight; with Lunar-Earthshine", "W cm-2 sr-1", 11)
        .printed("2.36e-11; 4.82e-9", 2.36e-11, Rule::Digits)
        .is(Literature, SIMULATED),
];
