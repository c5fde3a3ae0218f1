//! Adaptive Gauss-Kronrod quadrature of 21 and 10 points over given panels.

/// A value with its estimated error.
#[derive(Debug, Clone, Copy, Default)]
pub struct Sum {
    pub value: f64,
    pub err: f64,
}

/// Panels of one integral.
#[derive(Default)]
pub struct Panels(Vec<Panel>);

#[derive(Clone, Copy)]
struct Panel {
    from: f64,
    width: f64,
    /// Part of the panel, 0 to 1.
    t: (f64, f64),
    /// Nodes of fourth order at both ends.
    clustered: bool,
    sum: Sum,
}

impl Panels {
    /// All panels between edges, clustered.
    pub fn clustered(edges: &[f64]) -> Self {
        let mut panels = Self::default();
        edges.windows(2).for_each(|pair| panels.push(pair[0], pair[1], true));
        panels
    }

    pub fn push(&mut self, from: f64, to: f64, clustered: bool) {
        if to > from {
            self.0.push(Panel { from, width: to - from, t: (0.0, 1.0), clustered, sum: Sum::default() });
        }
    }

    /// The sum, refined until its error is `tolerance` of the larger of itself and `scale`, or `splits` are used up.
    pub fn refined(&mut self, f: impl Fn(f64) -> Sum, tolerance: f64, scale: f64, splits: usize) -> Sum {
        self.0.iter_mut().for_each(|p| p.evaluate(&f));
        let mut left = splits;
        loop {
            let total =
                self.0.iter().fold(Sum::default(), |t, p| Sum { value: t.value + p.sum.value, err: t.err + p.sum.err });
            let limit = tolerance * total.value.abs().max(scale);
            let worst = (0..self.0.len()).max_by(|i, j| self.0[*i].sum.err.total_cmp(&self.0[*j].sum.err));
            let Some(worst) = worst.filter(|_| total.err > limit && left > 0) else { return total };
            left -= 1;
            let p = self.0[worst];
            let middle = 0.5 * (p.t.0 + p.t.1);
            if !(p.t.0 < middle && middle < p.t.1) {
                return total;
            }
            let mut halves = [Panel { t: (p.t.0, middle), ..p }, Panel { t: (middle, p.t.1), ..p }];
            halves.iter_mut().for_each(|half| half.evaluate(&f));
            self.0[worst] = halves[0];
            self.0.push(halves[1]);
        }
    }
}

impl Panel {
    fn evaluate(&mut self, f: &impl Fn(f64) -> Sum) {
        let (mut fine, mut coarse, mut within) = (0.0, 0.0, 0.0);
        let mut values = [0.0; 21];
        let half = 0.5 * (self.t.1 - self.t.0);
        for (j, value) in values.iter_mut().enumerate() {
            let (at, sign) = if j <= 10 { (j, -1.0) } else { (20 - j, 1.0) };
            let t = self.t.0 + half * (1.0 + sign * X[at]);
            let u = 1.0 - t;
            let (y, dy) = if self.clustered {
                let t3 = t * t * t;
                (t3 * t * (35.0 - 84.0 * t + 70.0 * t * t - 20.0 * t3), 140.0 * t3 * u * u * u)
            } else {
                (t, 1.0)
            };
            let slope = half * self.width * dy;
            let Sum { value: here, err } = f(self.from + self.width * y);
            *value = here * slope;
            fine += KRONROD[at] * *value;
            within += KRONROD[at] * err * slope;
            if at % 2 == 1 {
                coarse += GAUSS[at / 2] * *value;
            }
        }
        let weight = |j: usize| KRONROD[if j <= 10 { j } else { 20 - j }];
        let spread: f64 = (0..21).map(|j| weight(j) * (values[j] - 0.5 * fine).abs()).sum();
        let apart = (fine - coarse).abs();
        let err = if spread > 0.0 { spread * (200.0 * apart / spread).powf(1.5).min(1.0) } else { apart };
        self.sum = Sum { value: fine, err: err + within + 4e-16 * fine.abs() };
    }
}

/// QUADPACK's: nodes from the end to the middle, Kronrod weights, Gauss weights.
const X: [f64; 11] = [
    0.995_657_163_025_808_1,
    0.973_906_528_517_171_7,
    0.930_157_491_355_708_2,
    0.865_063_366_688_984_5,
    0.780_817_726_586_416_9,
    0.679_409_568_299_024_4,
    0.562_757_134_668_604_7,
    0.433_395_394_129_247_2,
    0.294_392_862_701_460_2,
    0.148_874_338_981_631_22,
    0.0,
];
const KRONROD: [f64; 11] = [
    0.011_694_638_867_371_874,
    0.032_558_162_307_964_725,
    0.054_755_896_574_351_995,
    0.075_039_674_810_919_96,
    0.093_125_454_583_697_6,
    0.109_387_158_802_297_64,
    0.123_491_976_262_065_84,
    0.134_709_217_311_473_34,
    0.142_775_938_577_060_09,
    0.147_739_104_901_338_49,
    0.149_445_554_002_916_9,
];
const GAUSS: [f64; 5] = [
    0.066_671_344_308_688_14,
    0.149_451_349_150_580_6,
    0.219_086_362_515_982_04,
    0.269_266_719_309_996_35,
    0.295_524_224_714_752_87,
];
