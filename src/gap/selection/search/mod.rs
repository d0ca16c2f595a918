//! Search for the sets of candidates that explain a recording, over any likelihood of sets
//!
//! Sets grow by one candidate at a time, each member is exchanged against every other candidate, and the neighbours of
//! the best sets are fitted. Every set that was fitted keeps its weight and takes part in the posterior probabilities.

use std::collections::{BTreeMap, BTreeSet};

/// Index of a candidate, and that of its prior's scale: zero where its likelihood has no grid of scales.
pub(crate) type Member = (usize, usize);

/// A set at the parameters where a candidate was added to it, and the gain in ln weight there, nats; none where the
/// candidate cannot be added.
pub(crate) type Extension<S> = Option<(S, f64)>;

/// A set that was fitted.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Weighed<F> {
    /// At its best parameters.
    pub fitted: F,
    /// ln evidence + ln prior.
    pub ln_weight: f64,
}

/// Likelihood of a recording under sets of candidates, which are numbered from zero: all that the search needs to know.
pub(crate) trait SetLikelihood: Sync {
    /// A set at parameters where its fit may begin; the default is the empty one.
    type Set: Clone + Default + Send + Sync;
    /// The same at its best parameters.
    type Fitted: Clone + Send + Sync;

    /// Number of candidates.
    fn candidates(&self) -> usize;

    /// Whether a candidate is an effect of the library, else a free form.
    fn is_named(&self, candidate: usize) -> bool;

    /// The set that was fitted.
    fn set(fitted: &Self::Fitted) -> &Self::Set;

    /// Members of a set, each candidate once.
    fn members(set: &Self::Set) -> Vec<Member>;

    /// The set without a candidate, everything else at the same parameters.
    fn without(set: &Self::Set, candidate: usize) -> Self::Set;

    /// The set at its best parameters.
    fn fit(&self, start: &Self::Set) -> Weighed<Self::Fitted>;

    /// Each set at its best parameters; side by side where a fit takes long.
    fn fit_all(&self, starts: &[&Self::Set]) -> Vec<Weighed<Self::Fitted>> {
        starts.iter().map(|start| self.fit(start)).collect()
    }

    /// `base` extended by each of `candidates`, none of which it holds; gains with the prior odds of the candidate.
    fn extensions(&self, base: &Self::Fitted, candidates: &[usize]) -> Vec<Extension<Self::Set>>;

    /// Further sets that are fitted in the place of `base` with the candidate `out`. `extensions`: those of `base`, by
    /// candidate.
    fn in_part(
        &self,
        _base: &Self::Fitted,
        _out: usize,
        _extensions: &[(usize, Extension<Self::Set>)],
    ) -> Vec<Self::Set> {
        Vec::new()
    }

    /// Pairs of candidates that are worth little alone; the first of each is added first.
    fn pairs(&self) -> Vec<[usize; 2]> {
        Vec::new()
    }
}

/// How far a search goes. A fit may cost a second or some microseconds, and the gain of an extension may be exact or that
/// of a start: what is worth a fit differs between likelihoods.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Policy {
    /// Most members of a set.
    pub largest: usize,
    /// Most free forms in a set that grows.
    pub most_free: usize,
    /// Most extensions of one set that are fitted.
    pub fitted: usize,
    /// Gain above which an extension is fitted where a set grows, nats.
    pub least_gain: f64,
    /// ln weight that growth may lose in one step, nats.
    pub loss: f64,
    /// Whether growth drops members that are superfluous, begins again from effects alone and from pairs where a free form
    /// was chosen, and goes on from exchanged sets near the best. Otherwise exchange alone does that.
    pub regrows: bool,
    /// Whether a candidate is tried in its own place, at another scale of its prior.
    pub rescales: bool,
    /// Rounds of growth and exchange.
    pub rounds: usize,
    /// Most exchanges in a round.
    pub exchanges: usize,
    /// Gain of an exchange that ends them, nats.
    pub settled: f64,
    /// An exchange is fitted where it promises a set that is at most so much less probable than the best, nats.
    pub reach: f64,
    /// Sets this much less probable than the best are not pursued, nats.
    pub window: f64,
    /// Most sets whose neighbours are fitted: all sets one addition, removal or exchange away.
    pub centres: usize,
}

