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
mod effect;
mod label;
mod nats;
mod plan;
mod run;
mod sensor;
mod unlisted;
mod unlisted_noise;
mod wandering;

pub use case::{Case, make};
pub use catalogue::{COMMON, LISTED, UNLISTED};
pub use label::{Label, Parameters, Place, Strength};
pub use plan::{Mix, Spec, plan};

#[cfg(test)]
mod tests;
