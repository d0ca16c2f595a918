//! Search for the sets of candidates that explain the Gaussian part of a recording, with their probabilities
//!
//! Sets are grown by one candidate at a time, pruned, and each part is exchanged against every other candidate. Every
//! set that was fitted keeps its evidence and takes part in the posterior probabilities.

use super::evidence::{Fitted, Likelihood};
use super::hypothesis::{Hypothesis, Kind};
use super::lines::Lines;
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::OnceLock;

/// Prior odds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prior {
    /// ln of the odds of one more named effect.
    pub ln_named: f64,
    /// ln of the odds of one more free form.
    pub ln_free: f64,
}

impl Prior {
    /// ln of the odds of one more part.
    #[must_use]
    pub(crate) fn of(&self, named: bool) -> f64 {
        if named { self.ln_named } else { self.ln_free }
    }
}

impl Default for Prior {
    fn default() -> Self {
        Self { ln_named: (0.08_f64).ln(), ln_free: (0.012_f64).ln() }
    }
}

/// A set that was fitted.
#[derive(Debug, Clone)]
pub(crate) struct Met {
    /// At its best parameters.
    pub fitted: Fitted,
    /// ln evidence + ln prior.
    pub ln_weight: f64,
}

/// A set extended by a candidate, and the gain in ln p; none where it cannot be.
type Extension = Option<(Hypothesis, f64)>;

/// The recording whitened under a hypothesis: independent, of variance one, where it holds.
pub(crate) fn whitened(l: &Likelihood, h: &Hypothesis) -> Vec<f64> {
    let mut z = l.remainder(h);
    let s = h.spectrum(l.frame, l.candidates);
    for (b, e) in l.frame.bins.edges.windows(2).enumerate() {
        let scale = 1.0 / s[b].sqrt();
        z[e[0]..e[1]].iter_mut().for_each(|v| *v *= scale);
    }
    let mut w = l.frame.series(&z);
    let (profile, _) = h.level(l.frame, l.candidates);
    let long = w.len().div_ceil(profile.len().max(1)).max(1);
    for (block, s) in w.chunks_mut(long).zip(&profile) {
        block.iter_mut().for_each(|v| *v /= s.sqrt());
    }
    w
}

/// The search over sets.
pub(crate) struct Search<'a> {
    likelihood: &'a Likelihood<'a>,
    prior: Prior,
    /// Least number of cycles in the recording of anything periodic.
    cycles: f64,
    met: BTreeMap<Vec<usize>, Met>,
    /// Extensions of sets by each candidate, with their gains, as far as computed.
    extensions: BTreeMap<(Vec<usize>, usize), Extension>,
}

/// Sets this much less probable than the best are not pursued, nats.
const WINDOW: f64 = 12.0;
/// Candidates that gain so many nats less than the best one where they start are not fitted ...
pub(crate) const SCREENED: f64 = 6.0;
/// ... nor those that gain less than this.
pub(crate) const LEAST_SCREENED: f64 = -4.0;
/// Candidates that are fitted beside one set.
const FITTED: usize = 5;
/// Least number of cycles of a tone: what swings fewer times in a recording is a slow change, not a vibration.
const TONE_CYCLES: f64 = 10.0;
/// Most parts of a set.
const MOST: usize = 9;
/// Most free forms in a set: what two of them leave unexplained no third one tells apart.
const MOST_FREE: usize = 2;

impl<'a> Search<'a> {
    /// A search without any fitted set.
    pub(crate) fn new(likelihood: &'a Likelihood<'a>, prior: Prior) -> Self {
        Self { likelihood, prior, cycles: 3.0, met: BTreeMap::new(), extensions: BTreeMap::new() }
    }

    /// The likelihood that is searched.
    pub(crate) fn likelihood(&self) -> &'a Likelihood<'a> {
        self.likelihood
    }

    fn ln_prior(&self, set: &[usize]) -> f64 {
        set.iter().map(|c| self.prior.of(self.likelihood.candidates[*c].named)).sum()
    }

