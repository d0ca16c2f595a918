//! ω - s (θ - θr) - q (θ - θr)²: the gyro without the part of its error that the temperature tells
//!
//! The rest is b, with its variation between power-ons and its walk: a warm-up model with C1 = 0 and C2 = b. The
//! uncertainty of e(θ) depends on θ. The filter is given the largest of the drive, so that it is never surer than the
//! fit was.

use super::results::Run;
use super::table::names;
use crate::bias::Thermal;
use crate::config::{Config, Covariance, Gyro};
use crate::error::{Error, ErrorKind, Result};
use crate::signal::{Log, bridged, names as channels};

/// A drive and a configuration of which the temperature has been taken out.
pub(super) struct Compensated {
    pub config: Config,
    pub log: Log,
    /// Part of each reading that the temperature tells and that was subtracted, rad/s.
    taken_rad_s: Vec<f64>,
    notes: Vec<String>,
}

/// Takes the temperature out where the configuration has `[gyro.temperature]`; `None` where it has not.
///
/// # Errors
/// [`ErrorKind::Column`] where the drive has no temperature, [`ErrorKind::Value`] where it is missing for long.
pub(super) fn compensated(config: &Config, log: &Log) -> Result<Option<Compensated>> {
    let Some(gyro) = config.gyro.as_ref() else { return Ok(None) };
    let Some(table) = gyro.temperature else { return Ok(None) };
    let temperature_c = log.get(channels::TEMPERATURE).ok_or_else(|| no_temperature(log))?;
    let temperature_c = bridged(channels::TEMPERATURE, &log.time, temperature_c).map_err(|e| e.named(&log.source))?;
    let model = table.thermal();
    let taken_rad_s: Vec<f64> = temperature_c.iter().map(|t| model.above_reference_rad_s(*t)).collect();
    let mut log = log.clone();
    for channel in log.channels.iter_mut().filter(|c| c.name == channels::GYRO_Z) {
        channel.values.iter_mut().zip(&taken_rad_s).for_each(|(rate, taken)| *rate -= taken);
    }
    let covariance = table.covariance.map(|c| {
        let c = c.to_matrix();
        let worst = temperature_c.iter().map(|t| model.variance_rad2_s2(&c, *t)).fold(0.0, f64::max);
        Covariance { c2_c2_rad2_s2: worst, ..Covariance::default() }
    });
    let left = Gyro {
        c1_rad_s: 0.0,
        c2_rad_s: model.bias_rad_s,
        warm_up_relative_std: None,
        covariance,
        discrete: None,
        temperature: None,
        ..gyro.clone()
    };
    let (low, high) = temperature_c.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), t| (l.min(*t), h.max(*t)));
    let mut notes = vec![format!("the gyro's error is by temperature, {low:.1} to {high:.1} °C in this drive")];
    notes.extend(outside_validity(config, &model, low, high));
    // a later time since power-on is no extrapolation of this model; the sample time may stand in the table that is gone
    let sample_time_s = config.sample_time_s.or(gyro.discrete.map(|d| d.sample_time_s));
    let config = Config { gyro: Some(left), sample_time_s, validation: None, ..config.clone() };
    Ok(Some(Compensated { config, log, taken_rad_s, notes }))
}

fn no_temperature(log: &Log) -> Error {
    let channel = channels::TEMPERATURE;
    let there: Vec<_> = log.channels.iter().map(|c| c.name.as_str()).collect();
    let found = format!(
        "no channel {channel:?}, and [gyro.temperature] of the configuration needs it; there are {}",
        there.join(", ")
    );
    Error::new(ErrorKind::Column, &log.source, found).hint(format!(
        "name the column that holds it: --map {channel}=COLUMN; or delete [gyro.temperature] (and [provenance]) from a copy of \
         the configuration: the gyro then warms up by elapsed time"
    ))
}

fn outside_validity(config: &Config, model: &Thermal, low: f64, high: f64) -> Option<String> {
    let valid = config.validation.as_ref()?;
    let (from, to) = valid.valid_from_temperature_c.zip(valid.valid_to_temperature_c)?;
    (low < from || high > to).then(|| {
        let change = [low, high].map(|t| model.error_rad_s(t) - model.error_rad_s(t.clamp(from, to)));
        let most = change.iter().fold(0.0f64, |m, c| m.max(c.abs()));
        format!("the model was fitted on {from:.1} to {to:.1} °C: beyond, it extrapolates, by up to {most:.1e} rad/s")
    })
}

impl Compensated {
    /// Gives the part that was taken off back to the gyro's error that a run reports.
    pub(crate) fn given_back(self, mut run: Run) -> Run {
        let smoothed = run.smoothed.iter_mut().flat_map(|s| &mut s.pose.channels);
        for channel in run.pose.channels.iter_mut().chain(smoothed).filter(|c| c.name == names::GYRO_ERROR) {
            channel.values.iter_mut().zip(&self.taken_rad_s).for_each(|(error, taken)| *error += taken);
        }
        run.summary.final_pose.gyro_error_rad_s.estimate += self.taken_rad_s.last().copied().unwrap_or(0.0);
        run.summary.notes.splice(0..0, self.notes);
        run
    }
}

