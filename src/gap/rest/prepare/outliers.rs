//! Rare large samples are taken out before anything Gaussian is judged: |y - median of the neighbours| over its scale

use crate::math::NORMAL_975;
use crate::math::robust::{mad_std, median, quantile};

/// Samples beyond this many robust standard deviations are put aside. A normal series of 10⁵ samples has 10⁻⁴ of them.
pub(crate) const LIMIT: f64 = 6.0;
/// Stretches of the series whose scale is their own, of so many samples at least.
const STRETCHES: usize = 64;
const SHORTEST: usize = 500;
/// Neighbours on each side.
const SIDE: usize = 4;

/// The series with its rare large samples replaced by the median of their neighbours, and which they were.
#[must_use]
pub(crate) fn clean(y: &[f64]) -> (Vec<f64>, Vec<usize>) {
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
    let spread = (off.iter().map(|v| v * v).sum::<f64>() / n.max(1) as f64).sqrt();
    let mut cleaned = y.to_vec();
    let mut rows = Vec::new();
    // noise that grows or fades has the scale of its own time
    let long = n.div_ceil(STRETCHES).max(SHORTEST).min(n.max(1));
    let count = (n / long).max(1);
    for k in 0..count {
        let range = k * n / count..(k + 1) * n / count;
        let off = &off[range.clone()];
        // a smooth series is its own median but at its turns: there the upper deviations tell the scale, and up to one
        // sample in twenty may be false
        let mut sizes: Vec<f64> = off.iter().map(|v| v.abs()).collect();
        let upper = quantile(&mut sizes, 0.95) / NORMAL_975;
        let scale = mad_std(&mut off.to_vec(), 0.0).max(upper).max(1e-300);
        // on a coarse lattice most deviations are zero, and the scale of the rest is what counts
        let scale = if scale < 0.2 * spread { spread } else { scale };
        for (i, v) in range.zip(off) {
            if v.abs() > LIMIT * scale {
                cleaned[i] = centre[i];
                rows.push(i);
            }
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
        // noise that grows to six times its size has none
        let grown: Vec<f64> = (0..20_000).map(|i| draw.normal() * (1.8 * f64::from(i) / 20_000.0).exp()).collect();
        assert!(clean(&grown).1.len() <= 2, "{}", clean(&grown).1.len());
    }
}
