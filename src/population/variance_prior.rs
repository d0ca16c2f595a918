//! s_u² ~ s₀² F(d_u, d₀):  variances of units of a kind, each known by d_u degrees of freedom
//!
//! ```text
//! e_u = ln s_u² - ψ(d_u/2) + ln(d_u/2),   ψ'(d₀/2) = var(e) - mean ψ'(d_u/2),   ln s₀² = mean(e) + ψ(d₀/2) - ln(d₀/2)
//! ```
//!
//! Moments of ln s_u² (Smyth, Stat. Appl. Genet. Mol. Biol. 3 (2004) 3, equations of section 6.2). Where the variances differ by no more than
//! chance, d₀ is unbounded: all units have one variance.

use statrs::function::gamma::digamma;

/// Fewest units by which a prior is told: with three, one in 3000 false alarms became two.
const FEWEST: usize = 5;
/// Rounds of Newton's method for the inverse of ψ'; it converges monotonically.
const ROUNDS: usize = 50;

/// Prior of a unit's variance: as if d₀ earlier power-ons had told s₀².
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct VariancePrior {
    /// d₀; zero where too few units tell it, unbounded where all have one variance.
    degrees: f64,
    /// s₀².
    variance: f64,
    /// Degrees of freedom of all units together: no variance is known better than by these (limma, `eBayes`).
    pooled: f64,
}

impl VariancePrior {
    /// No prior.
    pub(super) const NONE: Self = Self { degrees: 0.0, variance: 0.0, pooled: f64::INFINITY };

    /// Prior by the sums of squares about the mean of some units, each with its degrees of freedom.
    pub(super) fn of(units: impl Iterator<Item = (f64, f64)>) -> Self {
        let told: Vec<(f64, f64)> = units.filter(|(squares, d)| *d >= 1.0 && *squares > 0.0).collect();
        if told.len() < FEWEST {
            return Self::NONE;
        }
        let n = told.len() as f64;
        let pooled = told.iter().map(|(_, d)| d).sum();
        let e: Vec<f64> = told.iter().map(|(s, d)| (s / d).ln() - digamma(0.5 * d) + (0.5 * d).ln()).collect();
        let mean = e.iter().sum::<f64>() / n;
        let scatter = e.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / (n - 1.0);
        let excess = scatter - told.iter().map(|(_, d)| trigamma(0.5 * d)).sum::<f64>() / n;
        if excess <= 0.0 {
            return Self { degrees: f64::INFINITY, variance: mean.exp(), pooled };
        }
        let half = inverse_trigamma(excess);
        Self { degrees: 2.0 * half, variance: (mean + digamma(half) - half.ln()).exp(), pooled }
    }

    /// Variance of a unit with this sum of squares and degrees of freedom, and the degrees of freedom by which it is known.
    pub(super) fn moderated(&self, squares: f64, degrees: f64) -> (f64, f64) {
        if self.degrees.is_infinite() {
            return (self.variance, self.pooled);
        }
        let all = self.degrees + degrees;
        ((self.degrees * self.variance + squares) / all, all.min(self.pooled))
    }
}

/// ψ'(x) for x > 0: its recurrence up to 10, then its asymptotic series (Abramowitz and Stegun 6.4.12), good to 1e-13.
fn trigamma(x: f64) -> f64 {
    let (mut x, mut sum) = (x, 0.0);
    while x < 10.0 {
        sum += 1.0 / (x * x);
        x += 1.0;
    }
    let i = 1.0 / (x * x);
    let series = i * (1.0 / 6.0 - i * (1.0 / 30.0 - i * (1.0 / 42.0 - i * (1.0 / 30.0 - i * 5.0 / 66.0))));
    sum + (1.0 + 0.5 / x + series) / x
}

/// x of ψ'(x) = y > 0, by Newton's method in 1/ψ', which is convex (Smyth, appendix).
fn inverse_trigamma(y: f64) -> f64 {
    let mut x = 0.5 + 1.0 / y;
    for _ in 0..ROUNDS {
        let here = trigamma(x);
        let slope = (trigamma(x * (1.0 + 1e-6)) - here) / (x * 1e-6);
        let step = here * (1.0 - here / y) / slope;
        x += step;
        if step.abs() < 1e-10 * x {
            break;
        }
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Stream;
    use std::f64::consts::PI;

    #[test]
    fn trigamma_has_its_known_values() {
        for (x, known) in
            [(1.0, PI * PI / 6.0), (0.5, PI * PI / 2.0), (2.0, PI * PI / 6.0 - 1.0), (10.0, 0.105_166_335_681_685_75)]
        {
            assert!((trigamma(x) / known - 1.0).abs() < 1e-12, "{x}: {} for {known}", trigamma(x));
            assert!((inverse_trigamma(known) / x - 1.0).abs() < 1e-5, "{x}: {}", inverse_trigamma(known));
        }
    }

    /// 2000 units: the relative error of d₀ is about √(2/n) ψ'(d/2)/… below a tenth, that of s₀² below a twentieth.
    #[test]
    fn a_prior_is_found_again_from_units_that_were_drawn_of_it() {
        let mut draw = Stream::new(5, 0);
        let (d0, s0) = (8.0, 4.0);
        let mut chi2 = |d: usize| (0..d).map(|_| draw.normal().powi(2)).sum::<f64>();
        let units: Vec<(f64, f64)> = (0..2000)
            .map(|k| {
                let d = 5 + k % 6;
                (s0 * d0 / chi2(8) * chi2(d), d as f64)
            })
            .collect();
        let found = VariancePrior::of(units.iter().copied());
        assert!((found.degrees / d0).ln().abs() < 0.3 && (found.variance / s0).ln().abs() < 0.1, "{found:?}");
        let alike: Vec<(f64, f64)> = (0..50).map(|_| (9.0, 9.0)).collect();
        assert_eq!(VariancePrior::of(alike.into_iter()).degrees, f64::INFINITY);
        assert_eq!(VariancePrior::of([(1.0, 3.0)].into_iter()), VariancePrior::NONE);
    }
}
