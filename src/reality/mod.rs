//! reading(t) = e(t) + Σ_i strength_i path_i(t) + σ · shaped white noise: recordings of real units, for trying a diagnosis on
//!
//! Floor 4. The generator of cases knows nothing of the diagnosis, of its library of effects, or of the simulator that it
//! uses: it models each effect independently, and otherwise than the textbook, as real units behave. Ramps bend,
//! temperature lags, filters are of any order, levels jitter. [`UNLISTED`] are effects that are in no list.
//!
//! How strong an effect is, is said by how clearly it shows: its expected log-likelihood ratio against the nominal simulator
//! over the log of the fit, in nats ([`Strength`]).
//!
//! [`plan`] says which effects the cases of a bench hold, [`make`] makes one case. Each case draws from its own seed: the same
//! plan gives the same bytes on one thread or many.

mod bias;
mod case;
mod catalogue;
mod draw;
pub mod drive;
mod effect;
mod label;
mod nats;
mod plan;
mod run;
mod sensor;
mod unlisted;
mod unlisted_noise;
mod wandering;

pub use case::Case;
pub use catalogue::{COMMON, LISTED, UNLISTED};
pub use label::{Label, Parameters, Place, Strength};
pub use plan::{Mix, Spec, plan};

use crate::config::Kind;
use crate::error::Result;

/// Makes case `index` of this `kind` of the bench with this `seed`.
///
/// # Errors
/// [`crate::ErrorKind::Usage`] if `spec` names an effect that the generator does not know.
pub fn make(kind: Kind, seed: u64, index: usize, spec: &Spec) -> Result<Case> {
    match kind {
        Kind::Stationary => case::make(seed, index, spec),
        Kind::Driving => drive::make(seed, index, spec),
    }
}

#[cfg(test)]
mod tests;
