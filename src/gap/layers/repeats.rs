//! Exact repetitions: a continuous reading hardly ever takes the same value twice in a row, or one value many times
//!
//! Free forms beside the lattice: held (stuck) samples, clipping and dead bands leave exactly equal values.

use std::collections::HashMap;

/// Exactly equal readings.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Repeats {
    /// Readings that equal the one before.
    pub held: usize,
    /// How often the most frequent value occurs.
    pub most: usize,
    /// That value, rad/s.
    pub value_rad_s: f64,
    /// Whether it is the largest or the smallest reading.
    pub extreme: bool,
    /// Evidence in nats over a continuous reading.
    pub ln_evidence: f64,
}

/// Counts them. `std` is the noise's standard deviation: readings are kept to a part of it, `resolution`, that a number of
/// the file's precision can tell.
#[must_use]
pub fn judge(recorded: &[f64], std: f64) -> Repeats {
    let n = recorded.len();
    let single = recorded.iter().all(|v| f64::from(*v as f32) == *v);
    let largest = recorded.iter().copied().filter(|v| v.is_finite()).fold(0.0, |a: f64, v| a.max(v.abs()));
    let resolution = largest * if single { f64::from(f32::EPSILON) } else { f64::EPSILON };
    // two normal readings agree to the resolution with probability resolution / (2 √π σ)
    let chance = (resolution / (3.54 * std)).clamp(1e-12, 1.0);
    let held = recorded.windows(2).filter(|w| w[0] == w[1]).count();
    let mut counts: HashMap<u64, usize> = HashMap::with_capacity(n);
    recorded.iter().filter(|v| v.is_finite()).for_each(|v| *counts.entry(v.to_bits()).or_default() += 1);
    let (bits, most) = counts.into_iter().max_by_key(|c| (c.1, c.0)).unwrap_or((0, 0));
    let value_rad_s = f64::from_bits(bits);
    let beyond = |f: &dyn Fn(f64) -> bool| recorded.iter().all(|v| !f(*v));
    let extreme = beyond(&|v| v > value_rad_s) || beyond(&|v| v < value_rad_s);
    // Poisson tails: k or more where `expected` are: ln p ≈ k ln(expected e/k) - expected
    let tail = |k: usize, expected: f64| {
        let k = k as f64;
        if k > 2.0 && k > 3.0 * expected { -(k * (expected * std::f64::consts::E / k).ln() - expected) } else { 0.0 }
    };
    let pairs = tail(held, n as f64 * chance);
    // any one of n values met so often by the others
    let often = (tail(most.saturating_sub(1), n as f64 * chance * 2.0) - (n.max(1) as f64).ln()).max(0.0);
    Repeats { held, most, value_rad_s, extreme, ln_evidence: pairs.max(often) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Stream;

    #[test]
    fn clipping_and_holding_show_and_noise_does_not() {
        let mut draw = Stream::new(2, 0);
        let noise: Vec<f64> = (0..20_000).map(|_| 1e-3 * draw.normal()).collect();
        assert_eq!(judge(&noise, 1e-3).ln_evidence, 0.0);
        let clipped: Vec<f64> = noise.iter().map(|v| v.min(3e-3)).collect();
        let found = judge(&clipped, 1e-3);
        assert!(found.ln_evidence > 50.0 && found.extreme && found.value_rad_s == 3e-3);
        let mut held = noise;
        (0..10).for_each(|i| held[1000 * i + 1] = held[1000 * i]);
        assert!(judge(&held, 1e-3).ln_evidence > 50.0);
    }
}
