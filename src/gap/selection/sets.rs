//! Sets of effects and free forms, their parts, and the largest part of a gap

use crate::effects::Parameters;

/// An effect or free form as part of one set.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    /// Identifier of the effect, or of the free form (`free.…`).
    pub id: String,
    /// Whether it is an effect of the library.
    pub named: bool,
    /// Whether it is read directly off the readings, as quantization is: every set has it then, whatever its evidence.
    pub certain: bool,
    /// Gain in log-likelihood attributed to it within the set, nats.
    pub share: f64,
    /// Parameters; empty for free forms.
    pub parameters: Parameters,
    /// Standard deviations of the parameters.
    pub std: Parameters,
    /// Interval in which it shows, s; none where it shows all the time.
    pub time_s: Option<[f64; 2]>,
    /// Frequency band in which it shows, Hz; none where it has none.
    pub frequency_hz: Option<[f64; 2]>,
    /// Description in words.
    pub description: String,
    /// ln evidence lost when it is left out and all others are fitted anew, nats; none where not computed.
    pub missed_nats: Option<f64>,
}

impl Part {
    /// A part with its share; everything else is empty.
    #[must_use]
    pub(crate) fn new(id: &str, named: bool, share: f64) -> Self {
        Self {
            id: id.to_owned(),
            named,
            certain: false,
            share,
            parameters: Parameters::new(),
            std: Parameters::new(),
            time_s: None,
            frequency_hz: None,
            description: String::new(),
            missed_nats: None,
        }
    }

    /// The same with a description.
    #[must_use]
    pub(crate) fn described(id: &str, named: bool, share: f64, description: String) -> Self {
        Self { description, ..Self::new(id, named, share) }
    }
}

/// A set of parts with its probability.
#[derive(Debug, Clone, PartialEq)]
pub struct WeightedSet {
    /// Its parts.
    pub parts: Vec<Part>,
    /// ln evidence + ln prior of the search, up to a constant.
    pub ln_weight: f64,
    /// Posterior probability.
    pub probability: f64,
}

impl WeightedSet {
    /// The effect with the largest share; the largest free form, where the shares of all free forms together exceed
    /// that.
    pub(crate) fn main(&self) -> Option<&Part> {
        let largest = |named: bool| {
            self.parts.iter().filter(move |p| p.named == named).max_by(|a, b| a.share.total_cmp(&b.share))
        };
        let unnamed: f64 = self.parts.iter().filter(|p| !p.named).map(|p| p.share.max(0.0)).sum();
        match (largest(true), largest(false)) {
            (Some(named), Some(free)) => Some(if unnamed > named.share { free } else { named }),
            (named, free) => named.or(free),
        }
    }

    /// The part `id`.
    pub fn part(&self, id: &str) -> Option<&Part> {
        self.parts.iter().find(|p| p.id == id)
    }
}

/// Main cause of a gap.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub enum Main {
    /// None: there is no gap.
    None,
    /// A free form: the cause is not in the library.
    Unknown,
    /// An effect, by its id.
    Effect(String),
}

impl Main {
    /// The main cause in a set.
    pub(crate) fn of(set: &WeightedSet) -> Self {
        match set.main() {
            None => Self::None,
            Some(p) if p.named => Self::Effect(p.id.clone()),
            Some(_) => Self::Unknown,
        }
    }
}
