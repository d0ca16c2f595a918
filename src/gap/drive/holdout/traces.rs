//! z_k beside h(ξ_k), ξ_k by the model alone from the pose and speed at the beginning of each window
//!
//! A drive as recorded, and as both simulators have it: in windows of the longest horizon the model drives on without
//! readings, with the recorded torques (where there are none: with the wheels).

use super::horizons::LONGEST_S;
use crate::effects::Library;
use crate::gap::drive::ekf::effect_set::{EffectSet, Effects};
use crate::gap::drive::ekf::innovations::run;
use crate::gap::drive::ekf::noise::{Channel, Noise, Process};
use crate::gap::drive::record::Record;
use crate::signal::names;
use serde::Serialize;

/// Points of a channel in the answer: as many as a picture across a page can show.
const POINTS: usize = 500;

/// A channel as recorded and as simulated.
#[derive(Debug, Clone, PartialEq)]
pub struct Trace {
    /// Name of the channel, as in a log.
    pub channel: &'static str,
    /// Recorded values, in the unit that the name ends in; NaN where there is none.
    pub recorded: Vec<f64>,
    /// Values of the nominal simulator where one was recorded, else NaN.
    pub before: Vec<f64>,
    /// Values of the augmented simulator; empty where no effect was found.
    pub after: Vec<f64>,
}

/// A drive as recorded and as both simulators have it.
#[derive(Debug, Clone, PartialEq)]
pub struct DriveTraces {
    /// Source of the recording.
    pub source: String,
    /// Time of each row, s, as in the log.
    pub times_s: Vec<f64>,
    /// Rows at which a window begins: there the simulators are put on the recorded pose.
    pub begins: Vec<usize>,
    /// Whether the recorded torques drive the simulators; else the recorded wheels do.
    pub by_torques: bool,
    /// The recorded channels.
    pub traces: Vec<Trace>,
}

/// A channel of a drive in the answer, at every n-th of its readings: those of x and y together are the path.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TraceCurve {
    /// Source of the recording.
    pub source: String,
    /// Abscissa.
    pub over: &'static str,
    /// Unit of `x`.
    pub x_unit: &'static str,
    /// Name of the channel, as in a log.
    pub shown: &'static str,
    /// Unit of the values.
    pub unit: &'static str,
    /// Time of each reading, s, as in the log.
    pub x: Vec<f64>,
    /// Recorded values.
    pub recorded: Vec<f64>,
    /// Values of the nominal simulator; NaN where it has none.
    pub before: Vec<f64>,
    /// Values of the augmented simulator, which is the nominal one where no effect was found.
    pub after: Vec<f64>,
    /// Times at which the simulators are put on the recorded pose, s; from one to the next they drive alone.
    pub begins_s: Vec<f64>,
    /// Whether the recorded torques drive the simulators; else the recorded wheels do.
    pub by_torques: bool,
}

impl DriveTraces {
    /// Each channel, at most 500 readings of it.
    pub fn curves(&self) -> impl Iterator<Item = TraceCurve> + '_ {
        self.traces.iter().map(|trace| {
            let rows: Vec<usize> = (0..self.times_s.len()).filter(|k| trace.recorded[*k].is_finite()).collect();
            let kept = |values: &[f64]| -> Vec<f64> {
                rows.iter().step_by(rows.len().div_ceil(POINTS).max(1)).map(|k| values[*k]).collect()
            };
            let after = if trace.after.is_empty() { &trace.before } else { &trace.after };
            TraceCurve {
                source: self.source.clone(),
                over: "time",
                x_unit: "s",
                shown: trace.channel,
                unit: unit(trace.channel),
                x: kept(&self.times_s),
                recorded: kept(&trace.recorded),
                before: kept(&trace.before),
                after: kept(after),
                begins_s: self.begins.iter().map(|k| self.times_s[*k]).collect(),
                by_torques: self.by_torques,
            }
        })
    }
}

/// Name of a channel in a log.
fn name(channel: Channel) -> &'static str {
    match channel {
        Channel::WheelLeft => names::WHEEL_LEFT,
        Channel::WheelRight => names::WHEEL_RIGHT,
        Channel::Gyro => names::GYRO_Z,
        Channel::X => names::X,
        Channel::Y => names::Y,
        Channel::Heading => names::HEADING,
    }
}

fn unit(channel: &str) -> &'static str {
    match channel {
        names::X | names::Y => "m",
        names::HEADING => "rad",
        _ => "rad/s",
    }
}

fn readings(record: &Record, channel: Channel) -> Option<&Vec<f64>> {
    match channel {
        Channel::WheelLeft => Some(&record.wheels_rad_s[0]),
        Channel::WheelRight => Some(&record.wheels_rad_s[1]),
        Channel::Gyro => record.gyro_rad_s.as_ref(),
        Channel::X | Channel::Y | Channel::Heading => Some(&record.pose.as_ref()?[channel as usize - 3]),
    }
}

/// Traces of each drive of `record`, without effects and with those of `together`.
pub(crate) fn traces(record: &Record, library: &Library, together: &Effects, process: Process) -> Vec<DriveTraces> {
    let nominal = EffectSet::new(&[], library);
    let found = (!together.is_empty()).then(|| EffectSet::new(together, library));
    let sources = record.sources.iter().cloned();
    record
        .apart()
        .zip(sources)
        .map(|(drive, source)| of_drive(&drive, source, &nominal, found.as_ref(), process))
        .collect()
}

