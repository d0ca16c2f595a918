//! Gain of each member of a set: its share, and the evidence that the set loses without it

use super::sets::Part;

/// Share of each of `members` in the gain of their set, nats: the mean of its gains in ln p when added first and last; zero
/// where one of them is not finite. `score`: ln p, nats, with the members for which the predicate holds.
pub(crate) fn shares<M: Copy + PartialEq>(members: &[M], score: impl Fn(&dyn Fn(M) -> bool) -> f64) -> Vec<f64> {
    let (none, all) = (score(&|_| false), score(&|_| true));
    let share = |m: &M| {
        let is_single = members.len() == 1;
        let first = if is_single { all } else { score(&|k| k == *m) } - none;
        let last = all - if is_single { none } else { score(&|k| k != *m) };
        Some(0.5 * (first + last)).filter(|share| share.is_finite()).unwrap_or(0.0)
    };
    members.iter().map(share).collect()
}

/// A member that was left out of a set, all others fitted anew.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct LeftOut {
    /// Identifier of the member.
    pub id: String,
    /// Evidence that the set loses without it, nats.
    pub missed_nats: f64,
}

impl LeftOut {
    /// `gain`: ln weight of the set over that without the member, nats; `ln_prior`: the member's prior odds therein.
    pub(crate) fn new(id: &str, gain: f64, ln_prior: f64) -> Self {
        Self { id: id.to_owned(), missed_nats: gain - ln_prior }
    }
}

/// Sets [`Part::missed_nats`] of those `parts` that have none, from what was `left_out`; of several with one id the last counts.
pub(crate) fn tell(parts: &mut [Part], left_out: &[LeftOut]) {
    for part in parts.iter_mut().filter(|part| part.missed_nats.is_none()) {
        part.missed_nats = left_out.iter().rfind(|left| left.id == part.id).map(|left| left.missed_nats);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn interchangeable_members_share_what_they_gain_and_what_is_known_stays() {
        // a and b gain the same 6 nats, c another 2; without a number nothing is shared
        let score = |keep: &dyn Fn(char) -> bool| {
            let ab: f64 = if keep('a') || keep('b') { 6.0 } else { 0.0 };
            ab + if keep('c') { 2.0 } else { 0.0 }
        };
        assert_eq!(shares(&['a', 'b', 'c'], score), [3.0, 3.0, 2.0]);
        assert_eq!(shares(&['a'], |keep| if keep('a') { 5.0 } else { 1.0 }), [4.0]);
        assert_eq!(shares(&['a'], |keep| if keep('a') { 5.0 } else { f64::NEG_INFINITY }), [0.0]);
        let known = Part { missed_nats: Some(1.0), ..Part::new("known", true, 0.0) };
        let mut parts = [known, Part::new("left", true, 0.0), Part::new("other", true, 0.0)];
        tell(
            &mut parts,
            &[("known", 9.0), ("left", 7.0), ("left", 8.0)].map(|(id, gain)| LeftOut::new(id, gain, -2.0)),
        );
        assert_eq!(parts.map(|p| p.missed_nats), [Some(1.0), Some(10.0), None]);
    }
}
