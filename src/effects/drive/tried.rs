//! Entries of the battery: each effect of drives brings its own.

use crate::effects::about::Parameters;

/// A plain size of an effect, each parameter spelled as users know it, and the readings that it moves.
#[derive(Debug, Clone, Copy)]
pub struct Tried {
    /// The parameters that the effect requires, and no others.
    pub required: &'static [(&'static str, f64)],
    /// Parameters that may be left out.
    pub optional: &'static [(&'static str, f64)],
    /// Whether a replay of recorded torques differs in gyro, left wheel, right wheel, position, heading.
    pub moves: [bool; 5],
}

impl Tried {
    /// With an effect on the motion, and so on every reading.
    pub const fn motion(required: &'static [(&'static str, f64)]) -> Self {
        Self { required, optional: &[], moves: [true; 5] }
    }

    /// With an effect on the gyro alone.
    pub const fn gyro(required: &'static [(&'static str, f64)]) -> Self {
        Self { moves: [true, false, false, false, false], ..Self::motion(required) }
    }

    /// With an effect on the readings of both wheels.
    pub const fn wheels(required: &'static [(&'static str, f64)]) -> Self {
        Self { moves: [false, true, true, false, false], ..Self::motion(required) }
    }

    /// With an effect on position and heading as the external reference reads them.
    pub const fn pose(required: &'static [(&'static str, f64)]) -> Self {
        Self { moves: [false, false, false, true, true], ..Self::motion(required) }
    }

    /// All of them.
    pub fn parameters(&self) -> Parameters {
        self.required.iter().chain(self.optional).map(|(name, value)| ((*name).to_owned(), *value)).collect()
    }
}
