//! ∫∫ w dt² given ∫ w dt ~ N(½ Δt ∫ w dt, ρ q Δt³/12):  ρ = 0 where the torque noise w is constant over a step Δt, 1
//! where it is white
//!
//! The simulator states the standard deviation of torque noise over a step, which does not tell how it changes within
//! one. A real motor's noise is white there too, so heading and position depart from what the speeds at both ends of
//! the step imply. To a filter without it this looks like an angle random walk of √q Δt/√12 between gyro and pose, and
//! like a slow walk of the gyro's bias. The log tells the share ρ.

use crate::gap::drive::ekf::noise::{Noise, Process};
use crate::gap::drive::record::Record;
use crate::gap::drive::regressors::candidates::Candidates;
use crate::gap::selection::prior::Prior;
use crate::math::brent;
use rayon::prelude::*;

/// Values of ρ, the share of the torque noise that changes within a step, that are compared.
const SHARES: [f64; 3] = [0.0, 0.5, 1.0];
/// Gain in ln likelihood needed to change the share, nats: by chance another one gains about one, and the simulator's
/// share is the hypothesis to be refuted.
pub(crate) const BETTER: f64 = 3.0;

/// The noise with the most likely share, `weigh` being ln likelihood; unchanged where no other gains enough, or without
/// a pose.
pub(crate) fn likely(record: &Record, noise: &Noise, weigh: impl Fn(&Noise) -> f64 + Sync) -> Noise {
    // only a pose tells the motion between two rows
    if record.pose.is_none() {
        return *noise;
    }
    let all = record.belief.torque_noise_n_m_sqrt_s.powi(2);
    let mut tried: Vec<Noise> = vec![*noise];
    for share in SHARES {
        let mut other = *noise;
        other.process.ripple = share * all;
        if other != *noise {
            tried.push(other);
        }
    }
    let weights: Vec<f64> = tried.par_iter().map(&weigh).collect();
    let mut best = (weights[0] + BETTER, *noise);
    for (weight, other) in weights.into_iter().zip(tried).skip(1) {
        if weight > best.0 {
            best = (weight, other);
        }
    }
    best.1
}

/// [`likely`] before any effect is known: only nuisances, such as bias and mounting of the reference, are free.
pub(crate) fn before(record: &Record, noise: &Noise) -> Noise {
    let nothing = Candidates::new(record, &[], &Prior::of_drives(), false, &[]).only(|_| false);
    likely(record, noise, |noise| nothing.linearise(record, noise, &nothing.zero()).ln_weight(&[]))
}

/// Largest share of the torque noise at the rims, as a ratio of variances.
const MOST_AT_RIMS: f64 = 4.0;
/// Relative error of that share, and a share, that do not matter.
const SHARE_ERROR: f64 = 0.02;

