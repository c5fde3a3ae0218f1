//! Entries by their place: which lie near a point, which are the same star twice, which could be taken for each other.
//!
//! Degrees; separations in arcsec where the name says so. A tree of directions, so that poles and 0 h need no care.

use super::tree::Tree;
use super::tree::direction;
use rstar::RTree;
use rstar::primitives::GeomWithData;

use super::star::Catalogue;
use super::star::CatalogueStar;

/// Entries this close are looked at as one star \[arcsec\]; APASS places are good to about 0.2.
const SAME_PLACE_ARCSEC: f64 = 1.0;
/// Magnitudes of the same star may differ by this, or by three of their errors \[mag\].
const SAME_MAG: f64 = 0.1;
/// An entry this much fainter than another is never taken for it \[mag\].
const CONFUSED_MAG: f64 = 3.0;

impl Tree {
    pub(super) fn of(stars: &[CatalogueStar]) -> Tree {
        let places = stars.iter().enumerate();
        Tree(RTree::bulk_load(places.map(|(i, s)| GeomWithData::new(direction(s.ra_deg, s.dec_deg), i)).collect()))
    }

    /// Entries within `radius_deg` of a point, in no order.
    pub(super) fn within(&self, ra_deg: f64, dec_deg: f64, radius_deg: f64) -> impl Iterator<Item = usize> {
        // chord² = 4 sin²(r/2); 1e-15 is the rounding of unit vectors
        let chord = 2.0 * (radius_deg.clamp(0.0, 180.0).to_radians() / 2.0).sin();
        let found = self.0.locate_within_distance(direction(ra_deg, dec_deg), chord * chord + 1e-15);
        found.map(|place| place.data)
    }
}

/// Angle between two points \[deg\], hav d = hav Δδ + cos δ₁ cos δ₂ hav Δα.
#[must_use]
pub fn separation_deg(ra1_deg: f64, dec1_deg: f64, ra2_deg: f64, dec2_deg: f64) -> f64 {
    let hav = |deg: f64| (deg.to_radians() / 2.0).sin().powi(2);
    let cos = dec1_deg.to_radians().cos() * dec2_deg.to_radians().cos();
    let h = hav(dec2_deg - dec1_deg) + cos * hav(ra2_deg - ra1_deg);
    (2.0 * h.sqrt().min(1.0).asin()).to_degrees()
}

fn between_arcsec(a: &CatalogueStar, b: &CatalogueStar) -> f64 {
    3600.0 * separation_deg(a.ra_deg, a.dec_deg, b.ra_deg, b.dec_deg)
}

/// Drops entries of a star that has another at the same place (1 arcsec) with the same magnitude (0.1 mag, or three
/// times their errors); the entry that knows most stays and takes from the others what it lacks. Returns how many were
/// dropped.
pub(super) fn drop_duplicates(stars: &mut Vec<CatalogueStar>) -> usize {
    let tree = Tree::of(stars);
    let same = |a: &CatalogueStar, b: &CatalogueStar| {
        let err = a.v_err_mag.unwrap_or(0.0).hypot(b.v_err_mag.unwrap_or(0.0));
        (a.v_mag - b.v_mag).abs() <= SAME_MAG.max(3.0 * err) && between_arcsec(a, b) <= SAME_PLACE_ARCSEC
    };
    let known = |s: &CatalogueStar| {
        let n = [s.b_v_mag, s.v_err_mag, s.b_v_err_mag, s.pm_ra_mas_yr].iter().flatten().count();
        (n, s.n_obs.unwrap_or(0))
    };
    let mut dropped = vec![false; stars.len()];
    for i in 0..stars.len() {
        if dropped[i] {
            continue;
        }
        let mut group: Vec<usize> = tree
            .within(stars[i].ra_deg, stars[i].dec_deg, SAME_PLACE_ARCSEC / 3600.0)
            .filter(|j| !dropped[*j] && (*j == i || same(&stars[i], &stars[*j])))
            .collect();
        if group.len() < 2 {
            continue;
        }
        // the one that knows most first; of equals the first of the file
        group.sort_by(|a, b| known(&stars[*b]).cmp(&known(&stars[*a])).then(a.cmp(b)));
        let mut best = stars[group[0]].clone();
        for j in &group[1..] {
            let other = &stars[*j];
            if best.b_v_mag.is_none() {
                (best.b_v_mag, best.b_v_err_mag) = (other.b_v_mag, other.b_v_err_mag);
            }
            best.v_err_mag = best.v_err_mag.or(other.v_err_mag);
            dropped[*j] = true;
        }
        stars[group[0]] = best;
    }
    let mut keep = dropped.iter().map(|d| !d);
    stars.retain(|_| keep.next().unwrap_or(true));
    dropped.iter().filter(|d| **d).count()
}

impl Catalogue {
    /// Marks the stars that a detection within `radius_arcsec` may be taken for although it is another one: those with
    /// a neighbour in that radius which is not fainter by more than 3 mag. Also fills `neighbour_arcsec`.
    ///
    /// Marks of an earlier call are forgotten. Entries that were skipped (without V) are not known here.
    pub fn mark_ambiguous(&mut self, radius_arcsec: f64) {
        let tree = Tree::of(&self.stars);
        let marks: Vec<(bool, Option<f64>)> = (0..self.stars.len())
            .map(|i| {
                let star = &self.stars[i];
                let (mut ambiguous, mut nearest) = (false, None::<f64>);
                for j in tree.within(star.ra_deg, star.dec_deg, radius_arcsec / 3600.0).filter(|j| *j != i) {
                    let other = &self.stars[j];
                    let apart = between_arcsec(star, other);
                    if apart <= radius_arcsec {
                        ambiguous |= other.v_mag <= star.v_mag + CONFUSED_MAG;
                        nearest = Some(nearest.map_or(apart, |n| n.min(apart)));
                    }
                }
                (ambiguous, nearest)
            })
            .collect();
        for (star, (ambiguous, nearest)) in self.stars.iter_mut().zip(marks) {
            (star.ambiguous, star.neighbour_arcsec) = (ambiguous, nearest);
        }
    }

    /// The catalogue with every star that has a proper motion at its place in `jyear`: [`CatalogueStar::moved_to`].
    #[must_use]
    pub fn moved_to(&self, jyear: f64, epoch_jyear: f64) -> Catalogue {
        let stars = self.stars.iter().map(|star| star.moved_to(jyear, epoch_jyear)).collect();
        Catalogue { stars, tree: std::sync::OnceLock::new(), ..self.clone() }
    }

    /// Whether any star has a proper motion.
    #[must_use]
    pub fn has_motions(&self) -> bool {
        self.stars.iter().any(|s| s.pm_ra_mas_yr.is_some() && s.pm_dec_mas_yr.is_some())
    }
}
