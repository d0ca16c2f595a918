//! A gyro that is not mounted along the axes of its robot
//!
//! ```text
//! w_robot = R w_sensor,    R = Rz(yaw) Ry(pitch) Rx(roll)
//! ```
//!
//! (roll, pitch, yaw about fixed axes, as ROS has them in REP 103 and URDF). The rate about an axis of the robot is a row of
//! R times the rates of the sensor's three axes; it becomes a column of the file before anything is made of it, so that a
//! turned log is audited, held or read once as any other. Yaw makes no difference to the rate about the robot's z axis.

use super::gravity::{Accelerometer, Gravity};
use super::names::{Axis, Role, tells_motion};
use crate::error::{Error, ErrorKind, Result};
use crate::ingest::assemble::recording::{GyroQuery, find_gyro};
use crate::ingest::formats::format::{Batch, Column, ColumnFacts, Facts, Source, Take};
use crate::ingest::formats::table::{Head, Kind};
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

/// A table with the rate about an axis of the robot in the place of the sensor's rates.
pub(crate) struct Mounted {
    inner: Box<dyn Source>,
    /// Heads of the table, and after them that of the rate.
    heads: Vec<Head>,
    /// Columns of the sensor's rates that count, and their weights.
    parts: Vec<(usize, f64)>,
    /// The accelerometer, which shows gravity while the sensor rests; `None` without one.
    accelerometer: Option<Accelerometer>,
    gravity: Gravity,
}

impl Mounted {
    /// The table `inner` of the file `source`, whose gyro is mounted as the query says. With what there is to tell.
    pub(crate) fn new(
        source: &str,
        inner: Box<dyn Source>,
        mounting: &Mounting,
        query: &GyroQuery,
    ) -> Result<(Self, Option<String>)> {
        if query.column.is_some() {
            return Err(Error::new(ErrorKind::Usage, "--column", "names one column, and a mounting turns three")
                .hint("leave out --column, or --mounting"));
        }
        let mut heads = inner.heads().to_vec();
        let aligned = *mounting == Mounting::ALIGNED;
        let parts = if aligned {
            vec![(find_gyro(source, &heads, query.axis)?, 1.0)]
        } else {
            parts(source, &heads, mounting.axis(query.axis))?
        };
        let unit = unit(source, &heads, &parts, query)?;
        // readers of the name learn the axis from it: that of the robot
        let (own, told) = if aligned {
            (heads[parts[0].0].name.clone(), None)
        } else {
            let own = format!("robot_gyro_{}", query.axis);
            let told = format!("{own} = {}, as the mounting has it", formula(&heads, &parts));
            (own, Some(told))
        };
        // the rates of the sensor's axes are nobody else's business
        for head in heads.iter_mut().filter(|h| matches!(h.named().role, Role::Gyro(_))) {
            (head.role, head.kind) = (Some(Role::Other), Kind::Other);
        }
        let accelerometer = Accelerometer::find(&heads);
        let mut head = Head::number(own, "number").with_role(Role::Gyro(Some(query.axis)));
        head.unit = unit;
        heads.push(head);
        let gravity = Gravity::new(mounting, query.axis == Axis::Z && query.reversed);
        Ok((Self { inner, heads, parts, accelerometer, gravity }, told))
    }

    /// The table of a drive with the rate about the robot's z axis. The accelerometer is not asked: a robot that drives also
    /// accelerates.
    pub(crate) fn of_drive(
        source: &str,
        inner: Box<dyn Source>,
        mounting: &Mounting,
    ) -> Result<(Self, Option<String>)> {
        let (turned, told) = Self::new(source, inner, mounting, &GyroQuery::default())?;
        if let Some(Head { unit: None, .. }) = turned.heads.last() {
            return Err(Error::new(
                ErrorKind::Unit,
                source,
                "the columns of the gyro that is to be turned name no unit",
            )
            .hint("name it in all of them, such as gyro_x_rad_s or gx_dps"));
        }
        Ok((Self { accelerometer: None, ..turned }, told))
    }
}

/// Whether there is a gyro among the columns.
pub(crate) fn has_gyro(heads: &[Head]) -> bool {
    heads.iter().any(|h| matches!(h.named().role, Role::Gyro(_)) && !tells_motion(&h.name))
}

