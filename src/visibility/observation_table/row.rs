//! One row of a table of observations: computed by its elements or as a geometry, compared, or with the reason why not.

use super::job::Job;
use super::number::Number;
use super::request::Places;
use super::satellites::Which;
use super::stated::identify;
use super::{checks, magnitudes};
use crate::base::error::Error;
use crate::base::vector::{Itrs, Vector};
use crate::brightness::columns::fill_model;
use crate::brightness::scene::{Scene, source_alt_rad};
use crate::brightness::settings::PUBLISHED_EARTH_RADIUS_KM;
use crate::brightness::sky::{Body, Sky, parallel_light};
use crate::orbit::propagate::DECAYED_BELOW_KM;
use crate::orbit::{EarthOrientation, bodies, moon_altaz, sun_altaz};
use crate::tables::PhotometryRow;
use crate::tables::read::Row;
use crate::tables::words::{Status, Verdict};
use crate::visibility::forecast::predicted;

/// Highest orbit \[km\].
const HIGHEST_KM: f64 = 200_000.0;

impl Job<'_> {
    /// The row of a table: its numbers, or why it has none.
    pub fn row(&self, row: &Row, fit: &std::result::Result<(), String>, which: &Which) -> PhotometryRow {
        let mut reasons = Vec::new();
        let computed = fit.clone().and_then(|()| match self.places {
            Places::Orbit => self.by_orbit(row, which, &mut reasons),
            Places::Geometry => self.by_geometry(row, &mut reasons),
        });
        let mut made = match computed {
            Ok(made) => PhotometryRow { status: Status::Ok.into(), verdict: Verdict::Use.into(), ..made },
            Err(reason) => PhotometryRow {
                status: Status::Failed.into(),
                verdict: Verdict::Reject.into(),
                reason,
                ..PhotometryRow::default()
            },
        };
        if made.status == Status::Ok {
            made.reason = reasons.join("; ");
            if self.request.magnitudes.is_some() && checks::is_contradicted(&made) {
                (made.status, made.verdict) = (Status::Rejected.into(), Verdict::Reject.into());
            }
        }
        magnitudes::compare(self.request, self.columns, row, &mut made);
        made
    }

    fn by_orbit(
        &self,
        row: &Row,
        which: &Which,
        reasons: &mut Vec<String>,
    ) -> std::result::Result<PhotometryRow, String> {
        let (epoch, tracker, site) = self.place(row, which)?;
        let made = predicted(tracker, &site, &self.models.by_orbit, &epoch).map_err(|e| e.to_string())?;
        reasons.extend(checks::contradictions(self, row, tracker, &made));
        reasons.extend(tracker.age_warning(&epoch));
        Ok(made)
    }

    /// A row of altitudes and azimuths, as a map of the sky has its directions: observer and orbits on concentric spheres.
    fn by_geometry(&self, row: &Row, reasons: &mut Vec<String>) -> std::result::Result<PhotometryRow, String> {
        let pair = |key: &str, of: Option<[Number; 2]>| {
            let [alt, az] = of.ok_or_else(|| format!("no column of {key}"))?;
            let (alt, az) = (alt.needed(row, self.table)?, az.needed(row, self.table)?);
            if !(-90.0..=90.0).contains(&alt) || !(-360.0..=360.0).contains(&az) {
                return Err(format!("{key}: altitude {alt}, azimuth {az} deg; accepted are -90 to 90 and -360 to 360"));
            }
            Ok((alt, az))
        };
        let (alt, az) = pair("the satellite", self.columns.alt_az_deg)?;
        if alt < 0.0 {
            return Err(format!("the satellite is below the horizon, at altitude {alt} deg"));
        }
        let radius_km = PUBLISHED_EARTH_RADIUS_KM;
        let height_km = match (self.columns.height_km, self.columns.range_km) {
            (Some(height), _) => height.needed(row, self.table)?,
            (None, Some(range)) => {
                // r² = R² + d² + 2 R d sin a
                let d = range.needed(row, self.table)?;
                (radius_km * radius_km + d * d + 2.0 * radius_km * d * alt.to_radians().sin()).sqrt() - radius_km
            }
            (None, None) => return Err("no height".into()),
        };
        if !(DECAYED_BELOW_KM..=HIGHEST_KM).contains(&height_km) {
            let metres = height_km / 1e3;
            let hint = if (DECAYED_BELOW_KM..=HIGHEST_KM).contains(&metres) { "; is it in m?" } else { "" };
            return Err(format!(
                "the height is {height_km} km; accepted is {DECAYED_BELOW_KM} to {HIGHEST_KM} km{hint}"
            ));
        }
        let far = |body: Body| if parallel_light(&self.request.settings.effects) { body.at_infinity() } else { body };
        let rad = |az_deg: f64| az_deg.to_radians().rem_euclid(std::f64::consts::TAU);
        let (sun, moon) = match self.columns.sun_alt_az_deg {
            None => self.sun_and_moon(row).map(|(sun, moon)| (sun, Some(moon)))?,
            Some(sun) => {
                let (alt, az) = pair("the Sun", Some(sun))?;
                let moon = match self.columns.moon_alt_az_deg {
                    Some([alt, az]) if alt.of(row).is_some() || az.of(row).is_some() => {
                        Some(pair("the Moon", Some([alt, az]))?)
                    }
                    _ => None,
                };
                let moon = moon.map(|(alt, az)| Body::moon(alt.to_radians(), rad(az)));
                (Body::sun(alt.to_radians(), rad(az)), moon)
            }
        };
        let axes = [Vector::new(0.0, 1.0, 0.0), Vector::new(0.0, 0.0, 1.0), Vector::new(1.0, 0.0, 0.0)];
        let words = |e: Error| e.to_string();
        let moving_rad = self.request.track_az_rad;
        let sky = Sky::new(axes, (radius_km, height_km), moving_rad, far(sun), moon.map(far)).map_err(words)?;
        let scene = sky.scene(alt.to_radians(), (az % 360.0).to_radians());
        let [moonless, moonlit] = self.models.geometry.as_ref().ok_or("no model of a geometry")?;
        let model = if moon.is_some() { moonlit } else { moonless };
        let answer = model.brightness(&scene).map_err(words)?;
        let mut made = PhotometryRow {
            range_km: Some(scene.range_km()),
            phase_angle_deg: Some(phase_angle_deg(&scene)),
            sun_alt_sat_deg: Some(source_alt_rad(&scene.satellite_km, &scene.sun_km).to_degrees()),
            ..PhotometryRow::default()
        };
        identify(&mut made, self.columns, row);
        reasons.extend(checks::other_phase(self, row, &made, "by the directions"));
        fill_model(&mut made, &answer, true);
        made.mu_mean_mag_arcsec2 = answer.mu_mean_mag_arcsec2;
        Ok(made)
    }
}

impl Job<'_> {
    /// Sun and Moon over the site of a row at its time.
    fn sun_and_moon(&self, row: &Row) -> std::result::Result<(Body, Body), String> {
        let epoch = self.columns.time.as_ref().ok_or("no column of times")?.of(row)?;
        let site = self.site(row)?;
        let eop = self.request.orbit.map(EarthOrientation::from_config).unwrap_or_default();
        let of = bodies(&epoch, &eop).map_err(|e| e.to_string())?;
        let body = |(alt_rad, az_rad): (f64, f64), place_km: &Vector<Itrs>| Body {
            alt_rad,
            az_rad,
            distance_km: (*place_km - site.position()).norm(),
        };
        let sun = body(sun_altaz(&site, &of), &of.sun_itrs_km);
        Ok((sun, body(moon_altaz(&site, &of), &of.moon_itrs_km)))
    }
}

/// Angle Sun-satellite-observer \[deg\].
fn phase_angle_deg(scene: &Scene) -> f64 {
    let from = |place: Vector<Itrs>| place - scene.satellite_km;
    from(scene.sun_km).angle_to(&from(scene.observer_km)).to_degrees()
}
