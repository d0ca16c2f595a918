//! Floor 5: the gap between the nominal simulator and a recording: where it lies, which effect causes it, how far it shrinks.
//!
//! ```text
//! ln p(set | recording) = ln ∫ p(recording | set, θ) p(θ) dθ / temperature + ln prior(set) + constant
//! gap closed            = (after - before) / (floor - before), in log score on the recording held out
//! ```
//!
//! A *set* holds effects of the library ([`crate::effects`]) and free forms: corrections of an equation without a cause. The
//! empty set says that nothing is missing; a set whose largest share is a free form's says that the cause is unknown. θ are the
//! effects' parameters with their priors, so that a set that needs more freedom than it earns loses by itself. *Before* is the
//! nominal simulator, *after* the one with the effects added, *floor* what that one scores on recordings of its own: no model of
//! this noise does better on average.
//!
//! # A diagnosis, step by step
//!
//! [`diagnose()`] of one recording, [`diagnose_drives`] of several; what differs between a gyro at rest and a drive is the
//! likelihood.
//!
//! 1. The recording is brought into the model's terms: [`rest`] keeps the gyro's rate on an even clock, [`drive`] all channels.
//!    Streams whose clocks disagree are set right first. Where nothing is seen twice, the answer is *cannot tell*.
//! 2. The effects that the configuration holds already are part of the nominal simulator.
//! 3. Drives are taken in several ways: noise levels as stated or as found, ticks lost or not, a sensor late by whole rows or
//!    not. Each is a hypothesis about the recording, and competes with the others.
//! 4. The likelihood is formed: at rest Whittle's, Gaussian in frequency; of a drive that of the innovations of an extended
//!    Kalman filter, with their sensitivity to every effect and free form.
//! 5. Each candidate alone is screened by what it gains.
//! 6. Sets grow by the best candidate, lose what is not worth its prior, exchange one for another; all sets one step from the
//!    best are compared too. At rest what is not Gaussian (quantization, tails, two levels, events) is judged on the series
//!    whitened by each set.
//! 7. Of a drive the best set's coordinates are settled by Gauss-Newton, and steps 4 to 6 repeated there.
//! 8. Each effect is left out, all others fitted anew: an effect whose loss is below what its prior asks is not named.
//! 9. [`selection::findings::Findings`] weighs the sets. [`Calibration`] turns evidences into probabilities that hold on cases
//!    of known truth.
//! 10. A class of at most three effects that this recording cannot tell apart follows from its information matrix.
//! 11. On the recording held out each effect's gain is compared with the gain that it would have if it were true ([`holdout`]):
//!     a loss counts as evidence against it, and what closes nothing is idle.
//! 12. The share that effects close together and one by one is measured, with an interval by blocks of time.
//! 13. The remainder is told with its place: channel, and frequency or condition.
//! 14. [`Answer`] holds all that, and [`trace`] every step with what it decided and by which constant.
//!
//! The constants by which the steps decide stand on a page of the book, `docs/src/constants.md`, that is made from the code.
//!
//! # Worked example
//!
//! A gyro that vibrates, which its simulator does not know:
//!
//! ```
//! use gyroid::config::Config;
//! use gyroid::effects::Library;
//! use gyroid::gap::{Options, diagnose};
//! use gyroid::signal::{Log, names};
//! use gyroid::simulate::{Options as Seed, stationary};
//!
//! let simulator = Config::parse(
//!     "schema = 1\nkind = 'stationary'\nsample_time_s = 0.5\n\
//!      [gyro]\nc1_rad_s = 2e-3\nc2_rad_s = -5e-3\ntime_constant_s = 240.0\nangle_random_walk_rad_sqrt_s = 1e-4",
//!     "gyroid.toml",
//! )?;
//! let recorded = |seed| -> gyroid::Result<Log> {
//!     let still = stationary(&simulator, 900.0, &Seed::from(seed))?;
//!     let rates = still.require(names::GYRO_Z)?;
//!     let shaken = |(i, rate)| rate + 1e-4 * (std::f64::consts::TAU * 0.31 * still.time.at(i)).sin();
//!     let shaken = rates.iter().enumerate().map(shaken).collect();
//!     let mut log = Log::new("recorded", still.time.clone());
//!     log.push(names::GYRO_Z, shaken)?;
//!     Ok(log)
//! };
//! let library = Library::new();
//! let found = diagnose(&simulator, &recorded(1)?, Some(&recorded(2)?), &library, &Options::default())?;
//! let answer = found.answer;
//! assert!(answer.main.is_some_and(|id| id.ends_with(".tone")));
//! // nearly all of the gap is closed on the recording held out
//! assert!(answer.effects[0].gap_closed.is_some_and(|closed| closed > 0.8));
//! # Ok::<(), gyroid::Error>(())
//! ```

pub mod answer;
mod asked;
pub(crate) mod diagnose;
mod diagnosis;
pub(crate) mod drive;
mod explain;
pub(crate) mod holdout;
pub mod plan;
pub mod power;
pub(crate) mod rest;
pub(crate) mod selection;
pub mod trace;
pub mod twin;

pub use crate::gap::answer::calibration::Calibration;
pub use crate::gap::drive::holdout::traces::{DriveTraces, Trace, TraceCurve};
pub(crate) use crate::gap::holdout::oracle::known_gain;
pub use crate::gap::rest::explain::Explanations;
pub use crate::gap::rest::model_selection::Options as JudgeOptions;
pub use crate::gap::rest::predictive;
pub use crate::gap::selection::prior::Prior;
pub use answer::{Answer, Verdict};
pub(crate) use diagnose::compare;
pub use diagnose::{diagnose, diagnose_drives, diagnose_observed};
pub use diagnosis::{Diagnosis, Drive, Options, Stage};
pub use explain::explain;