/// The noise with the share of the torque noise that effects pass to the wheels' readings, `weigh` being ln likelihood, and
/// what it gains, nats; none where it does not gain [`BETTER`] and `form_nats`, which errors in the form of laws may bring.
pub(crate) fn at_rims(
    record: &Record,
    noise: &Noise,
    form_nats: f64,
    weigh: impl Fn(&Noise) -> f64,
) -> Option<(Noise, f64)> {
    let with = |share: f64| {
        let at_rims = share * record.belief.torque_noise_n_m_sqrt_s.powi(2);
        Noise { process: Process { at_rims, ..noise.process }, ..*noise }
    };
    let before = weigh(noise);
    // most drives show none: one look in place of a search
    if weigh(&with(SHARE_ERROR)) <= before {
        return None;
    }
    let share = brent::minimum(|share| -weigh(&with(share)), 0.0, MOST_AT_RIMS, SHARE_ERROR)?.x;
    let gained = weigh(&with(share)) - before;
    (gained > BETTER + form_nats).then(|| (with(share), gained))
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::gap::drive::ekf::innovations::run;
    use crate::gap::drive::ekf::models::Models;
    use crate::gap::drive::ekf::noise::Channel;
    use crate::gap::drive::preprocess::acceleration_model::tests::{belief, recorded};
    use crate::math::random::Stream;
    use crate::model::drive::{DriveModel, Moving};

    const ROWS: usize = 12_000;
    const STEP_S: f64 = 0.02;
    const TORQUE_NOISE: f64 = 0.01;

    /// A robot moved by torque noise alone, which is drawn anew in each of `parts` parts of a step. Sums over a part
    /// are exact.
    pub(in crate::gap::drive) fn shaken(parts: usize, seed: u64) -> Record {
        let mut belief = belief();
        belief.torque_noise_n_m_sqrt_s = TORQUE_NOISE;
        (belief.gyro_std_rad_s, belief.wheel_std_rad_s) = (1e-3, 1e-3);
        (belief.position_std_m, belief.heading_std_rad) = (1e-3, 5e-4);
        let draw = &mut Stream::new(seed, 3);
        let [ahead, about] = DriveModel::new(belief.robot, Vec::new()).by_torque();
        let (b, r) = (belief.robot.half_track_m, belief.robot.radius_m[0]);
        let h = STEP_S / parts as f64;
        let [mut x, mut y, mut heading, mut v, mut w] = [0.0f64; 5];
        let mut wheels = [Vec::new(), Vec::new()];
        let (mut gyro, mut pose) = (Vec::new(), [Vec::new(), Vec::new(), Vec::new()]);
        for k in 0..ROWS {
            wheels[0].push((v - b * w) / r + belief.wheel_std_rad_s * draw.normal());
            wheels[1].push((v + b * w) / r + belief.wheel_std_rad_s * draw.normal());
            gyro.push(w + belief.gyro_std_rad_s * draw.normal());
            let stds = [belief.position_std_m, belief.position_std_m, belief.heading_std_rad];
            for ((values, at), std) in pose.iter_mut().zip([x, y, heading]).zip(stds) {
                values.push(if k % 5 == 0 { at + std * draw.normal() } else { f64::NAN });
            }
            for _ in 0..parts {
                let torques = [0, 1].map(|_| TORQUE_NOISE / h.sqrt() * draw.normal());
                let [dv, dw] = [ahead, about].map(|by| h * (by[0] * torques[0] + by[1] * torques[1]));
                let (way, turn) = (h * (v + 0.5 * dv), h * (w + 0.5 * dw));
                let (sin, cos) = (heading + 0.5 * turn).sin_cos();
                (x, y, heading) = (x + way * cos, y + way * sin, heading + turn);
                (v, w) = (v + dv, w + dw);
            }
        }
        let mut record = recorded(belief, STEP_S, wheels, gyro);
        record.torques_n_m = Some([vec![0.0; ROWS], vec![0.0; ROWS]]);
        record.pose = Some(pose);
        record
    }

    /// Mean square of the whitened innovations of the heading, and how many there are.
    fn heading_nis(record: &Record, noise: &Noise) -> (f64, f64) {
        let models = Models::alone(DriveModel::new(record.belief.robot, Vec::new()), Vec::new());
        let (mut n, mut sum) = (0.0, 0.0);
        let _ = run(record, &models, noise, &[], |i| {
            if i.channel == Channel::Heading {
                (n, sum) = (n + 1.0, sum + i.white * i.white);
            }
        });
        (sum / n, n)
    }

    #[test]
    fn the_log_tells_whether_torques_change_within_a_step() {
        for (parts, share) in [(1, 0.0), (16, 1.0)] {
            let record = shaken(parts, 5);
            let found = before(&record, &Noise::believed(&record, None));
            assert_eq!(found.process.ripple, share * TORQUE_NOISE.powi(2), "{parts}");
            // six standard deviations of the mean of n squares of standard normal variables
            let (mean, n) = heading_nis(&record, &found);
            assert!((mean - 1.0).abs() < 6.0 * (2.0 / n).sqrt(), "{parts}: {mean}");
            // the other share is refuted
            let mut other = found;
            other.process.ripple = (1.0 - share) * TORQUE_NOISE.powi(2);
            let (mean, n) = heading_nis(&record, &other);
            assert!((mean - 1.0).abs() > 6.0 * (2.0 / n).sqrt(), "{parts}: {mean}");
        }
    }

    #[test]
    fn without_a_pose_nothing_tells_and_nothing_is_assumed() {
        let mut record = shaken(16, 6);
        record.pose = None;
        let noise = Noise::believed(&record, None);
        assert_eq!(before(&record, &noise), noise);
    }

    #[test]
    fn the_log_tells_how_much_torque_noise_shakes_wheels_that_slip() {
        use crate::effects::drive::{by_id, ids};
        let mut record = shaken(16, 7);
        let slip = by_id(ids::slip()).and_then(|e| e.change()).unwrap();
        let models = Models::alone(DriveModel::new(record.belief.robot, vec![slip.at(&[0.3, 0.0])]), Vec::new());
        let noise = before(&record, &Noise::believed(&record, None));
        let weigh = |record: &Record, noise: &Noise| run(record, &models, noise, &[], |_| {}).ln_likelihood();
        assert_eq!(at_rims(&record, &noise, 0.0, |noise| weigh(&record, noise)), None);
        const SHARE: f64 = 0.6;
        let draw = &mut Stream::new(9, 1);
        for k in 0..record.len() {
            let wheels = [0, 1].map(|i| record.wheels_rad_s[i][k]);
            let [speed_m_s, yaw_rate_rad_s] = record.belief.robot.speed_and_yaw_rate(wheels);
            let at = Moving { speed_m_s, yaw_rate_rad_s, ..Moving::default() };
            let variance = models.here.wheel_variance_by_torque_noise(&at);
            for (wheel, own) in record.wheels_rad_s.iter_mut().zip(variance) {
                wheel[k] += TORQUE_NOISE * (SHARE * own).sqrt() * draw.normal();
            }
        }
        assert_eq!(at_rims(&record, &noise, 1e6, |noise| weigh(&record, noise)), None);
        let (found, _) = at_rims(&record, &noise, 0.0, |noise| weigh(&record, noise)).unwrap();
        let share = found.process.at_rims / TORQUE_NOISE.powi(2);
        // six standard deviations of a variance from two wheels, and the tolerance of the search
        let bound = 6.0 * (1.0 / ROWS as f64).sqrt() + SHARE_ERROR;
        assert!((share / SHARE - 1.0).abs() < bound, "{share}");
    }
}
