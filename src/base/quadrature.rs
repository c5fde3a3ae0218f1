//! Gauss-Legendre rules on \[0, 1\], nested Gauss-Kronrod pairs on \[−1, 1\], and maps that tame the ends of a panel.
//!
//! Dimensionless. Rules are computed once and shared; nothing here knows what is integrated.

use std::f64::consts::PI;
use std::sync::OnceLock;

/// Largest order kept.
pub(crate) const ORDER_MAX: usize = 80;

/// Nodes and weights of one rule.
type Rule = (Vec<f64>, Vec<f64>);

/// Nodes and weights of the Gauss-Legendre rule of `order` points (1 to [`ORDER_MAX`], clamped) on \[0, 1\].
pub(crate) fn gauss(order: usize) -> (&'static [f64], &'static [f64]) {
    static RULES: OnceLock<Vec<Rule>> = OnceLock::new();
    let rules = RULES.get_or_init(|| (1..=ORDER_MAX).map(legendre).collect());
    let (nodes, weights) = &rules[order.clamp(1, ORDER_MAX) - 1];
    (nodes, weights)
}

/// x = (1 − cos πt)/2 and dx/dt: quadratic at both ends, so that sqrt(x) becomes smooth.
pub(crate) fn half_cosine(t: f64) -> (f64, f64) {
    let half = (PI * t / 2.0).sin();
    (half * half, PI / 2.0 * (PI * t).sin())
}

/// x = t²(3 − 2t) and dx/dt: quadratic at both ends, so that sqrt(x) becomes smooth.
pub(crate) fn smooth_step(t: f64) -> (f64, f64) {
    (t * t * (3.0 - 2.0 * t), 6.0 * t * (1.0 - t))
}

/// x = t⁴(35 − 84t + 70t² − 20t³) and dx/dt: fourth order at both ends, for powers as small as x^0.2.
pub(crate) fn end_clustered(t: f64) -> (f64, f64) {
    let t3 = t * t * t;
    let u = 1.0 - t;
    (t3 * t * (35.0 - 84.0 * t + 70.0 * t * t - 20.0 * t3), 140.0 * t3 * u * u * u)
}

/// One Gauss-Kronrod pair: 2n+1 nodes of which every second belongs to the n-point Gauss rule.
pub(crate) struct Pair {
    /// Nodes on \[−1, 1\], rising.
    pub x: Vec<f64>,
    /// Kronrod weights.
    pub fine: Vec<f64>,
    /// Gauss weights; 0 at the nodes only Kronrod has.
    pub coarse: Vec<f64>,
    /// Weights of the interpolating rule on the nodes only Kronrod has, coarser still; 0 at the others.
    pub coarsest: Vec<f64>,
}

/// Number of pairs.
pub(crate) const PAIRS: usize = 6;

/// The pairs of 7, 9, 11, 15, 21 and 31 nodes.
pub(crate) fn kronrod() -> &'static [Pair; PAIRS] {
    static RULES: OnceLock<[Pair; PAIRS]> = OnceLock::new();
    RULES.get_or_init(|| {
        [pair(&KRONROD_7), pair(&KRONROD_9), pair(&KRONROD_11), pair(&KRONROD_15), pair(&KRONROD_21), pair(&KRONROD_31)]
    })
}

/// Both halves of a rule from one.
fn pair(half: &[[f64; 3]]) -> Pair {
    let mirrored = half.iter().skip(1).rev().map(|[x, fine, coarse]| [-x, *fine, *coarse]);
    let rows: Vec<[f64; 3]> = mirrored.chain(half.iter().copied()).collect();
    let column = |c: usize| rows.iter().map(|row| row[c]).collect();
    let x: Vec<f64> = column(0);
    let coarsest = interpolating(&x);
    Pair { fine: column(1), coarse: column(2), coarsest, x }
}

/// Weights of the rule that integrates the polynomial through the values at every second node, first and last included.
fn interpolating(x: &[f64]) -> Vec<f64> {
    let chosen: Vec<usize> = (0..x.len()).step_by(2).collect();
    let mut weights = vec![0.0; x.len()];
    let (ts, ws) = gauss(x.len());
    for j in &chosen {
        // ∫ of the Lagrange polynomial of this node
        let lagrange = |t: f64| -> f64 {
            let others = chosen.iter().filter(|i| *i != j);
            others.map(|i| (2.0 * t - 1.0 - x[*i]) / (x[*j] - x[*i])).product()
        };
        weights[*j] = 2.0 * ts.iter().zip(ws).map(|(t, w)| w * lagrange(*t)).sum::<f64>();
    }
    weights
}

