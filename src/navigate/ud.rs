//! P = U D Uᵀ, U unit upper triangular, D diagonal: the covariance of a filter in factors.
//!
//! Symmetric and positive by construction, whatever the rounding: a filter may run for days at tiny noise. Update by
//! one scalar measurement after Bierman, prediction by modified weighted Gram-Schmidt after Thornton (Bierman,
//! *Factorization Methods for Discrete Sequential Estimation*, Academic Press 1977, chapters V and VI).

// Rows and columns of two matrices run together here: indices say it more plainly than zipped iterators.
use nalgebra::{SMatrix, SVector};
use std::marker::PhantomData;

/// Does `$do` for each of the rows (or columns) below `$n`, in the order given. The number is a constant to the compiler,
/// which writes the loops inside out and leaves out what is zero.
macro_rules! each_row {
    ($n:ident, $do:ident: $($row:literal)*) => {
        const { assert!($n <= [$($row),*].len(), "rows are counted to twelve") };
        $(if $row < $n {
            $do!($row);
        })*
    };
}

/// Factors of an N x N covariance. No operation allocates.
#[derive(Debug, Clone, PartialEq)]
pub struct UdCovariance<const N: usize> {
    /// Column by column; one on the diagonal, zero below it.
    u: [[f64; N]; N],
    d: [f64; N],
}

