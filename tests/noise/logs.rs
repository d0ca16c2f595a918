//! Simulated logs at rest with known terms.

use gyroid::bias::WarmUp;
use gyroid::effects;
use gyroid::math::random::Stream;
use gyroid::model::Scene;
use gyroid::noise::TermKind;
use gyroid::signal::TimeAxis;

/// What a log is made of; a term of size zero is absent.
#[derive(Debug, Clone, Copy)]
pub struct Truth {
    pub samples: usize,
    pub step_s: f64,
    pub quantization: f64,
    pub angle_random_walk: f64,
    pub bias_instability: f64,
    pub rate_random_walk: f64,
    pub rate_ramp: f64,
    pub gauss_markov: f64,
    pub correlation_time_s: f64,
    /// C1 and T.
    pub warm_up: Option<[f64; 2]>,
}

impl Truth {
    /// Most of an hour at 10 Hz, N = 1e-4 rad/s/√Hz.
    pub fn white() -> Self {
        Self {
            samples: 32_768,
            step_s: 0.1,
            quantization: 0.0,
            angle_random_walk: 1e-4,
            bias_instability: 0.0,
            rate_random_walk: 0.0,
            rate_ramp: 0.0,
            gauss_markov: 0.0,
            correlation_time_s: 10.0,
            warm_up: None,
        }
    }

    pub fn size(&self, kind: TermKind) -> f64 {
        match kind {
            TermKind::Quantization => self.quantization,
            TermKind::AngleRandomWalk => self.angle_random_walk,
            TermKind::BiasInstability => self.bias_instability,
            TermKind::RateRandomWalk => self.rate_random_walk,
            TermKind::RateRamp => self.rate_ramp,
            TermKind::GaussMarkov => self.gauss_markov,
            TermKind::Bandwidth | TermKind::NarrowBandNoise => 0.0,
        }
    }

    pub fn kinds(&self) -> Vec<TermKind> {
        TermKind::ALL.into_iter().filter(|k| self.size(*k) > 0.0).collect()
    }
}

pub fn time(truth: &Truth) -> TimeAxis {
    TimeAxis::Uniform { start_s: 0.0, step_s: truth.step_s, len: truth.samples }
}

/// The log, rad/s.
pub fn simulated(truth: &Truth, seed: u64) -> Vec<f64> {
    let dt = truth.step_s;
    let stream = |n: u64| Stream::new(seed, n);
    let (mut white, mut walk, mut angle, mut markov) = (stream(0), stream(1), stream(2), stream(3));
    let mut bias = 0.0;
    let mut before = truth.quantization * angle.normal();
    let decay = (-dt / truth.correlation_time_s).exp();
    let drive = truth.gauss_markov * (1.0 - decay * decay).sqrt();
    let mut state = truth.gauss_markov * markov.normal();
    let mut out: Vec<f64> = (0..truth.samples)
        .map(|i| {
            let t = i as f64 * dt;
            bias += truth.rate_random_walk * dt.sqrt() * walk.normal();
            let now = truth.quantization * angle.normal();
            let quantised = (now - before) / dt;
            before = now;
            let correlated = state;
            state = decay * state + drive * markov.normal();
            let warm = truth.warm_up.map_or(0.0, |[c1, time]| -c1 * (-t / time).exp_m1());
            let noise = truth.angle_random_walk / dt.sqrt() * white.normal();
            noise + bias + quantised + correlated + warm + truth.rate_ramp * t - 5e-3
        })
        .collect();
    if truth.bias_instability > 0.0 {
        let scene = Scene {
            time: time(truth),
            step_s: dt,
            temperature_c: None,
            power_on_temperature_c: None,
            supply_v: None,
            warm_up: WarmUp { c1_rad_s: 0.0, c2_rad_s: 0.0, time_constant_s: 1.0 },
            white_std_rad_s: truth.angle_random_walk / dt.sqrt(),
            turn_on_bias_std_rad_s: 0.0,
            warm_up_relative_std: 0.0,
        };
        let parameters = [("bias_instability_rad_s".to_string(), truth.bias_instability)].into();
        let effect = effects::by_id("gyro.bias_instability").unwrap();
        let mut effect = effect.simulated(&parameters, &scene, seed).unwrap();
        out.iter_mut().enumerate().for_each(|(row, v)| *v += effect.bias_rad_s(row, &scene));
    }
    out
}
