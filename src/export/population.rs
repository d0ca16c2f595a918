//! From a population of logs to the configuration of the mean gyro, with how far one power-on lies from it.

use super::configuration::{ConfigurationOptions, on_base};
use crate::bias::{Discrete, WarmUp};
use crate::config::{Config, Covariance, Gyro, Noise, Provenance, Validation};
use crate::error::{Error, ErrorKind, Result};
use crate::population::{Population, Row};
use sha2::{Digest, Sha256};

/// Fewer logs say nothing useful of a spread: with two, the upper end of its interval is 30 times its estimate.
const FEWEST: usize = 3;

/// The configuration of `population`, the means of `rows` as its model, in a copy of `base` where there is one (as
/// [`super::configuration()`]). `turn_on_bias_std_rad_s` is the spread of C2, `warm_up_relative_std` that of C1 and T together; one
/// that the logs' own errors explain is left out. The covariance is that of the means. In `[provenance]` the log is the list of
/// logs, its hash that of the lines of their hashes, sorted.
///
/// # Errors
/// [`ErrorKind::TooShort`] if fewer than three logs count; [`crate::ErrorKind::Value`] if the sample time does not suit the scheme.
pub(crate) fn population_configuration(
    population: &Population,
    rows: &[Row],
    base: Option<&Config>,
    options: &ConfigurationOptions,
) -> Result<Config> {
    let counted: Vec<&Row> = population.counted.iter().filter_map(|i| rows.get(*i)).collect();
    let too_few = || {
        let found = format!("{} of {} logs of axis {} count", counted.len(), population.logs, population.axis);
        Error::new(ErrorKind::TooShort, "population", found)
            .hint(format!("a spread needs {FEWEST} logs that are fit for use: record more power-ons"))
    };
    if counted.len() < FEWEST {
        return Err(too_few());
    }
    let (Some(span), Some([c1_rad_s, c2_rad_s, time_constant_s])) = (&population.span, population.means(rows)) else {
        return Err(too_few());
    };
    let model = WarmUp::new(c1_rad_s, c2_rad_s, time_constant_s)?;
    let sample_time_s =
        options.sample_time_s.or(base.and_then(|b| b.sample_time_s)).unwrap_or(1.0 / span.sample_rate_hz);
    let positive = |std: f64| (std > 0.0).then_some(std);
    let time_constant = population.time_constant;
    let gyro = Gyro {
        c1_rad_s,
        c2_rad_s,
        time_constant_s,
        angle_random_walk_rad_sqrt_s: span.angle_random_walk_rad_sqrt_s,
        earth_rate_rad_s: counted.first().and_then(|r| r.earth_rate_rad_s),
        turn_on_bias_std_rad_s: population.c2.and_then(|p| positive(p.spread)),
        warm_up_relative_std: population.warm_up.and_then(|w| positive(w.relative_std)),
        cooling_time_constant_s: base.and_then(|b| b.gyro.as_ref()).and_then(|g| g.cooling_time_constant_s),
        covariance: Some(Covariance::from_matrix(&population.mean_covariance)),
        discrete: Some(Discrete::new(&model, sample_time_s, options.scheme)?),
        noise: span
            .rate_random_walk_rad_s_sqrt_s
            .map(|k| Noise { rate_random_walk_rad_s_sqrt_s: Some(k), ..Noise::default() }),
        temperature: None,
        last_run: None,
    };
    let white = counted.iter().all(|r| r.white == Some(true));
    let validation = Validation {
        white,
        identifiable: true,
        accepted_by_user: !white,
        joint_p_value: span.joint_p_value,
        level: span.level,
        averaging_times_s: span.averaging_times_s.clone(),
        samples: span.samples,
        sample_rate_hz: span.sample_rate_hz,
        valid_from_s: span.from_s,
        valid_to_s: span.to_s,
        valid_from_temperature_c: span.temperature_c.map(|t| t[0]),
        valid_to_temperature_c: span.temperature_c.map(|t| t[1]),
        time_constant_ci95_s: time_constant.map_or([time_constant_s; 2], |t| t.mean_ci95),
    };
    let names: Vec<&str> = counted.iter().map(|r| r.source.path.as_str()).collect();
    let mut hashes: Vec<&str> = counted.iter().map(|r| r.source.sha256.as_str()).collect();
    hashes.sort_unstable();
    let hash = Sha256::digest(hashes.iter().map(|h| format!("{h}\n")).collect::<String>().as_bytes());
    let provenance = Provenance {
        log: format!("{} logs: {}", names.len(), names.join(", ")),
        log_sha256: hash.iter().map(|b| format!("{b:02x}")).collect(),
        column: counted.first().and_then(|r| r.source.column.clone()).unwrap_or_default(),
        gyroid_version: options.version.clone(),
        command: options.command.clone(),
        ..Provenance::default()
    };
    Ok(on_base(base, sample_time_s, gyro, validation, provenance))
}
