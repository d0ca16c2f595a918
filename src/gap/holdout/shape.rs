//! distance = root mean square over octaves of ln(hold) - mean ln(simulated)
//!
//! Allan deviation (overlapping; IEEE Std 1139) and power spectrum (Hann window) of the residuals of a least-squares
//! fit of the nominal coefficients, the same for real and simulated recordings: their difference is the simulator's.

use crate::gap::answer::Metric;
use crate::gap::rest::state_space::StateSpaceModel;
use crate::math::spectra::{Periodogram, quick_len};
use std::f64::consts::{SQRT_2, TAU};

/// A curve of the hold-out recording at one averaging time or frequency, with the ranges of simulated recordings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Band {
    /// Averaging time, s, or frequency, Hz.
    pub at: f64,
    /// Value of the hold-out recording.
    pub hold: f64,
    /// Range of the nominal simulator: two standard deviations of the logarithm about its mean.
    pub nominal: [f64; 2],
    /// The same of the augmented simulator.
    pub augmented: [f64; 2],
}

/// Allan deviation and spectrum of one recording, as logarithms.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Shape {
    averaging_time_s: Vec<f64>,
    ln_allan_deviation: Vec<f64>,
    frequency_hz: Vec<f64>,
    ln_power: Vec<f64>,
}

/// Removal of the nominal simulator's coefficients, by least squares, from recordings with the same readings missing.
pub(super) struct Residuals {
    step_s: f64,
    there: Vec<bool>,
    fixed: Option<Vec<f64>>,
    /// Orthonormal over the rows that are present, zero in the others.
    columns: Vec<Vec<f64>>,
    periodogram: Periodogram,
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn project(values: &mut [f64], columns: &[Vec<f64>]) {
    for q in columns {
        let along = dot(q, values);
        values.iter_mut().zip(q).for_each(|(v, q)| *v -= along * q);
    }
}

impl Residuals {
    pub(super) fn new(reading_rad_s: &[f64], nominal: &StateSpaceModel) -> Self {
        /// Share of a column outside the span of those before it, below which it depends on them.
        const DEPENDENT: f64 = 1e-9;
        let there: Vec<bool> = reading_rad_s.iter().map(|v| v.is_finite()).collect();
        let mut columns: Vec<Vec<f64>> = Vec::new();
        let constant = vec![1.0; there.len()];
        let varying = nominal.coefficients.iter().filter(|c| c.std > 0.0).map(|c| &c.column);
        for column in std::iter::once(&constant).chain(varying) {
            let mut q: Vec<f64> = column.iter().zip(&there).map(|(x, t)| if *t { *x } else { 0.0 }).collect();
            let whole = dot(&q, &q).sqrt();
            // twice is enough (Parlett, The Symmetric Eigenvalue Problem, §6.9)
            (0..2).for_each(|_| project(&mut q, &columns));
            let left = dot(&q, &q).sqrt();
            if left > DEPENDENT * whole {
                q.iter_mut().for_each(|v| *v /= left);
                columns.push(q);
            }
        }
        let periodogram = Periodogram::new(quick_len(there.len()));
        Self { step_s: nominal.step_s, there, fixed: nominal.fixed_rad_s.clone(), columns, periodogram }
    }

