//! y_i → median of its neighbours, where |y_i - median| > 6 · scale: rare large samples taken out
//!
//! The rule of [`crate::gap::rest::prepare::outliers`]; here it runs over some eighty recordings, so that the scale comes from every 16th row
//! and medians are taken only next to large differences.

use crate::math::NORMAL_975;
use crate::math::robust::{mad_std, median, quantile};

/// Robust standard deviations beyond which a sample is taken out.
const LIMIT: f64 = 6.0;
/// A sample beyond the limit differs from a neighbour by this many.
const NEAR: f64 = 3.0;
/// Neighbours on each side.
const SIDE: usize = 4;
/// Every so many rows stand for the scale.
const STRIDE: usize = 16;

/// `y` without its rare large samples; missing ones stay missing.
pub(super) fn without_outliers(y: &[f64]) -> Vec<f64> {
    let mut around = Vec::with_capacity(2 * SIDE + 1);
    let mut centre = |i: usize| {
        around.clear();
        let near = &y[i.saturating_sub(SIDE)..(i + SIDE + 1).min(y.len())];
        around.extend(near.iter().copied().filter(|v| v.is_finite()));
        median(&mut around)
    };
    let mut off: Vec<f64> = (0..y.len()).step_by(STRIDE).map(|i| y[i] - centre(i)).filter(|v| v.is_finite()).collect();
    let squares: f64 = off.iter().map(|v| v * v).sum();
    let spread = (squares / off.len().max(1) as f64).sqrt();
    let mut sizes: Vec<f64> = off.iter().map(|v| v.abs()).collect();
    let upper = if sizes.is_empty() { 0.0 } else { quantile(&mut sizes, 0.95) / NORMAL_975 };
    // NaN where there is nothing: the maximum takes the other
    let robust = mad_std(&mut off, 0.0).max(upper);
    // on a coarse lattice most deviations are zero, and the scale of the rest is what counts
    let scale = if robust < 0.2 * spread { spread } else { robust };
    let mut out = y.to_vec();
    for i in 0..y.len() {
        let far = |j: Option<usize>| j.and_then(|j| y.get(j)).is_some_and(|v| (v - y[i]).abs() > NEAR * scale);
        if far(i.checked_sub(1)) || far(Some(i + 1)) {
            let centre = centre(i);
            if (y[i] - centre).abs() > LIMIT * scale {
                out[i] = centre;
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gap::rest::prepare::outliers::clean;
    use crate::math::random::Stream;

    #[test]
    fn it_takes_out_what_the_slow_rule_does() {
        let mut draw = Stream::new(2, 0);
        let mut y: Vec<f64> = (0..20_000).map(|_| draw.normal()).collect();
        for i in (500..20_000).step_by(700) {
            y[i] += if i % 3 == 0 { 15.0 } else { -11.0 };
        }
        let (slow, rows) = clean(&y);
        let fast = without_outliers(&y);
        assert!(rows.len() >= 28);
        let differ = slow.iter().zip(&fast).filter(|(a, b)| a != b).count();
        // the scale from a sixteenth of the rows is off by 3 %: samples at the very limit may fall either way
        assert!(differ <= 1, "{differ}");
        y[100] = f64::NAN;
        assert!(without_outliers(&y)[100].is_nan() && without_outliers(&y)[101] == fast[101]);
        assert!(without_outliers(&[]).is_empty());
    }
}
