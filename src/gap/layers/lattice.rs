//! y ∈ { offset + k · lsb }: values on a lattice; ln p(y) = ln [Φ((y + lsb/2 - m)/σ) - Φ((y - lsb/2 - m)/σ)] - ln lsb

use statrs::function::erf::erfc;
use std::f64::consts::{SQRT_2, TAU};

/// Step of the lattice on which the values lie; none where they lie on none.
///
/// The step is the largest of which all differences are multiples: the smallest difference is a multiple of it, so it is
/// that or a small fraction of it.
#[must_use]
pub fn step(values: &[f64]) -> Option<f64> {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let largest = sorted.first()?.abs().max(sorted.last()?.abs());
    // differences below the rounding of the numbers themselves are none, and a file in single precision is no lattice
    let single = sorted.iter().all(|v| f64::from(*v as f32) == *v);
    let rounding = if single { f64::from(f32::EPSILON) } else { 4.0 * f64::EPSILON } * largest;
    let differences: Vec<f64> = sorted.windows(2).map(|w| w[1] - w[0]).filter(|d| *d > rounding).collect();
    if differences.len() < 2 || sorted.len() < 100 {
        return None;
    }
    let least = differences.iter().copied().fold(f64::INFINITY, f64::min);
    let on_lattice = |lsb: f64| {
        let tolerance = (4.0 * rounding / lsb).max(1e-6);
        tolerance < 0.02
            && differences.iter().all(|d| {
                let k = d / lsb;
                (k - k.round()).abs() <= tolerance + 1e-9 * k
            })
    };
    // neighbouring levels: what lies between them is rounding
    let least =
        differences.iter().copied().filter(|d| *d > 1.5 * least.min(rounding * 2.0)).fold(f64::INFINITY, f64::min);
    let exact = (1..=4).map(|q| least / f64::from(q)).find(|lsb| on_lattice(*lsb));
    let mut lsb = exact.or_else(|| rounded(&differences, sorted.len()))?;
    // sharpened by the whole range
    let span = sorted.last()? - sorted.first()?;
    let count = (span / lsb).round();
    if count >= 1.0 {
        lsb = span / count;
    }
    Some(lsb)
}

/// The step where a text file has rounded the values: few different ones, whose distances are multiples to a hundredth.
fn rounded(differences: &[f64], count: usize) -> Option<f64> {
    if 4 * differences.len() > count {
        return None;
    }
    let typical = crate::math::robust::quantile(&mut differences.to_vec(), 0.2);
    let near: Vec<f64> = differences.iter().copied().filter(|d| (d / typical - 1.0).abs() < 0.02).collect();
    let lsb = crate::math::robust::median(&mut near.clone());
    let fits = differences.iter().filter(|d| {
        let k = *d / lsb;
        k.round() >= 1.0 && (k - k.round()).abs() <= 0.01 + 1e-4 * k
    });
    (near.len() > 2 && fits.count() * 200 >= differences.len() * 199).then_some(lsb)
}

/// ln of the normal probability of [a, b].
fn ln_cell(a: f64, b: f64) -> f64 {
    // by the tail that does not cancel
    let (a, b) = if a + b > 0.0 { (a, b) } else { (-b, -a) };
    let p = 0.5 * (erfc(a / SQRT_2) - erfc(b / SQRT_2));
    if p > 0.0 { p.ln() } else { -0.5 * a * a - (a.max(1.0) * TAU.sqrt()).ln() }
}

/// Gain in log-likelihood of the lattice over a density of standard deviation `nominal`, given the deviations of the
/// values from what is predicted, in rad/s.
#[must_use]
pub fn gain(deviations: &[f64], lsb: f64, std: f64, nominal: f64) -> f64 {
    let one = |d: &f64| {
        let cell = ln_cell((d - 0.5 * lsb) / std, (d + 0.5 * lsb) / std) - lsb.ln();
        let density = -0.5 * ((d / nominal).powi(2) + (TAU * nominal * nominal).ln());
        cell - density
    };
    deviations.iter().map(one).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Stream;

    #[test]
    fn a_lattice_is_found_with_any_offset_and_noise_has_none() {
        let mut draw = Stream::new(1, 0);
        let noise: Vec<f64> = (0..2000).map(|_| 1e-3 * draw.normal()).collect();
        assert_eq!(step(&noise), None);
        for lsb in [1e-3, 1e-4, 3.3e-6] {
            let on: Vec<f64> = noise.iter().map(|v| 0.37 * lsb + (v / lsb).round() * lsb).collect();
            let found = step(&on).unwrap();
            assert!((found / lsb - 1.0).abs() < 1e-6, "{lsb}: {found}");
        }
        // as a text file with seven digits has it
        let lsb = 1.330_281e-4;
        let text = |v: f64| format!("{:.6e}", (v / lsb).round() * lsb).parse::<f64>().unwrap();
        let written: Vec<f64> = noise.iter().map(|v| text(v + 0.02)).collect();
        assert!((step(&written).unwrap() / lsb - 1.0).abs() < 1e-3);
    }
}
