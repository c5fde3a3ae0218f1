//! `satphot limits simple`: the paper's panel of one albedo under one light source, as published and corrected.

use clap::Args;
use satphot::brightness::light_sources::FULL_MOON_V_MAG;
use satphot::config::Mode;
use satphot::report::summary::text_table;
use satphot::visibility::published_streaks::nadir_panel_mag;
use satphot::visibility::simple::{
    Panel, SimpleEffects, angle_arcsec, diameter_m, effective_solid_angle_arcsec2, invariant_surface_brightness,
    magnitude, solid_angle_arcsec2, summed_solid_angle_arcsec2, surface_brightness,
};

use super::super::orbit_args::bad;
use super::super::print;
use super::{positive, within};

const AFTER_HELP: &str = "\
A flat Lambert panel faces nadir over the observer. As published, moonlight falls on it with
cos(incidence) = sin(Moon's altitude), which is that of a panel facing up; corrected, a Moon
above the satellite's horizon shines on the back of the panel, and what lights its front is
moonlight from the Earth (Lunar-Earthshine), computed with the whole model and shown next to it.

Without --mag the surface brightness is that of the computed magnitude; with it, of the one
stated.

Examples:
  satphot limits simple --area-m2 4250.25 --range-km 400 --mag 12.02
  satphot limits simple --area-m2 253 --range-km 520 --albedo 0.6 --moon-alt-deg 60";

/// The paper's simple model: total, mean and peak surface brightness of a diffuse panel by moonlight.
#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub struct Simple {
    /// Area of the panel [m2]
    #[arg(long, value_name = "M2", default_value_t = 4250.25, allow_hyphen_values = true)]
    area_m2: f64,
    /// Distance; in the zenith the height of the orbit [km]
    #[arg(long, value_name = "KM", default_value_t = 400.0, allow_hyphen_values = true)]
    range_km: f64,
    /// Lambert reflectance
    #[arg(long, value_name = "RHO", default_value_t = 0.3, allow_hyphen_values = true)]
    albedo: f64,
    /// Altitude of the Moon above the satellite's horizontal [deg]
    #[arg(long, value_name = "DEG", default_value_t = 45.0, allow_hyphen_values = true)]
    moon_alt_deg: f64,
    /// Angle between the panel's normal and the observer [deg]
    #[arg(long, value_name = "DEG", default_value_t = 0.0, allow_hyphen_values = true)]
    emission_deg: f64,
    /// V of the Moon; the default is the full Moon's
    #[arg(long, value_name = "MAG", default_value_t = FULL_MOON_V_MAG, allow_hyphen_values = true)]
    moon_mag: f64,
    /// Magnitude of the satellite instead of the computed one, for its surface brightness
    #[arg(long, value_name = "MAG", allow_hyphen_values = true)]
    mag: Option<f64>,
    /// Seeing, FWHM [arcsec]
    #[arg(long, value_name = "ARCSEC", default_value_t = 1.5, allow_hyphen_values = true)]
    fwhm_arcsec: f64,
    /// Print comma-separated values instead of a table
    #[arg(long)]
    csv: bool,
}

/// One quantity in both readings.
struct Line {
    name: &'static str,
    unit: &'static str,
    values: [Option<f64>; 2],
    why: &'static str,
}

impl Simple {
    pub fn execute(self) -> anyhow::Result<()> {
        for (key, value) in
            [("--area-m2", self.area_m2), ("--range-km", self.range_km), ("--fwhm-arcsec", self.fwhm_arcsec)]
        {
            positive(key, Some(value))?;
        }
        for (key, value, low, high) in [
            ("--moon-alt-deg", self.moon_alt_deg, -90.0, 90.0),
            ("--emission-deg", self.emission_deg, 0.0, 90.0),
            ("--moon-mag", self.moon_mag, -40.0, 60.0),
            ("--mag", self.mag.unwrap_or(0.0), -40.0, 60.0),
        ] {
            within(key, Some(value), low, high)?;
        }
        if !(self.albedo > 0.0 && self.albedo <= 1.0) {
            let problem =
                format!("{} is not above 0 and at most 1: a panel sends out no more than it gets", self.albedo);
            return Err(bad("--albedo", problem));
        }
        let lines = self.lines()?;
        if self.csv {
            let number = |v: Option<f64>| v.map_or(String::new(), |v| format!("{v}"));
            print("quantity,unit,published,corrected\n");
            for l in &lines {
                print(&format!("{},{},{},{}\n", l.name, l.unit, number(l.values[0]), number(l.values[1])));
            }
            return Ok(());
        }
        let cell = |v: Option<f64>| {
            v.map_or(
                "-".to_owned(),
                |v| if v != 0.0 && v.abs() < 1e-3 { format!("{v:.4e}") } else { format!("{v:.4}") },
            )
        };
        let rows: Vec<Vec<String>> = lines
            .iter()
            .map(|l| vec![l.name.into(), cell(l.values[0]), cell(l.values[1]), l.unit.into(), l.why.into()])
            .collect();
        print(&text_table(&["quantity", "published", "corrected", "unit", "why they differ"], &rows));
        Ok(())
    }