    /// Residual of a recording, rad/s; 0 where a reading is missing.
    fn of(&self, reading_rad_s: &[f64]) -> Vec<f64> {
        let fixed = |k: usize| self.fixed.as_ref().map_or(0.0, |f| f[k]);
        let there = self.there.iter().zip(reading_rad_s).enumerate();
        let mut y: Vec<f64> = there.map(|(k, (there, y))| if *there { y - fixed(k) } else { 0.0 }).collect();
        project(&mut y, &self.columns);
        y
    }
}

impl Shape {
    pub(super) fn new(reading_rad_s: &[f64], residuals: &Residuals) -> Self {
        let r = residuals.of(reading_rad_s);
        let (averaging_time_s, deviation) = allan_deviation(&r, residuals.step_s).into_iter().unzip();
        let (frequency_hz, power) = spectrum(&r, residuals.step_s, residuals.periodogram.clone()).into_iter().unzip();
        let ln = |v: Vec<f64>| v.into_iter().map(|v| v.max(f64::MIN_POSITIVE).ln()).collect();
        Self { averaging_time_s, ln_allan_deviation: ln(deviation), frequency_hz, ln_power: ln(power) }
    }
}

/// (τ, σ(τ)) at octaves from the sample time to an eighth of the recording.
fn allan_deviation(rate_rad_s: &[f64], step_s: f64) -> Vec<(f64, f64)> {
    let mut angle = vec![0.0];
    let mut sum = 0.0;
    for r in rate_rad_s {
        sum += r;
        angle.push(sum);
    }
    std::iter::successors(Some(1), |m: &usize| Some(2 * m))
        .take_while(|m| 8 * m <= rate_rad_s.len())
        .map(|m| {
            // second differences of the angle
            // starts τ/32 apart lose hardly any information
            let starts = (0..angle.len() - 2 * m).step_by((m / 32).max(1));
            let n = starts.len();
            let square: f64 = starts.map(|i| (angle[i + 2 * m] - 2.0 * angle[i + m] + angle[i]).powi(2)).sum();
            (m as f64 * step_s, (square / (2 * n) as f64).sqrt() / m as f64)
        })
        .collect()
}

/// (frequency, two-sided PSD) in half octaves, at least four ordinates each.
fn spectrum(rate_rad_s: &[f64], step_s: f64, mut periodogram: Periodogram) -> Vec<(f64, f64)> {
    let n = quick_len(rate_rad_s.len());
    let window = |k: usize| 1.0 - (TAU * (k as f64 + 0.5) / n as f64).cos();
    let tapered: Vec<f64> = rate_rad_s[..n].iter().enumerate().map(|(k, r)| window(k) * r).collect();
    // the window's mean square is 3/2
    let scale = step_s / (1.5 * n as f64);
    let ordinates = periodogram.ordinates(&tapered);
    let mut out = Vec::new();
    let mut from = 0;
    while from + 4 <= ordinates.len() {
        let to = (((from + 1) as f64 * SQRT_2).ceil() as usize).max(from + 4).min(ordinates.len());
        let mean = ordinates[from..to].iter().sum::<f64>() / (to - from) as f64;
        let middle = 0.5 * (from + 1 + to) as f64;
        out.push((middle / (n as f64 * step_s), mean * scale));
        from = to;
    }
    out
}

/// Mean and standard deviation of the value `at` of a curve, over recordings.
fn moments(curves: &[&Vec<f64>], at: usize) -> (f64, f64) {
    let n = curves.len() as f64;
    let mean = curves.iter().map(|c| c[at]).sum::<f64>() / n;
    let square = curves.iter().map(|c| (c[at] - mean).powi(2)).sum::<f64>();
    (mean, (square / (n - 1.0)).sqrt())
}

fn distance(curve: &[f64], others: &[&Vec<f64>]) -> f64 {
    let square = |at: usize| (curve[at] - moments(others, at).0).powi(2);
    ((0..curve.len()).map(square).sum::<f64>() / curve.len().max(1) as f64).sqrt()
}

/// Both distances; the floor is that of each augmented recording from the mean of the other augmented recordings.
pub(super) fn metrics(hold: &Shape, nominal: &[&Shape], augmented: &[&Shape]) -> [Metric; 2] {
    let metric = |name: &str, curve: &dyn Fn(&Shape) -> &Vec<f64>| {
        fn pick<'s>(shapes: &[&'s Shape], curve: &dyn Fn(&Shape) -> &Vec<f64>) -> Vec<&'s Vec<f64>> {
            shapes.iter().map(|s| curve(s)).collect()
        }
        let (before, after) = (pick(nominal, curve), pick(augmented, curve));
        let own = |at: usize| {
            let others: Vec<&Vec<f64>> =
                after.iter().enumerate().filter(|(other, _)| *other != at).map(|(_, c)| *c).collect();
            distance(after[at], &others)
        };
        Metric {
            metric: name.into(),
            before: distance(curve(hold), &before),
            after: distance(curve(hold), &after),
            floor: (0..after.len()).map(own).sum::<f64>() / after.len() as f64,
        }
    };
    [metric("allan_deviation_ln_rms", &|s| &s.ln_allan_deviation), metric("spectrum_ln_rms", &|s| &s.ln_power)]
}

