//! ln p(drives | θ) = Σ_d ln p(drive d | θ)
//!
//! Several drives of one robot as one record. Effects and their parameters are the same in all drives; quantities that
//! are drawn anew in each run (start, turn-on bias, walk of the gyro's bias) are separate for each drive, and so are known
//! loads. No state is carried from one drive to the next: [`Record::drives`] gives their rows.

use super::Record;
use crate::config::Config;
use crate::error::{Error, ErrorKind, Result};
use crate::gap::diagnosis::Drive;
use crate::math::robust::median;
use std::ops::Range;

/// Largest ratio of sample times. The stated white noise is that of one reading, and scales with the square root of the
/// rate: a ratio of 1.25 changes it by an eighth.
const RATES: f64 = 1.25;

impl Record {
    /// Joins several drives of one robot.
    ///
    /// # Errors
    /// As [`Record::new`] of each; [`ErrorKind::Column`] where one has torques, a gyro or a pose and another has not;
    /// [`ErrorKind::Time`] where wheels or gyro are read at rates that differ by more than a quarter;
    /// [`ErrorKind::TooShort`] without any drive.
    pub(crate) fn of_drives(config: &Config, drives: &[Drive<'_>]) -> Result<Self> {
        let parts = drives.iter().map(|d| Self::of_drive(config, d)).collect::<Result<Vec<_>>>()?;
        let Some((first, others)) = parts.split_first() else {
            return Err(Error::new(ErrorKind::TooShort, "recordings", "no drive").hint("give at least one recording"));
        };
        if others.is_empty() {
            return Ok(first.clone());
        }
        for other in others {
            same_channels(first, other)?;
            same_rates(first, other)?;
        }
        let notes = merged_notes(&parts);
        let mut joined = Self { notes, ..first.clone().followed_by(others.iter().cloned()) };
        let steps = |rows: Range<usize>| joined.times_s[rows].windows(2).map(|w| w[1] - w[0]);
        let mut steps: Vec<f64> = joined.drives().flat_map(steps).collect();
        joined.step_s = median(&mut steps);
        Ok(joined)
    }

    /// Prepares the log of one drive, with its load.
    ///
    /// # Errors
    /// As [`Record::new`]; [`ErrorKind::Value`] if the load is no mass.
    fn of_drive(config: &Config, drive: &Drive<'_>) -> Result<Self> {
        let named = |e: Error| if e.input == "load" { e.named(&drive.log.source) } else { e };
        if drive.load_kg == 0.0 {
            return Self::new(config, drive.log, drive.since_power_on_s).map_err(named);
        }
        Self::new(&config.carrying(drive.load_kg), drive.log, drive.since_power_on_s).map_err(named)
    }

    /// Row range of each drive.
    pub(crate) fn drives(&self) -> impl ExactSizeIterator<Item = Range<usize>> + '_ {
        let end = |d: usize| self.starts.get(d + 1).copied().unwrap_or(self.len());
        self.starts.iter().enumerate().map(move |(d, start)| *start..end(d))
    }

    /// Row range of the drive that holds row `k`; all rows where none does.
    #[must_use]
    pub(crate) fn drive_around(&self, k: usize) -> Range<usize> {
        self.drives().find(|rows| rows.contains(&k)).unwrap_or(0..self.len())
    }

    /// Length of each drive, s.
    #[must_use]
    pub(crate) fn spans_s(&self) -> Vec<f64> {
        let span = |rows: Range<usize>| {
            let times_s = &self.times_s[rows];
            times_s.last().zip(times_s.first()).map_or(0.0, |(b, a)| b - a)
        };
        self.drives().map(span).collect()
    }

