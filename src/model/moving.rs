//! x, y, θ, v, ω, dv/dt, dω/dt and the forces of the wheels at one instant, now or a delay ago

use super::past::Past;

/// The robot at one instant; by default at rest at the origin, at time zero.
#[derive(Debug, Clone, Copy, Default)]
pub struct Moving<'a> {
    /// s since the log began
    pub t_s: f64,
    /// s since power-on
    pub since_power_on_s: f64,
    /// Of the middle of the axle, m
    pub x_m: f64,
    /// m
    pub y_m: f64,
    /// rad
    pub heading_rad: f64,
    /// m/s
    pub speed_m_s: f64,
    /// rad/s
    pub yaw_rate_rad_s: f64,
    /// dv/dt, m/s²
    pub acceleration_m_s2: f64,
    /// dω/dt, rad/s²
    pub yaw_acceleration_rad_s2: f64,
    /// Force of each wheel's rim on the ground, left and right, N
    pub wheel_force_n: [f64; 2],
    /// Motion so far
    pub past: Option<&'a Past>,
}

impl Moving<'_> {
    /// The same robot `delay_s` ago: speed, yaw rate and forces of the wheels. Within the last row, without a past, or ahead
    /// of time rates are extrapolated with the accelerations: errors of a filter's past rates would look like a delay.
    #[must_use]
    pub(crate) fn ago(&self, delay_s: f64) -> Self {
        let t_s = self.t_s - delay_s;
        let ([speed_m_s, yaw_rate_rad_s], wheel_force_n) = match self.past {
            Some(past) if delay_s > 0.0 && past.reaches(t_s) => {
                past.at(t_s, (self.t_s, [self.speed_m_s, self.yaw_rate_rad_s], self.wheel_force_n))
            }
            _ => (
                [
                    self.speed_m_s - delay_s * self.acceleration_m_s2,
                    self.yaw_rate_rad_s - delay_s * self.yaw_acceleration_rad_s2,
                ],
                self.wheel_force_n,
            ),
        };
        Self { t_s, speed_m_s, yaw_rate_rad_s, wheel_force_n, ..*self }
    }

    /// x, y (m) and heading (rad) `delay_s` ago, less the present ones: the chord of an arc. Accelerations from torques jump
    /// with them and do not hold back over a delay; those from past speeds do.
    #[must_use]
    pub(crate) fn pose_ago(&self, delay_s: f64) -> [f64; 3] {
        let half_s = if self.past.is_some() { 0.0 } else { 0.5 * delay_s };
        let turn = -delay_s * (self.yaw_rate_rad_s - half_s * self.yaw_acceleration_rad_s2);
        let (sin, cos) = (self.heading_rad + 0.5 * turn).sin_cos();
        let way = -delay_s * (self.speed_m_s - half_s * self.acceleration_m_s2);
        [way * cos, way * sin, turn]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_late_reference_is_behind_by_what_an_accelerating_robot_went_since() {
        let (v, a, delay_s) = (0.4, 0.9, 0.15);
        let at = Moving { speed_m_s: v, acceleration_m_s2: a, ..Moving::default() };
        let way = at.pose_ago(delay_s)[0];
        assert!((way + v * delay_s - 0.5 * a * delay_s * delay_s).abs() < 1e-12, "{way}");
        let past = Past::default();
        let driven = Moving { past: Some(&past), ..at };
        assert!((driven.pose_ago(delay_s)[0] + v * delay_s).abs() < 1e-12);
        let at = Moving { yaw_rate_rad_s: 0.3, yaw_acceleration_rad_s2: -0.8, ..Moving::default() };
        assert!((at.pose_ago(0.1)[2] + 0.03 + 0.004).abs() < 1e-12);
    }
}
