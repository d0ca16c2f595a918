//! The rows of a log at rest in the order of their times, each time once.

use super::audit::{Duplicates, Handling, OutOfOrder};
use crate::error::{Error, ErrorKind, Result};
use crate::ingest::assemble::plan::Plan;
use crate::ingest::formats::table::Table;
use crate::math::robust::median;
use crate::math::scan;
use std::borrow::Cow;

/// From this share of repeated stamps on the clock is coarser than the sampling.
pub(crate) const COARSE_CLOCK: f64 = 0.01;

/// Rows of the file that are used, in the order of time.
pub(crate) enum Rows {
    All(usize),
    These(Vec<usize>),
}

impl Rows {
    pub(crate) fn len(&self) -> usize {
        match self {
            Self::All(count) => *count,
            Self::These(rows) => rows.len(),
        }
    }

    /// The row of the k-th sample.
    pub(crate) fn at(&self, k: usize) -> usize {
        match self {
            Self::All(_) => k,
            Self::These(rows) => rows[k],
        }
    }

    fn to_vec(&self) -> Vec<usize> {
        (0..self.len()).map(|k| self.at(k)).collect()
    }

    /// The values of these rows.
    pub(crate) fn of<'a>(&self, all: Cow<'a, [f64]>) -> Cow<'a, [f64]> {
        match self {
            Self::All(_) => all,
            Self::These(rows) => rows.iter().map(|&i| all[i]).collect(),
        }
    }
}

/// Times that strictly increase, and what was done to that end: [`order`], then [`separate`].
pub(crate) fn in_order(
    table: &Table,
    plan: &Plan,
    seconds: Vec<f64>,
    values: &[f64],
    rows: &mut Rows,
    sort: bool,
) -> Result<(Vec<f64>, Duplicates, OutOfOrder)> {
    if matches!(rows, Rows::All(_)) && scan::first_after(&seconds, |a, b| b <= a).is_none() {
        let duplicates = Duplicates { count: 0, first_row: None, handling: Handling::Dropped };
        return Ok((seconds, duplicates, OutOfOrder { count: 0, handling: Handling::Sorted }));
    }
    let out_of_order = order(table, plan, &seconds, rows, sort)?;
    let (time_s, duplicates) = separate(table, plan, seconds, values, rows)?;
    Ok((time_s, duplicates, out_of_order))
}

/// Refuses or sorts times that go backwards.
fn order(table: &Table, plan: &Plan, seconds: &[f64], rows: &mut Rows, sort: bool) -> Result<OutOfOrder> {
    let mut count = 0;
    let t = |k: usize| seconds[rows.at(k)];
    for k in (1..rows.len()).filter(|&k| t(k) < t(k - 1)) {
        if !sort && let Some(column) = plan.time.index() {
            let found = format!("time goes back by {} s", short(t(k - 1) - t(k)));
            return Err(table
                .error_at(ErrorKind::Time, rows.at(k), column, found)
                .hint("cut the log there if it was started anew, or put its rows in order with --sort-time"));
        }
        count += 1;
    }
    if count > 0 {
        let mut sorted = rows.to_vec();
        sorted.sort_by(|&a, &b| seconds[a].total_cmp(&seconds[b]));
        *rows = Rows::These(sorted);
    }
    Ok(OutOfOrder { count, handling: Handling::Sorted })
}

/// Times that strictly increase: repeated stamps are dropped, or spread if the clock is coarser than the sampling.
fn separate(
    table: &Table,
    plan: &Plan,
    seconds: Vec<f64>,
    values: &[f64],
    rows: &mut Rows,
) -> Result<(Vec<f64>, Duplicates)> {
    let mut time_s = rows.of(Cow::Owned(seconds)).into_owned();
    let repeats = |k: &usize| time_s[*k] == time_s[*k - 1];
    let first = scan::first_after(&time_s, |a, b| b == a).unwrap_or(rows.len());
    let again: Vec<usize> = (first..rows.len()).filter(repeats).collect();
    let first_row = again.first().map(|&k| rows.at(k) + 1);
    let count = again.len();
    if count + 1 == rows.len() && rows.len() > 1 {
        let found = format!("time stands still at {} in all {} rows", time_s[0], rows.len());
        let mut error = Error::new(ErrorKind::Time, &table.source, found);
        if let Some(column) = plan.time.index() {
            error = error.at(format!("column {:?}", table.heads[column].name));
        }
        return Err(error.hint("name another time column with --time, or state the sample rate with --rate"));
    }
    let same_value = again.iter().filter(|&&k| values[rows.at(k)] == values[rows.at(k - 1)]).count();
    // rows that were written twice repeat the value too
    let coarse = count as f64 > COARSE_CLOCK * rows.len() as f64 && same_value * 10 < count * 9;
    if coarse {
        spread(&mut time_s);
        return Ok((time_s, Duplicates { count, first_row, handling: Handling::Spread }));
    }
    if count > 0 {
        let mut keep = vec![true; rows.len()];
        again.iter().for_each(|&k| keep[k] = false);
        *rows = Rows::These((0..rows.len()).filter(|&k| keep[k]).map(|k| rows.at(k)).collect());
        let mut flags = keep.iter();
        time_s.retain(|_| *flags.next().unwrap_or(&true));
    }
    Ok((time_s, Duplicates { count, first_row, handling: Handling::Dropped }))
}

/// Samples of one stamp are spread evenly up to the next stamp; the last ones by the step of those before.
fn spread(time_s: &mut [f64]) {
    let n = time_s.len();
    let mut first = 0;
    let mut step = f64::NAN;
    // a gap after a stamp is no time to spread into
    let mut stamps: Vec<f64> = time_s.windows(2).map(|w| w[1] - w[0]).filter(|d| *d > 0.0).collect();
    let usual = median(&mut stamps);
    while first < n {
        let stamp = time_s[first];
        let next = (first..n).find(|&k| time_s[k] > stamp).unwrap_or(n);
        let count = (next - first) as f64;
        if next < n || step.is_nan() {
            let room = if next < n { time_s[next] - stamp } else { usual };
            step = if room > 1.5 * usual { usual / count } else { room / count };
        } else {
            step = step.min(usual / count);
        }
        for (j, t) in time_s[first..next].iter_mut().enumerate() {
            *t = stamp + j as f64 * step;
        }
        first = next;
    }
}

/// A number with few digits.
pub(crate) fn short(x: f64) -> String {
    if x.abs() >= 1e-3 && x.abs() < 1e6 { format!("{x:.4}") } else { format!("{x:.3e}") }
}
