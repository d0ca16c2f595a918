//! max over τ of (Σ_{k≥τ} e_k)² / (n_τ - x_τ' G⁻¹ x_τ),   e = d - X G⁻¹ X'd,  G = X'X,  x_τ = Σ_{k≥τ} X_k,  n_τ = rows from τ on
//!
//! When a gyro's bias jumps: the generalised likelihood ratio of a step in d, what the gyro reads beyond the yaw rate of the
//! wheels, beside whatever constant, warm-up and errors of scale there may be (X). It is only a place to look at: the
//! comparison of effects weighs the step itself, in the filter.

use super::record::Record;
use faer::linalg::solvers::Solve;
use faer::{Mat, Side};

/// Columns of X: 1, warm-up, ω, |ω|, v².
const COLUMNS: usize = 5;
/// Relative size of what makes G regular.
const RIDGE: f64 = 1e-9;

/// Time of the most likely step of the gyro's bias, s since the log began; none without a gyro.
#[must_use]
pub fn of(record: &Record) -> Option<f64> {
    let gyro = record.gyro_rad_s.as_ref()?;
    let (robot, warm_up) = (&record.belief.robot, &record.belief.warm_up);
    let [left, right] = &record.wheels_rad_s;
    let row = |k: usize| {
        let [l, r] = [robot.radius_m[0] * left[k], robot.radius_m[1] * right[k]];
        let (rate, speed) = (0.5 * (r - l) / robot.half_track_m, 0.5 * (l + r));
        let since_s = record.since_power_on_s[k];
        let risen = -(-since_s / warm_up.time_constant_s).exp_m1();
        let d = gyro[k] - warm_up.error_rad_s(since_s) - rate;
        d.is_finite().then_some((k, d, [1.0, risen, rate, rate.abs(), speed * speed]))
    };
    let rows: Vec<(usize, f64, [f64; COLUMNS])> = (0..record.len()).filter_map(row).collect();
    let mut gram = Mat::<f64>::zeros(COLUMNS, COLUMNS);
    let mut moment = Mat::<f64>::zeros(COLUMNS, 1);
    for (_, d, x) in &rows {
        for i in 0..COLUMNS {
            moment[(i, 0)] += x[i] * d;
            for j in 0..COLUMNS {
                gram[(i, j)] += x[i] * x[j];
            }
        }
    }
    for i in 0..COLUMNS {
        gram[(i, i)] += RIDGE * gram[(i, i)] + f64::MIN_POSITIVE.sqrt();
    }
    let factor = gram.llt(Side::Lower).ok()?;
    let fitted = factor.solve(&moment);
    let inverse = factor.solve(&Mat::<f64>::identity(COLUMNS, COLUMNS));
    let (mut sum, mut after, mut count) = (0.0, [0.0; COLUMNS], 0.0);
    let mut best = (0.0, None);
    for (k, d, x) in rows.iter().rev() {
        sum += d - (0..COLUMNS).map(|i| x[i] * fitted[(i, 0)]).sum::<f64>();
        count += 1.0;
        after.iter_mut().zip(x).for_each(|(a, x)| *a += x);
        let known: f64 = (0..COLUMNS * COLUMNS)
            .map(|ij| after[ij / COLUMNS] * inverse[(ij / COLUMNS, ij % COLUMNS)] * after[ij % COLUMNS])
            .sum();
        // a step at the very beginning or end is no step: nothing is left to tell it by
        let left = count - known;
        if left > 1.0 && sum * sum / left > best.0 {
            best = (sum * sum / left, Some(record.times_s[*k] - record.times_s[0]));
        }
    }
    best.1
}