    /// Fits a set once.
    fn meet(&mut self, h: &Hypothesis) -> Met {
        let key = h.key();
        if let Some(met) = self.met.get(&key) {
            return met.clone();
        }
        let fitted = self.likelihood.fit_with_shapes(h);
        let met = Met { ln_weight: fitted.ln_evidence + self.ln_prior(&key), fitted };
        self.met.insert(key, met.clone());
        met
    }

    /// Fits each set once, side by side.
    fn meet_all(&mut self, sets: &[Hypothesis]) -> Vec<Met> {
        let mut new: Vec<&Hypothesis> = sets.iter().filter(|h| !self.met.contains_key(&h.key())).collect();
        // of two starts of one set the first counts
        let mut keys = BTreeSet::new();
        new.retain(|h| keys.insert(h.key()));
        let fitted: Vec<Fitted> = new.par_iter().map(|h| self.likelihood.fit_with_shapes(h)).collect();
        for (h, fitted) in new.into_iter().zip(fitted) {
            let key = h.key();
            self.met.insert(key.clone(), Met { ln_weight: fitted.ln_evidence + self.ln_prior(&key), fitted });
        }
        sets.iter().map(|h| self.meet(h)).collect()
    }

    /// `base` with `candidate` added at a good start, and the gain in ln p there; none where it cannot be added.
    fn extended(&mut self, base: &Met, candidate: usize) -> Extension {
        self.extended_by(base, &[candidate]).pop().flatten()
    }

    /// [`Self::extended`] by each of `candidates`, side by side.
    fn extended_by(&mut self, base: &Met, candidates: &[usize]) -> Vec<Extension> {
        let set = base.fitted.hypothesis.key();
        let key = |candidate: usize| (set.clone(), candidate);
        let new: Vec<usize> = candidates.iter().copied().filter(|c| !self.extensions.contains_key(&key(*c))).collect();
        let whitened = OnceLock::new();
        let made: Vec<Extension> = new.par_iter().map(|c| self.extend(base, *c, &whitened)).collect();
        self.extensions.extend(new.into_iter().map(key).zip(made));
        candidates.iter().map(|c| self.extensions.get(&key(*c)).cloned().flatten()).collect()
    }

    /// `whitened`: the recording whitened under `base`, once a candidate asks for it.
    fn extend(&self, base: &Met, candidate: usize, whitened: &OnceLock<Vec<f64>>) -> Extension {
        let l = self.likelihood;
        let h = &base.fitted.hypothesis;
        let gain = |(h, value): (Hypothesis, f64)| (h, value - base.fitted.ln_mode);
        match &l.candidates[candidate].kind {
            Kind::Signal(s) => l.add_signal(h, candidate, s.as_ref()).map(|(grown, _)| gain(l.with_white(grown))),
            Kind::Noise(_) | Kind::Filter(_) | Kind::Level(_) | Kind::Shape(_) => l.add_noise(h, candidate).map(gain),
            Kind::Variance(s) => l.add_variance(h, candidate, s.as_ref()).map(gain),
            Kind::TurnOn => Some(gain(l.add_turn_on(h, candidate))),
            Kind::Line(s, harmonics) => {
                let lines = Lines::new(whitened.get_or_init(|| self.whitened(h)), l.frame.scene.step_s);
                let tone = *harmonics == 1;
                let cycles = if tone { TONE_CYCLES } else { self.cycles };
                let line = if tone { lines.tone(cycles) } else { lines.comb(cycles, *harmonics) }?;
                let ln_shapes = lines.ln_shape(&line, cycles);
                if line.gain + ln_shapes < -2.0 {
                    return None;
                }
                let added = l.add_line(h, candidate, s.as_ref(), &[line.frequency_hz], ln_shapes);
                Some((added, line.gain + ln_shapes))
            }
        }
    }

