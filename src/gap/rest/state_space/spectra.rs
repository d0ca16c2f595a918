//! S(ω) ≈ Σ_i q_i/(1 + φ_i² - 2 φ_i cos ω): spectra as states
//!
//! ω in rad/sample; a spectrum is the two-sided PSD over the sample time, rad²/s²: the variance of one coefficient of the
//! orthonormal cosine transform. 1/f noise of PSD B²/(2πf) has B²/ω, whatever the sample time.

use super::{LowPass, Markov};
use crate::error::{Error, ErrorKind, Result};
use std::f64::consts::PI;

/// Frequencies per decade at which a spectrum is fitted.
const PER_DECADE: f64 = 20.0;
/// Sweeps of coordinate descent at most.
const SWEEPS: usize = 20_000;
/// Cells of the quadrature that turns a power response into autocovariances.
const CELLS: usize = 1 << 14;

/// A sum of first-order states, and how well it meets the spectrum.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct MarkovSum {
    /// The states, fastest last.
    pub states: Vec<Markov>,
    /// Largest |S_fit/S - 1| from the lowest frequency fitted up to half of Nyquist's. Above it first-order states flatten
    /// out, as does what is sampled without a filter.
    pub worst_relative_error: f64,
}

impl Markov {
    /// Spectrum at `omega` rad/sample, rad²/s².
    #[must_use]
    pub(crate) fn spectrum(&self, omega: f64) -> f64 {
        // 1 + φ² - 2φ cos ω without cancellation
        self.variance / ((1.0 - self.decay).powi(2) + 4.0 * self.decay * (0.5 * omega).sin().powi(2))
    }

    /// Stationary state that forgets at `rate` rad/sample, of `variance` in all.
    fn stationary(rate: f64, variance: f64) -> Self {
        Self { decay: (-rate).exp(), variance: -variance * (-2.0 * rate).exp_m1(), initial_variance: variance }
    }
}

/// `spectrum` between `omega_low` and π rad/sample as a sum of at most `states` stationary states, rates spaced evenly on a
/// logarithmic scale, variances by least squares of the relative error without negative ones.
///
/// It fits what falls with frequency no faster than 1/ω²; `worst_relative_error` says how well.
///
/// # Errors
/// [`ErrorKind::Value`] if the band is empty, there are no states, or the spectrum is not positive and finite.
pub(crate) fn markov_sum(spectrum: impl Fn(f64) -> f64, omega_low: f64, states: usize) -> Result<MarkovSum> {
    if !(omega_low > 0.0 && omega_low < PI) || states == 0 {
        let found = format!("{states} states from {omega_low} rad/sample");
        return Err(
            Error::new(ErrorKind::Value, "spectrum", found).hint("a band below π rad/sample, one state or more")
        );
    }
    let decades = (PI / omega_low).log10();
    let points = (PER_DECADE * decades).ceil().max(states as f64) as usize;
    let omegas: Vec<f64> = (0..=points).map(|i| omega_low * (PI / omega_low).powf(i as f64 / points as f64)).collect();
    let target: Vec<f64> = omegas.iter().map(|w| spectrum(*w)).collect();
    if let Some(at) = target.iter().position(|s| !(*s > 0.0 && s.is_finite())) {
        let found = format!("{} at {} rad/sample", target[at], omegas[at]);
        return Err(Error::new(ErrorKind::Value, "spectrum", found).hint("a positive spectrum"));
    }
    // from somewhat below the band to what is all but white
    let (slow, fast) = (0.5 * omega_low, 3.0_f64);
    let rate = |i: usize| slow * (fast / slow).powf((i as f64 + 0.5) / states as f64);
    let unit: Vec<Markov> = (0..states).map(|i| Markov::stationary(rate(i), 1.0)).collect();
    // the octave below Nyquist must not spoil the decades below it
    let weights: Vec<f64> = omegas.iter().map(|w| if *w > 0.5 * PI { 0.1 } else { 1.0 }).collect();
    let relative = |m: &Markov, g: usize| m.spectrum(omegas[g]) / target[g];
    let columns: Vec<Vec<f64>> =
        unit.iter().map(|m| (0..omegas.len()).map(|g| weights[g] * relative(m, g)).collect()).collect();
    let variances = nonnegative(&columns, &weights);
    let fitted = |g: usize| unit.iter().zip(&variances).map(|(m, v)| relative(m, g) * v).sum::<f64>();
    let below = (0..omegas.len()).filter(|g| omegas[*g] <= 0.5 * PI);
    let worst_relative_error = below.map(|g| (fitted(g) - 1.0).abs()).fold(0.0, f64::max);
    let scaled = unit.iter().zip(&variances).filter(|(_, v)| **v > 0.0).map(|(m, v)| Markov {
        decay: m.decay,
        variance: v * m.variance,
        initial_variance: *v,
    });
    Ok(MarkovSum { states: scaled.collect(), worst_relative_error })
}

