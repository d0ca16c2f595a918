//! p(z | β in bounds) = p(z) P(β in bounds | z)/P(β in bounds):  a coefficient that physics bounds has a normal prior that is cut
//! off there

use super::evidence::Likelihood;
use super::gaussian::Picked;
use super::hypothesis::{Hypothesis, Kind};
use crate::math::distributions::ln_normal_between;

impl Likelihood<'_> {
    /// Gain in ln p(z) by the bounds of the signals' coefficients, nats: of a coefficient that the recording puts out of its
    /// bounds a loss. Several coefficients count as if they were independent.
    pub(super) fn ln_bounded(&self, h: &Hypothesis, picked: &Picked) -> f64 {
        let bounds: Vec<Option<Vec<[f64; 2]>>> = h
            .signals
            .iter()
            .map(|s| match &self.candidates[s.candidate].kind {
                Kind::Signal(signal) => signal.bounds(),
                _ => None,
            })
            .collect();
        if bounds.iter().all(Option::is_none) {
            return 0.0;
        }
        let Some(posterior) = self.value(h, picked, true).1 else { return f64::NEG_INFINITY };
        let size = posterior.mean.len();
        let (mut at, mut gain) = (self.nuisance.len(), 0.0);
        for (s, bounds) in h.signals.iter().zip(bounds) {
            for (j, [low, high]) in bounds.into_iter().flatten().enumerate() {
                let (mean, variance) = (posterior.mean[at + j], posterior.covariance[(at + j) * size + at + j]);
                let (prior, std) = (s.unit[j] * s.ln_scale.exp(), variance.max(0.0).sqrt());
                if prior > 0.0 && std > 0.0 {
                    gain += ln_normal_between((low - mean) / std, (high - mean) / std)
                        - ln_normal_between(low / prior, high / prior);
                }
            }
            at += s.columns.len();
        }
        gain
    }
}
