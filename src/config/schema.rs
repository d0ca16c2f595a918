//! The tables of schema 1. Every key carries its unit.

use super::custom::CustomEffect;
use super::noise::Noise;
use super::temperature::Temperature;
use crate::bias::{Discrete, Restart, WarmUp};
use crate::error::{Error, ErrorKind, Result, nearest};
use crate::traction::TractionLaw;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Kind of simulator that a configuration describes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// A gyro at rest: `[gyro]` alone.
    #[default]
    Stationary,
    /// A two-wheel robot: also `[vehicle]` and `[encoder]`.
    Driving,
}

/// How a robot turns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Steering {
    /// Two driven wheels, and castors: the wheels roll where it turns.
    Differential,
    /// Wheels behind each other, or tracks: they skid sideways where it turns, as if the track were wider than it is.
    Skid,
}

/// One configuration file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Config {
    /// Schema number, 1.
    pub schema: i64,
    /// At rest or driving.
    #[serde(default)]
    pub kind: Kind,
    /// Sample time of simulator and filter, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sample_time_s: Option<f64>,
    /// The gyro's error.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gyro: Option<Gyro>,
    /// The robot.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub vehicle: Option<Vehicle>,
    /// How the wheels slip; without it they roll.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub traction: Option<Traction>,
    /// The wheel encoders.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub encoder: Option<Encoder>,
    /// The external reference.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pose: Option<Pose>,
    /// Effects that are added to the nominal simulator, kept as id and parameters.
    #[serde(default, rename = "effect", skip_serializing_if = "Vec::is_empty")]
    pub effects: Vec<EffectTable>,
    /// Effects of the user's own, which `[[effect]]` may then name.
    #[serde(default, rename = "custom_effect", skip_serializing_if = "Vec::is_empty")]
    pub custom_effects: Vec<CustomEffect>,
    /// Tests of the model, and their results.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub validation: Option<Validation>,
    /// Where the file comes from, and its checksum.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub provenance: Option<Provenance>,
}

/// `[gyro]`: e(t) = c1 (1 - exp(-t/time_constant)) + c2, plus white noise.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Gyro {
    /// C1, rad/s.
    pub c1_rad_s: f64,
    /// C2, rad/s.
    pub c2_rad_s: f64,
    /// T, s.
    pub time_constant_s: f64,
    /// White noise: standard deviation of a sample is this / sqrt(sample time), rad/√s.
    pub angle_random_walk_rad_sqrt_s: f64,
    /// The Earth's rotation about this axis as part of c2, rad/s; `None` where `gyroid fit --latitude` did not separate
    /// it. c2 includes it: simulator and filter measure the heading from the ground, and a robot on level ground
    /// measures it at rest and in motion. The gyro's own bias is c2 less this; exports to programs that model the
    /// Earth's rotation subtract it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub earth_rate_rad_s: Option<f64>,
    /// How much c2 varies from one power-on to the next, rad/s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub turn_on_bias_std_rad_s: Option<f64>,
    /// How much c1 and the time constant vary from one power-on to the next, relatively.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub warm_up_relative_std: Option<f64>,
    /// Tc: how fast the gyro cools when it is off, s; without it as T.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cooling_time_constant_s: Option<f64>,
    /// Covariance of the estimates.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub covariance: Option<Covariance>,
    /// The recursion that the filter runs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub discrete: Option<Discrete>,
    /// Stochastic terms beside the white noise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noise: Option<Noise>,
    /// The error by temperature, which then takes the place of the warm-up where a log has the temperature.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub temperature: Option<Temperature>,
    /// How warm the gyro was when it was last switched off.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub last_run: Option<LastRun>,
}

/// `[gyro.last_run]`: data for a warm restart.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LastRun {
    /// Age of the warm-up when the gyro was switched off, s: the time on since a cold power-on, or the time that would
    /// have warmed it as far at this file's time constant.
    pub warm_up_age_s: f64,
}

