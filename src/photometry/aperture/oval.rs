//! Circles and ellipses cut by the pixel grid: the share of a pixel from the area under the arc, in closed form.
//!
//! Pixels relative to the centre of the shape. Between two crossings with the grid an arc encloses a trapezoid and a
//! segment; crossings cost a square root, segments a short series. The outline's pixels of a row are integrated side by
//! side in lanes; rows share their chords. It does not cover ovals narrower than 4 px, whose arcs turn too far within a
//! pixel for the series.

use multiversion::multiversion;

/// Pixels integrated at once.
pub(super) const LANES: usize = 8;
/// Narrowest semi-axis for which [`Oval::row`] is exact \[px\].
pub(super) const MIN_SEMI_AXIS_PX: f64 = 2.0;

/// An ellipse with semi-axes a, b, rotated; inside is p·dx² + 2q·dx·dy + r·dy² ≤ 1.
#[derive(Debug, Clone, Copy)]
pub(super) struct Oval {
    pub(super) p: f64,
    pub(super) q: f64,
    pub(super) r: f64,
    pub(super) a: f64,
    pub(super) b: f64,
    sin: f64,
    cos: f64,
    /// Largest dx and dy, and where on the other axis they are reached.
    pub(super) x_max: f64,
    pub(super) y_max: f64,
    pub(super) right_y: f64,
    top_x: f64,
    /// The chord at dy is `slope_x`·dy ± `half_x`·√(y_max² − dy²), that at dx likewise.
    slope_x: f64,
    half_x: f64,
    slope_y: f64,
    half_y: f64,
    /// Terms of [`SEGMENT`] that count.
    terms: usize,
}

impl Oval {
    /// All from sums of squares: nothing cancels, however thin the ellipse.
    pub(super) fn new(a: f64, b: f64, (sin, cos): (f64, f64)) -> Self {
        let (s, t) = (1.0 / (a * a), 1.0 / (b * b));
        let (x_max, y_max) = ((a * cos).hypot(b * sin), (a * sin).hypot(b * cos));
        let shear = (a - b) * (a + b) * sin * cos;
        let (slope_x, slope_y) = (shear / (y_max * y_max), shear / (x_max * x_max));
        Self {
            p: cos * cos * s + sin * sin * t,
            q: sin * cos * (s - t),
            r: sin * sin * s + cos * cos * t,
            a,
            b,
            sin,
            cos,
            x_max,
            y_max,
            right_y: slope_y * x_max,
            top_x: slope_x * y_max,
            slope_x,
            half_x: a * b / (y_max * y_max),
            slope_y,
            half_y: a * b / (x_max * x_max),
            terms: match 0.5 * s.max(t) {
                s2 if s2 < 0.0015 => 5,
                s2 if s2 < 0.015 => 8,
                _ => SEGMENT.len(),
            },
        }
    }

    /// The range of dx inside at `dy`.
    pub(super) fn chord(&self, dy: f64) -> Option<(f64, f64)> {
        let square = (self.y_max - dy) * (self.y_max + dy);
        (square >= 0.0).then(|| {
            let (mid, half) = (self.slope_x * dy, self.half_x * square.sqrt());
            (mid - half, mid + half)
        })
    }

    /// Height of the upper outline at `dx`.
    #[inline(always)] // into the clones of `areas`
    fn upper(&self, dx: f64) -> f64 {
        self.slope_y * dx + self.half_y * ((self.x_max - dx) * (self.x_max + dx)).max(0.0).sqrt()
    }

