//! File formats: how to recognise one, and how to open it.

use super::input::Input;
use super::source::Source;
use super::topics::Container;
use crate::error::Result;

/// Content of an opened file.
pub(crate) enum Opened {
    /// One table.
    Table(Box<dyn Source>),
    /// Messages of several topics, each of which is a table.
    Topics(Box<dyn Container>),
}

/// A format that can be read.
pub(crate) struct Format {
    /// Name for messages.
    pub name: &'static str,
    /// Whether the first bytes (unpacked) are of this format.
    pub accepts: fn(&[u8]) -> bool,
    /// Opens a file that was accepted.
    pub open: fn(Input) -> Result<Opened>,
}
