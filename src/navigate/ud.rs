//! P = U D Uᵀ, U unit upper triangular, D diagonal: the covariance of a filter in factors.
//!
//! Symmetric and positive by construction, whatever the rounding: a filter may run for days at tiny noise. Update by
//! one scalar measurement after Bierman, prediction by modified weighted Gram-Schmidt after Thornton (Bierman,
//! *Factorization Methods for Discrete Sequential Estimation*, Academic Press 1977, chapters V and VI).

// Rows and columns of two matrices run together here: indices say it more plainly than zipped iterators.
use nalgebra::{SMatrix, SVector};

/// Factors of an N x N covariance. No operation allocates.
#[derive(Debug, Clone, PartialEq)]
pub struct UdCovariance<const N: usize> {
    /// Row by row; below the diagonal zero.
    u: [[f64; N]; N],
    d: [f64; N],
}

impl<const N: usize> UdCovariance<N> {
    /// Factors of `p`; `None` if it is not positive semidefinite beyond rounding.
    #[must_use]
    pub fn factor(p: &SMatrix<f64, N, N>) -> Option<Self> {
        let mut rest = *p;
        let mut out = Self { u: identity(), d: [0.0; N] };
        for j in (0..N).rev() {
            let pivot = rest[(j, j)];
            // what elimination leaves of a variance is known to about N roundings of it
            let rounding = 8.0 * N as f64 * f64::EPSILON * p[(j, j)];
            if pivot.is_nan() || pivot < -rounding {
                return None;
            }
            if pivot <= rounding {
                continue;
            }
            out.d[j] = pivot;
            for i in 0..j {
                out.u[i][j] = rest[(i, j)] / pivot;
            }
            for i in 0..j {
                for k in 0..=i {
                    rest[(k, i)] -= out.u[i][j] * out.u[k][j] * pivot;
                }
            }
        }
        Some(out)
    }

    /// P.
    #[must_use]
    pub fn covariance(&self) -> SMatrix<f64, N, N> {
        SMatrix::from_fn(|a, b| {
            let (i, j) = (a.min(b), a.max(b));
            (j..N).map(|k| self.u[i][k] * self.u[j][k] * self.d[k]).sum()
        })
    }

    /// The diagonal of P.
    #[must_use]
    pub fn variances(&self) -> SVector<f64, N> {
        SVector::from_fn(|i, _| (i..N).map(|k| self.u[i][k] * self.u[i][k] * self.d[k]).sum())
    }

    /// D: all positive exactly where P is positive definite.
    #[must_use]
    pub fn diagonal(&self) -> &[f64; N] {
        &self.d
    }

    /// hᵀ P h + r.
    #[must_use]
    pub fn innovation_variance(&self, h: &SVector<f64, N>, r: f64) -> f64 {
        let projected = self.project(h);
        projected.iter().zip(&self.d).map(|(f, d)| f * f * d).sum::<f64>() + r
    }

    /// Takes in a scalar measurement hᵀ x + noise of variance `r` > 0; returns the Kalman gain.
    pub fn update(&mut self, h: &SVector<f64, N>, r: f64) -> SVector<f64, N> {
        let f = self.project(h);
        let mut gain = SVector::<f64, N>::zeros();
        let mut variance = r;
        for j in 0..N {
            let v = self.d[j] * f[j];
            let before = variance;
            variance += f[j] * v;
            self.d[j] *= before / variance;
            let lambda = -f[j] / before;
            gain[j] = v;
            for i in 0..j {
                let u = self.u[i][j];
                self.u[i][j] = u + lambda * gain[i];
                gain[i] += v * u;
            }
        }
        gain / variance
    }

    /// P := Φ P Φᵀ + Γ diag(q) Γᵀ.
    pub fn predict<const Q: usize>(
        &mut self,
        phi: &SMatrix<f64, N, N>,
        gamma: &SMatrix<f64, N, Q>,
        q: &SVector<f64, Q>,
    ) {
        let mut w = [[0.0; N]; N];
        let mut g = [[0.0; Q]; N];
        for i in 0..N {
            for k in 0..N {
                let factor = phi[(i, k)];
                // most of a transition matrix is zero
                if factor != 0.0 {
                    for (out, u) in w[i].iter_mut().zip(&self.u[k]) {
                        *out += factor * u;
                    }
                }
            }
            for (k, out) in g[i].iter_mut().enumerate() {
                *out = gamma[(i, k)];
            }
        }
        let d = self.d;
        for j in (0..N).rev() {
            let (wj, gj) = (w[j], g[j]);
            let weighted: [f64; N] = std::array::from_fn(|k| d[k] * wj[k]);
            let noise: [f64; Q] = std::array::from_fn(|k| q[k] * gj[k]);
            let pivot = dot(&weighted, &wj) + dot(&noise, &gj);
            self.d[j] = pivot;
            for i in 0..j {
                let u = if pivot > 0.0 { (dot(&weighted, &w[i]) + dot(&noise, &g[i])) / pivot } else { 0.0 };
                self.u[i][j] = u;
                for k in 0..N {
                    w[i][k] -= u * wj[k];
                }
                for k in 0..Q {
                    g[i][k] -= u * gj[k];
                }
            }
        }
    }

