//! y_i ~ N(μ, S_i + τ² I), S_i known: by how much n vectors of p numbers differ beyond their own errors
//!
//! ```text
//! Q(τ²) = Σ (y_i - μ(τ²))ᵀ (S_i + τ² I)⁻¹ (y_i - μ(τ²)),   μ(τ²) by generalised least squares
//! ```
//!
//! At the true τ² this is χ² with p(n-1) degrees of freedom, and it falls with τ². The estimate is where Q = p(n-1) (Paule and
//! Mandel, J. Res. NBS 87 (1982) 377), the 95 % interval where Q is at the quantiles (Viechtbauer, Statistics in Medicine 26
//! (2007) 37): exact for normal y_i, however few. Where Q(0) is smaller already, τ is 0: the errors explain all differences.
//! The mean has the interval of Hartung and Knapp (Statistics in Medicine 20 (2001) 3875), Student's with n-1 degrees of freedom;
//! at this τ their variance is (Σ (S_i + τ² I)⁻¹)⁻¹. It is exact for equal S_i; where those of eight vectors differ sixteenfold it covers
//! 92 %.

use super::distributions::chi_squared_interval95;
use nalgebra::{SMatrix, SVector};
use statrs::distribution::{ChiSquared, ContinuousCDF, StudentsT};

/// One vector with the covariance of its own error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Observed<const P: usize> {
    /// y.
    pub value: SVector<f64, P>,
    /// S, positive semidefinite.
    pub covariance: SMatrix<f64, P, P>,
}

impl Observed<1> {
    /// A number with its standard deviation.
    #[must_use]
    pub(crate) fn number(value: f64, std: f64) -> Self {
        Self { value: SVector::<f64, 1>::new(value), covariance: SMatrix::<f64, 1, 1>::new(std * std) }
    }
}

/// Spread and mean of a population.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Spread<const P: usize> {
    /// τ, the spread net of the errors.
    pub std: f64,
    /// Its 95 % interval; the upper end is infinite if no τ is too large.
    pub ci95: [f64; 2],
    /// Probability of differences like these if the errors were all there is (Cochran's test).
    pub p_value: f64,
    /// μ.
    pub mean: SVector<f64, P>,
    /// Its covariance.
    pub mean_covariance: SMatrix<f64, P, P>,
    /// Half width of the 95 % interval of each number of μ.
    pub mean_half_width: SVector<f64, P>,
}

/// Relative tolerance of τ².
const TOLERANCE: f64 = 1e-9;
/// Most steps to it; five or so are taken.
const STEPS: usize = 200;
/// Least τ² over the square of the numbers' scale: without it a given number, whose error is 0, would weigh infinitely.
pub(super) const FLOOR: f64 = 1e-18;

/// Spread and mean of `observed`. `None` for fewer than two, for numbers that are not finite, and where neither errors nor
/// differences are positive.
#[must_use]
pub(crate) fn spread<const P: usize>(observed: &[Observed<P>]) -> Option<Spread<P>> {
    let n = observed.len();
    let finite = |o: &Observed<P>| o.value.iter().chain(o.covariance.iter()).all(|v| v.is_finite());
    if n < 2 || P == 0 || !observed.iter().all(finite) {
        return None;
    }
    let degrees = ((n - 1) * P) as f64;
    let centre = observed.iter().map(|o| o.value).sum::<SVector<f64, P>>() / n as f64;
    let differences = observed.iter().map(|o| (o.value - centre).norm_squared()).sum::<f64>();
    let errors = observed.iter().map(|o| o.covariance.trace()).sum::<f64>();
    let scale = (differences + errors) / n as f64;
    if !(scale > 0.0) {
        return None;
    }
    let q = |variance: f64| deviance(observed, variance.max(FLOOR * scale)).map(|d| d.q);
    let at = |target: f64| variance_where(q, target, scale, TOLERANCE).map(f64::sqrt);
    let [low, high] = chi_squared_interval95(degrees);
    let std = at(degrees)?;
    let ci95 = [at(high)?, at(low)?];
    let Deviance { mean, mean_covariance, .. } = deviance(observed, (std * std).max(FLOOR * scale))?;
    let student = StudentsT::new(0.0, 1.0, (n - 1) as f64).ok()?.inverse_cdf(0.975);
    Some(Spread {
        std,
        ci95,
        p_value: ChiSquared::new(degrees).ok()?.sf(q(0.0)?[0]),
        mean,
        mean_covariance,
        mean_half_width: mean_covariance.diagonal().map(|v| student * v.max(0.0).sqrt()),
    })
}

