//! q_k = q r_c(k):   diffusion of v and ω in row k, c the class of the row by how much they change around it
//!
//! A robot whose torques were not logged mostly drives evenly, and now and then starts, stops or turns. One diffusion
//! for both is too small for the latter and far too large for the former. In even motion the filter then trusts each
//! reading too much, innovations are correlated with the one before, and functions that bend near zero seem to follow
//! them. So each class of rows has a diffusion of its own. The class is that of the slope of the readings around a row,
//! relative to noise: an input like torques, the same before and after an effect is added. The ratios of the classes
//! are the most likely ones of a random walk with one state; their common size is estimated with the model.

use crate::gap::drive::ekf::noise::{CLASSES, Channel, EVEN, Noise, Ratios};
use crate::gap::drive::ekf::slopes::Slopes;
use crate::gap::drive::record::Record;
use crate::math::robust::{SECOND_DIFFERENCE, second_difference_std};
use std::ops::Range;

/// Readings on either side of a row whose means are compared.
const BESIDE: usize = 5;
/// Squares of a slope, in variances by noise alone, at which the next class begins.
const BEGINS: [f64; CLASSES - 1] = [4.0, 40.0, 400.0, 4000.0];
/// The first class in which an acceleration is significant, and may last.
const LASTS: u8 = 2;
/// Factors of the search for diffusions, and rounds of each.
const FACTORS: [f64; 4] = [30.0, 6.0, 2.4, 1.5];
const ROUNDS: usize = 3;
/// Shares of an acceleration that last, of which the more likely one starts the search.
const LASTING: [f64; 2] = [0.0, 0.9];

/// Class of each row, for v and for ω; empty where torques tell how the robot moves.
#[derive(Debug, Clone, Default)]
pub(crate) struct Classes([Vec<u8>; 2]);

impl Classes {
    /// Classes of the rows of `record`.
    #[must_use]
    pub(crate) fn of(record: &Record) -> Self {
        if record.torques_n_m.is_some() {
            return Self::default();
        }
        let mut classes = [0, 1].map(|_| vec![0; record.len()]);
        for rows in record.drives() {
            for (own, sources) in classes.iter_mut().zip(sources(record, &rows)) {
                sources.iter().for_each(|source| source.classify(&mut own[rows.clone()], rows.start));
            }
        }
        Self(classes)
    }

    /// Ratios of the diffusions of v and ω in row `k`.
    #[must_use]
    pub(super) fn ratios(&self, ratios: &Ratios, k: usize) -> [f64; 2] {
        [0, 1].map(|i| self.0[i].get(k).map_or(1.0, |class| ratios[i][usize::from(*class)]))
    }

    /// Whether accelerations of v and ω of row `k` may last: where rows have classes, only significant ones.
    #[must_use]
    pub(crate) fn lasts(&self, ratios: &Ratios, k: usize) -> [bool; 2] {
        let even = *ratios == EVEN;
        [0, 1].map(|i| even || self.0[i].get(k).is_none_or(|class| *class >= LASTS))
    }

    /// Those accelerations, zero where they may not.
    #[must_use]
    pub(crate) fn lasting(&self, ratios: &Ratios, accelerations: [f64; 2], k: usize) -> [f64; 2] {
        let lasts = self.lasts(ratios, k);
        [0, 1].map(|i| if lasts[i] { accelerations[i] } else { 0.0 })
    }
}

/// Readings of v or ω by one instrument.
pub(super) struct Source {
    channel: Channel,
    pub(super) rows: Vec<usize>,
    pub(super) values: Vec<f64>,
    /// Stated standard deviation of the white noise of a value
    std: f64,
}

/// Sources of v and of ω in these rows, the best one first.
pub(super) fn sources(record: &Record, rows: &Range<usize>) -> [Vec<Source>; 2] {
    let b = &record.belief;
    let [rl, rr] = b.robot.radius_m;
    let std = 0.5 * rl.hypot(rr) * b.wheel_std_rad_s;
    let wheels = |mode: usize, std: f64| {
        let there: Vec<usize> = rows.clone().filter(|k| record.rolling(*k)[mode].is_finite()).collect();
        let values = there.iter().map(|k| record.rolling(*k)[mode]).collect();
        Source { channel: Channel::WheelLeft, values, rows: there, std }
    };
    let (speed, turning) = (wheels(0, std), wheels(1, std / b.robot.half_track_m));
    let gyro = record.gyro_rad_s.as_ref().map(|gyro| {
        let there: Vec<usize> = rows.clone().filter(|k| gyro[*k].is_finite()).collect();
        let rate = |k: &usize| gyro[*k] - b.warm_up.error_rad_s(record.since_power_on_s[*k]);
        let values = there.iter().map(rate).collect();
        Source { channel: Channel::Gyro, values, rows: there, std: b.gyro_std_rad_s }
    });
    [vec![speed], gyro.into_iter().chain([turning]).filter(|s| s.values.len() > 2 * BESIDE).collect()]
}

