//! The filter over a log.
//!
//! Row k's readings are taken in at its time; row k's torques then act until the next row's. Missing readings (NaN) are
//! left out, so that sensors may have rates of their own. Steps may be uneven.

use super::consistency::{Consistency, Gatherer};
use super::filter::{Input, RollingFilter, STATES, Sensor, state};
use super::reference::{ErrorSums, Reference, ReferenceErrors};
use super::{ErrorModel, Settings};
use crate::config::Config;
use crate::error::{Error, ErrorKind, Result};
use crate::signal::{Log, TimeAxis, increasing_times, names as channels, since_power_on};
use crate::vehicle::Rolling;
use serde::Serialize;

/// Channels of [`Run::pose`] beside `x_m`, `y_m` and `heading_rad`.
pub mod names {
    /// Forward speed, m/s.
    pub const SPEED: &str = "speed_m_s";
    /// Yaw rate, rad/s.
    pub const YAW_RATE: &str = "yaw_rate_rad_s";
    /// Gyro error, rad/s.
    pub const GYRO_ERROR: &str = "gyro_error_rad_s";
    /// Standard deviation of x, m.
    pub const X_STD: &str = "x_std_m";
    /// Standard deviation of y, m.
    pub const Y_STD: &str = "y_std_m";
    /// Standard deviation of the heading, rad.
    pub const HEADING_STD: &str = "heading_std_rad";
    /// Standard deviation of the speed, m/s.
    pub const SPEED_STD: &str = "speed_std_m_s";
    /// Standard deviation of the yaw rate, rad/s.
    pub const YAW_RATE_STD: &str = "yaw_rate_std_rad_s";
    /// Standard deviation of the gyro error, rad/s.
    pub const GYRO_ERROR_STD: &str = "gyro_error_std_rad_s";
    /// Normalised innovation squared of the row's readings together.
    pub const NIS: &str = "nis";
}

/// A filter's pass over a log.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// What came out, in numbers.
    pub summary: Summary,
    /// The estimate at each row, after its readings: pose, velocities, gyro error, their standard deviations, NIS.
    pub pose: Log,
}

/// A run in numbers.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// Rows of the log.
    pub rows: u64,
    /// From the first row to the last, s.
    pub span_s: f64,
    /// Time since power-on at the first row, s.
    pub since_power_on_s: f64,
    /// Whether the log lacks the time since power-on, so that it was taken from the settings.
    pub since_power_on_assumed: bool,
    /// Whether the log's torques drove the prediction; else accelerations were taken as unknown and white.
    pub torques_used: bool,
    /// Densities of unknown accelerations, (m/s²)²/Hz and (rad/s²)²/Hz, where rows had no torques.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub acceleration_densities: Option<[f64; 2]>,
    /// NIS and whiteness of the innovations.
    pub consistency: Consistency,
    /// The pose at the last row.
    pub final_pose: FinalPose,
    /// Errors against the reference pose, where the log has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reference: Option<ReferenceErrors>,
    /// What the user should know.
    pub notes: Vec<String>,
}

/// An estimate with its standard deviation.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Estimate {
    /// The value.
    pub estimate: f64,
    /// Its standard deviation.
    pub std: f64,
}

/// Pose and gyro error at the end.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct FinalPose {
    /// x, m.
    pub x_m: Estimate,
    /// y, m.
    pub y_m: Estimate,
    /// Heading, rad.
    pub heading_rad: Estimate,
    /// Gyro error, rad/s.
    pub gyro_error_rad_s: Estimate,
}

