//! θ̂ = (Z'X)⁻¹ Z'y,   cov θ̂ = (Z'X)⁻¹ S (X'Z)⁻¹,   S = Σ_k Σ_{|j| ≤ 1} w_j e_k e_{k+j} z_k z_{k+j}'
//!
//! Instrumental variables: X are regressors with errors of their own, Z the same quantities with other, independent errors.
//! Then E[Z'e] = 0, and θ̂ is consistent where least squares would be pulled towards zero (Söderström, *Errors-in-Variables
//! Methods in System Identification*, 2018, chapter 6). Neighbouring windows share a reading, so that their residuals have one
//! autocovariance: w_1 = ½ keeps S positive semidefinite (Newey and West, Econometrica 55 (1987) 703).

use nalgebra::{DMatrix, DVector};

/// Windows for each coefficient at least.
const WINDOWS_EACH: usize = 4;
/// Standard deviations from zero by which the least singular value of the scaled Z'X must differ for the coefficients to be told.
const SINGULAR: f64 = 1e-7;

/// Coefficients with their covariance.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Regressed {
    /// θ̂
    pub value: DVector<f64>,
    /// Its covariance.
    pub covariance: DMatrix<f64>,
}

impl Regressed {
    /// Standard deviation of coefficient `i`.
    pub fn std(&self, i: usize) -> f64 {
        self.covariance[(i, i)].max(0.0).sqrt()
    }
}

/// Equations y = x'θ + e, one a window, with an instrument for each regressor.
#[derive(Debug, Clone, Default)]
pub(super) struct Equations<const P: usize> {
    rows: Vec<([f64; P], [f64; P], f64)>,
}

impl<const P: usize> Equations<P> {
    /// Adds one with regressors `x` and instruments `z`; none where a number is missing.
    pub fn push(&mut self, x: [f64; P], z: [f64; P], y: f64) {
        if x.iter().chain(&z).chain([&y]).all(|v| v.is_finite()) {
            self.rows.push((x, z, y));
        }
    }

    /// Solution; none where the windows are too few or alike.
    pub fn solve(&self) -> Option<Regressed> {
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
        let inverse = cross.try_inverse()?;
        let scaled = &inverse * (z.transpose() * &y) / n as f64;
        let e = y - &x * &scaled;
        let moment = |k: usize| z.row(k).transpose() * e[k];
        let mut s = DMatrix::zeros(P, P);
        for k in 0..n {
            let here = moment(k);
            s += &here * here.transpose();
            if k + 1 < n {
                let cross = &here * moment(k + 1).transpose();
                s += 0.5 * (&cross + cross.transpose());
            }
        }
        // degrees of freedom
        s *= 1.0 / (n as f64 * (n - P) as f64);
        let covariance = &inverse * s * inverse.transpose();
        let back = DMatrix::from_diagonal(&DVector::from_fn(P, |j, _| 1.0 / scale[j]));
        Some(Regressed { value: &back * scaled, covariance: &back * covariance * &back })
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
    fn errors_of_the_regressors_do_not_pull_to_zero_and_standard_errors_hold() {
        let truth = [2.0, -0.5];
        let found: Vec<Regressed> = (0..400).map(|seed| drawn(seed, 300).solve().unwrap()).collect();
        for (j, truth) in truth.into_iter().enumerate() {
            let z: Vec<f64> = found.iter().map(|r| (r.value[j] - truth) / r.std(j)).collect();
            let mean = z.iter().sum::<f64>() / 400.0;
            let square = z.iter().map(|z| z * z).sum::<f64>() / 400.0;
            // of 400 standard normal numbers: mean within 4/√400, mean square within 1 ± 4 √(2/400)
            assert!(mean.abs() < 4.0 / 20.0, "{j}: {mean}");
            assert!((square - 1.0).abs() < 4.0 * (2.0f64 / 400.0).sqrt(), "{j}: {square}");
        }
        // least squares, the regressors as their own instruments, is off by the attenuation 1/(1 + 0.09)
        let mut biased = drawn(1, 20_000);
        biased.rows.iter_mut().for_each(|r| r.1 = r.0);
        let least_squares = biased.solve().unwrap();
        assert!((least_squares.value[0] / 2.0 - 1.0 / 1.09).abs() < 0.01, "{}", least_squares.value[0]);
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