/// τ² at which Q is `target`: 0 where it is smaller already, infinite where 10²⁴ `scale` is too little. `q`: Q and its derivative by τ².
///
/// Q = Σ z_k²/(a_k + τ²), so that 1/Q is concave: Newton's step on it does not pass the root from the left, and where the a_k are equal it
/// is there at once. Where rounding makes it pass, the middle of what was seen on either side is taken.
pub(crate) fn variance_where(
    q: impl Fn(f64) -> Option<[f64; 2]>,
    target: f64,
    scale: f64,
    tolerance: f64,
) -> Option<f64> {
    let (mut variance, mut left, mut right) = (0.0, 0.0, f64::INFINITY);
    for step in 0..STEPS {
        let [value, slope] = q(variance)?;
        if step == 0 && value <= target {
            return Some(0.0);
        }
        if value > target {
            left = variance
        } else {
            right = variance
        }
        let mut next = variance + (target - value) / slope * (value / target);
        if !(left < next && next < right) && right.is_finite() {
            next = 0.5 * (left + right);
        }
        if !next.is_finite() || next > 1e24 * scale {
            return Some(f64::INFINITY);
        }
        if (next - variance).abs() <= tolerance * next {
            return Some(next);
        }
        variance = next;
    }
    None
}

/// Q with its derivative by τ², μ and its covariance.
struct Deviance<const P: usize> {
    q: [f64; 2],
    mean: SVector<f64, P>,
    mean_covariance: SMatrix<f64, P, P>,
}