/// Runs the filter over `log`.
///
/// Torques drive the prediction where the log has them. Rows without get unknown accelerations, white with the
/// densities of `settings`, or else those of the log's own motion: with D(δ) the mean square change of the speed that
/// the encoders show over a lag δ of about 0.2 s, a white acceleration of density q gives D = q δ + 2 σ², σ² being the
/// encoders' noise in that speed; so q = (D - 2 σ²)/δ, and likewise for the yaw rate.
///
/// # Errors
/// [`ErrorKind::Config`] if a table is missing, or the configuration holds effects; [`ErrorKind::Column`] if gyro or
/// wheel speeds are missing, or the pose with `use_pose`; [`ErrorKind::Time`] if time does not run forward;
/// [`ErrorKind::TooShort`] with fewer than two rows; [`ErrorKind::Numeric`] with the row where the state overflows.
pub fn run(config: &Config, log: &Log, settings: &Settings) -> Result<Run> {
    refuse_effects(config)?;
    if log.len() < 2 {
        let found = format!("{} rows, and a drive needs two", log.len());
        return Err(Error::new(ErrorKind::TooShort, &log.source, found).mend("give a longer log"));
    }
    let times = increasing_times(log)?;
    let start_s = since_power_on(log, settings.since_power_on_s)?[0];
    let assumed = log.get(channels::SINCE_POWER_ON).is_none();
    let (mut filter, mut notes) = RollingFilter::new(config, settings, start_s)?;
    if assumed && settings.error_model == ErrorModel::WarmUp {
        let channel = channels::SINCE_POWER_ON;
        notes.push(format!("the log has no {channel}: taken to begin {start_s} s after power-on (--start-offset)"));
    }
    notes.extend(outside_validity(config, start_s, start_s + log.time.span_s()));
    let readings = readings(log, config, settings)?;
    let inputs = Inputs::new(config, log, &times, settings)?;
    let reference = Reference::new(log, config.pose.as_ref());
    if let Some((row, pose)) = reference.as_ref().and_then(Reference::first) {
        let std = config.pose.map_or([0.0; 2], |p| [p.position_std_m, p.heading_std_rad]);
        if settings.start_at_reference {
            filter = filter.starting_at(pose, std);
        } else if row == 0 && pose[0].hypot(pose[1]) > 0.01 + 5.0 * std[0] {
            notes.push(format!(
                "the reference begins {:.2} m from the origin: compare with --start-at-reference",
                pose[0].hypot(pose[1])
            ));
        }
    }

    let mut gatherer = Gatherer::new();
    let mut errors = ErrorSums::default();
    let mut table = Table::new(log.len());
    for k in 0..times.len() {
        for (sensor, values) in &readings {
            if let Some(innovation) = filter.update(*sensor, values[k]) {
                gatherer.add(*sensor, &innovation);
            }
        }
        table.push(&filter, gatherer.end_row());
        if !filter.mean().iter().all(|v| v.is_finite()) {
            return Err(Error::new(ErrorKind::Numeric, &log.source, "the filter's state is no longer finite")
                .at(format!("row {}", k + 1))
                .mend("look for absurd readings in this row and those before"));
        }
        if let Some(reference) = &reference {
            let m = filter.mean();
            let pose = [m[state::X], m[state::Y], m[state::HEADING]];
            if reference.at(k).is_some() {
                let covariance = filter.covariance().fixed_view::<3, 3>(state::X, state::X).into_owned();
                errors.add(reference, k, pose, Some(covariance));
            }
        }
        if let Some(next) = times.get(k + 1) {
            filter.predict(inputs.at(k), next - times[k]);
        }
    }
    let consistency = gatherer.finish();
    if consistency.readings == 0 {
        return Err(Error::new(ErrorKind::Value, &log.source, "no reading of gyro or wheels is a finite number")
            .mend("check the columns: gyroid inspect LOG"));
    }
    let summary = Summary {
        rows: log.len() as u64,
        span_s: log.time.span_s(),
        since_power_on_s: start_s,
        since_power_on_assumed: assumed,
        torques_used: inputs.torques.is_some(),
        acceleration_densities: inputs.densities,
        consistency,
        final_pose: final_pose(&filter),
        reference: errors.finish(),
        notes,
    };
    Ok(Run { summary, pose: table.finish(&log.source, log.time.clone())? })
}

