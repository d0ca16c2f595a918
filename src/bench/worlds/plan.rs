//! Which effects the cases of a bench hold.

use super::catalogue;
use super::draw::{chance, index};
use super::drive;
use super::label::Strength;
use crate::config::Kind;
use crate::error::{Error, ErrorKind, Result};
use crate::math::random::Stream;
use serde::{Deserialize, Serialize};

/// Number of cases, and shares of their kinds. The remaining share holds one listed effect.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Mix {
    /// Number of cases.
    pub cases: usize,
    /// Share without any effect.
    pub none: f64,
    /// Share with two listed effects.
    pub pairs: f64,
    /// Share with an effect that is in no list.
    pub unlisted: f64,
    /// Of the cases with one listed effect, the share that holds a little of others too; of pairs and unlisted ones, half
    /// that share.
    pub messy: f64,
    /// Share of the cases that have each of the habits of who records: see `crate::bench::worlds::make_kept`.
    #[serde(default)]
    pub habits: f64,
}

/// Content of one case.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Spec {
    /// Main effects and how strong each is.
    pub effects: Vec<(&'static str, Strength)>,
    /// Whether small amounts of others lie beside them.
    pub messy: bool,
}

/// The cases of `mix` of this `kind`, effects and strengths evenly spread, in an order that `seed` shuffles.
///
/// # Errors
/// [`ErrorKind::Usage`] for shares that are none, or add up to more than 1.
pub(crate) fn plan(mix: &Mix, kind: Kind, seed: u64) -> Result<Vec<Spec>> {
    let shares = [
        ("none", mix.none),
        ("pairs", mix.pairs),
        ("unlisted", mix.unlisted),
        ("messy", mix.messy),
        ("habits", mix.habits),
    ];
    for (name, share) in shares {
        if !(0.0..=1.0).contains(&share) {
            return Err(Error::new(ErrorKind::Usage, "bench", format!("{share} is not a share"))
                .at(name)
                .hint("give a number from 0 to 1"));
        }
    }
    let together = mix.none + mix.pairs + mix.unlisted;
    if together > 1.0 + 1e-9 {
        return Err(Error::new(ErrorKind::Usage, "bench", format!("the shares add up to {together}"))
            .at("none, pairs, unlisted")
            .hint("let them add up to 1 at most; the rest holds one listed effect"));
    }
    let (listed, unlisted_ids, strengths): (&[_], &[_], &[_]) = match kind {
        Kind::Stationary => (&catalogue::LISTED, &catalogue::UNLISTED, &ALL_STRENGTHS),
        Kind::Driving => (&drive::LISTED, &drive::UNLISTED, &DRIVING_STRENGTHS),
    };
    let s = &mut Stream::new(seed, PLAN);
    let count = |share: f64| (share * mix.cases as f64).round() as usize;
    let none = count(mix.none).min(mix.cases);
    let pairs = count(mix.pairs).min(mix.cases - none);
    let unlisted = count(mix.unlisted).min(mix.cases - none - pairs);
    let single = mix.cases - none - pairs - unlisted;

    let mut out = vec![Spec { effects: Vec::new(), messy: false }; none];
    out.extend(evenly(listed, strengths, single, mix.messy, s));
    out.extend(evenly(unlisted_ids, &CLEAR, unlisted, 0.5 * mix.messy, s));
    out.extend(evenly(listed, &CLEAR, pairs, 0.5 * mix.messy, s).into_iter().map(|mut spec| {
        let other = loop {
            let id = listed[index(s, listed.len())];
            if spec.effects.iter().all(|(there, _)| *there != id) {
                break id;
            }
        };
        spec.effects.push((other, CLEAR[index(s, 2)]));
        spec
    }));
    s.shuffle(&mut out);
    Ok(out)
}

const PLAN: u64 = 1;
const ALL_STRENGTHS: [Strength; 3] = [Strength::Weak, Strength::Medium, Strength::Strong];
/// Effects of drives are strong more often than not.
const DRIVING_STRENGTHS: [Strength; 4] = [Strength::Weak, Strength::Medium, Strength::Strong, Strength::Strong];
const CLEAR: [Strength; 2] = [Strength::Medium, Strength::Strong];

/// `count` cases over all of `ids` and `strengths`: no combination comes twice before each came once.
fn evenly(ids: &[&'static str], strengths: &[Strength], count: usize, messy: f64, s: &mut Stream) -> Vec<Spec> {
    let mut out = Vec::with_capacity(count);
    // every effect once before any comes again, its strengths in an order of its own
    let mut turns: Vec<Vec<Strength>> = Vec::new();
    let mut round = 0;
    while out.len() < count {
        if round % strengths.len() == 0 {
            turns = ids
                .iter()
                .map(|_| {
                    let mut turn = strengths.to_vec();
                    s.shuffle(&mut turn);
                    turn
                })
                .collect();
        }
        let mut order: Vec<usize> = (0..ids.len()).collect();
        s.shuffle(&mut order);
        for i in order.into_iter().take(count - out.len()) {
            let strength = turns[i][round % strengths.len()];
            out.push(Spec { effects: vec![(ids[i], strength)], messy: chance(s, messy) });
        }
        round += 1;
    }
    out
}
