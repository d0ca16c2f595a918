//! A series on its lattice of sample times: gaps become missing slots (NaN), and block means over them.

use super::log::TimeAxis;
use crate::math::random::Stream;

/// Intervals above this many median steps are gaps.
pub(crate) const GAP_STEPS: f64 = 1.5;

/// `values` in order, with NaN where samples are missing. Jitter does not matter: a slot is missing only where an
/// interval is longer than 1.5 median steps. Gaps take no more slots, all together, than there are samples.
#[must_use]
pub(crate) fn slots(time: &TimeAxis, values: &[f64]) -> Vec<f64> {
    let TimeAxis::Explicit(t) = time else { return values.to_vec() };
    let step = time.median_step_s();
    let mut out = Vec::with_capacity(values.len());
    let mut room = values.len();
    for (i, v) in values.iter().enumerate() {
        if i > 0 {
            let interval = (t[i] - t[i - 1]) / step;
            if interval > GAP_STEPS {
                let missing = ((interval.round() - 1.0).max(0.0) as usize).min(room);
                room -= missing;
                out.resize(out.len() + missing, f64::NAN);
            }
        }
        out.push(*v);
    }
    out
}

/// Means over blocks of `size` slots; NaN where fewer than half are there. A last, incomplete block is left out.
#[must_use]
pub(crate) fn block_means(slots: &[f64], size: usize) -> Vec<f64> {
    if size <= 1 {
        return slots.to_vec();
    }
    slots
        .chunks_exact(size)
        .map(|block| {
            let (sum, n) = block.iter().filter(|v| v.is_finite()).fold((0.0, 0usize), |(s, n), v| (s + v, n + 1));
            if 2 * n >= size { sum / n as f64 } else { f64::NAN }
        })
        .collect()
}

/// Fills missing `rows` (ascending) by a straight line between the means of their neighbours, plus white noise;
/// `neighbours` maps the length of a gap to the number of neighbours on each side.
pub(crate) fn fill(values: &mut [f64], rows: &[usize], noise_std: f64, neighbours: impl Fn(usize) -> usize) {
    let mut draw = Stream::new(values.len() as u64, 2);
    let known = values.to_vec();
    let mean = |range: std::ops::Range<usize>| {
        let near: Vec<f64> = known[range].iter().copied().filter(|v| v.is_finite()).collect();
        (!near.is_empty()).then(|| near.iter().sum::<f64>() / near.len() as f64)
    };
    let mut at = 0;
    while at < rows.len() {
        let first = rows[at];
        let mut last = first;
        while at + 1 < rows.len() && rows[at + 1] == last + 1 {
            at += 1;
            last = rows[at];
        }
        at += 1;
        let reach = neighbours(last + 1 - first);
        let before = mean(first.saturating_sub(reach)..first);
        let after = mean(last + 1..(last + 1 + reach).min(known.len()));
        let (a, b) = (before.or(after).unwrap_or(0.0), after.or(before).unwrap_or(0.0));
        for (i, value) in values[first..=last].iter_mut().enumerate() {
            let u = (i + 1) as f64 / (last - first + 2) as f64;
            *value = a + (b - a) * u + noise_std * draw.normal();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_become_missing_slots() {
        let time = TimeAxis::Explicit(vec![0.0, 1.01, 1.99, 5.0, 6.0]);
        let s = slots(&time, &[1.0, 2.0, 3.0, 4.0, 5.0]);
        assert_eq!(s.len(), 7);
        assert!(s[3].is_nan() && s[4].is_nan());
        assert_eq!(s[5], 4.0);
        let means = block_means(&s, 3);
        assert_eq!(means[0], 2.0);
        assert!(means[1].is_nan(), "one of three is too few");
    }

    #[test]
    fn a_pause_of_years_does_not_fill_the_memory() {
        let time = TimeAxis::Explicit(vec![0.0, 0.01, 0.02, 1e9]);
        assert!(slots(&time, &[1.0; 4]).len() <= 8);
    }
}
