//! ξ⁺ = ξ + dt (v cos θ, v sin θ, ω): dead reckoning of the nominal robot, and the pose at which a drive begins to have one
//!
//! Speeds from the wheels, the yaw rate from the gyro less its nominal error where there is one.

use super::Record;
use crate::model::drive::Robot;
use std::ops::Range;

/// Wheel speeds are averaged over this time on either side, s.
const SMOOTH_S: f64 = 0.05;

/// Speed (m/s) and yaw rate (rad/s) in every row of one drive, from its wheel speeds and the geometry of `robot`.
pub(crate) fn driven(like: &Record, robot: &Robot) -> Vec<[f64; 2]> {
    let speeds: Vec<[f64; 2]> =
        (0..like.len()).map(|k| robot.speed_and_yaw_rate([0, 1].map(|i| like.wheels_rad_s[i][k]))).collect();
    let (mut from, mut to) = (0, 0);
    let mut last = [0.0; 2];
    let near = |k: usize| {
        let t = like.times_s[k];
        while like.times_s[from] < t - SMOOTH_S {
            from += 1;
        }
        while to < like.len() && like.times_s[to] <= t + SMOOTH_S {
            to += 1;
        }
        let known = speeds[from..to].iter().filter(|s| s.iter().all(|v| v.is_finite()));
        let (n, sum) = known.fold((0.0, [0.0; 2]), |(n, a), s| (n + 1.0, [a[0] + s[0], a[1] + s[1]]));
        if n > 0.0 {
            last = sum.map(|v| v / n);
        }
        last
    };
    (0..like.len()).map(near).collect()
}

/// Poses of the nominal robot in the rows of one drive from `first` on, by dead reckoning: x, y (m) and heading (rad)
/// relative to the pose in `first`.
pub(crate) fn reckoned(drive: &Record, first: usize) -> impl Iterator<Item = [f64; 3]> + '_ {
    let speeds = driven(drive, &drive.belief.robot);
    let mut pose = [0.0; 3];
    let mut rate = speeds[first][1];
    (first..drive.len()).map(move |k| {
        let here = pose;
        if let Some(gyro) = drive.gyro_rad_s.as_ref().map(|g| g[k]).filter(|g| g.is_finite()) {
            rate = gyro - drive.belief.warm_up.error_rad_s(drive.since_power_on_s[k]);
        } else if drive.gyro_rad_s.is_none() {
            rate = speeds[k][1];
        }
        if let Some(next) = drive.times_s.get(k + 1) {
            let dt = next - drive.times_s[k];
            let (sin, cos) = (pose[2] + 0.5 * dt * rate).sin_cos();
            pose[0] += dt * speeds[k][0] * cos;
            pose[1] += dt * speeds[k][0] * sin;
            pose[2] += dt * rate;
        }
        here
    })
}

/// First pose of a drive.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FirstPose {
    /// Its row.
    pub row: usize,
    /// x and y, m, and heading, rad; a heading that is not known is zero.
    pub pose: [f64; 3],
    /// Their variances, m² and rad².
    pub variance: [f64; 3],
}

impl FirstPose {
    /// That of the drive in `rows`: its first whole pose, or its first position where none is whole; none without
    /// positions.
    pub(crate) fn of(record: &Record, mut rows: Range<usize>) -> Option<Self> {
        let pose = record.pose.as_ref()?;
        let known = |channels: &[Vec<f64>], k: usize| channels.iter().all(|p| p[k].is_finite());
        let whole = rows.clone().find(|k| known(pose, *k));
        let row = whole.or_else(|| rows.find(|k| known(&pose[..2], *k)))?;
        let b = &record.belief;
        let heading = pose[2][row].is_finite();
        let of = [(b.position_std_m, b.lever_arm_std_m); 2];
        let [x, y] = of.map(|(reading, mounting)| 4.0 * reading.powi(2) + mounting.powi(2));
        let turned = match heading {
            true => 4.0 * b.heading_std_rad.powi(2) + b.heading_offset_std_rad.powi(2),
            // any heading is equally probable
            false => std::f64::consts::PI.powi(2) / 3.0,
        };
        let heading = if heading { pose[2][row] } else { 0.0 };
        Some(Self { row, pose: [pose[0][row], pose[1][row], heading], variance: [x, y, turned] })
    }

    /// The pose in row `begin` of the same drive, at or before this one, by dead reckoning.
    pub(crate) fn back_at(&self, record: &Record, begin: usize) -> [f64; 3] {
        if self.row == begin {
            return self.pose;
        }
        let way = record.window(begin..self.row + 1);
        let [ahead, aside, turned] = reckoned(&way, 0).last().unwrap_or_default();
        let heading = self.pose[2] - turned;
        let (sin, cos) = heading.sin_cos();
        [self.pose[0] - (cos * ahead - sin * aside), self.pose[1] - (sin * ahead + cos * aside), heading]
    }
}
