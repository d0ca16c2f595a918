//! Is a series white? Autocorrelation, Ljung-Box, cumulative periodogram, runs.
//!
//! Missing samples are NaN. Each test gives a p value; [`Whiteness`] holds all of one series.

use super::NORMAL_975;
use super::random::Stream;
use super::spectra::{Autocorrelation, Periodogram, autocorrelation};
use serde::Serialize;
use statrs::distribution::{Binomial, ChiSquared, ContinuousCDF, DiscreteCDF, Normal};

/// Statistic and p value of one test.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TestResult {
    /// The test's statistic.
    pub statistic: f64,
    /// Probability of as large a deviation in white noise.
    pub p_value: f64,
}

/// All tests of one series.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Whiteness {
    /// Samples that are there.
    pub samples: usize,
    /// r_0 … r_m.
    pub autocorrelation: Vec<f64>,
    /// ±1.96/√n: 95 % of the autocorrelations of white noise lie inside.
    pub autocorrelation_bound: f64,
    /// Share of lags outside the bound; p value by the binomial distribution.
    pub lags_outside: TestResult,
    /// Q = n(n+2) Σ r_k²/(n-k) against χ²_m (Ljung and Box, Biometrika 65 (1978) 297).
    pub ljung_box: TestResult,
    /// Largest distance of the cumulative periodogram from the diagonal (Bartlett 1955), by Kolmogorov-Smirnov.
    pub cumulative_periodogram: TestResult,
    /// Standardised number of runs about the median (Wald and Wolfowitz, Ann. Math. Stat. 11 (1940) 147).
    pub runs: TestResult,
}

impl Whiteness {
    /// The four p values, in the order of the fields.
    #[must_use]
    pub(crate) fn p_values(&self) -> [f64; 4] {
        [self.lags_outside.p_value, self.ljung_box.p_value, self.cumulative_periodogram.p_value, self.runs.p_value]
    }

