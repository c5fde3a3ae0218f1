//! Magnitudes by hand: ratios, differences, the photometric error, the systems of magnitudes.
//!
//! mag. What the paper measured enters as printed.

use std::path::Path;

use super::areas::scale_arcsec;
use super::context::Context;
use super::entry::{Basis, Entry, Numbers, row};
use super::rule::Rule;
use crate::base::error::{Error, Result};
use crate::base::vector::{Itrs, Vector};
use crate::brightness::light_sources::{FULL_MOON_V_MAG, SUN_V_MAG, moon_v_mag};
use crate::brightness::spectrum::{MagSystem, SolarColumn, Spectrum, ab_mag, brightness_ratio, published_ab_mag};
use crate::brightness::{Band, Brdf};
use crate::config::Mode;
use crate::zeropoint::fit::Zeropoint;
use Basis::{Additional, Stated};

/// As the introduction has them \[mag\].
const SUN_PRINTED_MAG: f64 = -26.5;
const MOON_PRINTED_MAG: f64 = -12.5;
/// Sunlit Starlink V1.5, introduction \[mag\], and the area of its array \[m²\].
const STARLINK_SUNLIT_MAG: f64 = 6.0;
const STARLINK_ARRAY_M2: f64 = 22.0;
/// Medians and scatters of the observations, night and day \[mag\].
const NIGHT: (f64, f64) = (12.02, 1.00);
const DAY: (f64, f64) = (-1.10, 0.84);
/// ZP, k, C with their errors, section Data Reduction.
const ZEROPOINT: &str = "zp_mag = -23.37\nzp_err_mag = 0.11\nk_mag_airmass = 0.12\nk_err_mag_airmass = 0.05\n\
                         c_mag_mag = 0.08\nc_err_mag_mag = 0.12\n";
/// Airmass and colour the error is stated for here: the middle of the star fields, and the Sun.
const AIRMASS: f64 = 1.5;
const SUN_B_V_MAG: f64 = 0.65;
/// Surface brightness that gives one electron per second and pixel, which the published limits need \[mag/arcsec²\].
const PIXEL_ZP_MAG: f64 = 21.62;

const INTRODUCTION: &str = "section Introduction";
const REDUCTION: &str = "section Data Reduction";
const RESULTS: &str = "section Observational Results";