    /// Uᵀ h.
    fn project(&self, h: &SVector<f64, N>) -> [f64; N] {
        std::array::from_fn(|j| (0..=j).map(|i| self.u[i][j] * h[i]).sum())
    }
}

fn identity<const N: usize>() -> [[f64; N]; N] {
    std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(i == j))))
}

fn dot<const K: usize>(a: &[f64; K], b: &[f64; K]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Stream;

    fn random_matrix<const R: usize, const C: usize>(stream: &mut Stream) -> SMatrix<f64, R, C> {
        SMatrix::from_fn(|_, _| stream.normal())
    }

    fn close<const N: usize>(a: &SMatrix<f64, N, N>, b: &SMatrix<f64, N, N>) {
        let scale = b.amax();
        assert!((a - b).amax() < 1e-12 * scale, "{a} {b}");
    }

    #[test]
    fn factors_give_the_covariance_back() {
        let mut stream = Stream::new(1, 1);
        for _ in 0..50 {
            let a = random_matrix::<5, 5>(&mut stream);
            let p = a * a.transpose();
            close(&UdCovariance::factor(&p).unwrap().covariance(), &p);
        }
        // rank one, and no covariance at all
        let v = random_matrix::<5, 1>(&mut stream);
        let p = v * v.transpose();
        close(&UdCovariance::factor(&p).unwrap().covariance(), &p);
        let mut indefinite = SMatrix::<f64, 5, 5>::identity();
        indefinite[(0, 1)] = 2.0;
        indefinite[(1, 0)] = 2.0;
        assert!(UdCovariance::factor(&indefinite).is_none());
        assert!(UdCovariance::factor(&SMatrix::<f64, 5, 5>::from_element(f64::NAN)).is_none());
    }

    #[test]
    fn updates_and_predictions_agree_with_the_textbook() {
        let mut stream = Stream::new(2, 1);
        let a = random_matrix::<5, 5>(&mut stream);
        let mut p = a * a.transpose();
        let mut ud = UdCovariance::factor(&p).unwrap();
        for _ in 0..100 {
            let phi = 0.6 * random_matrix::<5, 5>(&mut stream);
            let gamma = random_matrix::<5, 2>(&mut stream);
            let q = SVector::<f64, 2>::new(stream.uniform(), stream.uniform());
            ud.predict(&phi, &gamma, &q);
            p = phi * p * phi.transpose() + gamma * SMatrix::from_diagonal(&q) * gamma.transpose();
            close(&ud.covariance(), &p);

            let h = random_matrix::<5, 1>(&mut stream);
            let r = 0.1 + stream.uniform();
            let variance = (h.transpose() * p * h)[0] + r;
            assert!((ud.innovation_variance(&h, r) / variance - 1.0).abs() < 1e-12);
            let gain = ud.update(&h, r);
            let expected = p * h / variance;
            assert!((gain - expected).amax() < 1e-12 * expected.amax().max(1.0));
            let keep = SMatrix::<f64, 5, 5>::identity() - expected * h.transpose();
            p = keep * p * keep.transpose() + expected * expected.transpose() * r;
            close(&ud.covariance(), &p);
            close(&SMatrix::from_diagonal(&ud.variances()), &SMatrix::from_diagonal(&p.diagonal()));
        }
    }

    #[test]
    fn a_million_updates_of_a_constant_leave_its_exact_variance() {
        // prior 1, noise r: after n updates 1/(1 + n/r)
        let r = 1e-12;
        let mut ud = UdCovariance::factor(&SMatrix::<f64, 2, 2>::identity()).unwrap();
        let h = SVector::<f64, 2>::new(1.0, 0.0);
        let n = 1_000_000;
        (0..n).for_each(|_| {
            ud.update(&h, r);
        });
        let expected = 1.0 / (1.0 + f64::from(n) / r);
        // rounding of n products
        assert!((ud.variances()[0] / expected - 1.0).abs() < f64::from(n) * f64::EPSILON);
        assert_eq!(ud.variances()[1], 1.0);
    }
}
