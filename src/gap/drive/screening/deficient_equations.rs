//! Deficient equations of the nominal model, before any effect is named: the gain of a free correction of each
//! equation.
//!
//! In the manner of Kristensen, Madsen and Jørgensen (Automatica 40, 2004, 225): there a diffusion is added to each
//! equation and the smoothed state is regressed on candidates; here the regression goes straight into the likelihood.
//! The smoothed signal of the equations that gain most, and the diffusion that they need, are in [`crate::gap::drive::screening::model_discrepancy`].

use super::model_discrepancy;
use crate::gap::answer::EquationAnswer;
use crate::gap::drive::ekf::noise::Noise;
use crate::gap::drive::record::Record;
use crate::gap::drive::regressors::basis::Equation;
use crate::gap::drive::regressors::candidates::{Candidates, Kind};
use crate::gap::selection::prior::Prior;
use rayon::prelude::*;

/// Gain below which a correction counts as chance, nats: some fifty forms are tried, each with up to eight functions.
const LEAST_NATS: f64 = 8.0;
/// Most equations that are listed.
const LISTED: usize = 9;
/// Most equations whose correction is estimated as a signal.
const SMOOTHED: usize = 3;

/// Gains of free corrections to each equation of the nominal model, the largest first; for each its best form. With
/// `corrections`, the equations with the largest gains have theirs as a signal.
#[must_use]
pub(crate) fn pinpoint(record: &Record, noise: &Noise, corrections: bool) -> Vec<EquationAnswer> {
    let candidates = Candidates::new(record, &[], &Prior { ln_named: -1e9, ln_free: 0.0 }, true, &[]);
    let problem = candidates.linearise(record, noise, &candidates.zero());
    let mut best: Vec<(Equation, EquationAnswer)> = Vec::new();
    for ((group, _), gain) in problem.additions(&[]) {
        let Kind::Free(equation, follows) = candidates.kinds[group] else { continue };
        let here = EquationAnswer {
            equation: equation.words().into(),
            channel: equation.channel().into(),
            gain_nats: gain,
            follows: follows.condition().into(),
            correction: None,
        };
        match best.iter_mut().find(|b| b.0 == equation) {
            Some((_, b)) if b.gain_nats < gain => *b = here,
            Some(_) => {}
            None => best.push((equation, here)),
        }
    }
    best.retain(|(_, b)| b.gain_nats > LEAST_NATS);
    best.sort_by(|(_, a), (_, b)| b.gain_nats.total_cmp(&a.gain_nats));
    best.truncate(LISTED);
    if corrections {
        let most = best.len().min(SMOOTHED);
        best[..most]
            .par_iter_mut()
            .for_each(|(equation, b)| b.correction = model_discrepancy::of(record, noise, *equation));
    }
    best.into_iter().map(|(_, b)| b).collect()
}
