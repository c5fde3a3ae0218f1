//! Areas of satellites, the instrument: pixel scale, field, gain.
//!
//! m², arcsec, arcmin, dB. The areas are sums over the catalogue's components and surfaces.

use super::context::Context;
use super::entry::{Basis, Entry, Numbers, row};
use super::rule::Rule;
use crate::base::error::{Error, Result};
use crate::frames::{Detector, pixel_scale_arcsec};
use Basis::{Additional, Assumed, Stated};

const TABLE: &str = "table of total surface areas";
const APPENDIX: &str = "appendix A";
const OBSERVATIONS: &str = "section Description of Observations";

pub(super) const ROWS: &[Entry] = &[
    row("iss-solar-area", "section Satellites Considered", "ISS arrays, sum of the parts of the appendix", "m2", 2)
        .printed("2672.36", 2672.36, Rule::Digits)
        .is(Stated, "28 + 118.8 + 2500 + 12.84 + 12.72")
        .by(iss_array),
    row("iss-chassis-area", "section Satellites Considered", "ISS chassis, sum of the parts of the appendix", "m2", 2)
        .printed("1577.89", 1577.89, Rule::Digits)
        .is(
            Stated,
            "the parts listed, without Cupola, sum to 46.05 m2 more (0.03 mag); no part can be dropped to \
                give it, a truss \
             10.71 m shorter would. The list also mixes times: Pirs left in 2021, Nauka and Prichal are not in it. The \
             published area stays the one in use",
        )
        .by(iss_chassis),
    row("iss-chassis-area-cupola", APPENDIX, "the same with the Cupola", "m2", 2)
        .is(Additional, "does not give 1577.89 either")
        .by(iss_chassis_with_cupola),
    row("iss-total-area", TABLE, "ISS, chassis and arrays", "m2", 2)
        .printed("4250.25", 4250.25, Rule::Digits)
        .is(Stated, "of the two areas as printed")
        .by(area::<0>),
    row("starlink-v1.5-area", TABLE, "Starlink V1.5", "m2", 2)
        .printed("25.65", 25.65, Rule::Digits)
        .is(Stated, "22 + 3.65, areas of Fankhauser et al. 2023")
        .by(area::<1>),
    row("starlink-v2-area", TABLE, "Starlink V2.0", "m2", 2)
        .printed("116.03", 116.03, Rule::Digits)
        .is(Stated, "11.07 + 104.96, areas of the author's model files")
        .by(area::<2>),
    row("starlink-v3-area", TABLE, "Starlink V3.0", "m2", 0)
        .printed("420", 420.0, Rule::Digits)
        .is(Stated, "only the total is published; its division into chassis and array is ours")
        .by(area::<3>),
    row("bluebird-area", TABLE, "Bluebird FM1", "m2", 0)
        .printed("253", 253.0, Rule::Digits)
        .is(Stated, "one plate")
        .by(area::<4>),
    row("earendil-area", TABLE, "Earendil-1", "m2", 0)
        .printed("324", 324.0, Rule::Digits)
        .is(Stated, "18 m x 18 m")
        .by(area::<5>),
    row("starcloud-area", TABLE, "Starcloud", "m2", 0)
        .printed("16,000,000", 16e6, Rule::Digits)
        .is(Stated, "4 km x 4 km; its division is ours")
        .by(area::<6>),
    row("starmind-area", TABLE, "Starmind", "m2", 0)
        .printed("1400", 1400.0, Rule::Digits)
        .is(Stated, "only the total is published; its division is ours")
        .by(area::<7>),
    row("v3-over-v2-area", "section Satellites Considered", "area of Starlink V3 over V2", "", 2)
        .printed("approx 4", 4.0, Rule::About)
        .is(Stated, "420/116.03")
        .by(v3_over_v2),
    row("starlink-count", "section Satellites Considered", "Starlink in orbit, sum of the paper's table", "", 0)
        .printed("10,413", 10_413.0, Rule::Digits)
        .is(Stated, "10 413 are operational, the table sums what was launched: two quantities")
        .by(starlink_count),
    row("pixel-scale", OBSERVATIONS, "pixel scale", "arcsec", 4)
        .printed("1", 1.0, Rule::About)
        .is(Stated, "3.76 um in the focus of 3962 mm; the field of view printed agrees with ours. 26 times in area")
        .by(pixel_scale),
    row("pixel-area-ratio", OBSERVATIONS, "area of a pixel as printed over that of the optics", "", 1)
        .is(Additional, "what a limit per pixel is wrong by")
        .by(pixel_area_ratio),
    row("field-width", OBSERVATIONS, "field of view, long side", "arcmin", 1)
        .printed("31.0", 31.0, Rule::About)
        .is(Assumed, "9576 px, focal length 3962 mm (f/6.5), which the paper does not state")
        .by(field::<9576>),
    row("field-height", OBSERVATIONS, "field of view, short side", "arcmin", 1)
        .printed("20.7", 20.7, Rule::About)
        .is(Assumed, "6388 px")
        .by(field::<6388>),
    row("gain-unit", OBSERVATIONS, "gain from setting 200 to 300", "dB", 1)
        .printed("200-300dB", 100.0, Rule::About)
        .is(
            Stated,
            "settings are in units of 0.1 dB: 20 lg of the camera's electrons per ADU at 200 over that at \
                300; the flats \
             were taken at 200 only",
        )
        .by(gain_step),
];

