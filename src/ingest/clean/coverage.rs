//! Streams that end before the drive does, or begin after it; and sensors that repeat their last value to the end.

use crate::ingest::columns::channels;
use crate::signal::{Log, names};

/// Part of the drive's length that a stream may lack at either end ...
const SHARE: f64 = 0.05;
/// ... and how many times its longest gap.
const GAPS: f64 = 3.0;
/// How many times longer than it ever stayed before a sensor stays at one value where it has stopped: coarse ones repeat themselves.
const STUCK: usize = 10;

/// Channels of sensors that never stay at one value while they read.
const RESTLESS: [&str; 7] = [
    names::GYRO_Z,
    names::WHEEL_LEFT,
    names::WHEEL_RIGHT,
    names::WHEEL_LEFT_SPEED,
    names::WHEEL_RIGHT_SPEED,
    names::ODO_SPEED,
    names::ODO_YAW_RATE,
];

/// Sentences on the spans that the streams of a drive miss; each log has its times on the drive's clock, s. A value
/// that a sensor repeats after it has stopped is no reading: it is set to NaN, with a note.
pub(crate) fn lacking(logs: &mut [(Log, Vec<f64>)]) -> Vec<String> {
    let ends = |l: &(Log, Vec<f64>)| l.1.first().copied().zip(l.1.last().copied());
    let all = logs.iter().filter_map(ends);
    let (start, end) = all.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), (c, d)| (a.min(c), b.max(d)));
    let several = logs.len() > 1;
    let changed = |l: &(Log, Vec<f64>)| {
        let restless = l.0.channels.iter().filter(|c| RESTLESS.contains(&c.name.as_str()));
        restless.filter_map(|c| still_from(&c.values).map(|k| l.1[k])).fold(start, f64::max)
    };
    let changed = logs.iter().map(changed).fold(start, f64::max);
    let mut out: Vec<(String, String, Vec<String>)> = Vec::new();
    for (log, times) in logs {
        for channel in log.channels.iter_mut().filter(|c| channels::of(&c.name).is_some()) {
            let Some((what, hint)) = lack(&channel.name, &mut channel.values, times, [start, end, changed]) else {
                continue;
            };
            let what = if several { format!("of {} {what}", log.source) } else { what };
            match out.iter_mut().find(|(other, _, _)| *other == what) {
                Some((_, _, names)) => names.push(channel.name.clone()),
                None => out.push((what, hint, vec![channel.name.clone()])),
            }
        }
    }
    out.into_iter().map(|(what, hint, names)| format!("{} {what}; {hint}", names.join(", "))).collect()
}

/// Row from which on all readings to the end are the same; none without readings.
fn still_from(values: &[f64]) -> Option<usize> {
    let last = values.iter().rposition(|v| v.is_finite())?;
    (0..=last).rev().filter(|k| values[*k].is_finite()).take_while(|k| values[*k] == values[last]).last()
}

