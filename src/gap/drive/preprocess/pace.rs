//! ω̄_k = 1/h ∫ ω dt from t_k - h/2 to t_k + h/2:   the gyro averaged over the interval h of wheels that are read
//! seldom
//!
//! Without torques nothing tells how the robot moves between two readings of its wheels, and shaking of the gyro there
//! turns no wheel. Compared reading by reading that is an error in the variable that a track or a gain multiplies, and
//! draws both towards zero; without shaking, each reading tells more. The mean over the wheels' interval is what both
//! turn by; its white noise has the variance σ² Δt/h. Where the wheels tell the speed of the moment, such a mean is
//! less than they read wherever the turning is brisk, and a gain makes up for it: h is then shorter. Of a few h the one
//! is taken about whose means, their white noise aside, the readings of the wheels scatter least.

use super::acceleration_model::{BEYOND_CHANCE, BY_MEDIAN, LOUDER};
use super::offset::{Integral, fitted};
use crate::gap::drive::record::{Belief, FEWEST_ROWS, Record};
use crate::math::robust::{mad_std, median};

/// Readings of the gyro to one of the wheels from which on it is averaged.
const SELDOM: f64 = 2.5;

impl Record {
    /// Each drive with rows at the wheels' rate, where these are read much more seldom than the gyro and no torques
    /// tell the motion between. Clocks are to be set before: so few rows tell no lag.
    #[must_use]
    pub(crate) fn at_wheels(self) -> Self {
        let mut paced = self.by_drive(|_, drive| at_wheels(drive, FEWEST_ROWS).unwrap_or_else(|| drive.clone()));
        if paced.len() < self.len() {
            paced.notes.push(format!(
                "The wheels are read every {:.3} s, the gyro every {:.3} s: without torques they are compared as means over the wheels' \
                 interval, or the part of it that their readings resemble most, and what the gyro reads faster than that is not judged.",
                paced.step_s, self.step_s
            ));
        }
        paced
    }

    /// Whether, in some drive whose wheels are read seldom, means of the gyro agree better with the wheels' yaw rate
    /// than its readings do, or the readings scatter about it beyond stated noise and chance: by shaking, for example.
    #[must_use]
    pub(crate) fn is_shaken(&self) -> bool {
        self.drives().any(|rows| is_shaken(&self.window(rows)))
    }

    /// Median time, s, from one reading of v and of ω to the next: by the wheels, ω by the gyro where it is read more
    /// often.
    #[must_use]
    pub(crate) fn read_every_s(&self) -> [f64; 2] {
        let every_s = |there: &dyn Fn(usize) -> bool| -> f64 {
            let read = |rows: std::ops::Range<usize>| rows.filter(|k| there(*k)).map(|k| self.times_s[k]);
            let of_drive =
                |rows: std::ops::Range<usize>| read(rows.clone()).zip(read(rows).skip(1)).map(|(from, to)| to - from);
            let mut steps: Vec<f64> = self.drives().flat_map(of_drive).collect();
            median(&mut steps)
        };
        let wheels_s = every_s(&|k| is_read(self, k));
        let gyro_s = self.gyro_rad_s.as_ref().map_or(f64::INFINITY, |gyro| every_s(&|k| gyro[k].is_finite()));
        [wheels_s, wheels_s.min(gyro_s)]
    }
}

/// Readings of the torques to one of the wheels from which on a control acts on more than is logged.
const OFTEN: f64 = 1.5;

/// Note on torques that change between the readings of the wheels; none where they do not. A speed control sets them from
/// readings that the log does not hold, so that they tell of the motion beyond what they cause: innovations follow them
/// with nothing lacking from the simulator (Ljung, System Identification, 1999, 13.4: feedback).
pub(crate) fn feedback_note(record: &Record) -> Option<String> {
    let torques = record.torques_n_m.as_ref()?;
    let changes =
        |d: &std::ops::Range<usize>| d.clone().skip(1).filter(|k| torques.iter().any(|u| u[*k] != u[k - 1])).count();
    let reads = |d: &std::ops::Range<usize>| d.clone().filter(|k| is_read(record, *k)).count();
    let (changes, reads) = record.drives().fold((0, 0), |(c, r), d| (c + changes(&d), r + reads(&d)));
    (changes as f64 >= OFTEN * reads as f64).then(|| {
        format!(
            "The torques change {changes} times, the wheels are read {reads} times. A speed control that acts on wheel readings which \
             the log does not hold puts what it knows into its torques, which resembles small effects: what gains few nats may be \
             that. Hint: log the wheels as often as the torques."
        )
    })
}

