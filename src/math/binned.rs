//! z ~ N(X β, diag S), β ~ N(0, diag P): ln p(z) = -½ [Σ ln 2πS + Σ z²/S - bᵀ A⁻¹ b + ln det A + ln det P]
//!
//! with A = P⁻¹ + Xᵀ S⁻¹ X and b = Xᵀ S⁻¹ z: coefficients are integrated out exactly. z are cosine coefficients
//! ([`super::dct`]), taken together in bins of frequency: under any smooth spectrum S a likelihood then costs a few hundred
//! products, whatever the length of the series.

use super::dct::Cosine;
use std::f64::consts::{PI, TAU};

/// Coefficients that have a bin of their own.
const SINGLE: usize = 64;
/// Width of a bin, relative to its frequency.
const WIDTH: f64 = 0.04;

/// Into how many parts a bin is split, of how many coefficients at least.
const PARTS: usize = 8;
const FEWEST: usize = 8;
/// A bin is split where a part of it has more power than all of it by so many standard deviations.
const UNLIKE: f64 = 7.0;
/// Most bins that splitting adds.
const MOST_MORE: usize = 256;

/// Bins of cosine coefficients.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Bins {
    /// Bin b holds the coefficients `edges[b]..edges[b+1]`.
    pub edges: Vec<usize>,
    /// Angular frequency of each bin, rad/sample.
    pub omega: Vec<f64>,
    /// Coefficients in each bin.
    pub count: Vec<f64>,
    /// Bins that hold the slow part.
    pub low: usize,
}

impl Bins {
    /// Bins of `len` coefficients; the lowest `low_len` end with a bin.
    #[must_use]
    pub(crate) fn new(len: usize, low_len: usize) -> Self {
        Self::no_wider(len, low_len, len.max(1))
    }

    /// The same with at most `most` coefficients in a bin.
    #[must_use]
    pub(crate) fn no_wider(len: usize, low_len: usize, most: usize) -> Self {
        let mut edges: Vec<usize> = (0..=SINGLE.min(low_len)).collect();
        let mut low = edges.len() - 1;
        while edges[edges.len() - 1] < len {
            let from = edges[edges.len() - 1];
            let to = from + ((from as f64 * WIDTH) as usize).min(most).max(1);
            // the slow part ends with a bin
            let to = if from < low_len { to.min(low_len) } else { to };
            edges.push(to.min(len));
            if to <= low_len {
                low = edges.len() - 1;
            }
        }
        Self::of(edges, low)
    }

    fn of(edges: Vec<usize>, low: usize) -> Self {
        let len = edges.last().copied().unwrap_or(1);
        // the mean coefficient is where a random walk's would be: half a step above zero
        let omega = |k0: usize, k1: usize| if k0 == 0 { 0.5 * PI } else { 0.5 * (k0 + k1 - 1) as f64 * PI };
        Self {
            omega: edges.windows(2).map(|e| omega(e[0], e[1]) / len as f64).collect(),
            count: edges.windows(2).map(|e| (e[1] - e[0]) as f64).collect(),
            low,
            edges,
        }
    }

    /// The same with narrower bins where the power of the coefficients `z` varies within one: a narrow band is no smooth
    /// spectrum.
    #[must_use]
    pub(crate) fn resolving(&self, z: &[f64]) -> Self {
        let mut edges = vec![0];
        let mut waiting: Vec<[usize; 2]> = self.edges.windows(2).map(|e| [e[0], e[1]]).rev().collect();
        let mut more = MOST_MORE;
        while let Some([from, to]) = waiting.pop() {
            let parts: Vec<[usize; 2]> =
                (0..PARTS).map(|k| [from + k * (to - from) / PARTS, from + (k + 1) * (to - from) / PARTS]).collect();
            let mean = |[a, b]: &[usize; 2]| z[*a..*b].iter().map(|v| v * v).sum::<f64>() / (b - a).max(1) as f64;
            // squares of normal deviates: the mean of m of them scatters by √(2/m)
            let scatter = (2.0 * PARTS as f64 / (to - from) as f64).sqrt();
            let largest = parts.iter().map(mean).fold(0.0, f64::max);
            let split = to - from >= PARTS * FEWEST && largest > (1.0 + UNLIKE * scatter) * mean(&[from, to]);
            if split && more >= PARTS {
                more -= PARTS;
                waiting.extend(parts.into_iter().rev());
            } else {
                edges.push(to);
            }
        }
        let low_len = self.edges[self.low];
        let low = edges.iter().position(|e| *e == low_len).unwrap_or(self.low);
        Self::of(edges, low)
    }

