//! Errors against the log's reference, and NEES = dᵀ (P + R)⁻¹ d, chi-squared with 3 degrees of freedom (2 without heading)
//!
//! The reference is a measurement of its own with noise R; where the filter did not use it, d = estimate - reference has
//! the covariance P + R. NEES of one run are correlated in time: the value at the end is one draw, the mean is not to be
//! held against bounds for independent ones.
//!
//! A reference of positions alone (GPS) lies in a frame that the filter does not know: the track is then laid on it
//! first ([`Alignment`]).

use super::Settings;
use super::align::Alignment;
use super::wrap_angle;
use crate::config::Pose;
use crate::error::{Error, ErrorKind, Result};
use crate::math::distributions::chi_squared_interval95;
use crate::signal::{Log, names};
use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};
use serde::Serialize;

/// How far the estimate is from the reference.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ReferenceErrors {
    /// Reference positions compared.
    pub samples: u64,
    /// Root mean square distance, m.
    pub position_rms_m: f64,
    /// Distance at the last reference position, m.
    pub position_end_m: f64,
    /// Root mean square heading error, rad. Absent where the reference has no heading, like what follows of headings.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub heading_rms_rad: Option<f64>,
    /// Heading error (estimate minus reference, wrapped) at the last reference heading, rad.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub heading_end_rad: Option<f64>,
    /// Mean NEES of (x, y, θ); expected: 3, without heading of (x, y): 2. Absent where the estimate has no covariance,
    /// or was aligned with the reference, whose error the covariance does not include.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nees_mean: Option<f64>,
    /// NEES at the last reference pose.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nees_end: Option<f64>,
    /// 95 % interval of `nees_end`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nees_end_bounds95: Option<[f64; 2]>,
    /// Heading error at the last reference pose, squared, over its variance; expected: 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub heading_nees_end: Option<f64>,
    /// Alignment with the reference before the comparison, if there was one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub alignment: Option<Alignment>,
}

/// The reference columns of a log.
pub(super) struct Reference<'a> {
    position: [&'a [f64]; 2],
    heading: Option<&'a [f64]>,
    std: [f64; 2],
}

/// The reference at one row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ReferencePose {
    pub position: [f64; 2],
    pub heading: Option<f64>,
}

impl<'a> Reference<'a> {
    /// `None` if the log lacks a column of the position, or no row has both. The heading counts where some row has it
    /// beside the position.
    pub(crate) fn new(log: &'a Log, pose: Option<&Pose>) -> Option<Self> {
        let position = [log.get(names::X)?, log.get(names::Y)?];
        let std = pose.map_or([0.0; 2], |p| [p.position_std_m, p.heading_std_rad]);
        let mut reference = Self { position, heading: log.get(names::HEADING), std };
        let rows = || (0..log.len()).filter_map(|k| reference.at(k));
        rows().next()?;
        if rows().all(|pose| pose.heading.is_none()) {
            reference.heading = None;
        }
        Some(reference)
    }

    /// Whether headings can be compared.
    pub(crate) fn has_heading(&self) -> bool {
        self.heading.is_some()
    }

    /// The reference at row `k`, if its position is there.
    pub(crate) fn at(&self, k: usize) -> Option<ReferencePose> {
        let position = self.position.map(|c| c[k]);
        let heading = self.heading.map(|c| c[k]).filter(|h| h.is_finite());
        position.iter().all(|v| v.is_finite()).then_some(ReferencePose { position, heading })
    }

    /// Steps below this may be its noise, m: three standard deviations of the difference of two positions.
    pub(crate) fn still_m(&self) -> f64 {
        3.0 * std::f64::consts::SQRT_2 * self.std[0]
    }

    /// The first position and its row.
    pub(crate) fn first(&self) -> Option<(usize, ReferencePose)> {
        (0..self.position[0].len()).find_map(|k| Some((k, self.at(k)?)))
    }

    /// The first whole pose, to start from.
    fn first_pose(&self) -> Option<[f64; 3]> {
        (0..self.position[0].len()).find_map(|k| {
            let pose = self.at(k)?;
            Some([pose.position[0], pose.position[1], pose.heading?])
        })
    }

    /// The share of the path over which a track is to be aligned with the reference; `None` where it is compared as it
    /// is.
    pub(crate) fn share(&self, settings: &Settings) -> Option<f64> {
        let default = (!self.has_heading()).then_some(Alignment::DEFAULT_SHARE);
        settings.align_share.or(default).filter(|share| *share > 0.0)
    }
}

