//! The contract of an effect of drives: how it explains a drive, and how it changes the robot's equations.

use super::equivalent::{Map, Within};
use super::loss::Lost;
use super::on_log::{OnLog, UNTOLD};
#[cfg(test)]
use super::tried::Tried;
use crate::config::Steering;
use crate::effects::about::{About, Parameters};
use crate::error::Result;
use crate::model::drive::{DriveEffect, Instrument, Robot};
use crate::robot::Truth;

/// An effect of drives.
pub trait Driving: Sync + Send {
    /// Description of the effect.
    fn about(&self) -> &'static About;

    /// How it enters the likelihood of a drive.
    fn explanation(&self) -> DriveExplanation;

    /// Entry of the battery: a plain size of it, and the readings that it moves.
    #[cfg(test)]
    fn tried(&self) -> Tried;

    /// The change of the robot's equations that it is; none where it enters the likelihood in another way.
    fn change(&self) -> Option<&'static dyn ModelChange> {
        match self.explanation() {
            DriveExplanation::Model(change) => Some(change),
            _ => None,
        }
    }

    /// The instrument whose readings come late by it.
    fn delays(&self) -> Option<Instrument> {
        self.change()?.lags()
    }

    /// The loss of ticks that it is.
    fn tick_loss(&self) -> Option<&'static dyn TickLoss> {
        match self.explanation() {
            DriveExplanation::MissedTicks(loss) => Some(loss),
            _ => None,
        }
    }

    /// Channel of the answer with these parameters: one of `wheels`, `wheel_left`, `wheel_right`, `torque`, `gyro`, `pose`.
    fn channel(&self, parameters: &Parameters) -> &'static str {
        let _ = parameters;
        self.about().channel
    }

    /// Its work on a log that was made without it.
    ///
    /// # Errors
    /// The reason, where such a log does not tell.
    fn on_log(&self, parameters: &Parameters) -> std::result::Result<OnLog, &'static str> {
        let _ = parameters;
        Err(UNTOLD)
    }

    /// The effect at work in one drive of `span_s` seconds. What is drawn anew in each run comes from `seed`, unless
    /// `parameters` hold it.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Config`] if a parameter is missing, unknown or out of bounds.
    fn simulated(&self, parameters: &Parameters, span_s: f64, seed: u64) -> Result<Box<dyn DriveEffect>>;
}

/// The ways in which an effect can explain a drive.
#[derive(Clone, Copy)]
pub enum DriveExplanation {
    /// The robot's equations change with coordinates that are fitted
    Model(&'static dyn ModelChange),
    /// The gyro's bias jumps once
    GyroStep,
    /// One wheel reads low in bursts
    MissedTicks(&'static dyn TickLoss),
    /// Wheel speeds on a lattice
    WheelLattice,
    /// White noise of an instrument that is not as large as stated
    NoiseLevel(Instrument),
}

/// A change of the robot's equations, smooth in its coordinates θ; θ = 0 changes nothing.
pub trait ModelChange: Sync + Send {
    /// The coordinates.
    fn coordinates(&self) -> &'static [Coordinate];

    /// The same where it is known how the robot steers, with the sizes that such robots have.
    fn coordinates_of(&self, steering: Option<Steering>) -> &'static [Coordinate] {
        let _ = steering;
        self.coordinates()
    }

    /// Where the sizes of its coordinates are known from; the effect's own forms leave that to the effect.
    fn sizes(&self) -> &'static str {
        ""
    }

    /// The effect at θ, with or without departures.
    fn at(&self, theta: &[f64]) -> Box<dyn DriveEffect>;

    /// Parameters from θ.
    fn parameters(&self, theta: &[f64]) -> Parameters;

    /// θ from parameters that were checked.
    fn theta(&self, parameters: &Parameters) -> Vec<f64>;

