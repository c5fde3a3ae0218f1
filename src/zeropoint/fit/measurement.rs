//! One star of one pointing, as the fit takes it.

/// One catalogue star measured in one pointing. An error that is NaN or not positive is unknown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StarMeasurement {
    /// Instrumental magnitude, −2.5 log10(e⁻/s) \[mag\].
    pub inst_mag: f64,
    /// Its random error \[mag\].
    pub inst_err_mag: f64,
    /// Catalogue V \[mag\].
    pub v_mag: f64,
    /// Its error \[mag\].
    pub v_err_mag: f64,
    /// Catalogue B−V \[mag\]; may be NaN only where the colour term is pinned to 0.
    pub b_v_mag: f64,
    /// Its error \[mag\].
    pub b_v_err_mag: f64,
    /// Airmass X of the star or of its pointing.
    pub airmass: f64,
    /// Which pointing; stars of one pointing may share an error (a cloud).
    pub pointing: usize,
    /// Which star: the catalogue's error of a star is the same in all of its measurements. `None`: a star of its own.
    pub star: Option<usize>,
}