#[cfg(test)]
mod tests {
    use super::super::{ErrorModel, RollingFilter, Settings, run};
    use super::*;
    use crate::config::{Temperature, TemperatureCovariance};
    use crate::simulate::{Course, Options, drive};

    const ROBOT: &str = "schema = 1\nkind = \"driving\"\nsample_time_s = 0.02\n\
         [gyro]\nc1_rad_s = 0.0\nc2_rad_s = 4e-3\ntime_constant_s = 240.0\nangle_random_walk_rad_sqrt_s = 1.5e-4\n\
         [vehicle]\nmass_kg = 9.5\nyaw_inertia_kg_m2 = 0.21\nhalf_track_m = 0.17\nwheel_radius_m = 0.05\n\
         wheel_inertia_kg_m2 = 0.0008\nviscous_friction_n_m_s = 0.0006\ntorque_noise_n_m_sqrt_s = 0.0004\n\
         [encoder]\nspeed_noise_std_rad_s = 0.02\n";
    const THERMAL: Thermal =
        Thermal { reference_c: 30.0, bias_rad_s: 4e-3, sensitivity_rad_s_k: 2e-4, curvature_rad_s_k2: 3e-6 };

    /// A drive whose gyro follows a temperature that goes up by 20 K and down again.
    fn driven() -> (Config, Log) {
        let plain = Config::parse(ROBOT, "robot.toml").unwrap();
        let mut log = drive(&plain, Course::Square, 120.0, &Options::from(5)).unwrap().log;
        let temperature: Vec<f64> =
            (0..log.len()).map(|i| 30.0 + 20.0 * (std::f64::consts::PI * log.time.at(i) / 120.0).sin()).collect();
        for channel in log.channels.iter_mut().filter(|c| c.name == channels::GYRO_Z) {
            let hot = temperature.iter().map(|t| THERMAL.above_reference_rad_s(*t));
            channel.values.iter_mut().zip(hot).for_each(|(rate, e)| *rate += e);
        }
        log.push(channels::TEMPERATURE, temperature).unwrap();
        let mut config = plain;
        let gyro = config.gyro.as_mut().unwrap();
        let std = 1e-5;
        gyro.temperature = Some(Temperature {
            reference_c: THERMAL.reference_c,
            bias_rad_s: THERMAL.bias_rad_s,
            sensitivity_rad_s_k: THERMAL.sensitivity_rad_s_k,
            curvature_rad_s_k2: Some(THERMAL.curvature_rad_s_k2),
            covariance: Some(TemperatureCovariance { bias_bias_rad2_s2: std * std, ..Default::default() }),
        });
        (config, log)
    }

    #[test]
    fn a_drive_by_temperature_is_the_drive_without_it() {
        let (config, log) = driven();
        let by_temperature = run(&config, &log, &Settings::default()).unwrap();
        // the same drive whose gyro has b alone, under a configuration that says so
        let Compensated { config: plain, log: constant, taken_rad_s, .. } =
            compensated(&config, &log).unwrap().unwrap();
        let known = run(&plain, &constant, &Settings::default()).unwrap();
        let column = |r: &Run, name| r.pose.require(name).unwrap().to_vec();
        assert_eq!(column(&by_temperature, channels::HEADING), column(&known, channels::HEADING));
        let errors = column(&by_temperature, names::GYRO_ERROR);
        for ((found, left), taken) in errors.iter().zip(column(&known, names::GYRO_ERROR)).zip(taken_rad_s) {
            assert!((found - left - taken).abs() < 1e-15);
        }
        assert!(by_temperature.summary.notes[0].contains("30.0 to 50.0"), "{:?}", by_temperature.summary.notes);
        // the error lies within five of its standard deviations of the truth everywhere
        let std = column(&by_temperature, names::GYRO_ERROR_STD);
        let temperature = log.require(channels::TEMPERATURE).unwrap();
        for ((e, s), t) in errors.iter().zip(std).zip(temperature) {
            assert!((e - THERMAL.error_rad_s(*t)).abs() < 5.0 * s, "{e} {s} at {t}");
        }
        // by elapsed time the filter would take 20 K for a constant, and be wrong by 5 mrad/s
        let mut blind = config.clone();
        blind.gyro.as_mut().unwrap().temperature = None;
        let blind = run(&blind, &log, &Settings::default()).unwrap();
        let nis = |r: &Run| r.summary.consistency.nis_mean;
        assert!(nis(&by_temperature) < nis(&blind), "{} {}", nis(&by_temperature), nis(&blind));
    }

    #[test]
    fn a_drive_without_temperature_is_refused_and_never_taken_as_constant() {
        let (config, mut log) = driven();
        log.channels.retain(|c| c.name != channels::TEMPERATURE);
        let error = run(&config, &log, &Settings::default()).unwrap_err().to_string();
        assert!(error.contains("temperature_c") && error.contains("[gyro.temperature]"), "{error}");
        // step by step nobody hands a temperature over
        assert!(RollingFilter::new(&config, &Settings::default(), 0.0).is_err());
        let off = Settings { error_model: ErrorModel::Off, ..Settings::default() };
        assert!(run(&config, &log, &off).is_ok(), "without an error model there is nothing to compensate");
    }
}
