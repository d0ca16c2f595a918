//! From a validated fit to the configuration that filter, simulator and gap read.

use super::noise::coloured;
use crate::bias::{Discrete, Scheme};
use crate::config::{
    Config, Covariance, Gyro, Kind, Noise, Provenance, SCHEMA, Temperature, TemperatureCovariance, Validation,
};
use crate::error::Result;
use crate::report::{FitReport, Verdict};

/// How the model is discretised and what is written beside it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ConfigurationOptions {
    /// Discretisation.
    pub scheme: Scheme,
    /// The filter's sample time, s; by default the base's, else the log's.
    pub sample_time_s: Option<f64>,
    /// The command that asked for it.
    pub command: String,
    /// Version of the program.
    pub version: String,
}

/// The configuration of a fit, in a copy of `base` where there is one: `[gyro]`, `[validation]` and `[provenance]` are
/// new, everything else is the base's. A model by temperature ([`FitReport::against`]) is written as
/// `[gyro.temperature]` beside that by elapsed time. The base's spread from one power-on to the next
/// (`turn_on_bias_std_rad_s`, `warm_up_relative_std`) and its cooling (`cooling_time_constant_s`) stay, because one log
/// cannot tell them. Its rotation of the Earth does not: it belongs to the place of its log.
///
/// # Errors
/// [`crate::ErrorKind::Value`] if the sample time does not suit the scheme.
pub fn configuration(report: &FitReport, base: Option<&Config>, options: &ConfigurationOptions) -> Result<Config> {
    let fit = &report.fit;
    let log_step_s = 1.0 / fit.sample_rate_hz;
    let sample_time_s = options.sample_time_s.or(base.and_then(|b| b.sample_time_s)).unwrap_or(log_step_s);
    let model = fit.model();
    let old = base.and_then(|b| b.gyro.as_ref());
    let thermal = report.thermal();
    // the noise is what the model that is used leaves
    let noise = thermal.map_or(&fit.noise, |t| &t.noise);
    let walk = (noise.rate_random_walk_probability > 0.5).then_some(noise.rate_random_walk_rad_s_sqrt_s);
    let gyro = Gyro {
        c1_rad_s: model.c1_rad_s,
        c2_rad_s: model.c2_rad_s,
        time_constant_s: model.time_constant_s,
        angle_random_walk_rad_sqrt_s: noise.angle_random_walk_rad_sqrt_s,
        earth_rate_rad_s: report.earth.map(|e| e.vertical_rad_s),
        turn_on_bias_std_rad_s: old.and_then(|g| g.turn_on_bias_std_rad_s),
        warm_up_relative_std: old.and_then(|g| g.warm_up_relative_std),
        cooling_time_constant_s: old.and_then(|g| g.cooling_time_constant_s),
        covariance: Some(Covariance::from_matrix(&fit.covariance)),
        discrete: Some(Discrete::new(&model, sample_time_s, options.scheme)?),
        noise: (walk.is_some() || !fit.colour.is_empty())
            .then(|| Noise { rate_random_walk_rad_s_sqrt_s: walk, ..coloured(&fit.colour) }),
        temperature: thermal.map(|t| Temperature {
            reference_c: t.reference_c,
            bias_rad_s: t.bias_rad_s.estimate,
            sensitivity_rad_s_k: t.sensitivity_rad_s_k.estimate,
            curvature_rad_s_k2: t.curvature_rad_s_k2.map(|q| q.estimate),
            covariance: Some(TemperatureCovariance::from_matrix(&t.covariance)),
        }),
        // the log that was fitted was a run of its own: what the base says of the last one is past
        last_run: None,
    };
    let validation = Validation {
        white: report.validation.white,
        identifiable: fit.identifiable,
        accepted_by_user: report.verdict() != Verdict::FitForUse,
        joint_p_value: report.validation.joint_p_value,
        level: report.validation.level,
        averaging_times_s: report.validation.levels.iter().map(|l| l.averaging_time_s).collect(),
        samples: fit.samples as u64,
        sample_rate_hz: fit.sample_rate_hz,
        valid_from_s: fit.first_s,
        valid_to_s: fit.first_s + fit.span_s,
        valid_from_temperature_c: report.log.temperature_c.map(|t| t[0]),
        valid_to_temperature_c: report.log.temperature_c.map(|t| t[1]),
        time_constant_ci95_s: fit.time_constant_s.ci95,
    };
    let provenance = Provenance {
        log: report.log.name.clone(),
        log_sha256: report.log.sha256.clone(),
        column: report.log.column.clone(),
        gyroid_version: options.version.clone(),
        command: options.command.clone(),
        checksum: String::new(),
        noise: None,
    };
    Ok(on_base(base, sample_time_s, gyro, validation, provenance))
}

/// The configuration of a gyro, with the robot's tables from `base`.
pub(super) fn on_base(
    base: Option<&Config>,
    sample_time_s: f64,
    gyro: Gyro,
    validation: Validation,
    provenance: Provenance,
) -> Config {
    Config {
        schema: SCHEMA,
        kind: base.map_or(Kind::Stationary, |b| if b.vehicle.is_some() { Kind::Driving } else { b.kind }),
        sample_time_s: Some(sample_time_s),
        gyro: Some(gyro),
        vehicle: base.and_then(|b| b.vehicle),
        traction: base.and_then(|b| b.traction),
        encoder: base.and_then(|b| b.encoder),
        pose: base.and_then(|b| b.pose),
        effects: base.map(|b| b.effects.clone()).unwrap_or_default(),
        custom_effects: base.map(|b| b.custom_effects.clone()).unwrap_or_default(),
        validation: Some(validation),
        provenance: Some(provenance),
    }
}
