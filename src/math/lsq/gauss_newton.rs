//! p ← p - J⁺ r(p): scaled QR Gauss-Newton steps that take a good estimate to the last digits.

use super::factor::QrFactor;
use super::norm;
use crate::error::{Error, ErrorKind, Result};

/// Why [`polish`] stopped.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Termination {
    /// The last step is at the level of rounding.
    Converged {
        /// Steps taken.
        steps: usize,
        /// Length of the last step in the model's values, relative to the model's terms.
        relative_step: f64,
    },
    /// All steps were used up before the step came down to rounding.
    StepLimit {
        /// Steps taken.
        steps: usize,
        /// Length of the last step in the model's values, relative to the model's terms.
        relative_step: f64,
    },
    /// No fraction of the step, down to 2⁻²⁰, lowered the sum of squares.
    NoDescent {
        /// Steps taken before this one.
        steps: usize,
        /// Length of the refused step in the model's values, relative to the model's terms.
        relative_step: f64,
    },
}

impl Termination {
    /// Whether the parameters are those of a minimum, to rounding.
    #[must_use]
    pub fn converged(&self) -> bool {
        matches!(self, Self::Converged { .. })
    }

    /// Steps taken.
    #[must_use]
    pub fn steps(&self) -> usize {
        match *self {
            Self::Converged { steps, .. } | Self::StepLimit { steps, .. } | Self::NoDescent { steps, .. } => steps,
        }
    }
}

/// Where the Gauss-Newton steps ended.
#[derive(Debug, Clone, PartialEq)]
pub struct Polished {
    /// The parameters, in the order of the start.
    pub parameters: Vec<f64>,
    /// |r|² there.
    pub rss: f64,
    /// (JᵀJ)⁻¹ there; times the residual variance it is the covariance.
    pub inverse_normal: Vec<Vec<f64>>,
    /// Why it stopped.
    pub termination: Termination,
}

const INPUT: &str = "Gauss-Newton";

/// A step shorter than this many roundings of the model's terms cannot be told from rounding.
const ROUNDINGS: f64 = 4.0;
/// A step this many times longer is rounding if it no longer shrinks: the model's own terms round too.
const ROUGH: f64 = 1e4;
/// So is a step shorter than this part of |r|: it moves a parameter by √n millionths of its standard error at most.
const NEGLIGIBLE: f64 = 1e-6;

/// Pushes the residuals r(p) and, for each parameter, the derivatives ∂r/∂p_j, into buffers handed over empty.
pub type ResidualAndJacobian<'a> = dyn FnMut(&[f64], &mut Vec<f64>, &mut Vec<Vec<f64>>) + 'a;

/// Residuals and Jacobian at one point.
#[derive(Default)]
struct Point {
    parameters: Vec<f64>,
    residual: Vec<f64>,
    jacobian: Vec<Vec<f64>>,
    length: f64,
}

impl Point {
    fn move_to(&mut self, parameters: Vec<f64>, model: &mut ResidualAndJacobian<'_>) -> bool {
        self.residual.clear();
        self.jacobian.clear();
        model(&parameters, &mut self.residual, &mut self.jacobian);
        self.parameters = parameters;
        self.length = norm(&self.residual);
        (self.length * self.length).is_finite() && self.jacobian.iter().flatten().all(|v| v.is_finite())
    }

    /// Rounding of the residuals: ε times the size of the terms that a model is summed up from.
    fn rounding(&self) -> f64 {
        let terms: Vec<f64> = self.jacobian.iter().zip(&self.parameters).map(|(j, p)| norm(j) * p).collect();
        f64::EPSILON * norm(&terms).max(f64::MIN_POSITIVE / f64::EPSILON)
    }
}

/// Minimises |r(p)|² from `start` by at most `max_steps` Gauss-Newton steps, each halved until it descends.
///
/// The sign of r is free. Weights belong into both, residuals and derivatives.
///
/// The iteration ends where the step, measured in the model's values, has come down to rounding.
/// Source: Björck, Numerical Methods for Least Squares Problems (1996), section 9.2.
///
/// # Errors
/// [`ErrorKind::Usage`] if the shapes do not fit, [`ErrorKind::TooShort`] if there are fewer residuals than parameters,
/// [`ErrorKind::Value`] if the start is not finite or has no finite residuals, [`ErrorKind::Numeric`] if a parameter
/// has no influence of its own (the Jacobian is rank deficient); the message names it by its place, from 1.
pub fn polish(
    start: &[f64],
    residual_and_jacobian: &mut ResidualAndJacobian<'_>,
    max_steps: usize,
) -> Result<Polished> {
    let mut here = Point::default();
    let mut trial = Point::default();
    let finite = here.move_to(start.to_vec(), residual_and_jacobian);
    if here.jacobian.len() != start.len() {
        let found = format!("{} Jacobian columns for {} parameters", here.jacobian.len(), start.len());
        return Err(Error::new(ErrorKind::Usage, INPUT, found));
    }
    if !finite || start.iter().any(|p| !p.is_finite()) {
        let found = format!("the model is not finite at the start {start:?}");
        return Err(Error::new(ErrorKind::Value, INPUT, found).hint("check the data for values that are not finite"));
    }
    let mut previous = f64::INFINITY;
    let mut lingering = 0;
    let mut steps = 0;
    loop {
        let factor = factor(&here)?;
        let spanned = factor.spanned(&here.residual);
        let step = norm(&spanned);
        let rounding = here.rounding();
        let relative_step = step / (rounding / f64::EPSILON);
        lingering = if step >= previous { lingering + 1 } else { 0 };
        let small = step <= NEGLIGIBLE * here.length || step <= ROUGH * rounding;
        let done = |here: Point, termination| {
            let rss = here.length * here.length;
            Ok(Polished { parameters: here.parameters, rss, inverse_normal: factor.inverse_normal(), termination })
        };
        if step <= ROUNDINGS * rounding || (small && lingering >= 2) {
            return done(here, Termination::Converged { steps, relative_step });
        }
        if steps == max_steps {
            return done(here, Termination::StepLimit { steps, relative_step });
        }
        let change = factor.solve_spanned(&spanned);
        // |r| is known to its rounding only: near the minimum a true descent may look like an ascent
        let ceiling = here.length + ROUNDINGS * rounding;
        let descends = (0..=20).any(|halvings| {
            let part = 0.5_f64.powi(halvings);
            let parameters: Vec<f64> = here.parameters.iter().zip(&change).map(|(p, d)| p - part * d).collect();
            trial.move_to(parameters, residual_and_jacobian) && trial.length <= ceiling
        });
        if !descends {
            return if step <= ROUGH * rounding {
                done(here, Termination::Converged { steps, relative_step })
            } else {
                done(here, Termination::NoDescent { steps, relative_step })
            };
        }
        std::mem::swap(&mut here, &mut trial);
        previous = step;
        steps += 1;
    }
}

/// The factored Jacobian, or which parameter has no influence of its own.
fn factor(point: &Point) -> Result<QrFactor> {
    let factor = QrFactor::new(&point.jacobian).map_err(|e| e.named(INPUT))?;
    if point.residual.len() != point.jacobian[0].len() {
        let found = format!("{} residuals, {} rows of the Jacobian", point.residual.len(), point.jacobian[0].len());
        return Err(Error::new(ErrorKind::Usage, INPUT, found));
    }
    if let Some(j) = factor.dropped().first() {
        let found = "the data cannot tell it from the others";
        return Err(Error::new(ErrorKind::Numeric, INPUT, found)
            .at(format!("parameter {}", j + 1))
            .hint("fix this parameter, or give data that depend on it"));
    }
    Ok(factor)
}