impl<const N: usize> UdCovariance<N> {
    /// Factors of `p`; `None` if it is not positive semidefinite beyond rounding.
    #[must_use]
    pub(crate) fn factor(p: &SMatrix<f64, N, N>) -> Option<Self> {
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
                out.u[j][i] = rest[(i, j)] / pivot;
            }
            for i in 0..j {
                for k in 0..=i {
                    rest[(k, i)] -= out.u[j][i] * out.u[j][k] * pivot;
                }
            }
        }
        Some(out)
    }

    /// P.
    #[must_use]
    pub(crate) fn covariance(&self) -> SMatrix<f64, N, N> {
        SMatrix::from_fn(|a, b| {
            let (i, j) = (a.min(b), a.max(b));
            (j..N).map(|k| self.u[k][i] * self.u[k][j] * self.d[k]).sum()
        })
    }

    /// The element of P in row `i` and column `j`.
    #[must_use]
    pub(crate) fn element(&self, i: usize, j: usize) -> f64 {
        (i.max(j)..N).map(|k| self.u[k][i] * self.u[k][j] * self.d[k]).sum()
    }

    /// The diagonal of P.
    #[must_use]
    pub(crate) fn variances(&self) -> SVector<f64, N> {
        SVector::from_fn(|i, _| (i..N).map(|k| self.u[k][i] * self.u[k][i] * self.d[k]).sum())
    }

    /// D: all positive exactly where P is positive definite.
    #[must_use]
    pub fn diagonal(&self) -> &[f64; N] {
        &self.d
    }

    /// U.
    #[must_use]
    pub fn unit_upper(&self) -> SMatrix<f64, N, N> {
        SMatrix::from_fn(|i, j| self.u[j][i])
    }

    /// hᵀ P h + r.
    #[must_use]
    pub(crate) fn innovation_variance(&self, h: &SVector<f64, N>, r: f64) -> f64 {
        self.project(&Row::new(h), r).variance
    }

    /// A measurement hᵀ x + noise of variance `r` as the factors see it.
    #[must_use]
    #[inline(always)]
    pub(super) fn project(&self, h: &Row<N>, r: f64) -> Projection<N> {
        let mut f = [0.0; N];
        for (i, h) in h.entries() {
            for (f, column) in f.iter_mut().zip(&self.u) {
                *f += h * column[*i];
            }
        }
        let mut variances = [r; N];
        let mut variance = r;
        for j in h.first()..N {
            variance += f[j] * f[j] * self.d[j];
            variances[j] = variance;
        }
        Projection { f, r, variances, variance }
    }

    /// Takes in a scalar measurement hᵀ x + noise of variance `r` > 0 that was projected on these factors; returns the
    /// Kalman gain.
    #[inline(always)]
    pub(super) fn take_in(&mut self, seen: &Projection<N>) -> SVector<f64, N> {
        let mut gain = Gain { sums: [0.0; N], variance: seen.r, inverse: 1.0 / seen.r };
        macro_rules! condition {
            ($j:literal) => {
                // a column that is not seen stays as it is
                if seen.f[$j] != 0.0 {
                    gain.condition::<$j>(seen, &mut self.u[$j], &mut self.d[$j]);
                }
            };
        }
        each_row!(N, condition: 0 1 2 3 4 5 6 7 8 9 10 11);
        SVector::from(gain.sums.map(|g| g * gain.inverse))
    }

    /// P := Φ P Φᵀ + Γ diag(q) Γᵀ, by matrices of which `S` says where they can differ from zero.
    #[inline(always)]
    pub(super) fn predict_sparse<const Q: usize, S: Structure<N, Q>>(
        &mut self,
        phi: &SMatrix<f64, N, N>,
        gamma: &SMatrix<f64, N, Q>,
        q: &SVector<f64, Q>,
    ) {
        const { assert!(N + Q < 32, "a row's sources are bits") };
        debug_assert!((0..N).all(|i| (0..N).all(|k| has(S::PHI[i], k) || phi[(i, k)] == 0.0)));
        debug_assert!((0..N).all(|i| (0..Q).all(|k| has(S::GAMMA[i], k) || gamma[(i, k)] == 0.0)));
        let mut states = [[0.0; N]; N];
        macro_rules! multiply {
            ($i:literal) => {
                for k in 0..N {
                    let mut sum = 0.0;
                    for m in 0..=k {
                        if has(const { S::PHI }[$i], m) {
                            sum += phi[($i, m)] * self.u[k][m];
                        }
                    }
                    states[k][$i] = sum;
                }
            };
        }
        each_row!(N, multiply: 0 1 2 3 4 5 6 7 8 9 10 11);
        let mut sources = Sources::<N, Q, S> {
            states,
            variances: self.d,
            noises: std::array::from_fn(|k| std::array::from_fn(|i| gamma[(i, k)])),
            noise_variances: std::array::from_fn(|k| q[k]),
            structure: PhantomData,
        };
        macro_rules! eliminate {
            ($j:literal) => {
                self.d[$j] = sources.eliminate::<$j>(&mut self.u[$j])
            };
        }
        each_row!(N, eliminate: 11 10 9 8 7 6 5 4 3 2 1 0);
    }
}

/// A row of a measurement matrix, which is mostly zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Row<const N: usize> {
    entries: [(usize, f64); N],
    len: usize,
}

impl<const N: usize> Row<N> {
    pub(crate) fn new(h: &SVector<f64, N>) -> Self {
        let mut out = Self { entries: [(0, 0.0); N], len: 0 };
        for (i, h) in h.iter().enumerate().filter(|(_, h)| **h != 0.0) {
            out.entries[out.len] = (i, *h);
            out.len += 1;
        }
        out
    }

    /// Index and value of what is not zero.
    #[inline]
    pub(crate) fn entries(&self) -> &[(usize, f64)] {
        &self.entries[..self.len]
    }

    /// With its zeros.
    pub(crate) fn dense(&self) -> SVector<f64, N> {
        let mut out = SVector::zeros();
        self.entries().iter().for_each(|(i, h)| out[*i] = *h);
        out
    }

    /// Index of the first that is not zero.
    fn first(&self) -> usize {
        self.entries().first().map_or(N, |(i, _)| *i)
    }
}

