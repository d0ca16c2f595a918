//! Is there a warm-up at all, and is it more than a straight line?
//!
//! Constant, straight line and warm-up are each fitted by maximum likelihood under noise of their own (white plus
//! random walk, see `noise`): a random walk must not pass for a warm-up. The tests take the straight line's. Corrected AIC (Hurvich and Tsai,
//! Biometrika 76 (1989) 297) compares all three. The F-type test looks at the largest gain over all T; T does not
//! exist under the null hypothesis, so F tables do not apply (Davies, Biometrika 74 (1987) 33). Its p value is the
//! volume of the tube around the curve that the unit regressor draws on the sphere as T varies (Hotelling,
//! Am. J. Math. 61 (1939) 440), an upper bound that is exact for small p:
//! P = (L/π) (1 - w²)^((d-2)/2) + P(|B| > w), L the curve's length, w² the share of the sum of squares explained.

use super::noise::{Whitened, ratios, whiten};
use super::projection::{self, BlockSum, Projection};
use crate::math::basis::Basis;
use crate::math::basis::dot;
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, StudentsT};

/// Groups that the comparison looks at: enough to tell curves apart.
const GROUPS: usize = 256;

/// Corrected AIC of one model.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Score {
    /// Parameters, those of the noise included.
    pub parameters: u32,
    /// Corrected Akaike information criterion; smaller is better.
    pub aicc: f64,
    /// AICc less the smallest of the three.
    pub aicc_above_best: f64,
}

/// Test of the warm-up against a simpler model.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct GainTest {
    /// F statistic: (gain in the sum of squares / extra parameters) / (residual sum of squares / degrees of freedom),
    /// whitened.
    pub f: f64,
    /// Probability of as large a gain where the simpler model is true.
    pub p_value: f64,
}

/// The warm-up beside a constant and a straight line.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Comparison {
    /// e = C2
    pub constant: Score,
    /// e = C2 + slope t
    pub line: Score,
    /// e = C1 (1 - exp(-t/T)) + C2
    pub warm_up: Score,
    /// Warm-up against the constant.
    pub against_constant: GainTest,
    /// Warm-up against the straight line.
    pub against_line: GainTest,
}

/// Best likelihood of a model over the ratios K²/σ².
#[derive(Clone)]
struct Best {
    ln_likelihood: f64,
    ratio: f64,
}

/// Compares the three models. `None` with too few samples, or where C1 or T are given.
pub(super) fn compare(p: &Projection, free_time_constant: bool) -> Option<Comparison> {
    let [free_c1, free_c2] = p.free();
    if !(free_c1 && free_time_constant) {
        return None;
    }
    let m = p.moments;
    let shortest = m.step_s.max(m.span_s / projection::SHORTEST);
    let longest = 30.0 * (m.span_s + p.offset_s);
    if !(shortest > 0.0 && longest > shortest) {
        return None;
    }
    let steps = ((longest / shortest).ln() * 3.0).ceil();
    let times: Vec<f64> =
        (0..=steps as i32).map(|i| shortest * (longest / shortest).powf(f64::from(i) / steps)).collect();
    let first = p.growing_groups(times[0], GROUPS);
    let n = first.len();
    let base = if free_c2 { 0.0 } else { p.c2? - m.reference };
    let mean = |sum: f64, g: &BlockSum| sum / g.n;
    // y, [1], t, g(T) for every T
    let mut series = vec![first.iter().map(|g| mean(g.y, g) - base).collect::<Vec<f64>>()];
    if free_c2 {
        series.push(vec![1.0; n]);
    }
    let constants = series.len();
    series.push(first.iter().map(|g| g.mid_s + p.offset_s).collect());
    for &t in &times {
        series.push(p.growing_groups(t, GROUPS).iter().map(|g| mean(g.g, g)).collect());
    }
    let count: f64 = first.iter().map(|g| g.n).sum();
    let mut best: [Option<Best>; 3] = [None, None, None];
    // every second ratio: the likelihood is flat over half a decade
    for (ratio, _) in ratios(count, m.span_s, n).into_iter().step_by(2) {
        let white = whiten(&first, &series, ratio);
        let space = Space::new(&white, constants);
        let gains = [0.0, space.gain(&white.columns[constants]), space.largest_gain(&white.columns[constants + 1..])];
        for (slot, gain) in best.iter_mut().zip(gains) {
            let rss = (space.rss - gain).max(f64::MIN_POSITIVE);
            let ln_likelihood = -0.5 * (n as f64 * (rss / n as f64).ln() + white.ln_det);
            if slot.as_ref().is_none_or(|b| ln_likelihood > b.ln_likelihood) {
                *slot = Some(Best { ln_likelihood, ratio });
            }
        }
    }
    let [Some(constant), Some(line), Some(warm_up)] = best else { return None };
    // both tests take the noise of the straight line's fit: under the constant alone a warm-up would be taken for
    // the random walk that it is to be told from
    let white = whiten(&first, &series, line.ratio);
    let test = |null_end: usize, extra: f64| -> Option<GainTest> {
        let space = Space::new(&white, null_end);
        tube(&space, &white.columns[constants + 1..], n as f64 - (null_end - 1) as f64, extra)
    };
    let against_constant = test(constants, 2.0)?;
    let against_line = test(constants + 1, 1.0)?;
    let linear = (constants - 1) as u32;
    let scores = [(linear + 2, &constant), (linear + 3, &line), (linear + 4, &warm_up)].map(|(k, b)| {
        let kf = f64::from(k);
        let correction = 2.0 * kf * (kf + 1.0) / (n as f64 - kf - 1.0).max(f64::MIN_POSITIVE);
        (k, -2.0 * b.ln_likelihood + 2.0 * kf + correction)
    });
    let least = scores.iter().map(|s| s.1).fold(f64::INFINITY, f64::min);
    let score = |i: usize| Score { parameters: scores[i].0, aicc: scores[i].1, aicc_above_best: scores[i].1 - least };
    Some(Comparison { constant: score(0), line: score(1), warm_up: score(2), against_constant, against_line })
}

