//! A gyro at rest, nominal or with the effects of `[[effect]]`.

use super::gyro::GyroSensor;
use super::{Options, SOURCE, effects, rows, sample_time, start};
use crate::config::Config;
use crate::error::{Error, ErrorKind, Result};
use crate::model::{EffectSource, Scene};
use crate::progress;
use crate::signal::{Log, TimeAxis, increasing_times, names, since_power_on};

/// A log's step may differ from the stated sample time by this part of it: jitter, or rounding of its times.
const STEP_TOLERANCE: f64 = 0.01;

/// A nominal gyro at rest: `t_s` since power-on, `gyro_z_rad_s`, from `options.since_power_on_s` for `duration_s`.
///
/// # Errors
/// [`ErrorKind::Config`] if a table or the sample time is missing, or the configuration holds effects;
/// [`ErrorKind::Value`] if the duration is no positive time.
pub fn stationary(config: &Config, duration_s: f64, options: &Options) -> Result<Log> {
    lasting(config, duration_s, options, None)
}

/// As [`stationary`], with the effects of the configuration, which `effects` makes.
///
/// # Errors
/// As [`stationary`], and [`ErrorKind::Config`] if `effects` does not know one or one needs a temperature or a supply,
/// which only a log can give: [`stationary_like`].
pub fn stationary_with(config: &Config, duration_s: f64, options: &Options, effects: &dyn EffectSource) -> Result<Log> {
    lasting(config, duration_s, options, Some(effects))
}

/// The log that the configuration with its effects would have recorded at the rows of `inputs`: its times, temperature,
/// supply and time since power-on are copied, the gyro is simulated.
///
/// Time since power-on is the channel of that name; else, with a positive `options.since_power_on_s`, it counts from there at
/// the first row; else it is the log's own time.
///
/// # Errors
/// [`ErrorKind::Config`] as [`stationary_with`]; [`ErrorKind::Time`] if time does not run forward or begins before
/// power-on; [`ErrorKind::TooShort`] below two rows.
pub fn stationary_like(config: &Config, inputs: &Log, options: &Options, effects: &dyn EffectSource) -> Result<Log> {
    let scene = scene(config, inputs, options)?;
    let rates = rates(config, &scene, options, Some(effects))?;
    let mut log = Log::new(SOURCE, inputs.time.clone());
    let mut rates = Some(rates);
    for channel in &inputs.channels {
        match channel.name.as_str() {
            names::GYRO_Z => {
                if let Some(rates) = rates.take() {
                    log.push(names::GYRO_Z, rates)?;
                }
            }
            name @ (names::TEMPERATURE | names::SUPPLY | names::SINCE_POWER_ON) => {
                log.push(name, channel.values.clone())?;
            }
            _ => {}
        }
    }
    // a log without a gyro
    if let Some(rates) = rates {
        log.push(names::GYRO_Z, rates)?;
    }
    Ok(log)
}

fn lasting(config: &Config, duration_s: f64, options: &Options, effects: Option<&dyn EffectSource>) -> Result<Log> {
    let step_s = sample_time(config)?;
    let len = rows(duration_s, step_s)?;
    let time = TimeAxis::Uniform { start_s: start(options)?, step_s, len };
    let scene = bare(config, time.clone(), step_s, options)?;
    let mut log = Log::new(SOURCE, time);
    log.push(names::GYRO_Z, rates(config, &scene, options, effects)?)?;
    Ok(log)
}