    /// The row of pixels from `low` to `high` = `low` + 1, whose edges cut the chords `at_low` and `at_high`.
    pub(super) fn row(
        &self,
        low: f64,
        high: f64,
        at_low: Option<(f64, f64)>,
        at_high: Option<(f64, f64)>,
    ) -> PixelRow<'_> {
        let steepest = self.right_y.abs();
        let upper = (high > -steepest).then(|| Cut::new(self, (low, high), at_low, at_high));
        // an oval is its own mirror image through the centre: its lower outline is the upper one of the mirrored row
        let mirrored = |chord: Option<(f64, f64)>| chord.map(|(l, r)| (-r, -l));
        let lower = (low < steepest).then(|| Cut::new(self, (-high, -low), mirrored(at_high), mirrored(at_low)));
        PixelRow { oval: self, upper, lower }
    }
}

/// 2 C(2k, k)/4ᵏ/(2k + 3) from k = 15 down to 0.
///
/// Between the outline and a chord of it there is, with both mapped to the unit disc and the chord then 2s long, the area
/// asin s − s√(1 − s²) = Σₖ 2 C(2k, k)/4ᵏ s²ᵏ⁺³/(2k + 3). Within a pixel s² ≤ 1/(2b²): the terms used leave less than
/// 1e-16 px².
const SEGMENT: [f64; 16] = segment_series();

const fn segment_series() -> [f64; 16] {
    let mut series = [0.0; 16];
    let (mut binomial, mut k) = (1.0, 0);
    while k < 16 {
        let m = k as f64;
        series[15 - k] = 2.0 * binomial / (2.0 * m + 3.0);
        binomial *= (2.0 * m + 1.0) / (2.0 * m + 2.0);
        k += 1;
    }
    series
}

/// One row of pixels cut by an oval.
#[derive(Debug, Clone, Copy)]
pub(super) struct PixelRow<'a> {
    oval: &'a Oval,
    /// `None` where the upper outline is above the row everywhere.
    upper: Option<Cut>,
    /// The mirrored lower outline; `None` where that is below the row everywhere.
    lower: Option<Cut>,
}

/// Where the upper outline is above the lower and the upper edge of a row.
#[derive(Debug, Clone, Copy)]
struct Cut {
    low: f64,
    /// Height of the outline at the ends of `over_low`, and at those of `over_high`.
    foot: (f64, f64),
    roof: f64,
    over_low: (f64, f64),
    over_high: (f64, f64),
}

impl Cut {
    fn new(oval: &Oval, (low, high): (f64, f64), at_low: Option<(f64, f64)>, at_high: Option<(f64, f64)>) -> Self {
        // below its leftmost and rightmost point the upper outline has not begun: it reaches to the extremes
        let over = |y: f64, chord: Option<(f64, f64)>| {
            let (left, right) = chord.unwrap_or(if y > 0.0 { (oval.top_x, oval.top_x) } else { (0.0, 0.0) });
            (if y <= -oval.right_y { -oval.x_max } else { left }, if y <= oval.right_y { oval.x_max } else { right })
        };
        Self {
            low,
            foot: (low.max(-oval.right_y), low.max(oval.right_y)),
            roof: high.min(oval.y_max),
            over_low: over(low, at_low),
            over_high: over(high, at_high),
        }
    }
}

/// Flanks of an outline, one in each lane: the extent of its chord, and how high above the row the chord's middle is.
#[derive(Clone, Copy)]
struct Flanks {
    dx: [f64; LANES],
    dy: [f64; LANES],
    height: [f64; LANES],
}

impl Flanks {
    const NONE: Self = Self { dx: [0.0; LANES], dy: [0.0; LANES], height: [0.0; LANES] };

    /// Adds the trapezoids below the chords and the segments between chord and outline.
    #[inline(always)] // into the clones of `areas`
    fn add_to(&self, areas: &mut [f64; LANES], oval: &Oval) {
        let (mut s2, mut series) = ([0.0; LANES], [0.0; LANES]);
        let (along, across) = (1.0 / oval.a, 1.0 / oval.b);
        for lane in 0..LANES {
            let u = (oval.cos * self.dx[lane] + oval.sin * self.dy[lane]) * along;
            let v = (oval.cos * self.dy[lane] - oval.sin * self.dx[lane]) * across;
            s2[lane] = 0.25 * (u * u + v * v);
        }
        for c in &SEGMENT[SEGMENT.len() - oval.terms..] {
            for lane in 0..LANES {
                series[lane] = series[lane] * s2[lane] + c;
            }
        }
        for lane in 0..LANES {
            let segment = oval.a * oval.b * s2[lane] * s2[lane].sqrt() * series[lane];
            areas[lane] += self.dx[lane] * self.height[lane] + segment;
        }
    }
}

