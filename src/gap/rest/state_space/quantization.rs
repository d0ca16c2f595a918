//! P = ∫ φ(z) dz over the cell, with mean and variance of z in it: a standard normal known to lie in an interval
//!
//! Narrow cells by Gauss-Legendre quadrature, wide ones by the error function (Johnson, Kotz, Balakrishnan, Continuous
//! Univariate Distributions 1, §13.10.1), which would lose its digits to cancellation in narrow ones.

use statrs::function::erf::erfc;
use std::f64::consts::{FRAC_1_SQRT_2, PI, TAU};

/// Moments of a standard normal in an interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Cell {
    pub log_probability: f64,
    pub mean: f64,
    pub variance: f64,
}

/// Positive nodes and weights of Gauss-Legendre quadrature on [-1, 1] (Abramowitz and Stegun, table 25.4).
const FOUR: [(f64, f64); 2] =
    [(0.339_981_043_584_856_26, 0.652_145_154_862_546_1), (0.861_136_311_594_052_6, 0.347_854_845_137_453_85)];
const SIXTEEN: [(f64, f64); 8] = [
    (0.095_012_509_837_637_44, 0.189_450_610_455_068_5),
    (0.281_603_550_779_258_9, 0.182_603_415_044_923_6),
    (0.458_016_777_657_227_4, 0.169_156_519_395_002_54),
    (0.617_876_244_402_643_7, 0.149_595_988_816_576_73),
    (0.755_404_408_355_003, 0.124_628_971_255_533_87),
    (0.865_631_202_387_831_7, 0.095_158_511_682_492_78),
    (0.944_575_023_073_232_6, 0.062_253_523_938_647_89),
    (0.989_400_934_991_649_9, 0.027_152_459_411_754_095),
];

impl Cell {
    /// The interval `centre` ± `half`, in standard deviations from the mean.
    #[inline]
    pub(super) fn new(centre: f64, half: f64) -> Self {
        let steepness = centre.abs() * half;
        if steepness < 0.3 && half < 0.2 {
            return Self::narrow(centre, half, &FOUR);
        }
        if steepness < 12.0 && half < 2.0 {
            return Self::narrow(centre, half, &SIXTEEN);
        }
        let c = centre.abs();
        let wide = Self::wide(c - half, c + half);
        Self { mean: wide.mean.copysign(centre), ..wide }
    }

    /// φ(c + hx) = φ(c) exp(-chx - (hx)²/2): the moments of x, sums over the nodes.
    #[inline]
    fn narrow(centre: f64, half: f64, nodes: &[(f64, f64)]) -> Self {
        let (mut zeroth, mut first, mut second) = (0.0, 0.0, 0.0);
        for (x, w) in nodes {
            let even = w * (-0.5 * (half * x).powi(2)).exp();
            let tilt = (centre * half * x).exp();
            let (sum, difference) = (tilt + tilt.recip(), tilt.recip() - tilt);
            zeroth += even * sum;
            first += even * x * difference;
            second += even * x * x * sum;
        }
        let mean = first / zeroth;
        Self {
            log_probability: (half * zeroth).ln() - 0.5 * (centre * centre + TAU.ln()),
            mean: centre + half * mean,
            variance: half * half * (second / zeroth - mean * mean),
        }
    }

