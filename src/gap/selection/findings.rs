//! Result of the comparison of hypotheses: sets of effects with probabilities, shares and parameters.

use super::sets::{Main, Part, WeightedSet};
use crate::error::{Error, ErrorKind, Result};
use crate::gap::answer::calibration::{Calibration, counts};
use crate::gap::selection::prior::Prior;
use crate::gap::trace::Step;
use std::collections::{BTreeMap, BTreeSet};

/// All sets, most probable first.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Findings {
    /// The sets, most probable first.
    pub sets: Vec<WeightedSet>,
    /// Effects set aside as idle (present, but closing nothing of the gap), each with its probability of being present.
    pub idle: Vec<(Part, f64)>,
    /// Least [`Part::missed_nats`] of an effect that is named, nats: minus the ln of its prior odds.
    pub least_nats: f64,
    /// Probability, given a gap, that its cause is none of the candidates.
    pub doubt: f64,
    /// The same of sets whose main cause is an effect, and of those where it has no name.
    pub(crate) doubts: [f64; 2],
    /// Remarks on the recording, in sentences.
    pub notes: Vec<String>,
    /// Steps of the stages before the sets were weighed.
    pub trace: Vec<Step>,
}

/// Share from which on an effect has to be named, nats; a smaller side effect may be named.
const MATTERS: f64 = 6.0;

/// Cost of a false alarm relative to the cost of missing a gap.
const FALSE_ALARM: f64 = 4.0;

/// Prefix of the id of the free form that replaces a refuted effect; the effect's id follows.
pub(crate) const REFUTED: &str = "free.refuted.";

/// Least probability of an effect that counts as present beyond doubt, given that the cause is among the candidates.
const BEYOND_DOUBT: f64 = 0.9;

/// Gives each set the share that exp(`ln`) has in the sum over all, times `believed`; most probable first.
fn normalise(sets: &mut [WeightedSet], ln: &[f64], believed: impl Fn(&WeightedSet) -> f64) {
    let top = ln.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let total: f64 = ln.iter().map(|v| (v - top).exp()).sum();
    sets.iter_mut().zip(ln).for_each(|(set, v)| set.probability = believed(set) * (v - top).exp() / total);
    sets.sort_by(|a, b| b.probability.total_cmp(&a.probability));
}

/// One less the doubt of a set; `doubts`: where its main cause is an effect, and where it has no name.
fn believed([named, unknown]: [f64; 2], set: &WeightedSet) -> f64 {
    match Main::of(set) {
        _ if set.parts.is_empty() => 1.0,
        Main::Unknown => 1.0 - unknown,
        _ => 1.0 - named,
    }
}

impl Findings {
    /// Probability of the nominal simulator below which a gap is asserted: a false alarm costs four times a missed gap.
    pub(crate) const LEAST_NONE: f64 = 1.0 / (1.0 + FALSE_ALARM);

    /// Sets with normalised probabilities under `calibration`; `prior` is the one that their `ln_weight` includes.
    pub(crate) fn new(
        mut sets: Vec<WeightedSet>,
        prior: &Prior,
        calibration: &Calibration,
        notes: Vec<String>,
    ) -> Self {
        let ln: Vec<f64> = sets.iter().map(|s| calibration.ln_weight(s, prior)).collect();
        normalise(&mut sets, &ln, |_| 1.0);
        let (idle, trace) = (Vec::new(), Vec::new());
        let mut findings = Self { sets, idle, least_nats: -prior.ln_named, doubt: 0.0, doubts: [0.0; 2], notes, trace };
        findings.doubt_as(calibration);
        findings
    }

    /// Sets the doubt of `calibration`, and lowers the probabilities by it; they sum to one before.
    fn doubt_as(&mut self, calibration: &Calibration) {
        let doubt = calibration.doubt_of(self.mains().iter().filter(|m| m.0 != Main::None).map(|m| m.1));
        self.doubts = [doubt, calibration.doubt_unknown.unwrap_or(doubt)];
        let doubts = self.doubts;
        self.sets.iter_mut().for_each(|set| set.probability *= believed(doubts, set));
        self.doubt_of_all();
    }