    /// Forms of its law, one of which holds: a recording is explained by each of them in turn. None where it has but one.
    fn forms(&self) -> &'static [&'static dyn ModelChange] {
        &[]
    }

    /// Which equations it changes.
    fn touches(&self) -> Touches {
        Touches::ROBOT
    }

    /// Where to begin beside θ = 0, for a change so bent that its slope at zero misleads.
    fn starts(&self) -> Vec<Vec<f64>> {
        Vec::new()
    }

    /// Standard deviation of the first coordinate, in its unit, in robots without a fault that are read every
    /// `sample_time_s`: every recording may have as much of it. Zero where it is exact.
    fn usual_std(&self, sample_time_s: f64) -> f64 {
        let _ = sample_time_s;
        0.0
    }

    /// Whether its coordinates are constants of the robot, and no law that may bend.
    fn is_rigid(&self) -> bool {
        false
    }

    /// Coordinates beyond those of the effect, zero in the effect itself. They follow the others in θ. Where they
    /// differ from zero, the recording departs from the effect's law: it is another effect that resembles this one.
    fn departures(&self) -> &'static [Coordinate] {
        &[]
    }

    /// How many of its coordinates, from the first one, are the law itself. The others bend it, and in many robots they
    /// are next to zero.
    fn unbent(&self) -> usize {
        self.coordinates().len()
    }

    /// How many of its coordinates, from the first one, are positive in practice.
    fn positive(&self) -> usize {
        0
    }

    /// Name of the parameter for the share of the torque noise that its law passes to the wheels' readings, as a ratio of
    /// standard deviations; none where it passes none.
    fn torque_noise_share(&self) -> Option<&'static str> {
        None
    }

    /// The instrument whose readings come late, by its first coordinate in s.
    fn lags(&self) -> Option<Instrument> {
        None
    }

    /// θ for each second by which the gyro of `robot` seems late where no torques are logged, at this mean speed of its
    /// wheels over ground, m/s; none where it does not look like a late gyro.
    fn like_late_gyro(&self, robot: &Robot, speed_m_s: f64) -> Option<Vec<f64>> {
        let _ = (robot, speed_m_s);
        None
    }

    /// Effects that it stands for where readings cannot tell them apart.
    fn equivalents(&self) -> &'static [Equivalent] {
        &[]
    }

    /// Sizes of the robot's description under a law that is no constant of the robot; none where descriptions have no such number.
    fn described(&self, parameters: &Parameters) -> Option<Truth> {
        let _ = parameters;
        None
    }

    /// Requirements on a log for θ to be identifiable.
    fn needs(&self) -> Needs {
        Needs::NOTHING
    }
}

/// Equations.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Touches {
    /// Accelerations and sideways speed.
    pub motion: bool,
    /// Readings of the wheels.
    pub wheels: bool,
    /// Reading of the gyro.
    pub gyro: bool,
    /// Reading of the external reference.
    pub pose: bool,
}

impl Touches {
    /// Motion and wheels, as the robot's constants do.
    pub(crate) const ROBOT: Self = Self { motion: true, wheels: true, gyro: false, pose: false };
    /// The gyro alone.
    pub(crate) const GYRO: Self = Self { motion: false, wheels: false, gyro: true, pose: false };
    /// The motion alone.
    pub(crate) const MOTION: Self = Self { motion: true, wheels: false, gyro: false, pose: false };
    /// The wheels alone.
    pub(crate) const WHEELS: Self = Self { motion: false, wheels: true, gyro: false, pose: false };
    /// The external reference alone.
    pub(crate) const POSE: Self = Self { motion: false, wheels: false, gyro: false, pose: true };
}

/// Channels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Needs {
    /// Commanded torques.
    pub torques: bool,
    /// Gyro.
    pub gyro: bool,
    /// Position and heading.
    pub pose: bool,
    /// Any of the three: wheels alone know no length.
    pub length: bool,
}

impl Needs {
    /// None.
    pub(crate) const NOTHING: Self = Self { torques: false, gyro: false, pose: false, length: false };
}

/// One coordinate of a change.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coordinate {
    /// Standard deviation of its prior: from and to, evenly in the logarithm; up to sizes that are seen in practice.
    pub scale: [f64; 2],
    /// Smallest and largest value.
    pub bounds: [f64; 2],
}

/// An effect that another one stands for in drives whose readings cannot tell them apart.
#[derive(Clone, Copy)]
pub struct Equivalent {
    /// The effect that is equivalent.
    pub effect: &'static dyn Driving,
    /// Its coordinate.
    pub map: Map,
    /// The wheel that it is of, where that matters: 0 left, 1 right.
    pub side: usize,
    /// Drives in which they are the same.
    pub within: Within,
}

/// An effect by which one wheel reads low in bursts.
pub trait TickLoss: Sync + Send {
    /// The mean loss of the left wheel and of the right one, where no burst shows by itself.
    fn mean(&self) -> &'static [&'static dyn ModelChange; 2];

    /// Whether `parameters` state the mean loss over all of a drive.
    fn is_mean(&self, parameters: &Parameters) -> bool;

    /// The wheel that `parameters` state: 0 left, 1 right.
    fn side(&self, parameters: &Parameters) -> usize;

    /// The bursts that `parameters` state; none without a loss.
    fn lost(&self, parameters: &Parameters) -> Option<Lost>;

    /// Parameters that state these bursts.
    fn parameters(&self, lost: &Lost) -> Parameters;
}
