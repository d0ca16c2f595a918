//! m + t(p, n - 1) d √(1 + 1/n):  the value that one more draw stays below with probability p
//!
//! m and d are mean and standard deviation of n draws of a normal distribution, t is Student's quantile: exact whatever
//! the true mean and deviation (Hahn and Meeker, Statistical Intervals (1991), section 4.7).

use crate::math::NORMAL_975;
use statrs::distribution::{ContinuousCDF, Normal, StudentsT};

/// Fewest draws whose scatter tells a bound.
pub(super) const FEWEST: usize = 3;

/// The bound, and the 95 % interval of the true quantile; none with fewer than [`FEWEST`] draws, or where `never` further
/// draws without any value are more than the probability leaves.
pub(super) fn bound(probability: f64, draws: &[f64], never: usize) -> Option<(f64, [f64; 2])> {
    let n = draws.len() as f64;
    // of all logs, those that are named at some size
    let share = n / (n + never as f64);
    let p = probability / share;
    if draws.len() < FEWEST || p >= 1.0 {
        return None;
    }
    let mean = draws.iter().sum::<f64>() / n;
    let std = (draws.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
    let t = StudentsT::new(0.0, 1.0, n - 1.0).ok()?.inverse_cdf(p);
    let z = Normal::standard().inverse_cdf(p);
    let half = NORMAL_975 * std * (1.0 / n + z * z / (2.0 * (n - 1.0))).sqrt();
    let quantile = mean + z * std;
    Some((mean + t * std * (1.0 + 1.0 / n).sqrt(), [quantile - half, quantile + half]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Stream;

    #[test]
    fn one_more_draw_stays_below_as_often_as_told() {
        let mut draw = Stream::new(11, 0);
        for (n, p) in [(4, 0.9), (8, 0.9), (8, 0.6)] {
            const ROUNDS: usize = 4000;
            let below = |_| {
                let draws: Vec<f64> = (0..n).map(|_| 5.0 + 0.7 * draw.normal()).collect();
                usize::from(5.0 + 0.7 * draw.normal() < bound(p, &draws, 0).unwrap().0)
            };
            let share = (0..ROUNDS).map(below).sum::<usize>() as f64 / ROUNDS as f64;
            // four standard deviations of a binomial share
            assert!((share - p).abs() < 4.0 * (p * (1.0 - p) / ROUNDS as f64).sqrt(), "{n} {p}: {share}");
        }
    }

    #[test]
    fn the_interval_holds_the_quantile() {
        let mut draw = Stream::new(12, 0);
        let quantile = 5.0 + 0.7 * 1.281_552;
        let inside = |_| {
            let draws: Vec<f64> = (0..20).map(|_| 5.0 + 0.7 * draw.normal()).collect();
            let [low, high] = bound(0.9, &draws, 0).unwrap().1;
            usize::from((low..high).contains(&quantile))
        };
        let share = (0..2000).map(inside).sum::<usize>() as f64 / 2000.0;
        assert!((share - 0.95).abs() < 0.03, "{share}");
    }

    #[test]
    fn what_is_too_seldom_named_has_no_size() {
        let draws = [1.0, 1.1, 0.9, 1.2, 1.0, 0.95, 1.05, 1.1];
        let [all, most] = [0, 1].map(|never| bound(0.8, &draws, never).unwrap().0);
        assert!(most > all, "{most} {all}");
        assert_eq!(bound(0.9, &draws, 1), None);
        assert_eq!(bound(0.9, &draws[..2], 0), None);
    }
}
