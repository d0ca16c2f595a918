//! Comparison of all hypotheses about one recording: Gaussian part and non-Gaussian features.

use super::nongaussian::looks::{Choice, Looks, Seen, Views};
use super::nongaussian::telegraph::{Start, TelegraphFit, beside};
use super::nongaussian::{quantization, repeats, shots};
use super::parts::parts;
use super::prepare::outliers::{LIMIT, clean};
use super::whittle::basis::{Data, SpectralBasis};
use super::whittle::evidence::{Likelihood, nuisances};
use super::whittle::hypothesis::{Candidate, Hypothesis, Kind};
use super::whittle::nonparametric::{Comb, CovariateForm, Follows, FreeSpectrum, RateForm, SmoothTime};
use super::whittle::search::{LEAST_SCREENED, POLICY, Sets};
use crate::effects::{Effect, Explanation, NoiseState};
use crate::gap::answer::calibration::Calibration;
use crate::gap::selection::findings::Findings;
use crate::gap::selection::leave_out::{LeftOut, tell};
use crate::gap::selection::prior::Prior;
use crate::gap::selection::search::{Addition, SCREENED, Search};
use crate::gap::selection::sets::{Part, WeightedSet};
use crate::gap::trace::{Decision, Step, TraceStage, of_additions};
use crate::model::Scene;

/// Candidates in one scene: the effects that it can show, and the free forms.
pub(crate) fn candidates(effects: &[&'static dyn Effect], scene: &Scene) -> Vec<Candidate> {
    let mut all = Vec::new();
    for effect in effects {
        let id = effect.about().id.to_owned();
        let kind = match effect.explanation(scene) {
            Some(Explanation::Line(s)) => Kind::Line(s, 1),
            Some(Explanation::Signal(s)) => Kind::Signal(s),
            Some(Explanation::Noise(n)) => Kind::Noise(n),
            Some(Explanation::Filter(n)) => Kind::Filter(n),
            Some(Explanation::Level(n)) => Kind::Level(n),
            Some(Explanation::Variance(s)) => Kind::Variance(s),
            Some(Explanation::TurnOn) => Kind::TurnOn,
            _ => continue,
        };
        all.push(Candidate { id, named: true, kind });
    }
    let mut free = |id: &str, kind: Kind| all.push(Candidate { id: id.to_owned(), named: false, kind });
    free("free.time", Kind::Signal(Box::new(SmoothTime(12))));
    for (name, follows) in [("temperature", Follows::Temperature), ("supply", Follows::Supply)] {
        if follows.of(scene).is_some() {
            free(&format!("free.{name}"), Kind::Signal(Box::new(CovariateForm(follows))));
            free(&format!("free.{name}_rate"), Kind::Signal(Box::new(RateForm(follows))));
            free(&format!("free.variance_{name}"), Kind::Variance(Box::new(CovariateForm(follows))));
            free(&format!("free.variance_{name}_rate"), Kind::Variance(Box::new(RateForm(follows))));
        }
    }
    free("free.variance_time", Kind::Variance(Box::new(SmoothTime(6))));
    free("free.spectrum", Kind::Shape(Box::new(FreeSpectrum)));
    free("free.periodic", Kind::Line(Box::new(Comb(6)), 6));
    free("free.pulses", Kind::Line(Box::new(Comb(16)), 16));
    all
}

/// Sets further below the best in ln weight take no part in the answer, nats.
pub(crate) const DEPTH: f64 = 9.0;
/// Further distance below the best at which a combination with a non-Gaussian feature still takes part, nats.
const LAYER_DEPTH: f64 = 12.0;
/// Most sets of the Gaussian part that take part.
const SETS: usize = 60;

/// How hypotheses are compared.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Options {
    /// Prior odds of the search.
    pub prior: Prior,
    /// Calibration of evidences to probabilities.
    pub calibration: Calibration,
}

/// A set before the non-Gaussian features of its whitened series are added.
struct Account {
    /// Its parts beside a path of jumps, `missed_nats` being ln evidence lost by the Gaussian part; none of a set of
    /// the search, whose parts follow from its fit.
    parts: Option<Vec<Part>>,
    ln_weight: f64,
    view: usize,
    /// Whether it has the nominal noise level where the best set has another.
    nominal_level: bool,
}

