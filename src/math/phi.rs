//! φ1(z) = (1 - exp(-z))/z,  φ2(z) = (1 - φ1(z))/z: integrals of a decaying quantity over a step
//!
//! By their series where z is small, so that both keep their digits at zero; φ2 = Σ (-z)^k / (k+2)!.

/// 1/2, 1/3, ... 1/10.
const INVERSE: [f64; 9] =
    [1.0 / 2.0, 1.0 / 3.0, 1.0 / 4.0, 1.0 / 5.0, 1.0 / 6.0, 1.0 / 7.0, 1.0 / 8.0, 1.0 / 9.0, 1.0 / 10.0];

/// exp(-z), φ1(z) and φ2(z) of each z >= 0, to rounding.
///
/// Several at a time: the compiler then computes their series side by side.
#[must_use]
#[inline]
pub(crate) fn exponentials<const K: usize>(z: [f64; K]) -> [[f64; 3]; K] {
    let largest = z.iter().fold(0.0, |a: f64, b| a.max(*b));
    // what is left out is below 0.001⁵/7! = 2e-19 and 0.1⁹/11! = 3e-17
    let terms = match largest {
        _ if largest < 1e-3 => 5,
        _ if largest < 0.1 => 9,
        _ => return z.map(exponential),
    };
    let mut phi2 = [0.0; K];
    for inverse in INVERSE[..terms].iter().rev() {
        for (phi2, z) in phi2.iter_mut().zip(z) {
            *phi2 = inverse * (1.0 - z * *phi2);
        }
    }
    std::array::from_fn(|i| {
        let phi1 = 1.0 - z[i] * phi2[i];
        [1.0 - z[i] * phi1, phi1, phi2[i]]
    })
}

/// [`exponentials`] of one, at any size.
fn exponential(z: f64) -> [f64; 3] {
    if z < 0.1 {
        return exponentials([z])[0];
    }
    let phi1 = -(-z).exp_m1() / z;
    [(-z).exp(), phi1, (1.0 - phi1) / z]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn they_meet_where_the_formula_changes_and_keep_digits_at_zero() {
        assert_eq!(exponentials([0.0]), [[1.0, 1.0, 0.5]]);
        for z in [1e-12, 1e-6, 9.99e-4, 1e-3, 0.05, 0.099_999_999, 0.1, 0.3, 2.0, 50.0] {
            // alone, and beside one that asks for another formula
            for [e, p1, p2] in [exponentials([z])[0], exponentials([0.0, z, 7.0])[1], exponentials([z, 0.01])[0]] {
                assert!((e - (-z).exp()).abs() < 4.0 * f64::EPSILON, "{z}");
                // the recurrences 1 - z φ1 = E and 1 - z φ2 = φ1 hold for every branch
                assert!((1.0 - z * p1 - e).abs() < 4.0 * f64::EPSILON, "{z}");
                assert!((1.0 - z * p2 - p1).abs() < 4.0 * f64::EPSILON, "{z}");
            }
        }
        // 1/2 - z/6 + z²/24 - z³/120 at z = 0.01, truncated at 1e-8/720
        assert!((exponentials([0.01])[0][2] - (0.5 - 0.01 / 6.0 + 1e-4 / 24.0 - 1e-6 / 120.0)).abs() < 2e-11);
        assert!(exponentials([f64::NAN, 1.0])[0].iter().all(|v| v.is_nan()));
    }
}