fn deviance<const P: usize>(observed: &[Observed<P>], variance: f64) -> Option<Deviance<P>> {
    let added = SMatrix::<f64, P, P>::identity() * variance;
    let weights = observed.iter().map(|o| (o.covariance + added).try_inverse());
    let weights: Vec<SMatrix<f64, P, P>> = weights.collect::<Option<_>>()?;
    let mean_covariance = weights.iter().sum::<SMatrix<f64, P, P>>().try_inverse()?;
    let weighted = weights.iter().zip(observed).map(|(w, o)| w * o.value).sum::<SVector<f64, P>>();
    let mean = mean_covariance * weighted;
    let mut q = [0.0; 2];
    for (w, o) in weights.iter().zip(observed) {
        let r = o.value - mean;
        let wr = w * r;
        q = [q[0] + r.dot(&wr), q[1] - wr.norm_squared()];
    }
    Some(Deviance { q, mean, mean_covariance })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Stream;
    use nalgebra::{Matrix2, Vector2};

    #[test]
    fn equal_errors_have_a_closed_form() {
        let values = [1.0, 2.5, 0.5, 4.0, 3.0];
        let s = 0.4;
        let observed = values.map(|v| Observed::number(v, s));
        let found = spread(&observed).unwrap();
        let mean = values.iter().sum::<f64>() / 5.0;
        let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 4.0;
        // Q = Σ (y - mean)²/(s² + τ²) = n - 1
        assert!((found.std - (variance - s * s).sqrt()).abs() < 1e-8, "{found:?}");
        assert!((found.mean[0] - mean).abs() < 1e-12);
        assert!((found.mean_covariance[0] - variance / 5.0).abs() < 1e-8);
        for (end, quantile) in found.ci95.iter().zip([11.143_286_8, 0.484_418_6]) {
            assert!((end - (4.0 * variance / quantile - s * s).sqrt()).abs() < 1e-6, "{end}");
        }
        // Student's quantile with four degrees of freedom
        assert!((found.mean_half_width[0] - 2.776_445 * (variance / 5.0).sqrt()).abs() < 1e-5);
    }

    #[test]
    fn errors_that_explain_all_leave_no_spread() {
        let observed = [1.0, 1.1, 0.9, 1.05].map(|v| Observed::number(v, 1.0));
        let found = spread(&observed).unwrap();
        assert_eq!((found.std, found.ci95[0]), (0.0, 0.0));
        assert!(found.p_value > 0.99, "{found:?}");
        assert!((found.mean_covariance[0] - 0.25).abs() < 1e-6);
    }

    #[test]
    fn too_little_gives_nothing() {
        assert!(spread(&[Observed::number(1.0, 1.0)]).is_none());
        assert!(spread(&[Observed::number(1.0, 0.0), Observed::number(1.0, 0.0)]).is_none());
        assert!(spread(&[Observed::number(1.0, 1.0), Observed::number(f64::NAN, 1.0)]).is_none());
    }

    #[test]
    fn given_numbers_among_others_are_no_obstacle() {
        // a fifth of the numbers without error, which weigh 10¹⁸ times as much at τ = 0
        for seed in 0..2000 {
            let mut draw = Stream::new(seed, 4);
            let observed: Vec<Observed<1>> = (0..6)
                .map(|_| {
                    let std = if draw.uniform() < 0.2 { 0.0 } else { 10.0_f64.powf(-3.0 * draw.uniform()) };
                    Observed::number(draw.normal() * std.max(0.1), std)
                })
                .collect();
            assert!(spread(&observed).is_some_and(|s| s.std.is_finite() && s.ci95[0] <= s.std), "{observed:?}");
        }
    }

    /// Share of `runs` populations whose interval holds the true spread: 95 % within three binomial standard deviations.
    fn covers(runs: u64, covered: impl Fn(u64) -> bool) {
        let share = (0..runs).filter(|seed| covered(*seed)).count() as f64 / runs as f64;
        let bound = 3.0 * (0.95 * 0.05 / runs as f64).sqrt();
        assert!((share - 0.95).abs() < bound, "{share} of {runs}");
    }

    #[test]
    fn intervals_of_the_spread_cover() {
        // six numbers whose errors differ tenfold; seeds 0 to 3999
        let errors = [0.2, 0.4, 0.7, 1.0, 1.5, 2.0];
        for true_std in [0.5, 1.0, 4.0] {
            covers(4000, |seed| {
                let mut draw = Stream::new(seed, 1);
                let observed = errors.map(|s| Observed::number(7.0 + true_std * draw.normal() + s * draw.normal(), s));
                let [low, high] = spread(&observed).unwrap().ci95;
                low <= true_std && true_std <= high
            });
        }
    }

    #[test]
    fn intervals_of_the_mean_cover() {
        // Hartung and Knapp's interval is Student's where the errors are equal
        covers(4000, |seed| {
            let mut draw = Stream::new(seed, 2);
            let observed = [0.5; 5].map(|s| Observed::number(-2.0 + 2.0 * draw.normal() + s * draw.normal(), s));
            let found = spread(&observed).unwrap();
            (found.mean[0] + 2.0).abs() <= found.mean_half_width[0]
        });
    }

    #[test]
    fn one_spread_of_two_correlated_numbers_covers() {
        covers(2000, |seed| {
            let mut draw = Stream::new(seed, 3);
            let observed: Vec<Observed<2>> = (0..5)
                .map(|i| {
                    let s = 0.3 + 0.3 * f64::from(i);
                    // errors correlated by 0.8
                    let (a, b) = (draw.normal(), draw.normal());
                    let error = Vector2::new(s * a, s * (0.8 * a + 0.6 * b));
                    let covariance = Matrix2::new(1.0, 0.8, 0.8, 1.0) * (s * s);
                    let value = Vector2::new(1.0, -3.0) + error + Vector2::new(draw.normal(), draw.normal());
                    Observed { value, covariance }
                })
                .collect();
            let [low, high] = spread(&observed).unwrap().ci95;
            low <= 1.0 && 1.0 <= high
        });
    }
}
