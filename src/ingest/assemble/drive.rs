//! Drives: every numeric column of one file or several, under its canonical name where it has one.

use super::merge;
use super::merge::Part;
use super::recording::{named_unit, side_scale};
use crate::error::{Error, ErrorKind, Result};
use crate::ingest::clean::clock;
use crate::ingest::clean::clock::{Clock, POWER_ON_BELOW_S, TimeColumn};
use crate::ingest::clean::decimals;
use crate::ingest::columns::channel_map::{ChannelMap, Mapped};
use crate::ingest::columns::channels;
use crate::ingest::columns::channels::Found;
use crate::ingest::columns::gravity::Accelerometer;
use crate::ingest::columns::gyro::{find_gyro, has_gyro};
use crate::ingest::columns::mounted::Mounted;
use crate::ingest::columns::mounting::Mounting;
use crate::ingest::columns::names;
use crate::ingest::columns::names::{Axis, Role, TimeKind};
use crate::ingest::columns::quantity::Conversion;
use crate::ingest::columns::scale::{Scale, Scaled};
use crate::ingest::formats::head::{Head, Kind};
use crate::ingest::formats::source::Source;
use crate::ingest::formats::table;
use crate::ingest::formats::table::Table;
use crate::ingest::formats::topics::Stamp;
use crate::ingest::formats::{self, Choice};
use crate::math::scan::{self, Odd};
use crate::signal::{Log, TimeAxis, names as channel};
use crate::units::{RateUnit, STANDARD_GRAVITY_M_S2, TimeUnit};
use std::path::Path;

/// How to read a drive, where its files leave a choice.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct DriveQuery {
    /// Columns that are certain channels, whatever they are called.
    pub maps: Vec<ChannelMap>,
    /// Name of the time column, in the files that have it.
    pub time: Option<String>,
    /// Unit of the time columns.
    pub time_unit: Option<TimeUnit>,
    /// Topics of the logs that hold several: each is read from the files that have it; otherwise the only one with a gyro.
    pub topics: Vec<String>,
    /// Which of the two times of a message counts.
    pub stamp: Stamp,
    /// How the gyro is mounted in the robot, whose yaw rate is then read from the sensor's axes.
    pub mounting: Option<Mounting>,
    /// Factors on columns, in the files that have them.
    pub scales: Vec<Scale>,
    /// Whether rows of text that do not parse are left out, and counted, instead of refused.
    pub skip_bad_rows: bool,
}

/// A drive, and what was decided about its columns.
#[derive(Debug, Clone, PartialEq)]
pub struct DriveRecording {
    /// The log; several files stand on the union of their times, with NaN where a file has no row.
    pub log: Log,
    /// Decisions that the reader took, in words.
    pub notes: Vec<String>,
    /// Files of which nothing is used, because files before them hold all of their channels: more likely they are another drive.
    pub repeats: Vec<String>,
}

/// Reads all numeric columns of a drive that one file holds, as [`read_drive`] without a query.
///
/// # Errors
/// As [`read_drive`].
pub fn read_log(path: impl AsRef<Path>) -> Result<Log> {
    Ok(read_drive(&[path], &DriveQuery::default())?.log)
}

