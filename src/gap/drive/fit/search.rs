//! Search for the sets worth comparing: greedy growth, exchange, and all sets one step from the best.

use super::evidence::{Member, Problem, Weighed};
use std::collections::BTreeMap;

/// Most members of a set.
const LARGEST: usize = 12;
/// Rounds of growth and exchange.
const ROUNDS: usize = 3;
/// Most exchanges in a round.
const EXCHANGES: usize = 6;
/// Most effects that are tried as a partial replacement of a free form.
const PARTED: usize = 3;
/// Distance from the best set up to which sets are compared, nats of ln weight.
const DEPTH: f64 = 14.0;
/// Most sets whose neighbours are compared.
const CENTRES: usize = 3;

/// The best set alone: by growth and exchange, without its neighbours.
#[must_use]
pub(crate) fn best(problem: &Problem) -> Weighed {
    let mut met = Met { problem, weights: BTreeMap::new() };
    met.weigh(&[]);
    let grown = grow(&mut met, Vec::new());
    exchange(&mut met, grown);
    met.sorted().swap_remove(0)
}

/// All sets that were compared, the most probable first.
#[must_use]
pub(crate) fn search(problem: &Problem) -> Vec<Weighed> {
    let mut met = Met { problem, weights: BTreeMap::new() };
    met.weigh(&[]);
    let mut best: Vec<Member> = Vec::new();
    for _ in 0..ROUNDS {
        let before = best.clone();
        best = grow(&mut met, best);
        best = exchange(&mut met, best);
        if best == before {
            break;
        }
    }
    // all sets one step from the best ones
    let mut looked = Vec::new();
    for _ in 0..CENTRES {
        let Some(centre) = met.sorted().into_iter().find(|w| !looked.contains(&w.members)) else { break };
        if centre.ln_weight < met.top() - DEPTH {
            break;
        }
        looked.push(centre.members.clone());
        beside(&mut met, &centre.members);
    }
    let top = met.top();
    let mut all = met.sorted();
    all.retain(|w| w.ln_weight > top - DEPTH || w.members.is_empty());
    all
}

struct Met<'a> {
    problem: &'a Problem,
    weights: BTreeMap<Vec<Member>, f64>,
}

impl Met<'_> {
    fn weigh(&mut self, members: &[Member]) -> f64 {
        if let Some(w) = self.weights.get(members) {
            return *w;
        }
        let w = self.problem.ln_weight(members);
        self.weights.insert(members.to_vec(), w);
        w
    }

    fn top(&self) -> f64 {
        self.weights.values().copied().fold(f64::NEG_INFINITY, f64::max)
    }

    /// Most probable first; of sets that differ in their scales alone, only the best.
    fn sorted(&self) -> Vec<Weighed> {
        let mut all: Vec<Weighed> =
            self.weights.iter().map(|(m, w)| Weighed { members: m.clone(), ln_weight: *w }).collect();
        all.sort_by(|a, b| b.ln_weight.total_cmp(&a.ln_weight));
        let mut seen = std::collections::BTreeSet::new();
        all.retain(|w| seen.insert(w.members.iter().map(|m| m.0).collect::<Vec<_>>()));
        all
    }
}

fn with(members: &[Member], new: Member) -> Vec<Member> {
    let mut out = members.to_vec();
    out.push(new);
    out.sort_unstable();
    out
}

fn without(members: &[Member], i: usize) -> Vec<Member> {
    let mut out = members.to_vec();
    out.remove(i);
    out
}

fn grow(met: &mut Met, mut set: Vec<Member>) -> Vec<Member> {
    while set.len() < LARGEST {
        let here = met.weigh(&set);
        let additions = met.problem.additions(&set);
        let Some(best) = additions.into_iter().max_by(|a, b| a.1.total_cmp(&b.1)) else { break };
        if best.1 <= 0.0 {
            break;
        }
        let next = with(&set, best.0);
        if met.weigh(&next) <= here - 3.0 {
            break;
        }
        set = next;
    }
    set
}

/// Removes members that are not worth their prior, and replaces a member by one that explains more in its place.
fn exchange(met: &mut Met, mut set: Vec<Member>) -> Vec<Member> {
    for _ in 0..EXCHANGES {
        let here = met.weigh(&set);
        let mut best = (here + 1e-6, None);
        for i in 0..set.len() {
            let rest = without(&set, i);
            let w = met.weigh(&rest);
            if w > best.0 {
                best = (w, Some(rest.clone()));
            }
            let additions = met.problem.additions(&rest);
            let mut tried = parted(met.problem, &rest, set[i], &additions);
            let most = additions.into_iter().max_by(|a, b| a.1.total_cmp(&b.1));
            tried.extend(most.map(|(new, _)| with(&rest, new)));
            for next in tried {
                let w = met.weigh(&next);
                if w > best.0 {
                    best = (w, Some(next));
                }
            }
        }
        match best.1 {
            Some(next) => set = next,
            None => return set,
        }
    }
    set
}