/// Names of the satellites of the table.
const NAMES: [&str; 8] =
    ["iss", "starlink-v1.5", "starlink-v2", "starlink-v3", "bluebird-fm1", "earendil-1", "starcloud", "starmind"];

fn area<const I: usize>(context: &Context) -> Result<Numbers> {
    Ok(Numbers::both(context.area_m2(NAMES[I])?))
}

/// Sum of the components of a surface of the ISS, and with those that are listed but not counted \[m²\].
fn iss_parts(context: &Context, surface: &str) -> Result<(f64, f64)> {
    let iss = context.catalogue.find("iss")?;
    let of = |all: bool| {
        let parts = iss.components.iter().filter(|c| c.surface == surface && (all || !c.excluded));
        parts.filter_map(|c| c.total_m2()).sum()
    };
    Ok((of(false), of(true)))
}

fn iss_array(context: &Context) -> Result<Numbers> {
    Ok(Numbers::both(iss_parts(context, "array")?.0))
}

fn iss_chassis(context: &Context) -> Result<Numbers> {
    Ok(Numbers::both(iss_parts(context, "chassis")?.0))
}

fn iss_chassis_with_cupola(context: &Context) -> Result<Numbers> {
    Ok(Numbers::both(iss_parts(context, "chassis")?.1))
}

fn v3_over_v2(context: &Context) -> Result<Numbers> {
    Ok(Numbers::both(context.area_m2("starlink-v3")? / context.area_m2("starlink-v2")?))
}

fn starlink_count(context: &Context) -> Result<Numbers> {
    let mut sum = 0.0;
    for name in ["starlink-v1.5", "starlink-v2", "starlink-v3"] {
        sum += context.catalogue.find(name)?.counts.as_ref().map_or(0.0, |c| c.launched as f64);
    }
    Ok(Numbers::both(sum))
}

/// Of the paper's telescope and camera \[arcsec\].
pub(super) fn scale_arcsec(context: &Context) -> f64 {
    pixel_scale_arcsec(context.config.detector.pixel_um, 1, context.config.telescope.focal_length_mm)
}

fn pixel_scale(context: &Context) -> Result<Numbers> {
    Ok(Numbers::corrected(scale_arcsec(context)))
}

fn pixel_area_ratio(context: &Context) -> Result<Numbers> {
    Ok(Numbers::corrected(scale_arcsec(context).powi(-2)))
}

fn field<const PX: u32>(context: &Context) -> Result<Numbers> {
    Ok(Numbers::both(f64::from(PX) * scale_arcsec(context) / 60.0))
}

fn gain_step(context: &Context) -> Result<Numbers> {
    let detector = Detector::from_config(&context.config.detector)?;
    let e_per_adu = |setting| {
        detector.gain_for_setting(setting).map(|g| g.e_per_adu.0).ok_or_else(|| Error::Model {
            problem: format!("gain setting {setting} is not in the table of the camera"),
        })
    };
    Ok(Numbers::corrected(20.0 * (e_per_adu(200)? / e_per_adu(300)?).log10()))
}