/// Curves with the ranges of the simulated ones: Allan deviation, spectrum.
pub(super) fn bands(hold: &Shape, nominal: &[&Shape], augmented: &[&Shape]) -> (Vec<Band>, Vec<Band>) {
    let range = |curves: &[&Vec<f64>], at: usize| {
        let (mean, std) = moments(curves, at);
        [(mean - 2.0 * std).exp(), (mean + 2.0 * std).exp()]
    };
    let curve = |abscissae: &[f64], pick: fn(&Shape) -> &Vec<f64>| -> Vec<Band> {
        let before: Vec<&Vec<f64>> = nominal.iter().map(|s| pick(s)).collect();
        let after: Vec<&Vec<f64>> = augmented.iter().map(|s| pick(s)).collect();
        let band = |(at, abscissa): (usize, &f64)| Band {
            at: *abscissa,
            hold: pick(hold)[at].exp(),
            nominal: range(&before, at),
            augmented: range(&after, at),
        };
        abscissae.iter().enumerate().map(band).collect()
    };
    (curve(&hold.averaging_time_s, |s| &s.ln_allan_deviation), curve(&hold.frequency_hz, |s| &s.ln_power))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Stream;

    #[test]
    fn white_noise_has_its_allan_deviation_and_spectrum() {
        let (n, step_s, std) = (1 << 16, 0.02, 3e-4);
        let mut draw = Stream::new(4, 0);
        let y: Vec<f64> = (0..n).map(|_| std * draw.normal()).collect();
        for (tau, deviation) in allan_deviation(&y, step_s) {
            let truth = std * (step_s / tau).sqrt();
            // relative standard error of overlapping estimates is below sqrt(τ/T)
            let error = (tau / (n as f64 * step_s)).sqrt().max(0.004);
            assert!((deviation / truth - 1.0).abs() < 4.0 * error, "{tau}: {deviation} {truth}");
        }
        let bands = spectrum(&y, step_s, Periodogram::new(n));
        let truth = std * std * step_s;
        let mean = bands.iter().rev().take(6).map(|(_, p)| p / truth).sum::<f64>() / 6.0;
        assert!((mean - 1.0).abs() < 0.05, "{mean}");
        assert!(bands.iter().all(|(f, _)| *f < 25.0));
    }

    #[test]
    fn a_random_walk_rises_with_the_root_of_the_averaging_time() {
        let (n, step_s, walk) = (1 << 16, 0.02, 1e-5);
        let mut draw = Stream::new(5, 0);
        let mut level = 0.0;
        let y: Vec<f64> = (0..n)
            .map(|_| {
                level += walk * f64::sqrt(step_s) * draw.normal();
                level
            })
            .collect();
        // σ² = K² τ / 3 (IEEE Std 952), averaging times long against the sample time
        for (tau, deviation) in allan_deviation(&y, step_s).into_iter().skip(5).take(5) {
            let truth = walk * (tau / 3.0).sqrt();
            let error = (tau / (n as f64 * step_s)).sqrt();
            assert!((deviation / truth - 1.0).abs() < 4.0 * error.max(0.01), "{tau}: {deviation} {truth}");
        }
    }
}
