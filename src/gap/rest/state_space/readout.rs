//! p(y | past) = (1-p) p_cell(y; m, S) + p p_cell(y; m, S + A²): one reading, given mean m and variance S of what is
//! read
//!
//! For every readout the mean of the state moves by `shift` · P h, and its covariance loses `shrink` · P h hᵀ P.
//! With z = h'x + noise jointly Gaussian, E[x|y] = x̂ + P h (E[z|y] - m)/S and
//! Cov[x|y] = P - P h hᵀ P (S - Var[z|y])/S².

use super::quantization::Cell;
use super::{Outliers, StateSpaceModel};
use std::f64::consts::TAU;

/// Update by one reading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Told {
    /// ln p(y | past); with quantization, of the cell's probability over its width.
    pub log_density: f64,
    /// Factor of P h in the change of the mean.
    pub shift: f64,
    /// Factor of P h hᵀ P in the reduction of the covariance.
    pub shrink: f64,
}

/// Readout of the sensor: quantization and outliers.
#[derive(Debug, Clone, Copy)]
pub(super) struct Readout {
    lsb_rad_s: Option<f64>,
    outliers: Option<Outliers>,
}

impl Readout {
    pub(super) fn new(believed: &StateSpaceModel) -> Self {
        let outliers = believed.outliers.filter(|o| o.probability > 0.0);
        Self { lsb_rad_s: believed.lattice_lsb_rad_s, outliers }
    }

    /// Update by a reading that is `innovation` above its predicted mean, with predicted variance `variance`.
    #[inline]
    pub(super) fn read(&self, innovation: f64, variance: f64) -> Told {
        let usual = self.cell(innovation, variance);
        let Some(Outliers { probability, std_rad_s }) = self.outliers else {
            return usual;
        };
        let outlying = self.cell(innovation, variance + std_rad_s * std_rad_s);
        let (a, b) = ((-probability).ln_1p() + usual.log_density, probability.ln() + outlying.log_density);
        let log_density = a.max(b) + (-(a - b).abs()).exp().ln_1p();
        let (wa, wb) = ((a - log_density).exp(), (b - log_density).exp());
        // the mixture's moments: the spread of the two means adds variance along P h
        let apart = usual.shift - outlying.shift;
        Told {
            log_density,
            shift: wa * usual.shift + wb * outlying.shift,
            shrink: wa * usual.shrink + wb * outlying.shrink - wa * wb * apart * apart,
        }
    }

    #[inline]
    fn cell(&self, innovation: f64, variance: f64) -> Told {
        match self.lsb_rad_s {
            None => Told {
                log_density: -0.5 * ((TAU * variance).ln() + innovation * innovation / variance),
                shift: innovation / variance,
                shrink: variance.recip(),
            },
            Some(lsb) => {
                let std = variance.sqrt();
                let cell = Cell::new(innovation / std, 0.5 * lsb / std);
                Told {
                    log_density: cell.log_probability - lsb.ln(),
                    shift: cell.mean / std,
                    shrink: (1.0 - cell.variance) / variance,
                }
            }
        }
    }
}
