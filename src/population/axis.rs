//! An axis of a log, and its sign.

use crate::ingest::Axis;
use std::fmt;

/// An axis of a log, and whether it points the other way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub(crate) struct AxisChoice {
    /// The axis.
    pub axis: Axis,
    /// Whether its rates change their sign.
    pub reversed: bool,
}

impl fmt::Display for AxisChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}{}", if self.reversed { "-" } else { "" }, self.axis)
    }
}