/// Newton's method on P_n from the Chebyshev-like first guess.
fn legendre(n: usize) -> Rule {
    let mut rule: Vec<(f64, f64)> = (0..n)
        .map(|k| {
            let mut x = (PI * (k as f64 + 0.75) / (n as f64 + 0.5)).cos();
            let mut slope = 1.0;
            for _ in 0..100 {
                let (p, dp) = polynomial(n, x);
                slope = dp;
                let step = p / dp;
                x -= step;
                if step.abs() < 1e-16 {
                    break;
                }
            }
            ((1.0 - x) / 2.0, 1.0 / ((1.0 - x * x) * slope * slope))
        })
        .collect();
    rule.sort_by(|a, b| a.0.total_cmp(&b.0));
    rule.into_iter().unzip()
}

/// P_n(x) and its derivative.
fn polynomial(n: usize, x: f64) -> (f64, f64) {
    let (mut p0, mut p1) = (1.0, x);
    for k in 2..=n {
        // k P_k = (2k−1) x P_{k−1} − (k−1) P_{k−2}
        (p0, p1) = (p1, ((2 * k - 1) as f64 * x * p1 - (k - 1) as f64 * p0) / k as f64);
    }
    (p1, n as f64 * (x * p1 - p0) / (x * x - 1.0))
}

