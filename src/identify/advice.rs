//! How long to record: std(T)/T of a planned log, from this log's C1/T and noise.
//!
//! The covariance of least squares on e(t) under white noise plus random walk, for a log of length L from power-on;
//! with white noise alone std(T)/T = c(L/T) σ / (C1 √n).

use nalgebra::{Matrix3, Vector3};
use serde::Serialize;

/// Length and number of the logs that would give T to ±10 %.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Advice {
    /// The time constant that is assumed, s: the estimate, or where T is not known one that the log allows.
    pub if_time_constant_s: f64,
    /// Length from power-on at which the 95 % interval of T is within ±10 %, s; `None` where no log reaches that:
    /// once the warm-up is over nothing more is learnt of T, and a random walk of the bias hides it ever more.
    pub length_s: Option<f64>,
    /// How much longer than this log that is, s.
    pub longer_by_s: Option<f64>,
    /// Logs from power-on that together know T to ±10 %: 1, or where one log never does, as many as it takes.
    pub power_ons: u32,
    /// Length of each of them, s.
    pub length_each_s: f64,
}

/// A log that could be recorded.
#[derive(Debug, Clone, Copy)]
pub(super) struct Plan {
    pub c1_rad_s: f64,
    pub time_constant_s: f64,
    /// Time since power-on of the first sample, s.
    pub start_s: f64,
    pub rate_hz: f64,
    /// White variance of a sample, rad²/s².
    pub white_variance: f64,
    /// K², rad²/s³.
    pub walk_variance_rate: f64,
}

/// Half width of the 95 % interval that counts as known, relative to T.
const WANTED: f64 = 0.10;
const POINTS: usize = 400;

/// Standard deviation of T, relative to T, in a log of `length_s`. Infinite where it is singular.
pub(super) fn relative_std(plan: &Plan, length_s: f64) -> f64 {
    let n = (length_s * plan.rate_hz / POINTS as f64).max(f64::MIN_POSITIVE);
    let step = length_s / POINTS as f64;
    let column = |i: usize| {
        let u = (plan.start_s + step * (i as f64 + 0.5)) / plan.time_constant_s;
        let e = (-u).exp();
        Vector3::new(1.0 - e, 1.0, u * e)
    };
    let (mut normal, mut walk, mut tail) = (Matrix3::zeros(), Matrix3::zeros(), Vector3::zeros());
    for i in (0..POINTS).rev() {
        let x = column(i);
        normal += n * (x * x.transpose());
        tail += n * x;
        walk += step * (tail * tail.transpose());
    }
    // unit diagonal first: in a short log the columns are nearly parallel
    let scale = normal.diagonal().map(|d: f64| d.sqrt().recip());
    let unit = Matrix3::from_diagonal(&scale);
    let Some(inv) = (unit * normal * unit).cholesky().map(|c| unit * c.inverse() * unit) else { return f64::INFINITY };
    let spread = inv * walk * inv;
    let variance = plan.white_variance * inv[(2, 2)] + plan.walk_variance_rate * spread[(2, 2)];
    variance.sqrt() / plan.c1_rad_s.abs()
}

/// The shortest length that knows T to ±10 %, or how many logs of the best length do.
pub(super) fn advise(plan: &Plan, recorded_s: f64) -> Advice {
    let half_width = |length: f64| 1.96 * relative_std(plan, length);
    let (first, last) = (0.05 * plan.time_constant_s, 1e3 * plan.time_constant_s);
    let mut high = first;
    // independent logs: the variance falls with their number
    let logs = |width: f64| (width / WANTED).powi(2).ceil().clamp(1.0, f64::from(u32::MAX));
    let (mut each, mut number) = (first, f64::from(u32::MAX));
    while high < last {
        let width = half_width(high);
        if width <= WANTED {
            break;
        }
        // the least time of recording in all
        if logs(width) * high < number * each {
            (each, number) = (high, logs(width));
        }
        high *= 1.25;
    }
    let length_s = (high < last).then(|| {
        let mut low = high / 1.25;
        for _ in 0..20 {
            let mid = 0.5 * (low + high);
            if half_width(mid) <= WANTED {
                high = mid;
            } else {
                low = mid;
            }
        }
        high
    });
    Advice {
        if_time_constant_s: plan.time_constant_s,
        length_s,
        longer_by_s: length_s.map(|l| (l - recorded_s).max(0.0)),
        power_ons: if length_s.is_some() { 1 } else { number as u32 },
        length_each_s: length_s.unwrap_or(each),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLAN: Plan = Plan {
        c1_rad_s: 2e-3,
        time_constant_s: 500.0,
        start_s: 0.0,
        rate_hz: 100.0,
        white_variance: 1e-6,
        walk_variance_rate: 0.0,
    };

    #[test]
    fn agrees_with_the_published_table() {
        // std(T)/T = c σ / (C1 √n), c by length / T
        for (ratio, c) in [(0.1, 2820.0), (0.5, 137.0), (1.0, 44.0), (2.0, 17.5), (3.0, 12.0), (5.0, 9.7), (10.0, 10.3)]
        {
            let plan = PLAN;
            let length = ratio * 500.0;
            let found = relative_std(&plan, length) * 2e-3 / 1e-3 * (length * 100.0f64).sqrt();
            // the table has two to three digits
            assert!((found / c - 1.0).abs() < 0.02, "{ratio}: {found} against {c}");
        }
    }

    #[test]
    fn a_random_walk_can_make_it_unreachable_in_one_log() {
        let mut plan = PLAN;
        let white = advise(&plan, 100.0);
        let length = white.length_s.unwrap();
        assert!((1.96 * relative_std(&plan, length) - 0.1).abs() < 1e-3);
        plan.walk_variance_rate = 1e-8;
        let walk = advise(&plan, 100.0);
        assert_eq!(walk.length_s, None);
        // independent logs: the variance falls with their number
        let together = 1.96 * relative_std(&plan, walk.length_each_s) / f64::from(walk.power_ons).sqrt();
        assert!(together <= 0.1 && walk.power_ons > 1, "{together}");
    }

    #[test]
    fn white_noise_too_has_a_limit_once_the_warm_up_is_over() {
        let plan = Plan {
            c1_rad_s: 1.75e-3,
            time_constant_s: 611.0,
            start_s: 0.0,
            rate_hz: 1.0,
            white_variance: 2.35e-3f64.powi(2),
            walk_variance_rate: 0.0,
        };
        let a = advise(&plan, 5600.0);
        assert_eq!(a.length_s, None);
        assert!(a.power_ons > 1 && a.length_each_s < 20.0 * 611.0, "{a:?}");
    }
}
