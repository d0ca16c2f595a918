//! Several files of one drive on the union of their times.
//!
//! A row of the union is a time at which a file has a row. Channels of the other files are NaN there, so that every
//! sensor keeps its own rate; only what holds between its rows by its nature is filled in: torques and motor currents, which
//! stand for them, stay as they are until the next one, and time since power-on runs on.

use crate::error::{Error, ErrorKind, Result};
use crate::ingest::clean::coverage;
use crate::signal::{Log, TimeAxis, names};
use std::path::Path;

/// One file's log, and where its time begins.
pub(crate) struct Part {
    pub log: Log,
    /// Time of its zero by the file's clock, s.
    pub zero_s: f64,
    /// Whether that clock is of dates or of the time of day.
    pub dated: bool,
}

/// Stamps closer than this are of one moment: files round the same stamp differently, s.
const SAME_S: f64 = 1e-6;

/// Puts the logs on one time axis; with what there is to tell.
pub(crate) fn merge(parts: Vec<Part>) -> Result<(Log, Vec<String>)> {
    let several = parts.len() > 1;
    let mut notes = Vec::new();
    let Some(dated) = parts.first().map(|p| p.dated).filter(|_| several) else {
        let one = parts.into_iter().next().map(|p| {
            let times = p.log.time.to_vec();
            let mut alone = [(p.log, times)];
            let notes = coverage::lacking(&mut alone);
            let [(log, _)] = alone;
            (log, notes)
        });
        return one.ok_or_else(|| Error::new(ErrorKind::Usage, "drive", "no file is given"));
    };
    if let Some(other) = parts.iter().find(|p| p.dated != dated) {
        let (dates, plain) = if dated { (&parts[0], other) } else { (other, &parts[0]) };
        let (dates, plain) = (&dates.log.source, &plain.log.source);
        let found = format!("its time counts from 1970, that of {plain} does not: they are on two clocks");
        return Err(Error::new(ErrorKind::Time, dates, found)
            .hint("name a time column that both files have with --time, or write one file's times anew"));
    }
    // a plain clock stays as it is, unless it begins before its zero
    let zero_s = parts.iter().map(|p| p.zero_s).fold(if dated { f64::INFINITY } else { 0.0 }, f64::min);
    let mut logs: Vec<(Log, Vec<f64>)> = parts
        .into_iter()
        .map(|p| {
            let shift = p.zero_s - zero_s;
            let times = p.log.time.to_vec().into_iter().map(|t| t + shift).collect();
            (p.log, times)
        })
        .collect();
    check_overlap(&logs)?;
    notes.extend(coverage::lacking(&mut logs));
    let times = union(logs.iter().map(|l| l.1.as_slice()));
    let sources: Vec<_> = logs.iter().map(|l| l.0.source.clone()).collect();
    let mut out = Log::new(sources.join(" + "), TimeAxis::Explicit(times));
    for (log, own) in logs {
        let rows: Vec<usize> = own.iter().map(|t| row_of(&out.time, *t)).collect();
        for channel in log.channels {
            let mut values = vec![f64::NAN; out.len()];
            rows.iter().zip(&channel.values).for_each(|(row, value)| values[*row] = *value);
            match channel.name.as_str() {
                names::TORQUE_LEFT | names::TORQUE_RIGHT | names::CURRENT_LEFT | names::CURRENT_RIGHT => {
                    hold(&mut values, &rows)
                }
                names::SINCE_POWER_ON => run_on(&mut values, &out.time),
                _ => {}
            }
            let name = free_name(&channel.name, &log.source, &|name| out.get(name).is_some());
            if name != channel.name && crate::ingest::columns::channels::of(&channel.name).is_some() {
                notes.push(format!(
                    "{} is in several files: that of {} is {name} and not used; give it first to use it",
                    channel.name, log.source
                ));
            }
            out.push(name, values)?;
        }
    }
    Ok((out, notes))
}

