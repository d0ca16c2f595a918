//! A gyro that is not mounted along the axes of its robot
//!
//! ```text
//! w_robot = R w_sensor,    R = Rz(yaw) Ry(pitch) Rx(roll)
//! ```
//!
//! (roll, pitch, yaw about fixed axes, as ROS has them in REP 103 and URDF). The rate about an axis of the robot is a row of
//! R times the rates of the sensor's three axes; it becomes a column of the file before anything is made of it, so that a
//! turned log is audited, held or read once as any other. Yaw makes no difference to the rate about the robot's z axis.

use super::names::Axis;
use crate::error::{Error, ErrorKind, Result};
use nalgebra::{Quaternion, Rotation3, UnitQuaternion};

/// Right angles are not exact in radians: their sines and cosines are this close to 0 and 1.
const RIGHT_ANGLE: f64 = 1e-15;
/// A quaternion of unit length, each number rounded to three decimals, has a length this close to 1: four errors of up to
/// 5e-4, weighted by numbers of which the squares add up to 1, so that they add up to 2 at most.
const UNIT: f64 = 1e-3;

/// The rotation from the frame of the sensor to that of the robot.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Mounting {
    rotation: [[f64; 3]; 3],
}

impl Mounting {
    /// The sensor's axes are the robot's.
    pub const ALIGNED: Self = Self { rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] };

    /// From roll, pitch and yaw about the robot's fixed axes x, y, z, in degrees.
    ///
    /// # Errors
    /// [`ErrorKind::Usage`] for an angle that is not finite.
    pub fn from_roll_pitch_yaw_deg(angles_deg: [f64; 3]) -> Result<Self> {
        if let Some(angle) = angles_deg.iter().find(|a| !a.is_finite()) {
            return Err(Error::new(ErrorKind::Usage, "--mounting", format!("{angle} is no angle"))
                .hint("give roll, pitch and yaw in degrees: --mounting 180,0,0"));
        }
        let [roll, pitch, yaw] = angles_deg.map(f64::to_radians);
        Ok(Self::of(&Rotation3::from_euler_angles(roll, pitch, yaw)))
    }

    /// From a quaternion in the order of ROS: x, y, z, w.
    ///
    /// # Errors
    /// [`ErrorKind::Usage`] if its length is not 1 within what rounding to three decimals explains.
    pub fn from_quaternion([x, y, z, w]: [f64; 4]) -> Result<Self> {
        let quaternion = Quaternion::new(w, x, y, z);
        let length = quaternion.norm();
        if !((length - 1.0).abs() <= UNIT) {
            return Err(Error::new(
                ErrorKind::Usage,
                "--mounting-quaternion",
                format!("its length is {length}, not 1"),
            )
            .hint("check the numbers and their order: x, y, z, w"));
        }
        Ok(Self::of(&UnitQuaternion::new_normalize(quaternion).to_rotation_matrix()))
    }

    fn of(rotation: &Rotation3<f64>) -> Self {
        let exact = |v: f64| if (v - v.round()).abs() < RIGHT_ANGLE { v.round() } else { v };
        Self { rotation: std::array::from_fn(|i| std::array::from_fn(|j| exact(rotation[(i, j)]) + 0.0)) }
    }

    /// R: its rows are the robot's axes in the frame of the sensor.
    #[must_use]
    pub fn rotation(&self) -> [[f64; 3]; 3] {
        self.rotation
    }

    /// The robot's `axis` in the frame of the sensor, of unit length.
    #[must_use]
    pub fn axis(&self, axis: Axis) -> [f64; 3] {
        self.rotation[axis as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(a: [f64; 3], b: [f64; 3]) {
        assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-14), "{a:?} {b:?}");
    }

    #[test]
    fn roll_pitch_and_yaw_turn_about_fixed_axes_in_this_order() {
        let of = |angles| Mounting::from_roll_pitch_yaw_deg(angles).unwrap();
        // written out: R = Rz Ry Rx
        let ([sr, sp, sy], [cr, cp, cy]) =
            ([20f64, -35.0, 110.0].map(|a| a.to_radians().sin()), [20f64, -35.0, 110.0].map(|a| a.to_radians().cos()));
        let all = of([20.0, -35.0, 110.0]);
        close(all.axis(Axis::X), [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr]);
        close(all.axis(Axis::Y), [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr]);
        close(all.axis(Axis::Z), [-sp, cp * sr, cp * cr]);
        // a sensor that lies on its back turns about minus its z axis, exactly
        assert_eq!(of([180.0, 0.0, 0.0]).axis(Axis::Z), [0.0, 0.0, -1.0]);
        assert_eq!(of([90.0, 0.0, 0.0]).axis(Axis::Z), [0.0, 1.0, 0.0]);
        assert_eq!(of([0.0, 90.0, 0.0]).axis(Axis::Z), [-1.0, 0.0, 0.0]);
        assert_eq!(of([0.0, 0.0, 73.0]).axis(Axis::Z), [0.0, 0.0, 1.0]);
        assert_eq!(of([0.0; 3]), Mounting::ALIGNED);
        assert!(Mounting::from_roll_pitch_yaw_deg([0.0, f64::NAN, 0.0]).is_err());
    }

    #[test]
    fn quaternions_are_those_of_ros_and_have_unit_length() {
        // half of 90 degrees about x, rounded as people write it
        let turned = Mounting::from_quaternion([0.707, 0.0, 0.0, 0.707]).unwrap();
        close(turned.axis(Axis::Z), [0.0, 1.0, 0.0]);
        let (a, b) = (30f64.to_radians() / 2.0, -50f64.to_radians() / 2.0);
        // Rz(-50) Rx(30) as a product of quaternions
        let product = [b.cos() * a.sin(), b.sin() * a.sin(), b.sin() * a.cos(), b.cos() * a.cos()];
        let found = Mounting::from_quaternion(product).unwrap();
        let wanted = Mounting::from_roll_pitch_yaw_deg([30.0, 0.0, -50.0]).unwrap();
        Axis::ALL.into_iter().for_each(|axis| close(found.axis(axis), wanted.axis(axis)));
        for wrong in [[0.0; 4], [0.0, 0.0, 0.0, 1.01], [1.0, 1.0, 0.0, 0.0], [f64::NAN, 0.0, 0.0, 1.0]] {
            assert_eq!(Mounting::from_quaternion(wrong).unwrap_err().kind, ErrorKind::Usage);
        }
    }
}
