//! The filter's interface to a robot: motion of the state, and readings of the wheels.
//!
//! The states that every model has are those of [`state`]; a model may add its own behind them. Pose, speed and yaw rate
//! are the model's to carry, the gyro's error is the filter's.

use super::reading::Sensor;
use super::ud::UdCovariance;
use nalgebra::{SMatrix, SVector};

/// Index of each state that all models have.
pub mod state {
    /// x, m
    pub const X: usize = 0;
    /// y, m
    pub const Y: usize = 1;
    /// θ, rad
    pub const HEADING: usize = 2;
    /// v, m/s
    pub const SPEED: usize = 3;
    /// ω, rad/s
    pub const YAW_RATE: usize = 4;
    /// e, rad/s
    pub const GYRO_ERROR: usize = 5;
    /// s = C1 + C2, rad/s
    pub const WARM_ERROR: usize = 6;
    /// ln(T / 1 s)
    pub const LN_TIME_CONSTANT: usize = 7;
}

/// Input to the robot until the next row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Input {
    /// Commanded torques, left and right, N·m.
    Torques([f64; 2]),
    /// Unknown accelerations, white with these densities: (m/s²)²/Hz and (rad/s²)²/Hz, two-sided.
    Accelerations([f64; 2]),
}

/// A step: the state after it, its derivative by the state before, and the noise that enters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Transition<const N: usize> {
    /// The state after the step.
    pub mean: SVector<f64, N>,
    /// Φ: its derivative by the state before.
    pub phi: SMatrix<f64, N, N>,
    /// Γ: how the two disturbances of the motion and the rate random walk enter.
    pub gamma: SMatrix<f64, N, NOISES>,
    /// Their variances over the step.
    pub variances: SVector<f64, NOISES>,
    /// Noise columns for the step's curvature within the state's uncertainty, each of variance one; see
    /// [`super::SlipModel`].
    pub bend: Option<SMatrix<f64, N, BENDS>>,
}

/// Noise sources of a prediction: two torques or accelerations, and the rate random walk.
pub(super) const NOISES: usize = 3;

/// Directions in which a step may bend: four velocities and two disturbances.
pub(crate) const BENDS: usize = 6;

impl<const N: usize> Transition<N> {
    /// A step in which nothing moves.
    #[inline(always)]
    pub(super) fn rest(mean: &SVector<f64, N>) -> Self {
        Self { mean: *mean, phi: SMatrix::identity(), gamma: SMatrix::zeros(), variances: SVector::zeros(), bend: None }
    }
}

/// Linearised reading of a sensor whose row the model does not fix.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Expected<const N: usize> {
    /// Reading minus expectation.
    pub residual: f64,
    /// Derivative of the expectation by the states.
    pub by_state: SVector<f64, N>,
    /// Variance of the reading's noise.
    pub variance: f64,
}

/// A set of indices as bits.
#[must_use]
pub(crate) const fn bits(indices: &[usize]) -> u32 {
    let (mut out, mut i) = (0, 0);
    while i < indices.len() {
        out |= 1 << indices[i];
        i += 1;
    }
    out
}

/// How a robot of `N` states moves.
pub trait MotionModel<const N: usize>: Clone {
    /// Bit k of entry i: whether state i after a step can depend on state k before it (see `bits`). Dependences that
    /// are not declared here are zero in the filter's Φ. Rows of the gyro's error are the filter's to fill in.
    const DEPENDS: [u32; N];

    /// Bit k of entry i: whether disturbance k can move state i.
    const DISTURBED: [u32; N];

    /// Sets mean and covariance of the states that are the model's own, speed and yaw rate being set.
    fn start(&self, mean: &mut SVector<f64, N>, covariance: &mut SMatrix<f64, N, N>);

    /// Fills in pose, velocities and the model's own states of a step of `dt_s`: rows of the mean, Φ, the first two
    /// columns of Γ and the first two variances. `out` comes as a step in which nothing moves. Where the covariance is given, the
    /// model may linearise over it instead of at the mean.
    fn carry(
        &self,
        mean: &SVector<f64, N>,
        covariance: Option<&UdCovariance<N>>,
        input: Input,
        dt_s: f64,
        out: &mut Transition<N>,
    );

    /// The same for the state alone, with the two disturbances of the motion given.
    fn disturbed(&self, mean: &SVector<f64, N>, input: Input, disturbances: [f64; 2], dt_s: f64) -> SVector<f64, N>;

    /// Noise of each wheel's torque, N·m·√s.
    fn torque_noise_density(&self) -> f64;

    /// Variances of the two disturbances over a step.
    #[inline(always)]
    fn variances(&self, input: Input, dt_s: f64) -> [f64; 2] {
        match input {
            Input::Torques(_) => [self.torque_noise_density() * self.torque_noise_density() / dt_s; 2],
            Input::Accelerations(densities) => densities.map(|d| d / dt_s),
        }
    }

    /// Speed of the left (0) or right (1) wheel as a row by the states: every model's wheels are linear.
    fn wheel_row(&self, side: usize) -> SVector<f64, N>;

    /// Slip of both wheels with its derivative by the states; `None` where wheels do not slip.
    fn slips(&self, mean: &SVector<f64, N>) -> Option<[(f64, SVector<f64, N>); 2]> {
        let _ = mean;
        None
    }

    /// `reading` of `sensor`, its noise of this variance, linearised in the states; `None` where the sensor reads its
    /// row. It is asked once a reading, in the order in which they are taken in.
    #[inline(always)]
    fn expected(
        &mut self,
        sensor: Sensor,
        reading: f64,
        variance: f64,
        mean: &SVector<f64, N>,
        covariance: &UdCovariance<N>,
    ) -> Option<Expected<N>> {
        let _ = (sensor, reading, variance, mean, covariance);
        None
    }

    /// Notifies the model that the filter was carried on for `dt_s` under `input`.
    #[inline(always)]
    fn moved(&mut self, input: Input, dt_s: f64) {
        let _ = (input, dt_s);
    }

    /// Findings of the model besides the states, for the user.
    fn found(&self) -> Vec<String> {
        Vec::new()
    }
}
