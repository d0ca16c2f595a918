//! Location and scale that a minority of wild values cannot move.

/// Factor from the median absolute deviation to the standard deviation of a normal distribution, 1/Φ⁻¹(3/4).
pub const MAD_TO_STD: f64 = 1.482_602_218_505_602;

/// Quantile `p` in 0..=1 of `values` by linear interpolation between order statistics (Hyndman and Fan's type 7);
/// NaN for an empty slice. Reorders the slice. Values are to be free of NaN.
#[must_use]
pub fn quantile(values: &mut [f64], p: f64) -> f64 {
    let n = values.len();
    if n == 0 {
        return f64::NAN;
    }
    let h = (n - 1) as f64 * p.clamp(0.0, 1.0);
    let below = h.floor() as usize;
    let (_, &mut low, above) = values.select_nth_unstable_by(below, f64::total_cmp);
    let high = above.iter().copied().min_by(f64::total_cmp).unwrap_or(low);
    // no `low + (h - below) * (high - low)` where both are the same: infinities would make it NaN
    if h == h.floor() || high == low { low } else { low + (h - below as f64) * (high - low) }
}

/// Median of `values`; NaN for an empty slice. Reorders the slice.
#[must_use]
pub fn median(values: &mut [f64]) -> f64 {
    quantile(values, 0.5)
}

/// Standard deviation by the median absolute deviation from `centre`, for values that are normal but for a minority
/// (Hampel 1974). Overwrites the slice.
#[must_use]
pub fn mad_std(values: &mut [f64], centre: f64) -> f64 {
    values.iter_mut().for_each(|x| *x = (*x - centre).abs());
    MAD_TO_STD * median(values)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Stream;

    #[test]
    fn quantiles_interpolate() {
        let mut x = vec![4.0, 1.0, 3.0, 2.0];
        assert_eq!(quantile(&mut x, 0.0), 1.0);
        assert_eq!(quantile(&mut x, 1.0), 4.0);
        assert_eq!(median(&mut x), 2.5);
        assert!(median(&mut []).is_nan());
    }

    #[test]
    fn a_tenth_of_wild_values_does_not_move_the_scale_far() {
        let n = 20_000;
        let mut s = Stream::new(1, 0);
        let mut x: Vec<f64> = (0..n).map(|i| if i % 10 == 0 { 1e6 } else { s.normal() }).collect();
        let centre = median(&mut x);
        // a tenth on one side: median at Φ⁻¹(0.5/0.9) = 0.14, scale at most a fifth too large
        assert!((centre - 0.1397).abs() < 0.05, "{centre}");
        let std = mad_std(&mut x, centre);
        assert!((1.0..1.25).contains(&std), "{std}");
    }
}