fn of_drive(
    drive: &Record,
    source: String,
    nominal: &EffectSet,
    found: Option<&EffectSet>,
    process: Process,
) -> DriveTraces {
    let begins = begins(drive);
    let (before, after) = rayon::join(
        || simulated(drive, &begins, nominal, process),
        || found.map(|found| simulated(drive, &begins, found, process)),
    );
    let mut after = after.map(Vec::from).unwrap_or_default().into_iter();
    let all = Channel::ALL.into_iter().zip(before);
    let traces = all.filter_map(|(channel, before)| {
        let after = after.next().unwrap_or_default();
        let recorded = readings(drive, channel)?.clone();
        recorded.iter().any(|v| v.is_finite()).then(|| Trace { channel: name(channel), recorded, before, after })
    });
    let traces = traces.collect();
    DriveTraces { source, times_s: drive.times_s.clone(), begins, by_torques: drive.torques_n_m.is_some(), traces }
}

/// Rows at which windows begin: one after the other, each with a pose where there are any.
fn begins(drive: &Record) -> Vec<usize> {
    let known = |k: &usize| drive.pose.as_ref().is_none_or(|pose| pose.iter().all(|p| p[*k].is_finite()));
    let mut begins = Vec::new();
    let mut from = 0;
    while let Some(begin) = (from..drive.len()).find(known) {
        begins.push(begin);
        from = drive.times_s.partition_point(|t| *t <= drive.times_s[begin] + LONGEST_S).max(begin + 1);
    }
    begins
}

/// Each channel as simulated; NaN where nothing was recorded.
fn simulated(drive: &Record, begins: &[usize], claimed: &EffectSet, process: Process) -> [Vec<f64>; 6] {
    let mut noise: Noise = claimed.noise(drive, process);
    noise.exclude(if drive.torques_n_m.is_some() { 0..6 } else { 2..6 });
    let late = claimed.rows_late(drive);
    let (read, models) = claimed.read(drive);
    let mut out: [Vec<f64>; 6] = std::array::from_fn(|_| vec![f64::NAN; drive.len()]);
    for (i, begin) in begins.iter().copied().enumerate() {
        let end = begins.get(i + 1).copied().unwrap_or(drive.len());
        let part = read.window(begin..end);
        let _ = run(&part, &models, &noise, &[], |i| {
            let reading = readings(&part, i.channel).map_or(f64::NAN, |values| values[i.row]);
            if let Some(value) = out[i.channel as usize].get_mut(begin + i.row + late[i.channel as usize]) {
                *value = reading - i.white * i.std;
            }
        });
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::Parameters;
    use crate::effects::drive::ids;
    use crate::gap::drive::holdout::simulate_fitted::own;
    use crate::gap::drive::preprocess::clocks::tests::{recorded, robot};

    #[test]
    fn the_simulator_that_made_a_recording_is_nearer_to_it_than_another() {
        let like = Record::new(&robot(), &recorded(90.0, 8, None), 0.0).unwrap();
        let parameters: Parameters = [("mass_relative".to_string(), 0.8)].into();
        let payload = [(ids::payload().to_string(), parameters)];
        let library = Library::new();
        let drive = own(&like, &EffectSet::new(&payload, &library), Process::default(), 5);
        let all = traces(&drive, &library, &payload, Process::default());
        let [one] = all.as_slice() else { panic!("{} drives", all.len()) };
        assert!(one.by_torques && one.begins.len() >= 4 && one.times_s.len() == drive.len());
        let rms = |trace: &Trace, of: &[f64]| {
            let errors: Vec<f64> =
                trace.recorded.iter().zip(of).map(|(a, b)| a - b).filter(|e| e.is_finite()).collect();
            assert!(errors.len() > drive.len() / 20, "{}: {} of {}", trace.channel, errors.len(), drive.len());
            (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt()
        };
        for trace in one.traces.iter().filter(|t| [names::WHEEL_LEFT, names::WHEEL_RIGHT].contains(&t.channel)) {
            let (before, after) = (rms(trace, &trace.before), rms(trace, &trace.after));
            assert!(after < 0.7 * before, "{}: {after} after {before}", trace.channel);
        }
        let none = traces(&drive, &library, &Vec::new(), Process::default());
        assert!(none[0].traces.iter().all(|t| t.after.is_empty() && t.before.len() == drive.len()));
        // in the answer: readings at the same times of each channel, and no fewer than half of those that may be
        for (curve, trace) in one.curves().zip(&one.traces) {
            let readings = trace.recorded.iter().filter(|v| v.is_finite()).count();
            assert!(curve.x.len() <= POINTS && curve.x.len() > readings.min(POINTS) / 2, "{}", curve.x.len());
            for (k, x) in curve.x.iter().enumerate() {
                let row = one.times_s.iter().position(|t| t == x).unwrap();
                assert_eq!(curve.recorded[k], trace.recorded[row]);
                assert!(
                    [(curve.before[k], trace.before[row]), (curve.after[k], trace.after[row])]
                        .iter()
                        .all(|(a, b)| a == b || a.is_nan() && b.is_nan())
                );
            }
        }
        let of = |channel| one.curves().find(|c| c.shown == channel).unwrap();
        assert_eq!(of(names::X).x, of(names::Y).x);
        assert!(none[0].curves().all(|c| c.after.len() == c.x.len()));
    }
}