impl Gyro {
    /// A gyro without noise, bias or warm-up; T stands for a warm-up that is yet to be fitted.
    pub(crate) fn without_error(time_constant_s: f64) -> Self {
        Self {
            c1_rad_s: 0.0,
            c2_rad_s: 0.0,
            time_constant_s,
            angle_random_walk_rad_sqrt_s: 0.0,
            earth_rate_rad_s: None,
            turn_on_bias_std_rad_s: None,
            warm_up_relative_std: None,
            cooling_time_constant_s: None,
            covariance: None,
            discrete: None,
            noise: None,
            temperature: None,
            last_run: None,
        }
    }

    /// The warm-up model.
    #[must_use]
    pub fn warm_up(&self) -> WarmUp {
        WarmUp { c1_rad_s: self.c1_rad_s, c2_rad_s: self.c2_rad_s, time_constant_s: self.time_constant_s }
    }

    /// The restart after the gyro was off for `off_s` since its last run.
    ///
    /// # Errors
    /// [`ErrorKind::Config`] without `[gyro.last_run]`; [`ErrorKind::Value`] if `off_s` is no duration.
    pub fn restart(&self, off_s: f64) -> Result<Restart> {
        let last = self.last_run.ok_or_else(|| {
            let found = "the table is missing: how warm the gyro was when it was switched off is not known";
            Error::new(ErrorKind::Config, "configuration", found).at("[gyro.last_run]").hint(
                "write it after a drive with gyroid navigate --save-config FILE, or add warm_up_age_s = the seconds \
                 that the gyro had been on",
            )
        })?;
        Restart::new(last.warm_up_age_s, off_s, self.cooling_time_constant_s)
    }
}

/// `[gyro.covariance]`: of the estimates of C1, C2 and T, allowing for autocorrelated residuals.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Covariance {
    /// var(C1), rad²/s²
    pub c1_c1_rad2_s2: f64,
    /// cov(C1, C2), rad²/s²
    pub c1_c2_rad2_s2: f64,
    /// var(C2), rad²/s²
    pub c2_c2_rad2_s2: f64,
    /// cov(C1, T), rad
    pub c1_time_constant_rad: f64,
    /// cov(C2, T), rad
    pub c2_time_constant_rad: f64,
    /// var(T), s²
    pub time_constant_time_constant_s2: f64,
}

impl Covariance {
    /// From the matrix in the order C1, C2, T.
    #[must_use]
    pub fn from_matrix(m: &[[f64; 3]; 3]) -> Self {
        Self {
            c1_c1_rad2_s2: m[0][0],
            c1_c2_rad2_s2: m[0][1],
            c2_c2_rad2_s2: m[1][1],
            c1_time_constant_rad: m[0][2],
            c2_time_constant_rad: m[1][2],
            time_constant_time_constant_s2: m[2][2],
        }
    }

    /// The symmetric matrix in the order C1, C2, T.
    #[must_use]
    pub fn to_matrix(self) -> [[f64; 3]; 3] {
        let (ab, at, bt) = (self.c1_c2_rad2_s2, self.c1_time_constant_rad, self.c2_time_constant_rad);
        [[self.c1_c1_rad2_s2, ab, at], [ab, self.c2_c2_rad2_s2, bt], [at, bt, self.time_constant_time_constant_s2]]
    }
}

/// `[vehicle]`: two driven wheels on one axle.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Vehicle {
    /// M, kg.
    pub mass_kg: f64,
    /// Jc, about the vertical axis through the centre of mass, kg·m².
    pub yaw_inertia_kg_m2: f64,
    /// b, half the distance between the wheels, m.
    pub half_track_m: f64,
    /// How it turns; without it either is possible. It limits how far the effective track may lie from `half_track_m`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub steering: Option<Steering>,
    /// r, m.
    pub wheel_radius_m: f64,
    /// Jw, of one wheel with its motor, kg·m².
    pub wheel_inertia_kg_m2: f64,
    /// Torque per wheel speed, N·m·s.
    pub viscous_friction_n_m_s: f64,
    /// White torque noise of each wheel: standard deviation over a step dt is this / sqrt(dt), N·m·√s.
    pub torque_noise_n_m_sqrt_s: f64,
    /// Torque at the wheel of one ampere of its motor, gear included, N·m/A: makes torques of motor currents.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub torque_constant_n_m_a: Option<f64>,
    /// Known load that it carries in one run, a point mass at its centre of mass, kg: it adds to the mass and to the weight
    /// on the wheels, and not to the yaw inertia. Of a run and not of the robot: no key of the file.
    #[serde(skip)]
    pub load_kg: f64,
}

