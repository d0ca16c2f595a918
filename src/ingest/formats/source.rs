//! A table whose cells are handed over some rows at a time, and the facts about it.

use super::head::{BadCell, Head};
use crate::error::Result;

/// Rows that a reader gathers before it hands them over.
pub(crate) const BATCH_ROWS: usize = 65_536;

/// The next cells of a column. The origin is the same in all batches that hold a value.
#[derive(Debug, Clone, Default)]
pub(crate) struct Column {
    /// Whole number taken off every value.
    pub origin: i64,
    /// Value less `origin`; NaN where missing. Empty if the column was not asked for.
    pub values: Vec<f64>,
}

/// The next rows of a table: one entry a head.
#[derive(Debug, Clone)]
pub(crate) struct Batch {
    pub rows: usize,
    pub columns: Vec<Column>,
}

/// Facts about a column, known once all of it was read.
#[derive(Debug, Clone, Default)]
pub(crate) struct ColumnFacts {
    /// Value of one unit in the last written digit, 0 if unknown.
    pub resolution: f64,
    /// The first cell that is not a number, and how many there are.
    pub bad: Option<(BadCell, usize)>,
}

/// Facts about a table, known once all of it was read.
#[derive(Debug, Clone)]
pub(crate) struct Facts {
    /// Path, for messages.
    pub source: String,
    /// Name of the format.
    pub format: String,
    /// SHA-256 of the file's bytes, hexadecimal.
    pub sha256: String,
    /// One entry a head.
    pub columns: Vec<ColumnFacts>,
    /// Line of the first row, where the rows are lines without a break.
    pub first_line: Option<u64>,
    /// Decisions that the reader took.
    pub notes: Vec<String>,
}

/// Which file, for messages and reports.
#[derive(Debug, Clone)]
pub(crate) struct About {
    /// Path, for messages.
    pub source: String,
    /// Name of the format.
    pub format: &'static str,
    /// SHA-256 of the file's bytes, hexadecimal.
    pub sha256: String,
    /// Notes from the opening of the file.
    pub notes: Vec<String>,
}

impl About {
    /// Facts about the file's table, or about the one called `part`, once all of it was read.
    pub(crate) fn facts(self, part: Option<&str>, columns: Vec<ColumnFacts>, notes: Vec<String>) -> Facts {
        let format = part.map_or(self.format.to_string(), |name| format!("{}, {name}", self.format));
        Facts { source: self.source, format, sha256: self.sha256, columns, first_line: None, notes }
    }
}

/// Takes the batches of a table in the file's order; its error ends the reading.
pub(crate) type Take<'a> = &'a mut dyn FnMut(Batch) -> Result<()>;

/// An opened table whose columns are known and whose cells are not read yet.
pub(crate) trait Source {
    /// The columns.
    fn heads(&self) -> &[Head];
    /// How many rows there are, or about how many; none if that is not known before they are read.
    fn rows(&self) -> Option<u64> {
        None
    }
    /// Told before the cells are read that all of them are going to be held, so that they may come in one batch. Only for a
    /// source that knows how many [rows](Self::rows) there are.
    fn hold(&mut self) {}
    /// Reads the cells of the columns that are `wanted` (one flag a column), some rows at a time.
    fn read(self: Box<Self>, wanted: &[bool], take: Take<'_>) -> Result<Facts>;
}
