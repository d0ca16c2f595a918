//! ln p(z | set) - ln p(z | set without e), all others fitted anew: evidence that is lost without an effect
//!
//! In one linearisation an effect may seem worth much beside others that were fitted together with it. Its worth is
//! what is lost without it once the others have been fitted anew. An effect whose loss is below what its prior asks is
//! not named.

use super::Compared;
use crate::gap::drive::fit::form::form_nats;
use crate::gap::drive::preprocess::hypothesis::PreprocessingHypothesis;
use crate::gap::drive::regressors::candidates::Kind;
use crate::gap::selection::leave_out::LeftOut;
use rayon::prelude::*;

/// Most rounds in which an effect is removed.
const ROUNDS: usize = 3;
/// Most groups outside the set that may replace the removed effect.
const INSTEAD: usize = 8;

/// Loss beyond any single replacement, in nats, from which an effect is missed for certain: the others cannot win it
/// back by settling anew.
const SURE_NATS: f64 = 60.0;

impl PreprocessingHypothesis {
    /// Removes effects that are not missed, and sets `left_out` for those that remain.
    pub(crate) fn leave_out(&mut self) {
        for round in 0..ROUNDS {
            let top = self.compared.top();
            let without: Vec<Option<Compared>>;
            (self.left_out, without) = self.without_each().into_iter().unzip();
            let best = without.into_iter().flatten().max_by(|a, b| a.top().total_cmp(&b.top()));
            let Some(best) = best.filter(|b| b.top() > top && round + 1 < ROUNDS) else { return };
            let all = self.compared.candidates.clone();
            let there = Compared::wide(&self.record, &self.noise, all, best.next().0);
            if there.has_diverged() || there.top() <= top {
                return;
            }
            self.compared = there;
        }
    }

    /// Nats that the best set closes by laws that may bend, without the effect `id`.
    pub(crate) fn bent_nats_beside(&self, id: &str) -> f64 {
        let c = &self.compared;
        let members = &c.sets[0].fitted;
        let bent = |g: usize| matches!(c.candidates.kinds[g], Kind::Change(i) if !c.candidates.changes[i].1.is_rigid());
        let beside = |g: usize| bent(g) && c.candidates.groups[g].id != id;
        let shares = c.problem.shares(members);
        let own = members.iter().zip(&shares).filter(|(m, _)| beside(m.0)).map(|(_, share)| share.max(0.0));
        self.bent_nats + own.sum::<f64>()
    }

    /// Whether a group is a free form of the same equation and quantity as the effect `id`, or its varying coefficient.
    fn holds_law_of(&self, group: usize, id: &str) -> bool {
        let candidates = &self.compared.candidates;
        let known = candidates.changes.iter().map(|c| c.0.about()).find(|about| about.id == id);
        match (candidates.kinds[group], known) {
            (Kind::Varying(i), _) => candidates.changes[i].0.about().id == id,
            (Kind::Free(equation, follows), Some(about)) => {
                equation.channel() == about.channel && about.condition == Some(follows.id())
            }
            _ => false,
        }
    }

