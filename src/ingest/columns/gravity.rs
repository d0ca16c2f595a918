//! Where the accelerometer of a log at rest sees the vertical
//!
//! ```text
//! tilt = angle between the mean specific force and the robot's z axis, both in the frame of the sensor
//! ```
//!
//! At rest an accelerometer measures the force that holds it up, so that its mean points upwards whatever its unit.

use super::mounting::Mounting;
use super::names;
use super::names::Axis;
use crate::ingest::formats::head::{Head, Kind};
use crate::ingest::formats::source::Batch;

/// Offsets of cheap accelerometers (50 mg) and floors that are not level explain this much, degrees.
const TILT_DOUBT_DEG: f64 = 5.0;

/// Words that name an acceleration, or its integral over the samples.
const ACCELERATION: [&str; 7] =
    ["a", "acc", "accel", "accelerometer", "acceleration", "accelerations", "deltavelocity"];
/// Words that make something else of it.
const NOT_MEASURED: [&str; 16] = [
    "bias",
    "offset",
    "std",
    "sigma",
    "var",
    "variance",
    "cov",
    "covariance",
    "scale",
    "status",
    "temp",
    "temperature",
    "angular",
    "cmd",
    "setpoint",
    "ref",
];
/// Last words of names that are units, or parts of them.
const UNITS: [&str; 9] = ["m", "s", "s2", "2", "ms2", "mps2", "g", "mg", "per"];

/// Columns of an accelerometer's axes x, y, z.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Accelerometer {
    pub columns: [usize; 3],
}

impl Accelerometer {
    /// The only three columns whose names are those of an accelerometer's axes.
    pub(crate) fn find(heads: &[Head]) -> Option<Self> {
        let mut found: [Vec<usize>; 3] = Default::default();
        for (i, head) in heads.iter().enumerate().filter(|(_, h)| h.kind == Kind::Number) {
            if let Some(axis) = axis_of(&head.name) {
                found[axis as usize].push(i);
            }
        }
        match found.each_ref().map(|f| &f[..]) {
            [[x], [y], [z]] => Some(Self { columns: [*x, *y, *z] }),
            _ => None,
        }
    }
}

/// The axis of an accelerometer's column: `linear_acceleration.x`, `accelerometer_m_s2[0]`, `AccX`, `az_m_s2`.
fn axis_of(name: &str) -> Option<Axis> {
    let (stem, bracketed) = names::split_brackets(name);
    let mut words = names::words_of(&stem);
    if words.iter().any(|w| NOT_MEASURED.contains(&w.as_str())) {
        return None;
    }
    while words.len() > 1 && words.last().is_some_and(|w| UNITS.contains(&w.as_str())) {
        words.pop();
    }
    let index = match bracketed.as_deref() {
        Some("0") => Some(Axis::X),
        Some("1") => Some(Axis::Y),
        Some("2") => Some(Axis::Z),
        _ => None,
    };
    let named = |words: &[String]| {
        let pair = |p: &[String]| ACCELERATION.contains(&p.concat().as_str());
        words.iter().any(|w| ACCELERATION.contains(&w.as_str())) || words.windows(2).any(pair)
    };
    if let Some(axis) = index {
        return named(&words).then_some(axis);
    }
    let (last, before) = words.split_last()?;
    if let Some(axis) = Axis::parse(last) {
        return named(before).then_some(axis);
    }
    // ax, accz
    let at = last.len().checked_sub(1).filter(|at| last.is_char_boundary(*at))?;
    let (word, axis) = last.split_at(at);
    ACCELERATION.contains(&word).then(|| Axis::parse(axis)).flatten()
}

/// The mean specific force, while it is added up.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Gravity {
    /// The robot's z axis in the frame of the sensor, and whether it points down.
    z: [f64; 3],
    down: bool,
    aligned: bool,
    sum: [f64; 3],
    rows: usize,
}

impl Gravity {
    /// Sums for a gyro with this mounting in a robot whose z axis points up, or `down`.
    pub(crate) fn new(mounting: &Mounting, down: bool) -> Self {
        let aligned = *mounting == Mounting::ALIGNED;
        Self { z: mounting.axis(Axis::Z), down, aligned, sum: [0.0; 3], rows: 0 }
    }

    /// The next rows.
    pub(crate) fn add(&mut self, batch: &Batch, accelerometer: Accelerometer) {
        let axes = accelerometer.columns.map(|c| &batch.columns[c]);
        for row in 0..batch.rows {
            let force = axes.map(|c| c.values.get(row).map_or(f64::NAN, |v| v + c.origin as f64));
            if force.iter().all(|f| f.is_finite()) {
                self.sum.iter_mut().zip(force).for_each(|(sum, f)| *sum += f);
                self.rows += 1;
            }
        }
    }

