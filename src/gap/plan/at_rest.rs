//! E = mean over simulated recordings of ln P(truth | z) - ln P(rival | z), by the diagnosis among the rivals alone
//!
//! At rest a diagnosis takes one recording, so that an experiment has to tell effects apart by itself.

use super::inputs::SOURCE;
use super::rivals::Rival;
use super::worth::Pair;
use crate::config::Config;
use crate::effects::Library;
use crate::error::Result;
use crate::gap::answer::compose::RIVAL;
use crate::gap::diagnose::compare;
use crate::gap::diagnosis::Options as GapOptions;
use crate::gap::power::simulated::Simulator;
use crate::gap::rest::model_selection::DEPTH;
use crate::gap::selection::findings::Findings;
use crate::signal::{Log, TimeAxis, names};
use crate::simulate::Seeds;
use rayon::prelude::*;

/// Recordings that are simulated for each truth.
const LOGS: u64 = 4;
/// A longer recording, as a multiple of the given one: noise that wanders is told from noise that does not.
const LONGER: usize = 4;
/// Time constants after which a warm-up is over to a hundredth.
const WARM: f64 = 5.0;
/// By how much the gyro is warmed, K, and the supply raised, V.
const WARMED_K: f64 = 10.0;
const RAISED_V: f64 = 0.05;
/// Room temperature, where none is logged, °C.
const ROOM_C: f64 = 20.0;
/// Supply, where none is logged, V.
const SUPPLY_V: f64 = 5.0;
/// Cycles of warming and of the supply in a recording.
const CYCLES: f64 = 2.0;

/// Evidence from which on a diagnosis at rest tells two effects apart, nats.
pub(super) fn resolution() -> f64 {
    -RIVAL.ln()
}

/// A recording at rest.
pub(super) struct Recording {
    pub name: &'static str,
    pub how: &'static str,
    make: fn(&Like) -> Result<Log>,
}

/// The given recording, as further ones follow it.
pub(super) struct Like<'a> {
    log: &'a Log,
    start_s: f64,
    step_s: f64,
    time_constant_s: f64,
}

impl<'a> Like<'a> {
    /// As `log` was, of a gyro with this time constant of warm-up.
    pub(super) fn of(log: &'a Log, time_constant_s: f64) -> Self {
        Self { log, start_s: log.time.at(0), step_s: log.time.median_step_s(), time_constant_s }
    }

    /// Mean of a channel, or `else_`.
    fn mean(&self, name: &str, else_: f64) -> f64 {
        let there = self.log.get(name).into_iter().flatten().filter(|v| v.is_finite());
        let (count, sum) = there.fold((0.0, 0.0), |(n, s), v| (n + 1.0, s + v));
        if count > 0.0 { sum / count } else { else_ }
    }

    /// A recording of `rows` rows from `start_s` on. A channel follows its mean in the given recording by what `warmed` (K) and
    /// `raised` (V) say of a share of the recording; without them it is steady, and there where it was logged.
    fn recording(
        &self,
        start_s: f64,
        rows: usize,
        warmed: Option<&dyn Fn(f64) -> f64>,
        raised: Option<&dyn Fn(f64) -> f64>,
    ) -> Result<Log> {
        let mut log = Log::new(SOURCE, TimeAxis::Uniform { start_s, step_s: self.step_s, len: rows });
        log.push(names::GYRO_Z, vec![0.0; rows])?;
        for (name, else_, change) in [(names::TEMPERATURE, ROOM_C, warmed), (names::SUPPLY, SUPPLY_V, raised)] {
            if change.is_some() || self.log.get(name).is_some() {
                let from = self.mean(name, else_);
                let at = |k: usize| from + change.map_or(0.0, |f| f(k as f64 / rows as f64));
                log.push(name, (0..rows).map(at).collect())?;
            }
        }
        Ok(log)
    }

    /// After the warm-up.
    fn warm_s(&self) -> f64 {
        self.start_s.max(WARM * self.time_constant_s)
    }
}

