//! One linearisation of a drive as the search over sets sees it: members are groups of columns with a scale of their prior

use super::evidence::Problem;
use crate::gap::selection::search::{Extension, Member, Policy, Search, SetLikelihood, Weighed};

/// Most effects that are tried as a partial replacement of a free form.
const PARTED: usize = 3;

/// A fit is exact and cheap, so is the gain of an extension: one is followed, exchange mends, and all neighbours of the best
/// sets are compared.
pub(crate) const POLICY: Policy = Policy {
    largest: 12,
    most_free: usize::MAX,
    fitted: 1,
    least_gain: 0.0,
    loss: 3.0,
    regrows: false,
    rescales: true,
    rounds: 3,
    exchanges: 6,
    settled: 1e-6,
    reach: f64::INFINITY,
    window: 14.0,
    centres: 3,
};

/// A set with its weight: ln evidence + ln prior.
pub(crate) type WeighedMembers = Weighed<Vec<Member>>;

/// The best set alone: by one round of growth and exchange, without its neighbours.
#[must_use]
pub(crate) fn best(problem: &Problem) -> WeighedMembers {
    Search::new(problem, Policy { rounds: 1, centres: 0, ..POLICY }).run()
}

/// All sets that were compared, the most probable first.
#[must_use]
pub(crate) fn search(problem: &Problem) -> Vec<WeighedMembers> {
    let mut search = Search::new(problem, POLICY);
    let top = search.run().ln_weight;
    let mut all = search.posterior();
    all.retain(|w| w.ln_weight > top - POLICY.window || w.fitted.is_empty());
    all
}

fn with(members: &[Member], new: Member) -> Vec<Member> {
    let mut out = members.to_vec();
    out.push(new);
    out.sort_unstable();
    out
}

impl SetLikelihood for Problem {
    /// Members, ascending.
    type Set = Vec<Member>;
    type Fitted = Vec<Member>;

    fn candidates(&self) -> usize {
        self.groups().len()
    }

    fn is_named(&self, candidate: usize) -> bool {
        self.groups()[candidate].named
    }

    fn set(fitted: &Vec<Member>) -> &Vec<Member> {
        fitted
    }

    fn members(set: &Vec<Member>) -> Vec<Member> {
        set.clone()
    }

    fn without(set: &Vec<Member>, candidate: usize) -> Vec<Member> {
        set.iter().copied().filter(|m| m.0 != candidate).collect()
    }

    fn fit(&self, start: &Vec<Member>) -> WeighedMembers {
        Weighed { fitted: start.clone(), ln_weight: self.ln_weight(start) }
    }

    fn extensions(&self, base: &Vec<Member>, candidates: &[usize]) -> Vec<Extension<Vec<Member>>> {
        if candidates.is_empty() {
            return Vec::new();
        }
        let all = self.additions(base);
        let one = |candidate: &usize| {
            let (member, gain) = all.iter().find(|a| a.0.0 == *candidate)?;
            Some((with(base, *member), *gain))
        };
        candidates.iter().map(one).collect()
    }

    /// Sets in which an effect replaces a free form in part: the form holds the remainder, with a prior on that scale.
    /// Beside the form at its first scale, which can represent any law, an effect gains nothing; with the smaller scale the
    /// set is far cheaper where the effect's law is nearly right.
    fn in_part(&self, _: &Vec<Member>, out: usize, extensions: &[(usize, Extension<Vec<Member>>)]) -> Vec<Vec<Member>> {
        if self.is_named(out) {
            return Vec::new();
        }
        let named = extensions.iter().filter(|e| self.is_named(e.0));
        let mut effects: Vec<&(Vec<Member>, f64)> = named.filter_map(|e| e.1.as_ref()).collect();
        effects.sort_by(|a, b| b.1.total_cmp(&a.1));
        effects.truncate(PARTED);
        let beside = |(effect, _): &(Vec<Member>, f64)| Some(self.extensions(effect, &[out]).pop()??.0);
        effects.into_iter().filter_map(beside).collect()
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
        assert_eq!(best.fitted.iter().map(|m| m.0).collect::<Vec<_>>(), [0, 1], "{best:?}");
        // on the scale of the remainder, and not of the effect
        assert!(STD_NODES[best.fitted[1].1] < 31.0, "{best:?}");
        // growth alone chooses the form, beside which the effect is worth nothing
        let form = problem.additions(&[]).into_iter().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap().0;
        assert_eq!(form.0, 1);
        let effect = problem.additions(&[form]).into_iter().find(|a| a.0.0 == 0).unwrap();
        assert!(effect.1 < 0.0, "{effect:?}");
    }

    #[test]
    fn what_no_law_says_stays_with_the_form() {
        let best = best(&bent(90.0, 120.0));
        assert_eq!(best.fitted.iter().map(|m| m.0).collect::<Vec<_>>(), [1], "{best:?}");
    }
}
