//! θ ↦ equations: the common interface of effects that change the robot's equations.

use super::contract::{Coordinate, DriveExplanation, Driving, Equivalent, ModelChange, Needs, Touches};
use super::on_log::{OnLog, UNTOLD};
#[cfg(test)]
use super::tried::Tried;
use crate::config::Steering;
use crate::effects::about::{About, Parameters};
use crate::effects::parts::Checked;
use crate::error::Result;
use crate::model::drive::{DriveEffect, Instrument};

/// An effect that is simulated by the same equations as it is fitted.
pub(super) trait Law: ModelChange + Sized + 'static {
    /// The only value of the type.
    const ITSELF: &'static Self;
    /// Description of the effect.
    const ABOUT: &'static About;
    /// Its work on a log that was made without it; none where such a log does not tell.
    const ON_LOG: Option<OnLog> = None;
    /// Entry of the battery.
    #[cfg(test)]
    const TRIED: Tried;
}

impl<T: Law> Driving for T {
    fn about(&self) -> &'static About {
        T::ABOUT
    }

    #[cfg(test)]
    fn tried(&self) -> Tried {
        T::TRIED
    }

    fn explanation(&self) -> DriveExplanation {
        DriveExplanation::Model(T::ITSELF)
    }

    fn on_log(&self, _: &Parameters) -> std::result::Result<OnLog, &'static str> {
        T::ON_LOG.ok_or(UNTOLD)
    }

    fn simulated(&self, parameters: &Parameters, _: f64, _: u64) -> Result<Box<dyn DriveEffect>> {
        Checked::of(T::ABOUT, parameters)?;
        Ok(self.at(&self.theta(parameters)))
    }
}

/// How true times are, as a share of the sample time: a reading is taken within its row, and simulators and robots integrate
/// from row to row. A lag no longer than that says nothing of a sensor, nor does the chord that a step takes in the place of its
/// arc say that the robot slides.
pub(super) const TIMED_ROWS: f64 = 0.05;

/// A constant of the robot or of a sensor that differs from its nominal value: the effect's first parameter, zero where
/// it does not.
pub(super) trait Constant: Law {
    /// As `scale` in [`Coordinate`].
    const SCALE: [f64; 2];
    /// Source of these sizes.
    const SIZES: &'static str;
    /// Which equations hold the constant.
    const TOUCHES: Touches = Touches::ROBOT;
    /// Requirements on a log for the constant to be identifiable.
    const NEEDS: Needs = Needs::NOTHING;
    /// Whether it is positive in practice.
    const IS_POSITIVE: bool = false;
    /// The instrument whose readings come late by it.
    const LAGS: Option<Instrument> = None;
    /// Effects that it stands for where readings cannot tell them apart.
    const EQUIVALENTS: &'static [Equivalent] = &[];
    /// Standard deviation of the constant in robots without a fault, in sample times.
    const USUAL_ROWS: f64 = 0.0;

    /// Its coordinate in a robot that steers like this, where that makes a difference.
    fn steered(steering: Option<Steering>) -> Option<&'static [Coordinate]> {
        let _ = steering;
        None
    }

    /// The effect with the constant `value` away from nominal.
    fn off_by(value: f64) -> Box<dyn DriveEffect>;
}

impl<T: Constant> ModelChange for T {
    fn coordinates(&self) -> &'static [Coordinate] {
        const { &[Coordinate { scale: T::SCALE, bounds: T::ABOUT.parameters[0].bounds }] }
    }

    fn coordinates_of(&self, steering: Option<Steering>) -> &'static [Coordinate] {
        T::steered(steering).unwrap_or_else(|| self.coordinates())
    }

    fn sizes(&self) -> &'static str {
        T::SIZES
    }

    fn at(&self, theta: &[f64]) -> Box<dyn DriveEffect> {
        T::off_by(theta[0])
    }

    fn touches(&self) -> Touches {
        T::TOUCHES
    }

    fn usual_std(&self, sample_time_s: f64) -> f64 {
        T::USUAL_ROWS * sample_time_s
    }

    fn is_rigid(&self) -> bool {
        true
    }

    fn positive(&self) -> usize {
        usize::from(T::IS_POSITIVE)
    }

    fn lags(&self) -> Option<Instrument> {
        T::LAGS
    }

    fn equivalents(&self) -> &'static [Equivalent] {
        T::EQUIVALENTS
    }

    fn parameters(&self, theta: &[f64]) -> Parameters {
        Parameters::from([(T::ABOUT.parameters[0].name.into(), theta[0])])
    }

    fn theta(&self, parameters: &Parameters) -> Vec<f64> {
        vec![parameters.get(T::ABOUT.parameters[0].name).copied().unwrap_or(0.0)]
    }

    fn needs(&self) -> Needs {
        T::NEEDS
    }
}