impl Vehicle {
    /// Mass with the load, kg.
    #[must_use]
    pub const fn whole_mass_kg(&self) -> f64 {
        self.mass_kg + self.load_kg
    }
}

/// `[traction]`: the contact between wheels and ground, where wheels slip.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Traction {
    /// v_low: smallest denominator of slip, its regularisation at standstill, m/s.
    #[serde(default = "Traction::default_low_speed_m_s")]
    pub low_speed_m_s: f64,
    /// Part of the weight that the driven wheels carry; castors carry the rest.
    #[serde(default = "one")]
    pub driven_load_share: f64,
    /// Part of the driven wheels' load that lies on the left one.
    #[serde(default = "half")]
    pub left_load_share: f64,
    /// Resistance against rolling over load, at the driven wheels.
    #[serde(default)]
    pub rolling_resistance: f64,
    /// The law: a table `[traction.law.burckhardt]`, `pacejka`, `dugoff` or `linear` with its parameters.
    pub law: TractionLaw,
}

impl Traction {
    /// Half the weight on each wheel, no rolling resistance, slip regularised below 0.02 m/s.
    #[must_use]
    pub fn new(law: TractionLaw) -> Self {
        Self {
            low_speed_m_s: Self::default_low_speed_m_s(),
            driven_load_share: 1.0,
            left_load_share: 0.5,
            rolling_resistance: 0.0,
            law,
        }
    }

    /// 2 cm/s: a wheel's slip is well defined above it, and the contact creeps by less than a millimetre a second below.
    fn default_low_speed_m_s() -> f64 {
        0.02
    }
}

fn one() -> f64 {
    1.0
}

fn half() -> f64 {
    0.5
}

/// `[encoder]`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Encoder {
    /// White noise of a wheel speed sample, rad/s.
    pub speed_noise_std_rad_s: f64,
    /// Ticks of a turn of the wheel, gear included; where it is stated, speeds are differences of counted ticks.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ticks_per_revolution: Option<f64>,
}

impl Encoder {
    /// The wheel's angle from tick to tick, rad, where ticks are counted.
    #[must_use]
    pub fn tick_rad(&self) -> Option<f64> {
        self.ticks_per_revolution.map(|n| std::f64::consts::TAU / n)
    }

    /// Variance of a speed reading over `interval_s`, rad²/s²: σ² + tick²/(6 interval²).
    ///
    /// A count is the angle rounded down; of a wheel that turns over many ticks the rounding error is uniform over a
    /// tick, of variance tick²/12, and a speed is the difference of two such errors over the interval. Neighbouring
    /// speeds share a count with opposite signs: their errors have the correlation -1/2 (without white noise), so that
    /// they do not add up in the angle. A filter that takes them for white is the more cautious there.
    #[must_use]
    pub fn speed_variance_rad2_s2(&self, interval_s: f64) -> f64 {
        let by_ticks = self.tick_rad().map_or(0.0, |tick| tick * tick / (6.0 * interval_s * interval_s));
        self.speed_noise_std_rad_s * self.speed_noise_std_rad_s + by_ticks
    }
}

/// `[pose]`: an external reference.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pose {
    /// Samples a second.
    pub rate_hz: f64,
    /// White noise of x and of y, m.
    pub position_std_m: f64,
    /// White noise of the heading, rad.
    pub heading_std_rad: f64,
    /// Standard deviation of the tracked point from the middle of the axle, ahead of it and to its left, m. None: it is
    /// the middle.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lever_arm_std_m: Option<f64>,
    /// Standard deviation of the tracked heading's offset from the robot's, rad. None: there is none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub heading_offset_std_rad: Option<f64>,
    /// Standard deviation of its delay, s. None: there is none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub delay_std_s: Option<f64>,
    /// How long an error of the reference lasts, s: readings closer than this are not independent. None: they are.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub correlation_time_s: Option<f64>,
}

impl Pose {
    /// The assumed reference where a configuration does not describe it: noise of 0.02 m and 0.02 rad, neither offset nor
    /// delay.
    pub(crate) fn assumed(rate_hz: f64) -> Self {
        Self {
            rate_hz,
            position_std_m: 0.02,
            heading_std_rad: 0.02,
            lever_arm_std_m: None,
            heading_offset_std_rad: None,
            delay_std_s: None,
            correlation_time_s: None,
        }
    }
}

