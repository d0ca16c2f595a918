//! The contract of an effect: the simulator and the diagnosis know it by this trait.

use super::about::{About, Parameters};
use super::explanation::{Explanation, InDrives};
#[cfg(test)]
use super::tried::Tried;
use crate::error::Result;
use crate::model::{GyroEffect, Scene};

/// An effect of the library.
pub trait Effect: Sync + Send {
    /// Description of the effect.
    fn about(&self) -> &'static About;

    /// Entry of the battery: what the tests of all effects try it with.
    #[cfg(test)]
    fn tried(&self) -> Tried;

    /// The effect at work in one recording. What is drawn anew in each run (the phase of a tone, the time of a step, a
    /// random path) comes from `seed`, unless `parameters` hold it.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Config`] if a parameter is missing, unknown or out of bounds, or the scene lacks the covariate.
    fn simulated(&self, parameters: &Parameters, scene: &Scene, seed: u64) -> Result<Box<dyn GyroEffect>>;

    /// How it enters the likelihood of a recording; none where this recording cannot show it (no such covariate).
    fn explanation(&self, scene: &Scene) -> Option<Explanation>;

    /// How it enters the likelihood of a drive, beside the effects of drives; none where drives are not searched for it.
    fn in_drives(&self) -> Option<InDrives> {
        None
    }

    /// Which equation of the nominal model it adds to, in words, with these parameters.
    fn deficient(&self, parameters: &Parameters) -> String {
        let _ = parameters;
        self.about().deficient.to_owned()
    }

    /// From which to which frequency it shows with these parameters, Hz; none where it is no matter of frequency.
    fn band_hz(&self, parameters: &Parameters, scene: &Scene) -> Option<[f64; 2]> {
        let _ = (parameters, scene);
        None
    }

    /// A recording that separates it from what looks alike; none where only a longer one does.
    fn separated_by(&self) -> Option<&'static str> {
        None
    }

    /// Values of parameters at which it changes nothing in this scene, where they are not the same everywhere
    /// ([`Parameter::null`](super::Parameter::null)).
    fn nominal(&self, scene: &Scene) -> Parameters {
        let _ = scene;
        Parameters::new()
    }
}
