//! A plate before an observer: one point, or, where it is large against its range, many.
//!
//! Positions in km, areas in m². A divided plate is a square with one side horizontal; the light is integrated over it
//! by Gauss rules of rising order until two agree. The shadow's edge across a plate and one plate's shadow on another
//! are excluded.

use std::sync::{Arc, OnceLock};

use super::brdf::Brdf;
use super::earthshine::{LawBound, PreparedBrdf};
use super::flux_sum::FluxSum;
use super::flux_sum::unit;
use super::scene::{Scene, impossible};
use super::surface::Surface;
use crate::base::error::Result;
use crate::base::quadrature::gauss;
use crate::base::vector::{Itrs, Vector};
use crate::config::PlatformSize;

/// sqrt(area)/range above which a plate is not a point.
pub const POINT_MAX: f64 = 1e-3;
/// Relative change between two orders at which a divided plate is done: four points where it changes nothing, which
/// leaves 1e-8 (`satphot accuracy platform`).
pub const STABLE_TO: f64 = 1e-4;
/// Cosine below which a plate is seen edge-on: what is left there is rounding.
const EDGE_ON: f64 = 1e-12;
/// Orders of the Gauss rule along a side.
const ORDERS: [usize; 8] = [2, 3, 4, 6, 8, 12, 18, 27];

/// A surface as the model keeps it.
#[derive(Debug)]
pub(super) struct Prepared {
    pub name: Arc<str>,
    pub surface: Surface,
    front: PreparedBrdf,
    back: Option<PreparedBrdf>,
    /// Bounds of front and back, which few scenes need.
    bounds: [OnceLock<LawBound>; 2],
}

impl Prepared {
    pub fn new(surface: Surface) -> Self {
        let front = PreparedBrdf::new(&surface.brdf);
        let back = surface.back.as_ref().map(PreparedBrdf::new);
        Self { name: surface.name.as_str().into(), surface, front, back, bounds: Default::default() }
    }
}

/// A surface in a scene.
pub(super) struct SurfaceElement<'a> {
    prepared: &'a Prepared,
    front: Vector<Itrs>,
    observer_km: Vector<Itrs>,
    /// From its middle.
    pub centre: View,
    /// Half a side along and across, where it is divided \[km\].
    halves_km: Option<[Vector<Itrs>; 2]>,
}

/// The observer seen from one place on a plate.
pub(super) struct View {
    pub place_km: Vector<Itrs>,
    /// To the observer, unit.
    pub observer: Vector<Itrs>,
    range_m: f64,
    /// Of the front's normal; negative shows the back.
    pub cos_observer: f64,
}

/// The side a view sees.
pub(super) struct Side<'a> {
    pub normal: Vector<Itrs>,
    pub brdf: &'a Brdf,
    /// The same for light from the ground.
    pub from_ground: &'a PreparedBrdf,
    bound: &'a OnceLock<LawBound>,
    /// A (n·o)/d².
    pub spread: f64,
}

impl Side<'_> {
    /// What its law gives at most; computed once.
    pub fn bound(&self) -> &LawBound {
        self.bound.get_or_init(|| LawBound::of(self.brdf))
    }
}

impl<'a> SurfaceElement<'a> {
    pub fn new(scene: &Scene, prepared: &'a Prepared, size: PlatformSize) -> Result<Self> {
        let surface = &prepared.surface;
        let front = surface.normal(scene).ok_or_else(|| {
            impossible(format!("{}: its attitude {:?} has no direction here", surface.name, surface.attitude))
        })?;
        let centre = View::new(scene.satellite_km, scene.observer_km, &front)?;
        let side_km = surface.area_m2.sqrt() / 1e3;
        let divided = size == PlatformSize::Subdivided && side_km > POINT_MAX * scene.range_km();
        let halves_km = if divided {
            let level = scene.satellite_km.cross(&front);
            // a level plate has no horizontal side of its own: along the velocity
            let along = if level.norm() > 1e-6 * scene.satellite_km.norm() {
                level.unit()
            } else {
                (scene.velocity_km_s - front * front.dot(&scene.velocity_km_s)).unit()
            };
            let along = along.or_else(|| front.any_perpendicular());
            along.map(|a| [a * (0.5 * side_km), front.cross(&a) * (0.5 * side_km)])
        } else {
            None
        };
        Ok(Self { prepared, front, observer_km: scene.observer_km, centre, halves_km })
    }

