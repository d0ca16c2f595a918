//! Floor 2: stochastic terms of a gyro at rest, their spectra and Allan variances, the Allan family, and datasheets.
//!
//! ```text
//! reading = quantised angle Q + low-passed white N + flicker B + random walk K + ramp R + Gauss-Markov (σ, τ) + bands
//! ```
//!
//! Spectra are two-sided, names those of IEEE Std 952. Nothing here estimates a term: [`crate::identify::terms`] does.
//!
//! ```
//! use gyroid::noise::{Deviation, allan};
//!
//! // 0.01 °/s of white noise at 100 Hz is 0.001 °/s/√Hz: the Allan deviation at one second
//! let mut draw = gyroid::math::random::Stream::new(1, 0);
//! let rate: Vec<f64> = (0..100_000).map(|_| 0.01 * draw.normal()).collect();
//! let points = allan::deviations(&rate, 0.01, &[100], Deviation::Overlapping);
//! let [low, high] = points[0].ci95;
//! assert!(low < 0.001 && 0.001 < high);
//! ```

pub mod allan;
mod colour;
pub mod confidence;
pub mod datasheet;
mod low_pass;
mod narrow_band;
mod terms;

pub use allan::{AllanPoint, Deviation};
pub use colour::{Band, Colour};
pub use low_pass::LowPass;
pub use narrow_band::BandForm;
pub use terms::TermKind;
pub(crate) use terms::Unit;
