//! X_k = c_k Σ x_n cos(πk(2n+1)/2N), c_0 = √(1/N), else √(2/N): the orthonormal cosine transform (DCT-II), and back
//!
//! A random walk plus white noise has independent coefficients in it, of variance σ² + q/(2-2cos(πk/N)) for k > 0: the
//! cosines are the eigenvectors of the differences' normal matrix with free ends (Strang, SIAM Review 41 (1999) 135).
//! By one complex transform of half the length of the even extension (Makhoul, IEEE Trans. ASSP 28 (1980) 27).

use realfft::num_complex::Complex;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};
use std::f64::consts::PI;
use std::sync::Arc;

/// Transforms of one length.
pub(crate) struct Cosine {
    len: usize,
    forward: Arc<dyn RealToComplex<f64>>,
    back: Arc<dyn ComplexToReal<f64>>,
    /// exp(-iπk/2N), k = 0..=N/2
    twiddle: Vec<Complex<f64>>,
}

impl Cosine {
    /// Plans for series of `len` samples.
    #[must_use]
    pub(crate) fn new(len: usize) -> Self {
        let mut planner = RealFftPlanner::<f64>::new();
        let size = len.max(1);
        let angle = |k: usize| -PI * k as f64 / (2.0 * size as f64);
        Self {
            len,
            forward: planner.plan_fft_forward(size),
            back: planner.plan_fft_inverse(size),
            twiddle: (0..=size / 2).map(|k| Complex::from_polar(1.0, angle(k))).collect(),
        }
    }

    /// Length of the series.
    #[must_use]
    pub(crate) fn len(&self) -> usize {
        self.len
    }

    /// Coefficients of `x`; samples beyond the length are ignored, missing ones are zero.
    #[must_use]
    pub(crate) fn forward(&self, x: &[f64]) -> Vec<f64> {
        let n = self.len;
        if n == 0 {
            return Vec::new();
        }
        let at = |i: usize| x.get(i).copied().unwrap_or(0.0);
        let mut even: Vec<f64> = (0..n.div_ceil(2)).map(|i| at(2 * i)).collect();
        even.extend((0..n / 2).rev().map(|i| at(2 * i + 1)));
        let mut spectrum = self.forward.make_output_vec();
        let mut out = vec![0.0; n];
        if self.forward.process(&mut even, &mut spectrum).is_err() {
            return out;
        }
        let scale = (2.0 / n as f64).sqrt();
        for (k, (v, w)) in spectrum.iter().zip(&self.twiddle).enumerate() {
            let turned = v * w;
            out[k] = scale * turned.re;
            if k > 0 && n - k > k {
                // V[N-k] = conj V[k], its twiddle is -i conj(w): real part -Im(V w)
                out[n - k] = -scale * turned.im;
            }
        }
        out[0] *= std::f64::consts::FRAC_1_SQRT_2;
        out
    }

    /// The series that has the coefficients `c`.
    #[must_use]
    pub(crate) fn inverse(&self, c: &[f64]) -> Vec<f64> {
        let n = self.len;
        if n == 0 {
            return Vec::new();
        }
        let at = |k: usize| if k == 0 { c[0] * std::f64::consts::SQRT_2 } else { c.get(k).copied().unwrap_or(0.0) };
        let mut spectrum: Vec<Complex<f64>> = self
            .twiddle
            .iter()
            .enumerate()
            .map(|(k, w)| {
                let mirrored = if k == 0 { 0.0 } else { at(n - k) };
                Complex::new(at(k), -mirrored) * w.conj()
            })
            .collect();
        spectrum[0].im = 0.0;
        if n.is_multiple_of(2) {
            spectrum[n / 2].im = 0.0;
        }
        let mut even = self.back.make_output_vec();
        if self.back.process(&mut spectrum, &mut even).is_err() {
            return vec![0.0; n];
        }
        let scale = 1.0 / (2.0 * n as f64).sqrt();
        let mut out = vec![0.0; n];
        for (i, v) in even.iter().enumerate() {
            let row = if i < n.div_ceil(2) { 2 * i } else { 2 * (n - 1 - i) + 1 };
            out[row] = scale * v;
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Stream;

    fn by_definition(x: &[f64]) -> Vec<f64> {
        let n = x.len() as f64;
        let angle = |k: usize, i: usize| PI * k as f64 * (2 * i + 1) as f64 / (2.0 * n);
        (0..x.len())
            .map(|k| {
                let sum: f64 = x.iter().enumerate().map(|(i, v)| v * angle(k, i).cos()).sum();
                sum * if k == 0 { (1.0 / n).sqrt() } else { (2.0 / n).sqrt() }
            })
            .collect()
    }

    #[test]
    fn agrees_with_the_definition_and_goes_back() {
        for n in [1, 2, 3, 4, 7, 8, 15, 64, 101] {
            let mut draw = Stream::new(n as u64, 0);
            let x: Vec<f64> = (0..n).map(|_| draw.normal()).collect();
            let cosine = Cosine::new(n);
            let c = cosine.forward(&x);
            for (a, b) in c.iter().zip(by_definition(&x)) {
                assert!((a - b).abs() < 1e-12, "{n}: {a} {b}");
            }
            for (a, b) in cosine.inverse(&c).iter().zip(&x) {
                assert!((a - b).abs() < 1e-12, "{n}: {a} {b}");
            }
        }
    }
}
