//! y_r ~ N(θ_r, s_r²),  θ_r ~ (1 - π) δ(0) + π N(μ, τ²):  in which robots an effect is, and how large
//!
//! y_r is the effect's size as the recordings of robot r tell it, s_r its standard deviation. π is the share of robots that have it, uniform
//! from 0 to 1, so that each number of robots from none to all is as likely before; μ ~ N(0, S²), τ log-uniform between S/100 and S, half of it
//! at the lower end, S the largest size that was found. All three are integrated over. Whatever the sizes are
//!
//! ```text
//! p(y | π, μ, τ) = Π_r ((1 - π) N(y_r; 0, s_r²) + π N(y_r; μ, s_r² + τ²)),   p(all have it) = ∫ π^n Π_r N(y_r; μ, s_r² + τ²) / ∫ p(y)
//! ```
//!
//! (Mitchell and Beauchamp, J. Amer. Stat. Assoc. 83 (1988) 1023: spike and slab.) Whether the effect is there at all the diagnosis of each recording
//! has told; here it is asked in how many robots.

use crate::math::random_effects::{Observed, spread};
use serde::Serialize;
use std::f64::consts::FRAC_PI_2;

/// Nodes over the share, the mean and the spread.
const NODES: [usize; 3] = [64, 81, 9];
/// μ is sought up to so many S.
const WIDEST: f64 = 3.0;

/// An effect over the robots.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Shared {
    /// Probability that all robots have it.
    pub all: f64,
    /// Probability that none has.
    pub none: f64,
    /// Each robot, in the order given.
    pub units: Vec<UnitShare>,
    /// Mean size over the robots that have it, with its standard deviation; unknown where none has.
    pub mean: Option<f64>,
    pub mean_std: Option<f64>,
    /// Spread of the size over the robots that have it, net of their errors, and its 95 % interval; unknown for fewer than two.
    pub spread: Option<f64>,
    pub spread_ci95: Option<[f64; 2]>,
}

/// An effect in one robot.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct UnitShare {
    /// Probability that it has the effect.
    pub probability: f64,
    /// Size by its own recordings.
    pub size: f64,
    pub std: f64,
}

impl Shared {
    /// The same with sizes that count from zero, where those that were weighed count from `null`.
    #[must_use]
    pub(super) fn above(mut self, null: f64) -> Self {
        self.mean = self.mean.map(|m| m + null);
        self.units.iter_mut().for_each(|u| u.size += null);
        self
    }
}

/// Weighs the sizes of an effect, (y, s) of each robot. None without a robot, and where sizes are not finite or standard deviations not positive.
#[must_use]
pub(crate) fn shared(sizes: &[(f64, f64)]) -> Option<Shared> {
    let n = sizes.len();
    let sound = |(y, s): &(f64, f64)| y.is_finite() && s.is_finite() && *s > 0.0;
    if n == 0 || !sizes.iter().all(sound) {
        return None;
    }
    let widest = sizes.iter().map(|(y, s)| y.abs().max(*s)).fold(0.0, f64::max);
    let ln_normal = |y: f64, variance: f64| -0.5 * (y * y / variance + variance.ln());
    let absent: Vec<f64> = sizes.iter().map(|(y, s)| ln_normal(*y, s * s)).collect();
    let mut terms = Vec::new();
    for i in 0..NODES[1] {
        let mean = WIDEST * widest * (2.0 * i as f64 / (NODES[1] - 1) as f64 - 1.0);
        for j in 0..NODES[2] {
            let std = widest * 10_f64.powf(-2.0 + 2.0 * j as f64 / (NODES[2] - 1) as f64);
            let prior = ln_normal(mean, widest * widest)
                + if j == 0 { 0.5_f64.ln() } else { (0.5 / (NODES[2] - 1) as f64).ln() };
            let ratio = sizes.iter().zip(&absent).map(|((y, s), a)| ln_normal(y - mean, s * s + std * std) - a);
            terms.push((prior, ratio.collect::<Vec<f64>>()));
        }
    }
    Some(summed(sizes, &terms))
}