impl Source {
    /// Raises the classes of rows, the first of which is `first`, by the slopes of this source.
    fn classify(&self, classes: &mut [u8], first: usize) {
        let n = self.values.len();
        if n < 2 * BESIDE {
            return;
        }
        let mean = |range: Range<usize>| self.values[range].iter().sum::<f64>() / BESIDE as f64;
        // vibration makes a moving gyro noisier than its data sheet: the actual scatter from reading to reading then
        // counts
        let std = self.std.max(second_difference_std([self.values.as_slice()]) / SECOND_DIFFERENCE.sqrt());
        let noise = 2.0 * std * std / BESIDE as f64;
        let class = |j: usize| {
            let at = j.clamp(BESIDE, n - BESIDE);
            let slope = mean(at..at + BESIDE) - mean(at - BESIDE..at);
            BEGINS.iter().take_while(|begin| slope * slope > *begin * noise).count() as u8
        };
        for j in 0..n {
            // rows between two readings have the class of these
            let to = self.rows.get(j + 1).map_or(classes.len(), |next| next - first);
            let class = class(j);
            classes[self.rows[j] - first..to].iter_mut().for_each(|own| *own = (*own).max(class));
        }
    }
}

/// A random walk with one state, read by one instrument.
struct Walk {
    /// Time from the reading before, s, class of the step, and the reading; the first of a drive begins anew.
    steps: Vec<(f64, u8, f64)>,
    variance: f64,
}

impl Walk {
    /// ln p of the readings where classes diffuse with `q`, and accelerations last with the share `lasting`.
    fn ln_likelihood(&self, q: &[f64; CLASSES], lasting: f64) -> f64 {
        let (mut x, mut p, mut sum) = (0.0, 0.0, 0.0);
        let mut slope = 0.0;
        for (dt, class, value) in &self.steps {
            if dt.is_nan() {
                (x, p, slope) = (*value, self.variance, 0.0);
                continue;
            }
            let lasts = if *class >= LASTS { lasting * slope * dt } else { 0.0 };
            let before = x;
            x += lasts;
            p += q[usize::from(*class)] * dt;
            let s = p + self.variance;
            let nu = value - x;
            sum -= 0.5 * (nu * nu / s + s.ln());
            x += p / s * nu;
            p *= self.variance / s;
            // over as long as the filter compares speeds
            let share = (dt / Slopes::OVER_S).min(1.0);
            slope += share * ((x - before) / dt - slope);
        }
        sum
    }

    /// The most likely diffusions from `q` on, in the unit of the readings squared over s, and ln p.
    fn climb(&self, mut q: [f64; CLASSES], lasting: f64, bounds: &Range<f64>) -> ([f64; CLASSES], f64) {
        let there: Vec<usize> = (0..CLASSES).filter(|c| self.steps.iter().any(|s| usize::from(s.1) == *c)).collect();
        let mut best = self.ln_likelihood(&q, lasting);
        for factor in FACTORS {
            for _ in 0..ROUNDS {
                let before = best;
                for class in &there {
                    for by in [factor, 1.0 / factor] {
                        let mut next = q;
                        next[*class] = (next[*class] * by).clamp(bounds.start, bounds.end);
                        let ln = self.ln_likelihood(&next, lasting);
                        if ln > best {
                            (best, q) = (ln, next);
                        }
                    }
                }
                if best <= before {
                    break;
                }
            }
        }
        (q, best)
    }
}

