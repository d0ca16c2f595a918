//! S(f)/N² = |H(f)|² + Σ σᵢ² uᵢ(f) Δt/N²: the colour that a sensor's low-pass and its vibrations give to white noise
//!
//! Divided by its root, each cosine coefficient of a series of that colour has the power of the plateau: what is left is white.

use super::{BandForm, LowPass};
use crate::math::dct::Cosine;
use std::f64::consts::PI;

/// Noise in a band.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Band {
    /// Its form.
    pub form: BandForm,
    /// Its middle, Hz.
    pub center_hz: f64,
    /// Full width at half the peak, Hz.
    pub bandwidth_hz: f64,
    /// Standard deviation of its part of a sample, rad/s.
    pub std_rad_s: f64,
}

/// A low-pass, with its cutoff in Hz, and bands.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Colour {
    /// Form and cutoff, Hz.
    pub low_pass: Option<(LowPass, f64)>,
    /// Vibrations.
    pub bands: Vec<Band>,
}

impl Colour {
    /// Whether there is neither a low-pass nor a band.
    #[must_use]
    pub(crate) fn is_white(&self) -> bool {
        self.low_pass.is_none() && self.bands.is_empty()
    }

    /// S(ω)/N² at `omega` (rad a sample) of samples `step_s` apart whose white noise has the standard deviation `white_std_rad_s`.
    #[must_use]
    pub(crate) fn powers(&self, white_std_rad_s: f64, step_s: f64, omega: &[f64]) -> Vec<f64> {
        let mut power = match self.low_pass {
            Some((form, cutoff_hz)) => form.powers(cutoff_hz, step_s, omega),
            None => vec![1.0; omega.len()],
        };
        for band in &self.bands {
            let size = (band.std_rad_s / white_std_rad_s.max(f64::MIN_POSITIVE)).powi(2);
            let unit = band.form.unit(band.center_hz, band.bandwidth_hz, step_s, omega);
            power.iter_mut().zip(unit).for_each(|(p, u)| *p += size * u);
        }
        power
    }

    /// Takes the colour out of `values`, rad/s, which are evenly spaced, without gaps and about zero.
    pub(crate) fn take_out(&self, white_std_rad_s: f64, step_s: f64, values: &mut Vec<f64>) {
        let len = values.len();
        let omega: Vec<f64> = (0..len).map(|k| PI * k as f64 / len as f64).collect();
        let power = self.powers(white_std_rad_s, step_s, &omega);
        let cosine = Cosine::new(len);
        let mut coefficients = cosine.forward(values);
        coefficients.iter_mut().zip(&power).for_each(|(z, p)| *z /= p.sqrt());
        *values = cosine.inverse(&coefficients);
    }
}