/// Inputs to the effects of `config` in a recording at the rows of `log`: times since power-on as [`stationary_like`]
/// takes them, temperature and supply with their gaps bridged linearly, and the nominal model. Where it states no
/// repeatability, that is zero here.
///
/// # Errors
/// As [`stationary_like`].
pub(crate) fn scene(config: &Config, log: &Log, options: &Options) -> Result<Scene> {
    if log.len() < 2 {
        let found = format!("{} rows, and a recording needs two", log.len());
        return Err(Error::new(ErrorKind::TooShort, &log.source, found));
    }
    let offset_s = start(options)?;
    let times = increasing_times(log)?;
    let time = if log.get(names::SINCE_POWER_ON).is_some() {
        // the rows' distances are those of the log's own clock
        log.time.clone().shifted(since_power_on(log, offset_s)?[0] - times[0])
    } else if offset_s > 0.0 {
        log.time.clone().shifted(offset_s - times[0])
    } else {
        log.time.clone()
    };
    if time.at(0) < 0.0 {
        let found = format!("the first row is at {} s, before power-on", time.at(0));
        return Err(Error::new(ErrorKind::Time, &log.source, found)
            .at("row 1")
            .hint("state the time since power-on at the first row with --start-offset"));
    }
    let measured_s = time.median_step_s();
    let near = |s: &f64| (s / measured_s - 1.0).abs() <= STEP_TOLERANCE;
    let step_s = config.sample_time_s.filter(near).unwrap_or(measured_s);
    Ok(covered(bare(config, time, step_s, options)?, log))
}

/// Inputs to the gyro's effects in a drive at the rows of `inputs`, the first at `since_power_on_s`: the covariates are
/// the log's own.
pub(crate) fn scene_of_drive(config: &Config, inputs: &Log, since_power_on_s: f64, options: &Options) -> Result<Scene> {
    let time = inputs.time.clone().shifted(since_power_on_s - inputs.time.at(0));
    Ok(covered(bare(config, time, sample_time(config)?, options)?, inputs))
}

fn covered(mut scene: Scene, log: &Log) -> Scene {
    scene.temperature_c = log.get(names::TEMPERATURE).and_then(bridged);
    scene.supply_v = log.get(names::SUPPLY).and_then(bridged);
    scene
}

/// A scene without covariates.
pub(super) fn bare(config: &Config, time: TimeAxis, step_s: f64, options: &Options) -> Result<Scene> {
    let gyro = config.require_gyro()?;
    let warm_up = gyro.warm_up();
    let age_s = options.off_time_s.map(|off_s| gyro.restart(off_s)).transpose()?;
    Ok(Scene {
        time,
        step_s,
        temperature_c: None,
        power_on_temperature_c: None,
        supply_v: None,
        warm_up: age_s.map_or(warm_up, |restart| warm_up.seen_from(restart.age_s(warm_up.time_constant_s))),
        white_std_rad_s: gyro.angle_random_walk_rad_sqrt_s / step_s.sqrt(),
        turn_on_bias_std_rad_s: gyro.turn_on_bias_std_rad_s.unwrap_or(0.0),
        warm_up_relative_std: gyro.warm_up_relative_std.unwrap_or(0.0),
    })
}

fn rates(config: &Config, scene: &Scene, options: &Options, effects: Option<&dyn EffectSource>) -> Result<Vec<f64>> {
    let made = effects::of_gyro(config, scene, options, effects)?;
    let gyro = GyroSensor::new(config.require_gyro()?, scene.step_s, options)?;
    let mut gyro = if made.is_empty() { gyro } else { gyro.changed_by(made, scene.clone()) };
    let read = |i| {
        progress::tell(i, scene.len());
        gyro.read(0.0, scene.time.at(i)).reading_rad_s
    };
    Ok((0..scene.len()).map(read).collect())
}

/// Gaps bridged linearly by row, the ends held; none if there is no value at all.
fn bridged(values: &[f64]) -> Option<Vec<f64>> {
    let there: Vec<usize> = (0..values.len()).filter(|&i| values[i].is_finite()).collect();
    let (&first, &last) = (there.first()?, there.last()?);
    let mut out = values.to_vec();
    out[..first].fill(values[first]);
    out[last..].fill(values[last]);
    for pair in there.windows(2) {
        let (a, b) = (pair[0], pair[1]);
        let slope = (values[b] - values[a]) / (b - a) as f64;
        (a + 1..b).for_each(|i| out[i] = values[a] + slope * (i - a) as f64);
    }
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_are_bridged_and_ends_held() {
        let nan = f64::NAN;
        assert_eq!(bridged(&[nan, 1.0, nan, nan, 4.0, nan]).unwrap(), [1.0, 1.0, 2.0, 3.0, 4.0, 4.0]);
        assert_eq!(bridged(&[nan, nan]), None);
    }
}
