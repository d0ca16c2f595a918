//! q̂, σ̂ = argmax ln p(z | q, φ, σ):   a_{k+1} = φ a_k,  v and ω diffuse with q,  wheels and gyro read with σ
//!
//! Motion of a robot whose torques were not logged, and the noise of its sensors. At the maximum the likelihood does
//! not depend, to first order, on a common scale of all speeds. That is needed: away from the maximum such a scale has
//! evidence of its own, which wheels and gyro alone do not contradict, nor does a pose where free forms stand between
//! it and the speeds.
//!
//! Where σ is stated too small, q grows in its place, readings of the same yaw rate are no longer correlated, and what
//! a track or a gain explains is lost. So σ is estimated with q where that gains more than it costs; otherwise it is as
//! stated. Accelerations in bursts are no Gaussian diffusion, and noise is not to make up for that: whatever the robot
//! does, second differences of readings have a variance of 6 σ² and what torque noise adds. Where they agree with the
//! stated σ, that is kept.

use crate::gap::drive::ekf::agility;
use crate::gap::drive::ekf::innovations::run;
use crate::gap::drive::ekf::models::Models;
use crate::gap::drive::ekf::noise::{Channel, EVEN, Noise, Process};
use crate::gap::drive::record::{Belief, Record};
use crate::math::robust::{SECOND_DIFFERENCE, second_difference_std};
use crate::model::drive::DriveModel;
use rayon::prelude::*;
use std::ops::Range;

/// Values of the share of an acceleration that lasts from row to row.
const LASTING: [f64; 6] = [0.0, 0.5, 0.75, 0.9, 0.95, 1.0];
/// Start of the search with one diffusion for all rows.
const BEGIN: Process = Process {
    diffusion: [0.001, 0.002],
    agility: EVEN,
    unknown_input: [0.0; 2],
    lasting: 0.9,
    ripple: 0.0,
    at_rims: 0.0,
};
/// Gain needed for a diffusion of each class of rows, nats a row. Classes chosen by the motion itself gain a hundredth
/// where all rows are alike; where motion is even but for corners they gain one and more.
const CLASSES_WORTH: f64 = 0.1;
/// Factors of the search: the first where nothing is known, the first where something is, and the last.
const FAR: f64 = 8.0;
const NEAR: f64 = 2.8;
const LAST_FACTOR: f64 = 1.3;
/// Rounds of parabolic refinement; each takes the error of the one before to the third power.
const ROUNDS: usize = 2;
/// Range of diffusions that are considered, m²/s³ and rad²/s³.
const SENSIBLE: Range<f64> = 1e-9..1e4;
/// First factor on the variance towards louder noise, and the gain in nats from which on it is pursued.
const FIRST: f64 = 2.0;
const WORTH: f64 = 3.0;
/// ln prior odds of a noise that is not as large as stated.
const LN_OTHER: f64 = -7.0;
/// Standard deviation of a variance by the median size of n second differences of white noise, relative and times √n:
/// 2.3 for independent ones, more as these overlap.
pub(crate) const BY_MEDIAN: f64 = 3.0;
/// Standard deviations by which the scatter of readings must exceed the stated noise before louder noise is considered.
pub(crate) const BEYOND_CHANCE: f64 = 4.0;
/// ln of the ratio of standard deviations from which on louder noise matters and is reported: smooth motion adds as
/// much to second differences.
pub(crate) const LOUDER: f64 = 0.1;

/// A quantity that is varied: diffusion of v or ω (m²/s³, rad²/s³), or the variance of wheels or gyro (rad²/s²).
#[derive(Debug, Clone, Copy, PartialEq)]
enum Varied {
    Diffusion(usize),
    Wheels,
    Gyro,
}

impl Varied {
    const MOTION: [Self; 2] = [Self::Diffusion(0), Self::Diffusion(1)];

    fn places(self) -> Range<usize> {
        match self {
            Self::Diffusion(_) => 0..0,
            Self::Wheels => Channel::WheelLeft as usize..Channel::WheelRight as usize + 1,
            Self::Gyro => Channel::Gyro as usize..Channel::Gyro as usize + 1,
        }
    }

    fn times(self, from: &Noise, factor: f64) -> Noise {
        let mut next = *from;
        match self {
            Self::Diffusion(i) => next.process.diffusion[i] *= factor,
            Self::Wheels | Self::Gyro => {
                next.reading[self.places()].iter_mut().for_each(|variance| *variance *= factor)
            }
        }
        next
    }

    /// Readings of left and right wheel, or of the gyro, rad/s; NaN where a row has none.
    fn read(self, record: &Record) -> Vec<&Vec<f64>> {
        match self {
            Self::Diffusion(_) => Vec::new(),
            Self::Wheels => record.wheels_rad_s.iter().collect(),
            Self::Gyro => record.gyro_rad_s.iter().collect(),
        }
    }

