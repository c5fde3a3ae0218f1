//! Under which names and descriptors (UCD) catalogues keep what satphot reads, and the keys of `stars.columns`.

use std::collections::BTreeMap;

use crate::base::error::{Error, Result};
use crate::tables::guess::{Quantity, keys, unknown_key};

/// What is looked for, apart from places, which come in pairs.
pub const KNOWN: [Quantity; 10] = [
    Quantity { key: "ra_deg", names: "", ucds: &["pos.eq.ra;meta.main", "POS_EQ_RA_MAIN", "pos.eq.ra"] },
    Quantity { key: "dec_deg", names: "", ucds: &["pos.eq.dec;meta.main", "POS_EQ_DEC_MAIN", "pos.eq.dec"] },
    Quantity {
        key: "v_mag",
        names: "Vmag v_mag Johnson_V mag_V V_mag V",
        ucds: &["phot.mag;em.opt.V", "phot.mag;em.opt.V;meta.main", "PHOT_JHN_V"],
    },
    Quantity {
        key: "v_mag_err",
        names: "e_Vmag v_mag_err v_err_mag Verr V_err e_V err_Vmag",
        ucds: &["stat.error;phot.mag;em.opt.V"],
    },
    Quantity {
        key: "b_v_mag",
        names: "B-V b_v_mag B_V BV (B-V)",
        ucds: &["phot.color;em.opt.B;em.opt.V", "PHOT_JHN_B-V"],
    },
    Quantity {
        key: "b_v_err_mag",
        names: "e_B-V b_v_err_mag b_v_mag_err e_B_V BVerr B_V_err e_BV",
        ucds: &["stat.error;phot.color;em.opt.B;em.opt.V"],
    },
    Quantity {
        key: "id",
        names: "recno id source_id Source object_id Name UCAC4 objID",
        ucds: &["meta.id;meta.main", "ID_MAIN"],
    },
    Quantity { key: "pm_ra_mas_yr", names: "pm_ra_mas_yr pmRA pm_ra", ucds: &["pos.pm;pos.eq.ra"] },
    Quantity { key: "pm_dec_mas_yr", names: "pm_dec_mas_yr pmDE pmDEC pm_dec", ucds: &["pos.pm;pos.eq.dec"] },
    Quantity { key: "epoch_jyear", names: "epoch_jyear ref_epoch", ucds: &["meta.ref;time.epoch"] },
];

/// Names of right ascension and declination, which belong together; best first.
pub const PLACES: [(&str, &str); 12] = [
    ("RAJ2000", "DEJ2000"),
    ("_RAJ2000", "_DEJ2000"),
    ("RAmdeg", "DEmdeg"),
    ("RA_ICRS", "DE_ICRS"),
    ("RAICRS", "DEICRS"),
    ("_RA.icrs", "_DE.icrs"),
    ("_RA", "_DE"),
    ("ra_deg", "dec_deg"),
    ("radeg", "decdeg"),
    ("RAdeg", "DEdeg"),
    ("ra", "dec"),
    ("ALPHA_J2000", "DELTA_J2000"),
];

/// Names of Johnson B and of its error.
pub const B_MAG: [&[&str]; 2] = [&["Bmag", "b_mag", "Johnson_B"], &["e_Bmag", "b_mag_err", "Berr", "B_err"]];
/// Number of nights or images.
pub const N_OBS: &[&str] = &["nobs", "n_obs", "number_of_Obs", "Nobs"];
/// BT and VT of Tycho-2, and their errors.
pub const TYCHO: [&[&str]; 4] = [&["BTmag"], &["e_BTmag"], &["VTmag"], &["e_VTmag"]];
/// Names of a Tycho star in three columns.
pub const TYCHO_ID: [&str; 3] = ["TYC1", "TYC2", "TYC3"];
/// G, BP and RP of Gaia, and their errors.
pub const GAIA: [&[&str]; 6] = [
    &["Gmag", "phot_g_mean_mag"],
    &["e_Gmag", "phot_g_mean_mag_error"],
    &["BPmag", "phot_bp_mean_mag"],
    &["e_BPmag", "phot_bp_mean_mag_error"],
    &["RPmag", "phot_rp_mean_mag"],
    &["e_RPmag", "phot_rp_mean_mag_error"],
];

/// Refuses unknown keys of `stars.columns`.
pub fn check_keys(columns: &BTreeMap<String, String>) -> Result<()> {
    match unknown_key(&KNOWN, columns) {
        None => Ok(()),
        Some(key) => Err(Error::Config {
            key: format!("stars.columns.{key}"),
            problem: format!("is not a column that satphot reads; known: {}", keys(&KNOWN)),
        }),
    }
}