    /// The best set without each of its effects, the others fitted anew, with possible replacements; none where the effect
    /// is missed for certain: its evidence is then that beside the others as they were fitted. Errors of the laws of other
    /// effects that may bend explain a part of the evidence, which is taken off.
    fn without_each(&self) -> Vec<(LeftOut, Option<Compared>)> {
        let c = &self.compared;
        let members = &c.sets[0].fitted;
        let tested = |g: usize| matches!(c.candidates.kinds[g], Kind::Change(_) | Kind::Step(..) | Kind::Walk);
        let here = self.ln_likelihood(&self.noise);
        // the loss cannot exceed this, whatever one linearisation promises
        let lost_without = |id: &str| here - self.ln_likelihood_at(&c.candidates.without(id, &c.theta), &self.noise);
        let left_out: Vec<usize> = members.iter().map(|m| m.0).filter(|g| tested(*g)).collect();
        let one = |g: usize| {
            let group = &c.candidates.groups[g];
            let rest: Vec<_> = members.iter().copied().filter(|m| m.0 != g).collect();
            let (own, mut added): (Vec<_>, Vec<_>) =
                c.problem.additions(&rest).into_iter().partition(|(m, _)| c.candidates.groups[m.0].id == group.id);
            // a free form that can hold the effect's law is no replacement
            added.retain(|a| !self.holds_law_of(a.0.0, &group.id));
            added.sort_by(|a, b| b.1.total_cmp(&a.1));
            let gain = own.iter().map(|a| a.1).fold(f64::NEG_INFINITY, f64::max);
            let without = |compared: Option<Compared>| {
                let gain = compared.as_ref().map_or(gain, |less| c.top() - less.top());
                let mut told = LeftOut::new(&group.id, gain, group.ln_prior);
                told.missed_nats -= form_nats(told.missed_nats, self.bent_nats_beside(&group.id));
                (told, compared)
            };
            let sure = gain - added.first().map_or(0.0, |a| a.1.max(0.0)) > SURE_NATS;
            let linear = !matches!(c.candidates.kinds[g], Kind::Change(_));
            if sure && (linear || lost_without(&group.id) > SURE_NATS) {
                return without(None);
            }
            let instead: Vec<usize> = added.iter().take(INSTEAD).map(|a| a.0.0).collect();
            let few = c.candidates.only(|x| rest.iter().any(|m| m.0 == x) || instead.contains(&x));
            let from = few.without(&group.id, &c.theta);
            without(Some(Compared::narrow(&self.record, &self.noise, few, from, None)))
        };
        left_out.into_par_iter().map(one).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::drive::{ids, registry};
    use crate::gap::drive::ekf::noise::Noise;
    use crate::gap::drive::preprocess::clocks::tests::{recorded, robot};
    use crate::gap::drive::record::Record;
    use crate::gap::drive::regressors::candidates::Candidates;
    use crate::gap::drive::regressors::candidates::VARYING;
    use crate::gap::selection::prior::Prior;

    #[test]
    fn a_form_that_holds_a_law_does_not_do_without_it() {
        let record = Record::new(&robot(), &recorded(20.0, 3, None), 0.0).unwrap();
        let noise = Noise::believed(&record, None);
        let all = Candidates::new(&record, registry(), &Prior::of_drives(), true, &[]);
        let compared = Compared::wide(&record, &noise, all.clone(), all.zero());
        let branch = PreprocessingHypothesis::new(record, noise, compared, Vec::new());
        let holds = |form: &str, id: &str| {
            let place = all.groups.iter().position(|g| g.id == form).unwrap();
            branch.holds_law_of(place, id)
        };
        let scale = ids::scale_factor();
        let varying = |id: &str| format!("{VARYING}{id}");
        assert!(holds("free.gyro.yaw_rate", scale) && holds(&varying(scale), scale));
        for other in ["free.gyro.speed", "free.moment.heading", &varying(ids::radius_scale()), scale] {
            assert!(!holds(other, scale), "{other}");
        }
    }

    #[test]
    fn the_form_of_a_law_explains_what_is_small_beside_it_and_nothing_large() {
        // without a bendable law nothing is explained, and never more than there is
        assert_eq!(form_nats(50.0, 0.0), 0.0);
        for nats in [-3.0, 0.0, 1.0, 20.0, 1e4] {
            let form = form_nats(nats, 1e5);
            assert!(form >= 0.0 && form <= nats.max(0.0), "{nats}: {form}");
        }
        // beside 1e5 nats s² = 50 along a direction: of 20 nats hardly any is missed, of 1e4 still a fiftieth
        assert!(20.0 - form_nats(20.0, 1e5) < 3.0);
        let left = 1e4 - form_nats(1e4, 1e5);
        assert!((left - (1e4 / 51.0 + 0.5 * 51_f64.ln())).abs() < 1e-9, "{left}");
    }
}
