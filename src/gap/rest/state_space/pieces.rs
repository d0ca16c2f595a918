//! N(β; m, σ²) ≈ Σ_i w_i N(β; m_i, s²), s small against the jumps that β is mistaken for
//!
//! A constant and a level look alike until the level changes. Collapsing each mode to one Gaussian then moves the constant
//! towards the other mode's at every row, as if it walked. Where the constant is known to well within a jump this is
//! harmless; so its prior is cut into pieces that are (a Gaussian sum: Alspach and Sorenson, IEEE Trans. Automatic Control 17
//! (1972) 439), each with its own modes, until the readings have made them one or refuted them.

use super::StateSpaceModel;
use super::hypothesis::Hypothesis;

/// Pieces at most.
const MOST_PIECES: f64 = 128.0;
/// Standard deviation of a piece, in jumps.
const NARROW: f64 = 0.25;
/// Distance of neighbouring pieces, in their standard deviations: the sum ripples by 1e-5.
const SPACING: f64 = 1.25;
/// A piece less probable than this is refuted.
const REFUTED: f64 = 1e-8;

/// How the prior of one coefficient is cut.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Pieces {
    /// Which coefficient.
    pub coefficient: usize,
    /// Mean of each piece.
    pub means: Vec<f64>,
    /// Weight of each piece; they add up to one.
    pub weights: Vec<f64>,
    /// Standard deviation of every piece.
    pub std: f64,
    /// Means closer than this may be taken for one.
    pub close: f64,
}

/// The cut that `believed` needs; none where the prior is narrow as it is, or nothing jumps.
pub(super) fn cut(believed: &StateSpaceModel) -> Option<Pieces> {
    let telegraph = believed.telegraph.map(|t| (t.levels_rad_s[1] - t.levels_rad_s[0]).abs());
    let step = believed.step.as_ref().map(|s| s.size_rad_s.abs());
    // an outlier may be mistaken for the constant within the noise
    let outliers = believed.outliers.filter(|o| o.probability > 0.0).map(|_| believed.white_std_rad_s / NARROW);
    let jump = [telegraph, step, outliers].into_iter().flatten().filter(|j| *j > 0.0).reduce(f64::min)?;
    let rms = |column: &[f64]| (column.iter().map(|x| x * x).sum::<f64>() / column.len().max(1) as f64).sqrt();
    let sizes: Vec<f64> = believed.coefficients.iter().map(|c| c.std * rms(&c.column)).collect();
    let coefficient = (0..sizes.len()).max_by(|a, b| sizes[*a].total_cmp(&sizes[*b]))?;
    let c = &believed.coefficients[coefficient];
    let unit = rms(&c.column);
    if !(sizes[coefficient] > NARROW * jump) {
        return None;
    }
    // eight standard deviations in all; pieces of half the prior's width still add up to it
    let std = (NARROW * jump / unit).max(8.0 * c.std / (SPACING * MOST_PIECES)).min(0.5 * c.std);
    let between = c.std * c.std - std * std;
    let half = (4.0 * c.std / (SPACING * std)).ceil() as i32;
    let offsets: Vec<f64> = (-half..=half).map(|i| SPACING * std * f64::from(i)).collect();
    let weights: Vec<f64> = offsets.iter().map(|d| (-0.5 * d * d / between).exp()).collect();
    let sum: f64 = weights.iter().sum();
    Some(Pieces {
        coefficient,
        means: offsets.iter().map(|d| c.mean + d).collect(),
        weights: weights.iter().map(|w| w / sum).collect(),
        std,
        close: 0.1 * jump / unit,
    })
}

impl Pieces {
    /// Drops what is refuted and joins neighbours that agree. `modes` holds `kinds` modes a piece; `stride` is that of P.
    pub(super) fn reduce(&self, modes: &mut Vec<Hypothesis>, weights: &mut Vec<f64>, kinds: usize, stride: usize) {
        let mut from = 0;
        while from < modes.len() {
            let weight: f64 = weights[from..from + kinds].iter().sum();
            if weight < REFUTED && modes.len() > kinds {
                modes.drain(from..from + kinds);
                weights.drain(from..from + kinds);
                continue;
            }
            if from > 0 && self.agree(&modes[from - kinds..from + kinds], kinds, stride) {
                for kind in 0..kinds {
                    let (a, b) = (from - kinds + kind, from + kind);
                    let sum = weights[a] + weights[b];
                    let share = if sum > 0.0 { weights[a] / sum } else { 1.0 };
                    let (low, high) = modes.split_at_mut(b);
                    low[a].join(&high[0], stride, share);
                    weights[a] = sum;
                }
                modes.drain(from..from + kinds);
                weights.drain(from..from + kinds);
                continue;
            }
            from += kinds;
        }
        let sum: f64 = weights.iter().sum();
        weights.iter_mut().for_each(|w| *w /= sum);
    }

    /// Whether two neighbours hold the same of the coefficient, mode by mode.
    fn agree(&self, both: &[Hypothesis], kinds: usize, stride: usize) -> bool {
        let (a, b) = both.split_at(kinds);
        let at = self.coefficient;
        a.iter().zip(b).all(|(a, b)| {
            let apart = (a.mean[at] - b.mean[at]).abs();
            let variance = a.covariance[at * (stride + 1)].max(b.covariance[at * (stride + 1)]);
            apart < self.close.max(0.5 * variance.sqrt())
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gap::rest::state_space::{Coefficient, Telegraph};

    #[test]
    fn the_pieces_add_up_to_the_prior() {
        let mut believed = StateSpaceModel::white(10, 0.1, 1.0);
        believed.telegraph = Some(Telegraph::centred(2.0, [1.0, 1.0]));
        assert_eq!(cut(&believed), None);
        for std in [0.1, 0.51, 0.7, 1.5, 30.0] {
            believed.coefficients = vec![Coefficient { column: vec![0.5; 10], mean: 3.0, std: 2.0 * std }];
            let Some(pieces) = cut(&believed) else {
                assert_eq!(std, 0.1);
                continue;
            };
            assert!(pieces.means.len() <= 131, "{}", pieces.means.len());
            let normal = |z: f64, s: f64| (-0.5 * (z / s).powi(2)).exp() / s;
            for z in [-2.5, -1.0, 0.0, 0.3, 2.0] {
                let beta = 3.0 + 2.0 * std * z;
                let sum: f64 =
                    pieces.means.iter().zip(&pieces.weights).map(|(m, w)| w * normal(beta - m, pieces.std)).sum();
                let truth = normal(z * 2.0 * std, 2.0 * std);
                assert!((sum / truth - 1.0).abs() < 2e-3, "{std} {z}: {sum} {truth}");
            }
        }
    }
}
