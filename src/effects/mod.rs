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
//! The generator of benchmark cases ([`crate::reality`]) shares nothing with the library on purpose. A test asks that it either
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

mod bandwidth;
mod bias_instability;
mod bias_step;
pub mod drive;
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

pub use library::Library;

use crate::error::Result;
use crate::model::{GyroEffect, Scene};
use std::collections::BTreeMap;

/// Parameters by name, the unit in the name.
pub type Parameters = BTreeMap<String, f64>;

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

/// The effect that enters the likelihood of a drive in this way.
pub(crate) fn in_drives(way: InDrives) -> Option<&'static About> {
    registry().iter().find(|e| e.in_drives() == Some(way)).map(|e| e.about())
}

/// Description of an effect.
#[derive(Debug, Clone, Copy)]
pub struct About {
    /// Identifier of the contract, such as `gyro.rate_ramp`.
    pub id: &'static str,
    /// For people: "rate random walk".
    pub title: &'static str,
    /// The equation, in words and symbols.
    pub equation: &'static str,
    /// Where it is known from.
    pub source: &'static str,
    /// Channel of the answer: `gyro`.
    pub channel: &'static str,
    /// Which equation of the nominal model it adds to, in words.
    pub deficient: &'static str,
    /// `condition` of the answer, where it follows one.
    pub condition: Option<&'static str>,
    /// Its parameters.
    pub parameters: &'static [Parameter],
    /// Advice on how to remove or model it: one sentence.
    pub remedy: &'static str,
}

impl About {
    /// Name of the parameter `i` in the order of [`About::parameters`]; empty where there are fewer.
    #[must_use]
    pub fn name(&self, i: usize) -> &'static str {
        self.parameters.get(i).map_or("", |p| p.name)
    }

    /// Name of the parameter that says how large it is: the first one.
    #[must_use]
    pub fn size(&self) -> &'static str {
        self.name(0)
    }
}

/// One parameter of an effect.
#[derive(Debug, Clone, Copy)]
pub struct Parameter {
    /// Name with unit.
    pub name: &'static str,
    /// Symbol, physical meaning and unit.
    pub meaning: &'static str,
    /// Smallest and largest value that is physically possible.
    pub bounds: [f64; 2],
    /// Value at which the effect changes nothing; none where only another parameter switches it off.
    pub null: Option<f64>,
    /// Whether the answer must hold it (else it describes the form).
    pub required: bool,
}

/// An effect of the library.
pub trait Effect: Sync + Send {
    /// Description of the effect.
    fn about(&self) -> &'static About;

    /// Entry of the battery: what the tests of all effects try it with.
    #[cfg(test)]
    fn tried(&self) -> tried::Tried;

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
    /// ([`Parameter::null`]).
    fn nominal(&self, scene: &Scene) -> Parameters {
        let _ = scene;
        Parameters::new()
    }
}

/// The ways in which an effect can explain a recording at rest.
pub enum Explanation {
    /// y(t) += Σ_j β_j x_j(t; shape)
    Signal(Box<dyn Signal>),
    /// y(t) += β₁ cos 2πft + β₂ sin 2πft: a signal whose shape is a frequency and whose coefficients are a phase. The first
    /// parameter is the frequency, Hz
    Line(Box<dyn Signal>),
    /// y(t) += stationary (or integrated) Gaussian noise with a spectrum
    Noise(Box<dyn Noise>),
    /// the white noise passes a filter: its spectrum is multiplied by |H|²
    Filter(Box<dyn Noise>),
    /// the white noise is larger or smaller by a factor: its spectrum is multiplied by its square
    Level(Box<dyn Noise>),
    /// log variance of the white noise += β x(t)
    Variance(Box<dyn Signal>),
    /// C2 lies anywhere. The first parameter is its shift, rad/s
    TurnOn,
    /// two levels between which the bias jumps as a Markov chain. The parameters are the distance of the levels, rad/s, the
    /// mean time at a level, s, and the time at the upper level over that at the lower, 1 where it is not stated
    TwoLevels,
    /// rare samples of another distribution. The parameters are their share and their size, rad/s
    Outliers {
        /// Size where it is not stated, in nominal standard deviations of the white noise.
        usual_size: f64,
    },
    /// values on a lattice. The first parameter is its step, rad/s
    Lattice,
}

/// The ways in which an effect of a gyro at rest can explain a drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InDrives {
    /// The bias walks at random: its first parameter is the size of the walk, rad/s/√s.
    Walk,
    /// Single readings are far off: its first parameter is their share.
    Outliers,
}

/// One column of a signal.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// One value a row, in the unit that makes β the parameter (rad/s per unit of β).
    pub values: Vec<f64>,
    /// Prior standard deviation of its coefficient, relative to that of the first column, for columns scaled to the same
    /// root mean square: 1 for the first, less for a bend of it.
    pub relative_scale: f64,
}