/// What to know where the drive leaves the span of time that the model was fitted on.
fn outside_validity(config: &Config, from_s: f64, to_s: f64) -> Option<String> {
    let valid = config.validation.as_ref()?;
    let (start, end) = (valid.valid_from_s, valid.valid_to_s);
    (from_s < start || to_s > end).then(|| {
        format!(
            "the drive lasts from {from_s:.0} s to {to_s:.0} s after power-on, and the model was fitted on \
             {start:.0} s to {end:.0} s: beyond, it extrapolates"
        )
    })
}

fn refuse_effects(config: &Config) -> Result<()> {
    if config.effects.is_empty() {
        return Ok(());
    }
    let ids: Vec<_> = config.effects.iter().map(|e| e.id.as_str()).collect();
    let found = format!("this version's filter knows no effects, and the file has {}", ids.join(", "));
    Err(Error::new(ErrorKind::Config, "configuration", found)
        .at("`[[effect]]`")
        .mend("delete the tables [[effect]] to navigate with the nominal robot"))
}

/// The sensors to be read, with their columns.
fn readings<'a>(log: &'a Log, config: &Config, settings: &Settings) -> Result<Vec<(Sensor, &'a [f64])>> {
    let mut wanted = vec![
        (Sensor::Gyro, channels::GYRO_Z),
        (Sensor::WheelLeft, channels::WHEEL_LEFT),
        (Sensor::WheelRight, channels::WHEEL_RIGHT),
    ];
    if settings.use_pose {
        if config.pose.is_none() {
            return Err(Error::new(ErrorKind::Config, "configuration", "the table [pose] is missing")
                .mend("add it with the reference's standard deviations, or do not use the pose"));
        }
        wanted.extend([
            (Sensor::PoseX, channels::X),
            (Sensor::PoseY, channels::Y),
            (Sensor::PoseHeading, channels::HEADING),
        ]);
    }
    wanted.into_iter().map(|(sensor, name)| Ok((sensor, log.require(name)?))).collect()
}

/// What drives each row's prediction.
struct Inputs<'a> {
    torques: Option<[&'a [f64]; 2]>,
    densities: Option<[f64; 2]>,
}

impl<'a> Inputs<'a> {
    fn new(config: &Config, log: &'a Log, times: &[f64], settings: &Settings) -> Result<Self> {
        let torques = log.get(channels::TORQUE_LEFT).zip(log.get(channels::TORQUE_RIGHT)).map(|(l, r)| [l, r]);
        let torques = torques.filter(|[l, r]| l.iter().zip(*r).any(|(l, r)| l.is_finite() && r.is_finite()));
        let whole = torques.is_some_and(|t| t.iter().all(|side| side.iter().all(|v| v.is_finite())));
        let densities = match (whole, settings.acceleration_densities) {
            (true, _) => None,
            (false, Some(given)) if given.iter().all(|d| d.is_finite() && *d >= 0.0) => Some(given),
            (false, Some(given)) => {
                let found = format!("{given:?} are no densities");
                return Err(Error::new(ErrorKind::Value, "navigation", found).at("acceleration densities"));
            }
            (false, None) => Some(acceleration_densities(config, log, times)?),
        };
        Ok(Self { torques, densities })
    }

    fn at(&self, k: usize) -> Input {
        let torques = self.torques.map(|[left, right]| [left[k], right[k]]);
        match torques.filter(|t| t.iter().all(|v| v.is_finite())) {
            Some(torques) => Input::Torques(torques),
            None => Input::Accelerations(self.densities.unwrap_or_default()),
        }
    }
}

/// Lag over which the encoders' speeds are compared, s.
const LAG_S: f64 = 0.2;

/// Densities under which unknown accelerations are never taken: 1 mm/s², 1 mrad/s² in 1 Hz.
const DENSITY_FLOOR: f64 = 1e-6;

