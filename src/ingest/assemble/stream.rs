//! One axis of a gyro, read once in bounded memory: the audit and the sums of a log of any length.

use super::plan::Plan;
use super::query::GyroQuery;
use super::recording;
use super::recording::{FEWEST, LARGEST_RATE};
use crate::error::{Error, ErrorKind, Result};
use crate::ingest::clean::audit::{Audit, Duplicates, Handling, Missing, OutOfOrder, WITNESSES};
use crate::ingest::clean::clock;
use crate::ingest::clean::clock::{Clock, Scale};
use crate::ingest::clean::rows::{COARSE_CLOCK, short};
use crate::ingest::clean::stream_audit;
use crate::ingest::clean::stream_audit::{Gaps, Runs};
use crate::ingest::columns::names::Named;
use crate::ingest::formats::source::{BATCH_ROWS, Batch, Facts};
use crate::ingest::formats::table::Table;
use crate::math::robust::median;
use crate::signal::slots::GAP_STEPS;
use crate::signal::{Limits, Reduced, Reducer};
use crate::units::RateUnit;

/// Rows that say how times are read.
pub(crate) const HEAD_ROWS: usize = BATCH_ROWS;

/// One axis of a gyro at rest that was read once, and not held.
#[derive(Debug, Clone)]
pub struct StreamedRecording {
    /// Summary that the pass kept: the rate in rad/s, temperature in °C where it is there.
    pub log: Reduced,
    /// Name of the rate column in the file.
    pub column: String,
    /// Unit of the rate in the file.
    pub unit: RateUnit,
    /// Whether the unit was guessed.
    pub unit_guessed: bool,
    /// Zero of the times.
    pub clock: Clock,
    /// Defects of the log. Percentiles of the steps come from intervals spread over the log, level, noise and lattice
    /// from the raw stretches, motion from the block means; all else from every row.
    pub audit: Audit,
    /// Lowest and highest temperature, °C.
    pub temperature_c: Option<[f64; 2]>,
    /// Decisions that the reader took, in words.
    pub notes: Vec<String>,
    /// SHA-256 of the file's bytes, hexadecimal.
    pub sha256: String,
}

/// A pass over the rows of a table.
pub(crate) struct Pass<'a> {
    query: &'a GyroQuery,
    plan: &'a Plan,
    /// The table without its rows, for messages.
    about: Table,
    scale: Scale,
    clock: Clock,
    notes: Vec<String>,
    temperature: Option<Temperature>,
    reducer: Reducer,
    rows: usize,
    missing: Missing,
    duplicates: usize,
    first_duplicate: Option<usize>,
    /// Duplicates that repeat the value too.
    same_value: usize,
    /// Last row's time and rate, in the file's unit.
    last: Option<(f64, f64)>,
    first_s: f64,
    /// Largest rate by its size, in the file's unit, and its row.
    largest: (f64, usize),
    varies: bool,
    runs: Runs,
    gaps: Gaps,
}

/// A temperature column's cells as °C.
struct Temperature {
    column: usize,
    factor: f64,
    offset: f64,
    low: f64,
    high: f64,
}

