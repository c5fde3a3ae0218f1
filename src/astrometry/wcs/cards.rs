//! A coordinate system as header cards, and as a FITS header without pixels.

use super::linear::Wcs;

/// The value of a header card written by [`Wcs::cards`].
#[derive(Debug, Clone, PartialEq)]
pub enum WcsValue {
    /// A quoted string.
    Text(String),
    /// A number.
    Real(f64),
}

impl Wcs {
    /// The header cards of this system: keyword, value, comment.
    #[must_use]
    pub fn cards(&self) -> Vec<(String, WcsValue, String)> {
        let name = match (&self.tpv, self.is_distorted()) {
            (Some(_), _) => ["RA---TPV", "DEC--TPV"],
            (None, true) => ["RA---TAN-SIP", "DEC--TAN-SIP"],
            (None, false) => ["RA---TAN", "DEC--TAN"],
        };
        let text = |k: &str, v: String, c: &str| (k.to_owned(), WcsValue::Text(v), c.to_owned());
        let real = |k: String, v: f64, c: &str| (k, WcsValue::Real(v), c.to_owned());
        let mut cards = vec![
            text("CTYPE1", name[0].into(), "gnomonic projection"),
            text("CTYPE2", name[1].into(), "gnomonic projection"),
            text("CUNIT1", "deg".into(), "unit of CRVAL1"),
            text("CUNIT2", "deg".into(), "unit of CRVAL2"),
            text("RADESYS", "ICRS".into(), "reference system"),
            real("EQUINOX".into(), 2000.0, "[yr] equinox"),
            real("CRVAL1".into(), self.crval_deg[0], "[deg] right ascension at the reference pixel"),
            real("CRVAL2".into(), self.crval_deg[1], "[deg] declination at the reference pixel"),
            real("CRPIX1".into(), self.crpix[0], "[px] reference pixel, first pixel = 1"),
            real("CRPIX2".into(), self.crpix[1], "[px] reference pixel, first pixel = 1"),
        ];
        for i in 0..2 {
            for j in 0..2 {
                cards.push(real(format!("CD{}_{}", i + 1, j + 1), self.cd[i][j], "[deg/px] pixel to sky"));
            }
        }
        for (axis, sip) in ['A', 'B'].iter().zip(&self.sip) {
            let Some(sip) = sip else { continue };
            cards.push(real(format!("{axis}_ORDER"), sip.order as f64, "SIP polynomial order"));
            for (p, q, a) in &sip.terms {
                cards.push(real(format!("{axis}_{p}_{q}"), *a, "SIP coefficient"));
            }
        }
        if let Some(tpv) = &self.tpv {
            cards.extend(tpv.cards().into_iter().map(|(key, v)| real(key, v, "TPV coefficient")));
        }
        cards
    }

    /// A FITS header without pixels that holds this system, for a frame of `size_px`: blocks of 2880 bytes.
    ///
    /// Numbers are written so that they read back exactly.
    #[must_use]
    pub fn header_file(&self, size_px: (usize, usize)) -> Vec<u8> {
        let fixed = |k: &str, v: String, c: &str| format!("{k:<8}= {v:>20} / {c}");
        let mut cards = vec![
            fixed("SIMPLE", "T".into(), "FITS standard"),
            fixed("BITPIX", "8".into(), ""),
            fixed("NAXIS", "0".into(), "no pixels"),
            fixed("WCSAXES", "2".into(), ""),
            fixed("IMAGEW", size_px.0.to_string(), "[px] width of the frame"),
            fixed("IMAGEH", size_px.1.to_string(), "[px] height of the frame"),
        ];
        cards.extend(self.cards().into_iter().map(|(key, value, comment)| match value {
            WcsValue::Text(text) => format!("{key:<8}= '{text:<8}' / {comment}"),
            WcsValue::Real(v) if key.ends_with("_ORDER") => fixed(&key, format!("{v:.0}"), &comment),
            WcsValue::Real(v) => fixed(&key, format!("{v:E}"), &comment),
        }));
        cards.push("END".into());
        let mut text: String = cards.iter().map(|c| format!("{:<80.80}", c)).collect();
        text.extend(std::iter::repeat_n(' ', (2880 - text.len() % 2880) % 2880));
        text.into_bytes()
    }
}
