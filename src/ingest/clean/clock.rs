//! The time column: which one, in which unit, and what it counts from.

use crate::error::{Error, ErrorKind, Result, nearest};
use crate::ingest::columns::names;
use crate::ingest::columns::names::{Role, TimeKind};
use crate::ingest::formats::csv::cell::CLOCK_TIME;
use crate::ingest::formats::head::{Head, Kind, list};
use crate::ingest::formats::source::Batch;
use crate::ingest::formats::table::Table;
use crate::math::robust::median;
use crate::math::scan::{self, Odd};
use crate::units::TimeUnit;
use std::borrow::Cow;
use std::ops::Range;

/// Zero of the times of a recording.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
#[serde(tag = "counts_from", rename_all = "snake_case")]
pub enum Clock {
    /// From power-on: the column says so, or it is a plain time that starts small.
    PowerOn {
        /// Time of the first sample, s since power-on.
        first_s: f64,
        /// Whether the column's name says so.
        stated: bool,
    },
    /// From the first sample: when the power came on is not known.
    FirstSample {
        /// Time of the first sample by the file's clock, s (since 1970-01-01 UTC for dates and Unix times).
        file_s: f64,
    },
}

/// Which columns hold the time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum TimeColumn {
    /// One column.
    One(usize),
    /// Whole seconds and nanoseconds.
    Parts(usize, usize),
    /// No column: rows are evenly spaced, at the user's rate.
    Rows,
}

impl TimeColumn {
    /// Column to name in messages.
    pub(crate) fn index(self) -> Option<usize> {
        match self {
            Self::One(i) | Self::Parts(i, _) => Some(i),
            Self::Rows => None,
        }
    }
}

/// Times of all rows in seconds.
pub(crate) struct Times {
    /// Seconds, NaN where missing.
    pub seconds: Vec<f64>,
    /// Resolution of the times in the file, s.
    pub resolution_s: f64,
    pub clock: Clock,
    pub notes: Vec<String>,
    /// The one of the notes that says how the unit was decided, where it does not stand in the file.
    pub unit_note: Option<String>,
    /// Whether it is known already that none is missing.
    pub complete: bool,
    /// How the cells became seconds: the same holds for the rows that follow.
    pub scale: Scale,
}

/// How the cells of a time column become seconds on the recording's clock.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Scale {
    /// (cell + shift) · factor.
    Affine { column: usize, shift: f64, factor: f64 },
    /// Whole seconds, nanoseconds, and a shift.
    Parts { seconds: usize, nanoseconds: usize, shift: f64 },
    /// Rows at a rate.
    Rows { rate_hz: f64 },
}

impl Scale {
    /// Seconds of the rows of `batch`, the first of which is row `first`; NaN where a time is missing.
    pub(crate) fn seconds(&self, batch: &Batch, first: usize) -> Vec<f64> {
        match *self {
            Self::Affine { column, shift, factor } => affine(&batch.columns[column].values, shift, factor),
            Self::Parts { seconds, nanoseconds, shift } => {
                let part = &batch.columns[nanoseconds];
                let mut values = joined(&batch.columns[seconds].values, &part.values, part.origin);
                values.iter_mut().for_each(|v| *v += shift);
                values
            }
            Self::Rows { rate_hz } => (first..first + batch.rows).map(|i| i as f64 / rate_hz).collect(),
        }
    }
}

fn affine(cells: &[f64], shift: f64, factor: f64) -> Vec<f64> {
    cells.iter().map(|v| (v + shift) * factor).collect()
}

/// Whole seconds and nanoseconds together.
fn joined(seconds: &[f64], nanoseconds: &[f64], origin: i64) -> Vec<f64> {
    seconds.iter().zip(nanoseconds).map(|(s, ns)| s + (ns + origin as f64) * 1e-9).collect()
}