/// `[[effect]]`: an effect of reality by id, with its parameters.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EffectTable {
    /// Identifier, such as `gyro.scale_factor`.
    pub id: String,
    /// Parameters by name; the unit stands in the name.
    #[serde(flatten)]
    pub parameters: BTreeMap<String, f64>,
}

/// `[validation]`: tests on the log of the fit, their results, and the range where the model is valid.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Validation {
    /// Whether the residuals are white at every averaging time, by the joint test.
    pub white: bool,
    /// Whether the 95 % profile interval of T is finite on both sides.
    pub identifiable: bool,
    /// Whether a model that failed was exported because the user said so.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub accepted_by_user: bool,
    /// p value of the joint whiteness test.
    pub joint_p_value: f64,
    /// Level at which it was judged.
    pub level: f64,
    /// Averaging times that were tested, s.
    pub averaging_times_s: Vec<f64>,
    /// Samples used.
    pub samples: u64,
    /// Sample rate of the log, Hz.
    pub sample_rate_hz: f64,
    /// First time since power-on that the log covers, s.
    pub valid_from_s: f64,
    /// Last time since power-on that the log covers, s.
    pub valid_to_s: f64,
    /// Lowest temperature in the log, °C.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub valid_from_temperature_c: Option<f64>,
    /// Highest temperature in the log, °C.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub valid_to_temperature_c: Option<f64>,
    /// 95 % profile interval of T, s; a side without bound is `inf`.
    pub time_constant_ci95_s: [f64; 2],
}

/// `[provenance]`.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Provenance {
    /// Name of the log, without its folder.
    pub log: String,
    /// SHA-256 of the log's bytes.
    pub log_sha256: String,
    /// Column that was fitted, as the file calls it.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub column: String,
    /// Version of gyroid.
    pub gyroid_version: String,
    /// The command that wrote the file.
    pub command: String,
    /// SHA-256 of this file with this value empty and line ends as \n; made when the file is written.
    #[serde(default)]
    pub checksum: String,
    /// Where the noise terms come from, if they were identified.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noise: Option<NoiseProvenance>,
}

/// `[provenance.noise]`: the log of `[gyro.noise.terms]`, which may be another than that of the fit.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NoiseProvenance {
    /// Name of the log, without its folder.
    pub log: String,
    /// SHA-256 of the log's bytes.
    pub log_sha256: String,
    /// Its column, as the file calls it.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub column: String,
    /// Version of gyroid.
    pub gyroid_version: String,
    /// The command that wrote the terms.
    pub command: String,
}

/// Turns the parser's error into ours, with line and key.
pub(super) fn toml_error(error: &toml::de::Error, text: &str, name: &str) -> Error {
    let mut out = Error::new(ErrorKind::Config, name, error.message().replace('\n', "; "));
    if let Some(span) = error.span() {
        let start = span.start.min(text.len());
        let line = text.as_bytes()[..start].iter().filter(|b| **b == b'\n').count() + 1;
        let shown = text.lines().nth(line - 1).unwrap_or("").trim();
        out = out.at(if shown.is_empty() { format!("line {line}") } else { format!("line {line}, `{shown}`") });
    }
    out.hint(meant(error.message()).unwrap_or_else(|| "correct the key, or write the file anew with gyroid fit".into()))
}

/// Letters at the beginning of two words that mean the same.
const STEM: usize = 4;

/// The hint for a key or a value that serde does not know: in its message that comes first, and after it those that it does.
fn meant(message: &str) -> Option<String> {
    if !message.starts_with("unknown ") {
        return None;
    }
    let mut quoted = message.split('`').skip(1).step_by(2);
    let (unknown, known) = (quoted.next()?, quoted.collect::<Vec<_>>());
    // drive is far from driving by its letters
    let stem = |word: &&str| word.get(..STEM).is_some_and(|stem| unknown.get(..STEM) == Some(stem));
    let meant = nearest(unknown, known.iter().copied()).or_else(|| known.iter().copied().find(stem));
    meant.map(|meant| format!("did you mean {meant}?"))
}
