//! What a format is: how to know it, and how to open it.

use super::input::Input;
use super::table::{Head, Table};
use crate::error::Result;

/// An opened file whose columns are known and whose cells are not read yet.
pub(super) trait Source {
    /// The columns.
    fn heads(&self) -> &[Head];
    /// Reads the cells of the columns that are `wanted` (one flag a column).
    fn read(self: Box<Self>, wanted: &[bool]) -> Result<Table>;
}

/// A format that can be read.
pub(super) struct Format {
    /// Name for messages.
    pub name: &'static str,
    /// Whether the first bytes (unpacked) are of this format.
    pub accepts: fn(&[u8]) -> bool,
    /// Opens a file that was accepted.
    pub open: fn(Input) -> Result<Box<dyn Source>>,
}
