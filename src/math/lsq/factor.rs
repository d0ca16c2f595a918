//! A D P = Q R: QR of the columns, scaled to unit length by D and pivoted by P.

use super::{dot, norm};
use crate::error::{Error, ErrorKind, Result};
use faer::Mat;

/// The factorisation of a tall matrix, cut at its numerical rank.
///
/// Source: Golub and Van Loan, Matrix Computations, 4th ed., sections 5.4.2 (column pivoting) and 5.3.4 (scaling).
#[derive(Debug, Clone)]
pub struct QrFactor {
    /// Orthonormal columns, `rank` of them, each as long as the data.
    q: Vec<Vec<f64>>,
    /// Upper triangle, `rank` by `rank`, by rows.
    r: Vec<Vec<f64>>,
    /// `order[k]`: which column stands at place k.
    order: Vec<usize>,
    /// Length of each column, 1 where the column is zero.
    scale: Vec<f64>,
    rows: usize,
}

impl QrFactor {
    /// Factors `columns`, all of the same length, no fewer rows than columns.
    ///
    /// The rank is the number of pivots above n ε times the first, n the number of rows.
    ///
    /// # Errors
    /// [`ErrorKind::Usage`] if there is no column or their lengths differ, [`ErrorKind::TooShort`] if there are fewer
    /// rows than columns, [`ErrorKind::Value`] if an entry is not finite.
    pub fn new(columns: &[Vec<f64>]) -> Result<Self> {
        const INPUT: &str = "least squares";
        let Some(first) = columns.first() else {
            return Err(Error::new(ErrorKind::Usage, INPUT, "no column to fit with"));
        };
        let (rows, cols) = (first.len(), columns.len());
        if let Some(j) = columns.iter().position(|c| c.len() != rows) {
            let found = format!("{} rows, the first column has {rows}", columns[j].len());
            return Err(Error::new(ErrorKind::Usage, INPUT, found).at(format!("column {}", j + 1)));
        }
        if rows < cols {
            let found = format!("{rows} samples for {cols} unknowns");
            return Err(Error::new(ErrorKind::TooShort, INPUT, found).hint("give more samples or fit fewer unknowns"));
        }
        let mut scale = Vec::with_capacity(cols);
        for (j, column) in columns.iter().enumerate() {
            if let Some(i) = column.iter().position(|v| !v.is_finite()) {
                let place = format!("column {}, row {}", j + 1, i + 1);
                return Err(Error::new(ErrorKind::Value, INPUT, format!("{} is not finite", column[i])).at(place));
            }
            let length = norm(column);
            if !length.is_finite() {
                let hint = "bring the data nearer to 1";
                return Err(Error::new(ErrorKind::Numeric, INPUT, "the length of a column overflows")
                    .at(format!("column {}", j + 1))
                    .hint(hint));
            }
            scale.push(if length > 0.0 { length } else { 1.0 });
        }
        let qr = Mat::from_fn(rows, cols, |i, j| columns[j][i] / scale[j]).col_piv_qr();
        let triangle = qr.thin_R();
        let limit = f64::EPSILON * (rows as f64) * triangle[(0, 0)].abs();
        let rank = (0..cols).take_while(|&k| triangle[(k, k)].abs() > limit).count();
        let thin = qr.compute_thin_Q();
        Ok(Self {
            q: (0..rank).map(|k| thin.col(k).iter().copied().collect()).collect(),
            r: (0..rank).map(|k| (0..rank).map(|l| if l < k { 0.0 } else { triangle[(k, l)] }).collect()).collect(),
            order: qr.P().arrays().0.to_vec(),
            scale,
            rows,
        })
    }

    /// Number of independent columns.
    #[must_use]
    pub fn rank(&self) -> usize {
        self.r.len()
    }

    /// Whether every column is independent of the others.
    #[must_use]
    pub fn full_rank(&self) -> bool {
        self.rank() == self.order.len()
    }

