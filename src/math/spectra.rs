//! Autocorrelation and periodogram of a series with possibly missing samples (NaN).
//!
//! Missing samples are treated as in amplitude-modulated series (Parzen, Sankhya A 25 (1963) 383): the sum of the
//! products that exist, scaled by how many there could have been.

use rayon::prelude::*;
use realfft::num_complex::Complex;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};
use std::sync::Arc;

/// A series goes through transforms of eight times the lags, and no shorter ones than this: little of each is overlap, and what it
/// works on stays near the processor.
const SHORTEST: usize = 1 << 12;
/// Pieces whose spectra one core adds up: the sums do not depend on how many cores there are.
const TOGETHER: usize = 64;

/// Up to here summing directly beats planning a transform.
const DIRECT_LAGS: usize = 64;
const DIRECT_SAMPLES: usize = 1 << 17;

/// Sums Σ y\[i\] y\[i+k\], k = 0..=max_lag, of y = `value`(x).
fn lagged_products(x: &[f64], value: impl Fn(f64) -> f64 + Sync, max_lag: usize) -> Vec<f64> {
    if max_lag <= DIRECT_LAGS && x.len() <= DIRECT_SAMPLES {
        let y: Vec<f64> = x.iter().map(|v| value(*v)).collect();
        let product = |k: usize| y.iter().zip(y.get(k..).unwrap_or(&[])).map(|(a, b)| a * b).sum();
        return (0..=max_lag).map(product).collect();
    }
    let size = (8 * (max_lag + 1)).max(SHORTEST).min(x.len() + max_lag + 1).next_power_of_two();
    let block = size - max_lag - 1;
    let mut planner = RealFftPlanner::<f64>::new();
    let (forward, back) = (planner.plan_fft_forward(size), planner.plan_fft_inverse(size));
    let spectrum = |first: usize| {
        let mut sum = forward.make_output_vec();
        let (mut a, mut b) = (forward.make_input_vec(), forward.make_input_vec());
        let (mut fa, mut fb) = (forward.make_output_vec(), forward.make_output_vec());
        let starts = (first..x.len()).step_by(block).take(TOGETHER);
        for start in starts {
            // each piece meets itself and the max_lag samples after it
            let reach = (start + block + max_lag).min(x.len());
            fill(&mut b, &x[start..reach], &value);
            let own = block.min(reach - start);
            a[..own].copy_from_slice(&b[..own]);
            a[own..].fill(0.0);
            if run(forward.as_ref(), &mut a, &mut fa) && run(forward.as_ref(), &mut b, &mut fb) {
                sum.iter_mut().zip(fa.iter().zip(&fb)).for_each(|(s, (a, b))| *s += a.conj() * b);
            }
        }
        sum
    };
    let firsts: Vec<usize> = (0..x.len()).step_by(block * TOGETHER).collect();
    let spectra: Vec<_> = firsts.into_par_iter().map(spectrum).collect();
    let mut sum = forward.make_output_vec();
    spectra.iter().for_each(|one| sum.iter_mut().zip(one).for_each(|(s, v)| *s += v));
    let mut out = back.make_output_vec();
    if let Some(first) = sum.first_mut() {
        first.im = 0.0;
    }
    if let Some(last) = sum.last_mut() {
        last.im = 0.0;
    }
    inverse(back.as_ref(), &mut sum, &mut out);
    out.iter().take(max_lag + 1).map(|v| v / size as f64).collect()
}

fn fill(buffer: &mut [f64], values: &[f64], value: impl Fn(f64) -> f64) {
    buffer.iter_mut().zip(values).for_each(|(to, from)| *to = value(*from));
    buffer[values.len()..].fill(0.0);
}

/// Buffers come from the plan itself, so their lengths always fit.
fn run(plan: &dyn RealToComplex<f64>, input: &mut [f64], output: &mut [Complex<f64>]) -> bool {
    plan.process(input, output).is_ok()
}

fn inverse(plan: &dyn ComplexToReal<f64>, input: &mut [Complex<f64>], output: &mut [f64]) -> bool {
    plan.process(input, output).is_ok()
}