/// A scalar measurement projected on the factors of a covariance.
#[derive(Debug, Clone)]
pub(super) struct Projection<const N: usize> {
    /// Uᵀ h.
    f: [f64; N],
    r: f64,
    /// r + Σ f² d, up to each state.
    variances: [f64; N],
    /// hᵀ P h + r.
    pub variance: f64,
}

/// The Kalman gain as it grows column by column.
struct Gain<const N: usize> {
    sums: [f64; N],
    /// Variance of the measurement, by the columns so far.
    variance: f64,
    inverse: f64,
}

impl<const N: usize> Gain<N> {
    /// Takes in column J.
    #[inline(always)]
    fn condition<const J: usize>(&mut self, seen: &Projection<N>, u: &mut [f64; N], d: &mut f64) {
        let (f, variance) = (seen.f[J], seen.variances[J]);
        // the variances are known beforehand, so that no division waits for another
        let inverse = 1.0 / variance;
        let v = *d * f;
        *d *= self.variance * inverse;
        let lambda = -f * self.inverse;
        for (u, sum) in u[..J].iter_mut().zip(&mut self.sums) {
            let before = *u;
            *u += lambda * *sum;
            *sum += v * before;
        }
        self.sums[J] = v;
        (self.variance, self.inverse) = (variance, inverse);
    }
}

/// Where the matrices of a prediction can differ from zero: bit k of entry i for row i and column k.
pub(super) trait Structure<const N: usize, const Q: usize> {
    const PHI: [u32; N];
    const GAMMA: [u32; N];
    /// Which of the columns of [Φ U, Γ] row i has when its turn comes.
    const SOURCES: [u32; N] = sources(&Self::PHI, &Self::GAMMA, Q);
}

const fn has(bits: u32, k: usize) -> bool {
    bits >> k & 1 == 1
}

/// [`Structure::SOURCES`]: the elimination of a row gives its sources to those above it.
const fn sources<const N: usize>(phi: &[u32; N], gamma: &[u32; N], noises: usize) -> [u32; N] {
    let states = (1u32 << N) - 1;
    let mut rows = [0; N];
    let mut i = 0;
    while i < N {
        // U is upper triangular: a state brings its own column and those after it
        let first = phi[i].trailing_zeros();
        rows[i] = (u32::MAX << first & states) | (gamma[i] & ((1 << noises) - 1)) << N;
        i += 1;
    }
    let mut j = N;
    while j > 0 {
        j -= 1;
        i = 0;
        while i < j {
            if rows[j].count_ones() == 1 {
                // the only source of a row above goes with it entirely: so it is with constants
                rows[i] &= !rows[j];
            } else if rows[i] & rows[j] != 0 {
                rows[i] |= rows[j];
            }
            i += 1;
        }
    }
    rows
}

/// [Φ U, Γ], column by column, and the variance that each column carries.
struct Sources<const N: usize, const Q: usize, S> {
    states: [[f64; N]; N],
    variances: [f64; N],
    noises: [[f64; N]; Q],
    noise_variances: [f64; Q],
    structure: PhantomData<S>,
}

impl<const N: usize, const Q: usize, S: Structure<N, Q>> Sources<N, Q, S> {
    /// Makes the rows above row J orthogonal to it. Their projections are column J of U. Returns D, the squared length
    /// of row J.
    #[inline(always)]
    fn eliminate<const J: usize>(&mut self, u: &mut [f64; N]) -> f64 {
        let sources = const { S::SOURCES }[J];
        let mut sums = [0.0; N];
        macro_rules! project {
            ($columns:expr, $variances:expr, $bits:expr) => {
                for (k, column) in $columns.iter().enumerate() {
                    if has($bits, k) {
                        let weighted = $variances[k] * column[J];
                        for i in 0..=J {
                            sums[i] += weighted * column[i];
                        }
                    }
                }
            };
        }
        project!(self.states, self.variances, sources);
        project!(self.noises, self.noise_variances, sources >> N);
        let pivot = sums[J];
        let inverse = if pivot > 0.0 { 1.0 / pivot } else { 0.0 };
        for i in 0..J {
            u[i] = sums[i] * inverse;
        }
        macro_rules! subtract {
            ($columns:expr, $bits:expr) => {
                for (k, column) in $columns.iter_mut().enumerate() {
                    if has($bits, k) {
                        let own = column[J];
                        for i in 0..J {
                            column[i] -= own * u[i];
                        }
                    }
                }
            };
        }
        subtract!(self.states, sources);
        subtract!(self.noises, sources >> N);
        pivot
    }
}