/// Candidates that gain so many nats less than the best one where they start are not fitted where a set grows.
pub(crate) const SCREENED: f64 = 6.0;

/// A set in a search over the likelihood `L`.
type Met<L> = Weighed<<L as SetLikelihood>::Fitted>;

/// The search over sets.
pub(crate) struct Search<'a, L: SetLikelihood> {
    likelihood: &'a L,
    policy: Policy,
    met: BTreeMap<Vec<Member>, Met<L>>,
    /// Extensions of sets by each candidate, as far as computed.
    extensions: BTreeMap<Vec<Member>, BTreeMap<usize, Extension<L::Set>>>,
}

/// A candidate that was tried beside a set.
pub(crate) struct Addition {
    /// Its number.
    pub candidate: usize,
    /// Gain in ln weight where it started, nats; none where it cannot be there.
    pub start: Option<f64>,
    /// That of its fit, nats; none where it was not fitted.
    pub fitted: Option<f64>,
}

/// Members, ascending: the same for a set whatever the order in which it grew.
fn key<L: SetLikelihood>(set: &L::Set) -> Vec<Member> {
    let mut members = L::members(set);
    members.sort_unstable();
    members
}

/// Key of a fitted set.
fn key_of<L: SetLikelihood>(met: &Met<L>) -> Vec<Member> {
    key::<L>(L::set(&met.fitted))
}

/// Candidates of a fitted set.
fn inside<L: SetLikelihood>(met: &Met<L>) -> Vec<usize> {
    L::members(L::set(&met.fitted)).into_iter().map(|m| m.0).collect()
}

impl<'a, L: SetLikelihood> Search<'a, L> {
    /// A search without any fitted set.
    pub(crate) fn new(likelihood: &'a L, policy: Policy) -> Self {
        Self { likelihood, policy, met: BTreeMap::new(), extensions: BTreeMap::new() }
    }

    /// Fits a set once.
    pub(crate) fn meet(&mut self, set: &L::Set) -> Met<L> {
        self.met.entry(key::<L>(set)).or_insert_with(|| self.likelihood.fit(set)).clone()
    }

    /// Fits each set once.
    fn meet_all(&mut self, sets: &[L::Set]) -> Vec<Met<L>> {
        // of two starts of one set the first counts
        let mut keys = BTreeSet::new();
        let is_new = |set: &&L::Set| !self.met.contains_key(&key::<L>(set)) && keys.insert(key::<L>(set));
        let new: Vec<&L::Set> = sets.iter().filter(is_new).collect();
        let fitted = self.likelihood.fit_all(&new);
        self.met.extend(new.into_iter().map(key::<L>).zip(fitted));
        sets.iter().map(|set| self.meet(set)).collect()
    }

    /// `base` extended by each of `among` that it does not hold.
    fn extended(&mut self, base: &Met<L>, among: impl IntoIterator<Item = usize>) -> Vec<(usize, Extension<L::Set>)> {
        let held = inside::<L>(base);
        let among: Vec<usize> = among.into_iter().filter(|c| !held.contains(c)).collect();
        let known = self.extensions.entry(key_of::<L>(base)).or_default();
        let new: Vec<usize> = among.iter().copied().filter(|c| !known.contains_key(c)).collect();
        let made = self.likelihood.extensions(&base.fitted, &new);
        known.extend(new.into_iter().zip(made));
        among.into_iter().map(|c| (c, known.get(&c).cloned().flatten())).collect()
    }

    /// Extensions that gain more than `least` nats, the best first, as many as are fitted.
    fn screened(&self, extended: Vec<(usize, Extension<L::Set>)>, least: f64) -> Vec<(L::Set, f64)> {
        let mut screened: Vec<_> = extended.into_iter().filter_map(|e| e.1).filter(|e| e.1 > least).collect();
        screened.sort_by(|a, b| b.1.total_cmp(&a.1));
        screened.truncate(self.policy.fitted);
        screened
    }