/// Halves of the Gauss-Kronrod pairs on \[−1, 1\]: node, Kronrod weight, Gauss weight.
///
/// Computed with 40 digits: zeros of the Stieltjes polynomials, weights from the moments.
#[rustfmt::skip]
const KRONROD_7: [[f64; 3]; 4] = [
    [0.0, 0.450_916_538_658_474_14, 0.888_888_888_888_888_8],
    [0.434_243_749_346_802_54, 0.401_397_414_775_962_25, 0.0],
    [0.774_596_669_241_483_4, 0.268_488_089_868_333_45, 0.555_555_555_555_555_6],
    [0.960_491_268_708_020_3, 0.104_656_226_026_467_26, 0.0],
];
#[rustfmt::skip]
const KRONROD_9: [[f64; 3]; 5] = [
    [0.0, 0.346_442_981_890_136_34, 0.0],
    [0.339_981_043_584_856_26, 0.326_949_189_601_451_64, 0.652_145_154_862_546_1],
    [0.640_286_217_496_31, 0.266_798_340_452_284_45, 0.0],
    [0.861_136_311_594_052_6, 0.170_053_605_335_722_72, 0.347_854_845_137_453_85],
    [0.976_560_250_737_573_1, 0.062_977_373_665_473_01, 0.0],
];
#[rustfmt::skip]
const KRONROD_11: [[f64; 3]; 6] = [
    [0.0, 0.282_987_417_857_491_2, 0.568_888_888_888_888_9],
    [0.279_630_413_161_783_2, 0.272_849_801_912_558_9, 0.0],
    [0.538_469_310_105_683_1, 0.241_040_339_228_647_6, 0.478_628_670_499_366_47],
    [0.754_166_726_570_849_3, 0.186_800_796_556_492_65, 0.0],
    [0.906_179_845_938_664, 0.115_233_316_622_473_4, 0.236_926_885_056_189_08],
    [0.984_085_360_094_842_5, 0.042_582_036_751_081_83, 0.0],
];
#[rustfmt::skip]
const KRONROD_15: [[f64; 3]; 8] = [
    [0.0, 0.209_482_141_084_727_82, 0.417_959_183_673_469_4],
    [0.207_784_955_007_898_48, 0.204_432_940_075_298_89, 0.0],
    [0.405_845_151_377_397_2, 0.190_350_578_064_785_42, 0.381_830_050_505_118_9],
    [0.586_087_235_467_691_1, 0.169_004_726_639_267_9, 0.0],
    [0.741_531_185_599_394_5, 0.140_653_259_715_525_92, 0.279_705_391_489_276_64],
    [0.864_864_423_359_769_1, 0.104_790_010_322_250_19, 0.0],
    [0.949_107_912_342_758_5, 0.063_092_092_629_978_56, 0.129_484_966_168_869_7],
    [0.991_455_371_120_812_6, 0.022_935_322_010_529_224, 0.0],
];
#[rustfmt::skip]
const KRONROD_21: [[f64; 3]; 11] = [
    [0.0, 0.149_445_554_002_916_9, 0.0],
    [0.148_874_338_981_631_22, 0.147_739_104_901_338_49, 0.295_524_224_714_752_87],
    [0.294_392_862_701_460_2, 0.142_775_938_577_060_09, 0.0],
    [0.433_395_394_129_247_2, 0.134_709_217_311_473_34, 0.269_266_719_309_996_35],
    [0.562_757_134_668_604_7, 0.123_491_976_262_065_84, 0.0],
    [0.679_409_568_299_024_4, 0.109_387_158_802_297_64, 0.219_086_362_515_982_04],
    [0.780_817_726_586_416_9, 0.093_125_454_583_697_6, 0.0],
    [0.865_063_366_688_984_5, 0.075_039_674_810_919_96, 0.149_451_349_150_580_6],
    [0.930_157_491_355_708_2, 0.054_755_896_574_351_995, 0.0],
    [0.973_906_528_517_171_7, 0.032_558_162_307_964_725, 0.066_671_344_308_688_14],
    [0.995_657_163_025_808_1, 0.011_694_638_867_371_874, 0.0],
];
#[rustfmt::skip]
const KRONROD_31: [[f64; 3]; 16] = [
    [0.0, 0.101_330_007_014_791_54, 0.202_578_241_925_561_3],
    [0.101_142_066_918_717_5, 0.100_769_845_523_875_59, 0.0],
    [0.201_194_093_997_434_51, 0.099_173_598_721_791_96, 0.198_431_485_327_111_58],
    [0.299_180_007_153_168_84, 0.096_642_726_983_623_68, 0.0],
    [0.394_151_347_077_563_4, 0.093_126_598_170_825_32, 0.186_161_000_015_562_2],
    [0.485_081_863_640_239_7, 0.088_564_443_056_211_76, 0.0],
    [0.570_972_172_608_538_8, 0.083_080_502_823_133_02, 0.166_269_205_816_993_92],
    [0.650_996_741_297_417, 0.076_849_680_757_720_38, 0.0],
    [0.724_417_731_360_170_1, 0.069_854_121_318_728_26, 0.139_570_677_926_154_32],
    [0.790_418_501_442_466, 0.062_009_567_800_670_64, 0.0],
    [0.848_206_583_410_427_2, 0.053_481_524_690_928_09, 0.107_159_220_467_171_94],
    [0.897_264_532_344_081_9, 0.044_589_751_324_764_88, 0.0],
    [0.937_273_392_400_706, 0.035_346_360_791_375_85, 0.070_366_047_488_108_12],
    [0.967_739_075_679_139_1, 0.025_460_847_326_715_32, 0.0],
    [0.987_992_518_020_485_4, 0.015_007_947_329_316_122, 0.030_753_241_996_117_27],
    [0.998_002_298_693_397_1, 0.005_377_479_872_923_349, 0.0],
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_three_rules_of_a_pair_are_exact_to_their_degree() {
        for Pair { x, fine, coarse, coarsest } in kronrod() {
            let n = x.len() / 2;
            for (weights, degree) in [(fine, 3 * n + 1), (coarse, 2 * n - 1), (coarsest, n)] {
                for d in 0..=degree {
                    let sum: f64 = x.iter().zip(weights).map(|(x, w)| w * x.powi(d as i32)).sum();
                    let exact = if d % 2 == 0 { 2.0 / (d + 1) as f64 } else { 0.0 };
                    assert!((sum - exact).abs() < 1e-13, "{n} {d}: {sum}");
                }
            }
        }
    }

    #[test]
    fn a_rule_of_n_points_is_exact_to_degree_2n_minus_1() {
        for order in [1, 2, 5, 8, 27, 80] {
            let (nodes, weights) = gauss(order);
            let degree = 2 * order as i32 - 1;
            let sum: f64 = nodes.iter().zip(weights).map(|(x, w)| w * x.powi(degree)).sum();
            assert!((sum * f64::from(degree + 1) - 1.0).abs() < 1e-12, "{order}");
        }
    }

    #[test]
    fn both_maps_cover_the_panel_and_carry_their_own_derivative() {
        for map in [half_cosine, smooth_step, end_clustered] {
            assert!(map(0.0).0.abs() < 1e-15 && (map(1.0).0 - 1.0).abs() < 1e-15);
            let (step, t) = (1e-6, 0.3);
            let slope = (map(t + step).0 - map(t - step).0) / (2.0 * step);
            assert!((slope - map(t).1).abs() < 1e-8);
        }
    }
}