    pub fn name(&self) -> &Arc<str> {
        &self.prepared.name
    }

    pub fn area_m2(&self) -> f64 {
        self.prepared.surface.area_m2
    }

    pub fn is_divided(&self) -> bool {
        self.halves_km.is_some()
    }

    /// The observer sees a side that scatters.
    pub fn shows_a_side(&self) -> bool {
        self.side(&self.centre).is_some() || self.is_divided()
    }

    /// The side a view sees; `None` edge-on and for a black back.
    pub fn side(&self, view: &View) -> Option<Side<'a>> {
        let spread = self.area_m2() * view.cos_observer.abs() / (view.range_m * view.range_m);
        if view.cos_observer > EDGE_ON {
            let Prepared { surface, front, bounds: [bound, _], .. } = self.prepared;
            Some(Side { normal: self.front, brdf: &surface.brdf, from_ground: front, bound, spread })
        } else if view.cos_observer < -EDGE_ON {
            let (brdf, from_ground) = (self.prepared.surface.back.as_ref()?, self.prepared.back.as_ref()?);
            Some(Side { normal: -self.front, brdf, from_ground, bound: &self.prepared.bounds[1], spread })
        } else {
            None
        }
    }

    /// The side a view sees, or the front with the spread 0 it has from behind.
    pub fn any_side(&self, view: &View) -> Side<'a> {
        self.side(view).unwrap_or_else(|| {
            let Prepared { surface, front, bounds: [bound, _], .. } = self.prepared;
            let spread = self.area_m2() * view.cos_observer.max(0.0) / (view.range_m * view.range_m);
            Side { normal: self.front, brdf: &surface.brdf, from_ground: front, bound, spread }
        })
    }

    /// Mean of a flux over the plate: at its middle, or to [`STABLE_TO`] over its face.
    ///
    /// The error of a divided plate includes the change between the last two orders.
    pub fn integrate(&self, flux: impl Fn(&View) -> FluxSum) -> FluxSum {
        let Some([along, across]) = &self.halves_km else { return flux(&self.centre) };
        let mut before = flux(&self.centre);
        for order in ORDERS {
            let (nodes, weights) = gauss(order);
            let mut mean = FluxSum::default();
            for (u, weight_u) in nodes.iter().zip(weights) {
                for (v, weight_v) in nodes.iter().zip(weights) {
                    let place = self.centre.place_km + *along * (2.0 * u - 1.0) + *across * (2.0 * v - 1.0);
                    let Ok(view) = View::new(place, self.observer_km, &self.front) else { continue };
                    mean.add(&flux(&view), weight_u * weight_v);
                }
            }
            let change = (mean.flux - before.flux).abs();
            let (quadratures, nodes) = (before.quadratures + mean.quadratures, before.nodes + mean.nodes);
            let stable = change <= STABLE_TO * mean.flux;
            before = FluxSum { flux: mean.flux, err: mean.err + change, quadratures, nodes, ..FluxSum::default() };
            if stable {
                break;
            }
        }
        before
    }
}

impl View {
    fn new(place_km: Vector<Itrs>, observer_km: Vector<Itrs>, front: &Vector<Itrs>) -> Result<Self> {
        let to_observer = observer_km - place_km;
        let observer = unit(to_observer, "observer")?;
        Ok(Self { place_km, observer, range_m: to_observer.norm() * 1e3, cos_observer: front.dot(&observer) })
    }
}