/// Sets in which an effect replaces a free form in part: the form holds the remainder, with a prior on that scale.
/// Beside the form at its first scale, which can represent any law, an effect gains nothing; with the smaller scale the
/// set is far cheaper where the effect's law is nearly right.
fn parted(problem: &Problem, rest: &[Member], form: Member, additions: &[(Member, f64)]) -> Vec<Vec<Member>> {
    if problem.is_named(form.0) {
        return Vec::new();
    }
    let mut named: Vec<&(Member, f64)> = additions.iter().filter(|a| problem.is_named(a.0.0)).collect();
    named.sort_by(|a, b| b.1.total_cmp(&a.1));
    named.truncate(PARTED);
    let of = |(effect, _): &(Member, f64)| {
        let beside = with(rest, *effect);
        let left = problem.additions(&beside).into_iter().find(|a| a.0.0 == form.0)?;
        Some(with(&beside, left.0))
    };
    named.into_iter().filter_map(of).collect()
}

fn beside(met: &mut Met, set: &[Member]) {
    let here = met.weigh(set);
    let floor = met.top() - DEPTH;
    for (new, gain) in met.problem.additions(set) {
        if here + gain > floor {
            met.weigh(&with(set, new));
        }
    }
    for i in 0..set.len() {
        let rest = without(set, i);
        let w = met.weigh(&rest);
        for (new, gain) in met.problem.additions(&rest) {
            if w + gain > floor {
                met.weigh(&with(&rest, new));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gap::drive::fit::evidence::{Group, Rank};
    use faer::Mat;

    const STD_NODES: [f64; 5] = [3.0, 10.0, 30.0, 100.0, 300.0];

    fn group(id: &str, named: bool, columns: Vec<usize>, nodes: Vec<Vec<f64>>) -> Group {
        let id = id.to_owned();
        let rank = if named { Rank::Law } else { Rank::Form };
        Group { id, drive: 0, named, columns, nodes, ln_prior: -4.0, rank, positive: 0, varies: None }
    }

    /// Readings of an effect (column 0, whitened size `effect`) and of functions that its law lacks (columns 1 to 4,
    /// size
    /// `left` each), and a free form of five functions, one of which is the effect's own.
    fn bent(effect: f64, left: f64) -> Problem {
        // orthonormal columns: 0 the law, 1 to 4 the others, 5 the law once more as a function of the form
        let same = |i: usize| if i == 5 { 0 } else { i };
        let truth = |i: usize| if same(i) == 0 { effect } else { left };
        let null = effect * effect + 4.0 * left * left + 1e3;
        let gram = Mat::from_fn(7, 7, |i, j| match (i, j) {
            (6, 6) => null,
            (6, k) | (k, 6) => truth(k),
            (i, j) => f64::from(u8::from(same(i) == same(j))),
        });
        let form: Vec<Vec<f64>> = STD_NODES.iter().map(|s| vec![*s; 5]).collect();
        let law: Vec<Vec<f64>> = STD_NODES.iter().map(|s| vec![*s]).collect();
        let groups = vec![group("law", true, vec![0], law), group("free.form", false, vec![5, 1, 2, 3, 4], form)];
        Problem::new(&gram, 0.0, &[0.0; 6], groups, Vec::new())
    }

    #[test]
    fn an_effect_that_is_nearly_right_is_found_beside_a_form_that_holds_it() {
        let problem = bent(700.0, 9.0);
        let best = best(&problem);
        assert_eq!(best.members.iter().map(|m| m.0).collect::<Vec<_>>(), [0, 1], "{best:?}");
        // on the scale of the remainder, and not of the effect
        assert!(STD_NODES[best.members[1].1] < 31.0, "{best:?}");
        // growth alone chooses the form, beside which the effect is worth nothing
        let form = problem.additions(&[]).into_iter().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap().0;
        assert_eq!(form.0, 1);
        let effect = problem.additions(&[form]).into_iter().find(|a| a.0.0 == 0).unwrap();
        assert!(effect.1 < 0.0, "{effect:?}");
    }

    #[test]
    fn what_no_law_says_stays_with_the_form() {
        let best = best(&bent(90.0, 120.0));
        assert_eq!(best.members.iter().map(|m| m.0).collect::<Vec<_>>(), [1], "{best:?}");
    }
}
