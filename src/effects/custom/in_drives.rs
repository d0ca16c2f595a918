//! F, N, wheel or gyro reading += f(t, motion, place; θ),  θ_j = parameter - null_j, or parameter - reference_j without a null value
//!
//! θ = 0 changes nothing: parameters without a null value, the shape, are then at the reference, the middle of what is plausible.
//! The size is linear in most expressions and fitted exactly; the shape is not, and is begun from points over its plausible range.

use super::defined::Defined;
use super::quantities::InDrives;
use crate::config::ActsOn;
use crate::effects::about::{About, Parameters};
#[cfg(test)]
use crate::effects::drive::Tried;
use crate::effects::drive::{Coordinate, DriveExplanation, Driving, ModelChange, Needs, Touches};
use crate::effects::parts::{Checked, log_spaced};
use crate::error::Result;
use crate::model::drive::{DriveEffect, ForceFollows, Moving, Robot};

/// Most points at which a fit is begun, and most sizes at each.
const STARTS: usize = 32;
const SIZES: usize = 4;
/// Bases of the points over the plausible ranges of the shape (Halton 1960): there are at most seven parameters beside the size.
const BASES: [usize; 7] = [2, 3, 5, 7, 11, 13, 17];

/// An effect of the user's own in drives.
#[derive(Debug)]
pub(super) struct Driven(&'static Change);

/// The change of the robot's equations that it is.
#[derive(Debug)]
struct Change(&'static Defined);

impl Driven {
    pub(super) fn new(defined: &'static Defined) -> Self {
        Self(Box::leak(Box::new(Change(defined))))
    }
}

impl Driving for Driven {
    fn about(&self) -> &'static About {
        self.0.0.about
    }

    #[cfg(test)]
    fn tried(&self) -> Tried {
        Tried::motion(&[])
    }

    fn explanation(&self) -> DriveExplanation {
        DriveExplanation::Model(self.0)
    }

    fn simulated(&self, parameters: &Parameters, _: f64, _: u64) -> Result<Box<dyn DriveEffect>> {
        Checked::of(self.0.0.about, parameters)?;
        Ok(Box::new(Work { of: self.0.0, values: self.0.0.values(parameters) }))
    }
}

impl ModelChange for Change {
    fn coordinates(&self) -> &'static [Coordinate] {
        self.0.drives.coordinates
    }

    fn sizes(&self) -> &'static str {
        "what the configuration says is plausible"
    }

    fn at(&self, theta: &[f64]) -> Box<dyn DriveEffect> {
        Box::new(Work { of: self.0, values: self.0.at_theta(theta) })
    }

    fn parameters(&self, theta: &[f64]) -> Parameters {
        self.0.named(&self.0.at_theta(theta))
    }

    fn theta(&self, parameters: &Parameters) -> Vec<f64> {
        let values = self.0.values(parameters);
        self.0.drives.order.iter().map(|place| values[*place] - self.0.drives.reference[*place]).collect()
    }

    fn touches(&self) -> Touches {
        match self.0.table.acts_on {
            ActsOn::ForceN | ActsOn::TorqueNM | ActsOn::WheelLeftTorqueNM | ActsOn::WheelRightTorqueNM => {
                Touches::MOTION
            }
            ActsOn::WheelLeftRadS | ActsOn::WheelRightRadS => Touches::WHEELS,
            ActsOn::GyroRateRadS | ActsOn::GyroBiasRadS => Touches::GYRO,
        }
    }

    fn starts(&self) -> Vec<Vec<f64>> {
        let InDrives { order, reference, coordinates, sizes, .. } = &self.0.drives;
        let shape = &order[*sizes..];
        if shape.is_empty() {
            return Vec::new();
        }
        let [low, high] = coordinates[0].scale;
        let [down, up] = coordinates[0].bounds;
        let all = log_spaced(low, high, SIZES).into_iter().flat_map(|size| [size, -size]);
        let all: Vec<f64> = all.filter(|size| (down..=up).contains(size)).collect();
        let at = |n: usize, k: usize| {
            let [from, to] = self.0.table.parameters[shape[k]].plausible;
            from + (to - from) * radical_inverse(n, BASES[k]) - reference[shape[k]]
        };
        let points = 1..=STARTS / all.len().max(1);
        let start = |n: usize, size: &f64| {
            let mut theta = vec![0.0; *sizes];
            theta[0] = *size;
            theta.extend((0..shape.len()).map(|k| at(n, k)));
            theta
        };
        points.flat_map(|n| all.iter().map(move |size| start(n, size))).collect()
    }

    fn is_rigid(&self) -> bool {
        self.0.drives.sizes == self.0.drives.order.len()
    }

    fn positive(&self) -> usize {
        let sizes = &self.0.drives.coordinates[..self.0.drives.sizes];
        sizes.iter().take_while(|c| c.bounds[0] >= 0.0).count()
    }

    fn needs(&self) -> Needs {
        let touches = self.touches();
        // wheels alone know no length, and so no speed
        let needs = Needs { gyro: touches.gyro, length: touches.wheels, ..Needs::NOTHING };
        // a part of a log begins where only a pose tells
        let pose = self.0.drives.force_follows.position || self.0.drives.force_follows.heading;
        Needs { torques: touches.motion || self.0.drives.forced, pose, ..needs }
    }
}