/// All times, ascending, one for each moment.
fn union<'a>(all: impl Iterator<Item = &'a [f64]>) -> Vec<f64> {
    let mut times: Vec<f64> = all.flatten().copied().collect();
    times.sort_by(f64::total_cmp);
    let mut out: Vec<f64> = Vec::with_capacity(times.len());
    for t in times {
        if out.last().is_none_or(|last| t - last > SAME_S) {
            out.push(t);
        }
    }
    out
}

/// The row at or just before `t`.
fn row_of(time: &TimeAxis, t: f64) -> usize {
    match time {
        TimeAxis::Explicit(times) => times.partition_point(|at| *at <= t).saturating_sub(1),
        TimeAxis::Uniform { .. } => 0,
    }
}

fn check_overlap(logs: &[(Log, Vec<f64>)]) -> Result<()> {
    let ends = |l: &(Log, Vec<f64>)| l.1.first().copied().zip(l.1.last().copied());
    for (k, later) in logs.iter().enumerate() {
        for earlier in &logs[..k] {
            let (Some((a0, a1)), Some((b0, b1))) = (ends(earlier), ends(later)) else { continue };
            if b0 > a1 || a0 > b1 {
                let found = format!(
                    "lasts from {b0:.3} s to {b1:.3} s, {} from {a0:.3} s to {a1:.3} s: they do not overlap",
                    earlier.0.source
                );
                return Err(Error::new(ErrorKind::Time, &later.0.source, found)
                    .hint("give files of one drive on one clock, or name its column with --time"));
            }
        }
    }
    Ok(())
}

/// Rows of other files after a row of this one take its value.
fn hold(values: &mut [f64], rows: &[usize]) {
    let mut own = rows.iter().copied().peekable();
    let mut last = f64::NAN;
    for (row, value) in values.iter_mut().enumerate() {
        if own.peek() == Some(&row) {
            last = *value;
            while own.next_if_eq(&row).is_some() {}
        } else {
            *value = last;
        }
    }
}

/// A clock: the nearest value before a row, or else the first one, and the time between.
fn run_on(values: &mut [f64], time: &TimeAxis) {
    let Some(first) = values.iter().position(|v| v.is_finite()) else { return };
    let mut offset = values[first] - time.at(first);
    for (row, value) in values.iter_mut().enumerate() {
        if value.is_finite() {
            offset = *value - time.at(row);
        } else {
            *value = offset + time.at(row);
        }
    }
}

