//! ∂v'/∂β = ∂v/∂β + φ dt ∂a/∂β,   a = (v(t) - v(t - τ))/τ
//!
//! Where no torques tell an acceleration a, its share φ lasts to the next row, v' = v + dt φ a; and so does its
//! derivative by a coefficient β. The model's own forces have no part in it: without torques they would be those of a
//! robot that coasts.

use super::filter::{Lasting, N, TH, V, X, Y};
use std::collections::VecDeque;

/// Derivatives of v and ω by the columns at the rows that [`Slopes`](super::slopes::Slopes) compares.
#[derive(Default)]
pub(crate) struct SlopeTangents {
    /// At the last rows, the newest last.
    arrived: VecDeque<[Vec<f64>; 2]>,
    rows: usize,
}

impl SlopeTangents {
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
            let Some((now, then, by)) = slope else { continue };
            for c in 0..now.len() {
                let added = share * by * (now[c] - then[c]);
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
