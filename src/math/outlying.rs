//! z_i = |y_i - m|/√(s_i² + τ²): which of n numbers with known errors s_i is not of one normal population with the others
//!
//! τ, the spread beyond the errors, is where the quartile of the differences of pairs, |y_i - y_j|/√(s_i² + s_j² + 2τ²), is that
//! of normal numbers: Qn of Rousseeuw and Croux (J. American Statistical Association 88 (1993) 1273), its order statistic and
//! breakdown point of one half included, for numbers of unequal errors. m is the median, weighted by 1/√(s_i² + τ²). Neither
//! follows a minority of wild numbers, which therefore do not hide themselves or each other.
//!
//! The distribution of the largest z of an ordinary population is found by simulation: drawn normal with these s_i and this τ, the same
//! is done to each draw. p_i = (1 + draws whose largest z is at least z_i)/(1 + draws) allows for the n numbers that were looked
//! at: an ordinary population has a p_i below α with probability α (exactly where the s_i are equal: z then knows no scale).

use super::brent;
use super::random::Stream;
use rayon::prelude::*;

/// How far a number lies from the others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Outlying {
    /// (y - m)/√(s² + τ²), with its sign.
    pub studentized: f64,
    /// Probability that the largest of an ordinary population lies as far.
    pub p_value: f64,
}

/// Fewer numbers have no majority to differ from.
pub(crate) const FEWEST: usize = 5;

/// Φ⁻¹(5/8): below it lies a quarter of the sizes of standard normal numbers.
const QUARTER: f64 = 0.318_639_363_964_375_16;
/// Beyond so many numbers each is paired with `PARTNERS` others instead of all.
const ALL_PAIRS: usize = 65;
const PARTNERS: usize = 32;

/// Holds each of `values`, with the standard deviations `errors` of their own errors, against the others by `draws` simulated
/// populations. `None` for fewer than [`FEWEST`], for numbers that are not finite, and where more than half are the same without error.
#[must_use]
pub(crate) fn outlying(values: &[f64], errors: &[f64], draws: usize, seed: u64) -> Option<Vec<Outlying>> {
    let n = values.len();
    let usable = |e: &f64| e.is_finite() && *e >= 0.0;
    if n < FEWEST || errors.len() != n || !values.iter().all(|v| v.is_finite()) || !errors.iter().all(usable) {
        return None;
    }
    let pairs = pairs(n, seed);
    let (z, std) = studentized(values, errors, &pairs)?;
    let largest = |draw: usize| {
        let mut stream = Stream::new(seed, 1 + draw as u64);
        let drawn: Vec<f64> = errors.iter().map(|s| s.hypot(std) * stream.normal()).collect();
        let z = studentized(&drawn, errors, &pairs);
        z.map_or(f64::INFINITY, |(z, _)| z.iter().fold(0.0, |m: f64, z| m.max(z.abs())))
    };
    let largest: Vec<f64> = (0..draws).into_par_iter().map(largest).collect();
    let p_value = |z: f64| {
        let beyond = largest.iter().filter(|m| **m >= z.abs()).count();
        (1 + beyond) as f64 / (1 + draws) as f64
    };
    Some(z.into_iter().map(|z| Outlying { studentized: z, p_value: p_value(z) }).collect())
}

/// Pairs whose differences are looked at: all, or where that would be too many a random part, because neighbours in a list may be alike.
fn pairs(n: usize, seed: u64) -> Vec<(usize, usize)> {
    if n <= ALL_PAIRS {
        return (0..n).flat_map(|i| (0..i).map(move |j| (i, j))).collect();
    }
    let mut order: Vec<usize> = (0..n).collect();
    Stream::new(seed, 0).shuffle(&mut order);
    let partner = |i: usize| (1..=PARTNERS).map(move |d| (i, (i + d) % n));
    (0..n).flat_map(partner).map(|(i, j)| (order[i], order[j])).collect()
}

/// z with their signs, and τ.
fn studentized(values: &[f64], errors: &[f64], pairs: &[(usize, usize)]) -> Option<(Vec<f64>, f64)> {
    let std = robust_spread(values, errors, pairs)?;
    let scale: Vec<f64> = errors.iter().map(|s| s.hypot(std)).collect();
    if scale.iter().any(|s| !(*s > 0.0)) {
        return None;
    }
    let m = weighted_median(values, &scale);
    Some((values.iter().zip(&scale).map(|(y, s)| (y - m) / s).collect(), std))
}

fn robust_spread(values: &[f64], errors: &[f64], pairs: &[(usize, usize)]) -> Option<f64> {
    let n = values.len() as f64;
    // of all pairs, those of the closer half of the numbers
    let half = (n / 2.0).floor() + 1.0;
    let share = half * (half - 1.0) / (n * (n - 1.0));
    let rank = ((share * pairs.len() as f64).round() as usize).clamp(1, pairs.len()) - 1;
    let squares: Vec<[f64; 2]> = pairs
        .iter()
        .map(|(i, j)| [(values[*i] - values[*j]).powi(2), errors[*i].powi(2) + errors[*j].powi(2)])
        .collect();
    let mut buffer = Vec::with_capacity(pairs.len());
    let mut ranked = |of: &dyn Fn(&[f64; 2]) -> f64| {
        buffer.clear();
        buffer.extend(squares.iter().map(of));
        *buffer.select_nth_unstable_by(rank, f64::total_cmp).1
    };
    // without errors; theirs are between the smallest and the largest
    let whole = ranked(&|s| s[0]) / (2.0 * QUARTER * QUARTER);
    let extreme = errors.iter().fold([f64::INFINITY, 0.0], |[a, b]: [f64; 2], s| [a.min(*s), b.max(*s)]);
    let [high, low] = extreme.map(|s| (whole - s * s).max(0.0).sqrt());
    if high - low <= 1e-9 * high {
        return Some(high);
    }
    let ranked = std::cell::RefCell::new(ranked);
    let f = |std: f64| {
        let at = |s: &[f64; 2]| s[0] / (s[1] + 2.0 * std * std);
        (ranked.borrow_mut())(&at).sqrt() - QUARTER
    };
    if f(low) <= 0.0 {
        return Some(low);
    }
    brent::root(f, low, high, 1e-6 * high).map(|r| r.x)
}