    /// Columns left out because they depend on the others, ascending.
    #[must_use]
    pub fn dropped(&self) -> Vec<usize> {
        let mut dropped = self.order[self.rank()..].to_vec();
        dropped.sort_unstable();
        dropped
    }

    /// Qᵀ v: the part of `v` that the columns span, in the orthonormal basis. Shorter by far than `v`.
    #[must_use]
    pub fn spanned(&self, v: &[f64]) -> Vec<f64> {
        self.q.iter().map(|q| dot(q, v)).collect()
    }

    /// Takes from `v` what the columns span: v ← (I - Q Qᵀ) v. Done twice, so that the result is orthogonal to rounding
    /// even where little of `v` is left (Giraud and Langou 2003).
    pub fn project_out(&self, v: &mut [f64]) {
        for _ in 0..2 {
            for q in &self.q {
                let part = dot(q, v);
                for (v, q) in v.iter_mut().zip(q) {
                    *v -= part * q;
                }
            }
        }
    }

    /// Least-squares coefficients of `y`, one a column, 0 for dropped columns.
    ///
    /// # Errors
    /// [`ErrorKind::Usage`] if `y` has another length, [`ErrorKind::Value`] if it holds a value that is not finite.
    pub fn solve(&self, y: &[f64]) -> Result<Vec<f64>> {
        const INPUT: &str = "least squares";
        if y.len() != self.rows {
            let found = format!("{} values for {} rows", y.len(), self.rows);
            return Err(Error::new(ErrorKind::Usage, INPUT, found));
        }
        if let Some(i) = y.iter().position(|v| !v.is_finite()) {
            let found = format!("{} is not finite", y[i]);
            return Err(Error::new(ErrorKind::Value, INPUT, found).at(format!("row {}", i + 1)));
        }
        Ok(self.solve_spanned(&self.spanned(y)))
    }

    /// Coefficients whose combination of the columns is Q `spanned`.
    #[must_use]
    pub fn solve_spanned(&self, spanned: &[f64]) -> Vec<f64> {
        let mut z = spanned.to_vec();
        for k in (0..self.rank()).rev() {
            let known: f64 = (k + 1..self.rank()).map(|l| self.r[k][l] * z[l]).sum();
            z[k] = (z[k] - known) / self.r[k][k];
        }
        let mut coefficients = vec![0.0; self.order.len()];
        for (k, z) in z.iter().enumerate() {
            coefficients[self.order[k]] = z / self.scale[self.order[k]];
        }
        coefficients
    }

    /// The vector in the span of the columns whose inner product with column `column` is 1 and with all others 0:
    /// that column of the transposed pseudo-inverse. Zero for a dropped column.
    #[must_use]
    pub fn dual(&self, column: usize) -> Vec<f64> {
        let mut dual = vec![0.0; self.rows];
        for (weight, q) in self.covariance_factor()[column].iter().zip(&self.q) {
            for (d, q) in dual.iter_mut().zip(q) {
                *d += weight * q;
            }
        }
        dual
    }

    /// F = D P R⁻¹ with (AᵀA)⁻¹ = F Fᵀ, one row a column of A.
    #[must_use]
    pub fn covariance_factor(&self) -> Vec<Vec<f64>> {
        let rank = self.rank();
        let mut factor = vec![vec![0.0; rank]; self.order.len()];
        for l in 0..rank {
            let mut unit = vec![0.0; rank];
            unit[l] = 1.0;
            for (row, value) in factor.iter_mut().zip(self.solve_spanned(&unit)) {
                row[l] = value;
            }
        }
        factor
    }

    /// (AᵀA)⁻¹ of the columns that were kept, zero in the others.
    #[must_use]
    pub fn inverse_normal(&self) -> Vec<Vec<f64>> {
        outer(&self.covariance_factor())
    }
}

/// F Fᵀ of a matrix given by rows.
pub(super) fn outer(rows: &[Vec<f64>]) -> Vec<Vec<f64>> {
    rows.iter().map(|a| rows.iter().map(|b| dot(a, b)).collect()).collect()
}
