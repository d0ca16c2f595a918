//! [v, ω](t - τ), linear between the rates that are known;  F(t - τ): that of the step in which t - τ lies

use std::collections::VecDeque;

/// Past speeds (m/s), yaw rates (rad/s) and forces of the wheels (N), for sensors that lag.
#[derive(Debug, Clone, Default)]
pub struct Past {
    rates: VecDeque<(f64, [f64; 2], [f64; 2])>,
}

/// Difference of two times that are the same, s.
const SAME_S: f64 = 1e-9;

impl Past {
    /// Longest lag that can be looked up, s.
    pub(crate) const SPAN_S: f64 = 0.5;

    /// Appends speed and yaw rate at `t_s`, and the forces of the wheels in the step that ends there; times ascend.
    pub(crate) fn push(&mut self, t_s: f64, rates: [f64; 2], wheel_force_n: [f64; 2]) {
        self.rates.push_back((t_s, rates, wheel_force_n));
        while self.rates.len() > 2 && self.rates[1].0 < t_s - Self::SPAN_S {
            self.rates.pop_front();
        }
    }

    /// Whether a rate is known later than `t_s`.
    #[must_use]
    pub(crate) fn reaches(&self, t_s: f64) -> bool {
        self.rates.back().is_some_and(|last| last.0 > t_s)
    }

    /// Speed (m/s) and yaw rate (rad/s) at `t_s`, interpolated linearly up to those of `now`, which stand after its time;
    /// before the first known ones, these. Then the forces of the wheels in the step in which `t_s` lies, N; between two
    /// steps those of the one that ends.
    #[must_use]
    pub(crate) fn at(&self, t_s: f64, now: (f64, [f64; 2], [f64; 2])) -> ([f64; 2], [f64; 2]) {
        let mut later = now;
        for &earlier in self.rates.iter().rev() {
            if t_s - earlier.0 > -SAME_S {
                if t_s - earlier.0 < SAME_S {
                    return (earlier.1, earlier.2);
                }
                let span = later.0 - earlier.0;
                let u = if span > 0.0 { ((t_s - earlier.0) / span).clamp(0.0, 1.0) } else { 1.0 };
                return (std::array::from_fn(|i| earlier.1[i] + u * (later.1[i] - earlier.1[i])), later.2);
            }
            later = earlier;
        }
        (later.1, later.2)
    }
}
