//! Floor 4: what reality adds to the nominal simulator. One file an effect, one line in [`registry()`].
//!
//! An effect is defined once: the same definition changes the simulator ([`Effect::simulated`]) and explains a recording
//! ([`Effect::explanation`]). The engine that compares effects ([`crate::gap`]) knows the ways of explaining, and no effect.

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
static REGISTRY: [&dyn Effect; 18] = [
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
    &REGISTRY
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
    /// Name of the parameter that says how large it is: the first one.
    #[must_use]
    pub fn size(&self) -> &'static str {
        self.parameters.first().map_or("", |p| p.name)
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
    /// y(t) += β₁ cos 2πft + β₂ sin 2πft: a signal whose shape is a frequency and whose coefficients are a phase
    Line(Box<dyn Signal>),
    /// y(t) += stationary (or integrated) Gaussian noise with a spectrum
    Noise(Box<dyn Noise>),
    /// the white noise passes a filter: its spectrum is multiplied by |H|²
    Filter(Box<dyn Noise>),
    /// the white noise is larger or smaller by a factor: its spectrum is multiplied by its square
    Level(Box<dyn Noise>),
    /// log variance of the white noise += β x(t)
    Variance(Box<dyn Signal>),
    /// C2 lies anywhere
    TurnOn,
    /// two levels between which the bias jumps as a Markov chain
    TwoLevels,
    /// rare samples of another distribution
    Outliers,
    /// values on a lattice
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

    /// Whether its shape is the time at which it happens, another in each run.
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