    /// Sentence that compares the mounting with the direction of gravity; `None` without accelerometer readings.
    pub(crate) fn text(&self) -> Option<String> {
        let length = self.sum.iter().map(|f| f * f).sum::<f64>().sqrt();
        if self.rows == 0 || !(length > 0.0 && length.is_finite()) {
            return None;
        }
        let force = self.sum.map(|f| f / length);
        let z = if self.down { self.z.map(|v| -v) } else { self.z };
        let cross =
            [force[1] * z[2] - force[2] * z[1], force[2] * z[0] - force[0] * z[2], force[0] * z[1] - force[1] * z[0]];
        let sine = cross.iter().map(|v| v * v).sum::<f64>().sqrt();
        let cosine: f64 = force.iter().zip(z).map(|(a, b)| a * b).sum();
        let tilt_deg = sine.atan2(cosine).to_degrees();
        let axis = if self.down { "axis -z" } else { "z axis" };
        let said = format!("by the accelerometer the robot's {axis} lies {tilt_deg:.1}° from the vertical");
        if tilt_deg <= TILT_DOUBT_DEG {
            return Some(said);
        }
        // the third row of R is the vertical: (-sin p, cos p sin r, cos p cos r)
        let up = if self.down { force.map(|v| -v) } else { force };
        let (roll, pitch) = (up[1].atan2(up[2]).to_degrees(), (-up[0]).clamp(-1.0, 1.0).asin().to_degrees());
        let stated = if self.aligned { "it is mounted with" } else { "its mounting has" };
        Some(format!(
            "{said}, which is not as stated: if the robot stood level, {stated} roll {} and pitch {} degrees, unless the \
             accelerometer counts downwards",
            tenth(roll),
            tenth(pitch)
        ))
    }
}

/// To a tenth of a degree, without a zero of negative sign.
fn tenth(angle_deg: f64) -> String {
    format!("{:.1}", (angle_deg * 10.0).round() / 10.0 + 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ingest::formats::source::Column;

    #[test]
    fn accelerometers_are_found_in_the_files_of_common_recorders() {
        for names in [
            ["linear_acceleration.x", "linear_acceleration.y", "linear_acceleration.z"],
            ["accelerometer_m_s2[0]", "accelerometer_m_s2[1]", "accelerometer_m_s2[2]"],
            ["AccX", "AccY", "AccZ"],
            ["a_RS_S_x [m s^-2]", "a_RS_S_y [m s^-2]", "a_RS_S_z [m s^-2]"],
            ["ax_m_s2", "ay_m_s2", "az_m_s2"],
            ["accel_x", "accel_y", "accel_z"],
            ["delta_velocity[0]", "delta_velocity[1]", "delta_velocity[2]"],
        ] {
            let heads: Vec<Head> =
                ["t_s", "gyro_x", names[0], names[1], "angular_acceleration.z", names[2], "accel_bias_x"]
                    .iter()
                    .map(|n| Head::number(*n, "number"))
                    .collect();
            assert_eq!(Accelerometer::find(&heads), Some(Accelerometer { columns: [2, 3, 5] }), "{names:?}");
        }
        let two: Vec<Head> =
            ["ax", "ay", "az", "accel_x", "x", "time"].iter().map(|n| Head::number(*n, "number")).collect();
        assert_eq!(Accelerometer::find(&two), None);
    }

    /// The sentence for a sensor at rest that measures `force` (m/s²).
    fn said(force: [f64; 3], angles_deg: [f64; 3], down: bool) -> String {
        let mounting = Mounting::from_roll_pitch_yaw_deg(angles_deg).unwrap();
        let mut gravity = Gravity::new(&mounting, down);
        let column = |f: f64| Column { origin: 0, values: vec![f, f64::NAN, f] };
        let batch = Batch { rows: 3, columns: force.map(column).to_vec() };
        gravity.add(&batch, Accelerometer { columns: [0, 1, 2] });
        gravity.text().unwrap()
    }

    #[test]
    fn a_mounting_that_gravity_contradicts_is_told_with_the_right_one() {
        // the sensor sees the vertical along R' z
        let tilted = Mounting::from_roll_pitch_yaw_deg([30.0, -20.0, 40.0]).unwrap();
        let force = tilted.axis(Axis::Z).map(|v| 9.81 * v);
        assert!(said(force, [30.0, -20.0, 0.0], false).ends_with("lies 0.0° from the vertical"));
        let wrong = said(force, [0.0; 3], false);
        // cos of the tilt = cos 30° cos 20°
        assert!(wrong.contains("lies 35.5°") && wrong.contains("roll 30.0 and pitch -20.0"), "{wrong}");
        assert!(said(force, [30.0, -26.0, 0.0], false).contains("lies 6.0°"));
        // a sensor on its back, and a robot whose z axis points down
        assert!(said([0.0, 0.0, -1.0], [0.0; 3], false).contains("lies 180.0°"));
        assert!(said([0.0, 0.0, -1.0], [0.0; 3], true).ends_with("axis -z lies 0.0° from the vertical"));
        assert!(said([0.0, 0.0, -1.0], [180.0, 0.0, 0.0], false).ends_with("z axis lies 0.0° from the vertical"));
        assert!(Gravity::new(&Mounting::ALIGNED, false).text().is_none());
    }
}
