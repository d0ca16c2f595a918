//! Noise in a band about a frequency, as a vibration makes: two forms, both of variance σ²
//!
//! ```text
//! resonance   autocovariance σ² exp(-πΔ|τ|) cos(2πf₀τ)            a damped oscillator that noise drives: tails fall as 1/f²
//! wander      autocovariance σ² exp(-(πΔτ)²/(4 ln 2)) cos(2πf₀τ)  an engine whose speed varies: no tails
//! ```
//!
//! Δ is the full width at half the peak, Hz. Spectra are those of the samples: what is above half the sample rate is folded.

use serde::{Deserialize, Serialize};
use std::f64::consts::{LN_2, PI, TAU};

/// Form of a band.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BandForm {
    /// Exponential decay of the correlation: Lorentz's line.
    Resonance,
    /// Normal decay of the correlation: Gauss's line.
    Wander,
}

impl BandForm {
    /// All forms.
    pub const ALL: [Self; 2] = [Self::Resonance, Self::Wander];

    /// For people.
    #[must_use]
    pub fn title(self) -> &'static str {
        match self {
            Self::Resonance => "resonance",
            Self::Wander => "wandering frequency",
        }
    }

    /// Variance of the cosine coefficients at ω (rad/sample) per σ²: the density over the sample time, two-sided.
    #[must_use]
    pub(crate) fn unit(self, center_hz: f64, bandwidth_hz: f64, step_s: f64, omega: &[f64]) -> Vec<f64> {
        let (center, width) = (TAU * center_hz * step_s, TAU * bandwidth_hz * step_s);
        let line = |x: f64| match self {
            Self::Resonance => {
                let r = (-0.5 * width).exp();
                -(-width).exp_m1() / (1.0 - 2.0 * r * x.cos() + r * r)
            }
            Self::Wander => {
                // σ_ω of the line; ∫ over -π..π is 2π
                let std = width / (8.0 * LN_2).sqrt();
                let one = |x: f64| TAU / (TAU.sqrt() * std) * (-0.5 * (x / std).powi(2)).exp();
                (-1..=1).map(|fold| one(x + TAU * f64::from(fold))).sum()
            }
        };
        let wrapped = |x: f64| (x + PI).rem_euclid(TAU) - PI;
        omega.iter().map(|w| 0.5 * (line(wrapped(w - center)) + line(wrapped(w + center)))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_spectrum_is_that_of_the_autocovariance() {
        let step = 0.01;
        for (center, width) in [(20.0, 1.0), (31.4, 4.0), (49.0, 2.0)] {
            for form in BandForm::ALL {
                let covariance = |k: i32| {
                    let tau = f64::from(k.abs()) * step;
                    let decay = match form {
                        BandForm::Resonance => (-PI * width * tau).exp(),
                        BandForm::Wander => (-(PI * width * tau).powi(2) / (4.0 * LN_2)).exp(),
                    };
                    decay * (TAU * center * tau).cos()
                };
                for omega in [0.3, TAU * center * step, 2.9] {
                    let exact: f64 = (-4000..=4000).map(|k| covariance(k) * (f64::from(k) * omega).cos()).sum();
                    let found = form.unit(center, width, step, &[omega])[0];
                    assert!(
                        (found - exact).abs() < 1e-6 * exact.abs().max(1.0),
                        "{form:?} {center} {omega}: {found} {exact}"
                    );
                }
            }
        }
    }
}
