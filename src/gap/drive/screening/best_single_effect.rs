//! (ln p(z | e alone) - ln p(z | nothing)) / (ln p(z | best set) - ln p(z | nothing)): share of a gap that one effect
//! explains
//!
//! Where free forms explain a gap in every detail, no effect is needed beside them, and the answer is that the cause is
//! not in the library. The nearest effect is reported all the same.

use crate::effects::drive::Driving;
use crate::gap::drive::ekf::noise::Noise;
use crate::gap::drive::fit::Compared;
use crate::gap::drive::fit::evidence::Problem;
use crate::gap::drive::options::Options;
use crate::gap::drive::preprocess::hypothesis::PreprocessingHypothesis;
use crate::gap::drive::record::Record;
use crate::gap::drive::regressors::candidates::{Candidates, Kind};
use crate::gap::selection::search::Member;
use crate::gap::selection::sets::Part;
use rayon::prelude::*;

/// Most effects that are fitted alone.
const FITTED: usize = 6;

/// The effect that explains most alone.
#[derive(Debug, Clone)]
pub(crate) struct BestSingleEffect {
    /// The effect, with the parameters of its fit alone.
    pub part: Part,
    /// Gain in ln p over no effect, nats.
    pub gain: f64,
}

/// The `most` model changes of `all` that add most in `problem`, each fitted alone from zero.
pub(crate) fn alone(record: &Record, noise: &Noise, all: &Candidates, problem: &Problem, most: usize) -> Vec<Compared> {
    let changes = |m: &Member| matches!(all.kinds[m.0], Kind::Change(_));
    let mut worth: Vec<(Member, f64)> = problem.additions(&[]).into_iter().filter(|(m, _)| changes(m)).collect();
    worth.sort_by(|a, b| b.1.total_cmp(&a.1));
    worth.truncate(most);
    let fit =
        |((group, _), _): (Member, f64)| Compared::narrow(record, noise, all.only(|g| g == group), all.zero(), None);
    // in order: among equals the same one wins on any number of cores
    worth.into_par_iter().map(fit).collect()
}

/// The effect of `effects` that explains most of `record` alone, and ln p of the drive with nothing.
#[must_use]
pub(crate) fn closest(
    record: &Record,
    noise: &Noise,
    effects: &[&'static dyn Driving],
    options: &Options,
) -> Option<(BestSingleEffect, f64)> {
    let every = Candidates::new(record, effects, &options.prior, false, &[]);
    let all = every.only(|g| matches!(every.kinds[g], Kind::Change(_)));
    let zero = all.linearise(record, noise, &all.zero());
    let nothing = zero.ln_evidence(&[]);
    let gain = |c: &Compared| c.problem.ln_evidence(&c.sets[0].fitted) - nothing;
    let fits = alone(record, noise, &all, &zero, FITTED).into_iter().map(|c| (gain(&c), c));
    let (gain, best) = fits.filter(|f| f.0.is_finite()).max_by(|a, b| a.0.total_cmp(&b.0))?;
    let branch = PreprocessingHypothesis::new(record.clone(), *noise, best, Vec::new());
    let part = branch.sets().into_iter().next()?.parts.into_iter().next()?;
    Some((BestSingleEffect { part, gain }, nothing))
}
