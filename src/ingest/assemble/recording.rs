//! One axis of a gyro, read for the fit.

use super::plan::Plan;
use super::query::GyroQuery;
use crate::error::{Error, ErrorKind, Result};
use crate::ingest::clean::audit;
use crate::ingest::clean::audit::{Audit, Before, Handling, Missing};
use crate::ingest::clean::clock;
use crate::ingest::clean::clock::Clock;
use crate::ingest::clean::decimals;
use crate::ingest::clean::rows;
use crate::ingest::clean::rows::Rows;
use crate::ingest::columns::names;
use crate::ingest::columns::names::{Named, Role};
use crate::ingest::columns::rate_unit;
use crate::ingest::columns::rate_unit::Evidence;
use crate::ingest::formats::table::Table;
use crate::math::robust::{median, stretches};
use crate::math::scan;
use crate::signal::{Log, TimeAxis, names as channel};
use crate::units::RateUnit;
use std::borrow::Cow;

/// One axis of a gyro at rest, and all that there is to say about it.
#[derive(Debug, Clone)]
pub struct GyroRecording {
    /// The rate as channel `gyro_z_rad_s`, whatever axis was read; `temperature_c` and `supply_v` where they are there. Time strictly
    /// increases; the rate has no missing values, the other channels may.
    pub log: Log,
    /// Name of the rate column in the file.
    pub column: String,
    /// Unit of the rate in the file.
    pub unit: RateUnit,
    /// Whether the unit was guessed.
    pub unit_guessed: bool,
    /// Zero of the times.
    pub clock: Clock,
    /// Defects of the log.
    pub audit: Audit,
    /// Decisions that the reader took, in words.
    pub notes: Vec<String>,
    /// SHA-256 of the file's bytes, hexadecimal.
    pub sha256: String,
}

/// Rates beyond this are no gyro's, rad/s (5730 °/s).
pub(crate) const LARGEST_RATE: f64 = 100.0;
/// Fewer samples fit no model.
pub(crate) const FEWEST: usize = 3;
/// An axis is even if its times lie on a lattice within this, in steps ...
const FLOAT_TOLERANCE: f64 = 1e-6;
/// ... or within the rounding of the file, which counts up to half a step.
const MOST_TOLERANCE: f64 = 0.5;

