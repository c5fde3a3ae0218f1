//! Clouds only dim: pointings under a cloud are recognised by the one-sided tail of the offsets.
//!
//! Magnitudes. d_j = m + u_j + z_j c_j + e_j with u_j of variance τ², z_j = 1 with probability π and c_j exponential
//! or Gaussian of positive mean, by expectation and maximisation (Dempster, Laird & Rubin 1977). The zeropoint is corrected
//! for clouds where the likelihood ratio to m + u_j + e_j alone favours them; where it does not, and the offsets are skewed
//! towards the faint side, the shift that the clouds would make widens the error. Clouds over most of the pointings are not
//! modelled: nothing in a night distinguishes them from a lower zeropoint.

use std::f64::consts::{PI, SQRT_2};

use statrs::function::erf::erfc;

/// Fewest pointings among which clouds are looked for.
const FEWEST: usize = 6;
/// Twice the log-likelihood ratio at which clouds are as likely as not, and from which the zeropoint is corrected for them.
const EVIDENCE: f64 = 3.0;
/// Skewness of the deviations from which clouds that are not corrected are suspected.
const SKEWED: f64 = 0.25;
/// The penalty for one more parameter.
const ONE_MORE: f64 = 4.0;
/// Share of the shift that stays in the error however sure the clouds are: how thick they are is not exponential.
const UNKNOWN_SHAPE: f64 = 0.12;
/// Largest share of clouded pointings.
const MOST: f64 = 0.5;
/// Rounds of expectation and maximisation.
const ROUNDS: usize = 80;
/// Share of the scatter of the clear pointings that stays in the error: which of them are clear is itself estimated.
const UNKNOWN_SPLIT: f64 = 0.25;
/// By how much the scatter of the clear pointings is widened for the same reason.
const WIDENED: f64 = 1.15;
/// Parameters that are fitted to the offsets.
const FITTED: f64 = 4.0;
/// Smallest scatter in units of the pointings' own errors.
const SMALLEST: f64 = 0.1;

/// Pointings under clouds.
#[derive(Debug, Clone)]
pub struct Clouds {
    /// Expected extinction by cloud of each pointing \[mag\].
    pub mean_mag: Vec<f64>,
    /// Precision each pointing keeps, 0 to 1: whether it is clouded is not known for sure.
    pub weight: Vec<f64>,
    /// Probability that a pointing is clouded.
    pub probability: Vec<f64>,
    /// Scatter of the clear pointings \[mag\].
    pub tau_mag: f64,
    /// By how much the clouds would move the zeropoint if they were taken as scatter \[mag\].
    pub shift_mag: f64,
    /// Probability of the clouds, 0 to 1.
    pub belief: f64,
    /// Error of the zeropoint of a fit that is not corrected for these clouds \[mag\]: root mean square of the shift.
    pub suspected_mag: f64,
}

impl Clouds {
    /// Error of the zeropoint by not knowing for sure \[mag\].
    pub fn doubt_mag(&self) -> f64 {
        let sure = (self.belief * (1.0 - self.belief)).sqrt();
        (sure.max(UNKNOWN_SHAPE) * self.shift_mag).hypot(UNKNOWN_SPLIT * self.tau_mag)
    }

    /// Whether the clouds are more likely than not, so that the zeropoint is corrected for them.
    pub fn likely(&self) -> bool {
        self.belief >= 0.5
    }
}

/// The thickness of the clouds.
#[derive(Debug, Clone, Copy)]
enum Depth {
    /// Exponential of this mean \[mag\]: many thin ones.
    Exponential(f64),
    /// Gaussian of this mean and standard deviation \[mag\], the mean at least as large: all of one kind.
    Gaussian(f64, f64),
}

/// One set of parameters and its log-likelihood.
#[derive(Debug, Clone, Copy)]
struct State {
    m: f64,
    tau2: f64,
    share: f64,
    depth: Depth,
    log_likelihood: f64,
}

