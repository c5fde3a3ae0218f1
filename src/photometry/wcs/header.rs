//! What a header may and may not say: axes, units and equinox, the linear part.
//!
//! Anything that would be silently wrong is refused by the name of its keyword.

/// Whether axis 1 is the declination.
pub(super) fn axes_swapped(ctype: &[String; 2]) -> Result<bool, String> {
    for (i, c) in ctype.iter().enumerate() {
        if !matches!(c.as_str(), "RA---TAN" | "DEC--TAN" | "RA---TAN-SIP" | "DEC--TAN-SIP") {
            return Err(format!(
                "CTYPE{} = '{c}': only RA---TAN and DEC--TAN (with or without -SIP) are read; solve the frame again",
                i + 1
            ));
        }
    }
    match (ctype[0].starts_with("RA"), ctype[1].starts_with("RA")) {
        (true, false) => Ok(false),
        (false, true) => Ok(true),
        _ => Err(format!("CTYPE1 = '{}', CTYPE2 = '{}': one must be RA, the other DEC", ctype[0], ctype[1])),
    }
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
    let pv = (5..40).map(|m| format!("PV1_{m}")).chain((0..40).map(|m| format!("PV2_{m}")));
    for key in pv {
        if number(&key).is_some_and(|v| v != 0.0) {
            return Err(format!("{key}: PV distortion terms are not read; write the solution with SIP terms"));
        }
    }
    Ok(())
}

/// The linear part \[deg/px\]: CD, else CDELT · PC, else CDELT with CROTA2.
pub(super) fn matrix(number: &dyn Fn(&str) -> Option<f64>) -> Result<[[f64; 2]; 2], String> {
    let element = |name: &str, i: usize, j: usize| number(&format!("{name}{}_{}", i + 1, j + 1));
    let any = |name: &str| (0..4).any(|n| element(name, n / 2, n % 2).is_some());
    let cd = if any("CD") {
        [0, 1].map(|i| [0, 1].map(|j| element("CD", i, j).unwrap_or(0.0)))
    } else {
        let (Some(d1), Some(d2)) = (number("CDELT1"), number("CDELT2")) else {
            return Err("CD1_1 (or CDELT1, CDELT2) is missing: the pixel scale is unknown".into());
        };
        if any("PC") {
            let pc = |i: usize, j: usize| element("PC", i, j).unwrap_or(if i == j { 1.0 } else { 0.0 });
            [[d1 * pc(0, 0), d1 * pc(0, 1)], [d2 * pc(1, 0), d2 * pc(1, 1)]]
        } else {
            let (s, c) = number("CROTA2").unwrap_or(0.0).to_radians().sin_cos();
            [[d1 * c, -d2 * s], [d1 * s, d2 * c]]
        }
    };
    if cd.iter().flatten().all(|v| v.is_finite()) {
        Ok(cd)
    } else {
        Err(format!("CD (or PC, CDELT): the matrix {cd:?} is not finite"))
    }
}
