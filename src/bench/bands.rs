//! P(named) = Φ((E - c) / √(2 E)): an oracle that knows an effect's true form and size
//!
//! Under the effect its ln likelihood ratio is normal with mean E and variance 2 E, E being the label's nats (Neyman and
//! Pearson 1933; exact for innovations that the effect shifts). The oracle names it above c, minus ln of the prior odds.
//! It fits nothing and weighs no other effect, so that no diagnosis does better on average.

use super::intervals::Rate;
use super::judge::{Judged, Wanted};
use crate::gap::Prior;
use serde::Serialize;
use statrs::function::erf::erfc;

/// Limits of the bands, nats.
const LIMITS: [f64; 5] = [0.0, 12.0, 30.0, 100.0, f64::INFINITY];

/// Cases with one listed effect, or two, whose nats lie in one band: of two, those of the weaker one.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Band {
    /// Least nats.
    pub from_nats: f64,
    /// Limit of the nats; none above the last band.
    pub to_nats: Option<f64>,
    /// Cases without other effects: the effect is named; of two, both, and nothing else.
    pub alone: Rate,
    /// Cases with small amounts of others: the same.
    pub with_others: Rate,
    /// Expected share of all these cases in which an oracle names the effect; of two, the weaker one.
    pub oracle: f64,
}

/// Probability that an oracle names an effect of `nats`.
fn oracle(nats: f64) -> f64 {
    let price = -Prior::default().ln_named;
    // Φ(x) = erfc(-x/√2)/2
    0.5 * erfc((price - nats) / (2.0 * nats.max(f64::MIN_POSITIVE).sqrt()))
}

/// Bands of the cases with so many listed effects, one or two; those without a case are left out.
pub(super) fn bands(judged: &[Judged], effects: usize) -> Vec<Band> {
    let cases = || judged.iter().filter(|j| j.wanted == Wanted::Identified && j.truth.len() == effects);
    let right = |j: &Judged| if effects == 1 { j.right } else { j.exact };
    let band = |limits: &[f64]| {
        let [from, to] = [limits[0], limits[1]];
        let inside: Vec<(&Judged, f64)> =
            cases().filter_map(|j| Some((j, j.nats?))).filter(|(_, nats)| (from..to).contains(nats)).collect();
        let named = |messy: bool| Rate::count(inside.iter().filter(|(j, _)| j.messy == messy).map(|(j, _)| right(j)));
        (!inside.is_empty()).then(|| Band {
            from_nats: from,
            to_nats: to.is_finite().then_some(to),
            alone: named(false),
            with_others: named(true),
            oracle: inside.iter().map(|(_, nats)| oracle(*nats)).sum::<f64>() / inside.len() as f64,
        })
    };
    LIMITS.windows(2).filter_map(band).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Stream;

    #[test]
    fn the_oracle_names_as_often_as_simulated_likelihood_ratios_exceed_the_price() {
        let mut draw = Stream::new(5, 0);
        let price = -Prior::default().ln_named;
        let n = 20_000;
        for nats in [1.0, 4.0, 12.0] {
            // one reading that the effect shifts by √(2E): ln Λ = z √(2E) - E
            let shift = f64::sqrt(2.0 * nats);
            let above = (0..n).filter(|_| (draw.normal() + shift) * shift - nats > price).count();
            let (p, share) = (oracle(nats), above as f64 / f64::from(n));
            assert!((share - p).abs() < 4.0 * (p * (1.0 - p) / f64::from(n)).sqrt(), "{nats}: {share} for {p}");
        }
    }
}