    /// From `a` to `b`, with b - a or b² - a² large, and a + b >= 0.
    fn wide(a: f64, b: f64) -> Self {
        let ln_phi = |z: f64| -0.5 * (z * z + TAU.ln());
        let log_probability = if a > 0.0 {
            let rest = (0.5 * (a - b) * (a + b)).exp() * scaled_erfc(b * FRAC_1_SQRT_2);
            -0.5 * a * a + (0.5 * (scaled_erfc(a * FRAC_1_SQRT_2) - rest)).ln()
        } else {
            (1.0 - 0.5 * erfc(-a * FRAC_1_SQRT_2) - 0.5 * erfc(b * FRAC_1_SQRT_2)).ln()
        };
        // densities at both ends over the probability
        let (at_a, at_b) = ((ln_phi(a) - log_probability).exp(), (ln_phi(b) - log_probability).exp());
        if a > 50.0 {
            // 1 + a λ - λ² cancels; the tail is all but exponential, and exp(-2ch) of it is cut off, c h > 12
            let r = (a * a).recip();
            return Self {
                log_probability,
                mean: a + (1.0 - r * (2.0 - 10.0 * r)) / a,
                variance: r * (1.0 - r * (6.0 - 50.0 * r)),
            };
        }
        let mean = at_a - at_b;
        let ends = a * at_a - if at_b > 0.0 { b * at_b } else { 0.0 };
        Self { log_probability, mean, variance: (1.0 + ends - mean * mean).clamp(0.0, 1.0) }
    }
}

/// exp(x²) erfc(x), x >= 0.
fn scaled_erfc(x: f64) -> f64 {
    if x < 20.0 {
        return (x * x).exp() * erfc(x);
    }
    let r = (x * x).recip();
    // Abramowitz and Stegun 7.1.23; the next term is below 1e-11
    (1.0 - 0.5 * r * (1.0 - 1.5 * r * (1.0 - 2.5 * r))) / (x * PI.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Simpson's rule on 20 000 intervals of the cell, by the exponent relative to its largest value.
    fn brute(centre: f64, half: f64) -> Cell {
        let n = 20_000;
        // beyond 40 standard deviations from the nearest point nothing is left
        let nearest = (centre.abs() - half).max(0.0);
        let low = (centre.abs() - half).max(-12.0);
        let high = (centre.abs() + half).min(if nearest > 3.0 { nearest + 40.0 / nearest } else { 12.0 });
        let (mut p, mut m, mut s) = (0.0, 0.0, 0.0);
        for i in 0..=n {
            let w = if i == 0 || i == n { 1.0 } else { 2.0 * f64::from(1 + i % 2) };
            let z = low + (high - low) * f64::from(i) / f64::from(n);
            let f = w * (-0.5 * (z - nearest) * (z + nearest)).exp();
            p += f;
            m += f * (z - nearest);
            s += f * (z - nearest).powi(2);
        }
        let step = (high - low) / f64::from(3 * n);
        let mean = m / p;
        Cell {
            log_probability: (p * step).ln() - 0.5 * (nearest * nearest + TAU.ln()),
            mean: (nearest + mean).copysign(centre),
            variance: s / p - mean * mean,
        }
    }

    #[test]
    fn moments_are_those_of_brute_quadrature() {
        for half in [1e-6, 0.01, 0.19, 0.21, 0.7, 1.9, 2.1, 8.0] {
            for centre in [0.0, 0.3, -1.0, 1.4, 3.0, -5.9, 6.3, 11.0, -20.0, 49.0, 51.5, 70.0] {
                let (a, b) = (Cell::new(centre, half), brute(centre, half));
                let at = format!("{centre} {half}: {a:?} {b:?}");
                assert!((a.log_probability - b.log_probability).abs() < 1e-7, "{at}");
                assert!((a.mean - b.mean).abs() < 1e-6 * b.variance.sqrt().max(1e-3), "{at}");
                assert!((a.variance / b.variance - 1.0).abs() < 1e-4, "{at}");
            }
        }
    }

    #[test]
    fn cells_of_a_lattice_hold_all_the_probability() {
        for (lsb, offset) in [(0.1, 0.03), (0.9, 0.4), (3.0, -1.0), (7.0, 2.0)] {
            let total: f64 =
                (-200..=200).map(|i| Cell::new(offset + lsb * f64::from(i), 0.5 * lsb).log_probability.exp()).sum();
            assert!((total - 1.0).abs() < 1e-9, "{lsb}: {total}");
        }
    }
}
