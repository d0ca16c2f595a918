//! The likelihood of a recording at rest as the search over sets sees it: candidates are added at a good start

use super::evidence::{Fitted, Likelihood};
use super::hypothesis::{Hypothesis, Kind};
use super::lines::Lines;
use crate::gap::selection::prior::Prior;
use crate::gap::selection::search::{Extension, Member, Policy, SetLikelihood, Weighed};
use rayon::prelude::*;
use std::sync::OnceLock;

/// Candidates that gain less than this where they start are not fitted, nats.
pub(crate) const LEAST_SCREENED: f64 = -4.0;
/// Least number of cycles in the recording of anything periodic.
const CYCLES: f64 = 3.0;
/// The same of a tone: what swings fewer times in a recording is a slow change, not a vibration.
const TONE_CYCLES: f64 = 10.0;
/// Gain of a periodic signal below which it is not added, nats.
const LEAST_LINE: f64 = -2.0;

/// Each set costs a fit of some tenths of a second, and an extension gains where it starts: a few are fitted. What two free
/// forms leave unexplained no third one tells apart.
pub(crate) const POLICY: Policy = Policy {
    largest: 9,
    most_free: 2,
    fitted: 5,
    least_gain: LEAST_SCREENED,
    loss: 0.0,
    regrows: true,
    rescales: false,
    rounds: 1,
    exchanges: 3,
    settled: 0.1,
    reach: 12.0,
    window: 6.0,
    centres: 0,
};

/// Sets of the candidates of a likelihood, with prior odds.
#[derive(Clone, Copy)]
pub(crate) struct Sets<'a> {
    /// The likelihood.
    pub likelihood: &'a Likelihood<'a>,
    /// The prior odds.
    pub prior: Prior,
}

impl<'a> Sets<'a> {
    /// Sets of candidates that may be at work.
    pub(crate) fn new(likelihood: &'a Likelihood<'a>, prior: Prior) -> Self {
        Self { likelihood, prior }
    }

    /// ln of the prior odds of a set.
    pub(crate) fn ln_prior(&self, h: &Hypothesis) -> f64 {
        h.key().into_iter().map(|c| self.prior.of(self.is_named(c))).sum()
    }

    /// `base` with `candidate` at a good start, and its gain in ln p there. `whitened`: the recording whitened under `base`,
    /// once a candidate asks for it.
    fn extended(&self, base: &Fitted, candidate: usize, whitened: &OnceLock<Vec<f64>>) -> Extension<Hypothesis> {
        let l = self.likelihood;
        let h = &base.hypothesis;
        let gain = |(h, value): (Hypothesis, f64)| (h, value - base.ln_mode);
        match &l.candidates[candidate].kind {
            Kind::Signal(s) => l.add_signal(h, candidate, s.as_ref()).map(|(grown, _)| gain(l.with_white(grown))),
            Kind::Noise(_) | Kind::Filter(_) | Kind::Level(_) | Kind::Shape(_) => l.add_noise(h, candidate).map(gain),
            Kind::Variance(s) => l.add_variance(h, candidate, s.as_ref()).map(gain),
            Kind::TurnOn => Some(gain(l.add_turn_on(h, candidate))),
            Kind::Line(s, harmonics) => {
                let lines = Lines::new(whitened.get_or_init(|| l.whitened(h)), l.frame.scene.step_s);
                let tone = *harmonics == 1;
                let cycles = if tone { TONE_CYCLES } else { CYCLES };
                let line = if tone { lines.tone(cycles) } else { lines.comb(cycles, *harmonics) }?;
                let ln_shapes = lines.ln_shape(&line, cycles);
                if line.gain + ln_shapes < LEAST_LINE {
                    return None;
                }
                let added = l.add_line(h, candidate, s.as_ref(), &[line.frequency_hz], ln_shapes);
                Some((added, line.gain + ln_shapes))
            }
        }
    }
}

impl SetLikelihood for Sets<'_> {
    type Set = Hypothesis;
    type Fitted = Fitted;

    fn candidates(&self) -> usize {
        self.likelihood.candidates.len()
    }

    fn is_named(&self, candidate: usize) -> bool {
        self.likelihood.candidates[candidate].named
    }

    fn set(fitted: &Fitted) -> &Hypothesis {
        &fitted.hypothesis
    }

    fn members(set: &Hypothesis) -> Vec<Member> {
        set.candidates().map(|c| (c, 0)).collect()
    }

    fn without(set: &Hypothesis, candidate: usize) -> Hypothesis {
        set.without(candidate)
    }

    fn fit(&self, start: &Hypothesis) -> Weighed<Fitted> {
        let fitted = self.likelihood.fit_with_shapes(start);
        Weighed { ln_weight: fitted.ln_evidence + self.ln_prior(start), fitted }
    }

    fn fit_all(&self, starts: &[&Hypothesis]) -> Vec<Weighed<Fitted>> {
        starts.par_iter().map(|start| self.fit(start)).collect()
    }

    fn extensions(&self, base: &Fitted, candidates: &[usize]) -> Vec<Extension<Hypothesis>> {
        let whitened = OnceLock::new();
        let one = |c: &usize| {
            let (h, gain) = self.extended(base, *c, &whitened)?;
            Some((h, gain + self.prior.of(self.is_named(*c))))
        };
        candidates.par_iter().map(one).collect()
    }

    /// Each level of the noise with each filter: a nominal level that was read off filtered noise lacks what the filter
    /// removed.
    fn pairs(&self) -> Vec<[usize; 2]> {
        let of = |wanted: fn(&Kind) -> bool| {
            (0..self.candidates()).filter(move |c| wanted(&self.likelihood.candidates[*c].kind))
        };
        let filters = |level: usize| of(|k| matches!(k, Kind::Filter(_))).map(move |filter| [level, filter]);
        of(|k| matches!(k, Kind::Level(_))).flat_map(filters).collect()
    }
}