    /// The recording whitened under a hypothesis.
    pub(crate) fn whitened(&self, h: &Hypothesis) -> Vec<f64> {
        whitened(self.likelihood, h)
    }

    /// The best extension of `base` by one candidate of `among`.
    fn grown(&mut self, base: &Met, among: &[usize]) -> Option<Met> {
        let candidates = self.likelihood.candidates;
        let free = base.fitted.hypothesis.candidates().filter(|c| !candidates[*c].named).count();
        let open = |c: &usize| !base.fitted.hypothesis.holds(*c) && (candidates[*c].named || free < MOST_FREE);
        let among: Vec<usize> = among.iter().copied().filter(open).collect();
        let extended = self.extended_by(base, &among);
        let gained = |(c, e): (&usize, Extension)| e.map(|(h, gain)| (gain + self.ln_prior(&[*c]), h));
        let mut screened: Vec<(f64, Hypothesis)> = among.iter().zip(extended).filter_map(gained).collect();
        screened.sort_by(|a, b| b.0.total_cmp(&a.0));
        let top = screened.first()?.0;
        screened.retain(|s| s.0 > top - SCREENED && s.0 > LEAST_SCREENED);
        screened.truncate(FITTED);
        let sets: Vec<Hypothesis> = screened.into_iter().map(|s| s.1).collect();
        self.meet_all(&sets).into_iter().max_by(|a, b| a.ln_weight.total_cmp(&b.ln_weight))
    }

    /// Drops parts, down to `fewest`, while that makes the set more probable.
    fn pruned(&mut self, mut best: Met, fewest: usize) -> Met {
        loop {
            let parts: Vec<usize> = best.fitted.hypothesis.candidates().collect();
            if parts.len() <= fewest {
                return best;
            }
            let mut better = None;
            for c in parts {
                let met = self.meet(&best.fitted.hypothesis.without(c));
                if met.ln_weight > best.ln_weight {
                    better = Some(met);
                    break;
                }
            }
            match better {
                Some(b) => best = b,
                None => return best,
            }
        }
    }

    /// The set of `start` without the parts that make it less probable.
    pub(crate) fn settled(&mut self, start: &Hypothesis) -> Met {
        let met = self.meet(start);
        self.pruned(met, 0)
    }

    fn climb(&mut self, mut best: Met, among: &[usize]) -> Met {
        while best.fitted.hypothesis.size() < MOST {
            match self.grown(&best, among) {
                Some(next) if next.ln_weight > best.ln_weight => best = self.pruned(next, 1),
                _ => break,
            }
        }
        best
    }

    /// Searches; every set that was fitted is in [`Search::posterior`] afterwards.
    pub(crate) fn run(&mut self) -> Met {
        let all: Vec<usize> = (0..self.likelihood.candidates.len()).collect();
        let nothing = self.meet(&Hypothesis::default());
        let mut best = self.climb(nothing.clone(), &all);
        let is_named = |c: &usize| self.likelihood.candidates[*c].named;
        if !best.fitted.hypothesis.candidates().all(|c| is_named(&c)) {
            // a free form may stand where two effects together do, of which neither is close alone
            let named: Vec<usize> = all.iter().copied().filter(is_named).collect();
            let by_name = self.climb(nothing.clone(), &named);
            if by_name.ln_weight > best.ln_weight {
                best = by_name;
            }
            // a nominal level that was read off filtered noise lacks what the filter removed: both are added together
            for together in self.filters_with_levels(&nothing) {
                let filtered = self.climb(together, &all);
                if filtered.ln_weight > best.ln_weight {
                    best = filtered;
                }
            }
        }
        for _ in 0..3 {
            let start = best.ln_weight;
            let parts: Vec<usize> = best.fitted.hypothesis.candidates().collect();
            for part in parts {
                let base = self.meet(&best.fitted.hypothesis.without(part));
                let open = |c: &usize| *c != part && !base.fitted.hypothesis.holds(*c);
                let others: Vec<usize> = all.iter().copied().filter(open).collect();
                let extended = self.extended_by(&base, &others);
                let weighed =
                    |(c, e): (&usize, Extension)| e.map(|(h, gain)| (base.ln_weight + gain + self.ln_prior(&[*c]), h));
                let mut screened: Vec<(f64, Hypothesis)> = others.iter().zip(extended).filter_map(weighed).collect();
                screened.retain(|s| s.0 > best.ln_weight - WINDOW);
                screened.sort_by(|a, b| b.0.total_cmp(&a.0));
                screened.truncate(FITTED);
                let sets: Vec<Hypothesis> = screened.into_iter().map(|s| s.1).collect();
                for met in self.meet_all(&sets) {
                    if met.ln_weight > best.ln_weight - 0.5 * WINDOW {
                        // the remainder of this part may need another one
                        self.climb(met, &all);
                    }
                }
            }
            if let Some(top) = self.top() {
                best = top;
            }
            if best.ln_weight < start + 0.1 {
                break;
            }
        }
        best
    }