/// The digits of `n` in `base` mirrored at the point: 1, 2, 3, … are spread evenly over 0 to 1.
fn radical_inverse(mut n: usize, base: usize) -> f64 {
    let (mut value, mut unit) = (0.0, 1.0);
    while n > 0 {
        unit /= base as f64;
        value += unit * (n % base) as f64;
        n /= base;
    }
    value
}

/// The effect at work: values of its parameters in the order of their tables.
struct Work {
    of: &'static Defined,
    values: Vec<f64>,
}

impl Work {
    /// The expression's value, in the unit of its place.
    fn value(&self, at: &Moving, wheels_rad_s: [f64; 2]) -> f64 {
        let quantities = &self.of.drives.quantities;
        let signal = |i: usize| quantities[i].map_or(f64::NAN, |quantity| quantity(at, wheels_rad_s));
        self.of.law.value(signal, &self.values)
    }
}

impl DriveEffect for Work {
    fn force(&self, robot: &Robot, at: &Moving) -> [f64; 2] {
        let value = || self.value(at, robot.wheels_rad_s(at.speed_m_s, at.yaw_rate_rad_s));
        match self.of.table.acts_on {
            ActsOn::ForceN => [value(), 0.0],
            ActsOn::TorqueNM => [0.0, value()],
            ActsOn::WheelLeftTorqueNM => {
                let force = value() / robot.radius_m[0];
                [force, -robot.half_track_m * force]
            }
            ActsOn::WheelRightTorqueNM => {
                let force = value() / robot.radius_m[1];
                [force, robot.half_track_m * force]
            }
            ActsOn::WheelLeftRadS | ActsOn::WheelRightRadS | ActsOn::GyroRateRadS | ActsOn::GyroBiasRadS => [0.0; 2],
        }
    }

    fn force_follows(&self) -> ForceFollows {
        self.of.drives.force_follows
    }

    fn pushes_alike(&self, one: &Robot, other: &Robot) -> bool {
        // radii and track are what the speeds of wheels and the forces of their torques follow from
        one.radius_m == other.radius_m && one.half_track_m == other.half_track_m
    }

    fn wheels_rad_s(&self, robot: &Robot, at: &Moving, wheels_rad_s: [f64; 2]) -> [f64; 2] {
        let [left, right] = wheels_rad_s;
        let value = || self.value(at, robot.wheels_rad_s(at.speed_m_s, at.yaw_rate_rad_s));
        match self.of.table.acts_on {
            ActsOn::WheelLeftRadS => [left + value(), right],
            ActsOn::WheelRightRadS => [left, right + value()],
            _ => wheels_rad_s,
        }
    }

    fn gyro_rad_s(&self, at: &Moving, rate_rad_s: f64) -> f64 {
        // none of its signals is of the wheels
        let acts = self.of.table.acts_on == ActsOn::GyroRateRadS;
        if acts { rate_rad_s + self.value(at, [f64::NAN; 2]) } else { rate_rad_s }
    }
}

#[cfg(test)]
mod tests;
