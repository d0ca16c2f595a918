//! θ̂ = (Z'X)⁻¹ Z'y
//!
//! Instrumental variables: X are regressors with errors of their own, Z the same quantities with other, independent errors.
//! Then E[Z'e] = 0, and θ̂ is consistent where least squares would be pulled towards zero (Söderström, *Errors-in-Variables
//! Methods in System Identification*, 2018, chapter 6).

use nalgebra::{DMatrix, DVector};

/// Windows for each coefficient at least.
const WINDOWS_EACH: usize = 4;
/// Standard deviations from zero by which the least singular value of the scaled Z'X must differ for the coefficients to be told.
const SINGULAR: f64 = 1e-7;

/// Equations y = x'θ + e, one a window, with an instrument for each regressor.
#[derive(Debug, Clone, Default)]
pub(super) struct Equations<const P: usize> {
    rows: Vec<([f64; P], [f64; P], f64)>,
}

impl<const P: usize> Equations<P> {
    /// Adds one with regressors `x` and instruments `z`; none where a number is missing.
    pub(super) fn push(&mut self, x: [f64; P], z: [f64; P], y: f64) {
        if x.iter().chain(&z).chain([&y]).all(|v| v.is_finite()) {
            self.rows.push((x, z, y));
        }
    }

    /// Solution; none where the windows are too few or alike.
    pub(super) fn solve(&self) -> Option<[f64; P]> {
        let n = self.rows.len();
        if n < WINDOWS_EACH * P {
            return None;
        }
        let scale: [f64; P] =
            std::array::from_fn(|j| self.rows.iter().map(|r| r.0[j] * r.0[j]).sum::<f64>().sqrt() / (n as f64).sqrt());
        if scale.iter().any(|s| !(*s > 0.0)) {
            return None;
        }
        let x = DMatrix::from_fn(n, P, |k, j| self.rows[k].0[j] / scale[j]);
        let z = DMatrix::from_fn(n, P, |k, j| self.rows[k].1[j] / scale[j]);
        let y = DVector::from_fn(n, |k, _| self.rows[k].2);
        let cross = z.transpose() * &x / n as f64;
        let least = cross.clone().svd(false, false).singular_values.min();
        if !(least > SINGULAR) {
            return None;
        }
        let scaled = cross.lu().solve(&(z.transpose() * &y / n as f64))?;
        Some(std::array::from_fn(|j| scaled[j] / scale[j]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Stream;

    /// y = 2 a - 0.5 b + e, a and b read twice with independent errors of a third of their size.
    fn drawn(seed: u64, n: usize) -> Equations<2> {
        let draw = &mut Stream::new(seed, 0);
        let mut all = Equations::default();
        for _ in 0..n {
            let [a, b] = [draw.normal(), draw.normal() + 0.5];
            let read = |v: f64, draw: &mut Stream| v + 0.3 * draw.normal();
            let x = [read(a, draw), read(b, draw)];
            let z = [read(a, draw), read(b, draw)];
            all.push(x, z, 2.0 * a - 0.5 * b + 0.1 * draw.normal());
        }
        all
    }

    #[test]
    fn errors_of_the_regressors_do_not_pull_to_zero() {
        const RUNS: u64 = 400;
        let truth = [2.0, -0.5];
        let found: Vec<[f64; 2]> = (0..RUNS).map(|seed| drawn(seed, 300).solve().unwrap()).collect();
        let n = RUNS as f64;
        for (j, truth) in truth.into_iter().enumerate() {
            let mean = found.iter().map(|v| v[j]).sum::<f64>() / n;
            let std = (found.iter().map(|v| (v[j] - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
            assert!((mean - truth).abs() < 4.0 * std / n.sqrt(), "{j}: {mean}");
        }
        // least squares, the regressors as their own instruments, is off by the attenuation 1/(1 + 0.09)
        let mut biased = drawn(1, 20_000);
        biased.rows.iter_mut().for_each(|r| r.1 = r.0);
        let [least_squares, _] = biased.solve().unwrap();
        assert!((least_squares / 2.0 - 1.0 / 1.09).abs() < 0.01, "{least_squares}");
    }

    #[test]
    fn what_the_windows_do_not_tell_is_not_told() {
        let mut alike = Equations::<2>::default();
        (0..100).map(f64::from).for_each(|k| alike.push([k, 2.0 * k], [k, 2.0 * k], k));
        assert_eq!(alike.solve(), None);
        let mut few = Equations::<2>::default();
        (0..7).map(f64::from).for_each(|k| few.push([k, k * k], [k, k * k], k));
        assert_eq!(few.solve(), None);
    }
}
