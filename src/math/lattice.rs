//! x = x0 + k q: the origin x0 and the step q of a lattice, from levels on it that may be rounded

use super::robust::quantile;

/// Origin and step of the lattice nearest to `levels` (ascending, distinct, in any unit), in their unit; none of fewer than three.
///
/// The lower quartile of their distances is q wherever neighbouring levels are both visited. Least squares on a stretch around the
/// middle, which doubles, sharpens it: the number k of a level must be certain before it is used.
#[must_use]
pub fn through(levels: &[f64]) -> Option<(f64, f64)> {
    if levels.len() < 3 {
        return None;
    }
    let mut distances: Vec<f64> = levels.windows(2).map(|w| w[1] - w[0]).collect();
    let mut q = quantile(&mut distances, 0.25);
    let x0 = levels[levels.len() / 2];
    let mut reach = 8.0;
    while reach < 1e7 {
        let (mut kk, mut kx) = (0.0, 0.0);
        for &x in levels {
            let k = ((x - x0) / q).round();
            if k.abs() <= reach {
                kk += k * k;
                kx += k * (x - x0);
            }
        }
        if kk == 0.0 {
            return None;
        }
        q = kx / kk;
        reach *= 2.0;
    }
    Some((x0, q))
}

/// Distance of `x` from the nearest point of the lattice, in steps.
#[must_use]
pub fn off((x0, q): (f64, f64), x: f64) -> f64 {
    let k = (x - x0) / q;
    (k - k.round()).abs()
}
