//! A recording compared with a simulator, and each effect of it held against the simulator's log.

use crate::gap::diagnosis::Diagnosis;
use crate::gap::selection::findings::Findings;
use serde::Serialize;

/// A value with its standard deviation.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Said {
    /// Value.
    pub value: f64,
    /// Standard deviation; of several runs with their spread.
    pub std: f64,
}

/// An effect of the recording, held against the simulator's log.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Inherited {
    /// Identifier.
    pub id: String,
    /// Parameter.
    pub parameter: String,
    /// In the recording, relative to the twin.
    pub real: Said,
    /// In the simulator's log, relative to the twin; none where it cannot tell.
    pub simulator: Option<Said>,
    /// The difference; of a ratio, their ratio.
    pub difference: Said,
    /// Whether it is a gap.
    pub is_gap: bool,
}

/// A recording compared with a simulator.
#[derive(Debug, Clone)]
pub struct Compared {
    /// The diagnosis against the twin, without what the simulator has too.
    pub diagnosis: Diagnosis,
    /// Effects named against the twin, each with what the simulator's log says of it.
    pub held_against: Vec<Inherited>,
}

/// Probability of an effect with this evidence, nats: ½ where it just reaches what any effect must reach to be named.
pub(super) fn presence(nats: f64, findings: &Findings, temperature: f64) -> f64 {
    let odds = (nats - findings.least_nats) / temperature;
    1.0 / (1.0 + (-odds).exp())
}