    /// Each drive as a record of its own, in order.
    pub(crate) fn apart(&self) -> impl ExactSizeIterator<Item = Self> + '_ {
        self.drives().map(|rows| self.window(rows))
    }

    /// Applies `change` to each drive, given with its index, and joins the results to one record.
    pub(crate) fn by_drive(&self, mut change: impl FnMut(usize, &Self) -> Self) -> Self {
        if self.starts.len() < 2 {
            return change(0, self);
        }
        let mut changed = self.apart().enumerate().map(|(d, drive)| change(d, &drive));
        let Some(first) = changed.next() else { return self.clone() };
        Self { notes: self.notes.clone(), ..first.followed_by(changed) }
    }

    /// The rows `rows` as a record, with the drives that they belong to.
    pub(crate) fn window(&self, rows: Range<usize>) -> Self {
        let cut = |v: &Vec<f64>| v[rows.clone()].to_vec();
        let within = |(_, drive): &(usize, Range<usize>)| drive.start < rows.end && rows.start < drive.end;
        let held: Vec<(usize, Range<usize>)> = self.drives().enumerate().filter(within).collect();
        Self {
            times_s: cut(&self.times_s),
            since_power_on_s: cut(&self.since_power_on_s),
            starts: held.iter().map(|(_, drive)| drive.start.saturating_sub(rows.start)).collect(),
            sources: held.iter().map(|(d, _)| self.sources[*d].clone()).collect(),
            loads_kg: held.iter().map(|(d, _)| self.loads_kg[*d]).collect(),
            step_s: self.step_s,
            torques_n_m: self.torques_n_m.as_ref().map(|t| t.each_ref().map(cut)),
            gyro_rad_s: self.gyro_rad_s.as_ref().map(cut),
            wheels_rad_s: self.wheels_rad_s.each_ref().map(cut),
            pose: self.pose.as_ref().map(|p| p.each_ref().map(cut)),
            temperature_c: self.temperature_c.as_ref().map(cut),
            belief: self.belief,
            wheels_were_set: self.wheels_were_set,
            given: self.given.clone(),
            notes: Vec::new(),
        }
    }

    /// Appends drives with the same channels; belief, step and notes stay.
    fn followed_by(mut self, others: impl Iterator<Item = Self>) -> Self {
        for other in others {
            let rows = self.len();
            // a temperature that only some drives have is dropped
            self.temperature_c = self.temperature_c.zip(other.temperature_c).map(|(own, other)| [own, other].concat());
            self.starts.extend(other.starts.iter().map(|start| start + rows));
            self.sources.extend(other.sources);
            self.loads_kg.extend(other.loads_kg);
            self.times_s.extend(other.times_s);
            self.since_power_on_s.extend(other.since_power_on_s);
            append(&mut self.wheels_rad_s, other.wheels_rad_s);
            if let (Some(own), Some(other)) = (&mut self.torques_n_m, other.torques_n_m) {
                append(own, other);
            }
            if let (Some(own), Some(other)) = (&mut self.pose, other.pose) {
                append(own, other);
            }
            if let (Some(own), Some(other)) = (&mut self.gyro_rad_s, other.gyro_rad_s) {
                own.extend(other);
            }
        }
        self
    }
}

fn append<const N: usize>(own: &mut [Vec<f64>; N], other: [Vec<f64>; N]) {
    own.iter_mut().zip(other).for_each(|(own, other)| own.extend(other));
}

/// Name of a drive in messages.
fn source(record: &Record) -> &str {
    record.sources.first().map_or("recording", String::as_str)
}

fn same_channels(first: &Record, other: &Record) -> Result<()> {
    let there = |r: &Record| {
        [("torques", r.torques_n_m.is_some()), ("gyro", r.gyro_rad_s.is_some()), ("pose", r.pose.is_some())]
    };
    for ((what, first_has), (_, has)) in there(first).into_iter().zip(there(other)) {
        if has != first_has {
            let (found, with) = match has {
                true => (format!("it has {what}, and {} has not", source(first)), source(other)),
                false => (format!("it has no {what}, and {} has", source(first)), source(first)),
            };
            return Err(Error::new(ErrorKind::Column, source(other), found).hint(format!(
                "drives that are taken together need the same channels: leave the {what} of {with} out, or diagnose each \
                 drive by itself"
            )));
        }
    }
    Ok(())
}

/// Refuses different rates of wheels or gyro; the rate of the pose may differ.
fn same_rates(first: &Record, other: &Record) -> Result<()> {
    for (what, of) in [("wheels", wheels as fn(&Record) -> Option<&Vec<f64>>), ("gyro", gyro)] {
        let [Some(a), Some(b)] = [first, other].map(|r| of(r).map(|values| interval_s(r, values))) else { continue };
        if !((b / a).ln().abs() <= RATES.ln()) {
            let found = format!("its {what} are read every {b:.4} s, and those of {} every {a:.4} s", source(first));
            return Err(Error::new(ErrorKind::Time, source(other), found).hint(
                "drives that are taken together need the same sample time, for which the configuration states the noise: \
                 resample one of them, or diagnose each by itself",
            ));
        }
    }
    Ok(())
}

fn wheels(record: &Record) -> Option<&Vec<f64>> {
    record.wheels_rad_s.first()
}

fn gyro(record: &Record) -> Option<&Vec<f64>> {
    record.gyro_rad_s.as_ref()
}

/// Median time between readings, s.
fn interval_s(record: &Record, values: &[f64]) -> f64 {
    let read: Vec<f64> = record.times_s.iter().zip(values).filter(|(_, v)| v.is_finite()).map(|(t, _)| *t).collect();
    median(&mut read.windows(2).map(|w| w[1] - w[0]).collect::<Vec<_>>())
}

/// Notes of all drives: common ones once, the others with the name of their drive.
fn merged_notes(parts: &[Record]) -> Vec<String> {
    let mut notes: Vec<String> = Vec::new();
    for part in parts {
        for note in &part.notes {
            let all = parts.iter().all(|p| p.notes.contains(note));
            let note = if all { note.clone() } else { format!("{}: {note}", source(part)) };
            if !notes.contains(&note) {
                notes.push(note);
            }
        }
    }
    notes
}
