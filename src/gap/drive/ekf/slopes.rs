//! a = (v(t) - v(t - τ))/τ:   accelerations, and the wheel forces that they take

use crate::model::drive::DriveModel;
use std::collections::VecDeque;

/// Accelerations from differences of the speeds over the last rows, where no torques tell them.
pub(crate) struct Slopes {
    /// Rows and time, s, over which the last accelerations of v and ω are taken; none before the second row.
    pub over: [Option<(usize, f64)>; 2],
    over_s: [f64; 2],
    speeds: VecDeque<(f64, [f64; 2])>,
    t_s: f64,
}

impl Slopes {
    /// Least time over which speeds are compared, s.
    pub(crate) const OVER_S: f64 = 0.06;

    /// `over_s`: time over which v and ω are compared, s.
    pub(crate) fn new(over_s: [f64; 2]) -> Self {
        Self { over: [None; 2], over_s, speeds: VecDeque::new(), t_s: 0.0 }
    }

    /// Accelerations (m/s², rad/s²), and the wheel forces (N) that they take, `dt_s` after the last call.
    pub(crate) fn push(&mut self, dt_s: f64, speeds: [f64; 2], model: &DriveModel) -> ([f64; 2], [f64; 2]) {
        self.t_s += dt_s;
        self.speeds.push_back((self.t_s, speeds));
        let [over_v, over_w] = self.over_s;
        while self.speeds.len() > 2 && self.speeds[1].0 <= self.t_s - over_v.max(over_w) {
            self.speeds.pop_front();
        }
        if self.t_s <= self.speeds[0].0 {
            return Default::default();
        }
        let [a, alpha]: [f64; 2] = std::array::from_fn(|i| {
            let before = self.speeds.partition_point(|s| s.0 <= self.t_s - self.over_s[i]);
            let first = before.saturating_sub(1);
            let (t0, from) = self.speeds[first];
            self.over[i] = Some((self.speeds.len() - 1 - first, self.t_s - t0));
            (speeds[i] - from[i]) / (self.t_s - t0)
        });
        let robot = &model.robot;
        let (sum, difference) = (robot.mass_kg * a, robot.yaw_inertia_kg_m2 * alpha / robot.half_track_m);
        ([a, alpha], [0.5 * (sum - difference), 0.5 * (sum + difference)])
    }
}
