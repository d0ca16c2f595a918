//! w ~ (1 - p) N(0, s²) + p ∫ N(±a, s²) dG(a), G any law of sizes from [`LEAST`] standard deviations up
//!
//! The distribution of false samples is unknown: a fixed size, exponential, on one side or both. It is estimated with p
//! by non-parametric maximum likelihood (Kiefer and Wolfowitz, Ann. Math. Statist. 27 (1956) 887), by expectation
//! maximisation over a grid of sizes; the interval of p is that of its profile likelihood. A normal distribution would
//! also count expected false samples that are too small to be seen.

use super::interval::Estimate;
use crate::math::NORMAL_975;
use std::f64::consts::TAU;

/// Smallest size of a false sample, in standard deviations of the noise; smaller ones cannot be told from noise.
pub(super) const LEAST: f64 = 4.0;
/// Ratio of neighbouring sizes.
const NEXT: f64 = 1.2;
/// Largest relative deviation of the noise's level from one.
const LEVEL: f64 = 0.03;
/// Most steps of expectation and maximisation, and rounds in which the level is estimated anew.
const ROUNDS: usize = 300;
const LEVEL_ROUNDS: usize = 4;
/// Value of p that stands for no false samples.
const NONE: f64 = 1e-12;
/// Range of p.
const RANGE: [f64; 2] = [1e-7, 0.3];

/// Estimated rare (false) samples.
pub(super) struct Rare {
    /// Probability of a sample to be false.
    pub probability: Estimate,
    /// Root mean square of the values added to them, in standard deviations of the noise.
    pub size: Estimate,
    /// Gain in log-likelihood over noise alone.
    pub gain_nats: f64,
}

/// |w| in bins, and the densities of noise and of each size there.
struct Mixture {
    centre: Vec<f64>,
    count: Vec<f64>,
    sizes: Vec<f64>,
    /// Standard deviation of the noise, near one.
    level: f64,
    quiet: Vec<f64>,
    rare: Vec<Vec<f64>>,
}

impl Mixture {
    fn new(w: &[f64]) -> Self {
        /// Width of a bin, in standard deviations, and the size from which on bins are equal in ln size instead.
        const WIDTH: f64 = 0.05;
        const LINEAR: f64 = 8.0;
        let mut bins: std::collections::BTreeMap<i64, (f64, f64)> = std::collections::BTreeMap::new();
        let mut largest = LEAST;
        for a in w.iter().map(|v| v.abs()).filter(|a| a.is_finite()) {
            let key = if a < LINEAR {
                (a / WIDTH) as i64
            } else {
                (LINEAR / WIDTH) as i64 + ((a / LINEAR).ln() * LINEAR / WIDTH) as i64
            };
            let bin = bins.entry(key).or_default();
            bin.0 += 1.0;
            bin.1 += a * a;
            largest = largest.max(a);
        }
        let sizes =
            std::iter::successors(Some(LEAST), |a| Some(a * NEXT)).take_while(|a| *a < NEXT * largest).collect();
        let mut mixture = Self {
            centre: bins.values().map(|b| (b.1 / b.0).sqrt()).collect(),
            count: bins.values().map(|b| b.0).collect(),
            sizes,
            level: 1.0,
            quiet: Vec::new(),
            rare: Vec::new(),
        };
        mixture.set_level(1.0);
        mixture
    }

    fn set_level(&mut self, level: f64) {
        self.level = level;
        self.quiet = self.centre.iter().map(|x| self.quiet(*x)).collect();
        self.rare = self.centre.iter().map(|x| self.sizes.iter().map(|a| self.density(*x, *a)).collect()).collect();
    }

    /// Density at |w| = `x` of a false sample of the size `size`. Large neighbouring sizes are further apart than the
    /// noise is wide: each node is widened to the interval of sizes that it stands for.
    fn density(&self, x: f64, size: f64) -> f64 {
        let wide = self.level * self.level + (size * (NEXT - 1.0)).powi(2) / 12.0;
        let one = |d: f64| (-0.5 * d * d / wide).exp();
        (one(x - size) + one(x + size)) / (TAU * wide).sqrt()
    }

    fn quiet(&self, x: f64) -> f64 {
        2.0 * (-0.5 * (x / self.level).powi(2)).exp() / (TAU.sqrt() * self.level)
    }

    /// Expectation maximisation from the distribution of sizes `weights`, which it improves, and over `p` if `free`.
    /// Returns ln p(w), and the variance that the noise would have if it were free.
    fn climb(&self, p: &mut f64, free: bool, weights: &mut [f64]) -> [f64; 2] {
        let mut last = [f64::NEG_INFINITY, 1.0];
        let mut sums = vec![0.0; weights.len()];
        for _ in 0..ROUNDS {
            sums.fill(0.0);
            let (mut ln, mut total, mut square, mut calm) = (0.0, 0.0, 0.0, 0.0);
            for ((x, n), (quiet, rare)) in self.centre.iter().zip(&self.count).zip(self.quiet.iter().zip(&self.rare)) {
                let quiet = (1.0 - *p) * quiet;
                let loud: f64 = *p * rare.iter().zip(weights.iter()).map(|(d, w)| d * w).sum::<f64>();
                let all = (quiet + loud).max(1e-300);
                ln += n * all.ln();
                let share = n * quiet / all;
                calm += share;
                square += share * x * x;
                total += n;
                let factor = n * *p / all;
                sums.iter_mut().zip(rare.iter().zip(weights.iter())).for_each(|(s, (d, w))| *s += factor * d * w);
            }
            let sum: f64 = sums.iter().sum();
            if sum > 0.0 {
                weights.iter_mut().zip(&sums).for_each(|(w, s)| *w = s / sum);
            }
            if free {
                *p = (1.0 - calm / total).clamp(RANGE[0], RANGE[1]);
            }
            let gained = ln - last[0];
            last = [ln, square / calm.max(1e-300)];
            if gained < 1e-4 {
                break;
            }
        }
        last
    }
}

