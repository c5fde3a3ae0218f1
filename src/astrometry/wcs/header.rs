//! What a header may and may not say: axes, units and equinox, the linear part.
//!
//! Anything that would be silently wrong is refused by the name of its keyword.

/// How the plane is distorted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Projection {
    /// Without distortion, or with one in pixels (SIP).
    Tan,
    /// By PV polynomials.
    Tpv,
}

/// Whether axis 1 is the declination.
pub(super) fn axes_swapped(ctype: &[String; 2]) -> Result<bool, String> {
    for (i, c) in ctype.iter().enumerate() {
        let known = ["RA---TAN", "DEC--TAN", "RA---TAN-SIP", "DEC--TAN-SIP", "RA---TPV", "DEC--TPV"];
        if !known.contains(&c.as_str()) {
            return Err(format!("CTYPE{} = '{c}': only RA and Dec in TAN, TAN-SIP and TPV are read", i + 1));
        }
    }
    match (ctype[0].starts_with("RA"), ctype[1].starts_with("RA")) {
        (true, false) => Ok(false),
        (false, true) => Ok(true),
        _ => Err(format!("CTYPE1 = '{}', CTYPE2 = '{}': one must be RA, the other DEC", ctype[0], ctype[1])),
    }
}

/// TPV by name, or TAN with PV terms on both axes, which SCAMP wrote; SIP terms win over PV terms, as in astropy.
pub(super) fn projection(
    ctype: &[String; 2],
    number: &dyn Fn(&str) -> Option<f64>,
    has_sip: bool,
    swapped: bool,
) -> Result<Projection, String> {
    let named = ctype.iter().filter(|c| c.ends_with("TPV")).count();
    let any = |axis: u8, from: u8| (from..40).find(|m| number(&format!("PV{axis}_{m}")).is_some());
    let (lon, lat) = if swapped { (2, 1) } else { (1, 2) };
    match named {
        1 => return Err(format!("CTYPE1 = '{}', CTYPE2 = '{}': one axis is TPV, the other not", ctype[0], ctype[1])),
        2 if has_sip => {
            return Err("CTYPE = TPV with SIP terms (A_ORDER): two distortions; solve the frame again".into());
        }
        2 => return Ok(Projection::Tpv),
        _ if has_sip => return Ok(Projection::Tan),
        _ => {}
    }
    // on the longitude axis PV1_1 to PV1_4 may be the native place and pole of any projection
    match (any(lon, 5).or(any(lon, 0).filter(|m| *m < 1)), any(lat, 0)) {
        (_, Some(_)) if any(lon, 0).is_some() => Ok(Projection::Tpv),
        (None, None) => {
            let at = [1, 2].map(|m| number(&format!("PV{lon}_{m}")).unwrap_or(0.0));
            // PixInsight writes (0, 0) where it means the pole of TAN
            if at[0] != 0.0 || (at[1] != 0.0 && at[1] != 90.0) {
                return Err(format!(
                    "PV{lon}_1 = {}, PV{lon}_2 = {}: a tangent plane off its own pole is not read",
                    at[0], at[1]
                ));
            }
            Ok(Projection::Tan)
        }
        (lon_term, lat_term) => {
            let (axis, term) = lat_term.map(|m| (lat, m)).or(lon_term.map(|m| (lon, m))).unwrap_or((lon, 0));
            Err(format!("PV{axis}_{term}: PV terms on one axis only"))
        }
    }
}

/// Native longitude of the celestial pole \[deg\]: LONPOLE, else PV1_3 where that is not a distortion term, else 180.
pub(super) fn pole_deg(number: &dyn Fn(&str) -> Option<f64>, projection: Projection) -> f64 {
    let pv = || number("PV1_3").filter(|_| projection == Projection::Tan);
    number("LONPOLE").or_else(pv).filter(|p| p.is_finite()).unwrap_or(180.0)
}

/// Refuses units, equinoxes and distortions that would be silently wrong.
pub(super) fn check_system(
    number: &dyn Fn(&str) -> Option<f64>,
    text: &dyn Fn(&str) -> Option<String>,
) -> Result<(), String> {
    for key in ["CUNIT1", "CUNIT2"] {
        if let Some(unit) = text(key).map(|u| u.trim().to_lowercase())
            && !matches!(unit.as_str(), "" | "deg" | "degree" | "degrees")
        {
            return Err(format!("{key} = '{unit}': only deg is read"));
        }
    }
    let radesys = text("RADESYS").or_else(|| text("RADECSYS")).unwrap_or_default().trim().to_uppercase();
    if radesys.starts_with("FK4") {
        return Err(format!("RADESYS = '{radesys}': coordinates of B1950 are not read; solve the frame for J2000"));
    }
    if radesys != "ICRS"
        && let Some(equinox) = number("EQUINOX").filter(|e| (e - 2000.0).abs() > 0.5)
    {
        return Err(format!("EQUINOX = {equinox}: only 2000.0 is read; solve the frame for J2000"));
    }
    Ok(())
}

/// The linear part \[deg/px\]: CD, else CDELT · PC, else CDELT with CROTA2.
pub(super) fn matrix(number: &dyn Fn(&str) -> Option<f64>, swapped: bool) -> Result<[[f64; 2]; 2], String> {
    let element = |name: &str, i: usize, j: usize| number(&format!("{name}{}_{}", i + 1, j + 1));
    let any = |name: &str| (0..4).any(|n| element(name, n / 2, n % 2).is_some());
    let cd = if any("CD") {
        [0, 1].map(|i| [0, 1].map(|j| element("CD", i, j).unwrap_or(0.0)))
    } else {
        // with a PC matrix the scale may be in it: CDELT is 1 by default
        let step = |key: &str| number(key).or(any("PC").then_some(1.0));
        let (Some(d1), Some(d2)) = (step("CDELT1"), step("CDELT2")) else {
            return Err("CD1_1 (or CDELT1, CDELT2) is missing: the pixel scale is unknown".into());
        };
        if any("PC") {
            let pc = |i: usize, j: usize| element("PC", i, j).unwrap_or(if i == j { 1.0 } else { 0.0 });
            [[d1 * pc(0, 0), d1 * pc(0, 1)], [d2 * pc(1, 0), d2 * pc(1, 1)]]
        } else {
            // the angle stands on the latitude axis
            let (own, other) = if swapped { ("CROTA1", "CROTA2") } else { ("CROTA2", "CROTA1") };
            if let Some(angle) = number(other).filter(|a| *a != 0.0 && number(own).is_none()) {
                return Err(format!("{other} = {angle} without {own}: the rotation is unknown"));
            }
            let (s, c) = number(own).unwrap_or(0.0).to_radians().sin_cos();
            let s = if swapped { -s } else { s };
            [[d1 * c, -d2 * s], [d1 * s, d2 * c]]
        }
    };
    if cd.iter().flatten().all(|v| v.is_finite()) {
        Ok(cd)
    } else {
        Err(format!("CD (or PC, CDELT): the matrix {cd:?} is not finite"))
    }
}
