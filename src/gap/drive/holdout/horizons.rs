//! e_h = |p̂(t + h) - p(t + h)| from the pose at t, windows of the longest horizon one after another
//!
//! Error of a model that drives on without a reference: alone, with the recorded torques (where there are none: with
//! the wheels), or as a navigation filter with wheels and gyro.

use crate::gap::answer::Metric;
use crate::gap::drive::ekf::innovations::run;
use crate::gap::drive::ekf::noise::{Channel, Noise};
use crate::gap::drive::holdout::under::Under;
use crate::gap::drive::preprocess::lost_ticks::LostTicks;
use crate::gap::drive::record::Record;

/// Horizons, s.
const HORIZONS_S: [f64; 3] = [1.0, 5.0, 20.0];
/// The longest of them, s.
pub(super) const LONGEST_S: f64 = HORIZONS_S[2];
/// Fewest windows for a comparison of the errors of filters.
const FEWEST_WINDOWS: usize = 5;

/// Squared errors of position (m²) and heading (rad²) at each horizon, window by window.
#[derive(Default)]
pub(crate) struct Horizons([Vec<[f64; 2]>; 3]);

impl Horizons {
    /// Root mean square of position (m) and heading (rad) at each horizon; none where a horizon has no window.
    pub(crate) fn rms(&self) -> Option<[[f64; 2]; 3]> {
        let mean = |h: usize, i: usize| self.0[h].iter().map(|e| e[i]).sum::<f64>() / self.0[h].len() as f64;
        let rms = |h: usize| [0, 1].map(|i| mean(h, i).sqrt());
        self.0.iter().all(|h| !h.is_empty()).then(|| std::array::from_fn(rms))
    }

    /// ln of the squared position errors (m²), window by window: the mean over the horizons beyond the first, at which
    /// the wheels' readings leave little to a model.
    pub(crate) fn ln_positions(&self) -> Vec<f64> {
        let later = &self.0[1..];
        let windows = later.iter().map(Vec::len).min().unwrap_or(0);
        let ln = |n: usize| later.iter().map(|h| h[n][0].max(f64::MIN_POSITIVE).ln()).sum::<f64>() / later.len() as f64;
        (0..windows).map(ln).collect()
    }

    /// Adds the errors of one drive, if it is long enough.
    pub(crate) fn add(&mut self, record: &Record, lost: Option<&LostTicks>, under: &Under, alone: bool) {
        let claimed = under.claimed;
        if record.span_s() < 1.5 * LONGEST_S {
            return;
        }
        let mut noise: Noise = claimed.noise(record, under.process);
        noise.exclude(3..6);
        if alone {
            noise.exclude(if record.torques_n_m.is_some() { 0..3 } else { 2..3 });
        }
        let restored = lost.map(|b| b.restored(record));
        let record = restored.as_ref().unwrap_or(record);
        let (record, models) = claimed.read(record);
        let record = record.as_ref();
        let Some(pose) = &record.pose else { return };
        let mut from = 0;
        while let Some(begin) = (from..record.len()).find(|k| pose.iter().all(|p| p[*k].is_finite())) {
            let start_s = record.times_s[begin];
            let end = record.times_s.partition_point(|t| *t <= start_s + LONGEST_S);
            if end >= record.len() {
                break;
            }
            let part = record.window(begin..end);
            let mut last = [[None; 3]; 3];
            let _ = run(&part, &models, &noise, &[], |i| {
                let channel = match i.channel {
                    Channel::X => 0,
                    Channel::Y => 1,
                    Channel::Heading => 2,
                    _ => return,
                };
                let t = part.times_s[i.row] - start_s;
                for (h, horizon) in HORIZONS_S.iter().enumerate() {
                    if t > 0.5 * horizon && t <= *horizon {
                        last[h][channel] = Some(i.white * i.std);
                    }
                }
            });
            for (h, errors) in last.iter().enumerate() {
                if let [Some(x), Some(y), Some(turn)] = errors {
                    self.0[h].push([x * x + y * y, turn * turn]);
                }
            }
            from = end;
        }
    }
}

/// Standard deviations by which `after` exceeds `before`, in pairs, and exceeds `floor`, all ln of squared errors by
/// window: the lesser of both, zero for too few windows.
pub(crate) fn misled([before, after, floor]: &[Vec<f64>; 3]) -> f64 {
    if before.len() != after.len() || [after, floor].iter().any(|v| v.len() < FEWEST_WINDOWS) {
        return 0.0;
    }
    // mean and the variance of the mean
    let mean = |values: &[f64]| {
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        (mean, values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n * (n - 1.0)))
    };
    let more: Vec<f64> = after.iter().zip(before).map(|(a, b)| a - b).collect();
    let ((more, more_var), (after, after_var), (floor, floor_var)) = (mean(&more), mean(after), mean(floor));
    (more / more_var.sqrt()).min((after - floor) / (after_var + floor_var).sqrt()).max(0.0)
}

/// Root mean squares of position and heading at each horizon: before, after, floor.
pub(crate) fn horizon_metrics(prefix: &str, [before, after, floor]: [[[f64; 2]; 3]; 3]) -> Vec<Metric> {
    let mut all = Vec::with_capacity(2 * HORIZONS_S.len());
    for (quantity, i) in [("position_rms_m", 0), ("heading_rms_rad", 1)] {
        for (h, horizon) in HORIZONS_S.iter().enumerate() {
            let metric = format!("{prefix}{quantity}_{horizon}s");
            all.push(Metric { metric, before: before[h][i], after: after[h][i], floor: floor[h][i] });
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Stream;

    #[test]
    fn a_filter_that_errs_more_is_told_from_chance() {
        let draw = &mut Stream::new(31, 0);
        let windows = |draw: &mut Stream, at: f64| -> Vec<f64> { (0..20).map(|_| at + draw.normal()).collect() };
        // the lesser of two normal variables exceeds one standard deviation in some percent of cases, three in a
        // thousandth at most
        let chance = |draw: &mut Stream| misled(&[0.0, 0.0, 0.0].map(|at| windows(draw, at)));
        let far = (0..2000).filter(|_| chance(draw) > 3.0).count();
        assert!(far <= 10, "{far} of 2000");
        // two standard deviations of a window more than before, and than the floor: 2 √(20/2) = 6.3 of the mean
        let [low, high] = [misled(&[0.0, 2.0, 0.0].map(|at| windows(draw, at))), 12.0];
        assert!(low > 3.0 && low < high, "{low}");
        // no more than the floor, or better than before: the filter is not misled; and few windows tell nothing
        assert!(misled(&[0.0, 2.0, 2.5].map(|at| windows(draw, at))) < 1.0);
        assert_eq!(misled(&[2.0, 0.0, 0.0].map(|at| windows(draw, at))), 0.0);
        assert_eq!(misled(&[0.0, 2.0, 0.0].map(|at| windows(draw, at)[..FEWEST_WINDOWS - 1].to_vec())), 0.0);
    }
}