/// The pose to start at, where the settings ask for the reference's.
///
/// # Errors
/// [`ErrorKind::Column`] if there is no reference with a heading; [`ErrorKind::Usage`] if the settings also ask for the
/// track to be laid on it, or the share is none.
pub(super) fn start(log: &Log, reference: Option<&Reference>, settings: &Settings) -> Result<Option<[f64; 3]>> {
    if let Some(share) = settings.align_share {
        if !(0.0..=1.0).contains(&share) {
            let found = format!("{share} is no share of the path between 0 and 1");
            return Err(Error::new(ErrorKind::Usage, "--align", found).hint("0.2 takes the first fifth"));
        }
        if settings.start_at_reference && share > 0.0 {
            return Err(Error::new(ErrorKind::Usage, "--align", "a track that starts at the reference lies on it")
                .hint("leave out --align or --start-at-reference"));
        }
    }
    if !settings.start_at_reference {
        return Ok(None);
    }
    let pose = reference.and_then(Reference::first_pose);
    pose.map(Some).ok_or_else(|| {
        let missing = if reference.is_some() { "heading" } else { "pose" };
        let found = format!("there is no reference {missing} to start at");
        Error::new(ErrorKind::Column, &log.source, found).hint("leave out --start-at-reference")
    })
}

/// Sums of errors along a run.
#[derive(Debug, Default)]
pub(super) struct ErrorSums {
    samples: u64,
    position: f64,
    position_end: f64,
    headings: u64,
    heading: f64,
    heading_end: f64,
    nees_samples: u64,
    nees: f64,
    nees_end: Option<Nees>,
}

#[derive(Debug, Clone, Copy)]
struct Nees {
    whole: f64,
    degrees: f64,
    heading: Option<f64>,
}

impl ErrorSums {
    /// Compares `estimate` (x, y, θ), with its covariance if there is one, with row `k`.
    pub(crate) fn add(
        &mut self,
        reference: &Reference<'_>,
        k: usize,
        estimate: [f64; 3],
        covariance: Option<Matrix3<f64>>,
    ) {
        let Some(pose) = reference.at(k) else { return };
        let d = Vector2::new(estimate[0] - pose.position[0], estimate[1] - pose.position[1]);
        self.samples += 1;
        self.position += d.norm_squared();
        self.position_end = d.norm();
        let turn = pose.heading.map(|heading| wrap_angle(estimate[2] - heading));
        if let Some(turn) = turn {
            self.headings += 1;
            self.heading += turn * turn;
            self.heading_end = turn;
        }
        if let Some(nees) = covariance.and_then(|p| nees(reference, d, turn, &p)) {
            self.nees_samples += 1;
            self.nees += nees.whole;
            self.nees_end = Some(nees);
        }
    }

    pub(crate) fn finish(self) -> Option<ReferenceErrors> {
        if self.samples == 0 {
            return None;
        }
        let heading = |value: f64| (self.headings > 0).then_some(value);
        Some(ReferenceErrors {
            samples: self.samples,
            position_rms_m: (self.position / self.samples as f64).sqrt(),
            position_end_m: self.position_end,
            heading_rms_rad: heading((self.heading / self.headings as f64).sqrt()),
            heading_end_rad: heading(self.heading_end),
            nees_mean: self.nees_end.map(|_| self.nees / self.nees_samples as f64),
            nees_end: self.nees_end.map(|n| n.whole),
            nees_end_bounds95: self.nees_end.map(|n| chi_squared_interval95(n.degrees)),
            heading_nees_end: self.nees_end.and_then(|n| n.heading),
            alignment: None,
        })
    }
}

/// NEES of a row: of the whole pose, or of the position where the reference has no headings.
fn nees(reference: &Reference, d: Vector2<f64>, turn: Option<f64>, p: &Matrix3<f64>) -> Option<Nees> {
    let [position, heading] = reference.std.map(|s| s * s);
    let Some(turn) = turn else {
        if reference.has_heading() {
            return None;
        }
        let total = p.fixed_view::<2, 2>(0, 0).into_owned() + Matrix2::from_diagonal_element(position);
        let whole = (d.transpose() * total.cholesky()?.inverse() * d)[0];
        return Some(Nees { whole, degrees: 2.0, heading: None });
    };
    let total = p + Matrix3::from_diagonal(&Vector3::new(position, position, heading));
    let d = Vector3::new(d[0], d[1], turn);
    let whole = (d.transpose() * total.cholesky()?.inverse() * d)[0];
    Some(Nees { whole, degrees: 3.0, heading: Some(turn * turn / total[(2, 2)]) })
}
