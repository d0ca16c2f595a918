//! Every effect, in each direction: logs are simulated and diagnosed until it is known from which size on it is named.

use super::bound::{FEWEST, bound};
use super::direction::{Direction, typical, typical_of_drives};
use super::search::{Said, Threshold, threshold};
use super::simulated::Simulator;
use crate::config::{Config, Kind};
use crate::effects::{Library, Parameters};
use crate::error::{Error, ErrorKind, Result};
use crate::gap::answer::{Answer, Verdict};
use crate::gap::asked;
use crate::gap::diagnose::diagnose;
use crate::gap::diagnosis::Options as GapOptions;
use crate::gap::drive::record::Record;
use crate::gap::drive::regressors::candidates::knowable;
use crate::math::distributions::wilson95;
use crate::signal::Log;
use crate::simulate::{Seeds, scene};
use rayon::prelude::*;
use serde::Serialize;
use statrs::distribution::{Binomial, DiscreteCDF};
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Factor of the first steps, and of those of further logs, which begin where the first ones ended.
const FIRST_STEP: f64 = 2.0;
const STEP: f64 = 1.35;
/// Logs in a row in which an effect is never named, before no more are simulated.
const IN_VAIN: usize = 2;
/// Probability of a chance that is not believed in.
const CHANCE: f64 = 0.05;
/// Seeds of one run apart from those of another.
const SEEDS: u64 = 1_000_003;
/// The first seed of logs by which sizes are checked.
const CHECK: u64 = 500_000;

/// Settings of the search.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Probability with which a diagnosis is to name the effect, 0.5 to 0.99.
    pub probability: f64,
    /// Logs that are simulated for each effect and direction, at least three.
    pub cases: usize,
    /// Further logs at each size that was found, by which it is checked.
    pub check: usize,
    /// Seed of the simulated logs.
    pub seed: u64,
    /// Ids of the effects; empty: all that the log can show.
    pub effects: Vec<String>,
    /// Time since power-on at the first row, s, where the log does not hold it.
    pub since_power_on_s: f64,
}

/// Smallest size of each effect that a log could have found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Power {
    /// Probability with which effects of these sizes are named.
    pub probability: f64,
    /// Logs that were simulated for each effect and direction.
    pub cases: usize,
    /// Their seed.
    pub seed: u64,
    /// Rows of the log.
    pub rows: usize,
    /// Its length, s.
    pub span_s: f64,
    /// Its median sample time, s.
    pub sample_time_s: f64,
    /// Verdicts on logs without any effect.
    pub nominal: Nominal,
    /// Effects in each direction, in the order of the library.
    pub effects: Vec<EffectPower>,
    /// Effects of which no size was sought.
    pub cannot_show: Vec<Cannot>,
    /// Remarks, in sentences.
    pub notes: Vec<String>,
}

/// Diagnoses of logs of the nominal simulator.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Nominal {
    /// Logs.
    pub logs: usize,
    /// Those of which it is said that they lack nothing.
    pub none: usize,
}

/// One effect in one direction.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EffectPower {
    /// Identifier.
    pub id: String,
    /// Name of the parameter that says how large it is.
    pub parameter: String,
    /// Value of the parameter at which the effect changes nothing.
    pub null: f64,
    /// 1 where the parameter grows from there, else -1.
    pub sign: i8,
    /// The smallest value, on its side of `null`, that is named with the asked probability; none where no size is.
    pub smallest: Option<f64>,
    /// 95 % interval of it, by the scatter over logs.
    pub smallest_ci95: Option<[f64; 2]>,
    /// The other parameters that were simulated.
    pub parameters: Parameters,
    /// Value from which on each simulated log is named; none in a log that is named at no size.
    pub thresholds: Vec<Option<f64>>,
    /// Evidence of the effect at the smallest size that was named, nats, mean over the logs: what the diagnosis demands.
    pub evidence_nats: Option<f64>,
    /// Diagnoses of further logs at the smallest size; none unless asked for.
    pub checked: Option<Checked>,
    /// Answers to logs that did not name it: at the largest size, or at that which would follow from the others.
    pub instead: Vec<Instead>,
}

