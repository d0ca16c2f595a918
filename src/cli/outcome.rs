//! The outcome of a command that ran to its end, and its answer.

use serde_json::Value;

/// Outcome of a command that ran to its end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// The result is fit for use.
    Done,
    /// The work is done, and the result is not fit for use.
    Unfit,
}

/// The answer of a command.
#[derive(Debug, Clone, PartialEq)]
pub struct Answer {
    /// The answer as `--json` writes it.
    pub json: Value,
    /// The page for people.
    pub text: String,
    /// Whether it is fit for use: exit code 0, not 3.
    pub fit_for_use: bool,
}

impl Outcome {
    /// The exit code.
    pub(super) fn code(self) -> u8 {
        match self {
            Self::Done => 0,
            Self::Unfit => 3,
        }
    }
}