/// Plain times that start below this count from power-on, s: 11 days.
pub(crate) const POWER_ON_BELOW_S: f64 = 1e6;
/// Sample rates that a gyro log can have, Hz: the fastest gyros put out 32 kHz.
const SLOWEST_HZ: f64 = 0.01;
const FASTEST_HZ: f64 = 4e4;
/// Sample rates between which a guess is made, Hz.
const USUAL_HZ: std::ops::RangeInclusive<f64> = 0.5..=1e4;
/// Clocks that count in fractions of a unit below the second, and faster than this, are rather in seconds, Hz.
const USUAL_FRACTIONS_HZ: f64 = 2e3;
/// Steps looked at for the median.
const SAMPLE: usize = 10_000;

/// Chooses the time column. `wanted` is the user's choice; a drive (`from_log_start`) prefers `t_s` to the time since power-on,
/// which is then a channel of its own.
pub(crate) fn choose(source: &str, heads: &[Head], wanted: Option<&str>, from_log_start: bool) -> Result<TimeColumn> {
    if let Some(name) = wanted {
        let index = find(source, heads, name, "--time")?;
        if heads[index].kind == Kind::Other {
            let found = format!("the time column {name:?} holds {}", heads[index].type_name);
            return Err(
                Error::new(ErrorKind::Column, source, found).hint("name a column of numbers or dates with --time")
            );
        }
        return Ok(beside(heads, index).map_or(TimeColumn::One(index), |n| TimeColumn::Parts(index, n)));
    }
    let mut candidates: Vec<(TimeKind, TimeColumn)> = Vec::new();
    for (i, head) in heads.iter().enumerate().filter(|(_, h)| h.kind != Kind::Other) {
        let kind = match head.named().role {
            // a wall clock beside a time in numbers is the computer's
            Role::Time(TimeKind::Sensor) if head.type_name == CLOCK_TIME => TimeKind::Host,
            Role::Time(kind) | Role::TimePart { kind, nanoseconds: false } => kind,
            _ => continue,
        };
        let nanoseconds_of = |h: &Head| names::time_part(&h.name).filter(|(_, nanoseconds)| !nanoseconds);
        let is_part = names::time_part(&head.name).is_some_and(|(stem, nanoseconds)| {
            nanoseconds && heads.iter().any(|h| nanoseconds_of(h).is_some_and(|(whole, _)| whole == stem))
        });
        if !is_part {
            candidates.push((kind, beside(heads, i).map_or(TimeColumn::One(i), |n| TimeColumn::Parts(i, n))));
        }
    }
    let rank = |kind: TimeKind| match kind {
        TimeKind::SincePowerOn if from_log_start => TimeKind::Sensor,
        TimeKind::Sensor if from_log_start => TimeKind::SincePowerOn,
        other => other,
    };
    if candidates.is_empty() {
        // the one column of dates or clock times is the time, whatever it is called: `Date`, `Datum`
        let mut dated = heads.iter().enumerate().filter(|(_, h)| h.kind == Kind::Instant);
        if let (Some((only, _)), None) = (dated.next(), dated.next()) {
            return Ok(TimeColumn::One(only));
        }
        let named = |h: &&Head| h.kind == Kind::Other && matches!(names::parse(&h.name).role, Role::Time(_));
        if let Some(text) = heads.iter().find(named) {
            let found = format!(
                "the time column {:?} holds {}: neither numbers nor dates, nor clock times with hours",
                text.name, text.type_name
            );
            return Err(Error::new(ErrorKind::Column, source, found).hint(
                "write it in seconds or as HH:MM:SS.fff (a spreadsheet shows mm:ss.0 until the cells are given another \
                 format), or name another column with --time",
            ));
        }
    }
    let Some(best) = candidates.iter().map(|c| rank(c.0)).min() else {
        let found = format!("no time column; there are {}", list(heads));
        return Err(Error::new(ErrorKind::Column, source, found)
            .hint("name it with --time, or state the sample rate with --rate if the rows are evenly spaced"));
    };
    let best: Vec<_> = candidates.into_iter().filter(|c| rank(c.0) == best).map(|c| c.1).collect();
    match best[..] {
        [one] => Ok(one),
        _ => {
            let names: Vec<_> = best.iter().filter_map(|c| c.index()).map(|i| heads[i].name.as_str()).collect();
            let found = format!("several columns could be the time: {}", names.join(", "));
            Err(Error::new(ErrorKind::Column, source, found).hint("name one with --time"))
        }
    }
}