/// Diagnoses of further logs at the size that was told.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Checked {
    /// Logs.
    pub logs: usize,
    /// Those in which the effect was named.
    pub named: usize,
    /// Wilson's 95 % interval of their share.
    pub share_ci95: [f64; 2],
}

/// An answer in the place of an effect, and how often it was given.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Instead {
    /// The effect that was named, or the verdict.
    pub answer: String,
    /// Logs.
    pub logs: usize,
}

/// An effect of which no size was sought.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Cannot {
    /// Identifier.
    pub id: String,
    /// Why, a clause.
    pub reason: String,
}

/// Smallest sizes that `inputs` could have found: for each effect of `library` and each direction that which a diagnosis of such a
/// log against `config` names. `observe` is told how many directions are done, and of how many.
///
/// # Errors
/// Those of a simulation or diagnosis of a log like `inputs`; [`ErrorKind::Usage`] for an effect that is unknown or stands twice, and for settings
/// out of range; [`ErrorKind::Value`] where the channels cannot contradict each other, so that no effect is ever named.
pub fn power(
    config: &Config,
    inputs: &Log,
    library: &Library,
    options: &Options,
    observe: &(dyn Fn(usize, usize) + Sync),
) -> Result<Power> {
    check(options)?;
    let task = Task {
        config,
        library,
        simulator: Simulator::new(config, inputs, library, options.since_power_on_s),
        options,
        gap: GapOptions { since_power_on_s: options.since_power_on_s, seed: options.seed, ..GapOptions::default() },
    };
    let nominal: Vec<Answer> =
        (0..options.cases).into_par_iter().map(|case| task.nominal(case as u64)).collect::<Result<_>>()?;
    if nominal.iter().any(|a| a.verdict == Verdict::CannotTell) {
        let why = nominal.iter().flat_map(|a| &a.notes).next().cloned().unwrap_or_default();
        return Err(Error::new(
            ErrorKind::Value,
            &inputs.source,
            "no two of its channels say the same thing, so that no effect is ever named",
        )
        .hint(why));
    }
    let (directions, cannot_show) = task.directions(inputs)?;
    let (done, all) = (AtomicUsize::new(0), directions.len());
    observe(0, all);
    let one = |direction: &Direction| {
        let found = task.measure(direction);
        observe(done.fetch_add(1, Ordering::Relaxed) + 1, all);
        found
    };
    let effects = directions.par_iter().map(one).collect::<Result<Vec<_>>>()?;
    let none = nominal.iter().filter(|a| a.verdict == Verdict::None).count();
    Ok(Power {
        probability: options.probability,
        cases: options.cases,
        seed: options.seed,
        rows: inputs.len(),
        span_s: inputs.time.span_s(),
        sample_time_s: inputs.time.median_step_s(),
        nominal: Nominal { logs: nominal.len(), none },
        effects,
        cannot_show,
        notes: Vec::new(),
    })
}

fn check(options: &Options) -> Result<()> {
    let refused = |found: String, hint: &str| Err(Error::new(ErrorKind::Usage, "power", found).hint(hint));
    if !(0.5..=0.99).contains(&options.probability) {
        return refused(format!("the probability {} is not in 0.5 to 0.99", options.probability), "give 0.9, say");
    }
    if options.cases < FEWEST {
        let found = format!("{} simulated logs tell no scatter", options.cases);
        return refused(found, "give three at least; eight are a beginning");
    }
    Ok(())
}

struct Task<'a> {
    config: &'a Config,
    library: &'a Library,
    simulator: Simulator<'a>,
    options: &'a Options,
    gap: GapOptions,
}

