//! Location and scale that a minority of wild values cannot move.

use std::borrow::Cow;

/// Factor from the median absolute deviation to the standard deviation of a normal distribution, 1/Φ⁻¹(3/4).
pub(crate) const MAD_TO_STD: f64 = 1.482_602_218_505_602;

/// Variance of a second difference of white noise of variance one.
pub(crate) const SECOND_DIFFERENCE: f64 = 6.0;

/// Quantile `p` in 0..=1 of `values` by linear interpolation between order statistics (Hyndman and Fan's type 7);
/// NaN for an empty slice. May reorder the slice. Values are to be free of NaN.
#[must_use]
pub(crate) fn quantile(values: &mut [f64], p: f64) -> f64 {
    let n = values.len();
    if n == 0 {
        return f64::NAN;
    }
    let h = (n - 1) as f64 * p.clamp(0.0, 1.0);
    let below = h.floor() as usize;
    let (low, high) = if n < MANY { neighbours(values, below) } else { neighbours_of_many(values, below) };
    // no `low + (h - below) * (high - low)` where both are the same: infinities would make it NaN
    if h == h.floor() || high == low { low } else { low + (h - below as f64) * (high - low) }
}

/// From this many values on they are counted into bins first.
const MANY: usize = 4096;

/// The value at place `at` in the order of all, and the next one.
fn neighbours(values: &mut [f64], at: usize) -> (f64, f64) {
    let (_, &mut low, above) = values.select_nth_unstable_by(at, f64::total_cmp);
    (low, above.iter().copied().min_by(f64::total_cmp).unwrap_or(low))
}

/// The same of many: only those in the bins of the two are put in order.
fn neighbours_of_many(values: &[f64], at: usize) -> (f64, f64) {
    const BINS: usize = 2048;
    let (least, most) = values.iter().map(|v| order(*v)).fold((u64::MAX, 0), |(a, b), k| (a.min(k), b.max(k)));
    let shift = (u64::BITS - (most - least).leading_zeros()).saturating_sub(BINS.ilog2());
    let bin = |v: f64| ((order(v) - least) >> shift) as usize;
    let mut counts = [0_usize; BINS];
    values.iter().for_each(|v| counts[bin(*v) % BINS] += 1);
    let (mut first, mut before) = (0, 0);
    while before + counts[first] <= at {
        before += counts[first];
        first += 1;
    }
    let mut last = first;
    let mut up_to = before + counts[first];
    while up_to <= at + 1 && last + 1 < BINS {
        last += 1;
        up_to += counts[last];
    }
    let mut few: Vec<f64> = Vec::with_capacity(up_to - before);
    few.extend(values.iter().copied().filter(|v| (first..=last).contains(&bin(*v))));
    // values about zero differ in their exponents: most of them may lie in one bin
    let fewer = MANY <= few.len() && few.len() < values.len();
    if fewer { neighbours_of_many(&few, at - before) } else { neighbours(&mut few, at - before) }
}

/// Whole numbers in the order of [`f64::total_cmp`].
fn order(value: f64) -> u64 {
    let bits = value.to_bits();
    bits ^ ((bits as i64 >> 63) as u64 | 1 << 63)
}

/// The values in the order of [`f64::total_cmp`]: by one digit of their `order` after the other, the last one first.
#[must_use]
pub(crate) fn sorted(values: impl Iterator<Item = f64>) -> Vec<f64> {
    const DIGIT_BITS: u32 = 11;
    const DIGITS: usize = u64::BITS.div_ceil(DIGIT_BITS) as usize;
    let mut keys: Vec<u64> = values.map(order).collect();
    let digit = |key: u64, k: usize| (key >> (k as u32 * DIGIT_BITS)) as usize % (1 << DIGIT_BITS);
    let mut counts = vec![[0_usize; 1 << DIGIT_BITS]; DIGITS];
    keys.iter().for_each(|key| counts.iter_mut().enumerate().for_each(|(k, c)| c[digit(*key, k)] += 1));
    let mut other = vec![0; keys.len()];
    for (k, counts) in counts.iter_mut().enumerate() {
        // many a digit is the same in all: numbers of single precision end in zeros
        if counts.contains(&keys.len()) {
            continue;
        }
        let mut place = 0;
        counts.iter_mut().for_each(|count| place += std::mem::replace(count, place));
        for &key in &keys {
            let place = &mut counts[digit(key, k)];
            other[*place] = key;
            *place += 1;
        }
        std::mem::swap(&mut keys, &mut other);
    }
    // the way back from `order`
    keys.into_iter().map(|key| f64::from_bits(key ^ (((!key) as i64 >> 63) as u64 | 1 << 63))).collect()
}

