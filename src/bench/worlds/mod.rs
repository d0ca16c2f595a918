//! reading(t) = e(t) + Σ_i strength_i path_i(t) + σ · shaped white noise: recordings of real units, for trying a diagnosis on
//!
//! Floor 4. The generator of cases knows nothing of the diagnosis, of its library of effects, or of the simulator that it
//! uses: it models each effect independently, and otherwise than the textbook, as real units behave. Ramps bend,
//! temperature lags, filters are of any order, levels jitter. [`UNLISTED`] are effects that are in no list.
//!
//! How strong an effect is, is said by how clearly it shows: its expected log-likelihood ratio against the nominal simulator
//! over the log of the fit, in nats ([`Strength`]).
//!
//! How the logs are kept is no effect (`make_kept`): few decimals, CSV, a file a sensor, wheels that are read seldom, clocks that
//! disagree. Labels say it beside the effects.
//!
//! `plan` says which effects the cases of a bench hold, [`make`] makes one case. Each case draws from its own seed: the same
//! plan gives the same bytes on one thread or many.

mod bias;
mod case;
pub(crate) mod catalogue;
mod draw;
pub(crate) mod drive;
mod effect;
mod files;
mod habits;
pub(crate) mod label;
mod nats;
mod noise_level;
mod plan;
mod run;
mod sensor;
mod unlisted;
mod unlisted_noise;
mod wandering;
mod warm_up;

pub(crate) use case::Case;
pub(crate) use label::{ClockOffset, Label, Place};
pub(crate) use plan::plan;
pub(crate) use plan::{Mix, Spec};

use crate::config::Kind;
use crate::error::Result;

/// Makes case `index` of this `kind` of the bench with this `seed`.
///
/// # Errors
/// [`crate::ErrorKind::Usage`] if `spec` names an effect that the generator does not know.
#[cfg(test)]
pub(crate) fn make(kind: Kind, seed: u64, index: usize, spec: &Spec) -> Result<Case> {
    make_kept(kind, seed, index, spec, 0.0)
}

/// The same, its logs kept as people do: each habit with probability `habits`, 0 to 1.
///
/// - Rates of gyro and wheels are printed with few decimals, in rad/s or deg/s; a step of the decimals is a tenth of the white
///   noise of a sample at most.
/// - The logs are CSV.
/// - A robot's configuration says that it turns by `skid` or `differential`; a track may be up to twice the nominal where it skids.
/// - With half of that probability the wheels of a drive are read at 10 to 20 Hz, into a file of their own.
/// - With half of it clocks of wheels, pose or both are off by up to 1.5 s, in each recording by another offset; not
///   beside effects that are lags themselves.
///
/// All are drawn from a stream of their own: the content of a case stays the same, except for the track of a robot that
/// skids, and for the nats of wheels that are read at a lower rate.
///
/// # Errors
/// As [`make`].
pub(crate) fn make_kept(kind: Kind, seed: u64, index: usize, spec: &Spec, habits: f64) -> Result<Case> {
    match kind {
        Kind::Stationary => case::make(seed, index, spec, habits),
        Kind::Driving => drive::make(seed, index, spec, habits),
    }
}

#[cfg(test)]
mod tests;
