//! ln p(z | e alone) - ln p(z | nothing) over ln p(z | best set) - ln p(z | nothing): how much of a gap one effect explains
//!
//! Where free forms explain a gap in every detail, no effect is left anything to explain beside them, and the answer is that
//! the cause is not in the library. Which effect comes nearest is worth knowing all the same.

use super::branch::Branch;
use super::candidates::{Candidates, Kind};
use super::fit::Compared;
use super::judge::Options;
use super::pass::Noise;
use super::record::Record;
use crate::effects::drive::Driving;
use crate::gap::findings::Part;
use rayon::prelude::*;

/// Effects that are fitted alone.
const FITTED: usize = 6;

/// The effect that explains most alone.
#[derive(Debug, Clone)]
pub struct Closest {
    /// The effect, with its parameters alone.
    pub part: Part,
    /// ln p with it alone over ln p with nothing, nats.
    pub gain: f64,
}

/// The effect of `effects` that explains most of `record` alone, and ln p of the drive with nothing.
#[must_use]
pub fn closest(
    record: &Record,
    noise: &Noise,
    effects: &[&'static dyn Driving],
    options: &Options,
) -> Option<(Closest, f64)> {
    let every = Candidates::new(record, effects, &options.prior, false, None);
    let all = every.only(|g| matches!(every.kinds[g], Kind::Change(_)));
    let zero = all.linearise(record, noise, &all.zero());
    let nothing = zero.ln_evidence(&[]);
    let mut worth = zero.additions(&[]);
    worth.sort_by(|a, b| b.1.total_cmp(&a.1));
    worth.truncate(FITTED);
    let fit = |((group, _), _): (super::evidence::Member, f64)| {
        let one = all.only(|g| g == group);
        let settled = Compared::narrow(record, noise, one, all.zero(), None);
        let gain = settled.problem.ln_evidence(&settled.sets[0].members) - nothing;
        (gain, settled)
    };
    let fits: Vec<(f64, Compared)> = worth.into_par_iter().map(fit).collect();
    let (gain, best) = fits.into_iter().filter(|f| f.0.is_finite()).max_by(|a, b| a.0.total_cmp(&b.0))?;
    let branch = Branch::new(record.clone(), *noise, best, None);
    let part = branch.sets().into_iter().next()?.parts.into_iter().next()?;
    Some((Closest { part, gain }, nothing))
}
