//! Results of the fit.

use super::advice::Advice;
use super::compare::Comparison;
use super::minimum::Termination;
use super::options::{Loss, Weighting};
use super::terms::term::{TermEstimate, colour};
use crate::bias::WarmUp;
use crate::signal::TimeAxis;
use serde::Serialize;

/// An estimated number.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Estimate {
    /// Least-squares value.
    pub estimate: f64,
    /// Standard deviation that allows for autocorrelated residuals.
    pub std: f64,
    /// The classical one, for white residuals.
    pub std_white: f64,
    /// 95 % interval: of the profile likelihood; an end that the log does not bound is infinite (T: or 0).
    pub ci95: [f64; 2],
}

/// The noise that the residuals show: white, plus a random walk of the bias.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct NoiseEstimate {
    /// N: white noise, standard deviation of a sample times sqrt(sample time), rad/√s; behind a low-pass that of the plateau.
    pub angle_random_walk_rad_sqrt_s: f64,
    /// Probability that there is a random walk, from 0.3 before the log was seen.
    pub rate_random_walk_probability: f64,
    /// K, root of its posterior mean square, rad/s/√s.
    pub rate_random_walk_rad_s_sqrt_s: f64,
    /// K is below this with 95 % probability, rad/s/√s.
    pub rate_random_walk_upper95_rad_s_sqrt_s: f64,
}

/// Straight line through a log that is too short to identify T.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct StraightLine {
    /// Error at the first sample, rad/s: C2, where the log begins at power-on.
    pub start_rad_s: Estimate,
    /// Slope, rad/s²: C1/T, where the log is much shorter than T.
    pub slope_rad_s2: Estimate,
}

/// The fitted warm-up model, and how well it is known.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Fit {
    /// C1, rad/s.
    pub c1_rad_s: Estimate,
    /// C2, rad/s.
    pub c2_rad_s: Estimate,
    /// T, s.
    pub time_constant_s: Estimate,
    /// Covariance of (C1, C2, T) that allows for autocorrelated residuals, SI.
    pub covariance: [[f64; 3]; 3],
    /// Correlations of (C1, C2, T); those of a fixed parameter are 0.
    pub correlation: [[f64; 3]; 3],
    /// Whether the 95 % interval of T is finite on both sides.
    pub identifiable: bool,
    /// Why the search ended.
    pub termination: Termination,
    /// Loss function.
    pub loss: Loss,
    /// How samples were weighed.
    pub weighting: Weighting,
    /// Σ r², rad²/s².
    pub residual_sum_of_squares_rad2_s2: f64,
    /// sqrt(Σ r² / degrees of freedom), rad/s.
    pub residual_std_rad_s: f64,
    /// Samples less free parameters.
    pub degrees_of_freedom: f64,
    /// Samples.
    pub samples: usize,
    /// Samples a second, by the median interval.
    pub sample_rate_hz: f64,
    /// Time of the first sample since power-on, s.
    pub first_s: f64,
    /// Last time less first, s.
    pub span_s: f64,
    /// Noise of the residuals.
    pub noise: NoiseEstimate,
    /// The sensor's low-pass and vibrations, where the residuals show them; N is then that of the plateau.
    pub colour: Vec<TermEstimate>,
    /// Constant, straight line and warm-up; `None` where C1 or T are given, or samples are too few.
    pub comparison: Option<Comparison>,
    /// The straight line through the log.
    pub line: Option<StraightLine>,
    /// The fit by the other weighting, where the residuals show a walk more likely than not, or a walk was asked for.
    pub other_weighting: Option<Box<Fit>>,
    /// How long to record for T to ±10 %: one row where T is known, several assumed T where it is not.
    pub advice: Vec<Advice>,
}

impl Fit {
    /// The fitted model.
    #[must_use]
    pub fn model(&self) -> WarmUp {
        WarmUp {
            c1_rad_s: self.c1_rad_s.estimate,
            c2_rad_s: self.c2_rad_s.estimate,
            time_constant_s: self.time_constant_s.estimate,
        }
    }

    /// Whether both weightings disagree: in C1, C2 or T, by more than the root of the sum of both variances. `false` where
    /// there is but one.
    #[must_use]
    pub(crate) fn weightings_disagree(&self) -> bool {
        let numbers = |fit: &Self| [fit.c1_rad_s, fit.c2_rad_s, fit.time_constant_s];
        self.other_weighting.as_deref().is_some_and(|other| {
            let pairs = numbers(self).into_iter().zip(numbers(other));
            pairs.into_iter().any(|(a, b)| (a.estimate - b.estimate).abs() > a.std.hypot(b.std))
        })
    }

    /// Whether the warm-up is there at all: it beats the constant at the 5 % level. `true` where that was not tested.
    #[must_use]
    pub fn warm_up_found(&self) -> bool {
        self.comparison.is_none_or(|c| c.against_constant.p_value < 0.05)
    }

    /// `residuals`, rad/s, as white as the low-pass and the vibrations that were found let them be: what colours them near the
    /// sample rate is no error of the model.
    #[must_use]
    pub fn without_colour(&self, mut residuals: Vec<f64>) -> Vec<f64> {
        if !self.colour.is_empty() {
            let white_std_rad_s = self.noise.angle_random_walk_rad_sqrt_s * self.sample_rate_hz.sqrt();
            colour(&self.colour).take_out(white_std_rad_s, 1.0 / self.sample_rate_hz, &mut residuals);
        }
        residuals
    }

    /// Standard deviation of the model's error at `t_s` since power-on, rad/s.
    #[must_use]
    pub fn model_std_rad_s(&self, t_s: f64) -> f64 {
        let g = self.model().gradient(t_s);
        let mut variance = 0.0;
        for i in 0..3 {
            for j in 0..3 {
                if g[i] != 0.0 && g[j] != 0.0 {
                    variance += g[i] * self.covariance[i][j] * g[j];
                }
            }
        }
        variance.max(0.0).sqrt()
    }

    /// Derivatives of e(t) by the free ones of C1, C2 and T, one column each, one value a sample: the directions that
    /// the fit has taken out of its residuals.
    #[must_use]
    pub fn jacobian(&self, time: &TimeAxis) -> Vec<Vec<f64>> {
        let column = |f: &dyn Fn(f64) -> f64| (0..time.len()).map(|i| f(time.at(i))).collect();
        self.directions().iter().map(|f| column(f)).collect()
    }

    /// The same derivatives as functions of the time since power-on, s.
    #[must_use]
    pub fn directions(&self) -> Vec<impl Fn(f64) -> f64 + use<>> {
        let model = self.model();
        let free = [&self.c1_rad_s, &self.c2_rad_s, &self.time_constant_s].map(|e| e.std > 0.0);
        (0..3).filter(|&j| free[j]).map(|j| move |t_s: f64| model.gradient(t_s)[j]).collect()
    }

    /// Residuals `values - e(t)`, rad/s.
    #[must_use]
    pub fn residuals(&self, time: &TimeAxis, values: &[f64]) -> Vec<f64> {
        let model = self.model();
        values.iter().enumerate().map(|(i, y)| y - model.error_rad_s(time.at(i))).collect()
    }
}