/// Estimates the rare samples of a whitened series; none where it has no samples.
pub(super) fn judge(w: &[f64]) -> Option<Rare> {
    let mut mixture = Mixture::new(w);
    let n: f64 = mixture.count.iter().sum();
    if !(n > 0.0) {
        return None;
    }
    let mut law = vec![1.0 / mixture.sizes.len() as f64; mixture.sizes.len()];
    let mut p = 1e-3;
    for _ in 0..LEVEL_ROUNDS {
        let [_, variance] = mixture.climb(&mut p, true, &mut law);
        mixture.set_level(variance.sqrt().clamp(1.0 - LEVEL, 1.0 + LEVEL));
    }
    let [top, _] = mixture.climb(&mut p, true, &mut law);
    let at = |ln_p: f64| mixture.climb(&mut ln_p.exp(), false, &mut law.clone())[0];
    let none = at(NONE.ln());
    // samples in clusters tell less than as many single ones: compound Poisson
    let drop = 0.5 * NORMAL_975 * NORMAL_975 * clusters(w, p, &law, &mixture);
    let end = |sign: f64| {
        // doubled until outside, then halved
        let (mut inside, mut by) = (0.0, 0.1);
        while at(p.ln() + sign * by) > top - drop && by < 20.0 {
            (inside, by) = (by, 2.0 * by);
        }
        for _ in 0..8 {
            let middle = 0.5 * (inside + by);
            if at(p.ln() + sign * middle) > top - drop { inside = middle } else { by = middle }
        }
        (p.ln() + sign * 0.5 * (inside + by)).exp().clamp(0.0, 1.0)
    };
    let ci95 = [end(-1.0), end(1.0)];
    let probability = Estimate { estimate: p, std: 0.5 * (ci95[1] - ci95[0]) / NORMAL_975, ci95 };
    let moment = |k: i32| law.iter().zip(&mixture.sizes).map(|(w, a)| w * a.powi(k)).sum::<f64>();
    let (square, fourth, count) = (moment(2), moment(4), (n * p).max(1.0));
    // from the scatter of the sizes, and from the noise on each
    let relative = ((0.25 * (fourth / (square * square) - 1.0)).max(0.0) + 1.0 / square) / count;
    let size = Estimate::normal(square.sqrt(), (square * relative).sqrt(), true);
    Some(Rare { probability, size, gain_nats: (top - none).max(0.0) })
}

/// E c²/E c of the lengths c of runs of samples that are more probably false than not; at least one.
fn clusters(w: &[f64], p: f64, law: &[f64], mixture: &Mixture) -> f64 {
    let is_rare = |v: &f64| {
        let a = v.abs();
        let one = |(w, size): (&f64, &f64)| w * mixture.density(a, *size);
        a > LEAST && p * law.iter().zip(&mixture.sizes).map(one).sum::<f64>() > (1.0 - p) * mixture.quiet(a)
    };
    let (mut run, mut sum, mut squares) = (0.0_f64, 0.0, 0.0);
    for v in w.iter().chain([&0.0]) {
        if is_rare(v) {
            run += 1.0;
        } else if run > 0.0 {
            sum += run;
            squares += run * run;
            run = 0.0;
        }
    }
    if sum > 0.0 { (squares / sum).max(1.0) } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Stream;

    #[test]
    fn the_share_is_right_whatever_the_law_of_sizes() {
        let (n, p) = (40_000, 4e-3);
        let laws: [fn(f64) -> f64; 3] = [|_| 9.0, |u| 5.0 - 5.0 * u.ln(), |u| 30.0 * (0.7 + 0.6 * u)];
        for (k, law) in laws.iter().enumerate() {
            let mut draw = Stream::new(3 + k as u64, 0);
            let (mut w, mut count) = (Vec::new(), 0.0);
            for _ in 0..n {
                let rare = draw.uniform() < p;
                count += f64::from(u8::from(rare));
                let size = law(draw.uniform().max(1e-9));
                let sign = if draw.uniform() < 0.5 { 1.0 } else { -1.0 };
                w.push(draw.normal() + if rare { sign * size } else { 0.0 });
            }
            let found = judge(&w).unwrap().probability;
            // all of these are seen: the remaining error is that of the drawn count
            let share = count / f64::from(n);
            assert!((found.estimate / share - 1.0).abs() < 0.06, "law {k}: {found:?}, drawn {share}");
            let poisson = (p / f64::from(n)).sqrt();
            assert!((found.std / poisson - 1.0).abs() < 0.15, "law {k}: {found:?}, Poisson {poisson}");
        }
    }

    #[test]
    fn noise_has_none_and_clusters_tell_less() {
        let mut draw = Stream::new(11, 0);
        let noise: Vec<f64> = (0..40_000).map(|_| draw.normal()).collect();
        let found = judge(&noise).unwrap();
        assert!(found.gain_nats < 3.0 && found.probability.estimate < 3e-4, "{:?}", found.probability);
        let with = |cluster: usize| {
            let mut w = noise.clone();
            (0..120 / cluster).for_each(|k| (0..cluster).for_each(|c| w[331 * k * cluster + c] += 12.0));
            judge(&w).unwrap().probability
        };
        let (single, triple) = (with(1), with(3));
        let wider = |e: Estimate| (e.ci95[1] / e.ci95[0]).ln();
        assert!((wider(triple) / wider(single) - 3.0_f64.sqrt()).abs() < 0.15, "{single:?} {triple:?}");
    }
}
