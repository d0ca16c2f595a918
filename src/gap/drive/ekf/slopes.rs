//! a = (v(t) - v(t - τ))/τ:   accelerations, and the wheel forces that they take
//!
//! Of an acceleration beyond the model's own the share φ lasts to the next row: v' = v + dt (f + φ (a - f)). By a coefficient β
//! ∂v'/∂β = (1 - φ)(∂v/∂β + dt ∂f/∂β) + φ (∂v/∂β + dt (∂v(t)/∂β - ∂v(t - τ)/∂β)/τ).

use super::filter::{Lasting, N, TH, V, X, Y};
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

/// Derivatives of v and ω by the columns at the rows that [`Slopes`] compares.
#[derive(Default)]
pub(crate) struct SlopeTangents {
    /// At the last rows, the newest last.
    arrived: VecDeque<[Vec<f64>; 2]>,
    /// In this row, before the step.
    here: [Vec<f64>; 2],
    rows: usize,
}

impl SlopeTangents {
    /// Derivatives of the state before a step.
    pub(crate) fn leave(&mut self, state: &[Vec<f64>; N]) {
        self.here.iter_mut().zip(&state[V..]).for_each(|(own, from)| own.clone_from(from));
    }

    /// Adds to the derivatives of the state after a step of `dt` s, by the model, those of what lasts; `middle`: sine and cosine of the
    /// heading half way.
    pub(crate) fn arrive(&mut self, state: &mut [Vec<f64>; N], lasting: &[Lasting; 2], dt: f64, middle: (f64, f64)) {
        for (i, Lasting { share, over, lasts }) in lasting.iter().enumerate() {
            let slope = over.and_then(|(rows, over_s)| {
                self.rows = self.rows.max(rows);
                let newest = self.arrived.len().checked_sub(1)?;
                let by = if *lasts { dt / over_s } else { 0.0 };
                Some((&self.arrived[newest][i], &self.arrived[newest.checked_sub(rows)?][i], by))
            });
            for (c, before) in self.here[i].iter().enumerate() {
                let lasts = slope.map_or(0.0, |(now, then, by)| by * (now[c] - then[c]));
                let added = share * (lasts - (state[V + i][c] - before));
                state[V + i][c] += added;
                // half of the change within the step
                if i == 0 {
                    state[X][c] += 0.5 * dt * added * middle.1;
                    state[Y][c] += 0.5 * dt * added * middle.0;
                } else {
                    state[TH][c] += 0.5 * dt * added;
                }
            }
        }
        let mut newest =
            if self.arrived.len() > self.rows { self.arrived.pop_front() } else { None }.unwrap_or_default();
        newest.iter_mut().zip(&state[V..]).for_each(|(own, from)| own.clone_from(from));
        self.arrived.push_back(newest);
    }
}
