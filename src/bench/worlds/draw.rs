//! Draws that the generator needs beside uniform and normal ones.

use crate::math::random::Stream;

/// Uniform between the two.
pub(super) fn between(s: &mut Stream, low: f64, high: f64) -> f64 {
    low + (high - low) * s.uniform()
}

/// Its logarithm is uniform.
pub(super) fn log_between(s: &mut Stream, low: f64, high: f64) -> f64 {
    low * (high / low).powf(s.uniform())
}

/// Plus or minus one.
pub(super) fn sign(s: &mut Stream) -> f64 {
    if s.uniform() < 0.5 { -1.0 } else { 1.0 }
}

/// True with this probability.
pub(super) fn chance(s: &mut Stream, probability: f64) -> bool {
    s.uniform() < probability
}

/// Below `n`.
pub(super) fn index(s: &mut Stream, n: usize) -> usize {
    ((s.uniform() * n as f64) as usize).min(n.saturating_sub(1))
}

/// Exponential with mean one.
pub(super) fn exponential(s: &mut Stream) -> f64 {
    -(1.0 - s.uniform()).ln()
}

/// Gamma with mean one and integer-or-half shape k/2: a sum of k squared normals over k.
pub(super) fn gamma_halves(s: &mut Stream, halves: usize) -> f64 {
    let k = halves.max(1);
    (0..k).map(|_| s.normal().powi(2)).sum::<f64>() / k as f64
}

/// `value` with `digits` significant digits: what a person would have written into a file.
pub(super) fn rounded(value: f64, digits: usize) -> f64 {
    format!("{value:.*e}", digits.saturating_sub(1)).parse().unwrap_or(value)
}
