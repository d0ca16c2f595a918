//! Parts that several effects share: checked parameters, random streams, covariates and their bends, correlated noise.

use super::about::{About, Parameters};
use super::explanation::Column;
use crate::error::{Error, ErrorKind, Result};
use crate::math::random::Stream;
use crate::model::{GyroEffect, GyroInFilter, Scene};
use crate::signal::TimeAxis;

/// Advice: the recording that separates effects of temperature from those of time.
pub(super) const REHEATED: &str =
    "a recording in which temperature moves otherwise than with time since power-on: reheated when warm";
/// Advice: the recording that separates noises that wander.
pub(super) const LONGER: &str = "a recording four times as long, which shows whether the bias keeps wandering";
/// Advice: the recording that separates drifts of the unit from those of one run.
pub(super) const POWERED_AGAIN: &str =
    "a second power-on of the same length: what belongs to the unit repeats, what is drawn anew does not";

/// Largest rate that a parameter may state, rad/s (570 °/s): no gyro at rest errs by more.
pub(super) const RATE_BOUND_RAD_S: f64 = 10.0;
/// Smallest and largest time that a parameter may state, s.
pub(super) const TIME_BOUNDS_S: [f64; 2] = [1e-6, 1e7];
/// Below this no amplitude makes sense: a scene without white noise still has a scale, rad/s.
const SMALLEST_STD_RAD_S: f64 = 1e-12;

/// Parameters whose names are known, whose values lie inside the bounds, and of which none is missing.
pub(super) struct Checked<'a> {
    about: &'static About,
    parameters: &'a Parameters,
}

impl<'a> Checked<'a> {
    pub(crate) fn of(about: &'static About, parameters: &'a Parameters) -> Result<Self> {
        for (name, value) in parameters {
            let Some(known) = about.parameters.iter().find(|p| p.name == name) else {
                let names: Vec<_> = about.parameters.iter().map(|p| p.name).collect();
                return Err(error(about, name, "the parameter is unknown").hint(format!(
                    "{} has {}",
                    about.id,
                    names.join(", ")
                )));
            };
            let [low, high] = known.bounds;
            if !(*value >= low && *value <= high) {
                return Err(error(about, name, format!("{value} is not physical"))
                    .hint(format!("expected a number from {low} to {high}: {}", known.meaning)));
            }
        }
        let checked = Self { about, parameters };
        for needed in about.parameters.iter().filter(|p| p.required) {
            checked.value(needed.name)?;
        }
        if let (true, Some(first)) = (parameters.is_empty(), about.parameters.first()) {
            let names: Vec<_> = about.parameters.iter().map(|p| p.name).collect();
            return Err(error(about, first.name, "no parameter is stated: the effect would change nothing")
                .hint(format!("state one of {}", names.join(", "))));
        }
        Ok(checked)
    }

    /// A parameter that the simulation cannot do without.
    pub(crate) fn value(&self, name: &str) -> Result<f64> {
        self.optional(name).ok_or_else(|| {
            let meaning = self.about.parameters.iter().find(|p| p.name == name).map_or("", |p| p.meaning);
            error(self.about, name, "the parameter is missing").hint(format!("add {name} = ...: {meaning}"))
        })
    }

    pub(crate) fn optional(&self, name: &str) -> Option<f64> {
        self.parameters.get(name).copied()
    }
}

fn error(about: &About, name: &str, found: impl std::fmt::Display) -> Error {
    Error::new(ErrorKind::Config, "configuration", found).at(format!("`effect.{}.{name}`", about.id))
}

/// An effect that adds to the bias: a function of row and scene, rad/s, and the effect's form in a filter.
pub(super) struct Bias<F>(pub F, pub GyroInFilter);

impl<F: FnMut(usize, &Scene) -> f64 + Send> GyroEffect for Bias<F> {
    fn bias_rad_s(&mut self, row: usize, scene: &Scene) -> f64 {
        (self.0)(row, scene)
    }

    fn in_filter(&self) -> GyroInFilter {
        self.1.clone()
    }
}