/// Diffusions of v (m²/s³) and ω (rad²/s³) averaged over time, ratios of the classes, and the share of an acceleration
/// that lasts, under the noise of wheels and gyro in `noise`.
#[must_use]
pub(crate) fn likely(record: &Record, noise: &Noise, bounds: &Range<f64>) -> ([f64; 2], Ratios, f64) {
    let classes = Classes::of(record);
    let walk = |mode: usize| {
        let (mut steps, mut variance) = (Vec::new(), f64::NAN);
        for rows in record.drives() {
            let [speed, turning] = sources(record, &rows);
            let of_mode = if mode == 0 { speed } else { turning };
            let Some(Source { channel, rows, values, std }) = of_mode.into_iter().next() else { continue };
            let stated = match channel {
                Channel::Gyro => record.belief.gyro_std_rad_s,
                _ => record.belief.wheel_std_rad_s,
            };
            variance = noise.reading[channel as usize] * (std / stated).powi(2);
            let mut last: Option<usize> = None;
            for (k, value) in rows.into_iter().zip(values) {
                let step = last.map_or((f64::NAN, 0), |l| (record.times_s[k] - record.times_s[l], classes.0[mode][l]));
                steps.push((step.0, step.1, value));
                last = Some(k);
            }
        }
        Walk { steps, variance }
    };
    let modes = [0, 1].map(|mode| {
        let walk = walk(mode);
        let begin = std::array::from_fn(|class| (1e-3 * BEGINS[class.max(1) - 1] * walk.variance).max(bounds.start));
        LASTING.map(|lasting| walk.climb(begin, lasting, bounds)).map(|(q, ln)| {
            let spent =
                |class: usize| walk.steps.iter().filter(|s| usize::from(s.1) == class && s.0 > 0.0).map(|s| s.0).sum();
            let times: [f64; CLASSES] = std::array::from_fn(spent);
            let all: f64 = times.iter().sum();
            let mean = q.iter().zip(times).map(|(q, t)| q * t).sum::<f64>() / all.max(f64::MIN_POSITIVE);
            (mean.clamp(bounds.start, bounds.end), q, ln)
        })
    });
    let best = if modes[0][1].2 + modes[1][1].2 > modes[0][0].2 + modes[1][0].2 { 1 } else { 0 };
    let of = modes.map(|mode| mode[best]);
    (of.map(|m| m.0), of.map(|m| m.1.map(|q| q / m.0)), LASTING[best])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::Library;
    use crate::effects::drive::registry;
    use crate::gap::drive::ekf::innovations::run;
    use crate::gap::drive::ekf::models::Models;
    use crate::gap::drive::ekf::noise::Process;
    use crate::gap::drive::model_selection::judge;
    use crate::gap::drive::options::Options;
    use crate::gap::drive::preprocess::clocks::tests::{robot, without};
    use crate::gap::selection::sets::Main;
    use crate::signal::names;
    use crate::simulate::{Course, Options as Simulated, drive_with};

    const BOUNDS: Range<f64> = 1e-9..1e4;

    /// A drive along a course, without the channels `lost`.
    fn along(course: Course, seed: u64, lost: &[&str]) -> Record {
        let mut config = robot();
        if let Some(vehicle) = &mut config.vehicle {
            vehicle.torque_noise_n_m_sqrt_s = 4e-4;
        }
        let log = drive_with(&config, course, 60.0, &Simulated::from(seed), &Library::new()).unwrap().log;
        Record::new(&config, &without(log, lost), 0.0).unwrap()
    }

    const TORQUES: [&str; 2] = [names::TORQUE_LEFT, names::TORQUE_RIGHT];

    #[test]
    fn even_motion_and_corners_have_classes_of_their_own() {
        let record = along(Course::Square, 3, &TORQUES);
        let noise = Noise::believed(&record, None);
        let (diffusion, agility, lasting) = likely(&record, &noise, &BOUNDS);
        assert!(agility[1][0] < 0.05 && agility[1][2] > 1.0, "{agility:?}");
        // beside one diffusion for all rows, each at its most likely
        let models = Models::plain(&record);
        let weigh = |process: Process| run(&record, &models, &Noise { process, ..noise }, &[], |_| {}).ln_likelihood();
        let one = (-24..=4).map(|i| {
            let q = 2f64.powi(i);
            weigh(Process { diffusion: [q, q], lasting: 0.9, ..Process::default() })
        });
        let gained = weigh(Process { diffusion, agility, lasting, ..Process::default() })
            - one.fold(f64::NEG_INFINITY, f64::max);
        assert!(gained > 0.3 * record.len() as f64, "{gained}");
        // torques tell how a robot moves
        let forced = Classes::of(&along(Course::Square, 3, &[]));
        assert_eq!(forced.ratios(&agility, 5), [1.0; 2]);
    }

    /// With one diffusion for all rows, every one of these had a gain that differs between left and right, or an
    /// unknown cause.
    #[test]
    #[ignore = "battery: some seconds"]
    fn battery_a_drive_around_corners_lacks_nothing() {
        let none = |course, lost: &[&str]| {
            let findings = judge(&along(course, 5, lost), registry(), &Options::default()).findings;
            assert_eq!(findings.mains()[0].0, Main::None, "{course:?} without {lost:?}: {:?}", findings.mains());
        };
        let blind = [&TORQUES[..], &[names::X, names::Y, names::HEADING]].concat();
        for course in [Course::Square, Course::Umbmark] {
            none(course, &TORQUES);
            none(course, &blind);
        }
    }
}