/// A column by the name that the user gave: as written, or else without regard to case.
pub(crate) fn find(source: &str, heads: &[Head], name: &str, option: &str) -> Result<usize> {
    let exact = heads.iter().position(|h| h.name == name);
    exact.or_else(|| heads.iter().position(|h| h.name.trim().eq_ignore_ascii_case(name.trim()))).ok_or_else(|| {
        let found = format!("no column {name:?}; there are {}", list(heads));
        let meant = nearest(name, heads.iter().map(|h| h.name.as_str()));
        Error::new(ErrorKind::Column, source, found).hint(format!("name one of them with {option}")).meant(meant)
    })
}

/// The column of nanoseconds that goes with the whole seconds in column `index`.
fn beside(heads: &[Head], index: usize) -> Option<usize> {
    let (stem, false) = names::time_part(&heads[index].name)? else { return None };
    heads.iter().position(|h| h.kind == Kind::Number && names::time_part(&h.name) == Some((stem.clone(), true)))
}

/// Times of evenly spaced rows.
pub(crate) fn by_rows(rows: usize, rate_hz: f64) -> Times {
    Times {
        seconds: (0..rows).map(|i| i as f64 / rate_hz).collect(),
        resolution_s: 0.0,
        clock: Clock::PowerOn { first_s: 0.0, stated: false },
        notes: vec![format!("time is counted by rows at {rate_hz} Hz, from power-on with the first row")],
        unit_note: None,
        complete: false,
        scale: Scale::Rows { rate_hz },
    }
}

/// Reads the time column as seconds on the recording's clock.
pub(crate) fn read(table: &Table, column: TimeColumn, stated: Option<TimeUnit>) -> Result<Times> {
    match column {
        TimeColumn::One(i) => {
            let (times, _, shift, factor) = one(table, i, stated)?;
            Ok(Times { seconds: affine(&table.cells[i].values, shift, factor), ..times })
        }
        TimeColumn::Parts(seconds, nanoseconds) => parts(table, seconds, nanoseconds),
        TimeColumn::Rows => Ok(by_rows(table.rows, 1.0)),
    }
}

/// The same; a single column is taken out of the table, so that a long log is not held twice.
pub(crate) fn take(table: &mut Table, column: TimeColumn, stated: Option<TimeUnit>) -> Result<Times> {
    let TimeColumn::One(i) = column else { return read(table, column, stated) };
    let (times, odd, shift, factor) = one(table, i, stated)?;
    let mut seconds = std::mem::take(&mut table.cells[i].values);
    if !(odd.none && shift == 0.0 && factor == 1.0) {
        scan::replace(&mut seconds, |v| (v + shift) * factor);
    }
    Ok(Times { seconds, ..times })
}

