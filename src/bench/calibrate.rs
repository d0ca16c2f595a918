//! max Σ_cases ln p(truth | recording) over temperature and prior odds: the calibration of the diagnosis
//!
//! p(truth) is the probability that the diagnosis gives the true main effect (either of two), 'none' or 'unknown', and
//! a share of its doubt. A weak normal prior of standard deviation [`SPREAD`] about the uncalibrated values bounds
//! parameters that few cases determine. The reported figures are cross-validated: every case is judged by a calibration
//! that has not seen it.

use super::folder::names;
use super::intervals::{expected_calibration_error, perfect_calibration_p95};
use super::runner::case_logs;
use super::workers::each;
use super::worlds::Label;
use crate::config::Kind;
use crate::effects::Library;
use crate::error::{Error, ErrorKind, Result};
use crate::gap::answer::calibration::{Calibration, counts};
use crate::gap::selection::findings::Findings;
use crate::gap::selection::sets::Main;
use crate::gap::{Drive, JudgeOptions, Options, Prior, compare, drive};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;

/// Standard deviation of the prior of each logarithm.
pub(super) const SPREAD: f64 = 2.0;
/// Parts of the cross-validation.
pub(super) const FOLDS: usize = 10;
/// Number of alternative truths over which doubt is divided.
const ALTERNATIVES: f64 = 20.0;
/// Doubt at the start of the fit, ln odds.
pub(super) const DOUBT: f64 = -3.0;
/// Least probability that a truth is given, so that a single case that no set explains does not decide.
const FLOOR: f64 = 1e-4;
const PERFECT_SEED: u64 = 1;

/// A set of one case: ln evidence, numbers of effects and free forms, and the index of its main cause.
struct Set {
    ln_evidence: f64,
    effects: usize,
    free: usize,
    main: usize,
}

/// One case as the calibration sees it.
pub(crate) struct Example {
    sets: Vec<Set>,
    /// For each main cause, whether naming it is right.
    right: Vec<bool>,
    /// For each main cause, whether it is none.
    nothing: Vec<bool>,
}

/// Agreement of probabilities with the truth.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct Fit {
    /// Mean of -ln p(truth), nats a case.
    pub ln_loss: f64,
    /// Share of the cases with the right verdict.
    pub accuracy: f64,
    /// Expected calibration error of the verdict's probability.
    pub ece: f64,
    /// Its 95th percentile for a perfectly calibrated method.
    pub ece_perfect_p95: f64,
}

/// A fitted calibration with its figures of merit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct Calibrated {
    /// The calibration, from all cases.
    pub calibration: Calibration,
    /// Number of cases.
    pub cases: usize,
    /// Without calibration.
    pub before: Fit,
    /// Each tenth of the cases under the calibration of the other nine.
    pub cross_validated: Fit,
}

fn is_right(main: &Main, label: &Label) -> bool {
    let unlisted = label.effects.keys().any(|id| id.starts_with("x."));
    match main {
        Main::None => label.effects.is_empty(),
        Main::Unknown => unlisted,
        Main::Effect(id) => label.effects.contains_key(id),
    }
}

impl Example {
    /// A case from the uncalibrated findings under `prior`, and its label.
    #[must_use]
    pub(crate) fn new(findings: &Findings, label: &Label, prior: &Prior) -> Self {
        let mut mains: Vec<Main> = Vec::new();
        let sets = findings.sets.iter().map(|set| {
            let main = Main::of(set);
            let at = mains.iter().position(|m| *m == main).unwrap_or_else(|| {
                mains.push(main);
                mains.len() - 1
            });
            let (effects, free) = counts(set);
            let ln_evidence = set.ln_weight - effects as f64 * prior.ln_named - free as f64 * prior.ln_free;
            Set { ln_evidence, effects, free, main: at }
        });
        let sets = sets.collect();
        Self {
            sets,
            right: mains.iter().map(|m| is_right(m, label)).collect(),
            nothing: mains.iter().map(|m| *m == Main::None).collect(),
        }
    }

    /// Probability of each main cause.
    fn mains(&self, c: &Calibration) -> Vec<f64> {
        let ln = |s: &Set| s.ln_evidence / c.temperature + c.ln_prior(s.effects, s.free);
        let top = self.sets.iter().map(ln).fold(f64::NEG_INFINITY, f64::max);
        let mut sums = vec![0.0; self.right.len()];
        self.sets.iter().for_each(|s| sums[s.main] += (ln(s) - top).exp());
        let total: f64 = sums.iter().sum();
        let believed = 1.0 - c.doubt_of(sums.iter().zip(&self.nothing).filter(|(_, none)| !**none).map(|(s, _)| *s));
        sums.iter_mut().zip(&self.nothing).for_each(|(s, none)| *s *= if *none { 1.0 } else { believed } / total);
        sums
    }

    fn truth(&self, c: &Calibration) -> f64 {
        let mains = self.mains(c);
        let doubted = (1.0 - mains.iter().sum::<f64>()).max(0.0);
        mains.iter().zip(&self.right).filter(|(_, r)| **r).map(|(p, _)| p).sum::<f64>() + doubted / ALTERNATIVES
    }

