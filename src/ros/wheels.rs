//! Whether the wheels stand, by joint states or their odometry.

use super::messages::{JOINTS, JointState, Odometry};

/// A speed below this is zero but for rounding, rad/s or m/s: a turn in two hundred years.
const ZERO: f64 = 1e-9;

/// Follows the joints that are wheels.
pub(crate) struct WheelJoints {
    /// Names; empty: all joints are.
    names: Vec<String>,
    /// Position of each at the last reading, rad; its room is that of the largest message.
    positions: Vec<f64>,
}

impl WheelJoints {
    pub(crate) fn new(names: &[String]) -> Self {
        Self { names: names.to_vec(), positions: Vec::with_capacity(JOINTS) }
    }

    /// Whether all wheels of a message stand: by their positions where it has them, which must not change, else by their speeds.
    /// `None` where it has no wheel, or is the first one with positions.
    pub(crate) fn stand(&mut self, message: &JointState) -> Option<bool> {
        let (names, velocity) = (message.name.as_slice(), message.velocity.as_slice());
        let position = message.position.as_slice();
        let count = names.len().max(position.len()).max(velocity.len());
        let is_wheel = |joint: usize| {
            let name = names.get(joint).map(crate::report::mcap::fixed::Text::as_str);
            self.names.is_empty() || name.is_some_and(|name| self.names.iter().any(|n| n == name))
        };
        let (mut seen, mut stand, mut known) = (0, true, true);
        for joint in (0..count).filter(|joint| is_wheel(*joint)) {
            match (position.get(joint).filter(|p| p.is_finite()), velocity.get(joint)) {
                (Some(now), _) => match self.positions.get_mut(seen) {
                    Some(before) => {
                        stand &= now == before;
                        *before = *now;
                    }
                    None => {
                        self.positions.push(*now);
                        known = false;
                    }
                },
                (None, Some(speed)) => stand &= speed.abs() <= ZERO,
                (None, None) => return None,
            }
            seen += 1;
        }
        (seen > 0 && known).then_some(stand)
    }
}

/// Follows an odometry.
#[derive(Default)]
pub(crate) struct WheelOdometry {
    /// Position, m, and orientation of the last message.
    pose: Option<([f64; 3], [f64; 4])>,
}

impl WheelOdometry {
    /// Whether the wheels of a message stand: no speed, and the pose as before. `None` of the first one, or without numbers.
    ///
    /// An odometry that a gyro or a filter has a hand in never stands.
    pub(crate) fn stand(&mut self, message: &Odometry) -> Option<bool> {
        let pose = (message.pose.position, message.pose.orientation);
        let twist = [message.linear, message.angular];
        let finite = |values: &[f64]| values.iter().all(|v| v.is_finite());
        if ![&pose.0[..], &pose.1, &twist[0], &twist[1]].into_iter().all(finite) {
            return None;
        }
        let still = twist.iter().flatten().all(|speed| speed.abs() <= ZERO);
        self.pose.replace(pose).map(|before| still && before == pose)
    }
}
