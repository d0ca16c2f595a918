//! Orthonormal basis grown column by column (Gram-Schmidt, each column orthogonalised twice: twice is enough; Kahan,
//! in Parlett 1980).

/// Orthonormal columns of equal length.
#[derive(Debug, Clone, Default)]
pub(crate) struct Basis {
    /// The columns, each of unit length.
    pub columns: Vec<Vec<f64>>,
}

impl Basis {
    /// Direction of `column` outside the basis; `None` where only rounding is left of it.
    #[must_use]
    pub(crate) fn direction(&self, column: &[f64]) -> Option<Vec<f64>> {
        let mut v = column.to_vec();
        let norm = dot(&v, &v).sqrt();
        for _ in 0..2 {
            self.remove_from(&mut v);
        }
        let left = dot(&v, &v).sqrt();
        (left > 1e-9 * norm).then(|| v.iter().map(|x| x / left).collect())
    }

    /// Adds the direction of `column`, if it has one.
    pub(crate) fn push(&mut self, column: &[f64]) {
        self.columns.extend(self.direction(column));
    }

    /// Takes the basis' directions out of `v`.
    pub(crate) fn remove_from(&self, v: &mut [f64]) {
        for b in &self.columns {
            let along = dot(b, v);
            v.iter_mut().zip(b).for_each(|(v, b)| *v -= along * b);
        }
    }
}

/// Inner product. Partial sums of 256 keep the rounding error of long series near that of pairwise summation.
#[must_use]
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.chunks(256).zip(b.chunks(256)).map(|(a, b)| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_orthonormal_and_dependent_ones_left_out() {
        let column = |f: fn(f64) -> f64| (0..50).map(|i| f(f64::from(i) / 50.0)).collect::<Vec<f64>>();
        let mut basis = Basis::default();
        for c in [column(|_| 1.0), column(|x| x), column(|x| 1.0 + 1e-6 * x * x), column(|x| 3.0 - 2.0 * x)] {
            basis.push(&c);
        }
        assert_eq!(basis.columns.len(), 3, "the last is in the span of the first two");
        for (i, a) in basis.columns.iter().enumerate() {
            for (j, b) in basis.columns.iter().enumerate() {
                assert!((dot(a, b) - f64::from(u8::from(i == j))).abs() < 1e-14, "{i} {j}");
            }
        }
    }
}
