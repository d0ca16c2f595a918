//! Worth of an experiment: evidence of every rival over every other one.

use serde::Serialize;
use statrs::distribution::{ContinuousCDF, Normal};

/// A truth and an effect that resembles it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Pair {
    /// Id of the effect that is at work.
    pub truth: String,
    /// Id of the effect that is taken for it.
    pub rival: String,
    /// Evidence of the truth over the rival to be expected, nats.
    pub nats: f64,
    /// Probability that a diagnosis tells them apart.
    pub probability: f64,
}

/// Speed and yaw rate of a course at a time; between two times both are linear.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Command {
    /// Time since the course begins, s.
    pub t_s: f64,
    /// Forward speed, m/s.
    pub speed_m_s: f64,
    /// Yaw rate, rad/s.
    pub yaw_rate_rad_s: f64,
}

impl Pair {
    /// A pair whose evidence is expected to be `nats`, where a diagnosis tells effects apart from `resolution` nats on.
    pub(super) fn new(truth: &str, rival: &str, nats: f64, resolution: f64) -> Self {
        Self { truth: truth.into(), rival: rival.into(), nats, probability: told_apart(nats, resolution) }
    }
}

/// Φ((E - g)/√(2 E)); zero without evidence.
fn told_apart(nats: f64, resolution: f64) -> f64 {
    if nats <= 0.0 { 0.0 } else { Normal::standard().cdf((nats - resolution) / (2.0 * nats).sqrt()) }
}

/// Expected evidence from which on a diagnosis that tells effects apart from `resolution` nats on does so with 90 %: E of
/// Φ((E - g)/√(2 E)) = 0.9, √(2 E) = z + √(z² + 2 g).
pub(super) fn likely_nats(resolution: f64) -> f64 {
    let z = Normal::standard().inverse_cdf(0.9);
    0.5 * (z + (z * z + 2.0 * resolution).sqrt()).powi(2)
}

/// Worth of an experiment: pairs that reach `resolution`, and the least evidence of all.
pub(super) fn worth(pairs: &[Pair], resolution: f64) -> (usize, f64) {
    let told = pairs.iter().filter(|p| p.nats >= resolution).count();
    (told, pairs.iter().map(|p| p.nats).fold(f64::INFINITY, f64::min))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Stream;

    /// Readings d + noise against readings without d: ln p1/p0 = Σ (d z - d²/2 + d²), mean E = Σ d²/2.
    #[test]
    fn the_probability_is_that_of_a_log_likelihood_ratio() {
        const ROUNDS: usize = 4000;
        const ROWS: usize = 50;
        let mut draw = Stream::new(5, 0);
        for nats in [1.0f64, 4.0, 12.0] {
            let d = (2.0 * nats / ROWS as f64).sqrt();
            let ratio = |_| (0..ROWS).map(|_| d * (d + draw.normal()) - 0.5 * d * d).sum::<f64>();
            let told = (0..ROUNDS).map(ratio).filter(|ratio| *ratio >= 3.0).count() as f64 / ROUNDS as f64;
            let p = told_apart(nats, 3.0);
            // four standard deviations of a binomial share
            assert!((told - p).abs() < 4.0 * (p * (1.0 - p) / ROUNDS as f64).sqrt() + 1e-9, "{nats}: {told} {p}");
        }
        assert_eq!(told_apart(-1.0, 3.0), 0.0);
        assert!((told_apart(likely_nats(3.0), 3.0) - 0.9).abs() < 1e-9);
    }

    #[test]
    fn the_worst_pair_counts() {
        let pair = |nats| Pair::new("a", "b", nats, 3.0);
        assert_eq!(worth(&[pair(40.0), pair(2.0)], 3.0), (1, 2.0));
        // one that tells both directions is worth more than one that tells one of them well
        assert!(worth(&[pair(4.0), pair(3.5)], 3.0) > worth(&[pair(900.0), pair(2.9)], 3.0));
    }
}
