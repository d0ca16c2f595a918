//! [v, ω](t - τ), linear between the rates that are known

use std::collections::VecDeque;

/// Past speeds (m/s) and yaw rates (rad/s), for sensors that lag.
#[derive(Debug, Clone, Default)]
pub struct Past {
    rates: VecDeque<(f64, [f64; 2])>,
}

impl Past {
    /// Longest lag that can be looked up, s.
    pub(crate) const SPAN_S: f64 = 0.5;

    /// Appends speed and yaw rate at `t_s`; times ascend.
    pub(crate) fn push(&mut self, t_s: f64, speed_m_s: f64, yaw_rate_rad_s: f64) {
        self.rates.push_back((t_s, [speed_m_s, yaw_rate_rad_s]));
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
    /// before the first known ones, these.
    #[must_use]
    pub(crate) fn at(&self, t_s: f64, now: (f64, [f64; 2])) -> [f64; 2] {
        let mut later = now;
        for &earlier in self.rates.iter().rev() {
            if earlier.0 <= t_s {
                let span = later.0 - earlier.0;
                let u = if span > 0.0 { ((t_s - earlier.0) / span).clamp(0.0, 1.0) } else { 1.0 };
                return std::array::from_fn(|i| earlier.1[i] + u * (later.1[i] - earlier.1[i]));
            }
            later = earlier;
        }
        later.1
    }
}