/// A deterministic signal with linear coefficients and nonlinear shape parameters.
pub trait Signal: Sync + Send {
    /// Shapes to try: nodes of the prior of the nonlinear parameters, equally probable. At least one (which may be empty).
    fn shapes(&self, scene: &Scene) -> Vec<Vec<f64>>;

    /// Columns at one shape (also between the nodes).
    fn columns(&self, scene: &Scene, shape: &[f64]) -> Vec<Column>;

    /// Parameters from shape and coefficients; none of a free form, which has no named ones.
    fn parameters(&self, scene: &Scene, shape: &[f64], coefficients: &[f64]) -> Parameters {
        let _ = (scene, shape, coefficients);
        Parameters::new()
    }

    /// Shape from parameters where they hold it (a time constant, a frequency, a lag); none where it is drawn anew in
    /// each run (the time of a step).
    fn shape(&self, scene: &Scene, parameters: &Parameters) -> Option<Vec<f64>> {
        let _ = (scene, parameters);
        None
    }

    /// Coefficients from parameters; none where they are drawn anew in each run (the phase of a tone), with
    /// [`Signal::prior_std`] then telling how far they scatter.
    fn coefficients(&self, scene: &Scene, shape: &[f64], parameters: &Parameters) -> Option<Vec<f64>> {
        let _ = (scene, shape, parameters);
        None
    }

    /// Whether its shape is the time at which it happens, another in each run. The first parameter is then its size, rad/s.
    fn is_event(&self) -> bool {
        false
    }

    /// Standard deviation of the coefficients over runs where they are drawn anew.
    fn prior_std(&self, parameters: &Parameters) -> Option<Vec<f64>> {
        let _ = parameters;
        None
    }

    /// A column that is added whatever the coefficients are: what takes the place of something nominal subtracts that.
    fn offset(&self, scene: &Scene, shape: &[f64]) -> Option<Vec<f64>> {
        let _ = (scene, shape);
        None
    }

    /// Range of the nonlinear shape parameters for refinement between nodes; none where the nodes are all there is.
    fn refine(&self, scene: &Scene) -> Option<Vec<[f64; 2]>> {
        let _ = scene;
        None
    }
}

/// Gaussian noise by its spectrum. Its parameters are used by their logarithms, so all are positive.
pub trait Noise: Sync + Send {
    /// Names of the parameters, in the order of θ.
    fn names(&self) -> Vec<&'static str>;

    /// Value of the parameter `name` where it is not stated; none where it must be.
    fn unless_stated(&self, name: &str) -> Option<f64> {
        let _ = name;
        None
    }

    /// Range of each parameter in this scene: the prior is uniform in its logarithm.
    fn range(&self, scene: &Scene) -> Vec<[f64; 2]>;

    /// Starting points of the search, parameters in the unit of their names.
    fn starts(&self, scene: &Scene) -> Vec<Vec<f64>>;

    /// Variance of one coefficient of the orthonormal cosine transform at angular frequency `omega` rad/sample, 0 < ω ≤ π,
    /// rad²/s²: the two-sided PSD over the sample time. For a filter: |H|², dimensionless.
    fn spectrum(&self, scene: &Scene, theta: &[f64], omega: f64) -> f64;

    /// Steps of the parameters' logarithms over which the spectrum changes little.
    fn steps(&self, theta: &[f64]) -> Vec<f64> {
        vec![0.03; theta.len()]
    }

    /// Its mean over a band in rad/sample that `omega` lies in the middle of; for noise in a band as narrow as that.
    fn mean_spectrum(&self, scene: &Scene, theta: &[f64], omega: f64, band: [f64; 2]) -> f64 {
        let _ = band;
        self.spectrum(scene, theta, omega)
    }

    /// State-space form of the noise in continuous time; `None` for a filter.
    fn state(&self, theta: &[f64]) -> Option<NoiseState> {
        let _ = theta;
        None
    }

    /// Starting points at the peaks of the spectrum; empty where [`Noise::starts`] are all there are.
    fn starts_at(&self, scene: &Scene, peaks: &[Peak]) -> Vec<Vec<f64>> {
        let _ = (scene, peaks);
        Vec::new()
    }
}

/// Stochastic process of a noise in continuous time, for estimators that run along the recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum NoiseState {
    /// Random walk from zero: K, rad/s/√s.
    Walk(f64),
    /// Noise of the PSD B²/(2πf): B, rad/s.
    Flicker(f64),
    /// Exponentially correlated noise.
    Exponential {
        /// Correlation time, s.
        time_s: f64,
        /// Standard deviation, rad/s.
        std_rad_s: f64,
    },
    /// Noise in a band.
    Band {
        /// Middle, Hz.
        center_hz: f64,
        /// Full width at half the height of the spectrum, Hz.
        width_hz: f64,
        /// Standard deviation, rad/s.
        std_rad_s: f64,
    },
}

/// A peak of a spectrum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Peak {
    /// Middle, rad/sample.
    pub omega: f64,
    /// Width at half its height, rad/sample.
    pub width: f64,
    /// Variance beyond what was expected there, rad²/s².
    pub variance: f64,
}

#[cfg(test)]
mod battery;
