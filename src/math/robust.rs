//! Location and scale that a minority of wild values cannot move.

use std::borrow::Cow;

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

/// `values`, or of more than `most` about as many: stretches of neighbours, evenly spread, that show noise, jitter and drift
/// alike.
#[must_use]
pub fn stretches(values: &[f64], most: usize) -> Cow<'_, [f64]> {
    const STRETCHES: usize = 64;
    if values.len() <= most.max(STRETCHES) {
        return Cow::Borrowed(values);
    }
    let length = most.div_ceil(STRETCHES).max(1);
    let last = values.len() - length;
    let start = |k: usize| (last as f64 * k as f64 / (STRETCHES - 1) as f64) as usize;
    (0..STRETCHES).flat_map(|k| &values[start(k)..start(k) + length]).copied().collect()
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
    fn stretches_reach_from_end_to_end() {
        let x: Vec<f64> = (0..100_000).map(f64::from).collect();
        assert_eq!(stretches(&x, 100_000), x);
        let few = stretches(&x, 6400);
        assert_eq!((few.len(), few[0], few[6399]), (6400, 0.0, 99_999.0));
        // neighbours all of the time
        assert_eq!(few.windows(2).filter(|w| w[1] - w[0] == 1.0).count(), 64 * 99);
        assert_eq!(stretches(&x[..64], 1), &x[..64]);
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
