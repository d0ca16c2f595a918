//! The lattice on which a sensor's numbers lie: x = x0 + k q.
//!
//! It is drawn through the levels that occur more than once, and counts only if nearly all samples lie on it.

use crate::math::lattice;
use crate::math::robust::{MAD_TO_STD, median, sorted};

/// Samples looked at: evenly spread over the log.
const SAMPLE: usize = 100_000;
/// A sample lies on the lattice if it is this close to a level, in steps.
const NEAR: f64 = 0.1;
/// Share of samples that have to.
const SHARE: f64 = 0.99;
/// Steps below this share of the spread change nothing that a fit could see, and are not told from decimal rounding.
const FINEST: f64 = 1e-3;

/// Step of the lattice of `values` (finite), in their unit; `None` if they lie on none that matters.
pub(crate) fn step(values: &[f64]) -> Option<f64> {
    let stride = values.len().div_ceil(SAMPLE).max(1);
    let sorted = sorted(values.iter().step_by(stride).copied());
    let largest = sorted.first()?.abs().max(sorted.last()?.abs());
    // the same level told in single precision may come out in two neighbouring numbers
    let same = 4.0 * f64::from(f32::EPSILON) * largest;
    let mut levels: Vec<f64> = Vec::new();
    for cluster in sorted.chunk_by(|a, b| b - a <= same) {
        if cluster.len() >= 2 {
            levels.push(cluster[cluster.len() / 2]);
        }
    }
    let (x0, q) = lattice::through(&levels)?;
    let on = sorted.iter().filter(|&&x| lattice::off((x0, q), x) <= NEAR + same / q);
    if (on.count() as f64) < SHARE * sorted.len() as f64 || same > q / 4.0 {
        return None;
    }
    let middle = median(&mut sorted.clone());
    let mut deviations: Vec<f64> = sorted.iter().map(|x| (x - middle).abs()).collect();
    (q > FINEST * MAD_TO_STD * median(&mut deviations)).then_some(q)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Stream;

    fn noise(n: usize, std: f64) -> Vec<f64> {
        let mut s = Stream::new(3, 1);
        (0..n).map(|_| 0.02 + std * s.normal()).collect()
    }

    #[test]
    fn steps_of_common_sensors_are_found_in_double_and_single_precision() {
        for per_lsb in [1.0 / 131.0, 0.0175, 0.05, 1.0 / 32.8] {
            let q = per_lsb * crate::units::RAD_S_PER_DEG_S;
            for std in [0.4 * q, 2.0 * q, 30.0 * q] {
                let exact: Vec<f64> = noise(20_000, std).iter().map(|x| (x / q).round() * q).collect();
                let single: Vec<f64> = exact.iter().map(|&x| f64::from(x as f32)).collect();
                for values in [&exact, &single] {
                    let found = step(values).unwrap();
                    assert!((found / q - 1.0).abs() < 1e-4, "{found} {q} {std}");
                }
            }
        }
    }

    #[test]
    fn plain_noise_lies_on_no_lattice() {
        let plain = noise(50_000, 1e-3);
        assert_eq!(step(&plain), None);
        let single: Vec<f64> = plain.iter().map(|&x| f64::from(x as f32)).collect();
        assert_eq!(step(&single), None);
        // nine decimals are a lattice of no consequence
        let text: Vec<f64> = plain.iter().map(|x| (x * 1e9).round() * 1e-9).collect();
        assert_eq!(step(&text), None);
    }

    #[test]
    fn outliers_do_not_hide_the_lattice() {
        let q = 1e-3;
        let mut values: Vec<f64> = noise(10_000, 2e-3).iter().map(|x| (x / q).round() * q).collect();
        values[500] = 0.123_456;
        assert!((step(&values).unwrap() / q - 1.0).abs() < 1e-6);
    }
}