/// The wheels' interval, s; none where the gyro is not read much more often, or torques were logged.
fn interval_s(record: &Record) -> Option<f64> {
    record.gyro_rad_s.as_ref().filter(|_| record.torques_n_m.is_none())?;
    let [wheels_s, gyro_s] = record.read_every_s();
    (wheels_s >= SELDOM * gyro_s).then_some(wheels_s)
}

fn is_read(record: &Record, k: usize) -> bool {
    record.wheels_rad_s.iter().all(|w| w[k].is_finite())
}

/// Times, s, and yaw rates from the wheels, rad/s.
fn told(record: &Record) -> impl Iterator<Item = (f64, f64)> + '_ {
    (0..record.len()).filter(|k| is_read(record, *k)).map(|k| (record.times_s[k], record.rolling(k)[1]))
}

fn is_shaken(record: &Record) -> bool {
    let (Some(interval_s), Some(gyro)) = (interval_s(record), &record.gyro_rad_s) else { return false };
    let turned = Integral::of(&record.times_s, gyro);
    if resembling_s(record, &turned, interval_s) > turned.step_s() {
        return true;
    }
    let pairs = told(record).map(|(t_s, y)| [turned.mean(t_s, turned.step_s()), y]).filter(|p| p[0].is_finite());
    let pairs: Vec<[f64; 2]> = pairs.collect();
    let Some(([_, slope], mut errors)) = fitted(&pairs) else { return true };
    let Belief { robot, gyro_std_rad_s, wheel_std_rad_s, .. } = record.belief;
    let wheels = 0.5 * robot.radius_m[0].hypot(robot.radius_m[1]) * wheel_std_rad_s / robot.half_track_m;
    let stated = wheels.powi(2) + OF_ONE_STEP * (slope * gyro_std_rad_s).powi(2);
    let chance = 1.0 + BEYOND_CHANCE * BY_MEDIAN / (errors.len() as f64).sqrt();
    mad_std(&mut errors, 0.0).powi(2) > chance * (2.0 * LOUDER).exp() * stated
}

/// Variance of a mean over one step between means of neighbours, in that of one reading: (1/4)² + (1/2)² + (1/4)².
const OF_ONE_STEP: f64 = 0.375;

/// Shares of the wheels' interval over which their reading may be a mean: counts over the interval, a filtered speed,
/// the speed of the moment.
const PARTS: [f64; 3] = [1.0, 0.5, 0.0];

/// Averaging time, s, at which the gyro agrees best with the yaw rate of the wheels.
fn resembling_s(record: &Record, turned: &Integral, interval_s: f64) -> f64 {
    let told: Vec<(f64, f64)> = told(record).collect();
    let white = record.belief.gyro_std_rad_s.powi(2) * turned.step_s();
    // mean square of the wheels' residuals about a line in the gyro's means, less the white noise of these
    let scatter = |over_s: f64| {
        let pairs = told.iter().map(|(t_s, y)| (turned.mean(*t_s, over_s), *y)).filter(|(x, _)| x.is_finite());
        let sums = pairs.fold([0.0; 6], |[n, x, y, xx, xy, yy], (a, b)| {
            [n + 1.0, x + a, y + b, xx + a * a, xy + a * b, yy + b * b]
        });
        let [n, x, y, xx, xy, yy] = sums;
        let [xx, xy, yy] = [xx - x * x / n, xy - x * y / n, yy - y * y / n];
        let slope = if xx > 0.0 { xy / xx } else { 0.0 };
        (yy - slope * xy) / n - slope * slope * white / over_s
    };
    let widths = PARTS.map(|part| (part * interval_s).max(turned.step_s()));
    let scattered = widths.map(|over_s| (scatter(over_s), over_s)).into_iter();
    scattered.min_by(|a, b| a.0.total_cmp(&b.0)).map_or(interval_s, |best| best.1)
}