/// One value a row, computed beforehand.
pub(super) fn path(values: Vec<f64>) -> Box<dyn GyroEffect> {
    Box::new(Bias(move |row, _: &Scene| values.get(row).copied().unwrap_or(0.0), GyroInFilter::Known))
}

/// The random numbers of one effect: a stream of its own under every seed.
pub(super) fn stream(about: &About, seed: u64) -> Stream {
    // FNV-1a of the id: the numbers of an effect do not depend on which others there are
    let fnv = |hash: u64, byte: u8| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01B3);
    Stream::new(seed, about.id.bytes().fold(0xCBF2_9CE4_8422_2325, fnv))
}

/// One named parameter.
pub(super) fn single(name: &str, value: f64) -> Parameters {
    Parameters::from([(name.to_string(), value)])
}

/// From the row before to `row`, s; zero at the first.
pub(super) fn step_s(scene: &Scene, row: usize) -> f64 {
    match &scene.time {
        _ if row == 0 => 0.0,
        TimeAxis::Uniform { step_s, .. } => *step_s,
        TimeAxis::Explicit(t) => t[row] - t[row - 1],
    }
}

/// Standard deviation of the white noise, never zero, rad/s.
pub(super) fn white_std_rad_s(scene: &Scene) -> f64 {
    scene.white_std_rad_s.max(SMALLEST_STD_RAD_S)
}

/// `count` values from `low` to `high`, evenly in the logarithm.
pub(super) fn log_spaced(low: f64, high: f64, count: usize) -> Vec<f64> {
    let at = |i: usize| (low.ln() + (high / low).ln() * i as f64 / (count.max(2) - 1) as f64).exp();
    (0..count).map(at).collect()
}

/// Temperature above its value at power-on, °C.
pub(super) fn temperature_rise_c(scene: &Scene) -> Option<Vec<f64>> {
    let values = scene.temperature_c.as_ref().filter(|t| varies(t))?;
    let first = scene.first_temperature_c()?;
    Some(values.iter().map(|v| v - first).collect())
}

/// Supply above its mean over the log, V.
pub(super) fn supply_deviation_v(scene: &Scene) -> Option<Vec<f64>> {
    let values = scene.supply_v.as_ref().filter(|v| varies(v))?;
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    Some(values.iter().map(|v| v - mean).collect())
}

/// Whether all values are finite and not the same.
pub(super) fn varies(values: &[f64]) -> bool {
    values.iter().any(|v| *v != values[0]) && values.iter().all(|v| v.is_finite())
}

/// The covariate that an effect needs, or which one is missing.
pub(super) fn covariate(values: Option<Vec<f64>>, about: &About, channel: &str, there: bool) -> Result<Vec<f64>> {
    values.ok_or_else(|| {
        let found = if there {
            format!("needs {channel}, which is the same in every row")
        } else {
            format!("needs {channel}, and there is none")
        };
        Error::new(ErrorKind::Config, "configuration", found)
            .at(format!("`effect.{}`", about.id))
            .hint(format!("give a log with the column {channel}: gyroid simulate CONFIG --inputs LOG"))
    })
}

/// dz/dt = (x - z)/lag, z = 0 at the first row; exact where x is linear between the rows.
pub(super) fn lagged(scene: &Scene, values: &[f64], lag_s: f64) -> Vec<f64> {
    // far below a row the lag cannot be seen
    if lag_s < 1e-3 * scene.step_s {
        return values.to_vec();
    }
    let mut state = 0.0;
    let mut out = Vec::with_capacity(values.len());
    for (row, &now) in values.iter().enumerate() {
        if row > 0 {
            let (dt, before) = (step_s(scene, row), values[row - 1]);
            let decay = (-dt / lag_s).exp();
            let slope_lag = (now - before) * lag_s / dt;
            state = now - slope_lag * (1.0 - decay) + (state - before) * decay;
        }
        out.push(state);
    }
    out
}

/// x, and its bend: the residual of x² after regression on a constant and x. x² = bend + slope · x + constant.
pub(super) struct Bent {
    pub linear: Vec<f64>,
    pub bend: Vec<f64>,
    pub slope: f64,
}

