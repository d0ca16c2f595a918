//! What the comparison of hypotheses comes to: probabilities, shares and parameters, whatever the kind of effect.

use crate::effects::Parameters;

/// An effect or free form with what it does in one set.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    /// Identifier of the effect, or of the free form (`free.…`).
    pub id: String,
    /// Whether it is an effect of the library.
    pub named: bool,
    /// Share of what the set closes, nats.
    pub share: f64,
    /// Parameters and their standard deviations; empty for free forms.
    pub parameters: Parameters,
    /// Standard deviations of the parameters.
    pub std: Parameters,
    /// Where it shows in time, s, and in frequency, Hz.
    pub time_s: Option<[f64; 2]>,
    /// Band, Hz.
    pub frequency_hz: Option<[f64; 2]>,
    /// What it looks like, in words.
    pub description: String,
}

/// A set of parts with its probability.
#[derive(Debug, Clone, PartialEq)]
pub struct WeightedSet {
    /// Its parts.
    pub parts: Vec<Part>,
    /// ln evidence + ln prior, up to a constant.
    pub ln_weight: f64,
    /// Posterior probability.
    pub probability: f64,
}

impl WeightedSet {
    /// The part with the largest share.
    pub fn main(&self) -> Option<&Part> {
        self.parts.iter().max_by(|a, b| a.share.total_cmp(&b.share))
    }

    /// The part `id`.
    pub fn part(&self, id: &str) -> Option<&Part> {
        self.parts.iter().find(|p| p.id == id)
    }
}

/// All sets, most probable first.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Findings {
    /// The sets.
    pub sets: Vec<WeightedSet>,
    /// What is to be said about the recording.
    pub notes: Vec<String>,
}

/// What can be the main thing.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub enum Main {
    /// Nothing.
    None,
    /// A free form.
    Unknown,
    /// An effect.
    Effect(String),
}

impl Findings {
    /// Sets with normalised probabilities; `temperature` above one spreads them (calibration).
    pub fn new(mut sets: Vec<WeightedSet>, temperature: f64, notes: Vec<String>) -> Self {
        sets.sort_by(|a, b| b.ln_weight.total_cmp(&a.ln_weight));
        let top = sets.first().map_or(0.0, |s| s.ln_weight);
        let weight = |s: &WeightedSet| ((s.ln_weight - top) / temperature).exp();
        let total: f64 = sets.iter().map(weight).sum();
        for s in &mut sets {
            s.probability = weight(s) / total;
        }
        Self { sets, notes }
    }

    /// Probability of each main thing, most probable first.
    pub fn mains(&self) -> Vec<(Main, f64)> {
        let mut sums: std::collections::BTreeMap<Main, f64> = std::collections::BTreeMap::new();
        for s in &self.sets {
            let main = match s.main() {
                None => Main::None,
                Some(p) if p.named => Main::Effect(p.id.clone()),
                Some(_) => Main::Unknown,
            };
            *sums.entry(main).or_default() += s.probability;
        }
        let mut all: Vec<(Main, f64)> = sums.into_iter().collect();
        all.sort_by(|a, b| b.1.total_cmp(&a.1));
        all
    }

    /// Probability that `id` is present.
    pub fn presence(&self, id: &str) -> f64 {
        self.sets.iter().filter(|s| s.part(id).is_some()).map(|s| s.probability).sum()
    }

    /// Ids of everything that is in a set, most probable first.
    pub fn ids(&self) -> Vec<(String, bool, f64)> {
        let mut seen: Vec<(String, bool, f64)> = Vec::new();
        for s in &self.sets {
            for p in &s.parts {
                match seen.iter_mut().find(|x| x.0 == p.id) {
                    Some(x) => x.2 += s.probability,
                    None => seen.push((p.id.clone(), p.named, s.probability)),
                }
            }
        }
        seen.sort_by(|a, b| b.2.total_cmp(&a.2));
        seen
    }

    /// The most probable set that holds `id` (and, if asked, in which it is the main thing).
    pub fn best_with(&self, id: &str, as_main: bool) -> Option<&WeightedSet> {
        self.sets.iter().find(|s| s.part(id).is_some() && (!as_main || s.main().is_some_and(|m| m.id == id)))
    }
}