    /// Number of bins.
    #[must_use]
    pub(crate) fn len(&self) -> usize {
        self.count.len()
    }

    /// From where to where each bin reaches, rad/sample.
    pub(crate) fn bands(&self) -> impl Iterator<Item = [f64; 2]> + '_ {
        let len = self.edges.last().copied().unwrap_or(1) as f64;
        // a coefficient stands for half a step on each side
        let at = move |k: usize| (k as f64 - 0.5).max(0.0) * PI / len;
        self.edges.windows(2).map(move |e| [at(e[0]), at(e[1])])
    }

    /// Σ z² over each bin.
    #[must_use]
    pub(crate) fn power(&self, z: &[f64]) -> Vec<f64> {
        self.edges.windows(2).map(|e| z[e[0]..e[1]].iter().map(|v| v * v).sum()).collect()
    }

    /// Σ a b over each bin, as far as both reach.
    #[must_use]
    pub(crate) fn products(&self, a: &[f64], b: &[f64]) -> Vec<f64> {
        let reach = a.len().min(b.len());
        (0..self.len())
            .take_while(|i| self.edges[i + 1] <= reach)
            .map(|i| {
                let range = self.edges[i]..self.edges[i + 1];
                a[range.clone()].iter().zip(&b[range]).map(|(x, y)| x * y).sum()
            })
            .collect()
    }
}

/// The lowest cosine coefficients of a series that is smooth within blocks, from its block means.
pub(crate) struct BlockCosine {
    cosine: Cosine,
    /// Factor from a block mean's coefficient to the series'.
    gain: Vec<f64>,
}

impl BlockCosine {
    /// For `blocks` means over `block` samples each.
    #[must_use]
    pub(crate) fn new(blocks: usize, block: usize) -> Self {
        let len = blocks * block;
        let half = |k: usize| PI * k as f64 / (2.0 * len as f64);
        let gain = |k: usize| if k == 0 { block as f64 } else { (half(k) * block as f64).sin() / half(k).sin() };
        Self {
            cosine: Cosine::new(blocks),
            // orthonormal on both sides: √(blocks/len) = 1/√block
            gain: (0..blocks).map(|k| gain(k) / (block as f64).sqrt()).collect(),
        }
    }

    /// The first coefficients of the series, as many as there are blocks.
    #[must_use]
    pub(crate) fn forward(&self, block_means: &[f64]) -> Vec<f64> {
        let mut low = self.cosine.forward(block_means);
        low.iter_mut().zip(&self.gain).for_each(|(c, g)| *c *= g);
        low
    }
}

/// The likelihood at one set of columns and spectrum.
#[derive(Debug, Clone)]
pub(crate) struct Posterior {
    /// ln p(z), coefficients integrated out.
    pub log_marginal: f64,
    /// Posterior means of the coefficients.
    pub mean: Vec<f64>,
    /// Their covariance, row by row.
    pub covariance: Vec<f64>,
}

/// The part of the likelihood that the spectrum alone decides: -½ Σ [n ln 2πS + power/S].
#[must_use]
pub(crate) fn spectral(count: &[f64], power: &[f64], spectrum: &[f64]) -> f64 {
    let terms = count.iter().zip(power).zip(spectrum);
    -0.5 * terms.map(|((n, p), s)| n * (TAU * s).ln() + p / s).sum::<f64>()
}

