//! Floor 4: what reality adds to the nominal simulator. One file an effect, one line in [`registry()`].
//!
//! An effect is defined once: the same definition changes the simulator ([`Effect::simulated`]) and explains a recording
//! ([`Effect::explanation`]). The engine that compares effects ([`crate::gap`]) knows the ways of explaining, and no effect.
//!
//! # Adding an effect
//!
//! 1. One file, `src/effects/creep.rs` say. It describes the effect ([`About`]), simulates it and says how it explains a
//!    recording: as one of the variants of [`Explanation`], or of [`drive::DriveExplanation`] for an effect of drives.
//! 2. One line in the registry: `&creep::Creep`, and `mod creep;` above it.
//!
//! Nothing else need name the effect: configurations, simulator, diagnosis and reports take it from the registry, and an export
//! says that it is left out until a target has a number for it. In the same file, compiled with the tests alone, it brings its
//! entry of the battery: plain sizes, with which the tests of all effects try it,
//!
//! ```text
//! #[cfg(test)]
//! fn tried(&self) -> Tried {
//!     Tried::size(&[("creep_rad_s_sqrt_s", 2e-6)])
//! }
//! ```
//!
//! The generator of benchmark cases ([`crate::bench::worlds`]) shares nothing with the library on purpose. A test asks that it either
//! models the effect, in a form of its own, or lists it as left out with the reason.
//!
//! The whole of an effect that the library lacks:
//!
//! ```
//! use gyroid::effects::{About, Column, Effect, Explanation, Parameter, Parameters, Signal};
//! use gyroid::model::{GyroEffect, GyroInFilter, Scene};
//! use gyroid::{Error, ErrorKind, Result};
//!
//! const SIZE: &str = "creep_rad_s_sqrt_s";
//!
//! static ABOUT: About = About {
//!     id: "gyro.creep",
//!     title: "creep",
//!     equation: "b(t) = k √t: the bias follows a mounting that creeps",
//!     source: "Findley, Lai and Onaran, Creep and Relaxation of Nonlinear Viscoelastic Materials (1976)",
//!     channel: "gyro",
//!     deficient: "gyro bias: a term that grows with the root of time",
//!     condition: Some("elapsed_time"),
//!     parameters: &[Parameter {
//!         name: SIZE,
//!         meaning: "k, rad/s/√s",
//!         bounds: [-0.1, 0.1],
//!         null: Some(0.0),
//!         required: true,
//!     }],
//!     remedy: "Let the mounting relax before calibration, or estimate the bias as a state of the filter.",
//! };
//!
//! /// The bias creeps.
//! struct Creep;
//!
//! /// Creep at work in one recording: k, rad/s/√s.
//! struct Work(f64);
//!
//! impl GyroEffect for Work {
//!     fn bias_rad_s(&mut self, row: usize, scene: &Scene) -> f64 {
//!         self.0 * scene.time.at(row).max(0.0).sqrt()
//!     }
//!
//!     fn in_filter(&self) -> GyroInFilter {
//!         GyroInFilter::Known
//!     }
//! }
//!
//! impl Effect for Creep {
//!     fn about(&self) -> &'static About {
//!         &ABOUT
//!     }
//!
//!     fn simulated(&self, parameters: &Parameters, _: &Scene, _: u64) -> Result<Box<dyn GyroEffect>> {
//!         // inside the library `parts::Checked` refuses all that the description does not allow
//!         let missing = || Error::new(ErrorKind::Config, "configuration", format!("{SIZE} is missing"));
//!         Ok(Box::new(Work(*parameters.get(SIZE).ok_or_else(missing)?)))
//!     }
//!
//!     fn explanation(&self, _: &Scene) -> Option<Explanation> {
//!         Some(Explanation::Signal(Box::new(Creep)))
//!     }
//! }
//!
//! impl Signal for Creep {
//!     // no nonlinear parameter: one shape, which is empty
//!     fn shapes(&self, _: &Scene) -> Vec<Vec<f64>> {
//!         vec![Vec::new()]
//!     }
//!
//!     fn columns(&self, scene: &Scene, _: &[f64]) -> Vec<Column> {
//!         let values = scene.time.to_vec().iter().map(|t| t.max(0.0).sqrt()).collect();
//!         vec![Column { values, relative_scale: 1.0 }]
//!     }
//!
//!     fn parameters(&self, _: &Scene, _: &[f64], coefficients: &[f64]) -> Parameters {
//!         Parameters::from([(SIZE.to_owned(), coefficients[0])])
//!     }
//!
//!     fn shape(&self, _: &Scene, _: &Parameters) -> Option<Vec<f64>> {
//!         Some(Vec::new())
//!     }
//!
//!     fn coefficients(&self, _: &Scene, _: &[f64], parameters: &Parameters) -> Option<Vec<f64>> {
//!         Some(vec![*parameters.get(SIZE)?])
//!     }
//! }
//!
//! // what the battery checks of every signal: simulator and explanation are one definition
//! use gyroid::{bias::WarmUp, signal::TimeAxis};
//! let scene = Scene {
//!     time: TimeAxis::Uniform { start_s: 0.0, step_s: 0.5, len: 200 },
//!     step_s: 0.5,
//!     temperature_c: None,
//!     power_on_temperature_c: None,
//!     supply_v: None,
//!     warm_up: WarmUp { c1_rad_s: 2e-3, c2_rad_s: -3e-3, time_constant_s: 180.0 },
//!     white_std_rad_s: 1e-3,
//!     turn_on_bias_std_rad_s: 0.0,
//!     warm_up_relative_std: 0.0,
//! };
//! let size = Parameters::from([(SIZE.to_owned(), 2e-6)]);
//! let mut work = Creep.simulated(&size, &scene, 1)?;
//! let coefficients = Creep.coefficients(&scene, &[], &size).unwrap();
//! let columns = Creep.columns(&scene, &[]);
//! for row in 0..scene.len() {
//!     assert_eq!(work.bias_rad_s(row, &scene), coefficients[0] * columns[0].values[row]);
//! }
//! assert_eq!(Creep.parameters(&scene, &[], &coefficients), size);
//! assert!(Creep.simulated(&Parameters::new(), &scene, 1).is_err());
//! # Ok::<(), gyroid::Error>(())
//! ```