    /// Sets the doubt of all sets but the empty one together.
    fn doubt_of_all(&mut self) {
        let gaps = || self.sets.iter().filter(|set| !set.parts.is_empty());
        let all: f64 = gaps().map(|set| set.probability / believed(self.doubts, set)).sum();
        let left: f64 = gaps().map(|set| set.probability).sum();
        self.doubt = if all > 0.0 { 1.0 - left / all } else { self.doubts[0] };
    }

    /// With the steps of the trail that follow from the sets; refuses sets whose probability is not finite.
    ///
    /// # Errors
    /// [`ErrorKind::Numeric`] with the name of the `input`.
    pub(crate) fn weighed(mut self, input: &str) -> Result<Self> {
        if self.sets.iter().all(|set| set.probability.is_finite()) {
            self.trace.extend(self.steps());
            return Ok(self);
        }
        Err(Error::new(ErrorKind::Numeric, input, "the recording has no finite likelihood under the nominal simulator")
            .hint("look for readings or noise levels that are off by orders of magnitude: gyroid inspect"))
    }

    /// Removes given parts (those that the configuration states) from every set, and changes the probabilities
    /// accordingly: a given part has no prior cost, and a further effect counts as the first one.
    pub(crate) fn take_out_given(&mut self, calibration: &Calibration, is_given: impl Fn(&Part) -> bool) {
        let ln_prior = |set: &WeightedSet| {
            let (effects, free) = counts(set);
            calibration.ln_prior(effects, free)
        };
        let doubts = self.doubts;
        let mut total = 0.0;
        for set in &mut self.sets {
            let before = ln_prior(set).exp() * believed(doubts, set);
            set.parts.retain(|part| !is_given(part));
            set.probability *= ln_prior(set).exp() / before;
            total += set.probability;
        }
        self.sets.iter_mut().for_each(|set| set.probability /= total);
        self.sets.sort_by(|a, b| b.probability.total_cmp(&a.probability));
        self.doubt_as(calibration);
    }

    /// Moves the effects `ids` out of every set into `idle`. A set that held nothing else is then empty: no gap.
    pub(crate) fn set_aside(&mut self, ids: &[String]) {
        for id in ids {
            let part = self.best_with(id, false).and_then(|s| s.part(id)).cloned();
            self.idle.extend(part.map(|part| (part, self.presence(id))));
        }
        self.sets.iter_mut().for_each(|s| s.parts.retain(|p| !ids.contains(&p.id)));
    }

    /// Removes the effects `ids` from every set, because the hold-out recording contradicts them. In a set that holds
    /// nothing else, free forms with the same shares replace them.
    pub(crate) fn refute(&mut self, ids: &[String]) {
        let doubts = self.doubts;
        for set in &mut self.sets {
            let before = believed(doubts, set);
            let (refuted, mut left): (Vec<Part>, Vec<Part>) = set.parts.drain(..).partition(|p| ids.contains(&p.id));
            if left.is_empty() {
                left.extend(refuted.into_iter().map(|part| {
                    let description = format!("what {} explains here and not in the recording held out", part.id);
                    Part { description, ..Part::new(&format!("{REFUTED}{}", part.id), false, part.share) }
                }));
            }
            set.parts = left;
            set.probability *= believed(doubts, set) / before;
        }
    }

    /// Changes the probabilities of the sets by further ln evidence, nats, of each effect in them: of a recording that
    /// took no part in the comparison.
    pub(crate) fn weigh_by(&mut self, evidence: &[(String, f64)]) {
        if evidence.is_empty() {
            return;
        }
        let doubts = self.doubts;
        let told = |part: &Part| evidence.iter().find(|e| e.0 == part.id).map_or(0.0, |e| e.1);
        let nats: Vec<f64> = self.sets.iter().map(|set| set.parts.iter().map(told).sum()).collect();
        let ln = |(set, nats): (&WeightedSet, &f64)| (set.probability / believed(doubts, set)).ln() + nats;
        let ln: Vec<f64> = self.sets.iter().zip(&nats).map(ln).collect();
        for (set, nats) in self.sets.iter_mut().zip(nats) {
            set.ln_weight += nats;
            set.parts.iter_mut().for_each(|part| part.missed_nats = part.missed_nats.map(|nats| nats + told(part)));
        }
        normalise(&mut self.sets, &ln, |set| believed(doubts, set));
        self.doubt_of_all();
    }