    /// Variance of the change of the readings from row to row by the stated torque noise, rad²/s².
    fn shaken(self, record: &Record, model: &DriveModel) -> f64 {
        let Belief { robot, torque_noise_n_m_sqrt_s, .. } = &record.belief;
        let [ahead, about] = model.by_torque();
        let by = |torque: usize| match self {
            Self::Gyro => about[torque],
            _ => (ahead[torque] + robot.half_track_m * about[torque]) / robot.radius_m[1],
        };
        torque_noise_n_m_sqrt_s.powi(2) * record.step_s * (0..2).map(|torque| by(torque).powi(2)).sum::<f64>()
    }

    /// Number of readings, and the variance of their white noise from second differences, less the share of the stated
    /// torque noise, rad²/s²: an upper limit, reached where the robot accelerates evenly.
    fn scatter(self, record: &Record, models: &Models) -> (usize, f64) {
        let finite = |values: &Vec<f64>| values.iter().copied().filter(|v| v.is_finite()).collect::<Vec<f64>>();
        let there: Vec<Vec<f64>> = self.read(record).into_iter().map(finite).collect();
        let count = there.iter().map(Vec::len).sum();
        // two changes of speed and three readings
        let bend = second_difference_std(there.iter().map(Vec::as_slice));
        // under the heaviest load, where torques shake least
        let shaken = models.of_loads().map(|model| self.shaken(record, model)).fold(f64::INFINITY, f64::min);
        let white = bend.powi(2) - 2.0 * shaken;
        (count, white.max(0.0) / SECOND_DIFFERENCE)
    }
}

/// Whether the noise of wheels and gyro is as stated.
pub(crate) fn is_as_stated(record: &Record, noise: &Noise) -> bool {
    noise.reading[..3] == stated(record, noise).reading[..3]
}

fn stated(record: &Record, noise: &Noise) -> Noise {
    Noise::believed(record, (noise.wheel_lsb_rad_s > 0.0).then_some(noise.wheel_lsb_rad_s))
}

/// `noise` with the most likely diffusions under `models`; the variances of wheels and gyro are as stated, or the most
/// likely ones where these gain more than they cost.
#[must_use]
pub(crate) fn likely(record: &Record, models: &Models, noise: &Noise) -> Noise {
    let stated = stated(record, noise);
    let known = noise.process.diffusion.iter().all(|q| *q > 0.0);
    let mut begin = *noise;
    let mut levels = vec![Varied::Wheels];
    levels.extend(record.gyro_rad_s.as_ref().map(|_| Varied::Gyro));
    levels.iter().flat_map(|v| v.places()).for_each(|c| begin.reading[c] = stated.reading[c]);
    levels.retain(|level| {
        let (count, variance) = level.scatter(record, models);
        let chance = 1.0 + BEYOND_CHANCE * BY_MEDIAN / (count.max(1) as f64).sqrt();
        let matters = chance * (2.0 * LOUDER).exp();
        level.places().any(|c| variance > matters * stated.reading[c])
    });
    let climb = Climb { record, models, least: begin.reading };
    // one diffusion for all rows, or one for each class of rows: whichever gains more
    let best = |from: Noise, varied: &[Varied]| {
        if known {
            return climb.from(from, NEAR, varied);
        }
        let one = Process { ripple: noise.process.ripple, unknown_input: record.belief.unknown_input, ..BEGIN };
        let (diffusion, agility, lasting) = agility::likely(record, &from, &SENSIBLE);
        let [one, classes] =
            [one, Process { diffusion, agility, lasting, ..one }].map(|process| Noise { process, ..from });
        let (one, classes) = rayon::join(|| climb.from(one, FAR, varied), || climb.from(classes, NEAR, varied));
        if classes.0 > one.0 + CLASSES_WORTH * record.len() as f64 { classes } else { one }
    };
    let as_stated = best(begin, &Varied::MOTION);
    let first: Vec<f64> = levels.par_iter().map(|v| climb.weigh(&v.times(&as_stated.1, FIRST))).collect();
    if first.iter().all(|ln| *ln <= as_stated.0 + WORTH) {
        return as_stated.1;
    }
    // one of them may be as stated, and the motion differs with each choice: every choice has a maximum of its own
    let loud = |some: &[Varied]| {
        let (mut from, mut cost) = (begin, 0.0);
        for level in some {
            let (count, variance) = level.scatter(record, models);
            from.reading[level.places()].iter_mut().for_each(|own| *own = own.max(variance));
            cost += 0.5 * (count as f64).ln() - LN_OTHER;
        }
        let (ln, noise) = best(from, &[&Varied::MOTION[..], some].concat());
        (ln - cost, noise)
    };
    let mut some: Vec<&[Varied]> = levels.chunks(1).collect();
    some.push(&levels);
    let other: Vec<(f64, Noise)> = some.par_iter().map(|some| loud(some)).collect();
    other.into_iter().fold(as_stated, |a, b| if b.0 > a.0 { b } else { a }).1
}

struct Climb<'a> {
    record: &'a Record,
    models: &'a Models,
    /// Stated variances, the lower limits: below them noise and motion cannot be told apart
    least: [f64; 6],
}

