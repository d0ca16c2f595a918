//! Errors against the log's reference pose, and NEES = dᵀ (P + R)⁻¹ d, chi-squared with 3 degrees of freedom
//!
//! The reference is a measurement of its own with noise R; where the filter did not use it, d = estimate - reference has
//! the covariance P + R. NEES of one run are correlated in time: the value at the end is one draw, the mean is not to be
//! held against bounds for independent ones.

use super::consistency::chi_squared_interval95;
use super::wrap_angle;
use crate::config::Pose;
use crate::signal::{Log, names};
use nalgebra::{Matrix3, Vector3};
use serde::Serialize;

/// How far the estimate is from the reference.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ReferenceErrors {
    /// Reference poses compared.
    pub samples: u64,
    /// Root mean square distance, m.
    pub position_rms_m: f64,
    /// Distance at the last reference pose, m.
    pub position_end_m: f64,
    /// Root mean square heading error, rad.
    pub heading_rms_rad: f64,
    /// Heading error (estimate minus reference, wrapped) at the last reference pose, rad.
    pub heading_end_rad: f64,
    /// Mean NEES of (x, y, θ); expected: 3. Absent where the estimate has no covariance.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nees_mean: Option<f64>,
    /// NEES of (x, y, θ) at the last reference pose.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nees_end: Option<f64>,
    /// 95 % interval of `nees_end`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nees_end_bounds95: Option<[f64; 2]>,
    /// Heading error at the last reference pose, squared, over its variance; expected: 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub heading_nees_end: Option<f64>,
}

/// The reference columns of a log.
pub(super) struct Reference<'a> {
    columns: [&'a [f64]; 3],
    noise: Matrix3<f64>,
}

impl<'a> Reference<'a> {
    /// `None` if the log lacks one of the three columns, or all are empty.
    pub fn new(log: &'a Log, pose: Option<&Pose>) -> Option<Self> {
        let columns = [log.get(names::X)?, log.get(names::Y)?, log.get(names::HEADING)?];
        let std = pose.map_or([0.0; 3], |p| [p.position_std_m, p.position_std_m, p.heading_std_rad]);
        let noise = Matrix3::from_diagonal(&Vector3::from(std.map(|s| s * s)));
        let reference = Self { columns, noise };
        (0..log.len()).any(|k| reference.at(k).is_some()).then_some(reference)
    }

    /// The pose of row `k`, if it is whole.
    pub fn at(&self, k: usize) -> Option<[f64; 3]> {
        let pose = self.columns.map(|c| c[k]);
        pose.iter().all(|v| v.is_finite()).then_some(pose)
    }

    /// The first pose and its row.
    pub fn first(&self) -> Option<(usize, [f64; 3])> {
        (0..self.columns[0].len()).find_map(|k| Some((k, self.at(k)?)))
    }
}

/// Sums of errors along a run.
#[derive(Debug, Default)]
pub(super) struct ErrorSums {
    samples: u64,
    position: f64,
    heading: f64,
    nees: Option<f64>,
    last: Option<Last>,
}

#[derive(Debug)]
struct Last {
    position_m: f64,
    heading_rad: f64,
    nees: Option<[f64; 2]>,
}

impl ErrorSums {
    /// Compares `estimate` (x, y, θ), with its covariance if there is one, with row `k`.
    pub fn add(&mut self, reference: &Reference<'_>, k: usize, estimate: [f64; 3], covariance: Option<Matrix3<f64>>) {
        let Some(pose) = reference.at(k) else { return };
        let d = Vector3::new(estimate[0] - pose[0], estimate[1] - pose[1], wrap_angle(estimate[2] - pose[2]));
        let nees = covariance.and_then(|p| {
            let total = p + reference.noise;
            let inverse = total.cholesky()?.inverse();
            Some([(d.transpose() * inverse * d)[0], d[2] * d[2] / total[(2, 2)]])
        });
        self.samples += 1;
        self.position += d[0] * d[0] + d[1] * d[1];
        self.heading += d[2] * d[2];
        if let Some([whole, _]) = nees {
            self.nees = Some(self.nees.unwrap_or(0.0) + whole);
        }
        self.last = Some(Last { position_m: d[0].hypot(d[1]), heading_rad: d[2], nees });
    }

    pub fn finish(self) -> Option<ReferenceErrors> {
        let last = self.last?;
        let n = self.samples as f64;
        Some(ReferenceErrors {
            samples: self.samples,
            position_rms_m: (self.position / n).sqrt(),
            position_end_m: last.position_m,
            heading_rms_rad: (self.heading / n).sqrt(),
            heading_end_rad: last.heading_rad,
            nees_mean: self.nees.map(|sum| sum / n),
            nees_end: last.nees.map(|v| v[0]),
            nees_end_bounds95: last.nees.map(|_| chi_squared_interval95(3.0)),
            heading_nees_end: last.nees.map(|v| v[1]),
        })
    }
}
