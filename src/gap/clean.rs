//! Rare large samples are taken out before anything Gaussian is judged: |y - median of the neighbours| over its scale

use crate::math::NORMAL_975;
use crate::math::robust::{mad_std, median, quantile};

/// Samples beyond this many robust standard deviations are put aside. A normal series of 10⁵ samples has 10⁻⁴ of them.
const LIMIT: f64 = 6.0;
/// Neighbours on each side.
const SIDE: usize = 4;

/// The series with its rare large samples replaced by the median of their neighbours, and which they were.
#[must_use]
pub fn clean(y: &[f64]) -> (Vec<f64>, Vec<usize>) {
    let n = y.len();
    let mut around = Vec::with_capacity(2 * SIDE + 1);
    let centre: Vec<f64> = (0..n)
        .map(|i| {
            around.clear();
            around.extend_from_slice(&y[i.saturating_sub(SIDE)..(i + SIDE + 1).min(n)]);
            median(&mut around)
        })
        .collect();
    let off: Vec<f64> = y.iter().zip(&centre).map(|(a, b)| a - b).collect();
    // a smooth series is its own median but at its turns: there the upper deviations tell the scale, and up to one sample
    // in twenty may be false
    let mut sizes: Vec<f64> = off.iter().map(|v| v.abs()).collect();
    let upper = quantile(&mut sizes, 0.95) / NORMAL_975;
    let scale = mad_std(&mut off.clone(), 0.0).max(upper).max(1e-300);
    // on a coarse lattice most deviations are zero, and the scale of the rest is what counts
    let spread = (off.iter().map(|v| v * v).sum::<f64>() / n.max(1) as f64).sqrt();
    let scale = if scale < 0.2 * spread { spread } else { scale };
    let mut cleaned = y.to_vec();
    let mut rows = Vec::new();
    for i in 0..n {
        if off[i].abs() > LIMIT * scale {
            cleaned[i] = centre[i];
            rows.push(i);
        }
    }
    (cleaned, rows)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Stream;

    #[test]
    fn a_smooth_series_has_no_outliers_and_noise_keeps_its_own() {
        let mut draw = Stream::new(2, 0);
        // two poles at a twentieth of the sample rate
        let (mut a, mut b) = (0.0, 0.0);
        let smooth: Vec<f64> = (0..20_000)
            .map(|_| {
                a += 0.27 * (draw.normal() - a);
                b += 0.27 * (a - b);
                b
            })
            .collect();
        assert!(clean(&smooth).1.len() <= 2, "{}", clean(&smooth).1.len());
        let mut noise: Vec<f64> = (0..20_000).map(|_| draw.normal()).collect();
        let rows: Vec<usize> = (1..200).map(|k| 97 * k).collect();
        rows.iter().for_each(|r| noise[*r] += 15.0);
        assert_eq!(clean(&noise).1, rows);
    }
}