fn identity<const N: usize>() -> [[f64; N]; N] {
    std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(i == j))))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Stream;

    /// Nothing is known to be zero.
    struct Dense;

    impl<const N: usize, const Q: usize> Structure<N, Q> for Dense {
        const PHI: [u32; N] = [(1 << N) - 1; N];
        const GAMMA: [u32; N] = [(1 << Q) - 1; N];
    }

    impl<const N: usize> UdCovariance<N> {
        /// Takes in a scalar measurement hᵀ x + noise of variance `r` > 0; returns the Kalman gain.
        fn update(&mut self, h: &SVector<f64, N>, r: f64) -> SVector<f64, N> {
            self.take_in(&self.project(&Row::new(h), r))
        }

        /// P := Φ P Φᵀ + Γ diag(q) Γᵀ.
        fn predict<const Q: usize>(
            &mut self,
            phi: &SMatrix<f64, N, N>,
            gamma: &SMatrix<f64, N, Q>,
            q: &SVector<f64, Q>,
        ) {
            self.predict_sparse::<Q, Dense>(phi, gamma, q);
        }
    }

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

    /// A constant at the end, noise that enters from below, and an entry below the diagonal.
    struct Sparse;
    impl Structure<6, 2> for Sparse {
        const PHI: [u32; 6] = [0b001101, 0b010010, 0b000100, 0b011010, 0b110000, 0b100000];
        const GAMMA: [u32; 6] = [0b00, 0b01, 0b00, 0b11, 0b10, 0b00];
    }

    #[test]
    fn sparse_predictions_agree_with_the_textbook() {
        let mut stream = Stream::new(3, 1);
        for _ in 0..50 {
            let a = random_matrix::<6, 6>(&mut stream);
            let mut p = a * a.transpose();
            let mut ud = UdCovariance::factor(&p).unwrap();
            for _ in 0..5 {
                let mut phi = random_matrix::<6, 6>(&mut stream);
                let mut gamma = random_matrix::<6, 2>(&mut stream);
                phi.row_iter_mut().zip(<Sparse as Structure<6, 2>>::PHI).for_each(|(mut row, bits)| {
                    row.iter_mut().enumerate().filter(|(k, _)| !has(bits, *k)).for_each(|(_, v)| *v = 0.0);
                });
                gamma.row_iter_mut().zip(<Sparse as Structure<6, 2>>::GAMMA).for_each(|(mut row, bits)| {
                    row.iter_mut().enumerate().filter(|(k, _)| !has(bits, *k)).for_each(|(_, v)| *v = 0.0);
                });
                phi[(5, 5)] = 1.0;
                let q = SVector::<f64, 2>::new(stream.uniform(), stream.uniform());
                ud.predict_sparse::<2, Sparse>(&phi, &gamma, &q);
                p = phi * p * phi.transpose() + gamma * SMatrix::from_diagonal(&q) * gamma.transpose();
                close(&ud.covariance(), &p);
            }
        }
    }

    #[test]
    fn sources_are_what_elimination_leaves() {
        // the last state is a constant, which leaves no trace; the others collect those below that share a source
        let sources = <Sparse as Structure<6, 2>>::SOURCES;
        assert_eq!(sources, [0b11_011111, 0b11_011110, 0b11_011110, 0b11_011110, 0b10_010000, 0b00_100000]);
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
