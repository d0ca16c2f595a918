//! θ' = θ'(θ): effects that leave every reading of some drives as another one does.

/// Coordinate of the equivalent effect as a function of x, that of the effect that is compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Map {
    /// x
    Same,
    /// 1/(1 + x) - 1
    Inverse,
    /// x/(1 + x), a share that is lost: no less than zero
    Loss,
}

/// Kinds of drives, by the channels that were not logged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Within {
    /// Nothing but gyro and wheels was logged.
    GyroAndWheels,
    /// Torques were not logged.
    NoTorques,
}

impl Map {
    /// The coordinate of the equivalent effect.
    #[must_use]
    pub(crate) fn value(self, x: f64) -> f64 {
        match self {
            Self::Same => x,
            Self::Inverse => -x / (1.0 + x),
            Self::Loss => x / (1.0 + x),
        }
    }

    /// |dθ'/dθ|
    #[must_use]
    pub(crate) fn slope(self, x: f64) -> f64 {
        if self == Self::Same { 1.0 } else { (1.0 + x).powi(-2) }
    }
}
