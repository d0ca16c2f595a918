//! ξ' = f(ξ) + g(ξ), g the `[[effect]]` tables of the nominal simulator: given effects, which are no findings
//!
//! A simulator that a diagnosis has augmented is a nominal simulator like any other. Effects that are found beside
//! given ones add to them: a radius 1 % larger than one that is given as 2 % larger.

use crate::effects::drive::ModelChange;
use crate::model::drive::DriveEffect;
use std::fmt;
use std::sync::Arc;

/// Effects that the nominal simulator holds.
#[derive(Clone, Default)]
pub(crate) struct Given {
    /// Changes of the equations, with their coordinates.
    changes: Arc<[(&'static dyn ModelChange, Vec<f64>)]>,
    /// Quantization step of the wheels, rad/s.
    pub wheel_lsb_rad_s: Option<f64>,
}

impl fmt::Debug for Given {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let coordinates: Vec<&Vec<f64>> = self.changes.iter().map(|c| &c.1).collect();
        f.debug_struct("Given")
            .field("coordinates", &coordinates)
            .field("wheel_lsb_rad_s", &self.wheel_lsb_rad_s)
            .finish()
    }
}

impl Given {
    /// `changes` of the equations with their coordinates, and a quantization step of the wheels, rad/s.
    #[must_use]
    pub(crate) fn new(changes: Vec<(&'static dyn ModelChange, Vec<f64>)>, wheel_lsb_rad_s: Option<f64>) -> Self {
        Self { changes: changes.into(), wheel_lsb_rad_s }
    }

    /// The effects at their coordinates.
    pub(crate) fn effects(&self) -> impl Iterator<Item = Box<dyn DriveEffect>> + '_ {
        self.changes.iter().map(|(change, theta)| change.at(theta))
    }

    /// Number of changes of the equations.
    #[must_use]
    pub(crate) fn len(&self) -> usize {
        self.changes.len()
    }
}