impl<'a> Pass<'a> {
    /// A pass that keeps what `limits` allow. The `head` of a file says how its times are read and how far apart they are; its
    /// rows are still to be added.
    pub(crate) fn new(head: &Table, plan: &'a Plan, query: &'a GyroQuery, limits: Limits) -> Result<Self> {
        if query.sort_time {
            return Err(Error::new(ErrorKind::Usage, "--sort-time", "needs all rows of the log at once")
                .hint("raise --memory so that the log is held, or sort the file"));
        }
        let times = match query.rate_hz {
            Some(rate_hz) => clock::by_rows(head.rows, rate_hz),
            None => clock::read(head, plan.time, query.time_unit)?,
        };
        let raw = head.numbers(plan.gyro)?;
        let values = raw.values.iter().map(|v| v + raw.origin as f64);
        let there: Vec<(f64, f64)> =
            times.seconds.iter().copied().zip(values).filter(|(t, v)| t.is_finite() && v.is_finite()).collect();
        let mut steps: Vec<f64> = there.windows(2).map(|w| w[1].0 - w[0].0).filter(|d| *d > 0.0).collect();
        if steps.is_empty() {
            let found = format!("no two usable samples in the first {} rows", head.rows);
            return Err(Error::new(ErrorKind::TooShort, &head.source, found)
                .hint("cut the beginning off, or raise --memory so that the log is held"));
        }
        let middle = median(&mut steps);
        // a clock that is coarser than the sampling has steps about its mean
        let (sum, count) =
            steps.iter().filter(|d| **d <= GAP_STEPS * middle).fold((0.0, 0.0), |(s, n), d| (s + d, n + 1.0));
        let reference = there.iter().map(|p| p.1).sum::<f64>() / there.len() as f64;
        let mut notes = plan.notes.clone();
        notes.extend(times.notes);
        let temperature = plan.temperature.and_then(|column| {
            let named: Named = head.heads[column].named();
            match recording::side_scale(head, column, named) {
                Ok(((factor, offset), note)) => {
                    notes.extend(note);
                    Some(Temperature { column, factor, offset, low: f64::INFINITY, high: f64::NEG_INFINITY })
                }
                Err(why) => {
                    notes.push(why);
                    None
                }
            }
        });
        let reducer = Reducer::new(sum / count, reference, temperature.is_some(), limits);
        let (scale, clock) = (times.scale, times.clock);
        Ok(Self {
            query,
            plan,
            about: head.first(0),
            scale,
            clock,
            notes,
            temperature,
            reducer,
            rows: 0,
            missing: Missing { count: 0, first_row: None, handling: Handling::Dropped },
            duplicates: 0,
            first_duplicate: None,
            same_value: 0,
            last: None,
            first_s: f64::NAN,
            largest: (0.0, 0),
            varies: false,
            runs: Runs::default(),
            gaps: Gaps::new(middle),
        })
    }

    /// Takes the next rows.
    pub(crate) fn add(&mut self, batch: &Batch) -> Result<()> {
        let seconds = self.scale.seconds(batch, self.rows);
        let rate = &batch.columns[self.plan.gyro];
        let origin = rate.origin as f64;
        for (i, (&time_s, cell)) in seconds.iter().zip(&rate.values).enumerate() {
            let (row, value) = (self.rows + i, cell + origin);
            if value.is_infinite() || time_s.is_infinite() {
                return Err(self.infinite(row, value.is_infinite()));
            }
            if value.is_nan() || time_s.is_nan() {
                self.missing.count += 1;
                self.missing.first_row.get_or_insert(row + 1);
                continue;
            }
            if let Some((before_s, before)) = self.last {
                if time_s < before_s {
                    return Err(self.backwards(row, before_s - time_s));
                }
                if time_s == before_s {
                    self.duplicates += 1;
                    self.first_duplicate.get_or_insert(row + 1);
                    self.same_value += usize::from(value == before);
                    // duplicates are held against the row before them, as they stand in the file
                    self.last = Some((time_s, value));
                    continue;
                }
                self.gaps.add(before_s, time_s);
            } else {
                self.first_s = time_s;
            }
            self.varies |= self.last.is_some_and(|l| l.1 != value);
            self.last = Some((time_s, value));
            if value.abs() > self.largest.0 {
                self.largest = (value.abs(), row);
            }
            self.runs.add(time_s, value);
            let warmth = match &mut self.temperature {
                Some(t) => t.at(batch, i),
                None => f64::NAN,
            };
            self.reducer.push(time_s, value, warmth);
        }
        self.rows += batch.rows;
        Ok(())
    }

    /// Rows so far.
    pub(crate) fn rows(&self) -> usize {
        self.rows
    }

    fn infinite(&self, row: usize, rate: bool) -> Error {
        let error = match (rate, self.plan.time.index()) {
            (false, Some(column)) => self.about.error_at(ErrorKind::Time, row, column, "an infinite time"),
            _ => self.about.error_at(ErrorKind::Value, row, self.plan.gyro, "an infinite rate"),
        };
        error.hint("correct or delete the row")
    }

    fn backwards(&self, row: usize, by_s: f64) -> Error {
        let column = self.plan.time.index().unwrap_or(self.plan.gyro);
        let found = format!("time goes back by {} s", short(by_s));
        self.about.error_at(ErrorKind::Time, row, column, found).hint(
            "cut the log there if it was started anew, or sort the file; --sort-time needs the log in memory (--memory)",
        )
    }

