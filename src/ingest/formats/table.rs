//! Columns that a file's format hands over: by name, as numbers, before their meaning is known.

use super::head::{BadCell, Head};
use super::source::{Batch, Column, ColumnFacts, Facts, Source};
use crate::error::{Error, ErrorKind, Result};

/// A column's cells.
#[derive(Debug, Clone, Default)]
pub(crate) struct Cells {
    /// Whole number taken off every value before it became a float: nanoseconds since 1970 need more than 53 bits.
    pub origin: i64,
    /// Value less `origin`; NaN where missing. Empty if the column was not asked for.
    pub values: Vec<f64>,
    /// Value of one unit in the last written digit: values are rounded to this, 0 if unknown.
    pub resolution: f64,
    /// The first cell that is not a number (NaN in `values`), and how many there are.
    pub bad: Option<(BadCell, usize)>,
}

impl Cells {
    /// Number of missing cells and the first row that lacks one.
    pub(crate) fn missing(&self) -> (usize, Option<usize>) {
        let count = self.values.iter().filter(|v| v.is_nan()).count();
        (count, self.values.iter().position(|v| v.is_nan()))
    }
}

/// A file's content.
#[derive(Debug, Clone)]
pub(crate) struct Table {
    /// Path, for messages.
    pub source: String,
    /// Name of the format.
    pub format: String,
    /// SHA-256 of the file's bytes, hexadecimal.
    pub sha256: String,
    /// All columns of the file.
    pub heads: Vec<Head>,
    /// Cells, one entry a head.
    pub cells: Vec<Cells>,
    /// Rows in the file.
    pub rows: usize,
    /// Line of the first row, where the rows are lines without a break.
    pub first_line: Option<u64>,
    /// Decisions that the reader took.
    pub notes: Vec<String>,
}

impl Table {
    /// Where row `row` (counted from 0) lies: rows are told counted from 1, and the line where it is known.
    pub(crate) fn place(&self, row: usize, column: &str) -> String {
        let line = self.first_line.map(|first| format!(" (line {})", first + row as u64)).unwrap_or_default();
        format!("row {}{line}, column {column:?}", row + 1)
    }

    /// Whether its numbers are written in decimals.
    pub(crate) fn is_text(&self) -> bool {
        ["text", "JSON"].iter().any(|kind| self.format.starts_with(kind))
    }

    /// An error at a row of a column.
    pub(crate) fn error_at(&self, kind: ErrorKind, row: usize, column: usize, found: impl std::fmt::Display) -> Error {
        Error::new(kind, &self.source, found).at(self.place(row, &self.heads[column].name))
    }

    /// The same table with its first rows only.
    pub(crate) fn first(&self, rows: usize) -> Self {
        let few = |c: &Cells| {
            let values = c.values[..rows.min(c.values.len())].to_vec();
            Cells { values, origin: c.origin, resolution: c.resolution, bad: c.bad.clone() }
        };
        Self {
            source: self.source.clone(),
            format: self.format.clone(),
            sha256: self.sha256.clone(),
            heads: self.heads.clone(),
            cells: self.cells.iter().map(few).collect(),
            rows: rows.min(self.rows),
            first_line: self.first_line,
            notes: self.notes.clone(),
        }
    }

    /// The same table with the cells of the columns that are `wanted` (one flag a column).
    pub(crate) fn only(&self, wanted: &[bool]) -> Self {
        let mut out = self.first(0);
        out.rows = self.rows;
        for ((own, cells), _) in out.cells.iter_mut().zip(&self.cells).zip(wanted).filter(|c| *c.1) {
            own.values.clone_from(&cells.values);
        }
        out
    }

    /// Its cells as the rows of one batch.
    pub(crate) fn into_batch(self) -> Batch {
        let column = |c: Cells| Column { origin: c.origin, values: c.values };
        Batch { rows: self.rows, columns: self.cells.into_iter().map(column).collect() }
    }

    /// The cells of a column that has to be all numbers.
    pub(crate) fn numbers(&self, column: usize) -> Result<&Cells> {
        let cells = &self.cells[column];
        match &cells.bad {
            None => Ok(cells),
            Some((bad, count)) => {
                let more = if *count > 1 { format!(", and {} more such cells", count - 1) } else { String::new() };
                let found = format!("{:?} is not a number{more}", bad.text);
                Err(self
                    .error_at(ErrorKind::Value, bad.row, column, found)
                    .hint("correct or delete the row, or leave out such rows with --skip-bad-rows; missing values are written as nan, null or an empty field"))
            }
        }
    }
}

/// A table in the making.
pub(crate) struct Gathering {
    heads: Vec<Head>,
    cells: Vec<Cells>,
    rows: usize,
    /// Rows that there will be, about.
    expected: usize,
}

impl Gathering {
    /// The table of `source`, of which `most` rows at most are going to be held.
    pub(crate) fn new(source: &dyn Source, most: usize) -> Self {
        let heads = source.heads().to_vec();
        let cells = vec![Cells::default(); heads.len()];
        let expected = source.rows().map_or(0, |rows| usize::try_from(rows).unwrap_or(usize::MAX).min(most));
        Self { heads, cells, rows: 0, expected }
    }

    /// Adds the next rows.
    pub(crate) fn add(&mut self, batch: Batch) {
        self.rows += batch.rows;
        for (cells, column) in self.cells.iter_mut().zip(batch.columns) {
            cells.origin = column.origin;
            if cells.values.is_empty() {
                cells.values = column.values;
                // a count that a damaged file states may be beyond all memory: then it grows as it goes
                let more = if cells.values.is_empty() { 0 } else { self.expected.saturating_sub(cells.values.len()) };
                let _ = cells.values.try_reserve(more);
            } else {
                cells.values.extend_from_slice(&column.values);
            }
        }
    }

    pub(crate) fn rows(&self) -> usize {
        self.rows
    }

    /// Bytes of the cells.
    pub(crate) fn bytes(&self) -> usize {
        self.cells.iter().map(|c| c.values.len() * size_of::<f64>()).sum()
    }

    /// The table, when all of it was read.
    pub(crate) fn finish(mut self, facts: Facts) -> Table {
        for (cells, column) in self.cells.iter_mut().zip(facts.columns) {
            cells.resolution = column.resolution;
            cells.bad = column.bad;
        }
        Table {
            source: facts.source,
            format: facts.format,
            sha256: facts.sha256,
            heads: self.heads,
            cells: self.cells,
            rows: self.rows,
            first_line: facts.first_line,
            notes: facts.notes,
        }
    }

    /// The rows so far as a table, of which nothing but `source` is known yet.
    pub(crate) fn beginning(self, source: &str) -> Table {
        let columns = vec![ColumnFacts::default(); self.heads.len()];
        let (format, sha256) = (String::new(), String::new());
        let notes = Vec::new();
        self.finish(Facts { source: source.to_string(), format, sha256, columns, first_line: None, notes })
    }
}

/// Reads the columns of `source` that are `wanted`, whole.
pub(crate) fn collect(mut source: Box<dyn Source>, wanted: &[bool]) -> Result<Table> {
    source.hold();
    let mut gathering = Gathering::new(source.as_ref(), usize::MAX);
    let facts = source.read(wanted, &mut |batch| {
        gathering.add(batch);
        Ok(())
    })?;
    Ok(gathering.finish(facts))
}
