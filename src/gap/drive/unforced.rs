//! q̂ = argmax ln p(z | q, φ):   a_{k+1} = φ a_k,  v and ω diffuse with q
//!
//! How a robot moves whose torques were not logged. At the maximum the likelihood does not care, to first order, whether all
//! speeds are a little larger. It must not: away from the maximum a common scale of all speeds has evidence of its own, which
//! wheels and gyro alone do not contradict, and a pose does not either where free forms stand between it and the speeds.

use super::pass::{Models, Noise, Process, run};
use super::record::Record;
use rayon::prelude::*;

/// Where the search begins.
const BEGIN: Process = Process { diffusion: [0.001, 0.002], lasting: 0.9, ripple: 0.0 };
/// Shares of an acceleration that may last from row to row.
const LASTING: [f64; 6] = [0.0, 0.5, 0.75, 0.9, 0.95, 1.0];
/// Factors on q by which the search goes: the first, and the smallest.
const FACTORS: [f64; 2] = [8.0, 1.3];
/// Rounds of parabolas; each takes the error of the one before to the third power.
const ROUNDS: usize = 2;
/// Diffusions within these are sensible, m²/s³ and rad²/s³.
const SENSIBLE: std::ops::Range<f64> = 1e-9..1e4;

/// The most likely, under `models`.
#[must_use]
pub(super) fn likely(record: &Record, models: &Models, noise: &Noise) -> Process {
    let weigh = |process: Process| run(record, models, &Noise { process, ..*noise }, &[], |_| {}).ln_likelihood();
    let two = |[a, b]: [Process; 2]| rayon::join(|| weigh(a), || weigh(b));
    let times = |from: Process, i: usize, factor: f64| {
        let mut next = from;
        next.diffusion[i] *= factor;
        next
    };
    let sensible = |u: &Process| u.diffusion.iter().all(|q| SENSIBLE.contains(q));
    let mut here = Process { ripple: noise.process.ripple, ..BEGIN };
    let mut best = weigh(here);
    let mut factor = FACTORS[0];
    while factor > FACTORS[1] {
        let mut moved = false;
        for i in 0..2 {
            let [up, down] = [factor, 1.0 / factor].map(|by| times(here, i, by));
            let (above, below) = two([up, down]);
            let from = here;
            if above > best && sensible(&up) {
                (best, here, moved) = (above, up, true);
            }
            // from where that has led
            let back = times(here, i, 1.0 / factor);
            let below = if here == from { below } else { weigh(back) };
            if below > best && sensible(&back) {
                (best, here, moved) = (below, back, true);
            }
        }
        if !moved {
            factor = factor.sqrt();
        }
    }
    let lasting = LASTING.map(|lasting| Process { lasting, ..here });
    let weights: Vec<f64> = lasting.par_iter().map(|next| weigh(*next)).collect();
    for (next, weight) in lasting.into_iter().zip(weights) {
        if weight > best {
            (best, here) = (weight, next);
        }
    }
    let mut step = factor.ln();
    for _ in 0..ROUNDS {
        for i in 0..2 {
            let (below, above) = two([-step, step].map(|s| times(here, i, s.exp())));
            let bend = 2.0 * best - below - above;
            if bend > 0.0 {
                let by = (0.5 * step * (above - below) / bend).clamp(-step, step);
                let next = times(here, i, by.exp());
                let weight = weigh(next);
                if weight > best && sensible(&next) {
                    (best, here) = (weight, next);
                }
            }
        }
        step *= 0.5;
    }
    here
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::bias::WarmUp;
    use crate::gap::drive::record::Belief;
    use crate::math::random::Stream;
    use crate::model::drive::{DriveModel, Robot};

    const ROWS: usize = 4000;
    const STEP_S: f64 = 0.01;

    /// What is believed of a small robot without noise of its torques.
    pub(in crate::gap::drive) fn belief() -> Belief {
        let robot = Robot::small();
        Belief {
            steering: None,
            robot,
            torque_noise_n_m_sqrt_s: 0.0,
            gyro_std_rad_s: 1e-3,
            wheel_std_rad_s: 0.01,
            position_std_m: 0.01,
            heading_std_rad: 0.01,
            lever_arm_std_m: 0.0,
            heading_offset_std_rad: 0.0,
            pose_delay_std_s: 0.0,
            warm_up: WarmUp { c1_rad_s: 0.0, c2_rad_s: 0.0, time_constant_s: 100.0 },
            turn_on_bias_std_rad_s: 1e-4,
            warm_up_relative_std: 0.0,
        }
    }

    /// A robot whose speeds walk with these diffusions, and its wheels.
    fn walking(diffusion: [f64; 2]) -> Record {
        let belief = belief();
        let draw = &mut Stream::new(3, 8);
        let mut speeds = [0.0; 2];
        let (mut wheels, mut gyro) = ([Vec::new(), Vec::new()], Vec::new());
        for _ in 0..ROWS {
            let [v, w] = speeds;
            for (i, sign) in [-1.0, 1.0].into_iter().enumerate() {
                wheels[i].push((v + sign * 0.25 * w) / 0.1 + 0.01 * draw.normal());
            }
            gyro.push(w + 1e-3 * draw.normal());
            speeds.iter_mut().zip(diffusion).for_each(|(s, q)| *s += (q * STEP_S).sqrt() * draw.normal());
        }
        recorded(belief, STEP_S, wheels, gyro)
    }

    /// A drive without torques and pose, its rows `step_s` apart.
    pub(in crate::gap::drive) fn recorded(
        belief: Belief,
        step_s: f64,
        wheels_rad_s: [Vec<f64>; 2],
        gyro_rad_s: Vec<f64>,
    ) -> Record {
        let times_s: Vec<f64> = (0..gyro_rad_s.len()).map(|k| k as f64 * step_s).collect();
        Record {
            since_power_on_s: times_s.clone(),
            times_s,
            starts: vec![0],
            sources: vec!["drive".into()],
            step_s,
            torques_n_m: None,
            gyro_rad_s: Some(gyro_rad_s),
            wheels_rad_s,
            pose: None,
            temperature_c: None,
            belief,
            wheels_were_set: false,
            notes: Vec::new(),
        }
    }

    #[test]
    fn diffusions_are_found_at_the_maximum() {
        let truth = [0.02, 0.3];
        let record = walking(truth);
        let models = Models { here: DriveModel::new(record.belief.robot, Vec::new()), beside: Vec::new() };
        let noise = Noise::believed(&record, None);
        let found = likely(&record, &models, &noise);
        assert!(found.lasting.abs() < 1e-12, "{found:?}");
        for (q, truth) in found.diffusion.iter().zip(truth) {
            // ln q is known to √(2/n) from n rows: five standard deviations
            assert!((q / truth).ln().abs() < 5.0 * (2.0 / ROWS as f64).sqrt(), "{found:?}");
        }
        // at the maximum a change by a tenth of that costs next to nothing, and never gains
        let weigh = |u: Process| run(&record, &models, &Noise { process: u, ..noise }, &[], |_| {}).ln_likelihood();
        for i in 0..2 {
            for factor in [0.97, 1.03] {
                let mut beside = found;
                beside.diffusion[i] *= factor;
                assert!(weigh(beside) < weigh(found), "{i} {factor}");
            }
        }
    }
}
