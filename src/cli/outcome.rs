//! The outcome of a command that ran to its end.

/// Outcome of a command that ran to its end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// The result is fit for use.
    Done,
    /// The work is done, and the result is not fit for use.
    Unfit,
}

impl Outcome {
    /// The exit code.
    pub fn code(self) -> u8 {
        match self {
            Self::Done => 0,
            Self::Unfit => 3,
        }
    }
}