/// Reads all numeric columns of a drive from its files.
///
/// Columns whose name and unit leave no doubt, and those that `query` maps, are converted to SI and named as in
/// [`crate::signal::names`]; every other column keeps its name and its numbers. Missing values are NaN. Files must be
/// on one clock: plain times are taken as they are, dates and Unix times count from the earliest of all files. Where
/// two files have the same channel, that of the first is used.
///
/// # Errors
/// [`ErrorKind::Io`], [`ErrorKind::Format`] if a file cannot be read; [`ErrorKind::Column`] without a time column, or
/// for a mapped column that is in no file; [`ErrorKind::Unit`] for a mapped column of another quantity;
/// [`ErrorKind::Time`] where time is missing or does not increase, or the files do not overlap; [`ErrorKind::Value`]
/// for words or infinity in a column of numbers; [`ErrorKind::TooShort`] for a file without rows;
/// [`ErrorKind::Usage`] without files, or with a channel mapped twice.
pub fn read_drive<P: AsRef<Path>>(paths: &[P], query: &DriveQuery) -> Result<DriveRecording> {
    let name = |p: &P| p.as_ref().display().to_string();
    let mut notes = Vec::new();
    let mut sources = Vec::new();
    let mut turned = false;
    let any = Choice { topic: None, stamp: query.stamp, unhashed: true, skip_bad_rows: query.skip_bad_rows };
    let mut used = vec![false; query.scales.len()];
    for path in paths {
        for chosen in formats::open_all(path.as_ref(), &query.topics, any, paths.len() > 1)? {
            notes.extend(chosen.note);
            let mut source = Scaled::of(chosen.source, &query.scales, &mut used);
            if let Some(mounting) = &query.mounting
                && has_gyro(source.heads())
            {
                let (mounted, told) = Mounted::of_drive(&name(path), source, mounting)?;
                notes.extend(told);
                source = Box::new(mounted);
                turned = true;
            }
            sources.push((name(path), source));
        }
    }
    if let (Some(first), true) = (paths.first(), sources.is_empty()) {
        return Err(Error::new(
            ErrorKind::Column,
            name(first),
            format!("no file has a topic {}", query.topics.join(", ")),
        )
        .hint("see what is there with `gyroid inspect`"));
    }
    if let (Some(scale), Some((first, source))) =
        (query.scales.iter().zip(&used).find(|(_, used)| !**used).map(|s| s.0), sources.first())
    {
        return Err(scale.missing(first, source.heads()));
    }
    if query.mounting.is_some()
        && let Some((first, _)) = sources.first()
    {
        check_mounting(first, turned, query)?;
    }
    let several = sources.len() > 1;
    let heads: Vec<(String, &[Head])> = sources.iter().map(|(name, s)| (name.clone(), s.heads())).collect();
    let Some((first, _)) = heads.first() else {
        return Err(Error::new(ErrorKind::Usage, "drive", "no file is given").hint("name one log at least"));
    };
    if let Some(time) = &query.time
        && heads.iter().all(|(source, heads)| clock::find(source, heads, time, "--time").is_err())
    {
        clock::find(first, heads[0].1, time, "--time")?;
    }
    let mapped = mapped(&heads, query, &mut notes)?;
    let mut parts = Vec::with_capacity(sources.len());
    for ((source, file), mapped) in sources.into_iter().zip(mapped) {
        let part = read_part(&source, file, query, mapped).map_err(|e| one_of_many(e, query))?;
        let tell = |note: String| if several { format!("{source}: {note}") } else { note };
        notes.extend(part.1.into_iter().map(tell));
        parts.push(part.0);
    }
    let repeats = repeats(&parts);
    let (log, merged) = merge::merge(parts)?;
    notes.extend(merged);
    Ok(DriveRecording { log, notes, repeats })
}

/// A mounting needs a gyro to turn, and one that is mapped is not turned.
fn check_mounting(source: &str, turned: bool, query: &DriveQuery) -> Result<()> {
    if query.maps.iter().any(|m| m.channel() == channel::GYRO_Z) {
        let found = format!("turns three columns into {}, and --map names one", channel::GYRO_Z);
        return Err(Error::new(ErrorKind::Usage, "--mounting", found).hint("leave out one of them"));
    }
    if !turned {
        return Err(Error::new(ErrorKind::Column, source, "there is no gyro, and --mounting says how it is mounted")
            .hint("leave it out, or add the log of the gyro"));
    }
    Ok(())
}

/// Files whose channels are all in those before them.
fn repeats(parts: &[Part]) -> Vec<String> {
    let known = |part: &Part| -> Vec<String> {
        let names = part.log.channels.iter().map(|c| c.name.clone());
        names.filter(|name| crate::ingest::columns::channels::of(name).is_some()).collect()
    };
    let mut taken: Vec<String> = Vec::new();
    let mut out = Vec::new();
    for part in parts {
        let own = known(part);
        if !own.is_empty() && own.iter().all(|name| taken.contains(name)) {
            out.push(part.log.source.clone());
        }
        taken.extend(own);
    }
    out
}