/// The times of one column without their values (`seconds` is empty), its odd cells, and shift and factor to seconds.
fn one(table: &Table, index: usize, stated: Option<TimeUnit>) -> Result<(Times, Odd, f64, f64)> {
    let cells = table.numbers(index)?;
    let head = &table.heads[index];
    let named = head.named();
    let mut unit_note = None;
    let odd = scan::odd(&cells.values);
    if let Some(row) = odd.first.and_then(|_| cells.values.iter().position(|v| v.is_infinite())) {
        return Err(table.error_at(ErrorKind::Time, row, index, "an infinite time").hint("correct or delete the row"));
    }
    let valid: Cow<[f64]> = if odd.first.is_some() {
        cells.values.iter().copied().filter(|v| !v.is_nan()).collect()
    } else {
        Cow::Borrowed(&cells.values)
    };
    let Some(&first) = valid.first() else {
        let found = format!("all {} times are missing", table.rows);
        return Err(Error::new(ErrorKind::Time, &table.source, found)
            .at(format!("column {:?}", head.name))
            .hint("name another time column with --time"));
    };
    let first = cells.origin as f64 + first;
    let step = typical_step(&valid);
    let written = head
        .unit
        .as_deref()
        .or(named.unit.as_deref())
        .and_then(|u| TimeUnit::parse(u.trim_matches(['(', ')', '[', ']'])));
    let date = head.kind == Kind::Instant;
    let unit = match (date, stated, written) {
        (true, _, _) => TimeUnit::Ns,
        (_, Some(unit), _) | (_, None, Some(unit)) => unit,
        (_, None, None) => {
            let fractional = valid.iter().take(SAMPLE).any(|v| v.fract() != 0.0);
            let (unit, why) = guess_unit(step, first, fractional).map_err(|why| {
                Error::new(ErrorKind::Unit, &table.source, why)
                    .at(format!("column {:?}", head.name))
                    .hint("state the unit: --time-unit s, ms, us or ns")
            })?;
            unit_note = Some(format!("time unit of {:?} guessed: {unit}, because {why}", head.name));
            unit
        }
    };
    let factor = unit.to_s();
    let rate_hz = 1.0 / (step * factor);
    if step > 0.0 && !(SLOWEST_HZ..=FASTEST_HZ).contains(&rate_hz) {
        let found = format!("read in {unit}, its steps of {} make a sample rate of {rate_hz:.3e} Hz", few_digits(step));
        let hint = match stated.filter(|_| !date) {
            Some(stated) => format!("leave out --time-unit {stated}, or state the unit that it is in: s, ms, us or ns"),
            None => "state the unit with --time-unit s, ms, us or ns, or name another column with --time".into(),
        };
        return Err(Error::new(ErrorKind::Unit, &table.source, found).at(format!("column {:?}", head.name)).hint(hint));
    }
    if let (Some(stated), false, Some(other)) = (stated, USUAL_HZ.contains(&rate_hz), unix_unit(first))
        && other != stated
        && USUAL_HZ.contains(&(1.0 / (step * other.to_s())))
    {
        let found =
            format!("read in {stated}, it is no date of this century and {rate_hz:.3e} Hz; in {other} it is both");
        return Err(Error::new(ErrorKind::Unit, &table.source, found)
            .at(format!("column {:?}", head.name))
            .hint(format!("leave out --time-unit {stated}, or state {other}")));
    }
    if let Some(stated) = stated.filter(|stated| !date && written != Some(*stated))
        && let Some(other) = contradicted(stated, written, step, valid.iter().take(SAMPLE).any(|v| v.fract() != 0.0))
    {
        let found = format!(
            "read in {stated}, its steps of {} make a sample rate of {rate_hz:.3e} Hz; in {other} they make {:.4} Hz",
            few_digits(step),
            1.0 / (step * other.to_s())
        );
        return Err(Error::new(ErrorKind::Unit, &table.source, found).at(format!("column {:?}", head.name)).hint(
            format!("leave out --time-unit {stated}; if it is right, say so in the column's name: time_{stated}"),
        ));
    }
    if let (Some(stated), Some(written)) = (stated, written)
        && stated != written
    {
        unit_note = Some(format!("{:?} says {written}; it is read as {stated}, as --time-unit asks", head.name));
    }
    let mut notes: Vec<String> = unit_note.iter().cloned().collect();
    let clock = clock_of(first * factor, date, &named.role);
    if let (Role::Time(TimeKind::Host), None) = (named.role, stated) {
        notes.push(format!(
            "{:?} is the time of a computer, not of the sensor: its jitter is that of the transport",
            head.name
        ));
    }
    let shift = match clock {
        Clock::PowerOn { .. } => cells.origin as f64,
        Clock::FirstSample { .. } => -valid[0],
    };
    notes.extend(clock_note(clock, &head.name));
    let scale = Scale::Affine { column: index, shift, factor };
    let complete = odd.first.is_none();
    let resolution_s = cells.resolution * factor;
    let times = Times { seconds: Vec::new(), resolution_s, clock, notes, unit_note, complete, scale };
    Ok((times, odd, shift, factor))
}

