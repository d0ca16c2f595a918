//! Rows that come one at a time, gathered into batches of columns.

use super::source::{BATCH_ROWS, Batch, Column, ColumnFacts, Take};
use crate::error::Result;

/// A value of a message's field.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Number {
    Missing,
    Double(f64),
    /// Of single precision.
    Single(f32),
    /// Keeps all of its digits, however large.
    Whole(i64),
}

impl Number {
    /// An unsigned number; beyond 2⁶³ only its leading digits.
    pub(crate) fn unsigned(x: u64) -> Self {
        i64::try_from(x).map_or(Self::Double(x as f64), Self::Whole)
    }

    pub(crate) fn to_f64(self) -> f64 {
        match self {
            Self::Missing => f64::NAN,
            Self::Double(x) => x,
            Self::Single(x) => f64::from(x),
            Self::Whole(x) => x as f64,
        }
    }
}

#[derive(Debug, Clone, Default)]
struct Filling {
    column: Column,
    started: bool,
    whole: bool,
    single: bool,
    largest: f64,
}

impl Filling {
    fn push(&mut self, number: Number) {
        let value = match number {
            Number::Whole(x) => {
                if !std::mem::replace(&mut self.started, true) {
                    self.column.origin = x;
                }
                self.whole = true;
                (i128::from(x) - i128::from(self.column.origin)) as f64
            }
            Number::Single(x) => {
                self.single = true;
                f64::from(x)
            }
            Number::Missing => f64::NAN,
            // beside whole numbers, which have an origin
            Number::Double(x) => x - self.column.origin as f64,
        };
        if value.is_finite() {
            self.largest = self.largest.max(value.abs());
        }
        self.column.values.push(value);
    }

    fn facts(&self) -> ColumnFacts {
        let resolution = match (self.whole, self.single) {
            (true, _) => 1.0,
            (false, true) => self.largest * f64::from(f32::EPSILON),
            (false, false) => 0.0,
        };
        ColumnFacts { resolution, bad: None }
    }
}

/// A table in the making.
pub(crate) struct Fill {
    row: Vec<Number>,
    wanted: Vec<bool>,
    columns: Vec<Filling>,
    rows: usize,
    /// Columns that are divided by another one, times a factor.
    ratios: Vec<Ratio>,
}

/// `column / (by · unit)`: an increment over an interval is a rate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Ratio {
    pub column: usize,
    pub by: usize,
    /// Unit of the divisor, s.
    pub unit: f64,
}

impl Fill {
    /// A table of `wanted` columns (one flag a column).
    pub(crate) fn new(wanted: &[bool]) -> Self {
        Self {
            row: vec![Number::Missing; wanted.len()],
            wanted: wanted.to_vec(),
            columns: vec![Filling::default(); wanted.len()],
            rows: 0,
            ratios: Vec::new(),
        }
    }

    /// The same, with columns that are divided by others.
    pub(crate) fn with_ratios(mut self, ratios: &[Ratio]) -> Self {
        self.ratios = ratios.to_vec();
        self
    }

    /// Sets a value of the row; columns beyond the table are left out.
    pub(crate) fn put(&mut self, column: usize, number: Number) {
        if let Some(place) = self.row.get_mut(column) {
            *place = number;
        }
    }

    /// Clears the row.
    pub(crate) fn clear_row(&mut self) {
        self.row.fill(Number::Missing);
    }

    /// Ends the row; columns that were not set are missing.
    pub(crate) fn end_row(&mut self, take: Take<'_>) -> Result<()> {
        for ratio in &self.ratios {
            let interval_s = self.row[ratio.by].to_f64() * ratio.unit;
            let value = self.row[ratio.column].to_f64() / interval_s;
            let known = interval_s > 0.0 && value.is_finite();
            self.row[ratio.column] = if known { Number::Double(value) } else { Number::Missing };
        }
        for ((column, number), _) in self.columns.iter_mut().zip(&self.row).zip(&self.wanted).filter(|c| *c.1) {
            column.push(*number);
        }
        self.row.fill(Number::Missing);
        self.rows += 1;
        if self.rows == BATCH_ROWS { self.hand_over(take) } else { Ok(()) }
    }

    /// Hands over the last rows.
    pub(crate) fn finish(mut self, take: Take<'_>) -> Result<Vec<ColumnFacts>> {
        self.hand_over(take)?;
        Ok(self.columns.iter().map(Filling::facts).collect())
    }

    fn hand_over(&mut self, take: Take<'_>) -> Result<()> {
        let rows = std::mem::take(&mut self.rows);
        let next = |f: &mut Filling| Column { origin: f.column.origin, values: std::mem::take(&mut f.column.values) };
        take(Batch { rows, columns: self.columns.iter_mut().map(next).collect() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_numbers_keep_their_digits_and_unwanted_columns_stay_empty() {
        let mut fill = Fill::new(&[true, false, true]);
        let mut batches = Vec::new();
        let mut take = |b: Batch| {
            batches.push(b);
            Ok(())
        };
        for i in 0..3 {
            fill.put(0, Number::Whole(1_700_000_000_123_456_789 + i));
            fill.put(1, Number::Double(1.0));
            if i != 1 {
                fill.put(2, Number::Single(0.1));
            }
            fill.put(9, Number::Double(1.0));
            fill.end_row(&mut take).unwrap();
        }
        let facts = fill.finish(&mut take).unwrap();
        let columns = &batches[0].columns;
        assert_eq!((columns[0].origin, &columns[0].values[..]), (1_700_000_000_123_456_789, &[0.0, 1.0, 2.0][..]));
        assert!(columns[1].values.is_empty());
        assert!(columns[2].values[1].is_nan() && columns[2].values[2] == f64::from(0.1f32));
        assert_eq!(facts[0].resolution, 1.0);
        assert!((facts[2].resolution / (0.1 * f64::from(f32::EPSILON)) - 1.0).abs() < 1e-6);
    }

    #[test]
    fn increments_become_rates_also_where_the_interval_is_not_wanted() {
        let mut fill = Fill::new(&[true, false]).with_ratios(&[Ratio { column: 0, by: 1, unit: 1e-6 }]);
        let mut values = Vec::new();
        let mut take = |b: Batch| {
            values.extend(b.columns[0].values.clone());
            Ok(())
        };
        for interval in [5000, 0] {
            fill.put(0, Number::Single(0.5));
            fill.put(1, Number::Whole(interval));
            fill.end_row(&mut take).unwrap();
        }
        fill.finish(&mut take).unwrap();
        assert!((values[0] - 100.0).abs() < 1e-12 && values[1].is_nan(), "{values:?}");
    }

    #[test]
    fn many_rows_come_in_batches() {
        let mut fill = Fill::new(&[true]);
        let mut sizes = Vec::new();
        let mut take = |b: Batch| {
            sizes.push((b.rows, b.columns[0].values.len()));
            Ok(())
        };
        for _ in 0..BATCH_ROWS + 7 {
            fill.put(0, Number::Whole(3));
            fill.end_row(&mut take).unwrap();
        }
        fill.finish(&mut take).unwrap();
        assert_eq!(sizes, [(BATCH_ROWS, BATCH_ROWS), (7, 7)]);
    }
}