/// The columns of each file that the user maps, with their channels.
fn mapped(
    heads: &[(String, &[Head])],
    query: &DriveQuery,
    notes: &mut Vec<String>,
) -> Result<Vec<Vec<(&'static str, Mapped)>>> {
    let mut out: Vec<Vec<(&'static str, Mapped)>> = heads.iter().map(|_| Vec::new()).collect();
    for (k, map) in query.maps.iter().enumerate() {
        if query.maps[..k].iter().any(|m| m.channel() == map.channel()) {
            let found = format!("{} is mapped twice", map.channel());
            return Err(Error::new(ErrorKind::Usage, "--map", found).hint("map a channel once"));
        }
        let mut files = Vec::new();
        for (i, (source, heads)) in heads.iter().enumerate() {
            files.extend(map.find(source, heads)?.map(|m| (i, m)));
        }
        if files.len() > 1 {
            let names: Vec<_> = files.iter().map(|(i, _)| heads[*i].0.as_str()).collect();
            notes.push(format!("{} is in {}: that of {} is used", map.column(), names.join(", "), names[0]));
        }
        let (i, one) = files.into_iter().next().ok_or_else(|| map.missing(heads))?;
        if one.unit_assumed {
            notes.push(format!("{:?} states no unit: taken as {}", heads[i].1[one.column].name, map.quantity().si()));
        }
        out[i].push((one.channel, one));
    }
    Ok(out)
}

/// `error` without the advice to use an option that drives do not have.
fn one_of_many(mut error: Error, query: &DriveQuery) -> Error {
    if error.kind == ErrorKind::Column && query.time.is_none() && error.found.starts_with("no time column") {
        error.hint = Some("name it with --time".into());
    }
    error
}

fn read_part(
    source: &str,
    file: Box<dyn Source>,
    query: &DriveQuery,
    mapped: Vec<(&'static str, Mapped)>,
) -> Result<(Part, Vec<String>)> {
    let heads = file.heads();
    let wanted: Vec<bool> = heads.iter().map(|h| h.kind != Kind::Other).collect();
    let time = query.time.as_deref().filter(|name| clock::find(source, heads, name, "--time").is_ok());
    let time = clock::choose(source, heads, time, true)?;
    to_part(table::collect(file, &wanted)?, time, query, &mapped)
}

fn to_part(
    mut table: Table,
    time: TimeColumn,
    query: &DriveQuery,
    mapped: &[(&'static str, Mapped)],
) -> Result<(Part, Vec<String>)> {
    let times = clock::take(&mut table, time, query.time_unit)?;
    let t = times.seconds;
    let column = time.index().unwrap_or_default();
    if !times.complete
        && let Some(row) = scan::first_where(&t, |_, v| v.is_nan())
    {
        return Err(table.error_at(ErrorKind::Time, row, column, "no time").hint("delete the row"));
    }
    let repeated = t.windows(2).filter(|w| w[0] == w[1]).count();
    if repeated > 1 && 4 * repeated > t.len() {
        let (different, rows) = (t.len() - repeated, t.len());
        let found = format!("the stamps repeat: {rows} rows have {different} different ones, the clock is too coarse");
        return Err(Error::new(ErrorKind::Time, &table.source, found)
            .at(format!("column {:?}", table.heads[column].name))
            .hint(
                "log the time with its fractions of a second, leave out rows that were written twice, or name another column \
                 with --time",
            ));
    }
    if let Some(k) = scan::first_after(&t, |a, b| b <= a) {
        let found = format!("time does not increase: {} s after {} s", t[k], t[k - 1]);
        let error = table.error_at(ErrorKind::Time, k, column, found);
        return Err(error.hint("delete the row, or cut the log there if it was started anew"));
    }
    let step_s = t.last().zip(t.first()).map_or(0.0, |(b, a)| (b - a) / (t.len().max(2) - 1) as f64);
    let tolerance = if step_s > 0.0 { (times.resolution_s / step_s).clamp(1e-6, 0.5) } else { 0.0 };
    let mut log = Log::new(&table.source, TimeAxis::Explicit(t).compact(tolerance));
    let is_time = |i: usize| match time {
        TimeColumn::One(a) => a == i,
        TimeColumn::Parts(a, b) => a == i || b == i,
        TimeColumn::Rows => false,
    };
    let mut notes = table.notes.clone();
    notes.extend(times.unit_note);
    let mapped_anywhere = |name: &str| query.maps.iter().any(|m| m.claims(name));
    let found = channels::recognise(&table.heads, &mapped_anywhere, &mut notes);
    let gyro = gyro_column(&table);
    let unstated =
        gyro.filter(|_| !mapped_anywhere(channel::GYRO_Z)).and_then(|i| unstated_unit(&table, i, &mut notes));
    let columns = (0..table.heads.len()).filter(|&i| table.heads[i].kind == Kind::Number && !is_time(i));
    for i in columns.collect::<Vec<_>>() {
        let head = table.heads[i].name.clone();
        let odd = finite(&table, i)?;
        let known = match found.iter().find(|f| f.column == i) {
            Some(Found { channel, conversion, .. }) => Some((channel.to_string(), *conversion)),
            None => by_role(&table, i, gyro, unstated).filter(|(name, _)| !mapped_anywhere(name)),
        };
        let origin = table.cells[i].origin as f64;
        let values = std::mem::take(&mut table.cells[i].values);
        let mut named = mapped.iter().filter(|m| m.1.column == i).peekable();
        if named.peek().is_some() {
            for (name, Mapped { conversion, .. }) in named {
                log.push(*name, converted(values.clone(), origin, odd, *conversion))?;
            }
            continue;
        }
        if known.is_some() && table.is_text() {
            notes.extend(decimals::change(&values).map(|c| c.text(&head)));
        }
        let (name, conversion) = known.unwrap_or_else(|| (head.clone(), Conversion { factor: 1.0, offset: 0.0 }));
        let values = converted(values, origin, odd, conversion);
        // a note on its unit names the channel too
        let told = format!("{head:?} states no unit");
        if name != head && channels::of(&name).is_some() && !notes.iter().any(|n| n.starts_with(&told)) {
            notes.push(format!("{head:?} is read as {name}"));
        }
        let taken = |name: &str| log.get(name).is_some() || mapped_anywhere(name);
        let name = merge::free_name(&name, &table.source, &taken);
        log.push(name, values)?;
    }
    let (zero_s, dated) = zero_of(times.clock);
    Ok((Part { log, zero_s, dated }, notes))
}

/// Time of a log's zero by its file's clock, s, and whether that clock is of dates or of the time of day: a plain one may begin before
/// its zero.
fn zero_of(clock: Clock) -> (f64, bool) {
    match clock {
        Clock::PowerOn { .. } => (0.0, false),
        Clock::FirstSample { file_s } => (file_s, !(-POWER_ON_BELOW_S..0.0).contains(&file_s)),
    }
}

/// The numbers of a column, which are cells and `origin`, in SI.
fn converted(mut cells: Vec<f64>, origin: f64, odd: Odd, conversion: Conversion) -> Vec<f64> {
    let Conversion { factor, offset } = conversion;
    if !(odd.none && origin == 0.0 && factor == 1.0 && offset == 0.0) {
        scan::replace(&mut cells, |v| factor * (v + origin) + offset);
    }
    cells
}

/// Checks that a column holds numbers and none is infinite; returns the values that are not finite or negative zeros.
fn finite(table: &Table, i: usize) -> Result<Odd> {
    let cells = table.numbers(i)?;
    let odd = scan::odd(&cells.values);
    let infinite = |_, v: f64| v.is_infinite();
    match odd.first.and_then(|_| scan::first_where(&cells.values, infinite)) {
        None => Ok(odd),
        Some(row) => {
            Err(table.error_at(ErrorKind::Value, row, i, "an infinite value").hint("correct or delete the row"))
        }
    }
}

/// The gyro's yaw column: one that is called after the sensor before one that tells the motion (`yaw_rate`), which in
/// a filter's output is an estimate.
fn gyro_column(table: &Table) -> Option<usize> {
    let sensor = |i: &usize| {
        let head = &table.heads[*i];
        head.kind == Kind::Number
            && matches!(head.named().role, Role::Gyro(Some(Axis::Z)))
            && !names::tells_motion(&head.name)
    };
    let sensors: Vec<usize> = (0..table.heads.len()).filter(sensor).collect();
    match sensors[..] {
        [one] => Some(one),
        [] => find_gyro(&table.source, &table.heads, Axis::Z)
            .ok()
            .filter(|i| !(names::tells_motion(&table.heads[*i].name) && channels::is_result(&table.heads))),
        _ => sensors.into_iter().find(|i| table.heads[*i].name == channel::GYRO_Z),
    }
}

/// Mean specific force of an accelerometer in m/s²: gravity, with an offset of up to 50 mg.
const GRAVITY_M_S2: std::ops::RangeInclusive<f64> = 0.95 * STANDARD_GRAVITY_M_S2..=1.05 * STANDARD_GRAVITY_M_S2;

/// The unit of a gyro that states none: who logs the accelerometer beside it in SI logs both so. A drive does not tell by its
/// noise, which is that of the ground.
fn unstated_unit(table: &Table, gyro: usize, notes: &mut Vec<String>) -> Option<RateUnit> {
    let name = &table.heads[gyro].name;
    match named_unit(table, gyro) {
        Ok(Some(_)) => return None,
        Ok(None) => {}
        Err(error) => {
            let hint = error.hint.unwrap_or_default();
            notes.push(format!("{name:?} is not used: {}; {hint}", error.found));
            return None;
        }
    }
    let axis_mean = |i: usize| {
        let cells = &table.cells[i];
        let there = cells.values.iter().filter(|v| v.is_finite());
        let (sum, count) = there.fold((0.0, 0.0), |(sum, count), v| (sum + v, count + 1.0));
        sum / count + cells.origin as f64
    };
    let mean = Accelerometer::find(&table.heads)
        .map(|a| a.columns.iter().map(|&i| axis_mean(i).powi(2)).sum::<f64>().sqrt())
        .filter(|mean| GRAVITY_M_S2.contains(mean));
    let option = format!("--map {}={name}", channel::GYRO_Z);
    if let Some(mean) = mean {
        notes.push(format!(
            "{name:?} states no unit: taken as rad/s, for the accelerometer beside it is in m/s² (its mean is {mean:.2}); \
             otherwise {option}:UNIT"
        ));
        return Some(RateUnit::RadPerS);
    }
    notes.push(format!("{name:?} is not used: it states no unit; state it: {option}:rad/s or {option}:deg/s"));
    None
}

/// Name and conversion of a column of the gyro, of temperature, supply or time since power-on, where name and unit leave no
/// doubt.
fn by_role(table: &Table, i: usize, gyro: Option<usize>, unstated: Option<RateUnit>) -> Option<(String, Conversion)> {
    let head = &table.heads[i];
    let named = head.named();
    let scaled = |factor: f64| Conversion { factor, offset: 0.0 };
    let beside = |name: &str| -> Option<(String, Conversion)> {
        let ((factor, offset), _) = side_scale(table, i, named.clone()).ok()?;
        Some((name.to_string(), Conversion { factor, offset }))
    };
    let alone = |canonical: &str| {
        let same = |h: &&Head| h.kind == Kind::Number && h.named().role == named.role;
        head.name == canonical
            || (table.heads.iter().filter(same).count() == 1 && table.heads.iter().all(|h| h.name != canonical))
    };
    match named.role {
        Role::Gyro(axis) => {
            let axis = axis.unwrap_or_default();
            let own = match axis {
                Axis::Z => gyro == Some(i),
                _ => find_gyro(&table.source, &table.heads, axis) == Ok(i),
            };
            let unit = if own { named_unit(table, i).ok().flatten().or(unstated) } else { None };
            Some((format!("gyro_{axis}_rad_s"), scaled(unit?.to_rad_s())))
        }
        Role::Temperature if alone(channel::TEMPERATURE) => beside(channel::TEMPERATURE),
        Role::Supply if alone(channel::SUPPLY) => beside(channel::SUPPLY),
        Role::Time(TimeKind::SincePowerOn) if alone(channel::SINCE_POWER_ON) => {
            let unit = named.unit.as_deref().and_then(TimeUnit::parse)?;
            Some((channel::SINCE_POWER_ON.to_string(), scaled(unit.to_s())))
        }
        _ => None,
    }
}

/// `t_s` is the name of a log's time in every file that is written.
pub(crate) const TIME: &str = "t_s";

/// A channel that is called like the time would be lost when the file is read back.
pub(crate) fn check_names(log: &Log) -> Result<()> {
    match log.channels.iter().find(|c| c.name == TIME) {
        None => Ok(()),
        Some(_) => {
            Err(Error::new(ErrorKind::Column, &log.source, format!("a channel is called {TIME:?} like the time"))
                .hint("give the channel another name"))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_of_day_are_stamps_and_a_plain_clock_may_begin_early() {
        let first = |file_s| zero_of(Clock::FirstSample { file_s });
        // ten o'clock, midnight, a date
        for file_s in [36_000.0, 0.0, 1.7e9] {
            assert_eq!(first(file_s), (file_s, true));
        }
        assert_eq!(first(-0.4), (-0.4, false));
        assert_eq!(zero_of(Clock::PowerOn { first_s: 3.0, stated: false }), (0.0, false));
    }
}