    /// The best extension of `base` by one candidate of `among`.
    fn grown(&mut self, base: &Met<L>, among: &[usize]) -> Option<Met<L>> {
        let named = |c: &usize| self.likelihood.is_named(*c);
        let full = inside::<L>(base).iter().filter(|c| !named(c)).count() >= self.policy.most_free;
        let among: Vec<usize> = among.iter().copied().filter(|c| !full || named(c)).collect();
        let extended = self.extended(base, among);
        let screened = self.screened(extended, self.policy.least_gain);
        let top = screened.first()?.1;
        let near = screened.into_iter().filter(|e| e.1 > top - SCREENED);
        let sets: Vec<L::Set> = near.map(|e| e.0).collect();
        self.meet_all(&sets).into_iter().max_by(|a, b| a.ln_weight.total_cmp(&b.ln_weight))
    }

    /// Drops members, down to `fewest`, while that makes the set more probable.
    fn pruned(&mut self, mut best: Met<L>, fewest: usize) -> Met<L> {
        loop {
            let members = inside::<L>(&best);
            if members.len() <= fewest {
                return best;
            }
            let mut without = members.into_iter().map(|c| self.meet_without(&best, &[c]));
            let Some(better) = without.find(|met| met.ln_weight > best.ln_weight) else { return best };
            best = better;
        }
    }

    /// The set of `start` without the members that make it less probable.
    pub(crate) fn settled(&mut self, start: &L::Set) -> Met<L> {
        let met = self.meet(start);
        self.pruned(met, 0)
    }

    fn climb(&mut self, mut best: Met<L>, among: &[usize]) -> Met<L> {
        while inside::<L>(&best).len() < self.policy.largest {
            match self.grown(&best, among) {
                Some(next) if next.ln_weight > best.ln_weight - self.policy.loss => {
                    best = if self.policy.regrows { self.pruned(next, 1) } else { next };
                }
                _ => break,
            }
        }
        best
    }

    /// The best of `grown`, if it holds a free form, and of what grows from effects alone and from pairs.
    fn regrown(&mut self, grown: Met<L>, all: &[usize]) -> Met<L> {
        if inside::<L>(&grown).into_iter().all(|c| self.likelihood.is_named(c)) {
            return grown;
        }
        let nothing = self.meet(&L::Set::default());
        // a free form may stand where two effects together do, of which neither is close alone
        let named: Vec<usize> = all.iter().copied().filter(|c| self.likelihood.is_named(*c)).collect();
        let by_name = self.climb(nothing.clone(), &named);
        let likelihood = self.likelihood;
        let both = |[first, second]: [usize; 2]| {
            let first = self.with(&nothing, first)?;
            self.with(&first, second)
        };
        let pairs: Vec<Met<L>> = likelihood.pairs().into_iter().filter_map(both).collect();
        let from_pairs = pairs.into_iter().map(|pair| self.climb(pair, all));
        std::iter::once(by_name).chain(from_pairs).fold(grown, better)
    }

    /// The best set of those with one member of `best` removed, or exchanged against others, and of what grows from them.
    fn exchanged(&mut self, best: &Met<L>, all: &[usize]) -> Met<L> {
        let mut found = best.clone();
        for out in inside::<L>(best) {
            let base = self.meet_without(best, &[out]);
            let rescales = self.policy.rescales;
            let others = all.iter().copied().filter(|c| rescales || *c != out);
            let extended = self.extended(&base, others);
            let mut sets = self.likelihood.in_part(&base.fitted, out, &extended);
            let least = best.ln_weight - self.policy.reach - base.ln_weight;
            sets.extend(self.screened(extended, least).into_iter().map(|e| e.0));
            found = better(found, base);
            for met in self.meet_all(&sets) {
                // the remainder of this member may need another one
                let grows = self.policy.regrows && met.ln_weight > best.ln_weight - self.policy.window;
                found = better(found, if grows { self.climb(met, all) } else { met });
            }
        }
        found
    }

