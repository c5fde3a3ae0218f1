//! The skies of `satphot limits tracked`: given, by the Moon's phase, or by where the Moon stands.

use clap::Args;
use satphot::visibility::sky_brightness::{
    DARK_V_MAG_ARCSEC2, K_V_MAG_AIRMASS, LEAST_MOON_SEP_DEG, MoonInSky, moonlit_sky_v_mag_arcsec2, nl_of_v_mag_arcsec2,
    twilight_nl, v_mag_arcsec2_of_nl,
};
use satphot::visibility::sky_brightness_table::{sky_at_moon_phase, sky_of_v};

use crate::cli::orbit_args::bad;

/// Phases and altitudes of the Moon of `--by-moon` \[deg\].
const PHASES_DEG: [f64; 7] = [0.0, 30.0, 60.0, 90.0, 120.0, 150.0, 180.0];
const ALTITUDES_DEG: [f64; 5] = [-5.0, 10.0, 30.0, 50.0, 70.0];

/// How bright the sky is.
#[derive(Debug, Args)]
pub struct SkyArgs {
    /// Brightness of the sky in the band [mag/arcsec2] [default: full and new Moon of the table by the Moon's age]
    #[arg(long, value_name = "MAG", conflicts_with_all = ["moon_phase_deg", "by_moon", "sun_alt_deg"], allow_hyphen_values = true)]
    sky_mag: Option<f64>,
    /// Phase angle of the Moon [deg], 0 = full; alone: the sky of the table by the Moon's age
    #[arg(long, value_name = "DEG", allow_hyphen_values = true)]
    moon_phase_deg: Option<f64>,
    /// Altitude of the Moon [deg]: the sky of Krisciunas & Schaefer 1991
    #[arg(long, value_name = "DEG", requires = "moon_phase_deg", allow_hyphen_values = true)]
    moon_alt_deg: Option<f64>,
    /// Distance of the Moon from the line of sight [deg] [default: 90, or the nearest possible value]
    #[arg(long, value_name = "DEG", requires = "moon_alt_deg", allow_hyphen_values = true)]
    moon_sep_deg: Option<f64>,
    /// Altitude of the line of sight [deg], for moonlight
    #[arg(long, value_name = "DEG", default_value_t = 90.0, allow_hyphen_values = true)]
    alt_deg: f64,
    /// Dark sky under the Moon [V mag/arcsec2], for moonlight
    #[arg(long, value_name = "MAG", default_value_t = DARK_V_MAG_ARCSEC2, allow_hyphen_values = true)]
    dark_sky_mag: f64,
    /// Extinction [mag/airmass], for moonlight
    #[arg(long, value_name = "K", default_value_t = K_V_MAG_AIRMASS, allow_hyphen_values = true)]
    k_mag_airmass: f64,
    /// Altitude of the Sun [deg], -5 or below: adds twilight (Patat et al. 2006, V at the zenith)
    #[arg(long, value_name = "DEG", allow_hyphen_values = true)]
    sun_alt_deg: Option<f64>,
    /// A table over phases and altitudes of the Moon (Krisciunas & Schaefer)
    #[arg(long, conflicts_with_all = ["moon_phase_deg"])]
    by_moon: bool,
}

/// One sky.
pub struct SkyCase {
    pub name: String,
    pub moon_phase_deg: Option<f64>,
    pub moon_alt_deg: Option<f64>,
    pub mag_arcsec2: f64,
}

impl SkyArgs {
    /// The skies that are requested.
    pub fn cases(&self, band: &str) -> anyhow::Result<Vec<SkyCase>> {
        self.check()?;
        if let Some(mag_arcsec2) = self.sky_mag {
            if !mag_arcsec2.is_finite() {
                return Err(bad("--sky-mag", format!("{mag_arcsec2} is not a number")));
            }
            return Ok(vec![SkyCase { name: "given".into(), moon_phase_deg: None, moon_alt_deg: None, mag_arcsec2 }]);
        }
        if self.by_moon {
            let grid = PHASES_DEG.iter().flat_map(|phase| ALTITUDES_DEG.iter().map(move |alt| (*phase, *alt)));
            return grid.map(|(phase, alt)| self.moonlit(band, phase, alt)).collect();
        }
        match (self.moon_phase_deg, self.moon_alt_deg) {
            (Some(phase), Some(alt)) => Ok(vec![self.moonlit(band, phase, alt)?]),
            (Some(phase), None) => Ok(vec![self.of_age(band, format!("Moon {phase} deg from full"), phase)?]),
            _ => Ok(vec![self.of_age(band, "full Moon".into(), 0.0)?, self.of_age(band, "new Moon".into(), 180.0)?]),
        }
    }

