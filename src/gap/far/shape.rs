//! distance = root mean square over octaves of ln(hold) - mean ln(simulated)
//!
//! Allan deviation (overlapping; IEEE Std 1139) and power spectrum (Hann window) of what a least-squares fit of the nominal
//! coefficients leaves, the same for real and simulated recordings: their difference is the simulator's.

use super::super::answer::Metric;
use crate::error::Result;
use crate::gap::state_space::Believed;
use crate::math::lsq::solve_qr;
use crate::math::spectra::Periodogram;
use std::f64::consts::{SQRT_2, TAU};

/// A curve of the recording kept back at one averaging time or frequency, with what simulated ones range over.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Band {
    /// Averaging time, s, or frequency, Hz.
    pub at: f64,
    /// Of the recording.
    pub hold: f64,
    /// Of the nominal simulator: two standard deviations of the logarithm about its mean.
    pub nominal: [f64; 2],
    /// Of the augmented simulator.
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

/// What the coefficients of `nominal`, fitted freely, leave of a recording; 0 where a reading is missing.
fn residuals(reading_rad_s: &[f64], nominal: &Believed) -> Result<Vec<f64>> {
    let there: Vec<usize> = (0..reading_rad_s.len()).filter(|k| reading_rad_s[*k].is_finite()).collect();
    let fixed = |k: usize| nominal.fixed_rad_s.as_ref().map_or(0.0, |f| f[k]);
    let y: Vec<f64> = there.iter().map(|k| reading_rad_s[*k] - fixed(*k)).collect();
    let mut columns: Vec<Vec<f64>> = vec![vec![1.0; there.len()]];
    let varying = nominal.coefficients.iter().filter(|c| c.std > 0.0 && c.column.iter().any(|x| *x != c.column[0]));
    columns.extend(varying.map(|c| there.iter().map(|k| c.column[*k]).collect()));
    let mut out = vec![0.0; reading_rad_s.len()];
    for (k, r) in there.iter().zip(solve_qr(&columns, &y)?.residuals) {
        out[*k] = r;
    }
    Ok(out)
}

impl Shape {
    pub(super) fn new(reading_rad_s: &[f64], nominal: &Believed) -> Result<Self> {
        let r = residuals(reading_rad_s, nominal)?;
        let (averaging_time_s, deviation) = allan_deviation(&r, nominal.step_s).into_iter().unzip();
        let (frequency_hz, power) = spectrum(&r, nominal.step_s).into_iter().unzip();
        let ln = |v: Vec<f64>| v.into_iter().map(|v| v.max(f64::MIN_POSITIVE).ln()).collect();
        Ok(Self { averaging_time_s, ln_allan_deviation: ln(deviation), frequency_hz, ln_power: ln(power) })
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
            let n = angle.len() - 2 * m;
            let square: f64 = (0..n).map(|i| (angle[i + 2 * m] - 2.0 * angle[i + m] + angle[i]).powi(2)).sum();
            (m as f64 * step_s, (square / (2 * n) as f64).sqrt() / m as f64)
        })
        .collect()
}

/// (frequency, two-sided PSD) in half octaves, at least four ordinates each.
fn spectrum(rate_rad_s: &[f64], step_s: f64) -> Vec<(f64, f64)> {
    let n = rate_rad_s.len();
    let window = |k: usize| 1.0 - (TAU * (k as f64 + 0.5) / n as f64).cos();
    let tapered: Vec<f64> = rate_rad_s.iter().enumerate().map(|(k, r)| window(k) * r).collect();
    // the window's mean square is 3/2
    let scale = step_s / (1.5 * n as f64);
    let ordinates = Periodogram::new(n).ordinates(&tapered);
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

/// Mean and standard deviation of curve `at` over recordings.
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

/// Both distances; the floor is that of each augmented recording from the mean of the others.
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
        let bands = spectrum(&y, step_s);
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