impl Task<'_> {
    fn seeds(&self, case: u64) -> Seeds {
        Seeds::from(self.options.seed.wrapping_mul(SEEDS).wrapping_add(case))
    }

    fn diagnosed(&self, log: &Log) -> Result<Answer> {
        Ok(diagnose(self.config, log, None, self.library, &self.gap)?.answer)
    }

    fn nominal(&self, case: u64) -> Result<Answer> {
        self.diagnosed(&self.simulator.log(&[], self.seeds(case))?)
    }

    /// Answer to the log of `case` with the effect at the distance `u`. One so large that it cannot be simulated or
    /// diagnosed is not named.
    fn say(&self, direction: &Direction, u: f64, case: u64) -> Said {
        let log = self.simulator.log(&[direction.table(u)], self.seeds(case));
        let answer = log.and_then(|log| self.diagnosed(&log));
        let Ok(answer) = answer else {
            return Said { named: false, answer: "no finite likelihood".into(), nats: None };
        };
        let said = said(&answer);
        let effect = answer.effects.iter().find(|e| e.id == direction.id);
        let named = said == direction.id;
        Said { named, answer: said, nats: effect.and_then(|e| e.evidence_nats).filter(|_| named) }
    }

    /// Directions that are sought, and effects that are not.
    fn directions(&self, inputs: &Log) -> Result<(Vec<Direction>, Vec<Cannot>)> {
        let nothing = Parameters::new();
        let mut all: Vec<(&'static str, std::result::Result<Vec<Direction>, &'static str>)> = Vec::new();
        match self.config.kind {
            Kind::Stationary => {
                let scene = scene(self.config, inputs, &crate::simulate::Options::from(0))?;
                for effect in self.library.effects() {
                    let about = effect.about();
                    let found = typical(effect, &scene)
                        .map(|typical| Direction::of(about, &effect.nominal(&scene), &typical))
                        .ok_or("the log has no temperature or supply that it follows");
                    all.push((about.id, found));
                }
            }
            Kind::Driving => {
                let log = self.simulator.log(&[], self.seeds(0))?;
                let record = Record::new(self.config, &log, self.options.since_power_on_s)?;
                for effect in self.library.driving() {
                    let about = effect.about();
                    let found = match knowable(effect, &record) {
                        true => Ok(Direction::of(about, &nothing, &typical_of_drives(effect))),
                        false => Err("the channels of this log cannot show it"),
                    };
                    all.push((about.id, found));
                }
            }
        }
        let known: Vec<&str> = all.iter().map(|a| a.0).collect();
        let ids: Vec<&str> = self.options.effects.iter().map(String::as_str).collect();
        if !ids.is_empty() {
            asked::check("effects", &ids, &known, self.config.kind)?;
        }
        let is_asked = |id: &str| ids.is_empty() || ids.contains(&id);
        let given = |id: &str| self.config.effects.iter().any(|e| e.id == id);
        let (mut sought, mut cannot) = (Vec::new(), Vec::new());
        for (id, found) in all.into_iter().filter(|a| is_asked(a.0)) {
            match found {
                Ok(_) if given(id) => {
                    cannot.push(Cannot { id: id.into(), reason: "the configuration holds it already".into() });
                }
                Ok(directions) => sought.extend(directions),
                Err(why) => cannot.push(Cannot { id: id.into(), reason: why.into() }),
            }
        }
        Ok((sought, cannot))
    }

    fn measure(&self, direction: &Direction) -> Result<EffectPower> {
        let (cases, most, none) = (self.options.cases, direction.most(), Verdict::None.to_string());
        let mut from = self.simulator.start(direction, self.seeds(0))?;
        let mut found: Vec<Threshold> = Vec::with_capacity(cases);
        let mut at: Vec<f64> = Vec::with_capacity(cases);
        for case in 0..cases {
            if at.is_empty() && case == IN_VAIN.min(cases) {
                break;
            }
            let step = if at.is_empty() { FIRST_STEP } else { STEP };
            let one = threshold(from, step, most, &none, |u| self.say(direction, u, case as u64));
            if let Threshold::At(u, _) = one {
                at.push(u);
                from = at.iter().sum::<f64>() / at.len() as f64;
            }
            found.push(one);
        }
        let never = found.len() - at.len();
        let bound = bound(self.options.probability, &at, never).filter(|b| b.0 <= most);
        // what is named from some size on has to be named at this one: some answers come and go
        let there = bound.map_or_else(Vec::new, |b| {
            (0..found.len()).into_par_iter().map(|case| self.say(direction, b.0, case as u64)).collect()
        });
        let missed: Vec<&Said> = there.iter().filter(|said| !said.named).collect();
        let bound = bound.filter(|_| may_miss(self.options.probability, missed.len(), there.len()));
        let value = |u: f64| direction.value(u.clamp(0.0, most));
        let mut instead: BTreeMap<&str, usize> = BTreeMap::new();
        let mut nats = Vec::new();
        for one in &found {
            match one {
                Threshold::At(_, evidence) => nats.extend(*evidence),
                Threshold::Never(answer) => *instead.entry(answer).or_default() += 1,
            }
        }
        if bound.is_none() {
            missed.iter().for_each(|said| *instead.entry(&said.answer).or_default() += 1);
        }
        let instead = instead.into_iter().map(|(answer, logs)| Instead { answer: answer.into(), logs }).collect();
        let thresholds = found.iter().map(|one| match one {
            Threshold::At(u, _) => Some(value(*u)),
            Threshold::Never(_) => None,
        });
        Ok(EffectPower {
            id: direction.id.into(),
            parameter: direction.parameter.into(),
            null: direction.null,
            sign: if direction.sign > 0.0 { 1 } else { -1 },
            smallest: bound.map(|b| value(b.0)),
            smallest_ci95: bound.map(|b| {
                let [one, other] = b.1.map(value);
                [one.min(other), one.max(other)]
            }),
            parameters: direction.others.clone(),
            thresholds: thresholds.collect(),
            evidence_nats: (!nats.is_empty()).then(|| nats.iter().sum::<f64>() / nats.len() as f64),
            checked: bound.and_then(|b| self.checked(direction, b.0)),
            instead,
        })
    }

    /// Diagnoses of further logs at the distance `u`; none unless asked for.
    fn checked(&self, direction: &Direction, u: f64) -> Option<Checked> {
        let logs = self.options.check;
        let named = |case: usize| usize::from(self.say(direction, u, CHECK + case as u64).named);
        let named = (0..logs).into_par_iter().map(named).sum();
        Some(Checked { logs, named, share_ci95: wilson95(named, logs)? })
    }
}