    /// What was computed how, in a line.
    pub fn source(&self) -> String {
        let twilight = self.sun_alt_deg.map_or(String::new(), |alt| {
            format!("; twilight of the zenith (Patat et al. 2006) with the Sun at {alt} deg")
        });
        let of = if self.sky_mag.is_some() {
            "given".to_owned()
        } else if self.by_moon || self.moon_alt_deg.is_some() {
            format!(
                "Krisciunas & Schaefer 1991, line of sight at {} deg, dark sky V {}, k {}; other bands by the colour of \
                 the table",
                self.alt_deg, self.dark_sky_mag, self.k_mag_airmass
            )
        } else {
            "table by the Moon's age (V Walker 1987; g, r DECam calculator 7; i from Walker's R, I)".to_owned()
        };
        of + &twilight
    }

    /// Whether a table over phases and altitudes is requested.
    pub fn is_grid(&self) -> bool {
        self.by_moon
    }

    /// What should be known of a sky that was computed.
    pub fn note(&self) -> Option<String> {
        let sep = self.moon_alt_deg.map(|alt| self.separation_deg(alt))?;
        (sep < LEAST_MOON_SEP_DEG)
            .then(|| format!("the Moon is {sep} deg away: nearer than 10 deg its light is not known well"))
    }

    fn check(&self) -> anyhow::Result<()> {
        let within =
            |key: &str, value: Option<f64>, low: f64, high: f64| match value.filter(|v| !(low..=high).contains(v)) {
                Some(v) => Err(bad(key, format!("{v} is outside {low} to {high}"))),
                None => Ok(()),
            };
        within("--moon-phase-deg", self.moon_phase_deg, -180.0, 180.0)?;
        within("--moon-alt-deg", self.moon_alt_deg, -90.0, 90.0)?;
        within("--moon-sep-deg", self.moon_sep_deg, 0.0, 180.0)?;
        within("--alt-deg", Some(self.alt_deg), 0.0, 90.0)?;
        within("--sun-alt-deg", self.sun_alt_deg, -90.0, 90.0)?;
        within("--dark-sky-mag", Some(self.dark_sky_mag), 10.0, 30.0)?;
        within("--k-mag-airmass", Some(self.k_mag_airmass), 0.0, 3.0)?;
        if let (Some(alt), Some(sep)) = (self.moon_alt_deg, self.moon_sep_deg) {
            let (near, far) = self.separations_deg(alt);
            if !(near - 0.01..=far + 0.01).contains(&sep) {
                let problem = format!(
                    "the Moon at {alt} deg is between {near} and {far} deg from a line of sight at {} deg, not {sep}",
                    self.alt_deg
                );
                return Err(bad("--moon-sep-deg", problem));
            }
        }
        Ok(())
    }

    /// How near and how far the Moon can be from the line of sight \[deg\].
    fn separations_deg(&self, moon_alt_deg: f64) -> (f64, f64) {
        ((self.alt_deg - moon_alt_deg).abs(), 180.0 - (self.alt_deg + moon_alt_deg).abs())
    }

    fn separation_deg(&self, moon_alt_deg: f64) -> f64 {
        let (near, far) = self.separations_deg(moon_alt_deg);
        self.moon_sep_deg.unwrap_or(90.0_f64.max(near).min(far))
    }

    /// The sky under a Moon that stands somewhere.
    fn moonlit(&self, band: &str, phase_deg: f64, moon_alt_deg: f64) -> anyhow::Result<SkyCase> {
        let moon = MoonInSky {
            alt_rad: moon_alt_deg.to_radians(),
            phase_rad: phase_deg.to_radians(),
            sep_rad: self.separation_deg(moon_alt_deg).to_radians(),
        };
        let v = moonlit_sky_v_mag_arcsec2(self.dark_sky_mag, self.k_mag_airmass, self.alt_deg.to_radians(), Some(moon));
        let name = if moon_alt_deg > 0.0 {
            format!("Moon {phase_deg} deg from full at {moon_alt_deg} deg")
        } else {
            format!("Moon {phase_deg} deg from full, set")
        };
        let mag_arcsec2 = self.with_twilight(band, sky_of_v(band, v)?)?;
        Ok(SkyCase { name, moon_phase_deg: Some(phase_deg), moon_alt_deg: Some(moon_alt_deg), mag_arcsec2 })
    }

    /// The sky of the Moon's age.
    fn of_age(&self, band: &str, name: String, phase_deg: f64) -> anyhow::Result<SkyCase> {
        let mag_arcsec2 = self.with_twilight(band, sky_at_moon_phase(band, phase_deg)?)?;
        Ok(SkyCase { name, moon_phase_deg: Some(phase_deg), moon_alt_deg: None, mag_arcsec2 })
    }

    fn with_twilight(&self, band: &str, mag_arcsec2: f64) -> anyhow::Result<f64> {
        let Some(sun_alt_deg) = self.sun_alt_deg else { return Ok(mag_arcsec2) };
        if band != "V" {
            let problem = format!("twilight is known in V only, not in {band}; give --sky-mag");
            return Err(bad("--sun-alt-deg", problem));
        }
        let nl = twilight_nl(sun_alt_deg.to_radians())
            .map_err(|error| bad("--sun-alt-deg", error.to_string().trim_start_matches("model: ").to_owned()))?;
        Ok(v_mag_arcsec2_of_nl(nl_of_v_mag_arcsec2(mag_arcsec2) + nl))
    }
}
