//! Brent's minimiser and root finder (Brent 1973, chapters 4 and 5), by argmin.

use argmin::core::{CostFunction, Error as ArgminError, Executor, State};
use argmin::solver::brent::{BrentOpt, BrentRoot};

struct Scalar<F>(F);

impl<F: Fn(f64) -> f64> CostFunction for Scalar<F> {
    type Param = f64;
    type Output = f64;
    fn cost(&self, x: &f64) -> Result<f64, ArgminError> {
        Ok((self.0)(*x))
    }
}

/// Where a search ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Found {
    /// Argument.
    pub x: f64,
    /// Evaluations of the function, by argmin's iterations.
    pub iterations: u64,
}

/// Local minimum of `f` in `[low, high]` to a relative `tolerance` (half the digits of `f64` are the most that a
/// minimiser of values alone can have). `None` if the bracket is not one or `f` is not finite there.
#[must_use]
pub(crate) fn minimum(f: impl Fn(f64) -> f64, low: f64, high: f64, tolerance: f64) -> Option<Found> {
    if !(low < high && low.is_finite() && high.is_finite()) {
        return None;
    }
    let solver = BrentOpt::new(low, high).set_tolerance(tolerance, 0.1 * tolerance);
    let result = Executor::new(Scalar(f), solver).configure(|s| s.max_iters(200)).run().ok()?;
    let x = *result.state().get_best_param()?;
    x.is_finite().then(|| Found { x, iterations: result.state().get_iter() })
}

/// Root of `f` in `[low, high]` to `tolerance`, or to the last digits where that is finer. `None` unless `f` has opposite signs at the ends.
#[must_use]
pub(crate) fn root(f: impl Fn(f64) -> f64, low: f64, high: f64, tolerance: f64) -> Option<Found> {
    let (a, b) = (f(low), f(high));
    if !(low < high && a.is_finite() && b.is_finite() && a * b <= 0.0) {
        return None;
    }
    if a == 0.0 || b == 0.0 {
        return Some(Found { x: if a == 0.0 { low } else { high }, iterations: 0 });
    }
    let tolerance = tolerance.max(4.0 * f64::EPSILON * low.abs().max(high.abs()));
    let solver = BrentRoot::new(low, high, tolerance);
    let result = Executor::new(Scalar(f), solver).configure(|s| s.max_iters(200)).run().ok()?;
    let x = *result.state().get_best_param().or(result.state().get_param())?;
    x.is_finite().then(|| Found { x, iterations: result.state().get_iter() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn minimum_and_root_of_known_functions() {
        let m = minimum(|x| (x - 2.0).powi(2) + 1.0, 0.0, 5.0, 1e-9).unwrap();
        assert!((m.x - 2.0).abs() < 1e-7);
        let r = root(|x| x * x * x - 2.0, 0.0, 3.0, 0.0).unwrap();
        assert!((r.x - 2f64.cbrt()).abs() < 4.0 * f64::EPSILON, "{}", r.x);
    }

    #[test]
    fn no_bracket_no_answer() {
        assert!(root(|x| x * x + 1.0, -1.0, 1.0, 0.0).is_none());
        assert!(root(|_| f64::NAN, -1.0, 1.0, 0.0).is_none());
        assert!(minimum(|x| x, 1.0, 0.0, 1e-9).is_none());
    }
}