    /// Adds `part` to every set, removes the effects `ids`, and lowers the shares of the free forms by the share of
    /// `part`.
    pub(crate) fn lead(&mut self, part: &Part, ids: &[String]) {
        let doubts = self.doubts;
        for set in &mut self.sets {
            let before = believed(doubts, set);
            set.parts.retain(|p| p.id != part.id && !ids.contains(&p.id));
            let unnamed: f64 = set.parts.iter().filter(|p| !p.named).map(|p| p.share.max(0.0)).sum();
            let left = if unnamed > part.share { 1.0 - part.share / unnamed } else { 0.0 };
            set.parts.iter_mut().filter(|p| !p.named).for_each(|p| p.share *= left);
            set.parts.push(Part { share: part.share.max(unnamed), ..part.clone() });
            set.probability *= believed(doubts, set) / before;
        }
    }

    /// Whether an effect is worth naming: `missed_nats` reaches [`Findings::least_nats`], or, where it was not
    /// computed, the effect is present beyond doubt with this probability.
    pub(crate) fn is_worth_naming(&self, missed_nats: Option<f64>, presence: f64) -> bool {
        missed_nats.map_or(self.is_beyond_doubt(presence), |nats| nats >= self.least_nats)
    }

    /// Whether this probability of presence is beyond doubt, given that the cause is among the candidates.
    pub(crate) fn is_beyond_doubt(&self, presence: f64) -> bool {
        presence >= self.least_presence()
    }

    /// Least probability of being present of what is there beyond doubt, if the cause is among what was compared.
    pub(crate) fn least_presence(&self) -> f64 {
        BEYOND_DOUBT * (1.0 - self.doubt)
    }

    /// Probability of each main cause, most probable first.
    pub fn mains(&self) -> Vec<(Main, f64)> {
        let mut sums: BTreeMap<Main, f64> = BTreeMap::new();
        for s in &self.sets {
            *sums.entry(Main::of(s)).or_default() += s.probability;
        }
        let mut all: Vec<(Main, f64)> = sums.into_iter().collect();
        all.sort_by(|a, b| b.1.total_cmp(&a.1));
        all
    }

    /// The main cause to answer with, at least expected cost: the most probable one where a gap is more than four times
    /// as probable as none, else none.
    pub fn top(&self) -> Main {
        let mains = self.mains();
        let none = mains.iter().find(|m| m.0 == Main::None).map_or(0.0, |m| m.1);
        let first = mains.into_iter().next().filter(|_| none < Self::LEAST_NONE);
        first.map_or(Main::None, |m| m.0)
    }

    /// Probability that `id` is present.
    pub(crate) fn presence(&self, id: &str) -> f64 {
        self.sets.iter().filter(|s| s.part(id).is_some()).map(|s| s.probability).sum()
    }

    /// Effects to be named together: of the sets T that hold `main`, the one with the largest probability that T holds
    /// every effect that matters and that all of T is present. Of effects that explain the same (each below one half) T
    /// has the most probable one.
    pub fn together(&self, main: Option<&str>) -> Vec<String> {
        type Ids<'a> = BTreeSet<&'a str>;
        let mut known: BTreeMap<(Ids, Ids), f64> = BTreeMap::new();
        for s in &self.sets {
            let named = || s.parts.iter().filter(|p| p.named);
            let there: Ids = named().map(|p| p.id.as_str()).collect();
            let matters: Ids = named().filter(|p| p.share >= MATTERS).map(|p| p.id.as_str()).collect();
            *known.entry((matters, there)).or_default() += s.probability;
        }
        let score = |t: &Ids| -> f64 {
            let fits = |k: &&(Ids, Ids)| k.0.is_subset(t) && t.is_subset(&k.1);
            known.keys().filter(fits).filter_map(|k| known.get(k)).sum()
        };
        let wanted = |t: &&Ids| main.is_none_or(|m| t.contains(m));
        let best = known.keys().flat_map(|k| [&k.0, &k.1]).filter(wanted).map(|t| (score(t), t.len(), t));
        // of equally probable sets the larger: naming a small effect that is present is welcome
        let best = best.max_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        best.map(|b| b.2.iter().map(|id| (*id).to_owned()).collect()).unwrap_or_default()
    }