impl Depth {
    /// Density of a deviation `x` under a cloud, mean and variance of the cloud given it; `s` is the scatter without cloud.
    fn given(self, x: f64, s: f64) -> (f64, f64, f64) {
        match self {
            Depth::Exponential(depth) => {
                let t = x / s - s / depth;
                let h = hazard(t);
                (dimmed(x, s, depth), (s * (t + h)).max(0.0), (s * s * (1.0 - h * (h + t))).max(0.0))
            }
            Depth::Gaussian(mean, sd) => {
                let own = sd * sd / (sd * sd + s * s);
                (gauss(x - mean, sd.hypot(s)), (mean + own * (x - mean)).max(0.0), own * s * s)
            }
        }
    }

    /// The most likely depth: of all clouds together their expected number, Σ E c and Σ E c².
    fn next(self, number: f64, sum: f64, squares: f64) -> Depth {
        let mean = (sum / number.max(0.1)).max(1e-6);
        match self {
            Depth::Exponential(_) => Depth::Exponential(mean),
            Depth::Gaussian(..) => {
                let sd = (squares / number.max(0.1) - mean * mean).max(0.0).sqrt();
                Depth::Gaussian(mean, sd.clamp(1e-9, mean))
            }
        }
    }
}

fn gauss(x: f64, s: f64) -> f64 {
    (-0.5 * (x / s).powi(2)).exp() / (s * (2.0 * PI).sqrt())
}

/// Ratio φ/Φ.
fn hazard(t: f64) -> f64 {
    if t < -30.0 {
        return -t;
    }
    (-0.5 * t * t).exp() / (2.0 * PI).sqrt() / (0.5 * erfc(-t / SQRT_2))
}

/// Density of an exponential of mean `depth` plus a Gaussian of `s`.
fn dimmed(x: f64, s: f64, depth: f64) -> f64 {
    let t = x / s - s / depth;
    // far below: Φ is φ over the hazard, and the exponentials cancel to the Gaussian
    if t < -5.0 {
        return gauss(x, s) * s / depth / hazard(t).max(1e-300);
    }
    (0.5 * (s / depth).powi(2) - x / depth).exp() / depth * 0.5 * erfc(-t / SQRT_2)
}

/// The most likely clouds for deviations `d` of the pointings with their variances `v`; `None` with too few pointings. A
/// pointing without variance (no star used) takes no part.
pub fn find(d: &[f64], v: &[f64]) -> Option<Clouds> {
    let used: Vec<usize> = (0..d.len()).filter(|j| v[*j].is_finite() && d[*j].is_finite()).collect();
    if used.len() < FEWEST {
        return None;
    }
    let clear = normal(d, v, &used);
    let mut values: Vec<f64> = used.iter().map(|j| d[*j]).collect();
    values.sort_unstable_by(f64::total_cmp);
    let at = |q: f64| values[(q * (values.len() - 1) as f64).round() as usize];
    let own = used.iter().map(|j| v[*j]).sum::<f64>() / used.len() as f64;
    let low = at(0.35);
    let lower = at(0.1);
    let depth = (at(0.9) - low).max(own.sqrt());
    let begin = |depth| State {
        m: low,
        tau2: ((low - lower).powi(2) - own).max(own * 0.25).max(1e-16),
        share: 0.25,
        depth,
        log_likelihood: f64::NEG_INFINITY,
    };
    let floor = SMALLEST * SMALLEST * own;
    let empty = Clouds {
        mean_mag: vec![0.0; d.len()],
        weight: vec![1.0; d.len()],
        probability: vec![0.0; d.len()],
        tau_mag: 0.0,
        shift_mag: 0.0,
        belief: 0.0,
        suspected_mag: 0.0,
    };
    let kind = |depth: Depth, parameters: f64| {
        let (mut out, mut state) = (empty.clone(), begin(depth));
        for _ in 0..ROUNDS {
            state = step(d, v, &used, state, floor, &mut out);
        }
        (2.0 * (state.log_likelihood - clear.log_likelihood) - parameters, state, out)
    };
    let thin = kind(Depth::Exponential(depth), 0.0);
    let alike = kind(Depth::Gaussian(depth, 0.3 * depth), ONE_MORE);
    let belief = |gain: f64| 1.0 / (1.0 + (0.5 * (EVIDENCE - gain)).exp());
    let suspected = |gain: f64, state: &State| belief(gain).sqrt() * (clear.m - state.m).abs();
    let suspected_mag = suspected(thin.0, &thin.1).max(suspected(alike.0 + ONE_MORE, &alike.1));
    let (gain, state, mut out) = if alike.0 > thin.0 { alike } else { thin };
    out.belief = belief(gain);
    // scatter is symmetric: only a tail towards the faint side is suspected of clouds
    out.suspected_mag = if skewness(d, v, &used, &clear) > SKEWED { suspected_mag } else { 0.0 };
    // maximum likelihood is too small by the parameters that were fitted: location, slope, share and depth
    let clear_ones: f64 = used.iter().map(|j| out.weight[*j]).sum();
    out.tau_mag = WIDENED * (state.tau2 * clear_ones / (clear_ones - FITTED).max(1.0)).sqrt();
    out.shift_mag = clear.m - state.m;
    Some(out)
}

