//! Speeds that are differences of ticks: means over an interval, taken in in its middle.
//!
//! Under a constant acceleration the mean is the speed in the middle. Taken for the speed at the end, it would be half an
//! interval late, which the gyro, read at the end, would contradict.

use super::reading::Sensor;

/// A mean of a sensor's readings with its interval; or a reading of a gyro that is late, over no interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct MeanSpeed {
    /// Row at or after which the middle of the interval lies.
    pub row: usize,
    /// Middle of the interval, s.
    pub middle_s: f64,
    pub sensor: Sensor,
    /// Mean, in the sensor's unit.
    pub mean: f64,
    pub interval_s: f64,
}

/// The readings of the wheels' sensors at `times` as means, in the order of their middles.
///
/// A speed that was made of the log's own `counts` is the mean since the last count. One that was logged is the mean since
/// the row before, or where that has none, because another sensor's rows lie between, over the column's median interval,
/// and no longer than since the last one: what a reading that is missing covered is not known, and the shorter interval
/// has the larger variance.
pub(super) fn mean_speeds(wheels: &[(Sensor, &[f64])], counts: Option<[&[f64]; 2]>, times: &[f64]) -> Vec<MeanSpeed> {
    let mut means = Vec::with_capacity(wheels.len() * times.len());
    for (side, &(sensor, values)) in wheels.iter().enumerate() {
        // rows that end an interval
        let read: &[f64] = counts.and_then(|counts| counts.get(side).copied()).unwrap_or(values);
        let mut steps: Vec<f64> = Vec::new();
        let mut last = None;
        for k in (0..times.len()).filter(|k| read[*k].is_finite()) {
            steps.extend(last.replace(times[k]).map(|t| times[k] - t));
        }
        let median_s = crate::math::robust::median(&mut steps);
        let (mut row, mut last) = (0, None);
        for (k, &t) in times.iter().enumerate() {
            if !read[k].is_finite() {
                continue;
            }
            let before = last.replace(t);
            let interval_s = match (before, k.checked_sub(1).map(|j| t - times[j])) {
                (Some(since), _) if counts.is_some() => t - since,
                (_, None) => continue,
                (None, Some(_)) if counts.is_some() => continue,
                (Some(since), Some(row_s)) => (t - since).min(median_s).max(row_s),
                (None, Some(row_s)) => row_s,
            };
            let middle_s = t - 0.5 * interval_s;
            while times[row + 1] <= middle_s {
                row += 1;
            }
            if values[k].is_finite() {
                means.push(MeanSpeed { row, middle_s, sensor, mean: values[k], interval_s });
            }
        }
    }
    means.sort_by(|a, b| a.middle_s.total_cmp(&b.middle_s));
    means
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::tick_speeds_rad_s;

    fn found(means: &[MeanSpeed]) -> Vec<(Sensor, usize, f64, f64)> {
        let round = |s: f64| (s * 1e3).round();
        means.iter().map(|m| (m.sensor, m.row, round(m.middle_s), round(m.interval_s))).collect()
    }

    #[test]
    fn a_speed_belongs_in_the_middle_of_what_was_counted() {
        use Sensor::{WheelLeft as Left, WheelRight as Right};
        let (times, nan) = ([0.0, 0.1, 0.3, 0.4, 0.6], f64::NAN);
        let counts = [[0.0, 1.0, nan, 4.0, 6.0], [nan, 1.0, nan, nan, 6.0]];
        let speeds = counts.map(|n| tick_speeds_rad_s(&times, &n, 0.01));
        let wheels = [(Left, speeds[0].as_slice()), (Right, speeds[1].as_slice())];
        let made = mean_speeds(&wheels, Some([&counts[0], &counts[1]]), &times);
        let expected =
            [(Left, 0, 50.0, 100.0), (Left, 1, 250.0, 300.0), (Right, 2, 350.0, 500.0), (Left, 3, 500.0, 200.0)];
        assert_eq!(found(&made), expected);
        assert!((made[1].mean - 0.03 / 0.3).abs() < 1e-12);
        // logged speeds: each over the step before its row
        let logged = mean_speeds(&wheels, None, &times);
        assert!(logged.iter().any(|m| m.sensor == Right && m.row == 3 && (m.interval_s - 0.2).abs() < 1e-12));
    }

    #[test]
    fn rows_of_another_sensor_do_not_shorten_a_logged_mean() {
        // a speed at 10 Hz among rows at 50 Hz, one reading missing
        let times: Vec<f64> = (0..31).map(|k| 0.02 * f64::from(k)).collect();
        let speed: Vec<f64> = (0..31).map(|k| if k % 5 == 0 && k != 15 { 1.0 } else { f64::NAN }).collect();
        let means = mean_speeds(&[(Sensor::Speed, &speed)], None, &times);
        let expected = [(2, 50.0), (7, 150.0), (17, 350.0), (22, 450.0), (27, 550.0)];
        assert_eq!(found(&means), expected.map(|(row, middle)| (Sensor::Speed, row, middle, 100.0)));
    }
}