/// Densities of white accelerations that would change the encoders' speeds as much as they do (see [`run`]).
fn acceleration_densities(config: &Config, log: &Log, times: &[f64]) -> Result<[f64; 2]> {
    let robot = Rolling::new(config.require_vehicle()?);
    let [left, right] = [log.require(channels::WHEEL_LEFT)?, log.require(channels::WHEEL_RIGHT)?];
    let noise = config.require_encoder()?.speed_noise_std_rad_s;
    // half the sum and half the difference of two wheels: half the variance of one, times gains squared
    let by_wheel = robot.speed_and_yaw_rate([0.0, 1.0]);
    let variance = by_wheel.map(|gain| 2.0 * gain * gain * noise * noise);
    let lag = ((LAG_S / log.time.median_step_s()).round() as usize).clamp(1, times.len() - 1);
    let velocity = |k: usize| robot.speed_and_yaw_rate([left[k], right[k]]);
    let (mut sums, mut span, mut pairs) = ([0.0; 2], 0.0, 0.0);
    for k in lag..times.len() {
        let (before, after) = (velocity(k - lag), velocity(k));
        let change = [after[0] - before[0], after[1] - before[1]];
        if change.iter().all(|c| c.is_finite()) {
            (0..2).for_each(|i| sums[i] += change[i] * change[i]);
            span += times[k] - times[k - lag];
            pairs += 1.0;
        }
    }
    if pairs == 0.0 {
        return Err(Error::new(ErrorKind::Value, &log.source, "neither torques nor pairs of wheel speeds to go by")
            .mend("give a log with torques or with both wheel speeds in the same rows"));
    }
    Ok(std::array::from_fn(|i| ((sums[i] - 2.0 * variance[i] * pairs) / span).max(DENSITY_FLOOR)))
}

fn final_pose(filter: &RollingFilter) -> FinalPose {
    let (mean, std) = (filter.mean(), filter.std());
    let of = |i: usize| Estimate { estimate: mean[i], std: std[i] };
    FinalPose {
        x_m: of(state::X),
        y_m: of(state::Y),
        heading_rad: of(state::HEADING),
        gyro_error_rad_s: of(state::GYRO_ERROR),
    }
}

/// States that are written, with the names of value and standard deviation.
const COLUMNS: [(usize, &str, &str); 6] = [
    (state::X, channels::X, names::X_STD),
    (state::Y, channels::Y, names::Y_STD),
    (state::HEADING, channels::HEADING, names::HEADING_STD),
    (state::SPEED, names::SPEED, names::SPEED_STD),
    (state::YAW_RATE, names::YAW_RATE, names::YAW_RATE_STD),
    (state::GYRO_ERROR, names::GYRO_ERROR, names::GYRO_ERROR_STD),
];

/// The output, column by column.
struct Table {
    values: [Vec<f64>; COLUMNS.len()],
    std: [Vec<f64>; COLUMNS.len()],
    nis: Vec<f64>,
}

impl Table {
    fn new(len: usize) -> Self {
        let columns = || std::array::from_fn(|_| Vec::with_capacity(len));
        Self { values: columns(), std: columns(), nis: Vec::with_capacity(len) }
    }

    fn push(&mut self, filter: &RollingFilter, nis: f64) {
        let (mean, std): (_, nalgebra::SVector<f64, STATES>) = (filter.mean(), filter.std());
        for (at, (i, ..)) in COLUMNS.iter().enumerate() {
            self.values[at].push(mean[*i]);
            self.std[at].push(std[*i]);
        }
        self.nis.push(nis);
    }

    fn finish(self, source: &str, time: TimeAxis) -> Result<Log> {
        let mut log = Log::new(source, time);
        for (values, (_, name, _)) in self.values.into_iter().zip(COLUMNS) {
            log.push(name, values)?;
        }
        for (values, (_, _, name)) in self.std.into_iter().zip(COLUMNS) {
            log.push(name, values)?;
        }
        log.push(names::NIS, self.nis)?;
        Ok(log)
    }
}