/// Increase of [`spectral`] by columns whose coefficients are integrated out, and with `full` the posterior of these.
/// From the normal matrix XᵀS⁻¹X (lower triangle row by row) and XᵀS⁻¹z; `std` are the prior standard deviations of the
/// coefficients. None where the matrix is not definite.
#[must_use]
pub(crate) fn solve((gram, b): &(Vec<f64>, Vec<f64>), std: &[f64], full: bool) -> Option<Posterior> {
    let p = b.len();
    // scaled by the prior: B = I + P½ XᵀS⁻¹X P½ is well conditioned
    let mut factor = vec![0.0; p * p];
    let mut at = 0;
    for i in 0..p {
        for j in 0..=i {
            factor[i * p + j] = gram[at] * std[i] * std[j] + f64::from(u8::from(i == j));
            at += 1;
        }
    }
    let mut log_det = 0.0;
    for j in 0..p {
        for i in j..p {
            let dot: f64 = (0..j).map(|k| factor[i * p + k] * factor[j * p + k]).sum();
            let v = factor[i * p + j] - dot;
            if i == j {
                if !(v > 0.0) {
                    return None;
                }
                factor[j * p + j] = v.sqrt();
                log_det += v.ln();
            } else {
                factor[i * p + j] = v / factor[j * p + j];
            }
        }
    }
    let mut u = vec![0.0; p];
    for i in 0..p {
        let dot: f64 = (0..i).map(|k| factor[i * p + k] * u[k]).sum();
        u[i] = (b[i] * std[i] - dot) / factor[i * p + i];
    }
    let log_marginal = 0.5 * (u.iter().map(|v| v * v).sum::<f64>() - log_det);
    if !full {
        return Some(Posterior { log_marginal, mean: Vec::new(), covariance: Vec::new() });
    }
    // inverse of the factor, column by column
    let mut inverse = vec![0.0; p * p];
    for j in 0..p {
        inverse[j * p + j] = 1.0 / factor[j * p + j];
        for i in j + 1..p {
            let dot: f64 = (j..i).map(|k| factor[i * p + k] * inverse[k * p + j]).sum();
            inverse[i * p + j] = -dot / factor[i * p + i];
        }
    }
    let mut covariance = vec![0.0; p * p];
    let mut mean = vec![0.0; p];
    for i in 0..p {
        for j in 0..=i {
            let dot: f64 = (i..p).map(|k| inverse[k * p + i] * inverse[k * p + j]).sum();
            covariance[i * p + j] = dot * std[i] * std[j];
            covariance[j * p + i] = covariance[i * p + j];
        }
        mean[i] = std[i] * (i..p).map(|k| inverse[k * p + i] * u[k]).sum::<f64>();
    }
    Some(Posterior { log_marginal, mean, covariance })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn block_means_stand_for_a_smooth_series() {
        let (blocks, block) = (256, 16);
        let at = |i: usize| (-(i as f64) / 700.0).exp();
        let whole: Vec<f64> = (0..blocks * block).map(at).collect();
        let means: Vec<f64> = whole.chunks_exact(block).map(|c| c.iter().sum::<f64>() / block as f64).collect();
        let exact = Cosine::new(whole.len()).forward(&whole);
        let low = BlockCosine::new(blocks, block).forward(&means);
        let scale = exact.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        // a coefficient of the means holds the aliases of the series' own, 2·256 and more further up
        for (a, b) in low.iter().zip(&exact).take(64) {
            assert!((a - b).abs() < 1e-4 * scale, "{a} {b}");
        }
    }

    #[test]
    fn bins_are_split_where_a_narrow_band_stands_out_and_nowhere_else() {
        let mut draw = crate::math::random::Stream::new(5, 0);
        let (len, low) = (60_000, 2000);
        let bins = Bins::new(len, low);
        let mut z: Vec<f64> = (0..len).map(|_| draw.normal()).collect();
        assert_eq!(bins.resolving(&z), bins);
        (40_000..40_060).for_each(|k| z[k] *= 6.0);
        let fine = bins.resolving(&z);
        assert!(fine.edges[0] == 0 && fine.edges[fine.low] == low && fine.edges.is_sorted());
        assert_eq!(fine.count.iter().sum::<f64>(), len as f64);
        let around = |bins: &Bins| bins.edges.windows(2).find(|e| e[1] > 40_030).map_or(0, |e| e[1] - e[0]);
        assert!(around(&bins) > 1000 && around(&fine) < 60, "{} {}", around(&bins), around(&fine));
        assert!(fine.len() < bins.len() + 40);
    }

    #[test]
    fn integrating_a_coefficient_out_is_what_the_dense_density_says() {
        // two values, one column: ln N(z; 0, S + p x xᵀ) by its determinant and inverse
        let (z, x, s, p) = ([0.3, -1.2], [1.0, 0.5], [0.7, 1.9], 4.0);
        let (a, b, c) = (s[0] + p * x[0] * x[0], p * x[0] * x[1], s[1] + p * x[1] * x[1]);
        let det: f64 = a * c - b * b;
        let quadratic = (c * z[0] * z[0] - 2.0 * b * z[0] * z[1] + a * z[1] * z[1]) / det;
        let dense = -0.5 * (2.0 * TAU.ln() + det.ln() + quadratic);
        let gram = x[0] * x[0] / s[0] + x[1] * x[1] / s[1];
        let with = x[0] * z[0] / s[0] + x[1] * z[1] / s[1];
        let columns = solve(&(vec![gram], vec![with]), &[p.sqrt()], true).unwrap();
        let found = spectral(&[1.0, 1.0], &[z[0] * z[0], z[1] * z[1]], &s) + columns.log_marginal;
        assert!((found - dense).abs() < 1e-12, "{found} {dense}");
        assert!((columns.covariance[0] - 1.0 / (gram + 1.0 / p)).abs() < 1e-12);
    }
}
