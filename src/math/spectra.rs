//! Autocorrelation and periodogram of a series with possibly missing samples (NaN).
//!
//! Missing samples are treated as in amplitude-modulated series (Parzen, Sankhya A 25 (1963) 383): the sum of the
//! products that exist, scaled by how many there could have been.

use rayon::prelude::*;
use realfft::num_complex::Complex;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};
use std::cell::RefCell;
use std::sync::Arc;

/// Samples whose spectra one core adds up, at least: the sums do not depend on how many cores there are.
const TOGETHER: usize = 1 << 19;
/// The shortest transforms: shorter ones spend their time between them.
const SHORTEST: usize = 1 << 11;

/// Products of samples up to which summing them takes less time than transforms do.
const DIRECT: usize = 1 << 14;
/// Longest transforms whose plans are kept: a permutation test asks for one plan a thousand times, and planning takes as long as ten
/// transforms.
const KEPT: usize = 1 << 16;

thread_local! {
    static PLANNER: RefCell<RealFftPlanner<f64>> = RefCell::new(RealFftPlanner::new());
}

/// Transforms of `size` samples, there and back.
fn plans(size: usize) -> (Arc<dyn RealToComplex<f64>>, Arc<dyn ComplexToReal<f64>>) {
    let both = |planner: &mut RealFftPlanner<f64>| (planner.plan_fft_forward(size), planner.plan_fft_inverse(size));
    if size <= KEPT { PLANNER.with_borrow_mut(both) } else { both(&mut RealFftPlanner::new()) }
}

/// Sums from one pass over a series.
struct Products {
    /// Σ y\[i\] y\[i+k\], k = 0..=max_lag.
    lagged: Vec<f64>,
    /// Σ y.
    total: f64,
    /// Samples that are there.
    there: usize,
}

/// Sums of products of y = `value`(x).
///
/// Pieces of B > max_lag samples go once each through a transform of 2B: with X of one and N of the next, |X|² holds the
/// products inside a piece, and conj(X) N, moved by B samples, those that reach into the next, at lags below 2B.
fn lagged_products(x: &[f64], value: impl Fn(f64) -> f64 + Sync, max_lag: usize) -> Products {
    if (max_lag + 1) * x.len() <= DIRECT {
        let y: Vec<f64> = x.iter().map(|v| value(*v)).collect();
        let product = |k: usize| y.iter().zip(y.get(k..).unwrap_or(&[])).map(|(a, b)| a * b).sum();
        let there = x.iter().filter(|v| v.is_finite()).count();
        return Products { lagged: (0..=max_lag).map(product).collect(), total: y.iter().sum(), there };
    }
    let size = (2 * (max_lag + 1)).next_power_of_two().max(SHORTEST);
    let block = size / 2;
    let together = TOGETHER.div_ceil(block);
    let (forward, back) = plans(size);
    let arch = pulp::Arch::new();
    let of_stretch = |first: usize| {
        let mut sum = forward.make_output_vec();
        let mut piece = forward.make_input_vec();
        let (mut last, mut now) = (forward.make_output_vec(), forward.make_output_vec());
        let mut scratch = forward.make_scratch_vec();
        let (mut total, mut there) = (0.0, 0);
        // and the first piece of the next stretch, for the products that reach into it
        for (at, start) in (first..x.len()).step_by(block).take(together + 1).enumerate() {
            let own = &x[start..(start + block).min(x.len())];
            let found = arch.dispatch(
                #[inline(always)]
                || fill(&mut piece, own, &value),
            );
            // buffers come from the plan itself, so their lengths always fit
            if forward.process_with_scratch(&mut piece, &mut now, &mut scratch).is_err() {
                now.fill(Complex::default());
            }
            if at < together {
                total += now[0].re;
                there += found;
            }
            arch.dispatch(
                #[inline(always)]
                || match at {
                    0 => add::<true, false>(&mut sum, &last, &now),
                    _ if at == together => add::<false, true>(&mut sum, &last, &now),
                    _ => add::<true, true>(&mut sum, &last, &now),
                },
            );
            std::mem::swap(&mut last, &mut now);
        }
        (sum, total, there)
    };
    let firsts: Vec<usize> = (0..x.len()).step_by(block * together).collect();
    let stretches: Vec<_> = firsts.into_par_iter().map(of_stretch).collect();
    let mut sum = forward.make_output_vec();
    let (mut total, mut there) = (0.0, 0);
    for (one, its_total, its_there) in &stretches {
        sum.iter_mut().zip(one).for_each(|(s, v)| *s += v);
        total += its_total;
        there += its_there;
    }
    let mut out = back.make_output_vec();
    if let Some(first) = sum.first_mut() {
        first.im = 0.0;
    }
    if let Some(last) = sum.last_mut() {
        last.im = 0.0;
    }
    inverse(back.as_ref(), &mut sum, &mut out);
    Products { lagged: out.iter().take(max_lag + 1).map(|v| v / size as f64).collect(), total, there }
}

/// Puts y into a piece, zeros behind it: how many samples are there.
#[inline(always)]
fn fill(piece: &mut [f64], own: &[f64], value: impl Fn(f64) -> f64) -> usize {
    let mut there = 0;
    for (to, from) in piece.iter_mut().zip(own) {
        *to = value(*from);
        there += u64::from(from.is_finite());
    }
    piece[own.len()..].fill(0.0);
    there as usize
}

