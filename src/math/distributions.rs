//! Quantiles that several parts need.

use crate::math::NORMAL_975;
use statrs::distribution::{ChiSquared, ContinuousCDF, Normal};

/// Beyond this many degrees of freedom Wilson and Hilferty's cube root (PNAS 17 (1931) 684) is closer to the quantile
/// than an incomplete gamma function can be inverted: its relative error is below 1e-7.
const EXACT_DEGREES: f64 = 10_000.0;

/// Two-sided 95 % interval of chi-squared with `degrees` > 0 degrees of freedom.
#[must_use]
pub(crate) fn chi_squared_interval95(degrees: f64) -> [f64; 2] {
    chi_squared_interval(degrees, 0.95)
}

/// Two-sided interval of chi-squared with `degrees` > 0 degrees of freedom that holds it with probability `level`.
#[must_use]
pub(crate) fn chi_squared_interval(degrees: f64, level: f64) -> [f64; 2] {
    let (low, high) = (0.5 - 0.5 * level, 0.5 + 0.5 * level);
    match ChiSquared::new(degrees) {
        Ok(chi) if degrees <= EXACT_DEGREES => [chi.inverse_cdf(low), chi.inverse_cdf(high)],
        _ => [low, high].map(|p| Normal::standard().inverse_cdf(p)).map(|z| {
            let spread = 2.0 / (9.0 * degrees);
            degrees * (1.0 - spread + z * spread.sqrt()).powi(3)
        }),
    }
}

/// ln P(low < z < high) of a standard normal z, also far from zero.
#[must_use]
pub(crate) fn ln_normal_between(low: f64, high: f64) -> f64 {
    if low > 0.0 {
        // the tail that keeps its digits
        return ln_normal_between(-high, -low);
    }
    let (below, all) = (ln_normal_below(low), ln_normal_below(high));
    all + (-(below - all).exp()).ln_1p()
}

/// ln Φ(z).
fn ln_normal_below(z: f64) -> f64 {
    /// Here Φ is still a normal number, and from here on its asymptotic series is good to 1e-5.
    const FAR: f64 = -30.0;
    if z > FAR {
        return Normal::standard().cdf(z).ln();
    }
    -0.5 * z * z - (-z * std::f64::consts::TAU.sqrt()).ln() + (-1.0 / (z * z)).ln_1p()
}

/// Wilson's 95 % interval of the share `right` of `of` (J. American Statistical Association 22 (1927) 209); none of nothing.
#[must_use]
pub(crate) fn wilson95(right: usize, of: usize) -> Option<[f64; 2]> {
    let (n, z2) = (of as f64, NORMAL_975 * NORMAL_975);
    let p = right as f64 / n;
    let centre = (p + z2 / (2.0 * n)) / (1.0 + z2 / n);
    let half = NORMAL_975 / (1.0 + z2 / n) * (p * (1.0 - p) / n + z2 / (4.0 * n * n)).sqrt();
    (of > 0).then_some([(centre - half).max(0.0), (centre + half).min(1.0)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_intervals_are_those_of_the_tables_and_of_the_tails() {
        let near = |found: f64, wanted: f64| assert!((found / wanted - 1.0).abs() < 1e-6, "{found} {wanted}");
        near(ln_normal_between(-1.959_963_985, 1.959_963_985).exp(), 0.95);
        near(ln_normal_between(0.0, f64::INFINITY).exp(), 0.5);
        near(ln_normal_between(1.0, 2.0), ln_normal_between(-2.0, -1.0));
        near(ln_normal_between(5.0, f64::INFINITY).exp(), 2.866_515_719e-7);
        // across the change of formula, and where Φ itself is zero
        near(ln_normal_between(f64::NEG_INFINITY, -30.0 + 1e-9), ln_normal_between(f64::NEG_INFINITY, -30.0 - 1e-9));
        near(ln_normal_between(100.0, f64::INFINITY), -5_005.524_208_6);
        assert_eq!(ln_normal_between(f64::NEG_INFINITY, f64::INFINITY), 0.0);
    }

    #[test]
    fn quantiles_are_those_of_the_tables() {
        // Abramowitz and Stegun, table 26.8
        for (degrees, low, high) in [(1.0, 0.000_982, 5.024), (3.0, 0.216, 9.348), (100.0, 74.222, 129.561)] {
            let [a, b] = chi_squared_interval95(degrees);
            assert!((a - low).abs() < 5e-4 && (b - high).abs() < 5e-4, "{degrees}: {a} {b}");
        }
    }

    #[test]
    fn both_formulas_meet() {
        let exact = chi_squared_interval95(EXACT_DEGREES);
        let above = chi_squared_interval95(EXACT_DEGREES + 1e-6);
        for (a, b) in exact.iter().zip(above) {
            assert!((a / b - 1.0).abs() < 1e-7, "{a} {b}");
        }
    }
}