    /// Fits all sets one addition, removal or exchange away from the best ones.
    fn meet_neighbours(&mut self, all: &[usize]) {
        let mut looked = BTreeSet::new();
        for _ in 0..self.policy.centres {
            let Some(centre) = self.ranked().into_iter().find(|met| !looked.contains(&key_of::<L>(met))).cloned()
            else {
                break;
            };
            let floor = self.top() - self.policy.window;
            if centre.ln_weight < floor {
                break;
            }
            looked.insert(key_of::<L>(&centre));
            let without: Vec<Met<L>> = inside::<L>(&centre).iter().map(|c| self.meet_without(&centre, &[*c])).collect();
            for base in std::iter::once(centre).chain(without) {
                let near = |e: (usize, Extension<L::Set>)| e.1.filter(|e| base.ln_weight + e.1 > floor).map(|e| e.0);
                let sets: Vec<L::Set> =
                    self.extended(&base, all.iter().copied()).into_iter().filter_map(near).collect();
                self.meet_all(&sets);
            }
        }
    }

    /// Searches, and returns the best set; every set that was fitted is in [`Search::posterior`] afterwards.
    pub(crate) fn run(&mut self) -> Met<L> {
        let all: Vec<usize> = (0..self.likelihood.candidates()).collect();
        let mut best = self.meet(&L::Set::default());
        for _ in 0..self.policy.rounds {
            let before = key_of::<L>(&best);
            best = self.climb(best, &all);
            if self.policy.regrows {
                best = self.regrown(best, &all);
            }
            for _ in 0..self.policy.exchanges {
                let next = self.exchanged(&best, &all);
                let is_settled = next.ln_weight <= best.ln_weight + self.policy.settled;
                best = next;
                if is_settled {
                    break;
                }
            }
            if key_of::<L>(&best) == before {
                break;
            }
        }
        self.meet_neighbours(&all);
        self.ranked().swap_remove(0).clone()
    }

    /// ln weight of the best set.
    fn top(&self) -> f64 {
        self.met.values().map(|met| met.ln_weight).fold(f64::NEG_INFINITY, f64::max)
    }

    /// All sets fitted, the most probable first; of those that differ in their scales alone, only the best.
    pub(crate) fn posterior(&self) -> Vec<Met<L>> {
        self.ranked().into_iter().cloned().collect()
    }

    /// [`Self::posterior`], where it lies.
    fn ranked(&self) -> Vec<&Met<L>> {
        let mut all: Vec<(&Vec<Member>, &Met<L>)> = self.met.iter().collect();
        all.sort_by(|a, b| b.1.ln_weight.total_cmp(&a.1.ln_weight));
        let mut seen = BTreeSet::new();
        all.retain(|(key, _)| seen.insert(key.iter().map(|m| m.0).collect::<Vec<_>>()));
        all.into_iter().map(|(_, met)| met).collect()
    }

    /// Each candidate that was tried beside the set `base`.
    pub(crate) fn additions(&self, base: &L::Set) -> Vec<Addition> {
        let key = key::<L>(base);
        let (Some(without), Some(tried)) = (self.met.get(&key), self.extensions.get(&key)) else { return Vec::new() };
        let fitted = |candidate: usize| {
            let mut with: Vec<usize> = key.iter().map(|m| m.0).chain([candidate]).collect();
            with.sort_unstable();
            let same = |(key, _): &(&Vec<Member>, &Met<L>)| key.iter().map(|m| m.0).eq(with.iter().copied());
            self.met.iter().find(same).map(|(_, met)| met.ln_weight - without.ln_weight)
        };
        let one = |(candidate, extension): (&usize, &Extension<L::Set>)| Addition {
            candidate: *candidate,
            start: extension.as_ref().map(|e| e.1),
            fitted: fitted(*candidate),
        };
        tried.iter().map(one).collect()
    }

    /// Fits the set of `base` with `candidate`, however improbable; none where it cannot be added.
    pub(crate) fn with(&mut self, base: &Met<L>, candidate: usize) -> Option<Met<L>> {
        let (set, _) = self.extended(base, [candidate]).pop()?.1?;
        Some(self.meet(&set))
    }

    /// The set of `base` without `candidates`.
    pub(crate) fn meet_without(&mut self, base: &Met<L>, candidates: &[usize]) -> Met<L> {
        let rest = candidates.iter().fold(L::set(&base.fitted).clone(), |set, c| L::without(&set, *c));
        self.meet(&rest)
    }
}

/// The more probable of two sets; of equals the first.
fn better<F>(best: Weighed<F>, other: Weighed<F>) -> Weighed<F> {
    if other.ln_weight > best.ln_weight { other } else { best }
}

#[cfg(test)]
mod tests;