/// Compares all hypotheses about one recording: readings `recorded` in rad/s, one per row of `scene`.
pub(crate) fn judge(scene: &Scene, recorded: &[f64], effects: &[&'static dyn Effect], options: &Options) -> Findings {
    let prior = options.prior;
    let named = |of: fn(&Explanation) -> bool| {
        effects.iter().find(|e| e.explanation(scene).as_ref().is_some_and(of)).map(|e| e.about().id)
    };
    let mut scene = scene.clone();
    let nominal = scene.white_std_rad_s;
    let grain = quantization::Grain::of(recorded, nominal);
    scene.white_std_rad_s = (nominal * nominal + grain.variance()).sqrt();
    let frame = SpectralBasis::new(&scene);
    let deviation: Vec<f64> =
        (0..frame.len()).map(|i| recorded[i] - scene.warm_up.error_rad_s(scene.time.at(i))).collect();
    let (cleaned, aside) = clean(&deviation);
    let frame = frame.resolving(&cleaned);
    let data: Data = frame.data(cleaned);
    let candidates = candidates(effects, &frame.scene);
    let nuisance = nuisances(&frame);
    let likelihood = Likelihood::new(&frame, &data, &candidates, &nuisance);
    let weighed = Sets::new(&likelihood, prior);
    let mut search = Search::new(&weighed, POLICY);
    let best = search.run();
    let levels: Vec<usize> = best.fitted.hypothesis.candidates().filter(|c| candidates[*c].kind.is_level()).collect();
    // a fitted noise level hides its cause: bursts are judged beside the nominal level too
    let unlevelled = search.meet_without(&best, &levels);
    if let Some(noise) = candidates.iter().position(|c| c.kind.is_exponential()) {
        // telegraph noise is looked for where correlated noise may be
        search.with(&best, noise);
    }
    // sets without one part, for the evidence that each part is missed by
    for met in search.posterior().iter().filter(|m| m.ln_weight > best.ln_weight - DEPTH).take(SETS) {
        met.fitted.hypothesis.candidates().for_each(|c| drop(search.meet_without(met, &[c])));
    }

    let looks = Looks {
        aside: aside.iter().map(|i| (*i, deviation[*i] - data.values_rad_s[*i])).collect(),
        step_s: frame.scene.step_s,
        start_s: frame.scene.time.at(0),
        prior,
        // with coarse quantization no distribution of samples is normal
        coarse: grain.lsb_rad_s.is_some_and(|lsb| lsb > 0.3 * nominal),
        outliers: named(|e| matches!(e, Explanation::Outliers { .. })),
    };
    let all = search.posterior();
    let keys: Vec<Vec<usize>> = all.iter().map(|m| m.fitted.hypothesis.key()).collect();
    let number = |h: &Hypothesis| keys.iter().position(|k| *k == h.key());
    let deep: Vec<bool> =
        (0..all.len()).map(|i| i < SETS && all[i].ln_weight > best.ln_weight - DEPTH || keys[i].is_empty()).collect();
    let mut wanted = deep.clone();
    for met in all.iter().zip(&deep).filter(|(_, deep)| **deep).map(|(m, _)| &m.fitted.hypothesis) {
        let less = met.candidates().filter_map(|c| number(&met.without(c)));
        less.for_each(|i| wanted[i] = true);
    }
    number(&unlevelled.fitted.hypothesis).into_iter().for_each(|i| wanted[i] = true);
    let mut views = Views::default();
    let mut beside_path: Vec<Account> = Vec::new();
    let mut by_levels: Option<Vec<(&str, f64)>> = None;
    if let Some((found, ln_weight)) = popcorn(&likelihood, &nuisance, &search, &looks) {
        let h = &found.fitted.hypothesis;
        let without = search.meet(h).ln_weight;
        let left: Vec<f64> = data.values_rad_s.iter().zip(&found.path).map(|(y, p)| y - p).collect();
        let rest = frame.data_undithered(left);
        let likelihood = Likelihood::new(&frame, &rest, &candidates, &nuisance);
        let shots = shots::judge(&found.series, found.std, found.step_s);
        let ln_shots = ln_weight - found.ln_chain - prior.ln_named + shots.ln_evidence + prior.ln_free;
        // events are looked for in the remainder beside the path, if the path is probable enough
        let in_reach = ln_weight.max(ln_shots) > best.ln_weight - DEPTH;
        let seen = Seen::new(if in_reach { &likelihood } else { weighed.likelihood }, h);
        let others = parts(&likelihood, &found.fitted);
        let left_out = |c: usize| {
            let less = likelihood.fit_with_shapes(&h.without(c));
            LeftOut::new(&candidates[c].id, found.fitted.ln_evidence - less.ln_evidence, 0.0)
        };
        let left_out: Vec<LeftOut> = h.candidates().map(left_out).collect();
        let view = views.of(seen).unwrap_or(0);
        let mut push = |part: Part, ln_weight: f64, ln_prior: f64| {
            let own = LeftOut::new(&part.id, ln_weight - without, ln_prior);
            let mut parts = [&others[..], &[part]].concat();
            tell(&mut parts, &[&left_out[..], &[own]].concat());
            beside_path.push(Account { parts: Some(parts), ln_weight, view, nominal_level: false });
        };
        if let Some(id) = named(|e| matches!(e, Explanation::TwoLevels)) {
            let part = crate::gap::rest::parts::telegraph(id, &found, &frame.scene, (ln_weight - without).max(0.1));
            push(part, ln_weight, prior.ln_named);
        }
        let part = crate::gap::rest::parts::shots(&shots, (ln_shots - without).max(0.1));
        push(part, ln_shots, prior.ln_free);
        let jumps = named(|e| matches!(e, Explanation::TwoLevels)).map(|id| (id, ln_weight - best.ln_weight));
        by_levels = Some(jumps.into_iter().chain([("free.shots", ln_shots - best.ln_weight)]).collect());
    }
    let mut accounts: Vec<Option<Account>> = all.iter().map(|_| None).collect();
    let mut order: Vec<usize> = (0..all.len()).filter(|i| wanted[*i]).collect();
    // sets that take part first, then those that they are compared with
    order.sort_by_key(|i| !deep[*i]);
    for i in order {
        let h = &all[i].fitted.hypothesis;
        accounts[i] = views.of(Seen::new(&likelihood, h)).map(|view| Account {
            parts: None,
            ln_weight: all[i].ln_weight,
            view,
            nominal_level: !levels.is_empty() && !h.candidates().any(|c| candidates[c].kind.is_level()),
        });
    }
    accounts.extend(beside_path.into_iter().map(Some));
    views.look(&looks);

    let mut notes = Vec::new();
    let mut rows_removed = None;
    if !aside.is_empty() {
        let note = format!("Samples that stand out were put aside before anything else was judged: {}.", aside.len());
        let step = Step::new(TraceStage::Data, "samples that stand out", Decision::Removed, note.as_str());
        rows_removed =
            Some(step.limit("distance from the median of its neighbours", LIMIT, "robust standard deviations"));
        notes.push(note);
    }
    let white = |at: usize| accounts[at].as_ref().map_or(&[][..], |a| &views.layers[a.view].white);
    let lattice = grain.lsb_rad_s.map(|lsb| {
        let gain = quantization::gain(white(0), lsb, nominal, nominal);
        // quantization is read off the digits: no evidence is weighed against it
        crate::gap::rest::parts::lattice(lsb, recorded, gain, named(|e| matches!(e, Explanation::Lattice)))
    });
    let repeats = repeats::judge(recorded, scene.white_std_rad_s, |v| grain.step_rad_s(v));
    let repeats = (repeats.ln_evidence + prior.ln_free > 0.0).then(|| crate::gap::rest::parts::repeats(&repeats));

    let layers = |a: &Account| &views.layers[a.view];
    let total = |a: &Account, c: Choice| a.ln_weight + layers(a).ln_weight(c);
    // beside a path of jumps, which follows anything slow, no other free form is looked for
    let choices = |a: &Account| layers(a).choices(a.nominal_level, a.parts.is_some());
    let there = || accounts.iter().flatten();
    let top = there().flat_map(|a| choices(a).into_iter().map(move |c| total(a, c))).fold(f64::NEG_INFINITY, f64::max);
    let mut combined = Vec::new();
    for (at, account) in accounts.iter().enumerate() {
        let Some(a) = account else { continue };
        let empty = keys.get(at).is_some_and(Vec::is_empty);
        let near: Vec<Choice> =
            choices(a).into_iter().filter(|c| empty || total(a, *c) > top - DEPTH - LAYER_DEPTH).collect();
        if near.is_empty() {
            continue;
        }
        let own = a.parts.clone().unwrap_or_else(|| parts(&likelihood, &all[at].fitted));
        for choice in near {
            let ln_weight = total(a, choice);
            let left_out = |h: &Hypothesis, c: usize| {
                let less = accounts.get(number(&h.without(c))?)?.as_ref()?;
                let Candidate { id, named, .. } = &candidates[c];
                Some(LeftOut::new(id, ln_weight - total(less, choice), prior.of(*named)))
            };
            let met = all.get(at).map(|met| &met.fitted.hypothesis).into_iter();
            let left_out: Vec<LeftOut> = met.flat_map(|h| h.candidates().filter_map(|c| left_out(h, c))).collect();
            let mut parts = own.clone();
            tell(&mut parts, &left_out);
            parts.extend(layers(a).parts(choice).chain(&lattice).chain(&repeats).cloned());
            combined.push(WeightedSet { parts, ln_weight, probability: 0.0 });
        }
    }
    let mut trace = tried(&search, &candidates, &best.fitted.hypothesis);
    trace.extend(rows_removed);
    trace.extend(by_levels.into_iter().flatten().map(|(subject, nats)| {
        let reason = "in the place of a correlated noise, over the best set without";
        let decision = if nats > 0.0 { Decision::Taken } else { Decision::Rejected };
        Step::new(TraceStage::Preprocessing, subject, decision, reason).nats(nats)
    }));
    let weight = |a: &Account| choices(a).into_iter().map(|c| total(a, c)).fold(f64::NEG_INFINITY, f64::max);
    let whole = there().max_by(|a, b| weight(a).total_cmp(&weight(b)));
    trace.extend(whole.into_iter().flat_map(|a| layers(a).steps(a.nominal_level, a.parts.is_some())));
    Findings { trace, ..Findings::new(combined, &prior, &options.calibration, notes) }
}

/// Each candidate alone, and beside the best set, as steps of the trail.
fn tried(search: &Search<Sets>, candidates: &[Candidate], best: &Hypothesis) -> Vec<Step> {
    let alone = |tried: Addition| {
        let id = &candidates[tried.candidate].id;
        let step = |reason: &str| Step::new(TraceStage::Screening, id, Decision::Estimated, reason);
        match (tried.start, tried.fitted) {
            (_, Some(gain)) => step("gain, fitted").nats(gain),
            (None, None) => step("cannot be added alone: there is no start"),
            (Some(gain), None) if gain <= LEAST_SCREENED => {
                let step = step("gain where it starts: too little to be fitted").nats(gain);
                step.limit("gain from which on one is fitted", LEAST_SCREENED, "nats")
            }
            (Some(gain), None) => {
                let step = step("gain where it starts; others gained more, so that it was not fitted alone").nats(gain);
                step.limit("distance from the largest gain up to which one is fitted", SCREENED, "nats")
            }
        }
    };
    let mut steps: Vec<Step> = search.additions(&Hypothesis::default()).into_iter().map(alone).collect();
    let gain = |step: &Step| step.nats.unwrap_or(f64::NEG_INFINITY);
    steps.sort_by(|a, b| gain(b).total_cmp(&gain(a)));
    let beside = search.additions(best);
    let gain = |tried: &Addition| Some((candidates[tried.candidate].id.as_str(), tried.fitted.or(tried.start)?));
    steps.extend(of_additions(beside.iter().filter_map(gain)));
    steps
}

/// Least expected number of jumps of a path: one jump is a bias step.
const LEAST_JUMPS: f64 = 1.5;

/// The best set with telegraph noise in the place of a noise, and its ln weight; none where no set has a noise.
fn popcorn(
    likelihood: &Likelihood,
    nuisance: &[(crate::gap::rest::whittle::basis::ColumnId, f64)],
    search: &Search<Sets>,
    looks: &Looks,
) -> Option<(TelegraphFit, f64)> {
    let Looks { prior, coarse, .. } = *looks;
    let Likelihood { frame, data, candidates, .. } = *likelihood;
    let ln_weight =
        |ln_evidence: f64, h: &Hypothesis| ln_evidence + prior.ln_named + Sets::new(likelihood, prior).ln_prior(h);
    let sets = search.posterior();
    let top = sets.first()?.ln_weight;
    let mut best: Option<(TelegraphFit, f64)> = None;
    let mut tried: Vec<Vec<usize>> = Vec::new();
    let likely = sets.iter().filter(|m| m.ln_weight > top - 9.0 && !m.fitted.hypothesis.noises.is_empty()).take(5);
    // where a signal stood for a part of the path, the path begins without it
    let wholes = likely.map(|met| &met.fitted.hypothesis).flat_map(|h| {
        let alone = (!coarse).then(|| Hypothesis { signals: Vec::new(), ..h.clone() });
        std::iter::once(h.clone()).chain(alone)
    });
    for whole in wholes {
        for part in &whole.noises {
            let Kind::Noise(noise) = &candidates[part.candidate].kind else { continue };
            let base = whole.without(part.candidate);
            let key = base.key();
            if tried.contains(&key) {
                continue;
            }
            tried.push(key);
            // spacing and dwell time from standard deviation and correlation time of the noise in the path's place, if
            // it has them
            let theta: Vec<f64> = part.ln_theta.iter().map(|v| v.exp()).collect();
            let [spacing_rad_s, mean_dwell_s] = match noise.state(&theta) {
                Some(NoiseState::Exponential { time_s, std_rad_s }) => [2.0 * std_rad_s, 2.0 * time_s],
                _ => {
                    let followed = frame.series(&likelihood.followed(&whole, &likelihood.remainder(&whole)));
                    let square = followed.iter().map(|v| v * v).sum::<f64>() / frame.len() as f64;
                    [2.0 * square.sqrt(), 0.02 * frame.scene.span_s()]
                }
            };
            let start = Start { spacing_rad_s, mean_dwell_s, coarse };
            let found = beside(frame, data, candidates, nuisance, &base, &whole, start);
            let Some(found) = found.filter(|found| found.chain.jumps >= LEAST_JUMPS) else { continue };
            let weight = ln_weight(found.ln_evidence, &base);
            if best.as_ref().is_none_or(|b| weight > b.1) {
                best = Some((found, weight));
            }
        }
    }
    let (mut found, weight) = best?;
    // a part that was needed beside the noise may be superfluous beside the path
    let left: Vec<f64> = data.values_rad_s.iter().zip(&found.path).map(|(y, p)| y - p).collect();
    let rest = frame.data_undithered(left);
    let beside_path = Likelihood::new(frame, &rest, candidates, nuisance);
    let settled = Search::new(&Sets::new(&beside_path, prior), POLICY).settled(&found.fitted.hypothesis);
    let h = &settled.fitted.hypothesis;
    if h.size() == found.fitted.hypothesis.size() {
        return Some((found, weight));
    }
    // evidence of the settled set with the same path
    found.ln_evidence += settled.fitted.ln_evidence - found.fitted.ln_evidence;
    found.fitted = settled.fitted.clone();
    let weight = ln_weight(found.ln_evidence, h);
    let mean_dwell_s = 0.5 * (found.chain.dwell_low + found.chain.dwell_high) * frame.scene.step_s;
    let start = Start { spacing_rad_s: found.chain.spacing, mean_dwell_s, coarse };
    let again = beside(frame, data, candidates, nuisance, h, h, start);
    let weighed = again.map(|again| (ln_weight(again.ln_evidence, h), again));
    Some(weighed.filter(|(w, _)| *w > weight).map_or((found, weight), |(w, again)| (again, w)))
}