mod about;
mod bandwidth;
mod bias_instability;
mod bias_step;
mod custom;
pub mod drive;
mod effect;
mod explanation;
mod gauss_markov;
#[cfg(test)]
pub(crate) mod ids;
mod library;
mod narrow_band_noise;
mod noise_growth;
mod noise_level;
mod outliers;
mod parts;
mod quantization;
mod rate_ramp;
mod rate_random_walk;
mod second_time_constant;
mod supply_sensitivity;
mod telegraph_noise;
mod temperature_sensitivity;
mod tone;
#[cfg(test)]
mod tried;
mod turn_on_shift;
mod warm_up;

pub use about::{About, Parameter, Parameters};
pub(crate) use custom::unit as unit_of_own;
pub use effect::Effect;
pub use explanation::{Column, Explanation, InDrives, Noise, NoiseState, Peak, Signal};
pub use library::Library;

/// Every effect of the library, one line each.
static REGISTRY: &[&dyn Effect] = &[
    &rate_random_walk::RateRandomWalk,
    &bias_instability::BiasInstability,
    &gauss_markov::GaussMarkov,
    &quantization::Quantization,
    &rate_ramp::RateRamp,
    &second_time_constant::SecondTimeConstant,
    &temperature_sensitivity::TemperatureSensitivity,
    &supply_sensitivity::SupplySensitivity,
    &tone::Tone,
    &bias_step::BiasStep,
    &outliers::Outliers,
    &telegraph_noise::TelegraphNoise,
    &bandwidth::Bandwidth,
    &noise_growth::NoiseGrowth,
    &turn_on_shift::TurnOnShift,
    &warm_up::AnotherWarmUp,
    &noise_level::NoiseLevel,
    &narrow_band_noise::NarrowBandNoise,
];

/// Every effect of the library.
#[must_use]
pub fn registry() -> &'static [&'static dyn Effect] {
    REGISTRY
}

/// The effect `id`.
#[must_use]
pub fn by_id(id: &str) -> Option<&'static dyn Effect> {
    registry().iter().copied().find(|e| e.about().id == id)
}

/// Description of the effect `id`, at rest, of drives or of the user's own; none where nobody defines it.
#[must_use]
pub fn about(id: &str) -> Option<&'static About> {
    let listed = by_id(id).map(|e| e.about()).or_else(|| drive::by_id(id).map(|e| e.about()));
    listed.or_else(|| custom::about(id))
}

/// The effect that enters the likelihood of a drive in this way.
pub(crate) fn in_drives(way: InDrives) -> Option<&'static About> {
    registry().iter().find(|e| e.in_drives() == Some(way)).map(|e| e.about())
}

#[cfg(test)]
mod battery;
