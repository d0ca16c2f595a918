//! A whole log: every numeric column, under its canonical name where it has one.

use super::clock::{self, TimeColumn};
use super::formats;
use super::names::{self, Role, TimeKind};
use super::recording::{find_gyro, named_unit, side_channel};
use super::table::{Kind, Table};
use crate::error::{Error, ErrorKind, Result};
use crate::signal::{Log, TimeAxis, names as channel};
use crate::units::TimeUnit;
use std::path::Path;

/// Reads all numeric columns of a log, such as a drive, on its time `t_s`.
///
/// Gyro, temperature and supply are converted to SI and named as in [`crate::signal::names`] where name and unit leave no doubt;
/// every other column keeps its name and its numbers. Missing values are NaN.
///
/// # Errors
/// [`ErrorKind::Io`], [`ErrorKind::Format`] if the file cannot be read; [`ErrorKind::Column`] without a time column;
/// [`ErrorKind::Time`] where time is missing or does not increase; [`ErrorKind::Value`] for words or infinity in a column of
/// numbers; [`ErrorKind::TooShort`] for a file without rows.
pub fn read_log(path: impl AsRef<Path>) -> Result<Log> {
    let path = path.as_ref();
    let source = formats::open(path)?;
    let wanted: Vec<bool> = source.heads().iter().map(|h| h.kind != Kind::Other).collect();
    let time = clock::choose(&path.display().to_string(), source.heads(), None, true)?;
    to_log(&source.read(&wanted)?, time)
}

fn to_log(table: &Table, time: TimeColumn) -> Result<Log> {
    let times = clock::read(table, time, None)?;
    let t = times.seconds;
    let column = time.index().unwrap_or_default();
    if let Some(row) = t.iter().position(|v| v.is_nan()) {
        return Err(table.error_at(ErrorKind::Time, row, column, "no time").mend("delete the row"));
    }
    if let Some(k) = t.windows(2).position(|w| w[1] <= w[0]) {
        let found = format!("time does not increase: {} s after {} s", t[k + 1], t[k]);
        let error = table.error_at(ErrorKind::Time, k + 1, column, found);
        return Err(error.mend("delete the row, or cut the log there if it was started anew"));
    }
    let step_s = t.last().zip(t.first()).map_or(0.0, |(b, a)| (b - a) / (t.len().max(2) - 1) as f64);
    let tolerance = if step_s > 0.0 { (times.resolution_s / step_s).clamp(1e-6, 0.5) } else { 0.0 };
    let mut log = Log::new(&table.source, TimeAxis::Explicit(t).compact(tolerance));
    let taken = |i: usize| match time {
        TimeColumn::One(a) => a == i,
        TimeColumn::Parts(a, b) => a == i || b == i,
        TimeColumn::Rows => false,
    };
    for i in (0..table.heads.len()).filter(|&i| table.heads[i].kind == Kind::Number && !taken(i)) {
        let (name, values) = channel_of(table, i)?;
        let name = if log.get(&name).is_some() { table.heads[i].name.clone() } else { name };
        log.push(name, values)?;
    }
    Ok(log)
}

/// A column as a channel: canonical where it leaves no doubt, else as it is.
fn channel_of(table: &Table, i: usize) -> Result<(String, Vec<f64>)> {
    let cells = table.numbers(i)?;
    if let Some(row) = cells.values.iter().position(|v| v.is_infinite()) {
        return Err(table.error_at(ErrorKind::Value, row, i, "an infinite value").mend("correct or delete the row"));
    }
    let head = &table.heads[i];
    let origin = cells.origin as f64;
    let scaled = |factor: f64| cells.values.iter().map(|v| factor * (v + origin)).collect::<Vec<f64>>();
    let named = names::parse(&head.name);
    let alone = |canonical: &str| {
        let same = |h: &&super::table::Head| h.kind == Kind::Number && names::parse(&h.name).role == named.role;
        head.name == canonical
            || (table.heads.iter().filter(same).count() == 1 && table.heads.iter().all(|h| h.name != canonical))
    };
    match named.role {
        Role::Gyro(Some(axis)) if find_gyro(&table.source, &table.heads, axis) == Ok(i) => {
            if let Ok(Some(unit)) = named_unit(table, i) {
                return Ok((format!("gyro_{axis}_rad_s"), scaled(unit.to_rad_s())));
            }
        }
        Role::Temperature if alone(channel::TEMPERATURE) => {
            if let (Some(values), _) = side_channel(table, i, named) {
                return Ok((channel::TEMPERATURE.to_string(), values));
            }
        }
        Role::Supply if alone(channel::SUPPLY) => {
            if let (Some(values), _) = side_channel(table, i, named) {
                return Ok((channel::SUPPLY.to_string(), values));
            }
        }
        Role::Time(TimeKind::SincePowerOn) if alone(channel::SINCE_POWER_ON) => {
            if let Some(unit) = named.unit.as_deref().and_then(TimeUnit::parse) {
                return Ok((channel::SINCE_POWER_ON.to_string(), scaled(unit.to_s())));
            }
        }
        _ => {}
    }
    Ok((head.name.clone(), scaled(1.0)))
}

/// `t_s` is the name of a log's time in every file that is written.
pub(super) const TIME: &str = "t_s";

/// A channel that is called like the time would be lost when the file is read back.
pub(super) fn check_names(log: &Log) -> Result<()> {
    match log.channels.iter().find(|c| c.name == TIME) {
        None => Ok(()),
        Some(_) => {
            Err(Error::new(ErrorKind::Column, &log.source, format!("a channel is called {TIME:?} like the time"))
                .mend("give the channel another name"))
        }
    }
}