/// Areas below the outline, above the lower and not above the upper edge of the row, from `left` to `right`.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2", "x86_64+sse4.1"))]
fn areas(oval: &Oval, cut: &Cut, left: &[f64; LANES], right: &[f64; LANES]) -> [f64; LANES] {
    let mut areas = [0.0; LANES];
    let (mut one, mut other) = (Flanks::NONE, Flanks::NONE);
    let mut any_other = 0;
    for lane in 0..LANES {
        let (left, right) = (left[lane], right[lane]);
        let (at_left, at_right) = (oval.upper(left), oval.upper(right));
        areas[lane] = (right.min(cut.over_high.1) - left.max(cut.over_high.0)).max(0.0);
        // the outline rises from the lower edge of the row to the upper, and falls back to it
        let (begun, risen) = (left > cut.over_low.0, right >= cut.over_high.0);
        let (x0, y0) = (if begun { left } else { cut.over_low.0 }, if begun { at_left } else { cut.foot.0 });
        let (x1, y1) = (if risen { cut.over_high.0 } else { right }, if risen { cut.roof } else { at_right });
        let (begun, fallen) = (left > cut.over_high.1, right >= cut.over_low.1);
        let (x2, y2) = (if begun { left } else { cut.over_high.1 }, if begun { at_left } else { cut.roof });
        let (x3, y3) = (if fallen { cut.over_low.1 } else { right }, if fallen { cut.foot.1 } else { at_right });
        // nearly every pixel has only one of the flanks
        let (rises, falls) = (x0 < x1, x2 < x3);
        let (rising, falling) = (if rises { 1.0 } else { 0.0 }, if falls { 1.0 } else { 0.0 });
        let only = if rises { 0.0 } else { falling };
        one.dx[lane] = rising * (x1 - x0) + only * (x3 - x2);
        one.dy[lane] = rising * (y1 - y0) + only * (y3 - y2);
        one.height[lane] = 0.5 * (rising * (y0 + y1) + only * (y2 + y3)) - cut.low;
        let too = falling - only;
        other.dx[lane] = too * (x3 - x2);
        other.dy[lane] = too * (y3 - y2);
        other.height[lane] = 0.5 * (y2 + y3) - cut.low;
        any_other |= i32::from(rises & falls);
    }
    one.add_to(&mut areas, oval);
    if any_other != 0 {
        other.add_to(&mut areas, oval);
    }
    areas
}

impl PixelRow<'_> {
    /// Shares of the pixels from `left` to `right` = `left` + 1.
    pub(super) fn shares(&self, left: &[f64; LANES], right: &[f64; LANES]) -> [f64; LANES] {
        let upper = self.upper.as_ref().map(|cut| areas(self.oval, cut, left, right));
        // mirrored: left and right change places
        let lower = self.lower.as_ref().map(|cut| areas(self.oval, cut, &right.map(|x| -x), &left.map(|x| -x)));
        let shares = match (upper, lower) {
            (Some(one), None) | (None, Some(one)) => one,
            (Some(upper), Some(lower)) => std::array::from_fn(|lane| {
                let width = right[lane].min(self.oval.x_max) - left[lane].max(-self.oval.x_max);
                upper[lane] + lower[lane] - width.max(0.0)
            }),
            (None, None) => [1.0; LANES],
        };
        shares.map(|share| share.clamp(0.0, 1.0))
    }
}