    /// Each filter with each level of the noise.
    fn filters_with_levels(&mut self, nothing: &Met) -> Vec<Met> {
        let candidates = self.likelihood.candidates;
        let of = |wanted: fn(&Kind) -> bool| (0..candidates.len()).filter(move |c| wanted(&candidates[*c].kind));
        let mut met = Vec::new();
        for level in of(|k| matches!(k, Kind::Level(_))) {
            let Some((h, _)) = self.extended(nothing, level) else { continue };
            let base = self.meet(&h);
            for filter in of(|k| matches!(k, Kind::Filter(_))) {
                if let Some((h, _)) = self.extended(&base, filter) {
                    met.push(self.meet(&h));
                }
            }
        }
        met
    }

    /// Each candidate that was tried beside the set `base`: its number, its gain in ln weight where it started (none where it cannot
    /// be there), and that of its fit, if it was fitted.
    pub(crate) fn additions(&self, base: &Hypothesis) -> Vec<(usize, Option<f64>, Option<f64>)> {
        let key = base.key();
        let Some(without) = self.met.get(&key) else { return Vec::new() };
        let fitted = |candidate: usize| {
            let mut with = key.clone();
            with.push(candidate);
            with.sort_unstable();
            self.met.get(&with).map(|met| met.ln_weight - without.ln_weight)
        };
        let one = |(tried, extension): (&(Vec<usize>, usize), &Extension)| {
            let start = extension.as_ref().map(|e| e.1 + self.ln_prior(&[tried.1]));
            (tried.1, start, fitted(tried.1))
        };
        self.extensions.iter().filter(|(tried, _)| tried.0 == key).map(one).collect()
    }

    fn top(&self) -> Option<Met> {
        self.met.values().max_by(|a, b| a.ln_weight.total_cmp(&b.ln_weight)).cloned()
    }

    /// Fits the set of `base` with `candidate`, however improbable.
    pub(crate) fn meet_with(&mut self, base: &Met, candidate: usize) {
        if !base.fitted.hypothesis.holds(candidate)
            && let Some((h, _)) = self.extended(base, candidate)
        {
            self.meet(&h);
        }
    }

    /// The set of `base` without `parts`.
    pub(crate) fn meet_without(&mut self, base: &Met, parts: &[usize]) -> Met {
        let rest = parts.iter().fold(base.fitted.hypothesis.clone(), |h, c| h.without(*c));
        self.meet(&rest)
    }

    /// ln weight of the set with just these parts.
    pub(crate) fn weight_of(&mut self, h: &Hypothesis) -> f64 {
        self.meet(h).ln_weight
    }

    /// All sets fitted, most probable first.
    pub(crate) fn posterior(&self) -> Vec<Met> {
        let mut all: Vec<Met> = self.met.values().cloned().collect();
        all.sort_by(|a, b| b.ln_weight.total_cmp(&a.ln_weight));
        all
    }
}