/// Median of `values`; NaN for an empty slice. May reorder the slice.
#[must_use]
pub(crate) fn median(values: &mut [f64]) -> f64 {
    quantile(values, 0.5)
}

/// Standard deviation of the second differences of `series`, all alike, by their median size: of white noise it is √6 times that of the
/// values ([`SECOND_DIFFERENCE`]), and a slope does not matter. Zero where no series has three values.
#[must_use]
pub(crate) fn second_difference_std<'a>(series: impl IntoIterator<Item = &'a [f64]>) -> f64 {
    let bend = |w: &[f64]| w[0] - 2.0 * w[1] + w[2];
    let mut bends: Vec<f64> = series.into_iter().flat_map(|values| values.windows(3).map(bend)).collect();
    if bends.is_empty() { 0.0 } else { mad_std(&mut bends, 0.0) }
}

/// `values`, or of more than `most` about as many: stretches of neighbours, evenly spread, that show noise, jitter and drift
/// alike.
#[must_use]
pub(crate) fn stretches(values: &[f64], most: usize) -> Cow<'_, [f64]> {
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
pub(crate) fn mad_std(values: &mut [f64], centre: f64) -> f64 {
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
    fn many_values_have_the_quantiles_of_few() {
        let mut draw = Stream::new(2, 0);
        let n = 3 * MANY + 5;
        let normal: Vec<f64> = (0..n).map(|_| draw.normal()).collect();
        let steps: Vec<f64> = normal.iter().map(|x| 0.01 + 1e-9 * x.round()).collect();
        let wild: Vec<f64> = normal.iter().map(|x| (300.0 * x).exp() * x.signum()).collect();
        let mut odd = normal.clone();
        odd[..4].copy_from_slice(&[f64::INFINITY, f64::NEG_INFINITY, -0.0, 0.0]);
        let mut two = vec![-1.0; n];
        two[n / 2..].fill(1e300);
        for values in [normal, steps, wild, odd, two, vec![7.5; n]] {
            let mut expected = values.clone();
            expected.sort_unstable_by(f64::total_cmp);
            let sorted = sorted(values.iter().copied());
            assert!(sorted.iter().zip(&expected).all(|(a, b)| a.to_bits() == b.to_bits()));
            for at in [0, 1, n / 100, n / 2 - 1, n / 2, n - 2, n - 1] {
                let expected = (sorted[at], sorted[(at + 1).min(n - 1)]);
                let found = neighbours_of_many(&values, at);
                assert_eq!((found.0.to_bits(), found.1.to_bits()), (expected.0.to_bits(), expected.1.to_bits()));
                assert_eq!(neighbours(&mut values.clone(), at), found);
            }
        }
    }

    #[test]
    fn few_values_are_sorted_too() {
        assert!(sorted(std::iter::empty()).is_empty());
        assert_eq!(sorted([2.0, f64::NEG_INFINITY, -1e-300].into_iter()), [f64::NEG_INFINITY, -1e-300, 2.0]);
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
    fn second_differences_tell_the_noise_on_a_slope() {
        let mut draw = Stream::new(4, 9);
        let mut ramp =
            |std: f64| -> Vec<f64> { (0..20_000).map(|k| 0.3 * f64::from(k) + std * draw.normal()).collect() };
        let (a, b) = (ramp(2.0), ramp(2.0));
        let std = second_difference_std([a.as_slice(), &b]) / SECOND_DIFFERENCE.sqrt();
        // a median of 40 000 overlapping differences: relative standard deviation below 3/√n
        assert!((std / 2.0 - 1.0).abs() < 4.0 * 1.5 / 40_000f64.sqrt(), "{std}");
        assert_eq!(second_difference_std([&a[..2]]), 0.0);
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
