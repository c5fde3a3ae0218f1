use super::*;

#[test]
fn every_spelling_of_a_filter_means_its_band() {
    use Band::*;
    for (band, spellings) in [
        (
            V,
            "V|Johnson_V|Bessell V|johnson v|V (Bessell)|Bessel-V|VJ|Astrodon V|Filter_V|Chroma V|Johnson-Cousins V|V, Clear|upper: Clear  lower: V|Johnson V 50mm",
        ),
        (B, "Johnson B|Bessell_B|BJ"),
        (R, "Rc|R_c|Cousins R|Johnson R (Bessell)|Bessell R"),
        (I, "I|Ic|Cousins_I"),
        (
            SloanG,
            "g|g'|gp|SDSS-g|SDSS-G|SDSS g|sdss_g|g_band|SG|Sloan g'|g DECam SDSS c0001 4720.0 1520.0|g’|SDSS-GP-XXX",
        ),
        (SloanR, "r|r'|rp|SDSS-R|SR|HSC-r2|sr|r DECam SDSS c0002 6415.0 1480.0|Sloan R"),
        (SloanI, "i|ip|SI|i DECam SDSS c0003 7835.0 1470.0"),
        (SloanZ, "zs|z|SDSS z|ZS"),
        (TriGreen, "TG|Green|green|tg|LRGB_G"),
        (TriRed, "TR|Red|RGB R|Baader Red"),
        (TriBlue, "TB|Blue|Astronomik Deep-Sky Blue|Blue (B)"),
    ] {
        for text in spellings.split('|') {
            assert_eq!(filter_meaning(text), Meaning::Band(band), "{text}");
        }
    }
    for text in
        "|  |L|l|Lum|LUM|Luminance|Clear|CLEAR|clr|air|None|Empty|Open|No filter|Filter_L|'Clear'|UV/IR Cut|NOTPRESENT|None (Clear)".split('|')
    {
        assert_eq!(filter_meaning(text), Meaning::Unfiltered, "{text}");
    }
    for text in
        "Ha|H-alpha|Ha 7nm|Ha_3nm|H_alpha|OIII|O3|SII 3nm|NII|HaOIII|LP|VR|CLS|L-Pro|L-eXtreme|Chroma Ha 3nm|Dark"
            .split('|')
    {
        assert_eq!(filter_meaning(text), Meaning::NoBand, "{text}");
    }
    for text in ["R", "G", "B", "Astrodon B"] {
        assert!(matches!(filter_meaning(text), Meaning::Either(..)), "{text}");
    }
    // a place in the wheel, a wheel's name, a letter of the wrong case: nobody knows
    for text in ["1", "5", "EFW", "ZWO EFW", "UNKNOWN", "v", "b", "w", "W", "Moravian EFW"] {
        assert_eq!(filter_meaning(text), Meaning::Unknown, "{text}");
    }
}

#[test]
fn every_usual_column_name_implies_its_band() {
    use Band::*;
    for (band, names) in [
        (V, "Vmag|v_mag|Johnson_V|mag_V|V_mag|V|catalogue_v_mag|v_jkc_mag|magV|Vmag_std|Johnson_V (V)"),
        (B, "Bmag|b_mag|Johnson_B|B"),
        (R, "Rmag|R|Cousins_R|r_jkc_mag|Rc"),
        (I, "Imag|Ic|i_jkc_mag"),
        (SloanG, "gmag|g'mag|g_mag|g_psf|gMeanPSFMag|g_sdss_mag|gp|g_ps1_mag|SDSS_g|gPSFMag|Sloan_g|mag_g|psfMag_g"),
        (SloanR, "rmag|r'mag|r_psf|rMeanPSFMag|rp_mag"),
        (SloanI, "imag|i'mag"),
        (SloanZ, "zmag|z_psf"),
        (GaiaG, "Gmag|phot_g_mean_mag|gaia_g"),
        (GaiaBp, "BPmag|phot_bp_mean_mag"),
        (GaiaRp, "RPmag|phot_rp_mean_mag"),
        (TychoV, "VTmag"),
    ] {
        for name in names.split('|') {
            assert_eq!(column_band(name), Some(band), "{name}");
        }
    }
    for name in ["mag", "flux", "magnitude", "star_mag", "e_Vmag", "B-V", ""] {
        assert_eq!(column_band(name), None, "{name}");
    }
}

#[test]
fn a_result_has_the_band_on_which_filter_catalogue_and_user_agree() {
    let light = |text: &str| Light { filter: text.into(), meaning: filter_meaning(text) };
    let of = |text: &str, catalogue: Option<Band>, declared: Option<Band>| {
        CalibratedBand::of(&light(text), (catalogue, "column `x`"), declared)
            .map(|c| c.text())
            .map_err(|e| e.to_string())
    };
    let (v, g, r) = (Some(Band::V), Some(Band::SloanG), Some(Band::R));
    assert_eq!(of("", v, None).unwrap(), "V, unfiltered, colour-transformed");
    assert_eq!(of("Clear", g, None).unwrap(), "g, unfiltered, colour-transformed");
    assert_eq!(of("Johnson_V", v, None).unwrap(), "V");
    assert_eq!(of("V", v, v).unwrap(), "V");
    assert_eq!(of("gp", g, None).unwrap(), "g");
    // the green filter of a colour set is calibrated by stars of V and is not V
    assert_eq!(of("Green", v, None).unwrap(), "TG");
    assert_eq!(of("Green", v, v).unwrap(), "V, declared for filter Green, colour-transformed");
    assert_eq!(of("R", r, r).unwrap(), "R");
    assert_eq!(of("R", r, Some(Band::TriRed)).unwrap(), "TR");
    assert_eq!(of("Rc", v, v).unwrap(), "V, declared for filter Rc, colour-transformed");
    assert_eq!(of("7", v, v).unwrap(), "V, declared for filter 7, colour-transformed");
    for (text, catalogue, declared) in [
        ("V", g, None), // V of a column of g
        ("V", g, v),    // and declaring V does not make it V
        ("", g, v),
        ("R", v, None), // R of a column of V
        ("B", v, None),
        ("R", r, None), // Cousins or red?
        ("R", v, r),
        ("Ha", v, None),
        ("Ha", v, v),
        ("7", v, None),   // which filter is in place 7?
        ("", None, None), // a column that does not say
    ] {
        let problem = of(text, catalogue, declared).unwrap_err();
        assert!(problem.contains("photometry.band"), "{text}: {problem}");
    }
}
