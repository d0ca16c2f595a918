//! One row a quantity, and whether its share is what it claims.

use serde::Serialize;
use statrs::distribution::{Beta, ContinuousCDF};

const LEVEL: f64 = 0.99;

/// Claimed share.
#[derive(Debug, Clone, Copy, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Claim {
    Exactly(f64),
    AtMost(f64),
}

#[derive(Debug, Clone, Serialize)]
pub struct Row {
    pub quantity: String,
    pub claim: Claim,
    /// Intervals that hold the truth, or tests that reject it.
    pub right: u64,
    /// Logs in which it was printed.
    pub of: u64,
    /// Meaning of a number that is not what it claims.
    pub note: String,
}

impl Row {
    pub fn new(quantity: impl Into<String>, claim: Claim, [right, of]: [u64; 2]) -> Self {
        Self { quantity: quantity.into(), claim, right, of, note: String::new() }
    }

    /// A 95 % interval.
    pub fn interval(quantity: impl Into<String>, counts: [u64; 2]) -> Self {
        Self::new(quantity, Claim::Exactly(0.95), counts)
    }

    pub fn with_note(self, note: impl Into<String>) -> Self {
        Self { note: note.into(), ..self }
    }

    /// Clopper-Pearson interval of the share.
    fn bounds(&self) -> [f64; 2] {
        let tail = 0.5 * (1.0 - LEVEL);
        let (right, wrong) = (self.right as f64, (self.of - self.right) as f64);
        let quantile = |a: f64, b: f64, p: f64| Beta::new(a, b).map_or(f64::NAN, |law| law.inverse_cdf(p));
        let low = if self.right == 0 { 0.0 } else { quantile(right, wrong + 1.0, tail) };
        let high = if self.right == self.of { 1.0 } else { quantile(right + 1.0, wrong, 1.0 - tail) };
        [low, high]
    }

    pub fn consistent(&self) -> bool {
        let [low, high] = self.bounds();
        match self.claim {
            Claim::Exactly(share) => low <= share && share <= high,
            Claim::AtMost(share) => low <= share,
        }
    }

    pub fn head() -> &'static str {
        "| quantity | claims | held | logs | share | 99 % interval | consistent | |\n|---|---|---|---|---|---|---|---|"
    }
}

impl std::fmt::Display for Row {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [low, high] = self.bounds();
        let claim = match self.claim {
            Claim::Exactly(share) => format!("{share}"),
            Claim::AtMost(share) => format!("at most {share}"),
        };
        let (share, verdict) = (self.right as f64 / self.of as f64, if self.consistent() { "yes" } else { "no" });
        let Self { quantity, right, of, note, .. } = self;
        write!(f, "| {quantity} | {claim} | {right} | {of} | {share:.3} | {low:.3} to {high:.3} | {verdict} | {note} |")
    }
}

/// Holds and number of the answers that were given.
pub fn counts(answers: impl IntoIterator<Item = Option<bool>>) -> [u64; 2] {
    answers.into_iter().flatten().fold([0, 0], |[right, of], held| [right + u64::from(held), of + 1])
}

pub fn inside([low, high]: [f64; 2], value: f64) -> bool {
    low <= value && value <= high
}