/// `name`, or with the file's name before it where it is taken.
pub(crate) fn free_name(name: &str, source: &str, taken: &dyn Fn(&str) -> bool) -> String {
    if !taken(name) {
        return name.to_string();
    }
    let file = Path::new(source).file_name().map(|f| f.to_string_lossy().into_owned()).unwrap_or_default();
    let stem = file.split('.').next().unwrap_or_default();
    let mut free = format!("{stem}.{name}");
    while taken(&free) {
        free.push('_');
    }
    free
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part(source: &str, zero_s: Option<f64>, times: &[f64], channels: &[(&str, &[f64])]) -> Part {
        let mut log = Log::new(source, TimeAxis::Explicit(times.to_vec()));
        channels.iter().for_each(|(name, values)| log.push(*name, values.to_vec()).unwrap());
        Part { log, zero_s: zero_s.unwrap_or_default(), dated: zero_s.is_some() }
    }

    /// NaN written as -1, which no test value is.
    fn shown(log: &Log, name: &str) -> Vec<f64> {
        log.get(name).unwrap().iter().map(|v| if v.is_nan() { -1.0 } else { *v }).collect()
    }

    #[test]
    fn each_channel_stands_at_its_own_times() {
        let a = part("a.csv", None, &[0.0, 0.2, 0.4], &[("p", &[1.0, 2.0, 3.0]), ("q", &[4.0, 5.0, 6.0])]);
        let b = part("b.csv", None, &[0.1, 0.2 + 4e-7, 0.5], &[("p", &[7.0, 8.0, 9.0])]);
        let (log, _) = merge(vec![a, b]).unwrap();
        assert_eq!(log.time.to_vec(), [0.0, 0.1, 0.2, 0.4, 0.5]);
        assert_eq!(shown(&log, "p"), [1.0, -1.0, 2.0, 3.0, -1.0]);
        assert_eq!(shown(&log, "b.p"), [-1.0, 7.0, 8.0, -1.0, 9.0]);
        assert_eq!(shown(&log, "q"), [4.0, -1.0, 5.0, 6.0, -1.0]);
    }

    #[test]
    fn commands_hold_and_clocks_run_on() {
        let torques: (&str, &[f64]) = (names::TORQUE_LEFT, &[1.0, f64::NAN, 3.0]);
        let since: (&str, &[f64]) = (names::SINCE_POWER_ON, &[10.0, 11.0, 12.0]);
        let a = part("a.csv", None, &[1.0, 2.0, 3.0], &[torques, since]);
        let b = part("b.csv", None, &[0.5, 1.5, 2.5, 3.5], &[("p", &[0.0; 4])]);
        let (log, _) = merge(vec![a, b]).unwrap();
        // a command that is missing in its own file stays missing
        assert_eq!(shown(&log, names::TORQUE_LEFT), [-1.0, 1.0, 1.0, -1.0, -1.0, 3.0, 3.0]);
        assert_eq!(shown(&log, names::SINCE_POWER_ON), [9.5, 10.0, 10.5, 11.0, 11.5, 12.0, 12.5]);
    }

    #[test]
    fn dates_count_from_the_earliest_file() {
        let a = part("a.csv", Some(1000.5), &[0.0, 1.0], &[("p", &[1.0, 2.0])]);
        let b = part("b.csv", Some(1000.0), &[0.0, 1.0], &[("q", &[1.0, 2.0])]);
        assert_eq!(merge(vec![a, b]).unwrap().0.time.to_vec(), [0.0, 0.5, 1.0, 1.5]);
    }

    #[test]
    fn a_clock_that_begins_before_its_zero_is_no_date() {
        let early = Part { dated: false, ..part("a.csv", Some(-0.5), &[0.0, 1.0], &[("p", &[1.0, 2.0])]) };
        let plain = part("b.csv", None, &[0.0, 1.0], &[("q", &[1.0, 2.0])]);
        assert_eq!(merge(vec![early, plain]).unwrap().0.time.to_vec(), [0.0, 0.5, 1.0, 1.5]);
    }

    #[test]
    fn two_clocks_are_refused() {
        let a = || part("a.csv", None, &[0.0, 1.0], &[]);
        let text = merge(vec![a(), part("b.csv", Some(5.0), &[0.0], &[])]).err().unwrap().to_string();
        assert!(text.starts_with("b.csv") && text.contains("that of a.csv"), "{text}");
        let text = merge(vec![a(), part("b.csv", None, &[1.1, 2.0], &[])]).err().unwrap().to_string();
        assert!(text.starts_with("b.csv") && text.contains("do not overlap"), "{text}");
    }

    #[test]
    fn the_first_file_has_the_say_and_it_is_told() {
        let a = part("a.csv", None, &[0.0, 1.0], &[(names::X, &[1.0, 2.0])]);
        let b = part("dir/b.csv.gz", None, &[0.0, 1.0], &[(names::X, &[3.0, 4.0])]);
        let (log, notes) = merge(vec![a, b]).unwrap();
        assert_eq!(shown(&log, names::X), [1.0, 2.0]);
        assert_eq!(shown(&log, "b.x_m"), [3.0, 4.0]);
        assert!(notes.len() == 1 && notes[0].contains("dir/b.csv.gz"), "{notes:?}");
    }
}
