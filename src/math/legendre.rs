//! Legendre polynomials P_0 … P_7 and the Legendre series of exp(-h x) on \[-1, 1\].
//!
//! exp(-h x) = Σ (2k+1) (-1)^k i_k(h) P_k(x), i_k the modified spherical Bessel function of the first kind
//! (Abramowitz and Stegun 10.2.36). Cut after degree 7 the error is about h⁸/15!!.

/// Number of polynomials, degree 0 to 7.
pub(crate) const COUNT: usize = 8;

/// P_0(x) … P_7(x), by Bonnet's recursion.
#[inline]
#[must_use]
pub(crate) fn polynomials(x: f64) -> [f64; COUNT] {
    let mut p = [1.0; COUNT];
    p[1] = x;
    for k in 1..COUNT - 1 {
        let kf = k as f64;
        p[k + 1] = ((2.0 * kf + 1.0) * x * p[k] - kf * p[k - 1]) / (kf + 1.0);
    }
    p
}

/// Legendre coefficients of exp(-h x) and of x exp(-h x), degrees 0 to 7, and the first one less 1.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Exponential {
    /// Coefficients of exp(-h x).
    pub plain: [f64; COUNT],
    /// Coefficients of x exp(-h x).
    pub times_x: [f64; COUNT],
    /// `plain[0] - 1` without cancellation at small h.
    pub first_less_one: f64,
}

/// The series at `h >= 0`. All terms of the Bessel series are positive: no digits are lost at any h.
#[must_use]
pub(crate) fn exponential(h: f64) -> Exponential {
    let mut q = [0.0; COUNT + 1];
    let mut first_less_one = 0.0;
    // h^k/(2k+1)!!, the leading factor of i_k
    let mut lead = 1.0;
    for (k, out) in q.iter_mut().enumerate() {
        let kf = k as f64;
        if k > 0 {
            lead *= h / (2.0 * kf + 1.0);
        }
        let (mut term, mut tail) = (1.0, 0.0);
        for j in 1..200 {
            let jf = f64::from(j);
            term *= 0.5 * h * h / (jf * (2.0 * kf + 2.0 * jf + 1.0));
            tail += term;
            if term <= f64::EPSILON * 0.1 * (1.0 + tail) {
                break;
            }
        }
        if k == 0 {
            first_less_one = tail;
        }
        let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
        *out = sign * (2.0 * kf + 1.0) * lead * (1.0 + tail);
    }
    // x P_k = ((k+1) P_{k+1} + k P_{k-1}) / (2k+1)
    let mut times_x = [0.0; COUNT];
    for (k, out) in times_x.iter_mut().enumerate() {
        let kf = k as f64;
        let below = if k > 0 { q[k - 1] * kf / (2.0 * kf - 1.0) } else { 0.0 };
        *out = below + q[k + 1] * (kf + 1.0) / (2.0 * kf + 3.0);
    }
    let mut plain = [0.0; COUNT];
    plain.copy_from_slice(&q[..COUNT]);
    Exponential { plain, times_x, first_less_one }
}

/// Σ a_k b_k.
#[inline]
#[must_use]
pub(crate) fn dot(a: &[f64; COUNT], b: &[f64; COUNT]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn series_has_the_stated_error() {
        for h in [0.0, 1e-6, 0.05, 0.2, 0.5, 1.0] {
            let e = exponential(h);
            // the first term left out, with room for those after it, and rounding
            let bound = 1.2 * h.powi(8) / 2_027_025.0 * h.exp() + 4.0 * f64::EPSILON;
            for i in 0..=20 {
                let x = -1.0 + 0.1 * f64::from(i);
                let p = polynomials(x);
                assert!((dot(&e.plain, &p) - (-h * x).exp()).abs() < bound, "{h} {x}");
                // x P_7 reaches degree 8: 8/15 of the coefficient 15 h⁷/15!! is cut
                let wide = 1.2 * 8.0 * h.powi(7) / 2_027_025.0 * h.exp() + 4.0 * f64::EPSILON;
                assert!((dot(&e.times_x, &p) - x * (-h * x).exp()).abs() < wide, "{h} {x}");
            }
            assert!((e.first_less_one - (e.plain[0] - 1.0)).abs() <= 2.0 * f64::EPSILON);
        }
    }

    #[test]
    fn first_less_one_keeps_its_digits() {
        let h = 1e-7;
        // sinh(h)/h - 1 = h²/6 + h⁴/120 ...
        assert!((exponential(h).first_less_one / (h * h / 6.0) - 1.0).abs() < 1e-14);
    }
}