    /// Id, whether it is an effect of the library, and probability of presence of every part, most probable first.
    pub(crate) fn ids(&self) -> Vec<(String, bool, f64)> {
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

    /// The most probable set that holds `id`; if `as_main`, in which it is the main cause.
    pub(crate) fn best_with(&self, id: &str, as_main: bool) -> Option<&WeightedSet> {
        self.sets.iter().find(|s| s.part(id).is_some() && (!as_main || s.main().is_some_and(|m| m.id == id)))
    }

    /// The most probable set whose main cause is a free form.
    pub(crate) fn best_unknown(&self) -> Option<&WeightedSet> {
        self.sets.iter().find(|s| s.main().is_some_and(|m| !m.named))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::ids::{gauss_markov, rate_ramp, rate_random_walk, tone};

    fn set(parts: &[(&str, f64)], probability: f64) -> WeightedSet {
        let part = |(id, share): &(&str, f64)| Part::new(id, !id.starts_with("free."), *share);
        WeightedSet { parts: parts.iter().map(part).collect(), ln_weight: 0.0, probability }
    }

    fn findings(sets: Vec<WeightedSet>) -> Findings {
        Findings { sets, ..Findings::default() }
    }

    #[test]
    fn of_effects_that_stand_in_for_each_other_the_most_probable_is_named() {
        // each noise is present with a probability below one half, one of the two with 0.85
        let f = findings(vec![
            set(&[(tone(), 90.0), (gauss_markov(), 30.0)], 0.45),
            set(&[(tone(), 90.0), (rate_random_walk(), 29.0)], 0.40),
            set(&[(tone(), 90.0)], 0.15),
        ]);
        assert!(f.presence(gauss_markov()) < 0.5);
        assert_eq!(f.together(Some(tone())), [gauss_markov(), tone()]);
        assert_eq!(f.together(Some(rate_random_walk())), [rate_random_walk(), tone()]);
    }

    #[test]
    fn a_side_effect_is_named_only_where_that_is_no_risk() {
        let side =
            |p: f64| findings(vec![set(&[(tone(), 90.0), (rate_ramp(), 3.0)], p), set(&[(tone(), 90.0)], 1.0 - p)]);
        // leaving a small effect out costs nothing, naming one that is absent does
        assert_eq!(side(0.9).together(None), [tone()]);
        assert_eq!(side(1.0).together(None), [rate_ramp(), tone()]);
        // an effect with a larger share has to be named
        let f = findings(vec![set(&[(tone(), 90.0), (rate_ramp(), 15.0)], 0.6), set(&[(tone(), 90.0)], 0.4)]);
        assert_eq!(f.together(None), [rate_ramp(), tone()]);
    }

    #[test]
    fn what_no_effect_explains_is_counted_together() {
        let split = set(&[(tone(), 50.0), ("free.time", 30.0), ("free.supply", 31.0)], 1.0);
        assert_eq!(Main::of(&split), Main::Unknown);
        assert_eq!(split.main().map(|p| p.id.as_str()), Some("free.supply"));
        let named = set(&[(tone(), 50.0), ("free.time", 30.0), ("free.supply", -900.0)], 1.0);
        assert_eq!(Main::of(&named), Main::Effect(tone().into()));
        assert_eq!(Main::of(&set(&[], 1.0)), Main::None);
    }

    #[test]
    fn a_gap_is_asserted_where_it_is_four_times_as_probable_as_none() {
        let top = |none: f64| {
            let effect = set(&[(tone(), 9.0)], 0.6 * (1.0 - none));
            let other = set(&[("free.time", 9.0)], 0.4 * (1.0 - none));
            findings(vec![effect, other, set(&[], none)]).top()
        };
        assert_eq!([top(0.19), top(0.21)], [Main::Effect(tone().into()), Main::None]);
        assert_eq!(findings(Vec::new()).top(), Main::None);
    }

    #[test]
    fn what_another_recording_says_is_further_evidence() {
        let part = Part { missed_nats: Some(4.0), ..Part::new(rate_ramp(), true, 9.0) };
        let with = WeightedSet { parts: vec![part], ln_weight: 4.0, probability: 0.0 };
        let sets = vec![with, set(&[], 0.0), set(&[(tone(), 9.0)], 0.0)];
        let calibration = Calibration { doubt: [0.2; 2], ..Calibration::none(&Prior::default()) };
        let mut f = Findings::new(sets, &Prior::default(), &calibration, Vec::new());
        let odds = |f: &Findings, id: &str| {
            f.presence(id) / 0.8 / f.sets.iter().find(|s| s.parts.is_empty()).unwrap().probability
        };
        let before = [odds(&f, rate_ramp()), odds(&f, tone())];
        f.weigh_by(&[(rate_ramp().into(), -3.0)]);
        assert!((odds(&f, rate_ramp()) / before[0] - (-3f64).exp()).abs() < 1e-12);
        assert!((odds(&f, tone()) / before[1] - 1.0).abs() < 1e-12);
        // what the candidates have together is what it was: the doubt is that of the calibration
        let none = f.sets.iter().find(|s| s.parts.is_empty()).unwrap().probability;
        let others: f64 = f.sets.iter().filter(|s| !s.parts.is_empty()).map(|s| s.probability).sum();
        assert!((none + others / 0.8 - 1.0).abs() < 1e-12);
        assert_eq!(f.best_with(rate_ramp(), true).unwrap().part(rate_ramp()).unwrap().missed_nats, Some(1.0));
    }

    #[test]
    fn doubt_is_larger_where_the_candidates_are_divided() {
        let calibration = Calibration { doubt: [0.02, 0.5], ..Calibration::none(&Prior::default()) };
        let weighed = |weights: [f64; 2]| {
            let one = |(id, ln_weight)| WeightedSet { ln_weight, ..set(&[(id, 9.0)], 0.0) };
            let sets = [tone(), rate_ramp()].into_iter().zip(weights).map(one).chain([set(&[], 0.0)]).collect();
            Findings::new(sets, &Prior::default(), &calibration, Vec::new())
        };
        let sure = weighed([60.0, 0.0]);
        assert!((sure.doubt - 0.02).abs() < 1e-9 && (sure.mains()[0].1 - 0.98).abs() < 1e-9);
        // halves: 0.5 · 0.02 + 0.5 · 0.5
        let divided = weighed([60.0, 60.0]);
        assert!((divided.doubt - 0.26).abs() < 1e-9 && (divided.mains()[0].1 - 0.37).abs() < 1e-9);
        // where nothing is lacking there is nothing to doubt
        let total: f64 = weighed([-60.0, -60.0]).sets.iter().map(|s| s.probability).sum();
        assert!((total - 1.0).abs() < 1e-9);
    }

    #[test]
    fn what_was_not_left_out_is_named_beyond_doubt_alone() {
        let f = Findings { least_nats: 3.0, ..Findings::default() };
        let worth = |missed, presence| f.is_worth_naming(missed, presence);
        assert!(worth(Some(3.1), 0.6) && !worth(Some(2.9), 0.99));
        assert!(worth(None, 0.95) && !worth(None, 0.8));
        // with a doubt of 0.15 no effect is more probable than 0.85, and the limit is lower accordingly
        assert!(Findings { doubt: 0.15, ..f }.is_beyond_doubt(0.8));
    }
}