/// Mean of the samples that are there, and how many they are.
fn mean(x: &[f64]) -> (f64, usize) {
    const CHUNK: usize = 1 << 16;
    // eight sums side by side: one waits for each addition before the next
    let add = |chunk: &[f64]| {
        let (mut sums, mut there) = ([0.0; 8], [0; 8]);
        let (eights, rest) = chunk.as_chunks::<8>();
        let mut take = |part: &[f64]| {
            for ((sum, there), v) in sums.iter_mut().zip(&mut there).zip(part) {
                let is_there = v.is_finite();
                *sum += if is_there { *v } else { 0.0 };
                *there += usize::from(is_there);
            }
        };
        eights.iter().for_each(|eight| take(eight));
        take(rest);
        (sums.iter().sum::<f64>(), there.iter().sum::<usize>())
    };
    let sums: Vec<_> = x.par_chunks(CHUNK).map(add).collect();
    let (sum, there) = sums.into_iter().fold((0.0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
    (sum / there.max(1) as f64, there)
}

/// A sample about the mean, zero where it is missing.
fn about(mean: f64) -> impl Fn(f64) -> f64 + Sync {
    move |v| if v.is_finite() { v - mean } else { 0.0 }
}

/// Sample autocorrelation with what it rests on.
#[derive(Debug, Clone, PartialEq)]
pub struct Autocorrelation {
    /// r_0 … r_m.
    pub r: Vec<f64>,
    /// Number of samples of a complete series in which r_k would be known as well; its standard error in white noise
    /// is one over the root of it.
    pub effective: Vec<f64>,
}

/// Sample autocorrelation, lags 0 to `max_lag` (fewer if the series is shorter), the mean removed.
///
/// r_k = c_k / c_0, c_k = Σ x\[i\] x\[i+k\] (n-k)/(n n_k) over the n_k pairs that exist of the n - k that could.
/// `None` for a series that is constant or has fewer than two samples.
#[must_use]
pub fn autocorrelation(x: &[f64], max_lag: usize) -> Option<Autocorrelation> {
    let (mean, there) = mean(x);
    let max_lag = max_lag.min(x.len().saturating_sub(1));
    if there < 2 {
        return None;
    }
    let products = lagged_products(x, about(mean), max_lag);
    if !(products[0] > 0.0) {
        return None;
    }
    let n = x.len() as f64;
    let could = |k: usize| (x.len() - k) as f64;
    let pairs: Vec<f64> = if there == x.len() {
        (0..=max_lag).map(could).collect()
    } else {
        let is_there = |v: f64| f64::from(u8::from(v.is_finite()));
        lagged_products(x, is_there, max_lag).iter().map(|p| p.round()).collect()
    };
    let variance = products[0] / there as f64;
    let covariance = |k: usize| if pairs[k] > 0.0 { products[k] / pairs[k] } else { 0.0 };
    // without missing samples this is the usual Σ x[i] x[i+k] / Σ x²
    let r = (0..=max_lag).map(|k| covariance(k) * could(k) / (n * variance)).collect();
    let effective = (0..=max_lag).map(|k| pairs[k] * n / could(k)).collect();
    Some(Autocorrelation { r, effective })
}

/// The largest even length up to `len` without prime factors above seven, within about a hundredth: a transform of it
/// takes a quarter of the time that one of a length with large factors does. Short lengths stay as they are.
#[must_use]
pub fn quick_len(len: usize) -> usize {
    const SHORT: usize = 4096;
    let smooth = |n: &usize| {
        [2, 3, 5, 7].iter().fold(*n, |mut n, p| {
            while n % p == 0 {
                n /= p;
            }
            n
        }) == 1
    };
    if len <= SHORT { len } else { (SHORT..=len).rev().filter(|n| n % 2 == 0).find(smooth).unwrap_or(len) }
}

/// Reusable transform for the periodogram of series of one length.
#[derive(Clone)]
pub struct Periodogram {
    plan: Arc<dyn RealToComplex<f64>>,
    input: Vec<f64>,
    output: Vec<Complex<f64>>,
}

impl std::fmt::Debug for Periodogram {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Periodogram").field("len", &self.input.len()).finish_non_exhaustive()
    }
}

impl Periodogram {
    /// For series of `len` samples.
    #[must_use]
    pub fn new(len: usize) -> Self {
        let plan = RealFftPlanner::<f64>::new().plan_fft_forward(len.max(1));
        Self { input: plan.make_input_vec(), output: plan.make_output_vec(), plan }
    }

    /// |X_j|² at the Fourier frequencies j = 1 ..= (n-1)/2: neither zero nor Nyquist. Missing samples count as the
    /// mean. Empty if `x` has another length than the plan.
    pub fn ordinates(&mut self, x: &[f64]) -> Vec<f64> {
        if x.len() != self.input.len() || x.len() < 3 {
            return Vec::new();
        }
        fill(&mut self.input, x, about(mean(x).0));
        if !run(self.plan.as_ref(), &mut self.input, &mut self.output) {
            return Vec::new();
        }
        self.output[1..=(x.len() - 1) / 2].iter().map(Complex::norm_sqr).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Stream;

    fn plain(x: &[f64], k: usize) -> f64 {
        let mean = x.iter().sum::<f64>() / x.len() as f64;
        let c = |k: usize| (0..x.len() - k).map(|i| (x[i] - mean) * (x[i + k] - mean)).sum::<f64>();
        c(k) / c(0)
    }

    #[test]
    fn autocorrelation_is_its_definition_also_in_pieces() {
        for n in [2usize, 3, 57, 1000, 150_000, 700_001] {
            let mut draw = Stream::new(5, n as u64);
            let x: Vec<f64> = (0..n).map(|_| 3.0 + draw.normal()).collect();
            let r = autocorrelation(&x, 40).unwrap().r;
            assert_eq!(r.len(), n.min(41));
            for k in [0, 1, 7, 40].into_iter().filter(|k| *k < n) {
                assert!((r[k] - plain(&x, k)).abs() < 1e-11, "{n} {k}");
            }
        }
    }

    #[test]
    fn missing_samples_bias_nothing() {
        // AR(1) with a tenth of the samples gone: r_k = phi^k, standard error of r_1 about 1/sqrt(n)
        let n = 200_000;
        let mut draw = Stream::new(9, 0);
        let mut level = 0.0;
        let mut x: Vec<f64> = Vec::with_capacity(n);
        for _ in 0..n {
            level = 0.6 * level + draw.normal();
            x.push(if draw.uniform() < 0.1 { f64::NAN } else { level });
        }
        let r = autocorrelation(&x, 3).unwrap().r;
        for (k, r) in r.iter().enumerate() {
            let truth = 0.6f64.powi(k as i32);
            assert!((r - truth).abs() < 6.0 / (0.81 * n as f64).sqrt(), "{k}: {r} {truth}");
        }
    }

    #[test]
    fn quick_lengths_lose_little() {
        for n in [4097, 37_579, 100_001, 999_983] {
            let m = quick_len(n);
            assert!(m <= n && m as f64 > 0.98 * n as f64 && m.is_multiple_of(2), "{n}: {m}");
        }
        assert_eq!(quick_len(1 << 16), 1 << 16);
        assert_eq!(quick_len(31), 31);
    }

    #[test]
    fn periodogram_finds_a_line_and_keeps_the_power() {
        let n = 1001;
        let x: Vec<f64> = (0..n).map(|i| (std::f64::consts::TAU * 25.0 * i as f64 / n as f64).cos()).collect();
        let p = Periodogram::new(n).ordinates(&x);
        assert_eq!(p.len(), 500);
        let top = (0..p.len()).max_by(|&a, &b| p[a].total_cmp(&p[b])).unwrap();
        assert_eq!(top + 1, 25);
        // Parseval: 2 Σ |X|² / n = Σ x²
        assert!((2.0 * p.iter().sum::<f64>() / n as f64 - n as f64 / 2.0).abs() < 1e-6);
        assert!(Periodogram::new(10).ordinates(&x).is_empty());
    }
}
