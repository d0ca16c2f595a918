//! z ~ N(X β, diag S), β ~ N(0, diag P): ln p(z) = -½ [Σ ln 2πS + Σ z²/S - bᵀ A⁻¹ b + ln det A + ln det P]
//!
//! with A = P⁻¹ + Xᵀ S⁻¹ X and b = Xᵀ S⁻¹ z: coefficients are integrated out exactly.

use super::frame::{ColumnId, Data, Frame};
use std::collections::HashMap;
use std::f64::consts::TAU;
use std::rc::Rc;

/// The likelihood at one set of columns and spectrum.
#[derive(Debug, Clone)]
pub struct Posterior {
    /// ln p(z), coefficients integrated out.
    pub log_marginal: f64,
    /// Posterior means of the coefficients.
    pub mean: Vec<f64>,
    /// Their covariance, row by row.
    pub covariance: Vec<f64>,
}

/// Columns picked for repeated evaluation: what they have in common with each other and the recording.
pub struct Picked {
    gram: Vec<Rc<Vec<f64>>>,
    data: Vec<Rc<Vec<f64>>>,
}

/// Products of columns with the recording, kept.
#[derive(Default)]
pub struct DataProducts(std::cell::RefCell<HashMap<ColumnId, Rc<Vec<f64>>>>);

impl DataProducts {
    fn get(&self, frame: &Frame, data: &Data, column: ColumnId) -> Rc<Vec<f64>> {
        Rc::clone(self.0.borrow_mut().entry(column).or_insert_with(|| Rc::new(frame.with_data(column, data))))
    }
}

impl Picked {
    /// Picks `columns`.
    pub fn new(frame: &Frame, data: &Data, products: &DataProducts, columns: impl Iterator<Item = ColumnId>) -> Self {
        let ids: Vec<_> = columns.collect();
        let mut gram = Vec::with_capacity(ids.len() * (ids.len() + 1) / 2);
        for (i, a) in ids.iter().enumerate() {
            gram.extend(ids[..=i].iter().map(|b| frame.gram(*a, *b)));
        }
        let data = ids.iter().map(|c| products.get(frame, data, *c)).collect();
        Self { gram, data }
    }

    /// XᵀS⁻¹X, lower triangle row by row, and XᵀS⁻¹z.
    pub fn normal(&self, inverse_spectrum: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let sum = |products: &Rc<Vec<f64>>| products.iter().zip(inverse_spectrum).map(|(g, w)| g * w).sum::<f64>();
        (self.gram.iter().map(sum).collect(), self.data.iter().map(sum).collect())
    }
}

/// The part of the likelihood that the spectrum alone decides: -½ Σ [n ln 2πS + power/S].
pub fn spectral(count: &[f64], power: &[f64], spectrum: &[f64]) -> f64 {
    let terms = count.iter().zip(power).zip(spectrum);
    -0.5 * terms.map(|((n, p), s)| n * (TAU * s).ln() + p / s).sum::<f64>()
}

/// What the columns add to [`spectral`], coefficients integrated out; none where the matrix is not definite.
pub fn columns(picked: &Picked, std: &[f64], inverse_spectrum: &[f64], full: bool) -> Option<Posterior> {
    solve(&picked.normal(inverse_spectrum), std, full)
}

/// The same from the normal matrix (lower triangle row by row) and right-hand side.
pub fn solve((gram, b): &(Vec<f64>, Vec<f64>), std: &[f64], full: bool) -> Option<Posterior> {
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
