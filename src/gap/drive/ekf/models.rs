//! f, h at β, and moved from β by a step in each coordinate

use crate::effects::drive::Touches;
use crate::gap::drive::record::Record;
use crate::model::drive::DriveModel;

/// Models of one pass: at β, and moved by a step in each coordinate.
pub(crate) struct Models {
    /// Model at β.
    pub here: DriveModel,
    /// Moved models, by change and coordinate.
    pub beside: Vec<Vec<Beside>>,
}

/// The model moved from β by a step in one coordinate.
pub(crate) struct Beside {
    /// Moved model.
    pub model: DriveModel,
    /// Size of the step, in the coordinate's unit.
    pub step: f64,
    /// Equations that the coordinate changes.
    pub touches: Touches,
    /// For each of its effects, index of the effect with identical force in the model at β, whose force is reused;
    /// none: computed.
    pub known: Vec<Option<usize>>,
    /// Index of the coordinate's own effect, if on this robot it has the same shape as at β.
    pub own: Option<usize>,
}

impl Models {
    /// The nominal model: given effects alone.
    #[must_use]
    pub(crate) fn plain(record: &Record) -> Self {
        Self { here: record.model(Vec::new()), beside: Vec::new() }
    }
}
