//! S = Σ_x z(x)², and its excess over that of simulated recordings against each other

use super::measure::{Recipe, Scatter};
use crate::gap::rest::predictive::curve::Curve;

/// No single point counts for more than this many standard deviations.
const LARGEST_Z: f64 = 1e3;
/// An excess counts from so many standard deviations of the simulated recordings' own on.
const THRESHOLD: f64 = 4.0;
/// Part of the excess that [`Curve::most_in`] holds.
const MOST: f64 = 0.8;

/// The curve of `recipe`; `nominal` and `augmented` hold the values of one simulated recording each.
pub(super) fn curve(recipe: &Recipe, recorded: &[f64], nominal: &[Vec<f64>], augmented: &[Vec<f64>]) -> Curve {
    let before = Against::new(recipe.scatter, recorded, nominal);
    let after = Against::new(recipe.scatter, recorded, augmented);
    let most_in = (before.excess > 0.0).then(|| {
        let [first, last] = shortest(&before.by_point);
        [recipe.bins[first][0], recipe.bins[last][1]]
    });
    Curve {
        over: recipe.over,
        x_unit: recipe.x_unit.into(),
        shown: recipe.shown,
        unit: recipe.unit.into(),
        x: recipe.x.clone(),
        bins: recipe.bins.clone(),
        recorded: recorded.to_vec(),
        outside_before: outside(recorded, &before.band),
        outside_after: outside(recorded, &after.band),
        before: before.band,
        after: after.band,
        excess_before: before.excess,
        excess_after: after.excess,
        share: 0.0,
        most_in,
    }
}

fn outside(recorded: &[f64], band: &[[f64; 2]]) -> f64 {
    let out = recorded.iter().zip(band).filter(|(v, [low, high])| !(*low..=*high).contains(v)).count();
    out as f64 / recorded.len().max(1) as f64
}

/// The recording against the recordings of one simulator.
struct Against {
    band: Vec<[f64; 2]>,
    excess: f64,
    /// Excess of each point.
    by_point: Vec<f64>,
}

impl Against {
    fn new(scatter: Scatter, recorded: &[f64], simulated: &[Vec<f64>]) -> Self {
        let logs = simulated.len() as f64;
        let points = recorded.len();
        let scale = |v: f64| match scatter {
            Scatter::Normal => v,
            Scatter::Logarithmic => v.max(f64::MIN_POSITIVE).ln(),
            Scatter::Counts(of) => v * of,
        };
        // z² of a value that is not among those that mean and variance come from; of a count, Poisson's deviance
        let z2 = |value: f64, mean: f64, variance: f64, from: f64| match scatter {
            Scatter::Counts(_) => {
                let expected = mean.max(0.5 / from);
                let gain = if value > 0.0 { value * (value / expected).ln() } else { 0.0 };
                2.0 * (gain - (value - expected))
            }
            _ if value == mean => 0.0,
            _ => ((value - mean).powi(2) / (variance * (1.0 + 1.0 / from))).min(LARGEST_Z * LARGEST_Z),
        };
        let mut band = Vec::with_capacity(points);
        let mut of_recorded = Vec::with_capacity(points);
        let mut of_simulated = vec![0.0; simulated.len()];
        for (i, value) in recorded.iter().enumerate() {
            let column: Vec<f64> = simulated.iter().map(|log| log[i]).collect();
            band.push(column.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], v| [l.min(*v), h.max(*v)]));
            let column: Vec<f64> = column.into_iter().map(scale).collect();
            let mean = column.iter().sum::<f64>() / logs;
            let squares: f64 = column.iter().map(|v| (v - mean).powi(2)).sum();
            of_recorded.push(z2(scale(*value), mean, squares / (logs - 1.0), logs));
            for (s, v) in of_simulated.iter_mut().zip(&column) {
                // mean and variance of the others
                let others = mean - (v - mean) / (logs - 1.0);
                let variance = (squares - logs / (logs - 1.0) * (v - mean).powi(2)).max(0.0) / (logs - 2.0);
                *s += z2(*v, others, variance, logs - 1.0);
            }
        }
        let expected = of_simulated.iter().sum::<f64>() / logs;
        let std = (of_simulated.iter().map(|s| (s - expected).powi(2)).sum::<f64>() / (logs - 1.0)).sqrt();
        let largest = of_simulated.iter().copied().fold(0.0, f64::max);
        let sum: f64 = of_recorded.iter().sum();
        let excess = if sum > largest.max(expected + THRESHOLD * std) { sum - expected } else { 0.0 };
        let each = expected / points.max(1) as f64;
        Self { band, excess, by_point: of_recorded.iter().map(|z2| (z2 - each).max(0.0)).collect() }
    }
}

/// First and last point of the shortest stretch that holds [`MOST`] of the sum.
fn shortest(excess: &[f64]) -> [usize; 2] {
    let needed = MOST * excess.iter().sum::<f64>();
    let mut best = [0, excess.len().saturating_sub(1)];
    let (mut first, mut held) = (0, 0.0);
    for (last, e) in excess.iter().enumerate() {
        held += e;
        while first < last && held - excess[first] >= needed {
            held -= excess[first];
            first += 1;
        }
        if held >= needed && last - first < best[1] - best[0] {
            best = [first, last];
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shortest_stretch_is_found() {
        assert_eq!(shortest(&[0.0, 1.0, 9.0, 8.0, 0.5, 1.0]), [2, 3]);
        assert_eq!(shortest(&[5.0, 0.0, 0.0, 5.0]), [0, 3]);
        assert_eq!(shortest(&[7.0]), [0, 0]);
    }

    #[test]
    fn what_no_simulated_recording_has_is_an_excess_of_counts() {
        let simulated = vec![vec![0.5, 0.5, 0.0]; 39];
        let seen = Against::new(Scatter::Counts(1000.0), &[0.495, 0.495, 0.01], &simulated);
        // ten where at most half a one in 39 recordings is expected: 2 (10 ln(10 · 78) - 10 + 1/78)
        assert!((seen.by_point[2] - 113.2).abs() < 0.1, "{:?}", seen.by_point);
        assert!(seen.by_point[0] < 1.0 && seen.excess > 50.0);
    }
}