/// Seconds and nanoseconds in two columns.
fn parts(table: &Table, seconds: usize, nanoseconds: usize) -> Result<Times> {
    let (whole, part) = (table.numbers(seconds)?, table.numbers(nanoseconds)?);
    let nanosecond = |v: f64| v.is_nan() || (0.0..1e9).contains(&(v + part.origin as f64));
    if let Some(row) = part.values.iter().position(|v| !nanosecond(*v)) {
        let found = format!("{} is no part of a second in nanoseconds", part.values[row] + part.origin as f64);
        return Err(table
            .error_at(ErrorKind::Time, row, nanoseconds, found)
            .hint("name a column that holds the whole time with --time"));
    }
    let mut values = joined(&whole.values, &part.values, part.origin);
    let Some(&first) = values.iter().find(|v| !v.is_nan()) else {
        return Err(Error::new(ErrorKind::Time, &table.source, "all times are missing")
            .hint("name another column with --time, or state the sample rate with --rate"));
    };
    let clock = clock_of(whole.origin as f64 + first, false, &table.heads[seconds].named().role);
    let shift = match clock {
        Clock::PowerOn { .. } => whole.origin as f64,
        Clock::FirstSample { .. } => -first,
    };
    values.iter_mut().for_each(|v| *v += shift);
    let notes = clock_note(clock, &table.heads[seconds].name).into_iter().collect();
    let scale = Scale::Parts { seconds, nanoseconds, shift };
    Ok(Times { seconds: values, resolution_s: 1e-9, clock, notes, unit_note: None, complete: false, scale })
}

fn clock_of(first_s: f64, date: bool, role: &Role) -> Clock {
    let stated =
        matches!(role, Role::Time(TimeKind::SincePowerOn) | Role::TimePart { kind: TimeKind::SincePowerOn, .. });
    if !date && (stated || (0.0..POWER_ON_BELOW_S).contains(&first_s)) {
        Clock::PowerOn { first_s, stated }
    } else {
        Clock::FirstSample { file_s: first_s }
    }
}

fn clock_note(clock: Clock, name: &str) -> Option<String> {
    match clock {
        Clock::PowerOn { stated: true, .. } => None,
        Clock::PowerOn { first_s, .. } => {
            Some(format!("{name:?} starts at {first_s} s: taken as counted from power-on"))
        }
        Clock::FirstSample { .. } => Some(format!(
            "{name:?} does not count from power-on: time is counted from the first sample, so C1 and C2 hold for that moment"
        )),
    }
}

/// The unit in which a time column makes a usual sample rate, where the stated one is contradicted: by the column's name; or
/// where it makes fractions of itself faster than most gyros are, by seconds. A log may be slow where its user says so.
fn contradicted(stated: TimeUnit, written: Option<TimeUnit>, step: f64, fractional: bool) -> Option<TimeUnit> {
    let rate_hz = |unit: TimeUnit| 1.0 / (step * unit.to_s());
    let usual = |unit: &TimeUnit| step > 0.0 && USUAL_HZ.contains(&rate_hz(*unit));
    let too_fast = fractional && stated != TimeUnit::S && rate_hz(stated) > USUAL_FRACTIONS_HZ;
    match written {
        Some(written) => Some(written).filter(usual),
        None if too_fast => Some(TimeUnit::S).filter(usual),
        None => None,
    }
}

/// Rounded to four significant digits: further ones are the rounding of the times.
fn few_digits(v: f64) -> f64 {
    format!("{v:.3e}").parse().unwrap_or(v)
}

/// Median of the positive steps: duplicates and a few jumps do not move it.
fn typical_step(values: &[f64]) -> f64 {
    // evenly spread pairs of neighbours
    let stride = values.len().div_ceil(SAMPLE).max(1);
    let pairs = values.windows(2).step_by(stride);
    let mut steps: Vec<f64> = pairs.map(|w| w[1] - w[0]).filter(|d| *d > 0.0).collect();
    median(&mut steps)
}

const UNITS: [TimeUnit; 4] = [TimeUnit::S, TimeUnit::Ms, TimeUnit::Us, TimeUnit::Ns];

/// Unix times between 2001 and 2100, s.
pub(crate) const DATES_S: Range<f64> = 1e9..4.2e9;

/// The unit of such Unix times, which their size alone tells.
fn unix_unit(first: f64) -> Option<TimeUnit> {
    UNITS.into_iter().find(|u| DATES_S.contains(&(first * u.to_s())))
}