    fn lines(&self) -> anyhow::Result<Vec<Line>> {
        let panel = Panel {
            albedo: self.albedo,
            area_m2: self.area_m2,
            range_m: 1e3 * self.range_km,
            source_alt_rad: self.moon_alt_deg.to_radians(),
            emission_rad: self.emission_deg.to_radians(),
        };
        let both = [Mode::AsPublished, Mode::Corrected].map(SimpleEffects::of);
        let each = |f: &dyn Fn(&SimpleEffects) -> satphot::Result<f64>| -> satphot::Result<[Option<f64>; 2]> {
            Ok([Some(f(&both[0])?), Some(f(&both[1])?)])
        };
        let ratio = each(&|e| panel.flux_ratio(e))?;
        let direct = ratio.map(|r| magnitude(r?, self.moon_mag));
        let earthshine = nadir_panel_mag(&panel, self.moon_mag)?;
        let diameter = each(&|e| diameter_m(self.area_m2, e.diameter))?;
        let theta = each(&|e| angle_arcsec(diameter_m(self.area_m2, e.diameter)?, panel.range_m))?;
        let omega = each(&|e| solid_angle_arcsec2(self.area_m2, panel.range_m, e.diameter))?;
        let mag = self.mag.map_or([direct[0], direct[1].or(earthshine)], |m| [Some(m); 2]);
        let mean = [0, 1].map(|k| Some(surface_brightness(mag[k]?, omega[k]?)));
        let peak = |f: &dyn Fn(f64) -> satphot::Result<f64>| -> satphot::Result<[Option<f64>; 2]> {
            let one = |k: usize| -> satphot::Result<Option<f64>> {
                let (Some(m), Some(omega)) = (mag[k], omega[k]) else { return Ok(None) };
                Ok(Some(surface_brightness(m, f(omega)?)))
            };
            Ok([one(0)?, one(1)?])
        };
        let exact = peak(&|omega| effective_solid_angle_arcsec2(omega, self.fwhm_arcsec))?;
        let summed = peak(&|omega| summed_solid_angle_arcsec2(omega, self.fwhm_arcsec))?;
        let invariant =
            both.map(|e| invariant_surface_brightness(self.moon_mag, self.albedo, panel.cos_incidence(e.light)));
        let line = |name, unit, values, why| Line { name, unit, values, why };
        Ok(vec![
            line(
                "cos incidence",
                "",
                both.map(|e| Some(panel.cos_incidence(e.light))),
                "a Moon above lights the panel's back",
            ),
            line("F_obs/F_Moon", "", ratio, "area times one cosine of the observer, not two"),
            line("m by direct moonlight", "V mag", direct, ""),
            line(
                "m by Lunar-Earthshine",
                "V mag",
                [None, earthshine],
                "what lights a panel facing nadir; omitted in print",
            ),
            line("m used below", "V mag", mag, if self.mag.is_some() { "stated" } else { "" }),
            line("equivalent diameter", "m", diameter, "A = pi/4 D as printed, D squared is meant"),
            line("angular diameter", "arcsec", theta, ""),
            line("solid angle", "arcsec2", omega, ""),
            line("mean mu", "V mag/arcsec2", mean, ""),
            line("peak mu behind the seeing", "V mag/arcsec2", exact, "disc folded with a Gaussian, exact"),
            line(
                "peak mu, sum of areas",
                "V mag/arcsec2",
                summed,
                "Omega + pi FWHM2/(4 ln 2): up to 0.28 mag too faint",
            ),
            line("mu without area and distance", "V mag/arcsec2", invariant, "closed form, direct moonlight, resolved"),
        ])
    }
}