impl Bent {
    pub(crate) fn new(linear: Vec<f64>) -> Self {
        let n = linear.len().max(1) as f64;
        let mean = linear.iter().sum::<f64>() / n;
        let mean_square = linear.iter().map(|x| x * x).sum::<f64>() / n;
        let (mut variance, mut covariance) = (0.0, 0.0);
        for x in &linear {
            variance += (x - mean) * (x - mean);
            covariance += (x - mean) * (x * x - mean_square);
        }
        let slope = if variance > 0.0 { covariance / variance } else { 0.0 };
        let bend = linear.iter().map(|x| x * x - mean_square - slope * (x - mean)).collect();
        Self { linear, bend, slope }
    }

    /// The same without a constant: x² = bend + slope · x.
    pub(crate) fn through_origin(linear: Vec<f64>) -> Self {
        let square: f64 = linear.iter().map(|x| x * x).sum();
        let cube: f64 = linear.iter().map(|x| x * x * x).sum();
        let slope = if square > 0.0 { cube / square } else { 0.0 };
        let bend = linear.iter().map(|x| x * x - slope * x).collect();
        Self { linear, bend, slope }
    }

    /// The two columns, each times `factor`.
    pub(crate) fn columns(self, factor: f64, bend_scale: f64) -> Vec<Column> {
        let times = |x: Vec<f64>| x.into_iter().map(|v| factor * v).collect();
        vec![
            Column { values: times(self.linear), relative_scale: 1.0 },
            Column { values: times(self.bend), relative_scale: bend_scale },
        ]
    }

    /// The parameters called `slope` and `bend`, of slope · x + bend · x², from the columns' coefficients: the same
    /// function, but for a constant where the bend was freed of one.
    pub(super) fn parameters(&self, slope: &str, bend: &str, coefficients: &[f64]) -> Parameters {
        let at = |i: usize| coefficients.get(i).copied().unwrap_or(0.0);
        Parameters::from([(slope.to_string(), at(0) - self.slope * at(1)), (bend.to_string(), at(1))])
    }

    /// The columns' coefficients from those parameters, the bend 0 where it is not among them.
    pub(super) fn coefficients(&self, slope: &str, bend: &str, parameters: &Parameters) -> Option<Vec<f64>> {
        let bend = parameters.get(bend).copied().unwrap_or(0.0);
        Some(vec![*parameters.get(slope)? + self.slope * bend, bend])
    }
}

/// dx = -x/τ dt + ..., stationary with standard deviation σ; stepped exactly (Gillespie, Phys. Rev. E 54 (1996) 2084).
pub(super) struct OrnsteinUhlenbeck {
    std: f64,
    time_constant_s: f64,
    state: Option<f64>,
    /// step, φ and σ √(1 - φ²) of the last step
    known: [f64; 3],
}

impl OrnsteinUhlenbeck {
    pub(crate) fn new(std: f64, time_constant_s: f64) -> Self {
        Self { std, time_constant_s, state: None, known: [0.0, 1.0, 0.0] }
    }

    pub(crate) fn next(&mut self, dt_s: f64, draw: &mut Stream) -> f64 {
        if self.known[0] != dt_s {
            let rate = dt_s / self.time_constant_s;
            self.known = [dt_s, (-rate).exp(), self.std * (-(-2.0 * rate).exp_m1()).sqrt()];
        }
        let [_, decay, drive] = self.known;
        let next = match self.state {
            None => self.std * draw.normal(),
            Some(x) => decay * x + drive * draw.normal(),
        };
        self.state = Some(next);
        next
    }
}

/// Variance per sample and angular frequency of an Ornstein-Uhlenbeck process of unit variance, sampled every `dt_s`.
pub(super) fn exponential_spectrum(time_constant_s: f64, dt_s: f64, omega: f64) -> f64 {
    let rate = dt_s / time_constant_s;
    let decay = (-rate).exp();
    // (1 - φ)² + 4 φ sin²(ω/2) keeps the digits where φ is near one
    let half = (0.5 * omega).sin();
    let gap = -(-rate).exp_m1();
    -(-2.0 * rate).exp_m1() / (gap * gap + 4.0 * decay * half * half)
}