/// Whether chance leaves `missed` of `logs` without the name of an effect that each names with this probability.
fn may_miss(probability: f64, missed: usize, logs: usize) -> bool {
    let Ok(missing) = Binomial::new(1.0 - probability, logs as u64) else { return false };
    missed == 0 || missing.sf(missed as u64 - 1) > CHANCE
}

/// The effect that an answer names, or its verdict.
fn said(answer: &Answer) -> String {
    match (&answer.main, answer.verdict) {
        (Some(main), Verdict::Identified) => main.clone(),
        (_, verdict) => verdict.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chance_misses_a_few() {
        // of eight logs two or more are missed with 0.187, three or more with 0.038
        assert_eq!([0, 2, 3, 8].map(|missed| may_miss(0.9, missed, 8)), [true, true, false, false]);
        assert!(may_miss(0.5, 5, 8));
    }

    #[test]
    fn settings_out_of_range_are_refused() {
        let of = |probability: f64, cases: usize| Options {
            probability,
            cases,
            check: 0,
            seed: 1,
            effects: Vec::new(),
            since_power_on_s: 0.0,
        };
        assert!(check(&of(0.9, 8)).is_ok());
        for (probability, cases) in [(0.49, 8), (1.0, 8), (f64::NAN, 8), (0.9, 2)] {
            assert_eq!(check(&of(probability, cases)).unwrap_err().kind, ErrorKind::Usage, "{probability} {cases}");
        }
    }
}