/// Adds |`now`|² where `OWN`, and conj(`last`) `now` (-1)ᵏ where `NEXT`: half a transform further on.
#[inline(always)]
fn add<const OWN: bool, const NEXT: bool>(sum: &mut [Complex<f64>], last: &[Complex<f64>], now: &[Complex<f64>]) {
    let one = |s: &mut Complex<f64>, l: &Complex<f64>, n: &Complex<f64>, sign: f64| {
        if OWN {
            s.re += n.re * n.re + n.im * n.im;
        }
        if NEXT {
            s.re += sign * (l.re * n.re + l.im * n.im);
            s.im += sign * (l.re * n.im - l.im * n.re);
        }
    };
    let (pairs, end) = sum.as_chunks_mut::<2>();
    for ((s, l), n) in pairs.iter_mut().zip(last.as_chunks::<2>().0).zip(now.as_chunks::<2>().0) {
        one(&mut s[0], &l[0], &n[0], 1.0);
        one(&mut s[1], &l[1], &n[1], -1.0);
    }
    // of the B + 1 numbers the last has an even place
    if let ([s], Some(l), Some(n)) = (end, last.last(), now.last()) {
        one(s, l, n, 1.0);
    }
}

fn inverse(plan: &dyn ComplexToReal<f64>, input: &mut [Complex<f64>], output: &mut [f64]) -> bool {
    plan.process(input, output).is_ok()
}

/// A sample about `level`, zero where it is missing.
fn about(level: f64) -> impl Fn(f64) -> f64 + Sync {
    move |v| if v.is_finite() { v - level } else { 0.0 }
}

/// Mean of the samples that are there.
fn mean(x: &[f64]) -> f64 {
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
    sum / there.max(1) as f64
}

/// Mean of a few thousand samples from all over the series: sums about it keep their digits.
fn near_mean(x: &[f64]) -> f64 {
    let few = || x.iter().step_by((x.len() / 4096).max(1)).filter(|v| v.is_finite());
    few().sum::<f64>() / few().count().max(1) as f64
}

/// Σ (y\[i\] - d)(y\[i+k\] - d) from Σ y\[i\] y\[i+k\] of a complete series y = x - `level`, d its mean.
fn about_mean(x: &[f64], level: f64, sums: &Products) -> Vec<f64> {
    let n = x.len();
    let d = sums.total / n as f64;
    let (mut head, mut tail) = (0.0, 0.0);
    let at = |k: usize| {
        // what k samples leave out at either end
        if k > 0 {
            head += x[k - 1] - level;
            tail += x[n - k] - level;
        }
        sums.lagged[k] - d * (2.0 * sums.total - head - tail) + (n - k) as f64 * d * d
    };
    (0..sums.lagged.len()).map(at).collect()
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
    let max_lag = max_lag.min(x.len().saturating_sub(1));
    let level = near_mean(x);
    let sums = lagged_products(x, about(level), max_lag);
    let there = sums.there;
    if there < 2 {
        return None;
    }
    // where samples are missing, the sums about another level are not all that is needed
    let products = match there == x.len() {
        true => about_mean(x, level, &sums),
        false => lagged_products(x, about(level + sums.total / there as f64), max_lag).lagged,
    };
    if !(products[0] > 0.0) {
        return None;
    }
    let n = x.len() as f64;
    let could = |k: usize| (x.len() - k) as f64;
    let pairs: Vec<f64> = if there == x.len() {
        (0..=max_lag).map(could).collect()
    } else {
        let is_there = |v: f64| f64::from(u8::from(v.is_finite()));
        lagged_products(x, is_there, max_lag).lagged.iter().map(|p| p.round()).collect()
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
pub(crate) fn quick_len(len: usize) -> usize {
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
pub(crate) struct Periodogram {
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
    pub(crate) fn new(len: usize) -> Self {
        let plan = RealFftPlanner::<f64>::new().plan_fft_forward(len.max(1));
        Self { input: plan.make_input_vec(), output: plan.make_output_vec(), plan }
    }

    /// |X_j|² at the Fourier frequencies j = 1 ..= (n-1)/2: neither zero nor Nyquist. Missing samples count as the
    /// mean. Empty if `x` has another length than the plan.
    pub(crate) fn ordinates(&mut self, x: &[f64]) -> Vec<f64> {
        if x.len() != self.input.len() || x.len() < 3 {
            return Vec::new();
        }
        fill(&mut self.input, x, about(mean(x)));
        if self.plan.process(&mut self.input, &mut self.output).is_err() {
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
    fn a_thousand_lags_of_a_far_level_with_and_without_gaps() {
        for missing in [false, true] {
            let mut draw = Stream::new(6, 1);
            let mut level = 1e3;
            let mut x: Vec<f64> = (0..1_234_567)
                .map(|_| {
                    level += 0.01 * draw.normal();
                    level + draw.normal()
                })
                .collect();
            if missing {
                x.iter_mut().step_by(7).for_each(|v| *v = f64::NAN);
            }
            let found = autocorrelation(&x, 1000).unwrap();
            let there: Vec<f64> = x.iter().copied().filter(|v| v.is_finite()).collect();
            let mean = there.iter().sum::<f64>() / there.len() as f64;
            let variance = there.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / there.len() as f64;
            for k in [0, 1, 2, 7, 511, 999, 1000] {
                let pairs: Vec<f64> =
                    x.iter().zip(&x[k..]).map(|(a, b)| (a - mean) * (b - mean)).filter(|v| v.is_finite()).collect();
                let could = (x.len() - k) as f64;
                let known = pairs.iter().sum::<f64>() / pairs.len() as f64 * could / x.len() as f64 / variance;
                assert!((found.r[k] - known).abs() < 1e-11, "{missing} {k}: {} {known}", found.r[k]);
            }
        }
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