/// Σ |y - m|/σ is smallest there.
fn weighted_median(values: &[f64], scale: &[f64]) -> f64 {
    let mut order: Vec<(f64, f64)> = values.iter().zip(scale).map(|(y, s)| (*y, 1.0 / s)).collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half = 0.5 * order.iter().map(|o| o.1).sum::<f64>();
    let mut sum = 0.0;
    for (k, (y, w)) in order.iter().enumerate() {
        sum += w;
        // two in the middle share it
        if (sum - half).abs() <= 1e-12 * half && k + 1 < order.len() {
            return 0.5 * (y + order[k + 1].0);
        }
        if sum > half {
            return *y;
        }
    }
    order.last().map_or(f64::NAN, |o| o.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn population(n: usize, spread: f64, errors: &[f64], seed: u64) -> Vec<f64> {
        let mut draw = Stream::new(seed, 77);
        (0..n).map(|i| 3.0 + spread * draw.normal() + errors[i] * draw.normal()).collect()
    }

    /// How many of `runs` ordinary populations have a p value of 0.05 at most.
    fn alarms(runs: u64, spread: f64, errors: &[f64]) -> f64 {
        let alarm = |seed: &u64| {
            let values = population(errors.len(), spread, errors, *seed);
            let found = outlying(&values, errors, 199, 1000 + seed).unwrap();
            found.iter().any(|o| o.p_value <= 0.05)
        };
        (0..runs).filter(alarm).count() as f64 / runs as f64
    }

    #[test]
    #[ignore = "battery: some seconds"]
    fn battery_ordinary_populations_raise_their_stated_rate() {
        // 0.05 within three binomial standard deviations; seeds 0 to 999
        let runs = 1000;
        let bound = 3.0 * (0.05 * 0.95 / runs as f64).sqrt();
        let mixed = [0.2, 0.3, 0.5, 0.5, 0.6, 0.8, 1.0, 1.2, 1.5, 2.0];
        for (spread, errors) in [(1.0, vec![1e-3; 8]), (0.0, vec![1.0; 8]), (1.0, mixed.to_vec())] {
            let rate = alarms(runs, spread, &errors);
            assert!((rate - 0.05).abs() < bound, "spread {spread}: {rate}");
        }
    }

    #[test]
    fn outlying_numbers_are_found_and_do_not_hide_each_other() {
        let errors = vec![0.1; 12];
        let mut values = population(12, 1.0, &errors, 5);
        values[3] += 30.0;
        values[9] += 28.0;
        let found = outlying(&values, &errors, 999, 1).unwrap();
        let far: Vec<usize> = (0..12).filter(|i| found[*i].p_value <= 0.05).collect();
        assert_eq!(far, [3, 9], "{found:?}");
        assert!(found[3].studentized > 10.0);
    }

    #[test]
    fn a_number_that_knows_itself_badly_is_not_outlying() {
        let mut errors = vec![0.1; 10];
        let mut values = population(10, 1.0, &errors, 6);
        (values[4], errors[4]) = (20.0, 15.0);
        let found = outlying(&values, &errors, 199, 1).unwrap();
        assert!(found[4].p_value > 0.2, "{:?}", found[4]);
    }

    #[test]
    fn the_spread_is_that_of_the_population_also_where_pairs_are_drawn() {
        for n in [60, 3000] {
            let errors: Vec<f64> = (0..n).map(|i| 0.2 + 0.8 * f64::from(i % 7) / 6.0).collect();
            let values = population(n as usize, 2.0, &errors, 8);
            let std = robust_spread(&values, &errors, &pairs(n as usize, 1)).unwrap();
            // Qn knows a spread to 1/√(1.64 n) of itself; five standard deviations
            assert!((std / 2.0 - 1.0).abs() < 5.0 / (1.64 * f64::from(n)).sqrt() + 0.02, "{n}: {std}");
        }
    }

    #[test]
    fn medians_of_weights() {
        assert_eq!(weighted_median(&[3.0, 1.0, 2.0], &[1.0; 3]), 2.0);
        assert_eq!(weighted_median(&[3.0, 1.0, 2.0, 4.0], &[1.0; 4]), 2.5);
        // one that weighs more than all others
        assert_eq!(weighted_median(&[3.0, 1.0, 2.0], &[0.1, 1.0, 1.0]), 3.0);
        assert!(outlying(&[1.0; 6], &[0.0; 6], 9, 1).is_none());
        assert!(outlying(&[1.0, 2.0], &[0.1; 2], 9, 1).is_none());
    }
}
