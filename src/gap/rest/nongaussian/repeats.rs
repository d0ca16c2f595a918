//! Exact repetitions: a continuous reading hardly ever takes the same value twice in a row, or one value many times
//!
//! Free forms beside the lattice: held (stuck) samples, clipping and dead bands leave exactly equal values.

use crate::math::robust::mad_std;
use std::f64::consts::{SQRT_2, TAU};

/// Exactly equal readings.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Repeats {
    /// Readings that equal the one before.
    pub held: usize,
    /// How often the value occurs that is there most beyond chance.
    pub most: usize,
    /// That value, rad/s.
    pub value_rad_s: f64,
    /// Whether it is the largest or the smallest reading.
    pub extreme: bool,
    /// Evidence in nats over a continuous reading.
    pub ln_evidence: f64,
}

/// Differences and values within this part of a standard deviation are equally dense.
const NEAR: f64 = 0.25;
/// Where the density is not that of its neighbours: a bound of the error of counting it in [`NEAR`].
const SLACK: f64 = 1.05;
/// Fewest neighbours that tell a density.
const FEWEST: f64 = 50.0;

/// ln of one over the Poisson tail: `count` or more where `expected` are.
fn tail(count: f64, expected: f64) -> f64 {
    if count > 2.0 && count > expected { count * (count / expected).ln() - (count - expected) } else { 0.0 }
}

/// Counts them. `step_rad_s` is the distance of neighbouring numbers at a value: by chance alone, readings are equal as often
/// as a cell of that width holds two of them, which the density of readings and differences close by tells. `std` is the
/// standard deviation of the noise; on steps beyond [`NEAR`] of it equal readings are the rule, and nothing is judged.
#[must_use]
pub(crate) fn judge(recorded: &[f64], std: f64, step_rad_s: impl Fn(f64) -> f64) -> Repeats {
    let differences: Vec<f64> = recorded.windows(2).map(|w| w[1] - w[0]).filter(|d| d.is_finite()).collect();
    let pairs = differences.len() as f64;
    let spread = mad_std(&mut differences.clone(), 0.0);
    let spread = if spread > 0.0 { spread } else { SQRT_2 * std };
    let steps: Vec<f64> = recorded.iter().filter(|v| v.is_finite()).map(|v| step_rad_s(*v)).collect();
    let mean_step = steps.iter().sum::<f64>() / steps.len().max(1) as f64;
    let cells = (NEAR * spread / mean_step).floor();
    if cells < 1.0 {
        return Repeats::default();
    }
    let held = differences.iter().filter(|d| **d == 0.0).count();
    let reach = (cells + 0.5) * mean_step;
    let near = differences.iter().filter(|d| **d != 0.0 && d.abs() <= reach).count() as f64;
    let cell = if near > FEWEST { near / (2.0 * cells) } else { pairs * mean_step / (TAU.sqrt() * spread) };
    let by_chance = (SLACK * cell).max(1e-12 * pairs);

    let mut sorted: Vec<f64> = recorded.iter().copied().filter(|v| v.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    // the most frequent value, and both ends, where a sensor is cut off
    let frequent = sorted.chunk_by(|a, b| a == b).max_by_key(|same| same.len()).and_then(|same| same.first());
    let rarity = |value: f64| {
        let within = |reach: f64| {
            let [low, high] = [-reach, reach].map(|by| sorted.partition_point(|v| *v < value + by));
            high - low
        };
        let step = step_rad_s(value);
        let cells = (NEAR * std / step).floor().max(1.0);
        let count = within(0.5 * step);
        let around = (within((cells + 0.5) * step) - count) as f64;
        // the end of the range has neighbours on one side only
        let extreme = sorted.first() == Some(&value) || sorted.last() == Some(&value);
        let sides = if extreme { 1.0 } else { 2.0 };
        (tail(count as f64 - 1.0, SLACK * (around + 1.0) / (sides * cells)), count, value, extreme)
    };
    let found = [sorted.first(), sorted.last(), frequent].into_iter().flatten().map(|v| rarity(*v));
    let (often, most, value_rad_s, extreme) = found.max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or_default();
    // the share that is held, and which of the values it is, are free
    let ln_rows = (recorded.len().max(1) as f64).ln();
    let ln_evidence = (tail(held as f64, by_chance) - 0.5 * ln_rows).max(often - ln_rows).max(0.0);
    Repeats { held, most, value_rad_s, extreme, ln_evidence }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Stream;

    #[test]
    fn clipping_and_holding_show_and_noise_does_not() {
        let mut draw = Stream::new(2, 0);
        let noise: Vec<f64> = (0..20_000).map(|_| 1e-3 * draw.normal()).collect();
        // as doubles, and as a file with a step of a fiftieth to a fifth of the noise has them
        for step in [1e-18, 2e-5, 5e-5, 2e-4] {
            let judge = |values: &[f64]| {
                let on: Vec<f64> = values.iter().map(|v| (v / step).round() * step).collect();
                judge(&on, 1e-3, |_| step)
            };
            assert_eq!(judge(&noise).ln_evidence, 0.0, "{step}: {:?}", judge(&noise));
            let clipped: Vec<f64> = noise.iter().map(|v| v.min(1.8e-3)).collect();
            let found = judge(&clipped);
            assert!(found.ln_evidence > 50.0 && found.extreme, "{step}: {found:?}");
            assert!((found.value_rad_s - 1.8e-3).abs() < step);
            // by chance 20 000 · step/(2 √π σ); held as many again as ten standard deviations of that
            let chance = 20_000.0 * step / 3.545e-3;
            let count = (10.0 * chance.sqrt() + 10.0) as usize;
            let mut held = noise.clone();
            (0..count).for_each(|i| held[9 * i + 1] = held[9 * i]);
            // fifty nats, less what a density that is not known to one part in twenty may be taken for
            assert!(judge(&held).ln_evidence > 10.0, "{step}: {:?}", judge(&held));
        }
    }
}