/// min |Σ v_i c_i - target|² over v >= 0, by coordinate descent (it converges: the problem is convex and the bounds separate).
fn nonnegative(columns: &[Vec<f64>], target: &[f64]) -> Vec<f64> {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
    // columns of unit length: then a coordinate's best value needs no division
    let lengths: Vec<f64> = columns.iter().map(|c| dot(c, c).sqrt()).collect();
    let n = columns.len();
    let right: Vec<f64> = (0..n).map(|i| dot(&columns[i], target) / lengths[i]).collect();
    let gram: Vec<f64> =
        (0..n * n).map(|at| dot(&columns[at / n], &columns[at % n]) / (lengths[at / n] * lengths[at % n])).collect();
    let mut v = vec![0.0; n];
    for _ in 0..SWEEPS {
        let mut moved = 0.0f64;
        for i in 0..n {
            let slope = right[i] - dot(&gram[i * n..(i + 1) * n], &v);
            let next = (v[i] + slope).max(0.0);
            moved = moved.max((next - v[i]).abs());
            v[i] = next;
        }
        if moved < 1e-9 {
            break;
        }
    }
    v.iter().zip(&lengths).map(|(v, l)| v / l).collect()
}

/// 1/f noise of two-sided PSD B²/(2πf) from 1/(2 span) to Nyquist as eight states: within 6 % up to five decades, 20 to 30 % above it at Nyquist.
///
/// # Errors
/// [`ErrorKind::Value`] if `bias_instability_rad_s` is not positive or there are fewer than two rows.
pub(crate) fn flicker(bias_instability_rad_s: f64, rows: usize) -> Result<MarkovSum> {
    let power = bias_instability_rad_s * bias_instability_rad_s;
    markov_sum(|omega| power / omega, PI / rows.max(1) as f64, 8)
}

