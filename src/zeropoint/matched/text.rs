//! The fit to a matched table in words: the lines of the terminal, and a `zeropoint.toml` with its own unit, band and colour.

use std::fmt::Write as _;

use super::Matched;
use super::columns::PER_SECOND_UNIT;
use crate::zeropoint::fit::Zeropoint;

impl Matched {
    /// A zeropoint.toml that says its own unit, band and colour: one that is not of V and electrons per second must not be
    /// read as that of a night.
    pub(crate) fn own_convention(&self, toml: &str) -> String {
        let text = |s: String| toml::Value::String(s).to_string();
        let mut out = String::new();
        for line in toml.lines() {
            if line.starts_with("inst_mag_unit = ") && self.inst_unit != PER_SECOND_UNIT {
                let _ = writeln!(out, "inst_mag_unit = {}", text(self.inst_unit.clone()));
            } else if line.starts_with("convention = ") && (self.band != "V" || self.colour != "B-V") {
                let _ = writeln!(out, "convention = {}", text(self.convention()));
            } else if line.starts_with("# Zeropoint") && self.inst_unit != PER_SECOND_UNIT {
                let _ = writeln!(out, "# Zeropoint, extinction and colour term of a matched table; X is the airmass.");
            } else {
                let _ = writeln!(out, "{line}");
            }
        }
        out
    }

    fn convention(&self) -> String {
        let second = self.zeropoint.as_ref().is_ok_and(Zeropoint::second_order);
        let second = if second { format!(" - k'' X ({})", self.colour) } else { String::new() };
        format!("{0} = {0}_inst - ZP - k X - C ({1}){second}", self.band, self.colour)
    }

    /// The fit in a few lines.
    #[must_use]
    pub fn text(&self) -> String {
        let mut t = String::new();
        let lost: Vec<String> = self.excluded.iter().map(|(reason, n)| format!("{n} {reason}")).collect();
        let lost = if lost.is_empty() { "none skipped".to_owned() } else { format!("skipped: {}", lost.join("; ")) };
        let _ = writeln!(t, "Table      {}: {} rows, {lost}", self.table, self.rows.len());
        let taken: Vec<String> = self.taken.iter().map(|(what, from)| format!("{what}: {from}")).collect();
        let _ = writeln!(t, "Columns    {}", taken.join(", "));
        let Ok(z) = &self.zeropoint else {
            t.push_str("Zeropoint  none\n");
            return t;
        };
        let errs = z.errs();
        let _ = writeln!(
            t,
            "Zeropoint  ZP {:.6} +- {:.6}  k {:.6} +- {:.6} ({})  C {:.6} +- {:.6} ({})",
            z.zp_mag, errs[0], z.k_mag_airmass, errs[1], z.k_note, z.c_mag_mag, errs[2], z.c_note
        );
        let _ = writeln!(t, "           {}; inst: {}", self.convention(), self.inst_unit);
        let signed = |v: f64| if v < 0.0 { format!("- {:.6}", -v) } else { format!("+ {v:.6}") };
        let mut sum = format!("{} = inst {}", self.band, signed(-z.zp_mag));
        if z.k_mag_airmass != 0.0 {
            let _ = write!(sum, " {} X", signed(-z.k_mag_airmass));
        }
        if z.c_mag_mag != 0.0 {
            let _ = write!(sum, " {} ({})", signed(-z.c_mag_mag), self.colour);
        }
        if z.second_order() {
            let _ = write!(sum, " {} X ({})", signed(-z.k2_mag), self.colour);
        }
        let _ = writeln!(t, "           that is {sum} (where a zeropoint is added: {:.6})", -z.zp_mag);
        let intrinsic =
            if z.intrinsic_mag > 0.0 { format!(", intrinsic scatter {:.4}", z.intrinsic_mag) } else { String::new() };
        let _ = writeln!(
            t,
            "           N {} used, {} outliers, {}, {} pointings, rms {:.4} mag{intrinsic}; {}",
            z.n_used,
            z.n_rejected,
            z.n_words(),
            z.n_pointings,
            z.rms_mag,
            z.estimator
        );
        let [zp, k, c] = z.multipliers_95();
        let _ = writeln!(t, "           95 %: the errors of ZP, k and C times {zp:.2}, {k:.2} and {c:.2}");
        // a term that is not fitted has no variance, so where it is taken does not matter
        let at = |mean: f64, else_: f64| if mean.is_finite() { mean } else { else_ };
        let (x, colour) = (at(z.airmass_mean, 1.0), at(z.b_v_mean_mag, 0.0));
        let _ = writeln!(
            t,
            "           error at the mean airmass and colour: {:.4} mag propagated, {:.4} as the paper adds it",
            z.err_mag(x, colour, 0.0),
            z.err_as_published_mag()
        );
        t
    }
}