    /// The recording, when all rows were read.
    pub(crate) fn finish(mut self, facts: Facts) -> Result<StreamedRecording> {
        let gyro = self.plan.gyro;
        self.about.source = facts.source;
        self.about.first_line = facts.first_line;
        for (cells, column) in self.about.cells.iter_mut().zip(facts.columns) {
            cells.bad = column.bad;
        }
        for column in [Some(gyro), self.plan.time.index()].into_iter().flatten() {
            self.about.numbers(column)?;
        }
        let duplicates = self.judge_duplicates()?;
        let count = self.reducer.count();
        if count < FEWEST {
            let found = format!("{count} usable samples of {} rows; a fit needs {FEWEST}", self.rows);
            return Err(Error::new(ErrorKind::TooShort, &self.about.source, found).hint("record longer"));
        }
        let name = self.about.heads[gyro].name.clone();
        if !self.varies {
            let value = self.last.map_or(f64::NAN, |l| l.1);
            let found = format!("the rate is {value} in all {count} samples");
            return Err(Error::new(ErrorKind::Value, &self.about.source, found)
                .at(format!("column {name:?}"))
                .hint("check that the sensor was read, or name another column with --column"));
        }
        let source = self.about.source.clone();
        let log = self.reducer.finish().map_err(|e| e.named(&source))?;
        let step_s = median(&mut log.steps_s.clone());
        let witnesses = stream_audit::witnesses(&log, WITNESSES);
        let decision = recording::unit_of(&self.about, gyro, self.query, &witnesses, step_s)?;
        let mut notes = facts.notes;
        notes.append(&mut self.notes);
        if self.query.reversed {
            notes.push(format!("{name:?} is read with the other sign, as --axis asks"));
        }
        let to_si = decision.unit.to_rad_s();
        let (largest, row) = self.largest;
        if largest * to_si > LARGEST_RATE {
            let found = format!("a rate of {largest:e} {}, beyond any gyro", decision.unit);
            return Err(self
                .about
                .error_at(ErrorKind::Value, row, gyro, found)
                .hint("correct or delete the row, or state the right unit with --unit"));
        }
        notes.extend(decision.note.iter().map(|n| format!("{name:?}: {n}")));
        let factor = if self.query.reversed { -to_si } else { to_si };
        let log = log.scaled(factor);
        notes.push(log.text());
        // rows that were left out may have moved the first sample
        let (clock, shift_s) = match self.clock {
            Clock::PowerOn { stated, .. } => (Clock::PowerOn { first_s: self.first_s, stated }, 0.0),
            Clock::FirstSample { file_s } => (Clock::FirstSample { file_s: file_s + self.first_s }, -self.first_s),
        };
        let before = crate::ingest::clean::audit::Before {
            rows: self.rows,
            duplicates,
            out_of_order: OutOfOrder { count: 0, handling: Handling::Sorted },
            missing: self.missing,
        };
        let log = log.shifted(shift_s);
        let audit = stream_audit::judge(before, &log, self.runs.shifted(shift_s), self.gaps.shifted(shift_s), factor);
        Ok(StreamedRecording {
            log,
            column: name,
            unit: decision.unit,
            unit_guessed: decision.guessed,
            clock,
            audit,
            temperature_c: self.temperature.filter(|t| t.low <= t.high).map(|t| [t.low, t.high]),
            notes,
            sha256: facts.sha256,
        })
    }

    /// Repeated stamps were dropped; a clock that is coarser than the sampling cannot be known before the end.
    fn judge_duplicates(&self) -> Result<Duplicates> {
        let (count, rows) = (self.duplicates, self.reducer.count() + self.duplicates);
        let coarse = count as f64 > COARSE_CLOCK * rows as f64 && self.same_value * 10 < count * 9;
        if coarse {
            let found = format!("{count} of {rows} rows repeat a time stamp: the clock is coarser than the sampling");
            let mut error = Error::new(ErrorKind::Time, &self.about.source, found);
            if let Some(column) = self.plan.time.index() {
                error = error.at(format!("column {:?}", self.about.heads[column].name));
            }
            return Err(error.hint(
                "state the sample rate with --rate, or raise --memory so that the log is held and its stamps are spread",
            ));
        }
        Ok(Duplicates { count, first_row: self.first_duplicate, handling: Handling::Dropped })
    }
}

impl Temperature {
    fn at(&mut self, batch: &Batch, row: usize) -> f64 {
        let column = &batch.columns[self.column];
        let value = self.factor * (column.values[row] + column.origin as f64) + self.offset;
        if value.is_finite() {
            self.low = self.low.min(value);
            self.high = self.high.max(value);
        }
        value
    }
}