/// Makes a recording of a file's columns. They are changed where they lie: a long log is not held twice.
pub(crate) fn assemble(mut table: Table, plan: &Plan, query: &GyroQuery) -> Result<GyroRecording> {
    let gyro = plan.gyro;
    let origin = table.numbers(gyro)?.origin;
    // a column may be asked for by name, and be a side channel too
    let is_beside = |column: Option<usize>| column.is_some() && [plan.temperature, plan.supply].contains(&column);
    let mut notes = table.notes.clone();
    notes.extend(plan.notes.iter().cloned());
    let times = match query.rate_hz {
        Some(rate_hz) => clock::by_rows(table.rows, rate_hz),
        None if is_beside(plan.time.index()) => clock::read(&table, plan.time, query.time_unit)?,
        None => clock::take(&mut table, plan.time, query.time_unit)?,
    };
    let mut values = match is_beside(Some(gyro)) {
        true => table.cells[gyro].values.clone(),
        false => std::mem::take(&mut table.cells[gyro].values),
    };
    let table = &table;
    if origin != 0 {
        scan::replace(&mut values, |v| v + origin as f64);
    }
    if table.is_text() {
        notes.extend(decimals::change(&values).map(|c| c.text(&table.heads[gyro].name)));
    }
    let odd = scan::first_where(&values, |_, v| !v.is_finite());
    if let Some(row) = odd.and_then(|_| values.iter().position(|v| v.is_infinite())) {
        return Err(table.error_at(ErrorKind::Value, row, gyro, "an infinite rate").hint("correct or delete the row"));
    }
    let lacks = |i: usize| values[i].is_nan() || times.seconds[i].is_nan();
    let no_time = if times.complete { None } else { scan::first_where(&times.seconds, |_, t| t.is_nan()) };
    let first_missing = [odd, no_time].into_iter().flatten().min();
    let mut rows = match first_missing {
        None => Rows::All(table.rows),
        Some(_) => Rows::These((0..table.rows).filter(|&i| !lacks(i)).collect()),
    };
    let missing = Missing {
        count: table.rows - rows.len(),
        first_row: first_missing.map(|i| i + 1),
        handling: Handling::Dropped,
    };
    if rows.len() == 0 {
        let found = format!("all {} values are missing", table.rows);
        return Err(Error::new(ErrorKind::Value, &table.source, found)
            .at(format!("column {:?}", table.heads[gyro].name))
            .hint("name another column with --column"));
    }
    let (mut time_s, duplicates, out_of_order) =
        rows::in_order(table, plan, times.seconds, &values, &mut rows, query.sort_time)?;
    if rows.len() < FEWEST {
        let found = format!("{} usable samples of {} rows; a fit needs {FEWEST}", rows.len(), table.rows);
        return Err(Error::new(ErrorKind::TooShort, &table.source, found).hint("record longer"));
    }
    // rows that were sorted or left out may have moved the first sample
    let clock = match times.clock {
        Clock::PowerOn { stated, .. } => Clock::PowerOn { first_s: time_s[0], stated },
        Clock::FirstSample { file_s } => {
            let first_s = time_s[0];
            time_s.iter_mut().for_each(|t| *t -= first_s);
            Clock::FirstSample { file_s: file_s + first_s }
        }
    };
    let mut values = rows.of(Cow::Owned(values)).into_owned();
    if values.iter().all(|v| *v == values[0]) {
        let found = format!("the rate is {} in all {} samples", values[0], values.len());
        return Err(Error::new(ErrorKind::Value, &table.source, found)
            .at(format!("column {:?}", table.heads[gyro].name))
            .hint("check that the sensor was read, or name another column with --column"));
    }
    let step_s = median(&mut audit::intervals(&time_s));
    let decision = unit_of(table, gyro, query, &stretches(&values, audit::WITNESSES), step_s)?;
    let factor = if query.reversed { -decision.unit.to_rad_s() } else { decision.unit.to_rad_s() };
    if query.reversed {
        notes.push(format!("{:?} is read with the other sign, as --axis asks", table.heads[gyro].name));
    }
    if let Some(k) = scan::first_where(&values, |_, v| (v * factor).abs() > LARGEST_RATE) {
        let found = format!("a rate of {:e} {}, beyond any gyro", values[k], decision.unit);
        return Err(table
            .error_at(ErrorKind::Value, rows.at(k), gyro, found)
            .hint("correct or delete the row, or state the right unit with --unit"));
    }
    if factor != 1.0 {
        scan::replace(&mut values, |v| v * factor);
    }
    let rate = values;
    notes.extend(decision.note.iter().map(|n| format!("{:?}: {n}", table.heads[gyro].name)));
    notes.extend(times.notes);
    let tolerance = (times.resolution_s / step_s).clamp(FLOAT_TOLERANCE, MOST_TOLERANCE);
    let before = Before { rows: table.rows, duplicates, out_of_order, missing };
    let (axis, stamps_s) = match TimeAxis::even(&time_s, tolerance) {
        Some(even) => (even, time_s),
        None => (TimeAxis::Explicit(time_s), Vec::new()),
    };
    let audit = match &axis {
        TimeAxis::Explicit(t) => audit::judge(before, t, &axis, &rate),
        TimeAxis::Uniform { .. } => audit::judge(before, &stamps_s, &axis, &rate),
    };
    let mut log = Log::new(&table.source, axis);
    log.push(channel::GYRO_Z, rate)?;
    for (column, name) in [(plan.temperature, channel::TEMPERATURE), (plan.supply, channel::SUPPLY)] {
        let Some(column) = column else { continue };
        match beside(table, column, &rows, &mut notes) {
            Some(values) => log.push(name, values)?,
            None => continue,
        }
    }
    Ok(GyroRecording {
        log,
        column: table.heads[gyro].name.clone(),
        unit: decision.unit,
        unit_guessed: decision.guessed,
        clock,
        audit,
        notes,
        sha256: table.sha256.clone(),
    })
}

/// Unit that stands beside or in a column's name; an error if it is one that is not known.
pub(crate) fn named_unit(table: &Table, column: usize) -> Result<Option<RateUnit>> {
    let head = &table.heads[column];
    let named = head.named().unit;
    let Some(text) = named.as_deref().or(head.unit.as_deref()).map(|t| t.trim_matches(['(', ')', '[', ']'])) else {
        return Ok(None);
    };
    RateUnit::parse(text).map(Some).ok_or_else(|| {
        if names::is_raw(text) {
            return Error::new(ErrorKind::Unit, &table.source, "holds the sensor's own counts")
                .at(format!("column {:?}", head.name))
                .hint(format!(
                    "state what one is worth, by the data sheet: --scale {}=1/131:deg/s is an MPU-6050 at ±250 deg/s",
                    head.name
                ));
        }
        Error::new(ErrorKind::Unit, &table.source, format!("the unit {text:?} is not known"))
            .at(format!("column {:?}", head.name))
            .hint("state it: --unit rad/s, mrad/s, deg/s, mdeg/s or deg/h")
    })
}

