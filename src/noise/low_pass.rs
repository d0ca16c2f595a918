//! |H(ω)|² of the low-pass that a sensor has before it is sampled, ω in rad/sample, one at zero
//!
//! ```text
//! one pole       1/(1 + x²)                   x = sin(ω/2)/sin(ω_c/2)
//! two poles      1/(1 + (√2 - 1) x²)²         two equal ones, one after the other
//! Butterworth    1/(1 + y⁴)                   of order 2, y = tan(ω/2)/tan(ω_c/2)
//! average        Σ (1 - |k|/L) cos kω / Σ (1 - |k|/L), |k| < L
//! ```
//!
//! ω_c = 2π f_c Δt, and f_c is where the density of the samples is half of the plateau. The average is that of a time L Δt,
//! which need not be whole samples: what is above half the sample rate is folded. A filter that lets more than half of the
//! power pass even at half the sample rate has its f_c above that: cos ω_c goes on as -cosh(ω_c - π).

use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Form of a low-pass.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LowPass {
    /// One pole.
    #[default]
    OnePole,
    /// Two equal poles.
    TwoPoles,
    /// Butterworth's of order two.
    Butterworth,
    /// Mean over a time.
    Average,
}

/// Least |H|²: where a filter has a zero, the ends of a log leak as much.
const POWER_FLOOR: f64 = 1e-5;
/// Largest tangent: half the sample rate.
const TANGENT: f64 = 1e6;

impl LowPass {
    /// All forms.
    pub const ALL: [Self; 4] = [Self::OnePole, Self::TwoPoles, Self::Butterworth, Self::Average];

    /// For people.
    #[must_use]
    pub fn title(self) -> &'static str {
        match self {
            Self::OnePole => "one pole",
            Self::TwoPoles => "two poles",
            Self::Butterworth => "Butterworth, order 2",
            Self::Average => "mean over a time",
        }
    }

    /// Power gain at angular frequencies, rad/sample, of the form with its half power at `cutoff_hz`.
    pub(crate) fn filter(self, cutoff_hz: f64, step_s: f64) -> impl Fn(f64) -> f64 {
        let omega_c = TAU * cutoff_hz * step_s;
        let sin_c = if omega_c < PI { (0.5 * omega_c).sin() } else { (0.5 * (omega_c - PI)).cosh() };
        let tan_c = (0.5 * omega_c.min(PI)).tan().clamp(0.0, TANGENT);
        let window = if self == Self::Average { window(omega_c) } else { 1.0 };
        let at = move |w: f64| {
            let sine = ((0.5 * w).sin() / sin_c).powi(2);
            match self {
                Self::OnePole => 1.0 / (1.0 + sine),
                Self::TwoPoles => (1.0 + (std::f64::consts::SQRT_2 - 1.0) * sine).powi(-2),
                Self::Butterworth => 1.0 / (1.0 + ((0.5 * w).tan().abs().min(TANGENT) / tan_c).powi(4)),
                Self::Average => average(window, w),
            }
        };
        move |w| at(w).max(POWER_FLOOR)
    }

    /// The same at each of `omega`.
    #[must_use]
    pub(crate) fn powers(self, cutoff_hz: f64, step_s: f64, omega: &[f64]) -> Vec<f64> {
        let at = self.filter(cutoff_hz, step_s);
        omega.iter().map(|w| at(*w)).collect()
    }

    /// Bounds of the cutoff, Hz: from a hundredth of the sample rate, or what a log of `span_s` still tells from a drift, to
    /// where a pole takes less than a hundredth off the power. A Butterworth filter has none of it above half the sample rate.
    #[must_use]
    pub(crate) fn range_hz(self, step_s: f64, span_s: f64) -> [f64; 2] {
        let high = if self == Self::Butterworth { 0.49 } else { 1.5 };
        [(0.01 / step_s).max(50.0 / span_s), high / step_s]
    }
}

/// Density of a mean over `window` samples at ω, relative to that at zero.
fn average(window: f64, omega: f64) -> f64 {
    // 1 - |k|/L = (L - J)/L + (J - |k|)/L with J whole, J - 1 < L <= J: Dirichlet's and Fejér's kernels
    let j = window.ceil().max(1.0);
    let rest = window - j;
    let whole = rest * (2.0 * j - 1.0) + j * j;
    let half = (0.5 * omega).sin();
    if half.abs() < 1e-9 {
        return 1.0;
    }
    let dirichlet = ((j - 0.5) * omega).sin() / half;
    let fejer = ((0.5 * j * omega).sin() / half).powi(2);
    (rest * dirichlet + fejer) / whole
}

/// Samples that a mean is over whose density is half of the plateau at ω_c.
fn window(omega_c: f64) -> f64 {
    if omega_c >= FRAC_PI_2 {
        // up to two samples there is one cosine: 1 + 2 (1 - 1/L) cos ω
        let cos = if omega_c < PI { omega_c.cos() } else { -(omega_c - PI).cosh() };
        let twice = 1.0 / (1.0 - 2.0 * cos);
        return 1.0 / (1.0 - 0.5 * twice);
    }
    // sin²(x)/x² is half at x = 1.39
    let (mut low, mut high) = (2.0, 3.2 / omega_c + 1.0);
    for _ in 0..50 {
        let mid = 0.5 * (low + high);
        if average(mid, omega_c) > 0.5 {
            low = mid;
        } else {
            high = mid;
        }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_the_power_passes_at_the_cutoff() {
        for form in LowPass::ALL {
            for cutoff in [1.5, 9.0, 24.0, 33.0, 48.0] {
                let [zero, half] = form.powers(cutoff, 0.01, &[1e-12, TAU * cutoff * 0.01])[..] else { unreachable!() };
                assert!((zero - 1.0).abs() < 1e-9 && (half - 0.5).abs() < 1e-9, "{form:?} {cutoff}: {zero} {half}");
            }
        }
    }

    #[test]
    fn an_average_has_the_covariance_of_means_that_overlap() {
        for window in [0.7_f64, 1.2, 2.0, 2.6, 5.0] {
            for omega in [0.3, 1.1, 2.9] {
                let weight = |k: i32| (1.0 - f64::from(k.abs()) / window).max(0.0);
                let sum = |w: f64| (-6..=6).map(|k| weight(k) * (f64::from(k) * w).cos()).sum::<f64>();
                assert!((average(window, omega) - sum(omega) / sum(0.0)).abs() < 1e-12, "{window} {omega}");
            }
        }
        // two samples: half power at a quarter of the sample rate
        assert!((window(FRAC_PI_2) - 2.0).abs() < 1e-12 && (window(0.9999 * FRAC_PI_2) - 2.0).abs() < 1e-2);
    }
}
