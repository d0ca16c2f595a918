//! gyro = true rate + e(t) + white noise;  e(t) = C1 (1 - exp(-(t + A)/T)) + C2 + K W(t), t from power-on
//!
//! A is zero after a cold power-on; after a warm restart it is the age that the gyro had kept ([`crate::bias::Restart`]).
//! W is a Wiener process that starts at power-on: the rate random walk, a walk of C2. A sample's white noise has the
//! standard deviation N/√Ts, before the sensor's low-pass where `[gyro.noise]` states one; bands of vibration are added to it. Where the output lies on a lattice, it is rounded to it. Effects change bias, white noise,
//! filter and output in the order of [`crate::model`]; those of one kind, in the order in which they are given.

use super::coloured::Coloured;
use super::{Options, Purpose};
use crate::bias::WarmUp;
use crate::config::Gyro;
use crate::error::{Error, ErrorKind, Result};
use crate::math::random::Stream;
use crate::model::{GyroEffect, Scene};

/// A gyro with its state.
pub(super) struct GyroSensor {
    model: WarmUp,
    /// A, s
    age_at_power_on_s: f64,
    white_std_rad_s: f64,
    walk_rad_s_sqrt_s: f64,
    lsb_rad_s: Option<f64>,
    walk_rad_s: f64,
    walked_until_s: f64,
    white: Stream,
    steps: Stream,
    coloured: Coloured,
    changed: Option<Changed>,
}

/// Effects at work, and where in the recording they are.
struct Changed {
    scene: Scene,
    effects: Vec<Box<dyn GyroEffect>>,
    row: usize,
}

/// One sample.
pub(super) struct GyroSample {
    pub reading_rad_s: f64,
    /// e(t) without white noise.
    pub error_rad_s: f64,
}

impl GyroSensor {
    pub(crate) fn new(gyro: &Gyro, sample_time_s: f64, options: &Options) -> Result<Self> {
        let noise = gyro.noise.clone().unwrap_or_default();
        let white_std_rad_s = gyro.angle_random_walk_rad_sqrt_s / sample_time_s.sqrt();
        let model = if options.vary_turn_on { turn_on(gyro, options.seeds.turn_on)? } else { gyro.warm_up() };
        let restart = options.off_time_s.map(|off_s| gyro.restart(off_s)).transpose()?;
        Ok(Self {
            model,
            age_at_power_on_s: restart.map_or(0.0, |r| r.age_s(model.time_constant_s)),
            white_std_rad_s,
            walk_rad_s_sqrt_s: noise.rate_random_walk_rad_s_sqrt_s.unwrap_or(0.0),
            lsb_rad_s: noise.quantization_lsb_rad_s.filter(|lsb| *lsb > 0.0),
            walk_rad_s: 0.0,
            walked_until_s: 0.0,
            white: Purpose::GyroWhite.stream(options.seeds.sensors),
            steps: Purpose::GyroWalk.stream(options.seeds.sensors),
            coloured: Coloured::new(&noise, white_std_rad_s, sample_time_s, options.seeds.sensors),
            changed: None,
        })
    }

    /// The same gyro with effects; it is then to be read once for each row of `scene`.
    pub(crate) fn changed_by(mut self, effects: Vec<Box<dyn GyroEffect>>, scene: Scene) -> Self {
        if !effects.is_empty() {
            self.changed = Some(Changed { scene, effects, row: 0 });
        }
        self
    }

    /// Its white noise times `over_nominal`.
    pub(crate) fn louder(&mut self, over_nominal: f64) {
        self.white_std_rad_s *= over_nominal;
    }

    /// The warm-up that this power-on has.
    pub(crate) fn model(&self) -> WarmUp {
        self.model
    }

    /// Reads the gyro at `since_power_on_s`, which must not go backwards.
    pub(crate) fn read(&mut self, rate_rad_s: f64, since_power_on_s: f64) -> GyroSample {
        let dt = (since_power_on_s - self.walked_until_s).max(0.0);
        self.walked_until_s = since_power_on_s;
        if self.walk_rad_s_sqrt_s > 0.0 {
            self.walk_rad_s += self.walk_rad_s_sqrt_s * dt.sqrt() * self.steps.normal();
        }
        let mut error_rad_s = self.model.error_rad_s(since_power_on_s + self.age_at_power_on_s) + self.walk_rad_s;
        let mut white_std_rad_s = self.white_std_rad_s;
        if let Some(Changed { scene, effects, row }) = &mut self.changed {
            error_rad_s += effects.iter_mut().map(|e| e.bias_rad_s(*row, scene)).sum::<f64>();
            white_std_rad_s *= effects.iter_mut().map(|e| e.white_scale(*row, scene)).product::<f64>();
        }
        let white_rad_s = white_std_rad_s * self.white.normal();
        let mut raw = rate_rad_s + error_rad_s + self.coloured.next(white_rad_s);
        if let Some(Changed { effects, row, .. }) = &mut self.changed {
            raw = effects.iter_mut().fold(raw, |rate, e| e.filtered(rate));
            raw = effects.iter_mut().fold(raw, |reading, e| e.output(*row, reading));
            *row += 1;
        }
        let reading_rad_s = self.lsb_rad_s.map_or(raw, |lsb| (raw / lsb).round() * lsb);
        GyroSample { reading_rad_s, error_rad_s }
    }
}

/// Parameters of one power-on, drawn inside the stated repeatability.
fn turn_on(gyro: &Gyro, seed: u64) -> Result<WarmUp> {
    if gyro.turn_on_bias_std_rad_s.is_none() && gyro.warm_up_relative_std.is_none() {
        return Err(Error::new(ErrorKind::Config, "configuration", "states no variation from power-on to power-on")
            .at("`gyro`")
            .hint("add turn_on_bias_std_rad_s or warm_up_relative_std, or simulate the nominal gyro"));
    }
    let mut stream = Purpose::TurnOn.stream(seed);
    let relative = gyro.warm_up_relative_std.unwrap_or(0.0);
    let c2 = gyro.c2_rad_s + gyro.turn_on_bias_std_rad_s.unwrap_or(0.0) * stream.normal();
    let c1 = gyro.c1_rad_s * (1.0 + relative * stream.normal());
    WarmUp::new(c1, c2, gyro.time_constant_s * (relative * stream.normal()).exp())
}