/// `terms`: ln prior of each pair (μ, τ), and for each robot ln of the density with the effect over that without.
fn summed(sizes: &[(f64, f64)], terms: &[(f64, Vec<f64>)]) -> Shared {
    let n = sizes.len();
    // ln weight of each (μ, τ, π), and the probability that each robot has the effect there
    let mut nodes = Vec::new();
    for (weight, ratios) in terms {
        for k in 0..NODES[0] {
            // π = sin² φ: close nodes where nearly none or nearly all have it
            let angle = FRAC_PI_2 * (k as f64 + 0.5) / NODES[0] as f64;
            let (share, weight) = (angle.sin().powi(2), weight + (2.0 * angle).sin().ln());
            let has = |r: &f64| 1.0 / (1.0 + ((1.0 - share) / share) * (-r).exp());
            // ln((1 - π) + π e^r), also where e^r is beyond all numbers
            let ln = |r: &f64| {
                let (a, b) = ((1.0 - share).ln(), share.ln() + r);
                a.max(b) + (-(a - b).abs()).exp().ln_1p()
            };
            let each: Vec<f64> = ratios.iter().map(has).collect();
            nodes.push((weight + ratios.iter().map(ln).sum::<f64>(), each));
        }
    }
    let top = nodes.iter().map(|node| node.0).fold(f64::NEG_INFINITY, f64::max);
    let total: f64 = nodes.iter().map(|node| (node.0 - top).exp()).sum();
    let over =
        |of: &dyn Fn(&[f64]) -> f64| nodes.iter().map(|node| (node.0 - top).exp() * of(&node.1)).sum::<f64>() / total;
    let probabilities: Vec<f64> = (0..n).map(|r| over(&|each| each[r])).collect();
    let all = over(&|each| each.iter().product());
    let none = over(&|each| each.iter().map(|p| 1.0 - p).product());
    let have: Vec<_> = (0..n).filter(|r| probabilities[*r] >= 0.5).collect();
    let observed: Vec<_> = have.iter().map(|r| Observed::number(sizes[*r].0, sizes[*r].1)).collect();
    let among = spread(&observed);
    let mean = match (&among, &have[..]) {
        (Some(s), _) => Some((s.mean[0], s.mean_covariance[0].sqrt())),
        (None, [one]) => Some(sizes[*one]),
        _ => None,
    };
    let unit = |(&(size, std), probability): (&(f64, f64), f64)| UnitShare { probability, size, std };
    Shared {
        all,
        none,
        units: sizes.iter().zip(probabilities).map(unit).collect(),
        mean: mean.map(|m| m.0),
        mean_std: mean.map(|m| m.1),
        spread: among.map(|s| s.std),
        spread_ci95: among.map(|s| s.ci95),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Stream;

    #[test]
    fn one_robot_or_all_of_them() {
        let of = |sizes: &[f64]| shared(&sizes.iter().map(|y| (*y, 0.1)).collect::<Vec<_>>()).unwrap();
        let common = of(&[1.0, 1.1, 0.95, 1.05, 0.9]);
        assert!(common.all > 0.95 && common.none < 1e-6, "{common:?}");
        assert!((common.mean.unwrap() - 1.0).abs() < 0.1 && common.spread_ci95.unwrap()[0] == 0.0);
        let own = of(&[0.05, -0.1, 1.0, 0.1, 0.0]);
        assert!(own.all < 0.01 && own.units[2].probability > 0.99, "{own:?}");
        assert!(own.units.iter().enumerate().all(|(r, u)| r == 2 || u.probability < 0.3), "{own:?}");
        assert_eq!((own.mean, own.mean_std, own.spread), (Some(1.0), Some(0.1), None));
        // sizes of robots that all have it may differ
        let spread = of(&[1.0, 2.0, 3.0, 1.5, 2.5]);
        assert!(spread.all > 0.9 && spread.spread_ci95.unwrap()[0] > 0.3, "{spread:?}");
        assert_eq!((shared(&[]), shared(&[(1.0, 0.0)]), shared(&[(f64::NAN, 1.0)])), (None, None, None));
    }

    /// A recording that tells little of the size takes over what the others say, and one without a size is left open.
    #[test]
    fn a_robot_that_tells_little_leans_on_the_others() {
        let with = |weak: (f64, f64)| {
            let mut sizes = vec![(1.0, 0.1); 6];
            sizes.push(weak);
            shared(&sizes).unwrap().units[6].probability
        };
        assert!(with((0.9, 0.6)) > 0.9);
        assert!(with((0.0, 5.0)) > 0.7);
        assert!(with((0.0, 0.1)) < 0.2);
    }

    /// Of robots that the model itself draws, those of probability p have the effect with probability p.
    #[test]
    fn probabilities_are_calibrated() {
        let mut draw = Stream::new(7, 0);
        let (mut expected, mut variance, mut have, mut brier) = (0.0, 0.0, 0.0, 0.0);
        let mut count = 0.0;
        for _ in 0..400 {
            let (share, mean) = (draw.uniform(), draw.normal());
            let std = 0.1 * draw.uniform();
            let truth: Vec<bool> = (0..6).map(|_| draw.uniform() < share).collect();
            let size = |has: &bool| if *has { mean + std * draw.normal() } else { 0.0 };
            let sizes: Vec<f64> = truth.iter().map(size).collect();
            let seen: Vec<(f64, f64)> = sizes.iter().map(|size| (size + 0.3 * draw.normal(), 0.3)).collect();
            for (unit, has) in shared(&seen).unwrap().units.iter().zip(&truth) {
                let (p, has) = (unit.probability, f64::from(*has));
                (expected, have, count) = (expected + p, have + has, count + 1.0);
                variance += p * (1.0 - p);
                brier += (p - has).powi(2);
            }
        }
        // fleets are drawn apart, robots of one are not: six of them may err together
        assert!((have - expected).abs() < 4.0 * (6.0 * variance).sqrt(), "{have} of {count}, {expected:.0} told");
        assert!(brier / count < 0.25, "no better than a coin: {:.3}", brier / count);
    }
}