    /// Probability of the verdict, and whether it is right.
    fn verdict(&self, c: &Calibration) -> (f64, bool) {
        let mains = self.mains(c);
        let top = (0..mains.len()).max_by(|a, b| mains[*a].total_cmp(&mains[*b]));
        top.map_or((0.0, false), |i| (mains[i], self.right[i]))
    }
}

/// Temperature as its logarithm, the prior odds, and the ln odds of both doubts.
fn parameters(c: &Calibration) -> [f64; 7] {
    [c.temperature.ln(), c.ln_effect[0], c.ln_effect[1], c.ln_free[0], c.ln_free[1], DOUBT, DOUBT]
}

fn calibration(x: &[f64; 7]) -> Calibration {
    let doubt = [x[5], x[6]].map(|ln_odds| 1.0 / (1.0 + (-ln_odds).exp()));
    // an unknown cause is no likelier than any one effect
    Calibration {
        temperature: x[0].exp(),
        ln_effect: [x[1], x[2]],
        ln_free: [x[3].min(x[1]), x[4]],
        doubt,
        doubt_unknown: None,
    }
}

/// The calibration of largest posterior density for `examples`.
fn fitted<'a>(examples: impl Iterator<Item = &'a Example> + Clone, prior: &Prior) -> Calibration {
    let start = parameters(&Calibration::none(prior));
    let value = |x: &[f64; 7]| {
        let c = calibration(x);
        let likelihood: f64 = examples.clone().map(|e| e.truth(&c).max(FLOOR).ln()).sum();
        likelihood - 0.5 * x.iter().zip(&start).map(|(a, b)| ((a - b) / SPREAD).powi(2)).sum::<f64>()
    };
    // pattern search: seven parameters, a smooth and nearly concave function, no derivative needed
    let (mut x, mut best) = (start, value(&start));
    let mut step = 0.5;
    while step > 0.005 {
        let before = (x, best);
        for i in 0..x.len() {
            for sign in [-1.0, 1.0] {
                let mut next = x;
                next[i] += sign * step;
                let v = value(&next);
                if v > best {
                    (x, best) = (next, v);
                    break;
                }
            }
        }
        if best > before.1 {
            // once more in the direction that helped (Hooke and Jeeves 1961)
            let mut next = x;
            next.iter_mut().zip(&before.0).for_each(|(a, b)| *a += *a - b);
            let v = value(&next);
            if v > best {
                (x, best) = (next, v);
            }
        } else {
            step *= 0.5;
        }
    }
    calibration(&x)
}

pub(super) fn fit(verdicts: &[(f64, bool)], truths: &[f64]) -> Fit {
    let confidences: Vec<f64> = verdicts.iter().map(|v| v.0).collect();
    let cases = verdicts.len().max(1) as f64;
    Fit {
        ln_loss: truths.iter().map(|p| -p.max(FLOOR).ln()).sum::<f64>() / cases,
        accuracy: verdicts.iter().filter(|v| v.1).count() as f64 / cases,
        ece: expected_calibration_error(verdicts),
        ece_perfect_p95: perfect_calibration_p95(&confidences, PERFECT_SEED),
    }
}

/// Refuses fewer than five cases a fold.
pub(super) fn too_few(cases: usize) -> Result<()> {
    if cases >= 5 * FOLDS {
        return Ok(());
    }
    let hint = format!("a calibration needs at least {} cases, better 500", 5 * FOLDS);
    Err(Error::new(ErrorKind::TooShort, "bench", format!("{cases} cases")).hint(hint))
}

/// Fits the calibration to `examples`, whose evidences stood under `prior`.
///
/// # Errors
/// [`ErrorKind::TooShort`] for fewer than fifty cases.
pub(crate) fn calibrate(examples: &[Example], prior: &Prior) -> Result<Calibrated> {
    too_few(examples.len())?;
    let none = Calibration::none(prior);
    let (mut verdicts, mut truths) = (Vec::new(), Vec::new());
    for fold in 0..FOLDS {
        let inside = |i: usize| i % FOLDS == fold;
        let others = examples.iter().enumerate().filter(|(i, _)| !inside(*i)).map(|(_, e)| e);
        let c = fitted(others, prior);
        for (_, e) in examples.iter().enumerate().filter(|(i, _)| inside(*i)) {
            verdicts.push(e.verdict(&c));
            truths.push(e.truth(&c));
        }
    }
    let raw: Vec<(f64, bool)> = examples.iter().map(|e| e.verdict(&none)).collect();
    let raw_truths: Vec<f64> = examples.iter().map(|e| e.truth(&none)).collect();
    Ok(Calibrated {
        calibration: fitted(examples.iter(), prior),
        cases: examples.len(),
        before: fit(&raw, &raw_truths),
        cross_validated: fit(&verdicts, &truths),
    })
}

/// The prior odds of the search for this kind, which a calibration replaces.
#[must_use]
pub(crate) fn prior_of(kind: Kind) -> Prior {
    match kind {
        Kind::Stationary => Prior::default(),
        Kind::Driving => Prior::of_drives(),
    }
}

