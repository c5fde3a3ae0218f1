//! Test points: what a named place on a satellite sends to the observer, and whether the observer sees it.
//!
//! W m⁻² sr⁻¹; places in metres in the body frame, joints at angle 0. All directions are sampled, not a pixel's share.

use super::directions::SETS;
use super::image::Light;
use super::render::{RayCounts, Renderer};
use super::satellite::TestPoint;
use super::surface::beyond_m;
use super::triangle::Body;
use crate::base::error::{Error, Result};
use crate::base::vector::{Itrs, Vector};

/// How far a place may lie beyond its component, as a length and as a share of its size: places are read off drawings.
const TOLERANCE_M: f64 = 0.05;
const TOLERANCE_FRAC: f64 = 0.01;

/// A test point seen from the observer.
#[derive(Debug, Clone, PartialEq)]
pub struct PointLight {
    /// Its name.
    pub name: String,
    /// The component it is on.
    pub component: String,
    /// `seen`, `hidden` behind another part (the radiance is that it would show), or `faces away` (it shows none).
    pub view: &'static str,
    /// Radiance towards the observer by light, in the order of [`Light::ALL`] \[W m⁻² sr⁻¹\].
    pub radiance: [f64; 5],
    /// Cosine between its normal and nadir: 1 for a face that looks straight down.
    pub cos_nadir: f64,
}

impl PointLight {
    /// Sum of some lights \[W m⁻² sr⁻¹\].
    #[must_use]
    pub fn of(&self, lights: &[Light]) -> f64 {
        Light::ALL.iter().zip(self.radiance).filter(|(l, _)| lights.contains(l)).map(|(_, r)| r).sum()
    }
}

/// A test point from the command line: `component` or `component@x,y,z` \[m\].
///
/// # Errors
/// [`Error::Config`] for places that are not three numbers.
pub fn parse_point(text: &str) -> Result<TestPoint> {
    let (component, place) = text.split_once('@').unwrap_or((text, ""));
    let numbers: std::result::Result<Vec<f64>, _> =
        place.split(',').filter(|p| !p.is_empty()).map(|p| p.trim().parse::<f64>()).collect();
    let at_m = match numbers.as_deref() {
        Ok([]) => None,
        Ok([x, y, z]) if x.is_finite() && y.is_finite() && z.is_finite() => Some([*x, *y, *z]),
        _ => {
            let problem = format!("\"{text}\": expected component or component@x,y,z in metres");
            return Err(Error::Config { key: "point".into(), problem });
        }
    };
    Ok(TestPoint { component: component.trim().to_owned(), at_m, normal: None })
}

impl Renderer {
    /// The light of a test point.
    ///
    /// Of the component's triangles the one is taken whose side looks most nearly along the point's normal (without one:
    /// towards the observer) and, of equals, that is nearest to the place (without one: any).
    ///
    /// # Errors
    /// [`Error::Config`] for a component the satellite does not have, with those it has, and for a place outside it.
    pub fn point(&self, name: &str, point: &TestPoint) -> Result<PointLight> {
        let body = &self.body;
        let wanted = point.component.to_lowercase();
        let component = body.names.iter().position(|n| n.to_lowercase() == wanted).ok_or_else(|| Error::Config {
            key: format!("point {name}"),
            problem: format!("no component \"{}\"; it has: {}", point.component, body.names.join(", ")),
        })?;
        let vector = |[x, y, z]: [f64; 3]| Vector::<Body>::new(x, y, z);
        let toward = match point.normal {
            Some(n) => body.direction(component, &vector(n)),
            None => self.around.observer,
        };
        let near = point.at_m.map(|at| body.place(component, &vector(at)));
        if let (Some(place), Some(at)) = (&near, point.at_m) {
            self.refuse_outside(component, place, at)
                .map_err(|problem| Error::Config { key: format!("point {name}"), problem })?;
        }
        let mut best: Option<(f64, f64, usize, usize)> = None;
        for (k, face) in body.faces.iter().enumerate().filter(|(_, p)| p.component == component) {
            let normal = body.facets[face.facet].normal;
            let sides: &[usize] = if face.sheet { &[0, 1] } else { &[0] };
            for side in sides {
                let along = (if *side == 0 { normal } else { -normal }).dot(&toward);
                let [a, b, c] = &face.corners;
                let middle = (*a + *b + *c) * (1.0 / 3.0);
                let far = near.map_or(0.0, |p| (p - middle).norm());
                // directions first, to a tenth of a degree
                let better =
                    best.is_none_or(|(most, least, ..)| along > most + 1e-6 || (along > most - 1e-6 && far < least));
                if better {
                    best = Some((along, far, k, *side));
                }
            }
        }
        let (.., k, side) = best.ok_or_else(|| Error::Config {
            key: format!("point {name}"),
            problem: format!("component \"{}\" has no surface", point.component),
        })?;
        let face = &body.faces[k];
        let front = body.facets[face.facet].normal;
        let normal = if side == 0 { front } else { -front };
        let [a, b, c] = &face.corners;
        let middle = (*a + *b + *c) * (1.0 / 3.0);
        // into the plane of the triangle
        let place = near.map_or(middle, |p| p - normal * (p - middle).dot(&normal));
        let observer = self.around.observer;
        let view = if !(normal.dot(&observer) > 0.0) {
            "faces away"
        } else if body.shaded(&place, &normal, &observer) {
            "hidden"
        } else {
            "seen"
        };
        let sets: Vec<usize> = (0..SETS).collect();
        let faces = normal.dot(&observer) > 0.0;
        let radiance = if faces { self.light(k, &place, &sets, &mut RayCounts::default()) } else { [0.0; 5] };
        let component = body.names[component].clone();
        Ok(PointLight { name: name.to_owned(), component, view, radiance, cos_nadir: normal.dot(&self.around.nadir()) })
    }

    /// A place that lies beyond the surface of its component by more than rounding of what is written down.
    fn refuse_outside(&self, component: usize, place: &Vector<Itrs>, at: [f64; 3]) -> std::result::Result<(), String> {
        let body = &self.body;
        let triangles: Vec<_> = body.faces.iter().filter(|p| p.component == component).map(|p| p.corners).collect();
        let ends = body.extents_m[component];
        let size = ends.iter().map(|[low, high]| (high - low).powi(2)).sum::<f64>().sqrt();
        let beyond = beyond_m(&triangles, place);
        if beyond <= TOLERANCE_M.max(TOLERANCE_FRAC * size) {
            return Ok(());
        }
        let axis = |k: usize| format!("{} {:.2} to {:.2}", ["x", "y", "z"][k], ends[k][0], ends[k][1]);
        Err(format!(
            "{at:?} lies {beyond:.2} m beyond {}, which reaches over {}, {}, {} m (joints at angle 0)",
            body.names[component],
            axis(0),
            axis(1),
            axis(2)
        ))
    }
}
