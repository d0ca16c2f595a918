//! y(t) = nominal + Σ explanations: the ways in which effects enter the likelihood of a recording.

use super::about::Parameters;
use crate::model::Scene;

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

    /// Smallest and largest value of each coefficient; none where any is possible.
    fn bounds(&self) -> Option<Vec<[f64; 2]>> {
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
