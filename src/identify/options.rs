//! Options of the fit.

use serde::Serialize;

/// Parameters that are known and not fitted.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Fixed {
    /// C1, rad/s.
    pub c1_rad_s: Option<f64>,
    /// C2, rad/s.
    pub c2_rad_s: Option<f64>,
    /// T, s.
    pub time_constant_s: Option<f64>,
}

/// How residuals count.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Loss {
    /// Their squares.
    #[default]
    Squares,
    /// Huber's: squares up to 1.345 standard deviations, then linear.
    Huber,
}

/// How samples are weighed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Weighting {
    /// All alike: ordinary least squares.
    #[default]
    Uniform,
    /// By the inverse of the covariance of white noise and the random walk that the residuals show: generalised least
    /// squares. What lies far apart in time says less of the warm-up than what lies close together: a walk that comes
    /// further than the warm-up is large does not hide it; what else is slow, and no walk, is then followed by a shorter T.
    Walk,
}

/// Options of the fit.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FitOptions {
    /// Known parameters.
    pub fixed: Fixed,
    /// Loss function.
    pub loss: Loss,
    /// How to weigh samples. Where the residuals show no walk, all weigh alike.
    pub weighting: Weighting,
}