/// One step of expectation and maximisation; the likelihood is that before the step.
fn step(d: &[f64], v: &[f64], used: &[usize], state: State, floor: f64, out: &mut Clouds) -> State {
    let State { m, tau2, share, depth, .. } = state;
    let (mut log_likelihood, mut precision, mut sum, mut clouded, mut dimming) = (0.0, 0.0, 0.0, 0.0, 0.0);
    let (mut excess, mut squares, mut dimming2) = (0.0, 0.0, 0.0);
    for j in used.iter().copied() {
        let s2 = tau2 + v[j];
        let (s, x) = (s2.sqrt(), d[j] - m);
        let (density, c, var_c) = depth.given(x, s);
        let (f0, f1) = ((1.0 - share) * gauss(x, s), share * density);
        let total = (f0 + f1).max(1e-300);
        log_likelihood += total.ln();
        let p = (f1 / total).clamp(0.0, 1.0);
        let mean = p * c;
        let var = p * (var_c + c * c) - mean * mean;
        out.mean_mag[j] = mean;
        out.weight[j] = (1.0 - var / s2).clamp(0.02, 1.0);
        out.probability[j] = p;
        precision += 1.0 / s2;
        sum += (d[j] - mean) / s2;
        clouded += p;
        dimming += mean;
        dimming2 += p * (var_c + c * c);
        excess += ((x - mean).powi(2) + var - s2) / (s2 * s2);
        squares += 1.0 / (s2 * s2);
    }
    let n = used.len() as f64;
    State {
        m: sum / precision,
        tau2: (tau2 + excess / squares).max(floor),
        share: ((clouded + 0.5) / (n + 2.0)).min(MOST),
        depth: depth.next(clouded, dimming, dimming2),
        log_likelihood,
    }
}

/// Skewness of the deviations about one Gaussian scatter.
fn skewness(d: &[f64], v: &[f64], used: &[usize], clear: &State) -> f64 {
    let third = |j: &usize| ((d[*j] - clear.m) / (clear.tau2 + v[*j]).sqrt()).powi(3);
    used.iter().map(third).sum::<f64>() / used.len() as f64
}

/// One Gaussian scatter.
fn normal(d: &[f64], v: &[f64], used: &[usize]) -> State {
    let mut tau2 = 0.0;
    let mut m = 0.0;
    for _ in 0..60 {
        let sums = used.iter().fold((0.0, 0.0), |(w, y), j| (w + 1.0 / (tau2 + v[*j]), y + d[*j] / (tau2 + v[*j])));
        m = sums.1 / sums.0;
        let (mut excess, mut squares) = (0.0, 0.0);
        for j in used.iter().copied() {
            let s2 = tau2 + v[j];
            excess += ((d[j] - m).powi(2) - s2) / (s2 * s2);
            squares += 1.0 / (s2 * s2);
        }
        tau2 = (tau2 + excess / squares).max(0.0);
    }
    let log_likelihood = used.iter().map(|j| gauss(d[*j] - m, (tau2 + v[*j]).sqrt()).max(1e-300).ln()).sum();
    State { m, tau2, share: 0.0, depth: Depth::Exponential(0.0), log_likelihood }
}
