//! wheel speed = (n_k - n_j) tick/(t_k - t_j), j the last row before k that was counted
//!
//! The mean speed since then, not the one at t_k.

/// Speeds (rad/s) of a wheel whose ticks of `tick_rad` were counted to `counts` at `times` (s). Missing (NaN) at the
/// first row that was counted, and where the count is missing.
#[must_use]
pub(crate) fn tick_speeds_rad_s(times: &[f64], counts: &[f64], tick_rad: f64) -> Vec<f64> {
    let mut last: Option<(f64, f64)> = None;
    let speed = |(&t, &n): (&f64, &f64)| {
        if !n.is_finite() {
            return f64::NAN;
        }
        let before = last.replace((t, n));
        before.map_or(f64::NAN, |(t0, n0)| (n - n0) * tick_rad / (t - t0))
    };
    times.iter().zip(counts).map(speed).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_may_be_uneven_and_counts_missing() {
        let times = [0.0, 0.1, 0.4, 0.5, 0.7];
        let speeds = tick_speeds_rad_s(&times, &[f64::NAN, 7.0, 10.0, f64::NAN, 4.0], 0.5);
        assert!(speeds[0].is_nan() && speeds[1].is_nan() && speeds[3].is_nan());
        // 3 ticks in 0.3 s; -6 ticks in 0.3 s
        assert!((speeds[2] - 5.0).abs() < 1e-12 && (speeds[4] + 10.0).abs() < 1e-12, "{speeds:?}");
    }
}