/// One drive with the rows in which its wheels or a pose are read. None where the gyro is not much faster, or torques
/// tell the motion between.
fn at_wheels(record: &Record, fewest_rows: usize) -> Option<Record> {
    let interval_s = interval_s(record)?;
    let gyro = record.gyro_rad_s.as_ref()?;
    let of_pose = |k: usize| record.pose.as_ref().is_some_and(|p| p.iter().any(|p| p[k].is_finite()));
    let rows: Vec<usize> = (0..record.len()).filter(|k| is_read(record, *k) || of_pose(*k)).collect();
    if rows.len() < fewest_rows {
        return None;
    }
    let turned = Integral::of(&record.times_s, gyro);
    let over_s = resembling_s(record, &turned, interval_s);
    let mean = |k: &usize| if is_read(record, *k) { turned.mean(record.times_s[*k], over_s) } else { f64::NAN };
    let kept = |v: &Vec<f64>| -> Vec<f64> { rows.iter().map(|k| v[*k]).collect() };
    let mut belief = record.belief;
    belief.gyro_std_rad_s *= (turned.step_s() / over_s).sqrt();
    let times_s = kept(&record.times_s);
    let mut steps: Vec<f64> = times_s.windows(2).map(|w| w[1] - w[0]).collect();
    Some(Record {
        step_s: median(&mut steps),
        since_power_on_s: kept(&record.since_power_on_s),
        starts: vec![0],
        sources: record.sources.clone(),
        loads_kg: record.loads_kg.clone(),
        torques_n_m: None,
        gyro_rad_s: Some(rows.iter().map(mean).collect()),
        wheels_rad_s: record.wheels_rad_s.each_ref().map(kept),
        pose: record.pose.as_ref().map(|p| p.each_ref().map(kept)),
        temperature_c: record.temperature_c.as_ref().map(kept),
        times_s,
        belief,
        wheels_were_set: record.wheels_were_set,
        given: record.given.clone(),
        notes: record.notes.clone(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::Library;
    use crate::gap::diagnosis::Drive;
    use crate::gap::drive::ekf::slopes::Slopes;
    use crate::gap::drive::options::Options;
    use crate::gap::drive::preprocess::clocks::tests::{recorded, robot, two_files, without};
    use crate::gap::drive::record::ready::compare;
    use crate::gap::selection::sets::Main;
    use crate::math::random::Stream;
    use crate::signal::{Log, names};
    use std::f64::consts::TAU;

    /// A drive that turns slowly and fast, without noise.
    fn turning() -> Log {
        let lost = [names::TORQUE_LEFT, names::TORQUE_RIGHT, names::X, names::Y, names::HEADING];
        let mut log = without(recorded(90.0, 5, None), &lost);
        let rate = |t: f64| 0.4 * (TAU * 0.2 * t).sin() + 0.4 * (TAU * 1.7 * t).cos();
        let rolling = Record::new(&robot(), &log, 0.0).unwrap().belief.robot;
        let rates: Vec<f64> = (0..log.len()).map(|k| rate(log.time.at(k))).collect();
        for c in &mut log.channels {
            let wheel = |i: usize| rates.iter().map(|w| rolling.wheels_rad_s(0.5, *w)[i]).collect();
            match c.name.as_str() {
                names::GYRO_Z => c.values.clone_from(&rates),
                names::WHEEL_LEFT => c.values = wheel(0),
                names::WHEEL_RIGHT => c.values = wheel(1),
                _ => {}
            }
        }
        log
    }

    /// An acceleration over less than the distance of readings was the correction by a reading, and diverged.
    #[test]
    #[ignore = "battery: some ten seconds and more"]
    fn battery_wheels_that_are_read_seldom_beside_a_pose_have_a_likelihood() {
        let mut log = without(recorded(90.0, 5, None), &[names::TORQUE_LEFT, names::TORQUE_RIGHT]);
        for c in log.channels.iter_mut().filter(|c| [names::WHEEL_LEFT, names::WHEEL_RIGHT].contains(&c.name.as_str()))
        {
            c.values.iter_mut().enumerate().filter(|(k, _)| k % 15 != 0).for_each(|(_, v)| *v = f64::NAN);
        }
        let record = Record::new(&robot(), &log, 0.0).unwrap();
        assert!(record.pose.is_some() && record.read_every_s()[0] > 2.0 * Slopes::OVER_S);
        let fit = Drive::new(&log, 0.0);
        let findings = compare(&robot(), &fit, &Library::new(), &Options::default()).unwrap().weighed("drive");
        let found = findings.unwrap();
        assert_eq!(found.mains()[0].0, Main::None, "{:?}", found.mains());
    }

    #[test]
    fn torques_between_the_readings_of_the_wheels_are_told() {
        let log = recorded(30.0, 5, None);
        let told =
            |log: &Log| Record::new(&robot(), log, 0.0).unwrap().notes.iter().any(|n| n.contains("speed control"));
        assert!(!told(&log));
        let mut seldom = log.clone();
        let wheels = [names::WHEEL_LEFT, names::WHEEL_RIGHT];
        for c in seldom.channels.iter_mut().filter(|c| wheels.contains(&c.name.as_str())) {
            c.values.iter_mut().enumerate().filter(|(k, _)| k % 5 != 0).for_each(|(_, v)| *v = f64::NAN);
        }
        assert!(told(&seldom));
        // held from one reading to the next they were set by what the log holds
        let torques = [names::TORQUE_LEFT, names::TORQUE_RIGHT];
        for c in seldom.channels.iter_mut().filter(|c| torques.contains(&c.name.as_str())) {
            (0..c.values.len()).for_each(|k| c.values[k] = c.values[k - k % 5]);
        }
        assert!(!told(&seldom));
    }

    #[test]
    fn what_shakes_a_gyro_is_more_than_its_noise() {
        let log = without(recorded(90.0, 5, None), &[names::TORQUE_LEFT, names::TORQUE_RIGHT]);
        let mut record = Record::new(&robot(), &two_files(&log, 0.0), 0.0).unwrap();
        assert!(!record.is_shaken());
        let draw = &mut Stream::new(4, 2);
        record.gyro_rad_s.iter_mut().flatten().for_each(|rate| *rate += 0.03 * draw.normal());
        assert!(record.is_shaken());
        // wheels that are read as often tell it themselves
        assert!(!Record::new(&robot(), &log, 0.0).unwrap().is_shaken());
    }

    #[test]
    fn the_gyro_is_read_at_the_pace_of_wheels_that_are_read_seldom() {
        let log = turning();
        let every = Record::new(&robot(), &log, 0.0).unwrap().at_wheels();
        // with equal rates nothing is changed
        assert!((every.step_s - 0.01).abs() < 1e-9 && every.len() == log.len());
        let seldom = Record::new(&robot(), &two_files(&log, 0.0), 0.0).unwrap().at_wheels();
        assert!((seldom.step_s - 0.15).abs() < 1e-9 && seldom.len() == log.len().div_ceil(15), "{}", seldom.len());
        assert!(seldom.notes.iter().any(|n| n.contains("means over the wheels' interval")), "{:?}", seldom.notes);
        // they tell the speed of the moment: half a step at either side
        let (gyro, k) = (log.get(names::GYRO_Z).unwrap(), 20 * 15);
        let near = 0.5 * gyro[k] + 0.25 * (gyro[k - 1] + gyro[k + 1]);
        let means = seldom.gyro_rad_s.as_ref().unwrap();
        assert!((means[20] - near).abs() < 1e-12, "{} {near}", means[20]);
        assert_eq!(seldom.belief.gyro_std_rad_s, every.belief.gyro_std_rad_s);
        // wheels whose ticks are counted from one reading to the next
        let mut counted = log.clone();
        for c in
            counted.channels.iter_mut().filter(|c| [names::WHEEL_LEFT, names::WHEEL_RIGHT].contains(&c.name.as_str()))
        {
            let each = c.values.clone();
            let around = |k: usize| &each[k.saturating_sub(7)..(k + 8).min(each.len())];
            c.values = (0..each.len()).map(|k| around(k).iter().sum::<f64>() / around(k).len() as f64).collect();
        }
        let seldom = Record::new(&robot(), &two_files(&counted, 0.0), 0.0).unwrap().at_wheels();
        let means = seldom.gyro_rad_s.as_ref().unwrap();
        // fourteen whole steps and half a one at either end
        let mean = (gyro[k - 7..=k + 7].iter().sum::<f64>()
            + 0.25 * (gyro[k - 8] + gyro[k + 8] - gyro[k - 7] - gyro[k + 7]))
            / 15.0;
        assert!((means[20] - mean).abs() < 1e-12, "{} {mean}", means[20]);
        // white noise of means over fifteen readings
        let ratio = seldom.belief.gyro_std_rad_s / every.belief.gyro_std_rad_s;
        assert!((ratio - 15_f64.sqrt().recip()).abs() < 1e-9, "{ratio}");
        // torques tell the motion between
        assert!(
            at_wheels(&Record { torques_n_m: Some([vec![0.0; every.len()], vec![0.0; every.len()]]), ..every }, 16)
                .is_none()
        );
    }
}