/// All of them.
pub(super) const RECORDINGS: [Recording; 5] = [
    Recording {
        name: "again",
        how: "Record once more, as this log was recorded, from the next power-on.",
        make: |like| Ok(like.log.clone()),
    },
    Recording {
        name: "rest_longer",
        how: "Leave the unit at rest, at a steady temperature, for four times as long.",
        make: |like| like.recording(like.start_s, LONGER * like.log.len(), None, None),
    },
    Recording {
        name: "rest_warm",
        how: "Leave the unit at rest, at a steady temperature, and begin when it has warmed up: after five time constants.",
        make: |like| like.recording(like.warm_s(), like.log.len(), None, None),
    },
    Recording {
        name: "reheat",
        how: "When it has warmed up, warm the unit by 10 K and let it cool, twice, and log its temperature (temperature_c).",
        make: |like| {
            let warmed = |u: f64| WARMED_K * (1.0 - (CYCLES * std::f64::consts::TAU * u).cos()) / 2.0;
            like.recording(like.warm_s(), like.log.len(), Some(&warmed), None)
        },
    },
    Recording {
        name: "supply_steps",
        how: "When it has warmed up, step the supply by 50 mV up and down, twice, and log it (supply_v).",
        make: |like| {
            let raised = |u: f64| if (CYCLES * u).fract() < 0.5 { 0.0 } else { RAISED_V };
            like.recording(like.warm_s(), like.log.len(), None, Some(&raised))
        },
    },
];

impl Recording {
    /// Its inputs.
    ///
    /// # Errors
    /// None that a recording would bring about.
    pub(super) fn inputs(&self, like: &Like<'_>) -> Result<Log> {
        (self.make)(like)
    }
}

/// Every truth against every rival, in a recording with these `inputs`.
///
/// # Errors
/// Those of the simulation and of the comparison.
pub(super) fn pairs(
    config: &Config,
    inputs: &Log,
    library: &Library,
    rivals: &[Rival],
    seed: u64,
) -> Result<Vec<Pair>> {
    let needed = |id: &str| rivals.iter().any(|r| r.has(id)) || config.effects.iter().any(|e| e.id == id);
    let withheld = library.effects().map(|e| e.about().id).filter(|id| !needed(id));
    let among = Library::without(withheld).with_own(config)?;
    let simulator = Simulator::new(config, inputs, library, 0.0);
    let one = |truth: &Rival| -> Result<Vec<Pair>> {
        let told = |log: u64| -> Result<Findings> {
            let log = simulator.log(&truth.tables(), Seeds::from(seed.wrapping_mul(LOGS).wrapping_add(log)))?;
            Ok(compare(config, &log, &among, &GapOptions::default())?.0)
        };
        let found: Vec<Findings> = (0..LOGS).into_par_iter().map(told).collect::<Result<_>>()?;
        let over = |rival: &str| found.iter().map(|f| ln_odds(f, &truth.id, rival)).sum::<f64>() / found.len() as f64;
        let others = rivals.iter().filter(|r| r.id != truth.id);
        Ok(others.map(|r| Pair::new(&truth.id, &r.id, over(&r.id), resolution())).collect())
    };
    let all: Vec<Vec<Pair>> = rivals.par_iter().map(one).collect::<Result<_>>()?;
    Ok(all.concat())
}

/// ln odds of sets that hold `truth` and not `rival` over those that hold `rival` and not `truth`. Sets far below the best take no
/// part in findings: what is in none is as improbable as the deepest of them, so that the odds are those at least.
fn ln_odds(findings: &Findings, truth: &str, rival: &str) -> f64 {
    let floor = (-DEPTH).exp();
    let of = |with: &str, without: &str| -> f64 {
        let sets = findings.sets.iter().filter(|s| s.part(with).is_some() && s.part(without).is_none());
        sets.map(|s| s.probability).sum::<f64>().max(floor)
    };
    (of(truth, rival) / of(rival, truth)).ln()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::ids;
    use crate::gap::selection::sets::{Part, WeightedSet};

    #[test]
    fn odds_are_those_of_sets_with_one_and_not_the_other() {
        let set = |ids: &[&str], probability: f64| WeightedSet {
            parts: ids.iter().map(|id| Part::new(id, true, 9.0)).collect(),
            ln_weight: 0.0,
            probability,
        };
        let (a, b) = (ids::rate_ramp(), ids::rate_random_walk());
        let sets = vec![set(&[a], 0.6), set(&[b], 0.1), set(&[a, b], 0.2), set(&[], 0.1)];
        let findings = Findings { sets, ..Findings::default() };
        assert!((ln_odds(&findings, a, b) - 6f64.ln()).abs() < 1e-12);
        assert!((ln_odds(&findings, b, a) + 6f64.ln()).abs() < 1e-12);
        // neither shows
        assert_eq!(ln_odds(&Findings { sets: vec![set(&[], 1.0)], ..Findings::default() }, a, b), 0.0);
    }
}
