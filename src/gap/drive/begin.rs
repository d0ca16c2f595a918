//! θ₀ → θ:   where the comparison of sets begins, and where each is compared
//!
//! Slopes are those of one pass of the filter at one θ. Near it, sets are compared in one step; in a large gap the effects that explain
//! it are looked for at their own coordinates first. How precisely these are known grows with the root of the length of a drive, and what
//! the search takes with the length: the first minutes of a long drive say where to look in all of it.

use super::branch::Branch;
use super::candidates::{Candidates, Kind};
use super::closest::alone;
use super::fit::{Compared, Theta};
use super::judge::LARGE;
use super::pass::{Noise, run};
use super::record::Record;
use rayon::prelude::*;

/// Effects that are fitted alone in a large gap.
pub(super) const ALONE: usize = 4;
/// Rows in which the search begins where there are at least twice as many.
const PIECE: usize = 8000;

/// All sets compared where those of [`thorough`] settle. Of a long drive its beginning is searched, and all of it where what that found
/// leaves a large gap: something that only happens later.
pub(super) fn first(record: &Record, noise: &Noise, all: Candidates, begin: &Theta) -> Compared {
    if record.len() < 2 * PIECE {
        return thorough(record, noise, all, begin);
    }
    let rows = |drive: &Record| (drive.len() * PIECE).div_ceil(record.len());
    let piece = record.by_drive(|_, drive| drive.window(0..rows(drive)));
    let found = thorough(&piece, noise, all.clone(), begin);
    // what a few minutes leave open of the same set, all of them settle
    let members = &found.sets[0].members;
    let own = all.only(|g| members.iter().any(|m| m.0 == g));
    let theta = Compared::narrow(record, noise, own, found.next().0, None).next().0;
    let there = Compared::wide(record, noise, all.clone(), theta);
    let gap = there.top() - there.problem.ln_weight(members);
    if gap < LARGE { there } else { thorough(record, noise, all, begin) }
}

/// All sets compared at `begin`; and where a free form is in the best one, also where the named effects settle without any.
///
/// Free forms are linear in the innovations of one pass. An effect that is strong bends these, and a free form takes what the
/// bend leaves: the effect has to be compared at its own coordinates.
fn thorough(record: &Record, noise: &Noise, all: Candidates, begin: &Theta) -> Compared {
    let compared = Compared::wide(record, noise, all.clone(), begin.clone());
    let gap = compared.gap();
    let only_named = compared.sets[0].members.iter().all(|m| all.groups[m.0].named);
    if only_named && gap < LARGE {
        return compared;
    }
    let mut starts = vec![begin.clone()];
    if gap >= LARGE
        && let Some(theta) = best_alone(record, noise, &compared)
    {
        // where that leaves nothing to any free form, and keeps more than any far step promises, all is said
        let there = Compared::wide(record, noise, all.clone(), theta.clone());
        let only_named = there.sets[0].members.iter().all(|m| all.groups[m.0].named);
        if only_named && there.next().1 && there.top() >= compared.top() {
            return there;
        }
        starts.push(theta);
    }
    // of all times at which the bias may step, the most likely one in each drive will do
    let steps = compared.likely_steps();
    let named = all.only(|g| match all.kinds[g] {
        Kind::Step(..) => steps.contains(&g),
        _ => all.groups[g].named,
    });
    let settled = |from: Theta| Compared::narrow(record, noise, named.clone(), from, None);
    if gap < LARGE {
        let Some(theta) = best_of(starts.into_par_iter().map(settled).collect()).map(|b| b.next().0) else {
            return compared;
        };
        let there = Compared::wide(record, noise, all, theta);
        return if there.top() > compared.top() { there } else { compared };
    }
    // also all of them together: what only looks large because another is missing shrinks, and needs no free form beside it
    let joint = |from: &Theta| Compared::all_in(record, noise, named.clone(), from.clone());
    let (joint, settled): (Vec<Compared>, Vec<Compared>) = rayon::join(
        || starts.par_iter().map(joint).collect(),
        || starts.par_iter().map(|from| settled(from.clone())).collect(),
    );
    let ends = [best_of(joint), best_of(settled)].into_iter().flatten().map(|b| b.next().0);
    let mut there: Vec<Compared> = ends
        .collect::<Vec<_>>()
        .into_par_iter()
        .map(|theta| Compared::wide(record, noise, all.clone(), theta))
        .collect();
    there.push(compared);
    // what far steps promise they need not keep
    let kept = |c: Compared| (Compared::narrow(record, noise, c.plausible(), c.theta.clone(), None).top(), c);
    let kept: Vec<(f64, Compared)> = there.into_par_iter().map(kept).collect();
    let best = kept.into_iter().max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, best)| best);
    best.unwrap_or_else(|| Compared::wide(record, noise, all, begin.clone()))
}

/// The one with the most weight.
fn best_of(all: Vec<Compared>) -> Option<Compared> {
    all.into_iter().max_by(|a, b| a.top().total_cmp(&b.top()))
}

/// Where the effect that explains most alone settles: in a large gap the slopes at zero mislead, and whatever they make of an
/// effect is then explained by others.
fn best_alone(record: &Record, noise: &Noise, compared: &Compared) -> Option<Theta> {
    best_of(alone(record, noise, &compared.candidates, &compared.problem, ALONE)).map(|c| c.next().0)
}

/// Where to begin: at zero, or where a change that bends much explains far more.
pub(super) fn start(record: &Record, noise: &Noise, candidates: &Candidates) -> Theta {
    let zero = candidates.zero();
    let weigh = |theta: &Theta| {
        let models = Branch::models_at(record, candidates, theta);
        run(record, &models, noise, &[], |_| {}).ln_likelihood()
    };
    let mut tried = vec![zero.clone()];
    for (i, (_, change)) in candidates.changes.iter().enumerate() {
        for start in change.starts() {
            let mut theta = zero.clone();
            theta[i][..start.len()].copy_from_slice(&start);
            tried.push(theta);
        }
    }
    let weights: Vec<f64> = tried.par_iter().map(weigh).collect();
    let mut best = (weights[0] + 50.0, zero);
    for (theta, weight) in tried.into_iter().zip(weights).skip(1) {
        if weight > best.0 {
            best = (weight, theta);
        }
    }
    best.1
}