/// The unit of a time column that does not name it, by the size of its first value and of its steps.
fn guess_unit(step: f64, first: f64, fractional: bool) -> std::result::Result<(TimeUnit, String), String> {
    if step.is_nan() {
        return Ok((TimeUnit::S, "time stands still".to_string()));
    }
    if let Some(unit) = unix_unit(first) {
        return Ok((unit, "its values are then dates of this century".to_string()));
    }
    let rate = |u: TimeUnit| 1.0 / (step * u.to_s());
    let usual: Vec<_> = UNITS.into_iter().filter(|&u| USUAL_HZ.contains(&rate(u))).collect();
    match usual[..] {
        [unit] => Ok((unit, format!("its steps of {step:.4} are then a sample rate of {:.4} Hz", rate(unit)))),
        // counters of milliseconds and less are whole numbers
        [unit @ TimeUnit::S, ..] if fractional => {
            Ok((unit, format!("its values are fractions, at {:.4} Hz then", rate(unit))))
        }
        [] => Err(format!("names no unit, and steps of {step:.4} are no usual sample rate in any")),
        _ => {
            let rates: Vec<_> = usual.iter().map(|&u| format!("{:.4} Hz in {u}", rate(u))).collect();
            Err(format!("names no unit, and steps of {step:.4} could be {}", rates.join(" or ")))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn heads(names: &[&str]) -> Vec<Head> {
        let head = |n: &&str| Head::number(*n, "number");
        names.iter().map(head).collect()
    }

    #[test]
    fn the_sensors_clock_comes_before_the_hosts() {
        let pick = |names: &[&str], drive| choose("log", &heads(names), None, drive).map_err(|e| e.to_string());
        assert_eq!(pick(&["t_host_s", "t_s"], false), Ok(TimeColumn::One(1)));
        assert_eq!(pick(&["t_recv_s", "gz"], false), Ok(TimeColumn::One(0)));
        assert_eq!(pick(&["t_s", "time_since_power_on_s"], false), Ok(TimeColumn::One(1)));
        assert_eq!(pick(&["t_s", "time_since_power_on_s"], true), Ok(TimeColumn::One(0)));
        assert_eq!(pick(&["header.stamp.nanosec", "header.stamp.sec", "gz"], false), Ok(TimeColumn::Parts(1, 0)));
        assert_eq!(pick(&["sec", "nanosec", "gz"], false), Ok(TimeColumn::Parts(0, 1)));
        assert_eq!(pick(&["gz", "nsecs", "secs"], true), Ok(TimeColumn::Parts(2, 1)));
        assert_eq!(pick(&["stamp_sec", "stamp_nanosec"], false), Ok(TimeColumn::Parts(0, 1)));
        assert!(pick(&["t", "time"], false).unwrap_err().contains("several columns could be the time: t, time"));
        assert!(pick(&["gz", "ax"], false).unwrap_err().contains("no time column; there are gz, ax"));
    }

    #[test]
    fn units_are_guessed_only_where_one_fits() {
        for (step, first, fractional, unit) in [
            (0.01, 0.0, true, Some(TimeUnit::S)),
            (10.0, 5.0, false, Some(TimeUnit::Ms)),
            (10_000.0, 5.0, false, Some(TimeUnit::Us)),
            (1e7, 0.0, false, Some(TimeUnit::Ns)),
            (1.0, 1.7e9, false, Some(TimeUnit::S)),
            (10.0, 1.7e12, false, Some(TimeUnit::Ms)),
            (1e6, 1.7e18, false, Some(TimeUnit::Ns)),
            (1.0, 0.0, false, None),
            (1000.0, 0.0, false, None),
            // 6.5 Hz, or 6500 Hz in ms
            (0.154, 0.0, true, Some(TimeUnit::S)),
            (1.5, 0.0, true, Some(TimeUnit::S)),
            (10.003, 0.0, true, Some(TimeUnit::Ms)),
        ] {
            assert_eq!(guess_unit(step, first, fractional).ok().map(|g| g.0), unit, "{step} {first}");
        }
    }
}
