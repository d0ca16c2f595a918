//! θ₀ → θ:   start of the comparison of sets, and the points at which sets are compared
//!
//! Derivatives are those of one pass of the filter at one θ. Near it, sets are compared in one step; in a large gap the
//! effects that explain it are first fitted at their own coordinates. Their precision grows with the root of the length
//! of a drive, and the cost of the search with the length: the first minutes of a long drive tell where to search in
//! all of it.

use super::{Compared, Theta};
use crate::gap::drive::ekf::innovations::run;
use crate::gap::drive::ekf::noise::Noise;
use crate::gap::drive::fit::models_at;
use crate::gap::drive::options::{HOPELESS, LARGE};
use crate::gap::drive::record::Record;
use crate::gap::drive::regressors::candidates::{Candidates, Kind};
use crate::gap::drive::screening::best_single_effect::alone;
use rayon::prelude::*;

/// Most effects that are fitted alone in a large gap.
pub(crate) const ALONE: usize = 4;
/// Rows of the beginning of a drive that are searched first, where there are at least twice as many.
const PIECE: usize = 8000;

/// Compares all sets where those of [`thorough`] settle. Of a long drive the beginning is searched first, and all of it
/// where a large gap remains, as from something that only happens later.
pub(crate) fn first(record: &Record, noise: &Noise, all: Candidates, begin: &Theta) -> Compared {
    if record.len() < 2 * PIECE {
        return thorough(record, noise, Compared::wide(record, noise, all, begin.clone()));
    }
    let rows = |drive: &Record| (drive.len() * PIECE).div_ceil(record.len());
    let piece = record.by_drive(|_, drive| drive.window(0..rows(drive)));
    let found = thorough(&piece, noise, Compared::wide(&piece, noise, all.clone(), begin.clone()));
    // the set found in the first minutes is settled on all rows
    let members = &found.sets[0].fitted;
    let own = all.only(|g| members.iter().any(|m| m.0 == g));
    let theta = Compared::narrow(record, noise, own, found.next().0, None).next().0;
    let there = Compared::wide(record, noise, all.clone(), theta);
    let gap = there.top() - there.problem.ln_weight(members);
    if gap < LARGE {
        return there;
    }
    // a set of free forms alone leaves θ where it began
    let compared = if there.theta == *begin { there } else { Compared::wide(record, noise, all, begin.clone()) };
    thorough(record, noise, compared)
}

/// `compared`, all sets at one θ; where the best one holds a free form, also where the named effects settle without any.
///
/// Free forms are linear in the innovations of one pass. A strong effect is not, and a free form takes up the
/// difference: the effect has to be compared at its own coordinates.
fn thorough(record: &Record, noise: &Noise, compared: Compared) -> Compared {
    let (all, begin) = (compared.candidates.clone(), compared.theta.clone());
    let gap = compared.gap();
    if compared.is_named() && gap < LARGE {
        return compared;
    }
    let mut strongest = None;
    if gap >= LARGE
        && let Some(theta) = best_alone(record, noise, &compared)
    {
        // a settled set without free forms, which keeps more weight than any far step promises, is final
        let there = Compared::wide(record, noise, all.clone(), theta);
        if there.is_named() && there.next().1 && there.top() >= compared.top() {
            return there;
        }
        strongest = Some(there);
    }
    // of all times at which the bias may step, the most likely one in each drive suffices
    let steps = compared.likely_steps();
    let named = all.only(|g| match all.kinds[g] {
        Kind::Step(..) => steps.contains(&g),
        _ => all.groups[g].named,
    });
    let settled = |from: &Compared| from.narrowed(record, noise, named.clone());
    if gap < LARGE {
        let there = Compared::wide(record, noise, all, settled(&compared).next().0);
        return if there.top() > compared.top() { there } else { compared };
    }
    // also all of them together: an effect that only looks large because another is missing then shrinks, without a
    // free form
    let starts: Vec<&Compared> = std::iter::once(&compared).chain(&strongest).collect();
    let settled = best_of(starts.par_iter().map(|from| settled(from)).collect());
    let short = settled.as_ref().map_or(f64::MIN, Compared::top) - HOPELESS;
    let joint = best_of(starts.par_iter().map(|from| from.together(record, noise, named.clone(), short)).collect());
    let ends = [joint, settled].into_iter().flatten().map(|b| b.next().0);
    let mut there: Vec<Compared> = ends
        .collect::<Vec<_>>()
        .into_par_iter()
        .map(|theta| Compared::wide(record, noise, all.clone(), theta))
        .collect();
    there.push(compared);
    // far steps need not keep the weight that they promise
    let kept = |c: Compared| (c.narrowed(record, noise, c.plausible()).top(), c);
    let kept: Vec<(f64, Compared)> = there.into_par_iter().map(kept).collect();
    let best = kept.into_iter().max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, best)| best);
    best.unwrap_or_else(|| Compared::wide(record, noise, all, begin))
}

/// The comparison with the largest weight.
fn best_of(all: Vec<Compared>) -> Option<Compared> {
    all.into_iter().max_by(|a, b| a.top().total_cmp(&b.top()))
}

/// θ of the effect that explains most alone: in a large gap the derivatives at zero mislead, and their errors are then
/// explained by other effects.
fn best_alone(record: &Record, noise: &Noise, compared: &Compared) -> Option<Theta> {
    best_of(alone(record, noise, &compared.candidates, &compared.problem, ALONE)).map(|c| c.next().0)
}

/// θ to start from: zero, or where a strongly nonlinear change explains far more.
pub(crate) fn start(record: &Record, noise: &Noise, candidates: &Candidates) -> Theta {
    let zero = candidates.zero();
    let weigh = |theta: &Theta| {
        let models = models_at(record, candidates, theta);
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
