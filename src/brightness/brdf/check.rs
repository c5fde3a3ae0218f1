//! Which coefficients are a scattering law at all, and which of those a surface can have.
//!
//! Two questions kept apart: [`Brdf::check_parameters`] checks whether f is a finite non-negative function,
//! [`Brdf::check`] whether it also returns no more light than it receives.

use super::law::Brdf;
use super::law::PHONG_N_MAX;
use crate::base::error::Result;
use crate::brightness::scene::impossible;

/// Largest share of the light a surface may return: 1, with room for coefficients rounded to three digits.
pub const REFLECTANCE_MAX: f64 = 1.001;
/// Largest |power| of d in a binomial law.
const D_POWER_MAX: i32 = 200;

impl Brdf {
    /// Refuses coefficients with which f is not finite or not positive; a law that creates light passes.
    ///
    /// # Errors
    /// [`crate::Error::Model`] naming the coefficient, its value and what is accepted.
    #[doc(hidden)]
    pub fn check_parameters(&self, what: &str) -> Result<()> {
        let at_least_0 = |name: &str, value: f64| {
            if value >= 0.0 && value.is_finite() {
                Ok(())
            } else {
                Err(impossible(format!("{what}: {name} = {value}; accepted is a number of 0 or more")))
            }
        };
        let above_0 = |name: &str, value: f64| {
            if value > 0.0 && value.is_finite() {
                Ok(())
            } else {
                Err(impossible(format!("{what}: {name} = {value}; accepted is a number above 0")))
            }
        };
        match self {
            Brdf::Lambert { albedo } => at_least_0("albedo", *albedo),
            Brdf::Mirror { reflectance } => at_least_0("reflectance", *reflectance),
            Brdf::Phong { kd, ks, n } => {
                at_least_0("kd", *kd)?;
                at_least_0("ks", *ks)?;
                if (0.0..=PHONG_N_MAX).contains(n) {
                    Ok(())
                } else {
                    Err(impossible(format!(
                        "{what}: n = {n}; accepted is 0 to {PHONG_N_MAX:e}, beyond it use kind = \"mirror\""
                    )))
                }
            }
            Brdf::Abg { a, b, g } => {
                at_least_0("a", *a)?;
                above_0("b", *b)?;
                at_least_0("g", *g)
            }
            Brdf::Gaussian { peak_per_sr, sigma } => {
                at_least_0("peak_per_sr", *peak_per_sr)?;
                above_0("sigma", *sigma)
            }
            Brdf::Binomial(law) => {
                let entries = || law.b.iter().chain(&law.c).flatten();
                if entries().next().is_none() {
                    return Err(impossible(format!("{what}: b and c are empty; give at least one coefficient")));
                }
                if let Some(bad) = entries().find(|x| !x.is_finite()) {
                    return Err(impossible(format!("{what}: a coefficient of b or c is {bad}; accepted are numbers")));
                }
                at_least_0("d", law.d)?;
                let last = law.c.iter().map(Vec::len).max().unwrap_or(0) as i64 - 1 + i64::from(law.l1);
                let largest = law.d.powf(last.max(i64::from(law.l1)) as f64).max(law.d.powf(f64::from(law.l1)));
                if law.l1.abs() > D_POWER_MAX || last > i64::from(D_POWER_MAX) || !(largest < 1e100) {
                    return Err(impossible(format!(
                        "{what}: l1 = {} gives powers of d = {} that cannot be used; accepted are |l1| to {D_POWER_MAX} \
                         and powers below 1e100",
                        law.l1, law.d
                    )));
                }
                Ok(())
            }
        }
    }

    /// Refuses coefficients no surface has.
    ///
    /// # Errors
    /// [`crate::Error::Model`] for what [`Brdf::check_parameters`] refuses, for an albedo or reflectance above 1, for
    /// k_d + k_s above 1, and for a law that [creates light](Brdf::creates_light).
    #[doc(hidden)]
    pub fn check(&self, what: &str) -> Result<()> {
        self.check_parameters(what)?;
        let share = |name: &str, value: f64| {
            if value <= 1.0 { Ok(()) } else { Err(impossible(format!("{what}: {name} = {value}; accepted is 0 to 1"))) }
        };
        match *self {
            Brdf::Lambert { albedo } => share("albedo", albedo)?,
            Brdf::Phong { kd, ks, .. } => share("kd + ks", kd + ks)?,
            Brdf::Mirror { reflectance } => share("reflectance", reflectance)?,
            _ => {}
        }
        let (reflected, incidence_rad) = self.largest_reflectance();
        if reflected <= REFLECTANCE_MAX {
            return Ok(());
        }
        Err(impossible(format!(
            "{what}: reflects {reflected:.4} of the light that falls in at {:.1} deg; at most 1",
            incidence_rad.to_degrees()
        )))
    }

    /// Whether at some incidence more than [`REFLECTANCE_MAX`] of the light is returned.
    #[doc(hidden)]
    #[must_use]
    pub fn creates_light(&self) -> bool {
        !(self.max_reflectance() <= REFLECTANCE_MAX)
    }
}