/// Residual of y after projection on the null columns, and an orthonormal basis of these.
struct Space {
    null: Basis,
    residual: Vec<f64>,
    rss: f64,
}

impl Space {
    /// y is column 0, the null columns are 1..`null_end`.
    fn new(white: &Whitened, null_end: usize) -> Self {
        let mut null = Basis::default();
        white.columns[1..null_end].iter().for_each(|c| null.push(c));
        let mut residual = white.columns[0].clone();
        null.remove_from(&mut residual);
        let rss = dot(&residual, &residual);
        Self { null, residual, rss }
    }

    /// Reduction of the residual sum of squares by the column.
    fn gain(&self, column: &[f64]) -> f64 {
        let norm = dot(column, column);
        let outside = norm - self.null.columns.iter().map(|b| dot(b, column).powi(2)).sum::<f64>();
        // below this only rounding is left of it
        if outside > 1e-13 * norm { dot(column, &self.residual).powi(2) / outside } else { 0.0 }
    }

    fn largest_gain(&self, columns: &[Vec<f64>]) -> f64 {
        columns.iter().map(|c| self.gain(c)).fold(0.0, f64::max)
    }
}

/// The largest gain over the curve of regressors, and how often chance alone does as well.
fn tube(space: &Space, curve: &[Vec<f64>], dimension: f64, extra: f64) -> Option<GainTest> {
    let units: Vec<Vec<f64>> = curve.iter().filter_map(|c| space.null.direction(c)).collect();
    let length: f64 = units.windows(2).map(|w| dot(&w[0], &w[1]).abs().min(1.0).acos()).sum();
    let gain = units.iter().map(|u| dot(u, &space.residual).powi(2)).fold(0.0, f64::max);
    let share = if space.rss > 0.0 { (gain / space.rss).min(1.0) } else { 0.0 };
    let freedom = dimension - extra;
    if freedom < 1.0 {
        return None;
    }
    let student = StudentsT::new(0.0, 1.0, dimension - 1.0).ok()?;
    let t = (share * (dimension - 1.0) / (1.0 - share).max(f64::MIN_POSITIVE)).sqrt();
    let ends = 2.0 * student.cdf(-t);
    let p_value = (length / std::f64::consts::PI * (1.0 - share).powf(0.5 * (dimension - 2.0)) + ends).min(1.0);
    let f = (share / extra) / ((1.0 - share).max(f64::MIN_POSITIVE) / freedom);
    Some(GainTest { f, p_value })
}
