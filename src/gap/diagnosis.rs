//! A diagnosis: what it is asked for, its stages and its result

use super::answer::Answer;
use super::drive::holdout::traces::DriveTraces;
use super::drive::options::Options as DriveOptions;
use super::holdout::Far;
use super::rest::model_selection::Options as JudgeOptions;
use super::rest::prepare::Prepared;
use super::selection::findings::Findings;
use crate::config::Config;
use crate::signal::Log;

/// Settings of a diagnosis.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Seed of the simulated recordings.
    pub seed: u64,
    /// Settings of the comparison of hypotheses, for recordings at rest.
    pub judge: JudgeOptions,
    /// Settings of the comparison of hypotheses, for drives.
    pub judge_drives: DriveOptions,
    /// Time since power-on at the first row, s, where the logs' time counts from something else.
    pub since_power_on_s: f64,
    /// Number of recordings simulated for the floor of the log score.
    pub simulated_logs: usize,
    /// Drives only: whether to estimate the corrections of equations as signals over time; no other result depends on
    /// it.
    pub corrections: bool,
    /// Drives only: whether to simulate the drive on which the gap is measured; no other result depends on it.
    pub traces: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            seed: 1,
            judge: JudgeOptions::default(),
            judge_drives: DriveOptions::default(),
            since_power_on_s: 0.0,
            simulated_logs: 8,
            corrections: false,
            traces: false,
        }
    }
}

/// A drive, when its gyro was switched on, and what the robot carried.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drive<'a> {
    /// The recording.
    pub log: &'a Log,
    /// Time since power-on at its first row, s, where the log does not hold it.
    pub since_power_on_s: f64,
    /// Known load that the robot carried, a point mass at its centre of mass, kg
    /// ([`crate::config::Vehicle::load_kg`]).
    pub load_kg: f64,
}

impl<'a> Drive<'a> {
    /// A drive without a load, `since_power_on_s` after power-on at its first row.
    #[must_use]
    pub const fn new(log: &'a Log, since_power_on_s: f64) -> Self {
        Self { log, since_power_on_s, load_kg: 0.0 }
    }

    /// The same drive with this known load, kg.
    #[must_use]
    pub const fn carrying(self, load_kg: f64) -> Self {
        Self { load_kg, ..self }
    }
}

/// Result of a diagnosis.
#[derive(Debug, Clone, PartialEq)]
pub struct Diagnosis {
    /// The answer.
    pub answer: Answer,
    /// The nominal configuration with the effects found added as `[[effect]]` tables.
    pub augmented: Config,
    /// Sets of effects that were compared, with their probabilities.
    pub findings: Findings,
    /// Measures on the hold-out recording; none without one, and none of a drive, whose measures are in the answer.
    pub far: Option<Far>,
    /// The diagnosed recording on an even grid; none of a drive.
    pub prepared: Option<Prepared>,
    /// The drives on which the gap was measured, as recorded and as simulated; empty at rest, and unless asked for.
    pub traces: Vec<DriveTraces>,
}

/// Stages of a diagnosis, in their order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    /// Put the rows of a recording on an even grid.
    Prepare,
    /// Compare sets of effects.
    Compare,
    /// Measure the gap on the hold-out recording, or without one by cross-validation on the recording itself.
    Measure,
    /// The diagnosis is finished.
    Done,
}
