//! `[gyro.noise]`: parameters of a gyro's noise besides the angle random walk.

use crate::noise::{Band, BandForm, Colour, LowPass};
use serde::{Deserialize, Serialize};

/// `[gyro.noise]`: terms identified beside the angle random walk.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Noise {
    /// K: the bias performs a random walk, rad/s/√s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rate_random_walk_rad_s_sqrt_s: Option<f64>,
    /// Quantization step of the output, rad/s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub quantization_lsb_rad_s: Option<f64>,
    /// The sensor's low-pass: the density of the white noise is half of its plateau here, Hz. The angle random walk is that
    /// of the plateau.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bandwidth_cutoff_hz: Option<f64>,
    /// 95 % interval of the cutoff, Hz; a side without bound is `inf`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bandwidth_cutoff_ci95_hz: Option<[f64; 2]>,
    /// Form of the low-pass: `one_pole` (where it is not stated), `two_poles`, `butterworth` or `average`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bandwidth_form: Option<LowPass>,
    /// Vibrations: noise in bands.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub narrow_band: Vec<NarrowBand>,
    /// The terms of the joint noise model, with how well each is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub terms: Option<NoiseTerms>,
}

impl Noise {
    /// The low-pass and the bands that it states.
    #[must_use]
    pub fn colour(&self) -> Colour {
        let band = |b: &NarrowBand| Band {
            form: b.form.unwrap_or(BandForm::Resonance),
            center_hz: b.center_hz,
            bandwidth_hz: b.bandwidth_hz,
            std_rad_s: b.std_rad_s,
        };
        Colour {
            low_pass: self.bandwidth_cutoff_hz.map(|cutoff| (self.bandwidth_form.unwrap_or_default(), cutoff)),
            bands: self.narrow_band.iter().map(band).collect(),
        }
    }
}

/// `[[gyro.noise.narrow_band]]`: a vibration, as noise in a band about a frequency.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NarrowBand {
    /// Its middle, Hz.
    pub center_hz: f64,
    /// Full width at half the peak, Hz.
    pub bandwidth_hz: f64,
    /// Standard deviation of the vibration in a sample, rad/s.
    pub std_rad_s: f64,
    /// `resonance` (where it is not stated) or `wander`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub form: Option<BandForm>,
    /// 95 % interval of the middle, Hz.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub center_ci95_hz: Option<[f64; 2]>,
    /// 95 % interval of the width, Hz.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bandwidth_ci95_hz: Option<[f64; 2]>,
    /// 95 % interval of the standard deviation, rad/s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub std_ci95_rad_s: Option<[f64; 2]>,
}

/// `[gyro.noise.terms]`: one table a term that was identified, by its id and unit (names of IEEE Std 952).
///
/// Exports read them; simulator and filter know the white noise and the walk. Where these have a key of their own (`angle_random_walk_rad_sqrt_s`,
/// `rate_random_walk_rad_s_sqrt_s`), both must say the same.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NoiseTerms {
    /// Q of the integrated angle, rad: not the quantization step of the rate, which is `quantization_lsb_rad_s`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub quantization_rad: Option<NoiseTerm>,
    /// N, rad/√s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub angle_random_walk_rad_sqrt_s: Option<NoiseTerm>,
    /// B, rad/s: S(f) = B²/(2πf), two-sided.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bias_instability_rad_s: Option<NoiseTerm>,
    /// K, rad/s/√s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rate_random_walk_rad_s_sqrt_s: Option<NoiseTerm>,
    /// R, rad/s².
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rate_ramp_rad_s2: Option<NoiseTerm>,
    /// Stationary standard deviation of a first-order Gauss-Markov process, rad/s, and its correlation time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gauss_markov_rad_s: Option<GaussMarkovTerm>,
}

/// An identified number; its unit stands in the name of its table.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NoiseTerm {
    /// Estimate.
    pub estimate: f64,
    /// Its standard deviation.
    pub std: f64,
    /// 95 % interval; a side without bound is `inf`.
    pub ci95: [f64; 2],
}

/// db = -b/τ dt + σ √(2/τ) dW.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GaussMarkovTerm {
    /// σ, rad/s.
    pub estimate: f64,
    /// Its standard deviation, rad/s.
    pub std: f64,
    /// 95 % interval, rad/s; a side without bound is `inf`.
    pub ci95: [f64; 2],
    /// τ, s.
    pub correlation_time_s: f64,
    /// 95 % interval of τ, s; a side without bound is `inf`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub correlation_time_ci95_s: Option<[f64; 2]>,
}
