//! max over τ of (Σ_{k≥τ} e_k)² / (n_τ - x_τ' G⁻¹ x_τ),   e = d - X G⁻¹ X'd,  G = X'X,  x_τ = Σ_{k≥τ} X_k,  n_τ = rows
//! from τ on
//!
//! Time at which a gyro's bias jumps: the generalised likelihood ratio of a step in d, the gyro's reading less the yaw
//! rate of the wheels, beside a constant, warm-up and errors of scale (X). It only proposes a time: the comparison of
//! effects weighs the step itself, in the filter.

use crate::gap::drive::record::Record;
use crate::math::registers::free_upper_halves;
use faer::linalg::solvers::Solve;
use faer::{Mat, Side};

/// Columns of X: 1, warm-up, ω, |ω|, v².
const COLUMNS: usize = 5;
/// Relative size of the ridge that makes G regular.
const RIDGE: f64 = 1e-9;

/// Time of a bias step in each drive, s since that drive began; none for a drive without one, and for drives beyond the
/// last.
pub(crate) type Onsets = Vec<Option<f64>>;

/// [`of`] each drive.
#[must_use]
pub(crate) fn of_each(record: &Record) -> Onsets {
    record.apart().map(|drive| of(&drive)).collect()
}

/// The times of `known`, and those of `may` for drives where `known` has none.
#[must_use]
pub(crate) fn or(known: Onsets, may: &[Option<f64>]) -> Onsets {
    let count = known.len().max(may.len());
    let at = |onsets: &[Option<f64>], d: usize| onsets.get(d).copied().flatten();
    (0..count).map(|d| at(&known, d).or(at(may, d))).collect()
}

/// Time of the most likely step of the gyro's bias in a single drive, s since it began; none without a gyro.
#[must_use]
pub(crate) fn of(record: &Record) -> Option<f64> {
    let gyro = record.gyro_rad_s.as_ref()?;
    let warm_up = &record.belief.warm_up;
    let row = |k: usize| {
        let [speed, rate] = record.rolling(k);
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
    free_upper_halves();
    let (mut sum, mut after, mut count) = (0.0, [0.0; COLUMNS], 0.0);
    let mut best = (0.0, None);
    for (k, d, x) in rows.iter().rev() {
        sum += d - (0..COLUMNS).map(|i| x[i] * fitted[(i, 0)]).sum::<f64>();
        count += 1.0;
        after.iter_mut().zip(x).for_each(|(a, x)| *a += x);
        let known: f64 = (0..COLUMNS * COLUMNS)
            .map(|ij| after[ij / COLUMNS] * inverse[(ij / COLUMNS, ij % COLUMNS)] * after[ij % COLUMNS])
            .sum();
        // a step at the very beginning or end has no rows on one side to tell it by
        let left = count - known;
        if left > 1.0 && sum * sum / left > best.0 {
            best = (sum * sum / left, Some(record.times_s[*k] - record.times_s[0]));
        }
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Config;
    use crate::math::random::Stream;
    use crate::signal::{Log, TimeAxis, names};

    const ROBOT: &str = "schema = 1\nkind = \"driving\"\nsample_time_s = 0.01\n[gyro]\nc1_rad_s = 2.9e-3\nc2_rad_s = -4.7e-3\n\
        time_constant_s = 181.0\nangle_random_walk_rad_sqrt_s = 1e-4\n[vehicle]\nmass_kg = 17.1\nyaw_inertia_kg_m2 = 0.61\n\
        half_track_m = 0.25\nwheel_radius_m = 0.1\nwheel_inertia_kg_m2 = 0.0011\nviscous_friction_n_m_s = 0.0005\n\
        torque_noise_n_m_sqrt_s = 0.0002\n[encoder]\nspeed_noise_std_rad_s = 1e-3\n";

    /// A weaving drive whose gyro has a gain, a bias and a step of `step` standard deviations at row 1777 of 4000.
    fn record(step: f64, with_gyro: bool) -> Record {
        let s = &mut Stream::new(3, 1);
        let (len, std) = (4000, 1e-3);
        let mut log = Log::new("test", TimeAxis::Uniform { start_s: 0.0, step_s: 0.01, len });
        let rate: Vec<f64> = (0..len).map(|k| 0.6 * (0.011 * k as f64).sin()).collect();
        for (name, side) in [(names::WHEEL_LEFT, -1.0), (names::WHEEL_RIGHT, 1.0)] {
            let wheel = rate.iter().map(|w| (0.5 + side * 0.25 * w) / 0.1 + 1e-3 * s.normal());
            log.push(name, wheel.collect()).unwrap();
        }
        if with_gyro {
            let biased = |k: usize| 1.02 * rate[k] + 0.004 + if k >= 1777 { step * std } else { 0.0 };
            log.push(names::GYRO_Z, (0..len).map(|k| biased(k) + std * s.normal()).collect()).unwrap();
        }
        Record::new(&Config::parse(ROBOT, "robot.toml").unwrap(), &log, 0.0).unwrap()
    }

    #[test]
    fn a_step_is_placed_to_within_what_its_size_allows() {
        for (step, rows) in [(8.0, 1.0), (2.0, 6.0), (0.5, 90.0)] {
            // the likelihood of a place n rows off is exp(-n step²/2): 12 nats for the noise of both sides
            let found = of(&record(step, true)).unwrap();
            assert!((found / 0.01 - 1777.0).abs() <= rows, "{step}: {found}");
        }
    }

    #[test]
    fn without_a_gyro_there_is_none() {
        assert_eq!(of(&record(1.0, false)), None);
    }
}
