//! x = x0 + k q: the origin x0 and the step q of a lattice, from levels on it that may be rounded

use super::robust::quantile;

/// Origin and step of the lattice nearest to `levels` (ascending, distinct, in any unit), in their unit; none of fewer than three.
///
/// The lower quartile of their distances is q wherever neighbouring levels are both visited. Least squares on a stretch around the
/// middle, which doubles, sharpens both: the number k of a level must be certain before it is used.
#[must_use]
pub(crate) fn through(levels: &[f64]) -> Option<(f64, f64)> {
    if levels.len() < 3 {
        return None;
    }
    let mut distances: Vec<f64> = levels.windows(2).map(|w| w[1] - w[0]).collect();
    let mut q = quantile(&mut distances, 0.25);
    let mut x0 = levels[levels.len() / 2];
    let mut reach = 8.0;
    while reach < 1e7 {
        let [mut n, mut k1, mut k2, mut x1, mut kx] = [0.0; 5];
        for &x in levels {
            let k = ((x - x0) / q).round();
            if k.abs() <= reach {
                let x = x - x0;
                (n, k1, k2, x1, kx) = (n + 1.0, k1 + k, k2 + k * k, x1 + x, kx + k * x);
            }
        }
        let spread = n * k2 - k1 * k1;
        if spread <= 0.0 {
            return None;
        }
        q = (n * kx - k1 * x1) / spread;
        x0 += (x1 - q * k1) / n;
        reach *= 2.0;
    }
    Some((x0, q))
}

/// Distance of `x` from the nearest point of the lattice, in steps.
#[must_use]
pub(crate) fn off((x0, q): (f64, f64), x: f64) -> f64 {
    let k = (x - x0) / q;
    (k - k.round()).abs()
}
