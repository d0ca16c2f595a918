//! dv/dt, dω/dt under the torques of wheels that roll without slip ([`Rolling`]): the motion model of eight states
//!
//! Noise: each wheel's torque has white noise of density q, held over a step (variance q²/dt, as simulated); unknown
//! accelerations are white with given densities.

use super::model::{Input, MotionModel, Transition, bits, state};
use super::ud::UdCovariance;
use crate::config::Vehicle;
use crate::vehicle::{Forcing, Motion, Rolling, advance, advance_with_jacobian};
use nalgebra::{SMatrix, SVector};
use state::{HEADING, SPEED, X, Y, YAW_RATE};

/// Number of states.
pub(crate) const ROLLING_STATES: usize = 8;
const N: usize = ROLLING_STATES;

/// The rolling robot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RollingModel {
    robot: Rolling,
    torque_noise_density: f64,
}

impl RollingModel {
    /// The robot that `vehicle` describes.
    #[must_use]
    pub fn new(vehicle: &Vehicle) -> Self {
        Self { robot: Rolling::new(vehicle), torque_noise_density: vehicle.torque_noise_n_m_sqrt_s }
    }

    #[inline]
    fn forcing(&self, input: Input) -> Forcing {
        match input {
            Input::Torques(torques) => self.robot.forcing(torques),
            Input::Accelerations(_) => Forcing::default(),
        }
    }

    /// (a, α) of each of the two disturbances.
    #[inline]
    fn by_disturbance(&self, input: Input) -> [[f64; 2]; 2] {
        match input {
            Input::Torques(_) => {
                let (a, alpha) = (self.robot.acceleration_by_torque(), self.robot.yaw_acceleration_by_torque());
                [[a, -alpha], [a, alpha]]
            }
            Input::Accelerations(_) => [[1.0, 0.0], [0.0, 1.0]],
        }
    }
}

impl MotionModel<N> for RollingModel {
    const DEPENDS: [u32; N] = {
        let mut rows = [0; N];
        rows[X] = bits(&[X, HEADING, SPEED, YAW_RATE]);
        rows[Y] = bits(&[Y, HEADING, SPEED, YAW_RATE]);
        rows[HEADING] = bits(&[HEADING, YAW_RATE]);
        rows[SPEED] = bits(&[SPEED]);
        rows[YAW_RATE] = bits(&[YAW_RATE]);
        rows
    };

    const DISTURBED: [u32; N] = {
        let mut rows = [0; N];
        let (mut i, moved) = (0, [X, Y, HEADING, SPEED, YAW_RATE]);
        while i < moved.len() {
            rows[moved[i]] = bits(&[0, 1]);
            i += 1;
        }
        rows
    };

    fn start(&self, _mean: &mut SVector<f64, N>, _covariance: &mut SMatrix<f64, N, N>) {}

    #[inline]
    fn carry(
        &self,
        mean: &SVector<f64, N>,
        _covariance: Option<&UdCovariance<N>>,
        input: Input,
        dt_s: f64,
        out: &mut Transition<N>,
    ) {
        let (after, j) = advance_with_jacobian(&motion_of(mean), &self.forcing(input), dt_s);
        set_motion(&mut out.mean, &after);
        let phi = &mut out.phi;
        for i in [X, Y] {
            phi[(i, HEADING)] = j.position_by_heading[i];
            phi[(i, SPEED)] = j.position_by_speed[i];
            phi[(i, YAW_RATE)] = j.position_by_yaw_rate[i];
        }
        phi[(HEADING, YAW_RATE)] = j.heading_by_yaw_rate;
        phi[(SPEED, SPEED)] = j.speed_by_speed;
        phi[(YAW_RATE, YAW_RATE)] = j.yaw_rate_by_yaw_rate;
        for (k, [a, alpha]) in self.by_disturbance(input).into_iter().enumerate() {
            for i in [X, Y] {
                out.gamma[(i, k)] = j.position_by_acceleration[i] * a + j.position_by_yaw_acceleration[i] * alpha;
            }
            out.gamma[(HEADING, k)] = j.heading_by_yaw_acceleration * alpha;
            out.gamma[(SPEED, k)] = j.speed_by_acceleration * a;
            out.gamma[(YAW_RATE, k)] = j.yaw_rate_by_yaw_acceleration * alpha;
        }
        [out.variances[0], out.variances[1]] = self.variances(input, dt_s);
    }

    fn disturbed(&self, mean: &SVector<f64, N>, input: Input, disturbances: [f64; 2], dt_s: f64) -> SVector<f64, N> {
        let mut forcing = self.forcing(input);
        for (size, [a, alpha]) in disturbances.into_iter().zip(self.by_disturbance(input)) {
            forcing.acceleration_m_s2 += a * size;
            forcing.yaw_acceleration_rad_s2 += alpha * size;
        }
        let mut after = *mean;
        set_motion(&mut after, &advance(&motion_of(mean), &forcing, dt_s));
        after
    }

    fn torque_noise_density(&self) -> f64 {
        self.torque_noise_density
    }

    fn wheel_row(&self, side: usize) -> SVector<f64, N> {
        let [by_speed, by_yaw] = self.robot.wheel_by_motion()[side];
        let mut h = SVector::zeros();
        (h[SPEED], h[YAW_RATE]) = (by_speed, by_yaw);
        h
    }
}

/// Pose and velocity in a state of any model.
pub(super) fn motion_of<const M: usize>(m: &SVector<f64, M>) -> Motion {
    Motion { x_m: m[X], y_m: m[Y], heading_rad: m[HEADING], speed_m_s: m[SPEED], yaw_rate_rad_s: m[YAW_RATE] }
}

/// Puts them there.
pub(super) fn set_motion<const M: usize>(mean: &mut SVector<f64, M>, motion: &Motion) {
    mean[X] = motion.x_m;
    mean[Y] = motion.y_m;
    mean[HEADING] = motion.heading_rad;
    mean[SPEED] = motion.speed_m_s;
    mean[YAW_RATE] = motion.yaw_rate_rad_s;
}
