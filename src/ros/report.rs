//! The loop's report to the keeper once a second: copied, without allocation.

use crate::live::{Corrected, Corrector, Stamped};

/// Messages, by what was the matter with them.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Counts {
    pub samples: u64,
    pub malformed: u64,
    pub unsent: u64,
    pub unrecorded: u64,
    pub repeated: u64,
    pub overtaken: u64,
    pub gaps: u64,
    pub jumps: u64,
    pub not_finite: u64,
    pub passed_through: u64,
}

impl Counts {
    /// Counts what a gyro's reading was; its stamp where it is the `first` of its message.
    pub(super) fn add(&mut self, got: &Corrected, first: bool) {
        match got.flags.stamped {
            Stamped::Steady => {}
            _ if !first => {}
            Stamped::Repeated => self.repeated += 1,
            Stamped::Overtaken => self.overtaken += 1,
            Stamped::Gap => self.gaps += 1,
            Stamped::JumpedForward | Stamped::JumpedBack => self.jumps += 1,
        }
        self.not_finite += u64::from(got.flags.not_finite);
        self.passed_through += u64::from(got.flags.passed_through());
    }
}

/// A gyro and what was last made of its reading.
#[derive(Clone)]
pub(super) struct Gyro {
    pub corrector: Corrector,
    pub last: Option<Corrected>,
}

/// The loop's report.
pub(super) struct Report {
    /// In the order of the options; none before the first message.
    pub gyros: [Option<Gyro>; 3],
    pub counts: Counts,
    /// By the loop's clock, s.
    pub now_s: f64,
    pub notes: Vec<String>,
}