    /// Names of the four tests, for reports.
    pub(crate) const TESTS: [&'static str; 4] = ["lags outside bounds", "Ljung-Box", "cumulative periodogram", "runs"];
}

/// Lags that are looked at in a series of `n` samples: 40, or a quarter of the series.
#[must_use]
pub(crate) fn lags(n: usize) -> usize {
    40.min(n / 4)
}

/// Fewest samples for which the tests are run.
pub(crate) const FEWEST: usize = 12;

/// Transform and dither for series of one length, made once for many of them.
#[derive(Debug, Clone)]
pub(crate) struct Plan {
    periodogram: Periodogram,
    /// Standard normal dither of the runs test, as many as samples were there.
    dither: Vec<f64>,
}

impl Plan {
    /// For series of `len` samples, missing ones counted.
    #[must_use]
    pub(crate) fn new(len: usize) -> Self {
        Self { periodogram: Periodogram::new(len), dither: Vec::new() }
    }
}

/// Runs all tests on `x`, for whose length `plan` must have been made, and returns the ordinates of its periodogram
/// beside them. `None` with too few samples, or where the series is constant.
pub(crate) fn evaluate(x: &[f64], plan: &mut Plan) -> Option<(Whiteness, Vec<f64>)> {
    let n = x.iter().filter(|v| v.is_finite()).count();
    if n < FEWEST {
        return None;
    }
    let Plan { periodogram, dither } = plan;
    let (runs, (correlation, ordinates)) =
        rayon::join(|| runs(x, n, dither), || (autocorrelation(x, lags(n)), periodogram.ordinates(x)));
    let correlation = correlation?;
    let whiteness = Whiteness {
        samples: n,
        autocorrelation_bound: NORMAL_975 / correlation.effective.get(1)?.sqrt(),
        lags_outside: lags_outside(&correlation)?,
        ljung_box: ljung_box(&correlation, x.len())?,
        cumulative_periodogram: cumulative_periodogram(&ordinates)?,
        runs: runs?,
        autocorrelation: correlation.r,
    };
    Some((whiteness, ordinates))
}

fn lags_outside(c: &Autocorrelation) -> Option<TestResult> {
    let m = (c.r.len() - 1) as u64;
    let both = c.r.iter().zip(&c.effective).skip(1);
    let outside = both.filter(|(r, n)| r.abs() > NORMAL_975 / n.sqrt()).count() as u64;
    let p_value = if outside == 0 { 1.0 } else { Binomial::new(0.05, m).ok()?.sf(outside - 1) };
    Some(TestResult { statistic: outside as f64 / m as f64, p_value })
}

fn ljung_box(c: &Autocorrelation, slots: usize) -> Option<TestResult> {
    let n = slots as f64;
    let terms = c.r.iter().zip(&c.effective).enumerate().skip(1);
    let q: f64 = terms.map(|(k, (r, effective))| r * r * effective * (n + 2.0) / (n - k as f64)).sum();
    Some(TestResult { statistic: q, p_value: ChiSquared::new((c.r.len() - 1) as f64).ok()?.sf(q) })
}

/// The cumulative periodogram at its ordinates, from 1/m to 1.
#[must_use]
pub(crate) fn cumulative(ordinates: &[f64]) -> Vec<f64> {
    let total: f64 = ordinates.iter().sum();
    let mut sum = 0.0;
    ordinates
        .iter()
        .map(|p| {
            sum += p;
            sum / total
        })
        .collect()
}

fn cumulative_periodogram(ordinates: &[f64]) -> Option<TestResult> {
    // the last value is 1 by construction: m - 1 uniform order statistics remain
    let m = ordinates.len().checked_sub(1).filter(|m| *m > 1)?;
    let mf = m as f64;
    let distance = cumulative(ordinates)
        .iter()
        .take(m)
        .enumerate()
        .map(|(j, c)| ((j + 1) as f64 / mf - c).max(c - j as f64 / mf))
        .fold(0.0, f64::max);
    Some(TestResult { statistic: distance, p_value: kolmogorov(distance * (mf.sqrt() + 0.12 + 0.11 / mf.sqrt())) })
}

/// Distance of the cumulative periodogram's 95 % band from the diagonal, for `m` ordinates.
#[must_use]
pub(crate) fn kolmogorov_band95(m: usize) -> f64 {
    let m = (m.max(2) - 1) as f64;
    1.358 / (m.sqrt() + 0.12 + 0.11 / m.sqrt())
}

/// P(sup |Brownian bridge| > x) = 2 Σ (-1)^(k-1) exp(-2k²x²); the argument carries Stephens's (1970) correction.
fn kolmogorov(x: f64) -> f64 {
    if x < 0.2 {
        return 1.0;
    }
    let mut sum = 0.0;
    for k in 1..=100 {
        let kf = f64::from(k);
        let term = (-2.0 * kf * kf * x * x).exp();
        sum += if k % 2 == 1 { term } else { -term };
        if term < 1e-17 {
            break;
        }
    }
    (2.0 * sum).clamp(0.0, 1.0)
}

/// Standard deviations of dither that the runs test adds.
const DITHER: f64 = 0.5;

/// Runs about the median. Where many samples share a value (a lattice, or a sharp peak), the side on which they fall
/// would be decided by the last digits of whatever smooth curve was subtracted, in long runs; independent dither
/// decides it instead, and leaves white noise white. Its seed is fixed, so that series of `n` samples that are there share
/// one `dither`.
fn runs(x: &[f64], n: usize, dither: &mut Vec<f64>) -> Option<TestResult> {
    if dither.len() != n {
        let mut draw = Stream::new(0, n as u64);
        *dither = (0..n).map(|_| draw.normal()).collect();
    }
    let square: f64 = x.iter().filter(|v| v.is_finite()).map(|v| v * v).sum();
    let size = DITHER * (square / n as f64).sqrt();
    let there: Vec<f64> = x.iter().filter(|v| v.is_finite()).zip(dither).map(|(v, d)| v + size * *d).collect();
    let mut sorted = there.clone();
    let median = *sorted.select_nth_unstable_by(n / 2, f64::total_cmp).1;
    // without a branch on the side, which in white noise nobody can predict
    let (mut above, mut total, mut runs, mut last) = (0_u64, 0_u64, 0_u64, 2);
    for v in there.iter().filter(|v| **v != median) {
        let side = u64::from(*v > median);
        above += side;
        total += 1;
        runs += u64::from(side != last);
        last = side;
    }
    let [above, total, runs] = [above, total, runs].map(|count| count as f64);
    let below = total - above;
    let mean = 2.0 * above * below / total + 1.0;
    let variance = (mean - 1.0) * (mean - 2.0) / (total - 1.0);
    if !(variance > 0.0) {
        return Some(TestResult { statistic: 0.0, p_value: 1.0 });
    }
    let z = (runs - mean) / variance.sqrt();
    Some(TestResult { statistic: z, p_value: 2.0 * Normal::standard().sf(z.abs()) })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Share of rejections at 5 % in `draws` series of `n` by each test.
    fn rejections(n: usize, draws: u64, series: impl Fn(&mut Stream) -> Vec<f64>) -> [f64; 4] {
        let mut plan = Plan::new(n);
        let mut count = [0.0; 4];
        for seed in 0..draws {
            let (w, _) = evaluate(&series(&mut Stream::new(seed, n as u64)), &mut plan).unwrap();
            w.p_values().iter().zip(&mut count).for_each(|(p, c)| *c += f64::from(u8::from(*p < 0.05)));
        }
        count.map(|c| c / draws as f64)
    }

    #[test]
    fn sizes_are_right_on_white_noise() {
        let draws = 2000;
        // 99.9 % of binomial shares at p = 0.05 lie inside
        let slack = 3.3 * (0.05f64 * 0.95 / draws as f64).sqrt();
        for n in [60, 400, 2000] {
            let [outside, ljung, bartlett, runs] = rejections(n, draws, |s| (0..n).map(|_| s.normal()).collect());
            // discrete statistics and the mean's removal make these conservative, never liberal
            assert!(outside < 0.05 + slack, "{n} {outside}");
            assert!((bartlett - 0.05).abs() < slack + 0.02, "{n} {bartlett}");
            assert!(runs < 0.05 + slack + 0.01, "{n} {runs}");
            // Ljung-Box is known to be liberal in short series: its true size is what the bootstrap is for
            let liberal = if n < 100 { 0.03 } else { 0.012 };
            assert!(ljung < 0.05 + slack + liberal, "{n} {ljung}");
        }
    }

    #[test]
    fn correlated_noise_is_seen_by_all() {
        let n = 2000;
        let power = rejections(n, 100, |s| {
            let mut level = 0.0;
            (0..n)
                .map(|_| {
                    level = 0.3 * level + s.normal();
                    level
                })
                .collect()
        });
        for (p, name) in power.iter().zip(Whiteness::TESTS) {
            // r_1 alone reaches only one lag of 40, which the count of lags cannot see
            let floor = if name == Whiteness::TESTS[0] { 0.05 } else { 0.95 };
            assert!(*p >= floor, "{name} {p}");
        }
    }

    #[test]
    fn missing_samples_do_not_raise_an_alarm() {
        let (n, draws) = (600, 1000);
        let shares =
            rejections(n, draws, |s| (0..n).map(|_| if s.uniform() < 0.1 { f64::NAN } else { s.normal() }).collect());
        let slack = 3.3 * (0.05f64 * 0.95 / draws as f64).sqrt() + 0.015;
        for (p, name) in shares.iter().zip(Whiteness::TESTS) {
            assert!(*p < 0.05 + slack, "{name} {p}");
        }
    }

    #[test]
    fn quantised_noise_keeps_the_size_of_the_runs_test() {
        let (n, draws) = (500, 1000);
        let shares = rejections(n, draws, |s| (0..n).map(|_| (s.normal() / 1.5).round()).collect());
        assert!(shares[3] < 0.05 + 3.3 * (0.05f64 * 0.95 / draws as f64).sqrt() + 0.01, "{}", shares[3]);
    }

    /// The band that is drawn is where the p value is 5 %: 1.358 is the 95 % point of Kolmogorov's distribution.
    #[test]
    fn the_band_of_the_periodogram_is_where_its_p_value_is_five_per_cent() {
        for m in [20, 500, 30_000] {
            let mf = f64::from(m - 1);
            let band = kolmogorov_band95(m as usize);
            let p_value = kolmogorov(band * (mf.sqrt() + 0.12 + 0.11 / mf.sqrt()));
            assert!((p_value - 0.05).abs() < 1e-4, "{m}: {p_value}");
        }
    }

    #[test]
    fn too_little_or_constant_is_no_answer() {
        assert!(evaluate(&[1.0; 50], &mut Plan::new(50)).is_none());
        assert!(evaluate(&[1.0, 2.0, 3.0], &mut Plan::new(3)).is_none());
        assert!(evaluate(&[f64::NAN; 50], &mut Plan::new(50)).is_none());
    }
}