/// Diagnoses the cases of `folder`, `jobs` at a time (0: one a core), without calibration and without measuring the
/// gap;
/// `progress` hears (done, all).
///
/// # Errors
/// [`ErrorKind::Io`]; [`ErrorKind::Usage`] for a folder without cases; what the diagnosis refuses of a case.
pub(crate) fn examples(
    folder: &Path,
    labels: &BTreeMap<String, Label>,
    jobs: usize,
    progress: impl Fn(usize, usize) + Sync,
) -> Result<Vec<Example>> {
    let all = names(folder)?;
    let prior = Prior::default();
    let options =
        Options { judge: JudgeOptions { prior, calibration: Calibration::none(&prior) }, ..Options::default() };
    let library = Library::new();
    let of_drives = Prior::of_drives();
    let driving = drive::options::Options { prior: of_drives, calibration: Calibration::none(&of_drives) };
    let one = |name: &String| -> Result<Option<Example>> {
        let Some(label) = labels.get(name) else { return Ok(None) };
        let (config, log, _) = case_logs(&folder.join(name))?;
        if config.kind == Kind::Driving {
            let fit = Drive::new(&log, options.since_power_on_s);
            let findings = drive::record::ready::compare(&config, &fit, &library, &driving)?;
            return Ok(Some(Example::new(&findings, label, &of_drives)));
        }
        let (findings, _) = compare(&config, &log, &library, &options)?;
        Ok(Some(Example::new(&findings, label, &prior)))
    };
    // by name, so that folds do not depend on which thread was first
    Ok(each(&all, jobs, progress, |_, name| one(name))?.into_iter().flatten().collect())
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::bench::worlds::label::Strength;
    use crate::gap::selection::sets::{Part, WeightedSet};
    use crate::math::random::Stream;

    fn set(id: Option<&str>, ln_weight: f64) -> WeightedSet {
        let part = |id: &str| Part::new(id, !id.starts_with("free."), 5.0);
        WeightedSet { parts: id.map(part).into_iter().collect(), ln_weight, probability: 0.0 }
    }

    /// A label with this effect alone.
    pub(in crate::bench) fn label(id: Option<&str>) -> Label {
        Label {
            background: Vec::new(),
            effects: id.map(|id| (id.to_string(), Default::default())).into_iter().collect(),
            kind: "stationary".into(),
            nats: Default::default(),
            strength: Strength::None,
            places: Default::default(),
            without: Vec::new(),
            time_offsets: Vec::new(),
            kept: Vec::new(),
        }
    }

    /// Cases in which each alternative shows by a normal deviate shifted by two where it is true: its ln evidence over
    /// nothing is then exact. It is overstated by `temperature`.
    fn cases(number: usize, temperature: f64, odds: [f64; 2], prior: &Prior) -> Vec<Example> {
        let mut draw = Stream::new(8, 0);
        let truths = [None, Some("a"), Some("b"), Some("x.c")];
        let sets = [None, Some("a"), Some("b"), Some("free.c")];
        let weights = [1.0, odds[0].exp(), odds[0].exp(), odds[1].exp()];
        let one = |_| {
            let mut u = draw.uniform() * weights.iter().sum::<f64>();
            let truth = weights.iter().position(|w| {
                u -= w;
                u < 0.0
            });
            let truth = truth.unwrap_or(0);
            let mut all = vec![set(None, 0.0)];
            for (k, id) in sets.iter().enumerate().skip(1) {
                let shown = draw.normal() + if k == truth { 2.0 } else { 0.0 };
                let ln_prior = if k == 3 { prior.ln_free } else { prior.ln_named };
                all.push(set(*id, temperature * (2.0 * shown - 2.0) + ln_prior));
            }
            let findings = Findings::new(all, prior, &Calibration::none(prior), Vec::new());
            Example::new(&findings, &label(truths[truth]), prior)
        };
        (0..number).map(one).collect()
    }

    #[test]
    fn an_overstated_evidence_and_the_odds_of_the_world_are_recovered() {
        let prior = Prior::default();
        let found = calibrate(&cases(3000, 1.8, [-0.7, -1.5], &prior), &prior).unwrap();
        let c = found.calibration;
        // 3000 cases tell each logarithm to about 0.07
        assert!((c.temperature.ln() - 1.8_f64.ln()).abs() < 0.25, "{c:?}");
        assert!((c.ln_effect[0] + 0.7).abs() < 0.25 && (c.ln_free[0] + 1.5).abs() < 0.25, "{c:?}");
        let (before, after) = (found.before, found.cross_validated);
        assert!(after.ece < after.ece_perfect_p95 && before.ece > 2.0 * before.ece_perfect_p95, "{found:?}");
        assert!(after.ln_loss < before.ln_loss && after.accuracy >= before.accuracy);
    }

    #[test]
    fn too_few_cases_are_refused() {
        let prior = Prior::default();
        assert_eq!(calibrate(&cases(20, 1.0, [-1.0; 2], &prior), &prior).unwrap_err().kind, ErrorKind::TooShort);
    }
}