impl Climb<'_> {
    /// ln p; -∞ where the filter diverges.
    fn weigh(&self, noise: &Noise) -> f64 {
        // with one, nothing is left of the motion to be compared
        let process = Process { unknown_input: [0.0; 2], ..noise.process };
        let ln = run(self.record, self.models, &Noise { process, ..*noise }, &[], |_| {}).ln_likelihood();
        if ln.is_finite() { ln } else { f64::NEG_INFINITY }
    }

    /// ln p and the noise at its maximum over the quantities `varied`; the first steps are by `first_factor`.
    fn from(&self, begin: Noise, first_factor: f64, varied: &[Varied]) -> (f64, Noise) {
        let two = |[a, b]: [Noise; 2]| rayon::join(|| self.weigh(&a), || self.weigh(&b));
        let sensible = |u: &Noise| {
            let louder = u.reading.iter().zip(&self.least).all(|(own, least)| own >= least);
            louder && u.process.diffusion.iter().all(|q| SENSIBLE.contains(q))
        };
        let mut here = begin;
        let mut best = self.weigh(&here);
        let mut factor = first_factor;
        while factor > LAST_FACTOR {
            let mut moved = false;
            for one in varied {
                let [up, down] = [factor, 1.0 / factor].map(|by| one.times(&here, by));
                let (above, below) = two([up, down]);
                let from = here;
                if above > best && sensible(&up) {
                    (best, here, moved) = (above, up, true);
                }
                // from the result of the step up
                let back = one.times(&here, 1.0 / factor);
                let below = if here == from { below } else { self.weigh(&back) };
                if below > best && sensible(&back) {
                    (best, here, moved) = (below, back, true);
                }
            }
            if !moved {
                factor = factor.sqrt();
            }
        }
        let lasting = LASTING.map(|lasting| Noise { process: Process { lasting, ..here.process }, ..here });
        let weights: Vec<f64> = lasting.par_iter().map(|next| self.weigh(next)).collect();
        for (next, weight) in lasting.into_iter().zip(weights) {
            if weight > best {
                (best, here) = (weight, next);
            }
        }
        let mut step = factor.ln();
        for _ in 0..ROUNDS {
            for one in varied {
                let (below, above) = two([-step, step].map(|s| one.times(&here, s.exp())));
                let bend = 2.0 * best - below - above;
                if bend > 0.0 {
                    let by = (0.5 * step * (above - below) / bend).clamp(-step, step);
                    let next = one.times(&here, by.exp());
                    let weight = self.weigh(&next);
                    if weight > best && sensible(&next) {
                        (best, here) = (weight, next);
                    }
                }
            }
            step *= 0.5;
        }
        (best, here)
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::bias::WarmUp;
    use crate::math::random::Stream;
    use crate::model::drive::Robot;

    const ROWS: usize = 4000;
    const STEP_S: f64 = 0.01;

    /// Nominal parameters of a small robot without torque noise.
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
            unknown_input: [0.0; 2],
        }
    }

    /// A robot whose speeds are random walks with these diffusions.
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
            loads_kg: vec![0.0],
            sources: vec!["drive".into()],
            step_s,
            torques_n_m: None,
            gyro_rad_s: Some(gyro_rad_s),
            wheels_rad_s,
            pose: None,
            temperature_c: None,
            belief,
            wheels_were_set: false,
            given: Default::default(),
            notes: Vec::new(),
        }
    }

    #[test]
    fn noise_that_is_louder_than_stated_is_found_with_the_diffusions() {
        let truth = [0.02, 0.3];
        let mut record = walking(truth);
        let draw = &mut Stream::new(5, 8);
        let louder = 8.0 * record.belief.gyro_std_rad_s;
        record.gyro_rad_s.iter_mut().flatten().for_each(|g| *g += louder * draw.normal());
        let models = Models::alone(DriveModel::new(record.belief.robot, Vec::new()), Vec::new());
        let noise = Noise::believed(&record, None);
        let found = likely(&record, &models, &noise);
        assert!(!is_as_stated(&record, &found) && is_as_stated(&record, &noise));
        assert_eq!(found.reading[..2], noise.reading[..2], "the wheels are as stated");
        // ln σ² is known to √(2/n) from n readings of nothing else; motion that wheels read as well takes no more than
        // half of that
        let variance = louder.powi(2) + record.belief.gyro_std_rad_s.powi(2);
        assert!((found.reading[2] / variance).ln().abs() < 5.0 * (4.0 / ROWS as f64).sqrt(), "{found:?}");
        for (q, truth) in found.process.diffusion.iter().zip(truth) {
            assert!((q / truth).ln().abs() < 10.0 * (2.0 / ROWS as f64).sqrt(), "{found:?}");
        }
    }

    #[test]
    fn diffusions_are_found_at_the_maximum() {
        let truth = [0.02, 0.3];
        let record = walking(truth);
        let models = Models::alone(DriveModel::new(record.belief.robot, Vec::new()), Vec::new());
        let noise = Noise::believed(&record, None);
        let found = likely(&record, &models, &noise);
        assert_eq!(found.reading, noise.reading, "as large as stated");
        let found = found.process;
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