/// The span of the drive from `start` to `end` that a channel misses, and the remedy. The value that it repeats to the
/// end is removed only where another sensor's reading still changes, at last `changed`: a simulator without noise
/// repeats itself as well. All in s.
fn lack(name: &str, values: &mut [f64], times: &[f64], [start, end, changed]: [f64; 3]) -> Option<(String, String)> {
    let there: Vec<usize> = (0..values.len()).filter(|&k| values[k].is_finite()).collect();
    let (first, last) = (times[*there.first()?], times[*there.last()?]);
    let longest = there.windows(2).map(|w| times[w[1]] - times[w[0]]).fold(0.0, f64::max);
    let short = |missing: f64| missing > SHARE * (end - start) && missing > GAPS * longest;
    let cut = || "cut all files to what they share, or record the drive again".to_string();
    if short(end - last) {
        return Some((format!("ends at {last:.1} s, the drive at {end:.1} s"), cut()));
    }
    if short(first - start) {
        return Some((format!("begins at {first:.1} s, the drive at {start:.1} s"), cut()));
    }
    let from = still_from(values)?;
    let (before, stays) = there.split_at(there.partition_point(|k| *k < from));
    let (value, since) = (values[from], times[from]);
    if !RESTLESS.contains(&name) || value == 0.0 || !short(end - since) {
        return None;
    }
    let found = format!("stays at {value} from {since:.1} s to the end");
    let runs = before.chunk_by(|a, b| values[*a] == values[*b]).filter(|run| values[run[0]] != 0.0);
    let longest = runs.map(<[usize]>::len).max().unwrap_or(0);
    if longest == 0 || stays.len() <= STUCK * longest || !short(changed - since) {
        return Some((found, "has its sensor stopped there? Then cut the drive, or record it again".into()));
    }
    // the first of them is a reading
    stays[1..].iter().for_each(|k| values[*k] = f64::NAN);
    Some((found, "its sensor stopped there, and what it repeats is left out: cut the drive, or record it again".into()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::TimeAxis;

    fn stream(source: &str, times: &[f64], channels: &[(&str, &[f64])]) -> (Log, Vec<f64>) {
        let mut log = Log::new(source, TimeAxis::Explicit(times.to_vec()));
        channels.iter().for_each(|(name, values)| log.push(*name, values.to_vec()).unwrap());
        (log, times.to_vec())
    }

    fn even(step: f64, rows: usize) -> Vec<f64> {
        (0..rows).map(|k| step * k as f64).collect()
    }

    fn moving(rows: usize) -> Vec<f64> {
        (0..rows).map(|k| (k as f64).sin()).collect()
    }

    #[test]
    fn a_stream_that_stops_half_way_is_told() {
        let (imu, wheels) = (even(0.01, 10_000), even(0.15, 333));
        let wheel = moving(333);
        let a = stream("imu.csv", &imu, &[(names::GYRO_Z, &moving(10_000))]);
        let b = stream("wheels.csv", &wheels, &[(names::WHEEL_LEFT, &wheel), (names::WHEEL_RIGHT, &wheel)]);
        let told = lacking(&mut [a.clone(), b]);
        let said = "wheel_left_rad_s, wheel_right_rad_s of wheels.csv ends at 49.8 s, the drive at 100.0 s; cut all";
        assert!(told.len() == 1 && told[0].starts_with(said), "{told:?}");
        // a second less is nothing
        let c = stream("wheels.csv", &even(0.15, 661), &[(names::WHEEL_LEFT, &moving(661))]);
        assert_eq!(lacking(&mut [a, c]), [""; 0]);
    }

    #[test]
    fn missing_values_and_a_stuck_sensor_end_a_stream_too_and_a_stop_does_not() {
        let times = even(0.1, 1000);
        let until =
            |rest: f64| (0..1000).map(|k| if k < 600 { f64::from(k).sin() } else { rest }).collect::<Vec<f64>>();
        for (rest, said) in [(f64::NAN, Some("ends at 59.9 s")), (0.25, Some("stays at 0.25 from 60.0 s")), (0.0, None)]
        {
            let mut logs =
                [stream("d.csv", &times, &[(names::WHEEL_LEFT, &until(rest)), (names::GYRO_Z, &moving(1000))])];
            let told = lacking(&mut logs);
            assert_eq!(told.len(), usize::from(said.is_some()), "{told:?}");
            assert!(said.is_none_or(|said| told[0].starts_with(&format!("wheel_left_rad_s {said}"))), "{told:?}");
            let read = logs[0].0.channels[0].values.iter().filter(|v| v.is_finite()).count();
            let left = [(rest == 0.0, 1000), (rest.is_nan(), 600), (rest == 0.25, 601)];
            assert!(left.contains(&(true, read)), "{rest}: {read}");
        }
        // where all stay, it is a simulator without noise that holds its speed
        let mut logs = [stream("d.csv", &times, &[(names::WHEEL_LEFT, &until(0.25)), (names::GYRO_Z, &until(0.5))])];
        assert_eq!(lacking(&mut logs).len(), 2);
        assert!(logs[0].0.channels.iter().all(|c| c.values.iter().all(|v| v.is_finite())));
        // an encoder that counts coarsely stays at one speed for long, again and again; a course may be one speed
        for steps in [[0.25, 0.5, 0.25], [0.5, 0.5, 0.5]] {
            let coarse: Vec<f64> = (0..1000).map(|k| steps[k / 400]).collect();
            let mut logs = [stream("d.csv", &times, &[(names::WHEEL_LEFT, &coarse), (names::GYRO_Z, &moving(1000))])];
            lacking(&mut logs);
            assert_eq!(logs[0].0.channels[0].values, coarse, "{steps:?}");
        }
        // a late beginning
        let mut late = until(0.0);
        late[..200].fill(f64::NAN);
        let told = lacking(&mut [stream("d.csv", &times, &[(names::GYRO_Z, &late)])]);
        assert!(told.len() == 1 && told[0].contains("begins at 20.0 s"), "{told:?}");
    }
}