pub(crate) fn unit_of(
    table: &Table,
    gyro: usize,
    query: &GyroQuery,
    rate: &[f64],
    step_s: f64,
) -> Result<rate_unit::Decision> {
    let named = match query.unit {
        Some(_) => named_unit(table, gyro).unwrap_or(None),
        None => named_unit(table, gyro)?,
    };
    rate_unit::decide(query.unit, named, &Evidence::of(rate, step_s)).map_err(|question| {
        Error::new(ErrorKind::Unit, &table.source, question)
            .at(format!("column {:?}", table.heads[gyro].name))
            .hint("state the unit: --unit rad/s or --unit deg/s; the log must be one at rest")
    })
}

/// Temperature in °C or supply in V; `None`, with a note, if its unit cannot be told.
fn beside(table: &Table, column: usize, rows: &Rows, notes: &mut Vec<String>) -> Option<Vec<f64>> {
    let cells = &table.cells[column];
    match side_scale(table, column, table.heads[column].named()) {
        Ok(((factor, offset), note)) => {
            notes.extend(note);
            let all = cells.values.iter().map(|v| factor * (v + cells.origin as f64) + offset).collect();
            Some(rows.of(all).into_owned())
        }
        Err(why) => {
            notes.push(why);
            None
        }
    }
}

type SideScale = ((f64, f64), Option<String>);

/// Factor and offset that make °C or V of a column, and what there is to say about it; or why it is not used.
pub(crate) fn side_scale(table: &Table, column: usize, named: Named) -> std::result::Result<SideScale, String> {
    let head = &table.heads[column];
    let Ok(cells) = table.numbers(column) else {
        return Err(format!("{:?} is not used: it is not all numbers", head.name));
    };
    let mut there: Vec<f64> = cells.values.iter().copied().filter(|v| v.is_finite()).collect();
    if there.is_empty() {
        return Err(format!("{:?} is not used: it is empty", head.name));
    }
    let centre = median(&mut there) + cells.origin as f64;
    let written = named.unit.as_deref().or(head.unit.as_deref());
    let known = written.and_then(|u| names::environment_factor(named.role, u.trim_matches(['(', ')', '[', ']'])));
    let (factor, offset, note) = match (known, named.role) {
        (Some((factor, offset)), _) => (factor, offset, None),
        (None, Role::Temperature) if (-60.0..=150.0).contains(&centre) => (1.0, 0.0, Some("°C")),
        (None, Role::Temperature) if (200.0..=425.0).contains(&centre) => (1.0, -273.15, Some("K")),
        (None, Role::Supply) if (0.5..=60.0).contains(&centre) => (1.0, 0.0, Some("V")),
        (None, Role::Supply) if (500.0..=60_000.0).contains(&centre) => (1e-3, 0.0, Some("mV")),
        _ => {
            return Err(format!("{:?} is not used: its unit cannot be told, its median is {centre}", head.name));
        }
    };
    let note = note.map(|unit| format!("{:?}: unit guessed: {unit}, from a median of {centre:.4}", head.name));
    Ok(((factor, offset), note))
}

impl GyroRecording {
    /// The same recording without the samples that move ([`Audit::motion`]); the audit stays that of the whole log.
    ///
    /// # Errors
    /// [`ErrorKind::TooShort`] if fewer than three samples remain.
    pub fn without_motion(mut self) -> Result<Self> {
        let intervals = &self.audit.motion.intervals;
        if intervals.is_empty() {
            return Ok(self);
        }
        let time_s = self.log.time.to_vec();
        let rests = |t: f64| !intervals.iter().any(|i| (i.start_s..=i.end_s).contains(&t));
        let keep: Vec<bool> = time_s.iter().map(|&t| rests(t)).collect();
        let kept = |x: &[f64]| x.iter().zip(&keep).filter(|p| *p.1).map(|p| *p.0).collect::<Vec<f64>>();
        let time_s = kept(&time_s);
        if time_s.len() < FEWEST {
            let found = format!("only {} samples are at rest; a fit needs {FEWEST}", time_s.len());
            return Err(Error::new(ErrorKind::TooShort, &self.log.source, found)
                .hint("record the gyro at rest, or fit the whole log without --trim-motion"));
        }
        let mut log = Log::new(&self.log.source, TimeAxis::Explicit(time_s));
        for c in &self.log.channels {
            log.push(&c.name, kept(&c.values))?;
        }
        let removed = self.log.len() - log.len();
        self.notes.push(format!("{removed} samples in {} moving stretches are left out", intervals.len()));
        self.log = log;
        Ok(self)
    }
}