pub(super) const ROWS: &[Entry] = &[
    row("sun-moon-difference", INTRODUCTION, "full Moon less Sun", "mag", 2)
        .printed("14", 14.0, Rule::Digits)
        .is(Stated, "-12.5 less -26.5; corrected: V at mean distances, -12.73 less -26.76")
        .by(|_| Ok(Numbers::pair(MOON_PRINTED_MAG - SUN_PRINTED_MAG, FULL_MOON_V_MAG - SUN_V_MAG))),
    row("sun-moon-ratio", INTRODUCTION, "Sun over full Moon", "", 0)
        .printed("~400,000", 4e5, Rule::About)
        .is(Stated, "printed is 2.5^14, the number is 10^(0.4 14)")
        .by(|_| {
            let difference_mag = MOON_PRINTED_MAG - SUN_PRINTED_MAG;
            Ok(Numbers::pair(
                brightness_ratio(difference_mag, Mode::AsPublished),
                brightness_ratio(difference_mag, Mode::Corrected),
            ))
        }),
    row("starlink-moonlit", INTRODUCTION, "Starlink V1.5 by moonlight", "mag", 2)
        .printed("~20", 20.0, Rule::About)
        .is(Stated, "6 + 14, as if moonlight went the ways of sunlight")
        .by(|_| {
            let by_moon = |difference: f64| STARLINK_SUNLIT_MAG + difference;
            Ok(Numbers::pair(by_moon(MOON_PRINTED_MAG - SUN_PRINTED_MAG), by_moon(FULL_MOON_V_MAG - SUN_V_MAG)))
        }),
    row("starcloud-ratio", INTRODUCTION, "16 km2 over Starlink V1.5", "", 0)
        .printed("~730,000", 730_000.0, Rule::About)
        .is(Stated, "16e6/22, the array alone; corrected: all of its 25.65 m2")
        .by(starcloud_ratio),
    row("starcloud-gain", INTRODUCTION, "the same in magnitudes", "mag", 2)
        .printed("14.7", 14.7, Rule::Digits)
        .is(Stated, "2.5 lg of it")
        .by(|context| {
            let Numbers { as_published, corrected } = starcloud_ratio(context)?;
            let mag = |ratio: Option<f64>| ratio.map(|r| 2.5 * r.log10());
            Ok(Numbers { as_published: mag(as_published), corrected: mag(corrected) })
        }),
    row("starcloud-moonlit", INTRODUCTION, "16 km2 platform by moonlight", "mag", 2)
        .printed("~5.3", 5.3, Rule::About)
        .is(Stated, "20 less 14.7; the full scattering model is not in it")
        .by(|context| {
            let Numbers { as_published, corrected } = starcloud_ratio(context)?;
            let by_moon = |sun_moon: f64, ratio: f64| STARLINK_SUNLIT_MAG + sun_moon - 2.5 * ratio.log10();
            Ok(Numbers {
                as_published: as_published.map(|r| by_moon(MOON_PRINTED_MAG - SUN_PRINTED_MAG, r)),
                corrected: corrected.map(|r| by_moon(FULL_MOON_V_MAG - SUN_V_MAG, r)),
            })
        }),
    row("starcloud-angle", INTRODUCTION, "4 km x 4 km at 500 km", "arcmin", 1)
        .printed("of the full Moon", 31.0, Rule::About)
        .is(Stated, "27.5 along a side; corrected: the disc of the same area. The Moon is 29 to 34 wide")
        .by(|_| {
            let arcmin = |m: f64| (m / 500e3).to_degrees() * 60.0;
            Ok(Numbers::pair(arcmin(4e3), arcmin((16e6 * 4.0 / std::f64::consts::PI).sqrt())))
        }),
    row("night-day-difference", RESULTS, "ISS by night less by day", "mag", 2)
        .printed("13.12", 13.12, Rule::Digits)
        .is(Stated, "12.02 less -1.10, both measured")
        .by(|_| Ok(Numbers::both(NIGHT.0 - DAY.0))),
    row("night-day-difference-err", RESULTS, "its error", "mag", 2)
        .printed("1.30", 1.30, Rule::Digits)
        .is(
            Stated,
            "the two standard deviations in quadrature: the spread of single observations, not \
            the error of medians",
        )
        .by(|_| Ok(Numbers::both(NIGHT.1.hypot(DAY.1)))),
    row("sigma-phot", REDUCTION, "photometric error", "mag", 4)
        .printed("0.17", 0.17, Rule::Digits)
        .is(
            Stated,
            "the three errors in quadrature; corrected: each times its airmass 1.5 or colour 0.65, no \
                covariance known",
        )
        .by(|_| {
            let zeropoint = Zeropoint::parse(Path::new("zeropoint as printed"), ZEROPOINT)?;
            Ok(Numbers::pair(zeropoint.err_as_published_mag(), zeropoint.err_mag(AIRMASS, SUN_B_V_MAG, 0.0)))
        }),
    row("zeropoint-gap", "section Detection Thresholds", "zeropoint of the limits less the measured one", "mag", 1)
        .against(0.0, Rule::Limit)
        .is(
            Stated,
            "the published limits need 1 e-/s in a pixel of 0.196 arcsec at 21.62 mag/arcsec2, 25.16 mag \
                for the whole; \
             measured is 23.37, its unit (electrons or counts per second) not stated",
        )
        .by(|context| Ok(Numbers::corrected(PIXEL_ZP_MAG - 5.0 * scale_arcsec(context).log10() - 23.37))),
    row("moon-system", "section Spectral Modelling of Moonlight", "full Moon", "mag", 2)
        .printed("-12.73 V band ABmag", -12.73, Rule::Digits)
        .is(Stated, "the law is of V in the Vega system; corrected: V of the same Moon in AB")
        .by(|_| {
            let v = Band::of_config("V")?;
            let [vega, ab] = [MagSystem::Vega, MagSystem::Ab].map(|system| v.sun_mag_in(system));
            let offset_mag = ab.zip(vega).map(|(ab, vega)| ab - vega);
            Ok(Numbers { as_published: Some(moon_v_mag(0.0)), corrected: offset_mag.map(|o| moon_v_mag(0.0) + o) })
        }),
    row("ab-of-sun", "lumos-sat", "the Sun, 1360 W/m2 at 532 nm", "mag", 2)
        .is(Additional, "the conversion behind the published model is 0.30 mag too bright; corrected: V")
        .by(|_| Ok(Numbers { as_published: published_ab_mag(1360.0), corrected: Some(SUN_V_MAG) })),
    row(
        "extinction-global",
        "section Spectral Modelling of Moonlight",
        "extinction in a source at the ground, global",
        "mag",
        2,
    )
    .formula()
    .is(
        Stated,
        "magnitudes are corrected for extinction, yet the source is scaled at the bottom of the \
                atmosphere: counted twice",
    )
    .by(|_| extinction(SolarColumn::Global)),
    row("extinction-direct", "section Spectral Modelling of Moonlight", "the same of the direct spectrum", "mag", 2)
        .formula()
        .is(Stated, "as above, had the direct column been taken")
        .by(|_| extinction(SolarColumn::Direct)),
    row("ab-constant", "section Simplified Brightness Model", "magnitude 0 in W m-2 Hz-1, as a magnitude", "mag", 1)
        .printed("56.1", 56.1, Rule::Digits)
        .is(Stated, "corrected: 3631 Jy")
        .by(|_| Ok(Numbers { as_published: ab_mag(1.0).map(|m| -m), corrected: Some(-2.5 * 3631e-26_f64.log10()) })),
    row("brdf-definition", "equation of the BRDF", "the definition printed over the right one, seen at 60 deg", "", 2)
        .formula()
        .is(Stated, "f = dL_o/(L_i cos theta_i d omega_i); printed is 1/cos theta_e more")
        .by(|_| {
            let (up, seen_deg) = (Vector::<Itrs>::new(0.0, 0.0, 1.0), 60.0_f64);
            let (sin, cos) = seen_deg.to_radians().sin_cos();
            let f = Brdf::Lambert { albedo: 1.0 }.value(&up, &up, &Vector::new(sin, 0.0, cos));
            Ok(Numbers::pair(f / cos * std::f64::consts::PI, f * std::f64::consts::PI))
        }),
];

fn starcloud_ratio(context: &Context) -> Result<Numbers> {
    let starcloud_m2 = context.area_m2("starcloud")?;
    Ok(Numbers::pair(starcloud_m2 / STARLINK_ARRAY_M2, starcloud_m2 / context.area_m2("starlink-v1.5")?))
}

/// What V loses between a spectrum outside the air and one at the ground.
fn extinction(column: SolarColumn) -> Result<Numbers> {
    let v = Band::of_config("V")?;
    let mag = |column| -> Result<f64> {
        let spectrum = Spectrum::sun(column)?;
        v.ab_mag(&spectrum).ok_or_else(|| Error::Model { problem: "no light in V".into() })
    };
    Ok(Numbers::pair(mag(column)? - mag(SolarColumn::Extraterrestrial)?, 0.0))
}