/// The columns of the gyro's axes and their weights in the rate. Axes of weight zero need not be there.
fn parts(source: &str, heads: &[Head], weights: [f64; 3]) -> Result<Vec<(usize, f64)>> {
    let mut parts: Vec<(usize, f64)> = Vec::new();
    let needed: Vec<String> =
        Axis::ALL.iter().zip(weights).filter(|(_, w)| *w != 0.0).map(|(a, _)| a.to_string()).collect();
    let hint = format!(
        "this mounting needs the rates of the sensor's axes {}, in columns whose names say so, such as gyro_x",
        needed.join(", ")
    );
    for (axis, weight) in Axis::ALL.into_iter().zip(weights).filter(|(_, w)| *w != 0.0) {
        let column = find_gyro(source, heads, axis).map_err(|e| e.hint(&hint))?;
        if parts.iter().any(|p| p.0 == column) {
            let found = format!("column {:?} is the only gyro, and its name says no axis", heads[column].name);
            return Err(Error::new(ErrorKind::Column, source, found).hint(&hint));
        }
        parts.push((column, weight));
    }
    Ok(parts)
}

/// The one unit of all parts.
fn unit(source: &str, heads: &[Head], parts: &[(usize, f64)], query: &GyroQuery) -> Result<Option<String>> {
    let of = |part: &(usize, f64)| heads[part.0].named().unit.or_else(|| heads[part.0].unit.clone());
    let first = parts.first().and_then(of);
    match parts.iter().find(|p| of(p) != first) {
        Some(other) if query.unit.is_none() => {
            let said = |unit: Option<String>| unit.unwrap_or_else(|| "none".into());
            let (a, b) = (&heads[parts[0].0].name, &heads[other.0].name);
            let found = format!("{a:?} and {b:?} name different units: {} and {}", said(first), said(of(other)));
            Err(Error::new(ErrorKind::Unit, source, found)
                .hint("a mounting adds them: name the same unit in all three columns, or state it with --unit"))
        }
        _ => Ok(first),
    }
}

fn formula(heads: &[Head], parts: &[(usize, f64)]) -> String {
    let mut out = String::new();
    for (i, (column, weight)) in parts.iter().enumerate() {
        let sign = match (i, *weight < 0.0) {
            (0, false) => "",
            (0, true) => "-",
            (_, false) => " + ",
            (_, true) => " - ",
        };
        let size = weight.abs();
        let times = if size == 1.0 { String::new() } else { format!("{size:.6} ") };
        out += &format!("{sign}{times}{}", heads[*column].name);
    }
    out
}

/// The rate of the rows of `batch`; missing where a part is.
fn turned(batch: &Batch, parts: &[(usize, f64)]) -> Column {
    let mut values = vec![0.0; batch.rows];
    for (column, weight) in parts {
        let part = &batch.columns[*column];
        let origin = part.origin as f64;
        values.iter_mut().zip(&part.values).for_each(|(sum, v)| *sum += weight * (v + origin));
    }
    Column { origin: 0, values }
}

impl Source for Mounted {
    fn heads(&self) -> &[Head] {
        &self.heads
    }

    fn rows(&self) -> Option<u64> {
        self.inner.rows()
    }

    fn read(self: Box<Self>, wanted: &[bool], take: Take<'_>) -> Result<Facts> {
        let Self { inner, parts, accelerometer, mut gravity, .. } = *self;
        let columns = inner.heads().len();
        let mut needed = wanted[..columns].to_vec();
        let turns = wanted[columns];
        if turns {
            parts.iter().for_each(|p| needed[p.0] = true);
            accelerometer.iter().flat_map(|a| a.columns).for_each(|c| needed[c] = true);
        }
        let mut facts = inner.read(&needed, &mut |mut batch| {
            let rate = if turns { turned(&batch, &parts) } else { Column::default() };
            if let (true, Some(accelerometer)) = (turns, accelerometer) {
                gravity.add(&batch, accelerometer);
            }
            // what was read for the rate alone is not held
            for (column, _) in batch.columns.iter_mut().zip(wanted).filter(|(_, w)| !**w) {
                *column = Column::default();
            }
            batch.columns.push(rate);
            take(batch)
        })?;
        let bad = parts.iter().filter_map(|p| facts.columns[p.0].bad.clone()).min_by_key(|b| b.0.row);
        facts.columns.push(ColumnFacts { resolution: 0.0, bad });
        facts.notes.extend(gravity.text());
        Ok(facts)
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