impl LowPass {
    /// All-pole filter of `order` with the first autocovariances of the power response |H(ω)|², `power`, ω in rad/sample
    /// (Levinson's recursion). Deep notches, as of a Butterworth filter at Nyquist, are met only as the order grows.
    ///
    /// # Errors
    /// [`ErrorKind::Value`] if the response is negative, not finite, or zero everywhere.
    pub(crate) fn from_power(power: impl Fn(f64) -> f64, order: usize) -> Result<Self> {
        let mut autocovariance = vec![0.0; order + 1];
        for cell in 0..CELLS {
            let omega = PI * (cell as f64 + 0.5) / CELLS as f64;
            let p = power(omega);
            if !(p >= 0.0 && p.is_finite()) {
                return Err(Error::new(ErrorKind::Value, "power response", p).at(format!("{omega} rad/sample")));
            }
            for (lag, r) in autocovariance.iter_mut().enumerate() {
                *r += p * (lag as f64 * omega).cos() / CELLS as f64;
            }
        }
        // a trace of white noise keeps the recursion regular where the response is all but zero
        autocovariance[0] *= 1.0 + 1e-9;
        if !(autocovariance[0] > 0.0) {
            return Err(Error::new(ErrorKind::Value, "power response", "zero everywhere"));
        }
        let (mut ar, mut error): (Vec<f64>, f64) = (Vec::new(), autocovariance[0]);
        for n in 0..order {
            let known: f64 = (0..n).map(|i| ar[i] * autocovariance[n - i]).sum();
            let k = (autocovariance[n + 1] - known) / error;
            ar = (0..n).map(|i| ar[i] - k * ar[n - 1 - i]).chain([k]).collect();
            error *= 1.0 - k * k;
        }
        Ok(Self { ar, ma: vec![error.sqrt()] })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    impl LowPass {
        /// |H(ω)|², ω in rad/sample.
        fn power(&self, omega: f64) -> f64 {
            let square = |coefficients: &mut dyn Iterator<Item = (usize, f64)>| {
                let (re, im) = coefficients.fold((0.0, 0.0), |(re, im), (lag, c)| {
                    let (sin, cos) = (lag as f64 * omega).sin_cos();
                    (re + c * cos, im + c * sin)
                });
                re * re + im * im
            };
            let top = square(&mut self.ma.iter().copied().enumerate());
            top / square(&mut std::iter::once((0, 1.0)).chain(self.ar.iter().enumerate().map(|(i, a)| (i + 1, -a))))
        }
    }

    #[test]
    fn flicker_is_one_over_f_within_a_few_percent() {
        for rows in [1000, 20_000, 80_000, 320_000] {
            let sum = flicker(2e-5, rows).unwrap();
            assert!(sum.worst_relative_error < 0.06, "{rows}: {}", sum.worst_relative_error);
            assert!(sum.states.len() <= 8);
            let at_nyquist = sum.states.iter().map(|m| m.spectrum(PI)).sum::<f64>() * PI / 4e-10;
            assert!((1.0..1.35).contains(&at_nyquist), "{rows}: {at_nyquist}");
            // the band as a whole: ∫ S dω/π against B² ln(π/ω_low)/π
            let n = 200_000;
            let low = (PI / rows as f64).ln();
            let step = (PI.ln() - low) / f64::from(n);
            let power: f64 = (0..n)
                .map(|i| (low + (f64::from(i) + 0.5) * step).exp())
                .map(|w| sum.states.iter().map(|m| m.spectrum(w)).sum::<f64>() * w * step / PI)
                .sum();
            let truth = 4e-10 * (rows as f64).ln() / PI;
            assert!((power / truth - 1.0).abs() < 0.01, "{rows}: {}", power / truth);
        }
    }

    #[test]
    fn a_gauss_markov_spectrum_comes_back() {
        let truth = Markov::gauss_markov(3.0, 1e-4, 0.05);
        // the spectrum integrates to the variance
        let n = 400_000;
        let mean = (0..n).map(|i| truth.spectrum(PI * (f64::from(i) + 0.5) / f64::from(n))).sum::<f64>() / f64::from(n);
        assert!((mean / 1e-8 - 1.0).abs() < 1e-6);
        let sum = markov_sum(|w| truth.spectrum(w), 1e-3, 12).unwrap();
        assert!(sum.worst_relative_error < 0.15, "{}", sum.worst_relative_error);
    }

    #[test]
    fn an_all_pole_filter_is_found_from_its_power() {
        let truth = LowPass { ar: vec![1.2, -0.5], ma: vec![0.3] };
        let found = LowPass::from_power(|w| truth.power(w), 2).unwrap();
        for (a, b) in found.ar.iter().zip(&truth.ar).chain(found.ma.iter().zip(&truth.ma)) {
            assert!((a - b).abs() < 1e-6, "{found:?}");
        }
        assert!((truth.power(0.0) - 1.0).abs() < 1e-14);
    }

    #[test]
    fn senseless_spectra_are_refused() {
        assert!(markov_sum(|_| 0.0, 0.1, 4).is_err());
        assert!(markov_sum(|w| 1.0 / w, 4.0, 4).is_err());
        assert!(markov_sum(|w| 1.0 / w, 0.1, 0).is_err());
        assert!(flicker(0.0, 100).is_err() && flicker(1.0, 1).is_err());
        assert!(LowPass::from_power(|_| 0.0, 3).is_err() && LowPass::from_power(|_| f64::NAN, 3).is_err());
    }
}
